//! Compilation happens once a kernel. Alone in its process, since the counter is for all of it.

#[path = "engine_common/fields.rs"]
mod fields;

use glam::DVec3;
use imp::engine::{CompiledField, Field, Program, compilations};
use std::sync::Arc;

#[test]
fn a_new_q_compiles_nothing() {
    let example = fields::blobs(14);
    let program = Arc::new(Program::new(&example.graph, &[example.root], 3));
    let before = compilations();
    let first = CompiledField::new(program.clone(), example.q.clone());
    assert_eq!(compilations(), before);
    let a = first.value(DVec3::ZERO);
    assert_eq!(compilations(), before + 1);
    first.value_gradient(DVec3::ZERO);
    assert_eq!(compilations(), before + 2);

    let q = example.q.iter().map(|value| value * 1.1).collect();
    let second = CompiledField::new(program, q);
    let b = second.value(DVec3::ZERO);
    second.value_gradient(DVec3::ONE);
    assert_eq!(compilations(), before + 2);
    assert_ne!(a, b);
}
