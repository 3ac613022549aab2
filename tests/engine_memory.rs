//! Dropped fields give their executable memory back. Alone in its process, whose memory it
//! measures.
#![cfg(target_os = "linux")]

#[path = "engine_common/fields.rs"]
mod fields;

use glam::DVec3;
use imp::engine::{CompiledField, Field, Program};
use std::sync::Arc;

/// Virtual and resident memory of this process, in pages (proc(5), statm).
fn pages() -> (u64, u64) {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    let mut numbers = text.split(' ').map(|number| number.parse().unwrap());
    (numbers.next().unwrap(), numbers.next().unwrap())
}

fn compile_and_drop(times: usize) {
    let example = fields::blobs(4);
    for _ in 0..times {
        let program = Program::new(&example.graph, &[example.root], 3);
        let field = CompiledField::new(Arc::new(program), example.q.clone());
        assert!(field.value(DVec3::ZERO).is_finite());
        assert!(field.value_gradient(DVec3::ZERO).1.is_finite());
    }
}

#[test]
fn dropped_fields_leave_no_memory_behind() {
    compile_and_drop(50);
    let before = pages();
    compile_and_drop(300);
    let after = pages();
    // 600 kernels have at least a page of code each; if they stayed, both numbers would grow by
    // 600 or more. The allocator's own variation stays below 200 pages.
    assert!(after.0 < before.0 + 200, "virtual: {before:?} to {after:?}");
    assert!(
        after.1 < before.1 + 200,
        "resident: {before:?} to {after:?}"
    );
}
