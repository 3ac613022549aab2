//! What a field of 7,000 operations takes in memory, by tier, and whether fields that are dropped
//! leave something behind. Resident memory as the system counts it, so on Linux only.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

#[path = "../tests/engine_common/fields.rs"]
mod fields;

use fields::Example;
use glam::DVec3;
use imp::engine::{CompiledField, Field, Program, Tier};
use std::sync::Arc;

/// How many equal fields are held at a time: their sum is large against what the allocator keeps.
const HELD: usize = 24;

/// How many fields are made and dropped.
const DROPPED: usize = 10_000;

/// Kilobytes of this process in memory (proc(5), statm; pages of 4 kB).
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split(' ').nth(1)?.parse().ok()?;
    Some(4 * pages)
}

fn field(example: &Example, tier: Tier) -> CompiledField {
    let program = Program::with_tier(&example.graph, &[example.root], 3, tier);
    CompiledField::new(Arc::new(program), example.q.clone())
}

fn main() {
    let Some(_) = resident() else {
        println!("this system has no /proc/self/statm: nothing to measure");
        return;
    };
    // 7 operations a sphere: three differences, squares, two sums, a root, a difference, a minimum.
    let example = fields::spheres(636);
    let words: Vec<String> = std::env::args().collect();
    if let [_, word, name, what] = &words[..]
        && word == CHILD
    {
        let tier = Tier::named(name).expect("the parent's tier");
        println!("{}", kilobytes(&example, tier, what == GRADIENT));
        return;
    }
    println!(
        "a field of {} operations, kB in memory:\n",
        example.graph.len()
    );
    println!("| tier | F | F, F_x |\n| --- | ---: | ---: |");
    for (name, _) in Tier::ALL {
        let [value, gradient] = [VALUE, GRADIENT].map(|what| in_a_process(name, what));
        println!("| {name} | {value} | {gradient} |");
    }
    let small = fields::blobs(4);
    let cycle = |times: usize| {
        for _ in 0..times {
            drop(used(&small, Tier::MachineCode, true));
        }
    };
    cycle(100);
    let before = resident().unwrap_or(0);
    cycle(DROPPED);
    let after = resident().unwrap_or(0);
    println!("\n{DROPPED} fields compiled and dropped: {before} kB before, {after} kB after");
}

/// What a process is called with that measures one tier.
const CHILD: &str = "--of";
const VALUE: &str = "value";
const GRADIENT: &str = "gradient";

/// Kilobytes of one field, measured in a process of its own: in this one there may be memory that
/// was freed, but not given back to the system.
fn in_a_process(name: &str, what: &str) -> String {
    let program = std::env::current_exe().expect("this program has a path");
    let mut child = std::process::Command::new(program);
    let output = child.args([CHILD, name, what]).output();
    let output = output.expect("this program can be run");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

/// Kilobytes of one field among equal ones.
fn kilobytes(example: &Example, tier: Tier, with_gradient: bool) -> u64 {
    // What is kept for the thread and the process is made before, with what one field leaves free.
    let first = used(example, tier, with_gradient);
    let before = resident().unwrap_or(0);
    let held: Vec<CompiledField> = (0..HELD)
        .map(|_| used(example, tier, with_gradient))
        .collect();
    let after = resident().unwrap_or(0);
    drop((first, held));
    after.saturating_sub(before) / HELD as u64
}

/// A field that has been evaluated at a point and at a batch of them.
fn used(example: &Example, tier: Tier, with_gradient: bool) -> CompiledField {
    let field = field(example, tier);
    let column = [0.5; 64];
    field.values(&[&column[..]; 3], &mut [0.0; 64]);
    assert!(field.value(DVec3::ONE).is_finite());
    if with_gradient {
        assert!(field.value_gradient(DVec3::ONE).1.is_finite());
    }
    field
}
