//! `imp verify`

use std::io::Read;
use std::time::Instant;

use serde_json::json;

use super::arguments::Verify;
use super::output;
use super::progress::TerminalProgress;
use crate::diagnostic::{Code, Diagnostic, Sources};
use crate::polygonize::{Component, Verified, VerifyError};

/// Larger files are no certificates.
const LARGEST: u64 = 256_000_000;

/// How many places are named in which nothing is proven.
const NAMED: usize = 3;

/// Proves again what a certificate claims; fails with an exit code.
pub(super) fn verify(command: &Verify) -> Result<(), u8> {
    let begun = Instant::now();
    let fail = |code, message: String| {
        let error = Diagnostic::error(code, message);
        output::report(&[error], &Sources::default(), &command.common)
    };
    let name = command.file.display();
    let text = read(command)
        .map_err(|error| fail(Code::CannotRead, format!("cannot read {name}: {error}")))?;
    let progress = TerminalProgress::new(command.common.quiet);
    let verified = crate::polygonize::verify(&text, &progress);
    progress.clear();
    let verified = verified.map_err(|error| {
        let code = match error {
            VerifyError::Cancelled => Code::Cancelled,
            _ => Code::NotVerified,
        };
        fail(code, format!("{name} is not accepted: {error}"))
    })?;
    output::data(&match command.common.json {
        true => as_json(&verified).to_string(),
        false => as_text(&verified, begun),
    });
    Ok(())
}

/// The text of the file; bytes that are no text make it no certificate.
fn read(command: &Verify) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    if command.file.as_os_str() == "-" {
        std::io::stdin().take(LARGEST).read_to_end(&mut bytes)?;
    } else {
        let file = std::fs::File::open(&command.file)?;
        file.take(LARGEST).read_to_end(&mut bytes)?;
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// What was proven, in lines.
fn as_text(verified: &Verified, begun: Instant) -> String {
    let dimension = verified.bounds.dimension;
    let sides = verified.bounds.sides();
    let sides: Vec<String> = sides
        .map(|(low, high)| format!("{low:?}..{high:?}"))
        .collect();
    let mut lines = vec![
        format!("field       {} nodes in R{dimension}", verified.nodes),
        format!("box         {}", sides.join(", ")),
        format!(
            "cells       {} without a zero, {} by their normals, {} undecided",
            verified.decided,
            verified.tested,
            verified.undecided.len()
        ),
    ];
    if verified.proven {
        lines.push(format!("components  {}", verified.components.len()));
        lines.extend(
            verified
                .components
                .iter()
                .map(|own| format!("            {}", named(own, dimension))),
        );
        lines.push("topology    proven".to_owned());
    } else {
        let places = verified.undecided.iter().take(NAMED);
        let places = places.map(|place| {
            let coordinates = place.to_array();
            let coordinates = coordinates[..dimension]
                .iter()
                .map(|own| format!("{own:.6}"));
            format!("({})", coordinates.collect::<Vec<_>>().join(", "))
        });
        let places = places.collect::<Vec<_>>().join(", ");
        lines.push(format!(
            "topology    not proven, and not claimed to be: see {places}"
        ));
    }
    lines.push(format!(
        "time        {:.2} s",
        begun.elapsed().as_secs_f64()
    ));
    lines.join("\n")
}

/// A component in words.
fn named(component: &Component, dimension: usize) -> String {
    match (dimension, component.boundaries, component.genus()) {
        (2, 0, _) => "a closed curve".to_owned(),
        (2, ..) => "a curve from side to side of the box".to_owned(),
        (_, 0, Some(genus)) => format!("a closed surface of genus {genus}"),
        (_, loops, Some(genus)) => {
            format!("a surface of genus {genus} with {loops} closed curves in the sides of the box")
        }
        (_, loops, None) => {
            let euler = component.euler;
            format!("a surface of Euler characteristic {euler} with {loops} boundaries")
        }
    }
}

/// The same as one object.
fn as_json(verified: &Verified) -> serde_json::Value {
    let dimension = verified.bounds.dimension;
    let components = verified.components.iter().map(|own| {
        json!({
            "euler": own.euler,
            "boundaries": own.boundaries,
            "genus": own.genus().filter(|_| dimension == 3),
        })
    });
    let undecided = verified
        .undecided
        .iter()
        .map(|place| place.to_array()[..dimension].to_vec());
    json!({
        "proven": verified.proven,
        "dimension": dimension,
        "nodes": verified.nodes,
        "bounds": verified.bounds.sides().map(|(low, high)| json!([low, high])).collect::<Vec<_>>(),
        "decided": verified.decided,
        "tested": verified.tested,
        "undecided": undecided.collect::<Vec<_>>(),
        "components": components.collect::<Vec<_>>(),
    })
}
