//! OFF, the object file format of Geomview: text with vertices, then polygons of their numbers
//! from 0. What is written reads back exactly.

use std::io::{self, Write};

use super::assembly::Assembly;
use super::reading::{Lines, Wrong, counted, number, quoted_bytes, vector, whole};
use crate::geometry::Mesh;

/// `OFF`, the numbers of vertices, faces and edges (0: nobody counts them), then vertices and
/// triangles. Normals are left out, since many programs do not know the header `NOFF`.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    writeln!(output, "OFF")?;
    writeln!(
        output,
        "{} {} 0",
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for position in &mesh.positions {
        writeln!(output, "{:?} {:?} {:?}", position.x, position.y, position.z)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(output, "3 {a} {b} {c}")?;
    }
    Ok(())
}

/// The mesh of a text that begins with `OFF`, with `C`, `N` and `ST` before it where vertices have
/// colours, normals and texture coordinates; or with the three numbers at once. Colours and texture
/// coordinates are left aside. Costs time and memory in proportion to the content.
pub(super) fn read_mesh(content: &[u8]) -> Result<Mesh, Wrong> {
    let mut lines = Lines::new(content);
    let mut words = Vec::new();
    lines.next_words(&mut words, true);
    let with_normals = read_keyword(&mut words).map_err(|message| lines.wrong(message))?;
    if words.is_empty() {
        lines.next_words(&mut words, true);
    }
    let [vertices, faces] = counts(&words).map_err(|message| lines.wrong(message))?;
    // A vertex takes six bytes at least and a face eight, with what separates them.
    let least = vertices
        .saturating_mul(6)
        .saturating_add(faces.saturating_mul(8));
    let there = lines.rest().len() as u64 + 1;
    if least > there {
        return Err(lines.wrong(format!(
            "{vertices} vertices and {faces} faces take at least {least} bytes, but after this \
             line there are {}",
            there - 1
        )));
    }
    let mut mesh = Assembly::default();
    for _ in 0..vertices {
        require(&mut lines, &mut words, vertices, "vertices")?;
        read_vertex(&words, with_normals, &mut mesh).map_err(|message| lines.wrong(message))?;
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        require(&mut lines, &mut words, faces, "faces")?;
        read_face(&words, &mut corners)
            .and_then(|()| mesh.polygon(&corners, mesh.vertices()))
            .map_err(|message| lines.wrong(message))?;
    }
    if lines.next_words(&mut words, true) {
        let message = "more after the last face; expected the end of the file";
        return Err(lines.wrong(message));
    }
    mesh.finish().map_err(|message| lines.wrong(message))
}

/// Takes the keyword from the words, if there is one; tells whether vertices have normals.
fn read_keyword(words: &mut Vec<&[u8]>) -> Result<bool, String> {
    let Some(&first) = words.first() else {
        return Err("the file is empty; expected `OFF`".into());
    };
    if first[0].is_ascii_digit() {
        return Ok(false);
    }
    let unknown = || format!("{}; expected `OFF`", quoted_bytes(first));
    let rest = first.strip_prefix(b"ST").unwrap_or(first);
    let rest = rest.strip_prefix(b"C").unwrap_or(rest);
    let (with_normals, rest) = match rest.strip_prefix(b"N") {
        Some(rest) => (true, rest),
        None => (false, rest),
    };
    let rest = rest.strip_prefix(b"OFF").ok_or_else(unknown)?;
    if words.get(1).is_some_and(|word| *word == b"BINARY") {
        return Err("binary OFF, which is not read; expected a text".into());
    }
    // Collections exist whose files lack the line break after the keyword.
    match rest.first() {
        None => drop(words.remove(0)),
        Some(byte) if byte.is_ascii_digit() => words[0] = rest,
        Some(_) => return Err(unknown()),
    }
    Ok(with_normals)
}

/// The numbers of vertices and faces; that of edges may be missing.
fn counts(words: &[&[u8]]) -> Result<[u64; 2], String> {
    match words {
        [vertices, faces] | [vertices, faces, _] => Ok([whole(vertices)?, whole(faces)?]),
        _ => Err(format!(
            "{}; expected the numbers of vertices, faces and edges",
            counted(words.len(), "word")
        )),
    }
}

/// Goes to the next line, of which there have to be so many.
fn require<'a>(
    lines: &mut Lines<'a>,
    words: &mut Vec<&'a [u8]>,
    count: u64,
    what: &str,
) -> Result<(), Wrong> {
    match lines.next_words(words, true) {
        true => Ok(()),
        false => Err(lines.wrong(format!("the file ends; expected {count} lines of {what}"))),
    }
}

/// A position, a normal if there are normals, and further numbers.
fn read_vertex(words: &[&[u8]], with_normals: bool, mesh: &mut Assembly) -> Result<(), String> {
    mesh.vertex(vector(words)?)?;
    let rest = &words[3..];
    let rest = match with_normals {
        true => {
            mesh.normal(vector(rest)?)?;
            &rest[3..]
        }
        false => rest,
    };
    rest.iter().try_for_each(|word| number(word).map(drop))
}

/// The number of corners, the corners, and perhaps a colour.
fn read_face(words: &[&[u8]], corners: &mut Vec<u32>) -> Result<(), String> {
    corners.clear();
    let [count, rest @ ..] = words else {
        return Ok(());
    };
    let count: usize = whole(count)?;
    if count > rest.len() {
        let found = counted(rest.len(), "number");
        return Err(format!(
            "{found} after the number of corners; expected at least {count}"
        ));
    }
    for corner in &rest[..count] {
        corners.push(whole(corner)?);
    }
    rest[count..]
        .iter()
        .try_for_each(|word| number(word).map(drop))
}
