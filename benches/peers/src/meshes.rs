//! Meshes of solids in [−1, 1]³, with cells of a 64th of the side, from the field to the triangles.
//!
//! fidget's mesher against Imp's dual contouring, both with sharp edges; the table also says what
//! Imp's marching cubes take. Both make their evaluators before the clock starts.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use fidget::jit::JitFunction;
use fidget::mesh::{Octree, Settings};
use fidget::render::{RenderHints, ThreadPool};
use fidget::shape::BoundShape;
use fidget::vm::VmFunction;
use imp::engine::{CompiledField, Silent};
use imp::geometry::Bounds;
use imp::polygonize::{Method, Options as Polygonizing, Shape, polygonize};

use crate::measure::{Contender, Task, compete};
use crate::peer::{self, Peer};
use crate::subjects::Subject;
use crate::{Goal, Options, PEERS, Row, own, pictures};

/// Cells along a side are 2 to the power of this.
const DEPTH: u8 = 6;

/// The methods that are compared with the peer's one.
const METHODS: [(Method, &str); 2] = [(Method::Dual, "dual"), (Method::Cubes, "cubes")];

/// The meshes of a solid field; nothing for others.
pub fn meshes(subject: &Subject, threads: usize, options: &Options) -> Result<(), String> {
    if subject.dimension != 3 {
        return Ok(());
    }
    // Fields with exp and sin are slow for the peer.
    let goal = match subject.name {
        "14 Gaussians" | "gyroid" => 50.0,
        _ => 8.0,
    };
    for (method, name) in METHODS {
        let mut compiled = peer_mesh::<JitFunction>(subject, threads)?;
        let mut interpreted = peer_mesh::<VmFunction>(subject, threads)?;
        let (label, task) = match time(&mut compiled) < time(&mut interpreted) {
            true => (PEERS[0], compiled),
            false => (PEERS[1], interpreted),
        };
        let own = own_mesh(subject, method, threads, options)?;
        let contenders = vec![
            Contender::single("Imp", own),
            Contender::single(label, task),
        ];
        let outcome = compete(contenders, options.rounds);
        let goal = (method == Method::Dual).then_some(goal);
        let name = format!("mesh by {name}, {}³, a second", 1 << DEPTH);
        Row::new(subject, threads, &outcome).print(&name, "Imp", Goal::Peer(goal));
    }
    Ok(())
}

fn time(task: &mut Task) -> std::time::Duration {
    let begun = Instant::now();
    task();
    begun.elapsed()
}

/// Imp's mesh.
fn own_mesh(
    subject: &Subject,
    method: Method,
    threads: usize,
    options: &Options,
) -> Result<Task, String> {
    let program = Arc::new(own::program(subject, options.tier));
    let q = subject.q.clone();
    let bounds = Bounds::from_sides(&[(-1.0, 1.0); 3]).ok_or("no box")?;
    let polygonizing = Polygonizing {
        method: Some(method),
        cell: 2.0 / f64::from(1u32 << DEPTH),
        cap: false,
        ..Polygonizing::new(bounds)
    };
    let pool = pictures::pool(threads)?;
    Ok(Box::new(move || {
        let field = CompiledField::new(Arc::clone(&program), q.clone());
        pool.install(|| {
            let found = polygonize(&field, &polygonizing, &Silent);
            black_box(found.is_ok());
        });
    }))
}

/// fidget's mesh.
fn peer_mesh<F: Peer + RenderHints>(subject: &Subject, threads: usize) -> Result<Task, String> {
    let shape = peer::shape::<F>(subject);
    let shape: BoundShape<'static, F, f32> =
        BoundShape::try_from(shape).map_err(|error| error.to_string())?;
    let pool = match threads {
        1 => None,
        _ => Some(ThreadPool::Custom(pictures::pool(threads)?)),
    };
    Ok(Box::new(move || {
        let settings = Settings {
            depth: DEPTH,
            threads: pool.as_ref(),
            ..Default::default()
        };
        if let Some(octree) = Octree::build(&shape, &settings) {
            black_box(octree.walk_dual().triangles.len());
        }
    }))
}

/// Says of how many triangles the two programs' meshes of a field are, and whether they are
/// closed or end at the box, and manifold.
pub fn compare(subject: &Subject, options: &Options) -> Result<(), String> {
    if subject.dimension != 3 {
        return Ok(());
    }
    let shape = peer::shape::<VmFunction>(subject);
    let shape: BoundShape<'static, VmFunction, f32> =
        BoundShape::try_from(shape).map_err(|error| error.to_string())?;
    let settings = Settings {
        depth: DEPTH,
        ..Default::default()
    };
    let octree = Octree::build(&shape, &settings).ok_or("no mesh")?;
    let mesh = octree.walk_dual();
    let peer = imp::geometry::Mesh {
        positions: (mesh.vertices.iter())
            .map(|vertex| [vertex.x, vertex.y, vertex.z].map(f64::from).into())
            .collect(),
        normals: Vec::new(),
        triangles: (mesh.triangles.iter())
            .map(|corners| [corners.x, corners.y, corners.z].map(|corner| corner as u32))
            .collect(),
    };
    describe(subject.name, "fidget", &peer);
    for (method, name) in METHODS {
        let bounds = Bounds::from_sides(&[(-1.0, 1.0); 3]).ok_or("no box")?;
        let polygonizing = Polygonizing {
            method: Some(method),
            cell: 2.0 / f64::from(1u32 << DEPTH),
            cap: false,
            ..Polygonizing::new(bounds)
        };
        let program = Arc::new(own::program(subject, options.tier));
        let field = CompiledField::new(program, subject.q.clone());
        let found =
            polygonize(&field, &polygonizing, &Silent).map_err(|error| error.to_string())?;
        if let Shape::Mesh(mesh) = &found.shape {
            describe(subject.name, name, mesh);
        }
    }
    Ok(())
}

fn describe(subject: &str, program: &str, mesh: &imp::geometry::Mesh) {
    let topology = mesh.topology();
    println!(
        "{subject}: mesh by {program}: {} triangles, {} components, genus {:?}, {} boundary loops, \
         {} non-manifold edges, {} self-intersecting triangles",
        topology.triangles,
        topology.components,
        topology.genus(),
        topology.boundary_loops,
        topology.nonmanifold_edges,
        mesh.self_intersecting_triangles(),
    );
}
