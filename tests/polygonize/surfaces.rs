//! Surfaces whose topology and measures are known from closed forms or the literature, as fields
//! of the language, and what is asked of all polygonizers of surfaces.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use imp::diagnostic::{Diagnostic, SourceId};
use imp::engine::{CompiledField, Field, Monitor, Silent};
use imp::geometry::{Bounds, Mesh, Topology};
use imp::language::{Host, Limits, Mode, Session};
use imp::polygonize::{Method, Options};
use imp::syntax::parse;

use crate::support::{self, Closure, Made};
use glam::DVec3;

/// Listens to nothing.
struct Deaf;

impl Host for Deaf {
    fn print(&mut self, _line: &str) {}

    fn warn(&mut self, _warning: Diagnostic) {}

    fn wrote(&mut self, _path: &Path) {}

    fn read_source(&mut self, path: &Path) -> Result<(SourceId, Arc<str>), Diagnostic> {
        panic!("{} is not read here", path.display())
    }

    fn monitor(&self) -> &dyn Monitor {
        &Silent
    }
}

/// The field (x, y, z) with this formula.
pub(crate) fn compiled(formula: &str) -> CompiledField {
    let mut session = Session::new(
        Box::new(Deaf),
        Mode::Define,
        Limits::default(),
        PathBuf::new(),
        Vec::new(),
    );
    let text = format!("field f(x, y, z) = {formula}\n");
    let parsed = parse(SourceId(0), &text);
    assert!(parsed.diagnostics.is_empty(), "{text}");
    session.run(&parsed.tree).unwrap();
    let found = session.fields().get("f").cloned().unwrap();
    found.surfaces(session.graph(), &[]).unwrap().remove(0)
}

/// A surface with what is known of it.
pub(crate) struct Known {
    pub(crate) name: &'static str,
    pub(crate) formula: &'static str,
    pub(crate) sides: [(f64, f64); 3],
    /// Cells along the longest side with which the topology shows.
    pub(crate) resolution: f64,
    pub(crate) components: usize,
    pub(crate) genus: usize,
    /// Area and volume with the relative error that this resolution leaves.
    pub(crate) measures: Option<(f64, f64, f64)>,
}

impl Known {
    /// What to ask of a method.
    pub(crate) fn options(&self) -> Options {
        let bounds = Bounds::from_sides(&self.sides).unwrap();
        Options {
            cell: bounds.size().max_element() / self.resolution,
            ..Options::new(bounds)
        }
    }

    /// Fails unless a mesh has the surface's topology and measures.
    pub(crate) fn check(&self, found: &Made<Mesh>) {
        let (name, topology) = (self.name, found.shape.topology());
        assert_closed(name, found);
        assert_eq!(topology.components, self.components, "{name}");
        assert_eq!(topology.genus(), Some(self.genus), "{name}");
        assert_eq!(found.statistics.poor_roots, 0, "{name}");
        if let Some((area, volume, error)) = self.measures {
            let found = (found.shape.area(), found.shape.volume());
            assert!((found.0 / area - 1.0).abs() <= error, "{name}: {found:?}");
            assert!((found.1 / volume - 1.0).abs() <= error, "{name}: {found:?}");
        }
    }
}

/// Fails unless a mesh is closed and oriented, with vertices on the level set.
pub(crate) fn assert_closed(name: &str, found: &Made<Mesh>) -> Topology {
    let topology = found.shape.topology();
    assert!(
        topology.watertight && topology.manifold && topology.oriented,
        "{name}: {topology:?}"
    );
    assert_eq!(found.shape.normals.len(), found.shape.positions.len());
    topology
}

/// The mesh that a method makes of a known surface.
pub(crate) fn polygonized(known: &Known, method: Method, options: &Options) -> Made<Mesh> {
    let field = compiled(known.formula);
    support::mesh(&field, (method, options), &Silent).unwrap()
}

const fn cube(half: f64) -> [(f64, f64); 3] {
    [(-half, half); 3]
}

/// Thin tubes have greater errors; Gaussian curvature adds up to what the genus says anyway.
pub(crate) const SURFACES: &[Known] = &[
    Known {
        name: "sphere",
        formula: "x^2 + y^2 + z^2 - 1",
        sides: cube(1.3),
        resolution: 48.0,
        components: 1,
        genus: 0,
        measures: Some((4.0 * PI, 4.0 * PI / 3.0, 3e-3)),
    },
    Known {
        name: "torus",
        formula: "(x^2 + y^2 + z^2 + 1 - 0.16)^2 - 4*(x^2 + y^2)",
        sides: cube(1.6),
        resolution: 64.0,
        components: 1,
        genus: 1,
        measures: Some((4.0 * PI * PI * 0.4, 2.0 * PI * PI * 0.16, 6e-3)),
    },
    Known {
        name: "double torus",
        formula: "(x^2*(1 - x^2) - y^2)^2 + z^2 - 0.01",
        sides: [(-1.3, 1.3), (-0.8, 0.8), (-0.3, 0.3)],
        resolution: 96.0,
        components: 1,
        genus: 2,
        measures: Some((3.6735, 0.19716, 1e-2)),
    },
    Known {
        name: "tanglecube",
        formula: "x^4 - 5*x^2 + y^4 - 5*y^2 + z^4 - 5*z^2 + 11.8",
        sides: cube(2.8),
        resolution: 64.0,
        components: 1,
        genus: 5,
        measures: Some((100.941, 29.944, 6e-3)),
    },
    Known {
        name: "CSG classic",
        formula: "max(x^2 + y^2 + z^2 - 1, max(abs(x), abs(y), abs(z)) - 0.75, 0.25 - x^2 - y^2, 0.25 - y^2 - z^2, 0.25 - z^2 - x^2)",
        sides: cube(1.1),
        resolution: 64.0,
        components: 1,
        genus: 5,
        // Edges are cut off.
        measures: Some((12.31, 0.989, 3e-2)),
    },
    Known {
        name: "orthocircles",
        formula: "((x^2 + y^2 - 1)^2 + z^2)*((y^2 + z^2 - 1)^2 + x^2)*((z^2 + x^2 - 1)^2 + y^2) - 0.075^2*(1 + 3*(x^2 + y^2 + z^2))",
        sides: cube(1.4),
        resolution: 96.0,
        components: 1,
        genus: 7,
        measures: Some((18.983, 1.7731, 2e-2)),
    },
    Known {
        name: "decocube",
        formula: "((x^2 + y^2 - 0.95^2)^2 + (z^2 - 1)^2)*((y^2 + z^2 - 0.95^2)^2 + (x^2 - 1)^2)*((z^2 + x^2 - 0.95^2)^2 + (y^2 - 1)^2) - 0.01",
        sides: cube(1.3),
        resolution: 80.0,
        components: 1,
        genus: 13,
        measures: Some((18.287, 1.2105, 3e-2)),
    },
    Known {
        name: "Chmutov sextic",
        formula: "32*(x^6 + y^6 + z^6) - 48*(x^4 + y^4 + z^4) + 18*(x^2 + y^2 + z^2) - 3",
        sides: cube(1.2),
        resolution: 64.0,
        components: 1,
        genus: 28,
        measures: None,
    },
    Known {
        name: "two nearly touching spheres",
        formula: "min((x - 1.02)^2 + y^2 + z^2, (x + 1.02)^2 + y^2 + z^2) - 1",
        sides: [(-2.2, 2.2), (-1.2, 1.2), (-1.2, 1.2)],
        resolution: 120.0,
        components: 2,
        genus: 0,
        measures: Some((8.0 * PI, 8.0 * PI / 3.0, 3e-3)),
    },
    Known {
        name: "thin plate",
        formula: "max(abs(x) - 1, abs(y) - 1, abs(z - 0.01) - 0.03)",
        sides: cube(1.3),
        resolution: 50.0,
        components: 1,
        genus: 0,
        // Its edges, all that is not flat, are cut off by at most a cell.
        measures: Some((8.48, 0.24, 6e-2)),
    },
];

/// A field in R3, from a closure that returns F and F_x.
pub(crate) fn space<F: Fn(DVec3) -> (f64, DVec3) + Send + Sync>(function: F) -> Closure<F> {
    Closure {
        dimension: 3,
        function,
    }
}

/// What no mesh can be right for, but every mesh must be closed for: formula and half the box.
pub(crate) const WICKED: &[(&str, f64)] = &[
    // Through the points of the grid, in planes and at corners.
    ("max(abs(x), abs(y), abs(z)) - 0.5", 1.0),
    ("abs(x) + abs(y) + abs(z) - 0.5", 1.0),
    // F = 0 on a region.
    (
        "max(x^2 + y^2 + z^2 - 0.5, 0) - max(0, 0.25 - x^2 - y^2 - z^2)",
        1.0,
    ),
    // Not a number in a region.
    ("sqrt(x) + y^2 + z^2 - 0.5", 1.0),
    ("x^2 + y^2 + z^2 - 0.5 + 0*log(y)", 1.0),
    // Crossing planes and cones.
    ("x*y", 1.0),
    ("x*y*z", 1.0),
    ("x^2 + y^2 - z^2", 1.0),
    // The gradient vanishes along curves on the surface.
    ("(x^2 + 9/4*y^2 + z^2 - 1)^3 - x^2*z^3 - 9/80*y^2*z^3", 1.5),
    ("x^2*y^2 + y^2*z^2 + z^2*x^2 - 2*x*y*z", 1.1),
    // Steep.
    ("exp(40*(sqrt(x^2 + y^2 + z^2) - 0.7)) - 1", 1.0),
    ("x^20 + y^20 + z^20 - 0.5", 1.0),
    // A pole beside a zero.
    ("1/(x^2 + y^2 + z^2 - 0.25) - 4", 1.0),
];

/// Whatever a field is like, a capped mesh is closed, and an open one a manifold.
pub(crate) fn survive_wicked_fields(method: Method, adapt: impl Fn(Options) -> Options) {
    for &(formula, half) in WICKED {
        let field = compiled(formula);
        for cells in [8.0, 13.0] {
            for cap in [true, false] {
                let options = adapt(Options {
                    cell: 2.0 * half / cells,
                    cap,
                    ..Options::new(Bounds::from_sides(&cube(half)).unwrap())
                });
                let found = support::mesh(&field, (method, &options), &Silent).unwrap();
                let topology = found.shape.topology();
                assert!(topology.manifold && topology.oriented, "{formula}");
                assert!(topology.watertight || !cap, "{formula}");
                let residual = found.statistics.max_residual;
                assert!(residual <= 1e-9 * options.bounds.diagonal(), "{formula}");
                let stays = |&position: &DVec3| options.bounds.contains(position);
                assert!(found.shape.positions.iter().all(stays), "{formula}");
            }
        }
    }
}

/// The same mesh from any number of threads.
pub(crate) fn assert_same_on_threads(make: impl Fn() -> Made<Mesh> + Sync) {
    let results: Vec<Made<Mesh>> = [1, 2, 4]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(&make)
        })
        .collect();
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

/// A continuous field on a cube of so many unit cells, 1 or −1 by chance at every point of its
/// lattice of half integers.
pub(crate) fn random_signs(seed: u64, cells: usize) -> impl Field {
    let field = crate::cubes::random_signs(seed, 2 * cells + 1);
    space(move |p| {
        let (value, gradient) = field.value_gradient(2.0 * p);
        (value, 2.0 * gradient)
    })
}
