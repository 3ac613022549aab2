//! Proven topology: known genus and components without any resolution, honest failures, certificates
//! that are checked, and alterations of them that are found.

use glam::DVec3;
use imp::engine::{CompiledField, Silent};
use imp::geometry::Bounds;
use imp::graph::Op;
use imp::polygonize::{
    Cause, Certified, Component, Method, Options, PolygonizeError, Polygonized, Shape, VerifyError,
    polygonize, verify,
};

use crate::expression::{Expression, compiled};
use crate::support::{Closure, cube};

fn made(field: &CompiledField, bounds: Bounds) -> Result<Polygonized, PolygonizeError> {
    let options = Options {
        method: Some(Method::Certified),
        ..Options::new(bounds)
    };
    polygonize(field, &options, &Silent)
}

/// What was proven, with the proof checked and the mesh compared with it.
fn proven(field: &CompiledField, bounds: Bounds) -> (Polygonized, Certified) {
    let found = made(field, bounds).unwrap();
    let certified = found.certified.clone().unwrap();
    let verified = verify(&certified.certificate.text(), &Silent).unwrap();
    assert_eq!(verified.proven, certified.proven);
    assert_eq!(verified.components, certified.components);
    assert_eq!(verified.undecided.is_empty(), certified.doubts.is_empty());
    assert_eq!(found.statistics.proven, certified.proven);
    (found, certified)
}

/// The genera of closed components, proven and found in the mesh, too.
fn genera(field: &CompiledField, bounds: Bounds) -> Vec<u64> {
    let (found, certified) = proven(field, bounds);
    assert!(certified.proven, "{:?}", certified.doubts);
    let Shape::Mesh(mesh) = &found.shape else {
        panic!("a mesh in R3");
    };
    let topology = mesh.topology();
    assert!(topology.watertight && topology.manifold && topology.oriented);
    let sum: i64 = certified.components.iter().map(|own| own.euler).sum();
    assert_eq!(topology.components, certified.components.len());
    assert_eq!(topology.euler_characteristic(), sum);
    let genus = |component: &Component| {
        assert_eq!(component.boundaries, 0);
        component.genus().unwrap()
    };
    certified.components.iter().map(genus).collect()
}

fn sphere(p: &[Expression]) -> Expression {
    sum_of(p, |x| x.square()) - 1.0
}

fn sum_of(p: &[Expression], of: impl Fn(&Expression) -> Expression) -> Expression {
    let mut parts = p.iter().map(of);
    let first = parts.next().unwrap();
    parts.fold(first, |sum, part| sum + part)
}

fn torus(p: &[Expression]) -> Expression {
    let sum = sum_of(p, |x| x.square()) + 0.84;
    sum.square() - 4.0 * (p[0].square() + p[1].square())
}

/// Critical values of `constant`: 18.75, 12.5, 6.25 and 0.
fn tanglecube(constant: f64) -> CompiledField {
    compiled(3, |p| {
        sum_of(p, |x| x.power(4) - 5.0 * x.square()) + constant
    })
}

fn chmutov_quartic(p: &[Expression]) -> Expression {
    sum_of(p, |x| 8.0 * x.power(4) - 8.0 * x.square()) + 3.0
}

/// Three rings, each around an axis, as thin tubes that are joined.
fn orthocircles(p: &[Expression]) -> Expression {
    let ring = |a: usize, b: usize, c: usize| {
        (p[a].square() + p[b].square() - 1.0).square() + p[c].square()
    };
    let sum = sum_of(p, |x| x.square());
    ring(0, 1, 2) * ring(1, 2, 0) * ring(2, 0, 1) - 0.075 * 0.075 * (1.0 + 3.0 * sum)
}

fn blobs(level: f64) -> CompiledField {
    compiled(3, |p| {
        let blob = |centre: f64| {
            let square = (p[0].clone() - centre).square() + p[1].square() + p[2].square();
            (-square).apply(imp::graph::Op::Exp, &[])
        };
        level - (blob(0.8) + blob(-0.8))
    })
}

fn cayley(p: &[Expression]) -> Expression {
    let [x, y, z] = [&p[0], &p[1], &p[2]];
    let quadrics = x.square() + y.square() + z.square();
    quadrics - x.square() * z.clone() + y.square() * z.clone() - 1.0
}

#[test]
fn smooth_surfaces_have_their_genus_without_a_resolution() {
    assert_eq!(genera(&compiled(3, sphere), cube(3, -2.0, 2.1)), [0]);
    assert_eq!(genera(&compiled(3, torus), cube(3, -2.0, 2.1)), [1]);
    let double = compiled(3, |p| {
        let bands = p[0].square() * (1.0 - p[0].square()) - p[1].square();
        bands.square() + p[2].square() - 0.01
    });
    assert_eq!(genera(&double, cube(3, -1.5, 1.5)), [2]);
    assert_eq!(
        genera(&compiled(3, chmutov_quartic), cube(3, -1.3, 1.3)),
        [5]
    );
}

#[test]
fn thin_tubes_have_their_genus() {
    assert_eq!(genera(&compiled(3, orthocircles), cube(3, -1.5, 1.5)), [7]);
}

#[test]
fn the_tanglecube_changes_at_its_critical_values_and_nowhere_else() {
    let bounds = cube(3, -3.0, 3.0);
    assert_eq!(genera(&tanglecube(-1e-3), bounds), [0]);
    assert_eq!(genera(&tanglecube(1e-3), bounds), [0; 2]);
    assert_eq!(genera(&tanglecube(6.25 - 1e-3), bounds), [0; 2]);
    assert_eq!(genera(&tanglecube(6.25 + 1e-3), bounds), [5]);
    assert_eq!(genera(&tanglecube(12.5 - 1e-3), bounds), [5]);
    assert_eq!(genera(&tanglecube(12.5 + 1e-3), bounds), [0; 8]);
    assert_eq!(genera(&tanglecube(18.75 - 1e-3), bounds), [0; 8]);
    let empty = made(&tanglecube(18.75 + 1e-3), bounds);
    assert!(matches!(empty, Err(PolygonizeError::ProvenEmpty { .. })));
}

#[test]
fn gaussian_blobs_part_at_their_critical_level() {
    let critical = 2.0 * (-0.64f64).exp();
    let bounds = cube(3, -2.0, 2.1);
    assert_eq!(genera(&blobs(critical - 1e-4), bounds), [0]);
    assert_eq!(genera(&blobs(critical + 1e-4), bounds), [0; 2]);
}

#[test]
fn what_the_box_cuts_is_proven_up_to_its_sides() {
    // A cylinder along z, and the plane x + y + z = 0.2 in the box.
    let tube = compiled(3, |p| p[0].square() + p[1].square() - 1.0);
    let plane = compiled(3, |p| sum_of(p, Clone::clone) - 0.2);
    for (field, euler, boundaries) in [(tube, 0, 2), (plane, 1, 1)] {
        let (found, certified) = proven(&field, cube(3, -2.0, 2.0));
        assert!(certified.proven, "{:?}", certified.doubts);
        assert_eq!(certified.components, [Component { euler, boundaries }]);
        let Shape::Mesh(mesh) = found.shape else {
            panic!("a mesh in R3");
        };
        // With its caps either is a ball.
        assert_eq!((mesh.genus(), mesh.is_watertight()), (Some(0), true));
        assert!(found.statistics.cut_by_box);
    }
}

#[test]
fn nodes_are_told_of_in_their_places() {
    let (_, certified) = proven(&compiled(3, cayley), cube(3, -3.0, 3.0));
    assert!(!certified.proven);
    assert_eq!(certified.doubts.len(), 4);
    for doubt in &certified.doubts {
        assert_eq!(doubt.cause, Cause::Singular);
        // The nodes are (±√2, 0, 1) and (0, ±√2, −1).
        let side = if doubt.place.z > 0.0 {
            doubt.place.x
        } else {
            doubt.place.y
        };
        let flat = if doubt.place.z > 0.0 {
            doubt.place.y
        } else {
            doubt.place.x
        };
        assert!((side.abs() - 2f64.sqrt()).abs() < 1e-9 && flat.abs() < 1e-9);
        assert!((doubt.place.z.abs() - 1.0).abs() < 1e-9);
        assert!(doubt.values[0] < 1e-12 && doubt.values[1] < 1e-9);
    }
}

#[test]
fn what_cannot_be_proven_is_never_claimed() {
    let bounds = cube(3, -2.0, 2.0);
    let cause = |field: &CompiledField, bounds: Bounds| {
        let (_, certified) = proven(field, bounds);
        assert!(!certified.proven);
        certified.doubts[0].cause
    };
    // Two spheres that touch, a double line, an edge at a right angle, the end of a domain, a pole.
    let touching = compiled(3, |p| {
        let ball =
            |centre: f64| (p[0].clone() - centre).square() + p[1].square() + p[2].square() - 0.25;
        ball(0.5) * ball(-0.5)
    });
    assert_eq!(cause(&touching, bounds), Cause::Singular);
    let crossing = compiled(3, |p| p[0].clone() * p[1].clone());
    assert_eq!(cause(&crossing, bounds), Cause::Singular);
    let wedge = compiled(3, |p| p[0].max(&p[1]) + 0.1);
    assert_eq!(cause(&wedge, bounds), Cause::Kink);
    let root = compiled(3, |p| p[0].sqrt() - p[1].clone());
    assert_eq!(cause(&root, bounds), Cause::Undefined);
    let jump = compiled(3, |p| p[0].apply(Op::Floor, &[]) + 0.5);
    let failure = made(&jump, bounds).unwrap_err();
    assert!(matches!(
        failure,
        PolygonizeError::MaybeEmpty {
            cause: Cause::Jump,
            ..
        }
    ));
    // A sphere that touches the box.
    assert_eq!(
        cause(&compiled(3, sphere), cube(3, -1.0, 1.0)),
        Cause::Border
    );
}

/// Near 10¹⁰ numbers are 2e-6 apart: as it is computed, the field is a staircase, whose steps hide the
/// zeros from floating-point searches.
#[test]
fn what_is_proven_to_be_there_is_not_said_to_be_absent() {
    let plane = compiled(3, |p| (p[0].clone() + 1e10).apply(Op::Sin, &[]));
    let (found, certified) = proven(&plane, cube(3, -1.0, 1.0));
    assert!(certified.proven && certified.components.len() == 1);
    assert_eq!(found.statistics.poor_roots, 0);
    let circle = compiled(2, |p| sum_of(p, |x| (x.clone() + 1e9 - 1e9).square()) - 0.3);
    let (_, certified) = proven(&circle, cube(2, -1.0, 1.0));
    assert_eq!(certified.components.len(), 1);
}

#[test]
fn certificates_that_claim_nothing_are_accepted() {
    let pole = compiled(2, |p| p[0].clone() / p[1].clone() + 1.27);
    let end = compiled(2, |p| p[0].apply(Op::Log, &[]) - p[1].clone());
    let end_in_space = compiled(3, |p| p[0].apply(Op::Log, &[]) + p[1].clone());
    for (field, dimension) in [(pole, 2), (end, 2), (end_in_space, 3)] {
        let (_, certified) = proven(&field, cube(dimension, -1.0, 1.0));
        assert!(!certified.proven);
    }
}

#[test]
fn zeros_without_a_change_of_sign_are_not_said_to_be_absent() {
    let bounds = cube(3, -2.0, 2.0);
    let double = compiled(3, |p| sphere(p).square());
    let flat = compiled(3, |p| sphere(p).max(&p[0].number(0.0)));
    for field in [double, flat] {
        let failure = made(&field, bounds).unwrap_err();
        assert!(
            matches!(failure, PolygonizeError::MaybeEmpty { .. }),
            "{failure}"
        );
    }
}

#[test]
fn a_small_budget_ends_in_doubts() {
    let options = Options {
        method: Some(Method::Certified),
        cell_limit: 2000,
        ..Options::new(cube(3, -1.5, 1.5))
    };
    let found = polygonize(&compiled(3, orthocircles), &options, &Silent).unwrap();
    let certified = found.certified.unwrap();
    assert!(!certified.proven);
    assert!(
        certified
            .doubts
            .iter()
            .any(|doubt| doubt.cause == Cause::Budget)
    );
    assert!(
        !verify(&certified.certificate.text(), &Silent)
            .unwrap()
            .proven
    );
}

#[test]
fn fields_without_enclosures_are_refused() {
    let field = Closure {
        dimension: 3,
        function: |p: DVec3| (p.length_squared() - 1.0, 2.0 * p),
    };
    let options = Options {
        method: Some(Method::Certified),
        ..Options::new(cube(3, -2.0, 2.0))
    };
    let failure = polygonize(&field, &options, &Silent).unwrap_err();
    assert_eq!(failure, PolygonizeError::NothingToProveWith);
}

#[test]
fn curves_in_the_plane_are_proven() {
    let closed = |field: &CompiledField, bounds: Bounds| {
        let (found, certified) = proven(field, bounds);
        assert!(certified.proven, "{:?}", certified.doubts);
        let Shape::Curves(curves) = found.shape else {
            panic!("curves in R2");
        };
        assert_eq!(curves.components(), certified.components.len());
        assert!(
            certified
                .components
                .iter()
                .all(|own| own.euler == 0 && own.boundaries == 0)
        );
        assert_eq!(curves.closed_components(), curves.components());
        (curves.components(), curves.length())
    };
    let cassini = |product: f64| {
        compiled(2, move |p| {
            let to = |centre: f64| (p[0].clone() - centre).square() + p[1].square();
            to(1.0) * to(-1.0) - product
        })
    };
    assert_eq!(closed(&cassini(0.999), cube(2, -2.0, 2.0)).0, 2);
    assert_eq!(closed(&cassini(1.001), cube(2, -2.0, 2.0)).0, 1);
    // A ring as wide as 2e-3.
    let ring = compiled(2, |p| sphere(p).abs() - 2e-3);
    let (components, length) = closed(&ring, cube(2, -1.5, 1.6));
    assert_eq!(components, 2);
    let expected = std::f64::consts::TAU * (1.002f64.sqrt() + 0.998f64.sqrt());
    assert!((length / expected - 1.0).abs() < 1e-3);
    // The lemniscate crosses itself; a wave goes from side to side.
    let (_, lemniscate) = proven(&cassini(1.0), cube(2, -2.0, 2.1));
    assert_eq!(lemniscate.doubts.len(), 1);
    assert!(lemniscate.doubts[0].place.length() < 1e-9);
    let wave = compiled(2, |p| p[1].clone() - (3.0 * p[0].clone()).sine());
    let (_, wave) = proven(&wave, cube(2, -3.0, 3.0));
    assert!(wave.proven);
    assert_eq!(
        wave.components,
        [Component {
            euler: 1,
            boundaries: 2
        }]
    );
}

#[test]
fn random_fields_agree_with_fine_marching_cubes_wherever_they_are_proven() {
    let mut random = Random(7);
    let mut count = 0;
    for _ in 0..12 {
        let waves: Vec<[f64; 5]> = (0..4)
            .map(|_| std::array::from_fn(|_| 2.0 * random.unit() - 1.0))
            .collect();
        let field = compiled(3, |p| {
            let wave = |own: &[f64; 5]| {
                let phase = own[0] * p[0].clone() + own[1] * p[1].clone() + own[2] * p[2].clone();
                own[3] * (3.0 * phase + 3.0 * own[4]).sine()
            };
            let mut parts = waves.iter().map(wave);
            let first = parts.next().unwrap();
            parts.fold(first, |sum, part| sum + part)
        });
        let bounds = cube(3, -1.0, 1.0);
        let Ok(found) = made(&field, bounds) else {
            continue;
        };
        let certified = found.certified.unwrap();
        assert!(verify(&certified.certificate.text(), &Silent).is_ok());
        if !certified.proven {
            continue;
        }
        let cubes = Options {
            method: Some(Method::Cubes),
            cell: 2.0 / 96.0,
            cap: false,
            ..Options::new(bounds)
        };
        let Shape::Mesh(mesh) = polygonize(&field, &cubes, &Silent).unwrap().shape else {
            panic!("a mesh in R3");
        };
        let topology = mesh.topology();
        let sum: i64 = certified.components.iter().map(|own| own.euler).sum();
        let loops: usize = certified.components.iter().map(|own| own.boundaries).sum();
        assert_eq!(topology.components, certified.components.len());
        assert_eq!(topology.euler_characteristic(), sum);
        assert_eq!(topology.boundary_loops, loops);
        count += 1;
    }
    assert!(count >= 8, "{count} fields were proven");
}

/// Pseudo-random numbers (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[test]
fn no_altered_byte_of_a_certificate_is_overlooked() {
    let fields = [
        (compiled(3, torus), cube(3, -2.0, 2.1)),
        (compiled(3, cayley), cube(3, -3.0, 3.0)),
        (compiled(2, sphere), cube(2, -2.0, 2.1)),
    ];
    let mut random = Random(1);
    for (field, bounds) in fields {
        let text = proven(&field, bounds).1.certificate.text();
        for _ in 0..100 {
            let mut bytes = text.clone().into_bytes();
            let place = random.next() as usize % bytes.len();
            let other = b' ' + (random.next() % 95) as u8;
            if bytes[place] == other {
                continue;
            }
            bytes[place] = other;
            let altered = String::from_utf8(bytes).unwrap();
            assert_eq!(verify(&altered, &Silent), Err(VerifyError::NotWhole));
        }
        assert_eq!(
            verify(&text[..text.len() / 2], &Silent),
            Err(VerifyError::NotWhole)
        );
        assert_eq!(verify("", &Silent), Err(VerifyError::NotWhole));
    }
}

#[test]
fn false_claims_are_found_also_under_a_right_digest() {
    let (_, certified) = proven(&compiled(3, torus), cube(3, -2.0, 2.1));
    let truth = certified.certificate;
    assert!(verify(&truth.text(), &Silent).is_ok());
    let refused = |alter: &dyn Fn(&mut imp::polygonize::Certificate)| {
        let mut certificate = truth.clone();
        alter(&mut certificate);
        assert_ne!(certificate, truth);
        verify(&certificate.text(), &Silent).unwrap_err()
    };
    let claims = VerifyError::OtherClaims;
    assert_eq!(refused(&|own| own.components[0].euler = 2), claims);
    assert_eq!(refused(&|own| own.components[0].boundaries = 1), claims);
    assert_eq!(
        refused(&|own| own.components.push(Component {
            euler: 2,
            boundaries: 0
        })),
        claims
    );
    assert_eq!(refused(&|own| own.components.clear()), claims);
    assert_eq!(refused(&|own| own.proven = false), claims);
    assert_eq!(
        refused(&|own| own.tree = own.tree.replacen('n', "?", 1)),
        claims
    );
    assert_eq!(
        refused(&|own| own.tree = own.tree.replacen("n", "", 1)),
        VerifyError::BadTree
    );
    assert_eq!(refused(&|own| own.tree.push('+')), VerifyError::BadTree);
    let cell = |error: VerifyError| {
        matches!(
            error,
            VerifyError::CellFails { .. } | VerifyError::CornerFails { .. }
        )
    };
    for (from, to) in [("n", "+"), ("n", "-"), ("+", "-"), ("-", "+")] {
        assert!(
            cell(refused(&|own| own.tree = own.tree.replacen(from, to, 1))),
            "{from} {to}"
        );
    }
    // Another radius, another level, another box: the cells prove nothing of them.
    assert!(cell(refused(
        &|own| own.field = own.field.replace("0.84", "0.5")
    )));
    assert!(cell(refused(&|own| own.iso = 0.3)));
    assert!(cell(refused(&|own| own.sides[0].1 = 1.2)));
    assert_eq!(
        refused(&|own| own.sides[1].1 = f64::INFINITY),
        VerifyError::BadBox
    );
    assert_eq!(refused(&|own| own.coarse[2] = 0), VerifyError::BadBox);
    let field = |error: VerifyError| matches!(error, VerifyError::BadField(_));
    assert!(field(refused(
        &|own| own.field = own.field.replace("square", "cube")
    )));
    assert!(field(refused(
        &|own| own.field = own.field.replace("output", "n99 = x")
    )));
    // A coarser division than is proven.
    let coarser = |own: &mut imp::polygonize::Certificate| {
        own.tree = "n".repeat(512);
    };
    assert!(cell(refused(&coarser)));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let field = compiled(3, torus);
    let of_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| made(&field, cube(3, -2.0, 2.1)).unwrap())
    };
    let one = of_threads(1);
    assert_eq!(one, of_threads(3));
}
