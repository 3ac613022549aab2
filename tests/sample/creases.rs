//! Creases and corners of zero sets, against closed forms.

use std::f64::consts::{SQRT_2, TAU};

use glam::DVec3;
use imp::engine::{CompiledField, Field, Silent, pieces};
use imp::geometry::Bounds;
use imp::sample::{CreasePoint, Creases, Method, Options, creases, sample_curve};

use crate::trace::compiled;

const TOLERANCE: f64 = 1e-10;

fn field(text: &str) -> CompiledField {
    compiled(text).pop().unwrap()
}

fn cube(dimension: usize, half: f64) -> Bounds {
    Bounds::from_sides(&vec![(-half, half); dimension]).unwrap()
}

fn found(text: &str, bounds: Bounds) -> Creases {
    creases(&field(text), bounds, TOLERANCE, &Silent).unwrap()
}

/// In R3, in the box -2..2 (a little off, so that nothing is in the middle of anything).
fn in_space(body: &str) -> Creases {
    let sides = [(-2.03, 2.01), (-2.02, 2.04), (-2.0, 2.05)];
    found(
        &format!("field f(p in R3) = {body}"),
        Bounds::from_sides(&sides).unwrap(),
    )
}

/// Twelve edges and eight corners of the cube with the half side `half`, and normals that point
/// outward (1) or inward (-1).
fn check_cube(creases: &Creases, half: f64, outward: f64) {
    assert_eq!(creases.report.undecided, 0);
    assert_eq!((creases.arcs.len(), creases.corners.len()), (12, 8));
    for crease in &creases.arcs {
        assert!(!crease.closed && crease.corners.iter().all(Option::is_some));
        assert!(
            (crease.length - 2.0 * half).abs() < 1e-9,
            "{}",
            crease.length
        );
    }
    for corner in &creases.corners {
        let off = (corner.position.abs() - DVec3::splat(half)).abs();
        assert!(off.max_element() < 1e-12, "{}", corner.position);
        assert_eq!(corner.normals.len(), 3);
        for axis in 0..3 {
            let normal = DVec3::AXES[axis] * corner.position[axis].signum();
            let normal = outward * normal;
            assert!(corner.normals.iter().any(|n| n.distance(normal) < 1e-9));
        }
    }
}

#[test]
fn a_cube_has_twelve_edges_and_eight_corners() {
    check_cube(&in_space("max(abs(p.x), abs(p.y), abs(p.z)) - 1"), 1.0, 1.0);
    check_cube(&in_space("max(abs(p)) - 1"), 1.0, 1.0);
}

#[test]
fn so_has_the_librarys_box_whose_distance_is_another_function_outside() {
    check_cube(&in_space("box(2)(p)"), 1.0, 1.0);
    check_cube(&in_space("complement(box(1.4))(p)"), 0.7, -1.0);
}

/// All creases are closed, with these lengths in any order.
fn check_loops(creases: &Creases, mut lengths: Vec<f64>) {
    assert_eq!(creases.report.undecided, 0);
    assert!(creases.corners.is_empty());
    assert!(creases.arcs.iter().all(|crease| crease.closed));
    let mut found: Vec<f64> = creases.arcs.iter().map(|crease| crease.length).collect();
    found.sort_by(f64::total_cmp);
    lengths.sort_by(f64::total_cmp);
    assert_eq!(found.len(), lengths.len());
    for (found, length) in found.iter().zip(&lengths) {
        assert!((found - length).abs() < 1e-9 * length, "{found} {length}");
    }
}

#[test]
fn two_spheres_meet_in_a_circle_whatever_is_done_with_them() {
    let spheres = "sphere(1, [-0.5, 0, 0]), sphere(1, [0.5, 0, 0])";
    let radius = 0.75_f64.sqrt();
    // The signs of the normals: away from the first and the second centre.
    for (operation, signs) in [
        ("union", [1.0, 1.0]),
        ("intersection", [1.0, 1.0]),
        ("difference", [1.0, -1.0]),
    ] {
        let creases = in_space(&format!("{operation}({spheres})(p)"));
        check_loops(&creases, vec![TAU * radius]);
        let points = creases.points(&|_| 0.1);
        assert_eq!(points.len(), (TAU * radius / 0.1).round() as usize);
        let chord = 2.0 * radius * (TAU / 2.0 / points.len() as f64).sin();
        for (place, point) in points.iter().enumerate() {
            let p = point.position;
            assert!(p.x.abs() < 1e-9 && (p.length() - radius).abs() < 1e-9);
            let next = points[(place + 1) % points.len()].position;
            assert!(
                (p.distance(next) - chord).abs() < 1e-7,
                "{}",
                p.distance(next)
            );
            assert!(point.tangent.dot(p).abs() < 1e-9 && point.tangent.x.abs() < 1e-9);
            assert_eq!(point.normals.len(), 2);
            for (centre, sign) in [-0.5, 0.5].into_iter().zip(signs) {
                let normal = sign * (p - DVec3::X * centre);
                assert!(point.normals.iter().any(|n| n.distance(normal) < 1e-8));
            }
        }
    }
    // The symmetric difference has both spheres, which cross.
    check_loops(&in_space(&format!("xor({spheres})(p)")), vec![TAU * radius]);
}

#[test]
fn the_rims_of_cylinders_are_circles() {
    let rims = vec![TAU * 0.7; 2];
    check_loops(
        &in_space("intersection(cylinder_inf(0.7), p -> abs(p.z) - 0.5)(p)"),
        rims.clone(),
    );
    check_loops(&in_space("cylinder(0.7, 1)(p)"), rims);
}

#[test]
fn what_is_smooth_has_no_creases() {
    for kernel in ["quadratic", "cubic", "circular"] {
        let balls = "sphere(1, [-0.6, 0, 0]), sphere(1, [0.6, 0.2, 0])";
        let creases = in_space(&format!(
            "smooth_union({balls}, 0.4, kernel = \"{kernel}\")(p)"
        ));
        assert!(
            creases.arcs.is_empty() && creases.corners.is_empty(),
            "{kernel}"
        );
        assert_eq!(creases.report.undecided, 0, "{kernel}");
    }
    let torus = in_space("torus(1, 0.4)(p)");
    assert!(torus.arcs.is_empty() && torus.points(&|_| 0.1).is_empty());
    assert_eq!((torus.report.cells, torus.report.evaluations), (0, 0));
}

#[test]
fn an_octahedron_has_twelve_edges_and_six_corners() {
    let creases = in_space("abs(p.x) + abs(p.y) + abs(p.z) - 1");
    assert_eq!(creases.report.undecided, 0);
    assert_eq!((creases.arcs.len(), creases.corners.len()), (12, 6));
    for crease in &creases.arcs {
        assert!((crease.length - SQRT_2).abs() < 1e-9);
    }
    for corner in &creases.corners {
        let mut p = corner.position.abs().to_array();
        p.sort_by(f64::total_cmp);
        assert!(p[1] < 1e-10 && (p[2] - 1.0).abs() < 1e-10, "{p:?}");
        assert_eq!(corner.normals.len(), 4);
    }
    // Six corners, and nine points between those of each edge.
    let points = creases.points(&|_| SQRT_2 / 10.0);
    assert_eq!(points.len(), 6 + 12 * 9);
    assert_eq!(points.iter().filter(|point| point.is_corner).count(), 6);
}

#[test]
fn a_gyroid_cut_off_by_a_ball_has_its_creases_on_both() {
    let gyroid = "sin(4*p.x)*cos(4*p.y) + sin(4*p.y)*cos(4*p.z) + sin(4*p.z)*cos(4*p.x)";
    let creases = in_space(&format!("max({gyroid}, norm(p) - 1.7)"));
    assert_eq!(creases.report.undecided, 0);
    assert!(creases.arcs.iter().all(|crease| crease.closed));
    let points = creases.points(&|_| 0.05);
    assert!(points.len() > 200);
    for point in &points {
        let [x, y, z] = (4.0 * point.position).to_array();
        let value = x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos();
        assert!(value.abs() < 1e-8 && (point.position.length() - 1.7).abs() < 1e-9);
    }
    // The same curve as that on which both fields vanish.
    let fields = compiled(&format!("field f(p in R3) = [{gyroid}, norm(p) - 1.7]"));
    let options = Options {
        method: Method::Trace,
        bounds: Some(cube(3, 2.0)),
        ..Options::default()
    };
    let [one, other] = fields.as_slice() else {
        panic!("two fields");
    };
    let curves = sample_curve([one, other], &options, &Silent).unwrap();
    let components = curves.statistics.curves.unwrap().components;
    assert_eq!(components.len(), creases.arcs.len());
    let whole: f64 = components.iter().map(|curve| curve.length).sum();
    let found: f64 = creases.arcs.iter().map(|crease| crease.length).sum();
    assert!((whole - found).abs() < 1e-8 * whole, "{whole} {found}");
}

/// The cube with three holes of `examples/csg.imp`: in each of six sides the circle in which the ball
/// cuts it and the rim of a hole; inside, where two holes meet, parts of the ellipses in the planes
/// x = ±y, as far as the third hole does not remove them.
#[test]
fn constructive_geometry_has_the_creases_of_its_parts() {
    let text = "let hole = cylinder_inf(0.5)
let holes = union(hole, hole.rotate_x(90deg), hole.rotate_y(90deg))
field f(p in R3) = difference(sphere(1) & box(1.5), holes)(p)";
    let creases = found(text, cube(3, 1.1));
    assert_eq!(creases.report.undecided, 0);
    let (rims, ribs): (Vec<_>, Vec<_>) = creases.arcs.iter().partition(|crease| crease.closed);
    let mut lengths: Vec<f64> = rims.iter().map(|rim| rim.length).collect();
    lengths.sort_by(f64::total_cmp);
    let sphere = (1.0_f64 - 0.75 * 0.75).sqrt();
    assert_eq!(lengths.len(), 12);
    for (place, length) in lengths.iter().enumerate() {
        let expected = TAU * if place < 6 { 0.5 } else { sphere };
        assert!((length - expected).abs() < 1e-9, "{length} {expected}");
    }
    // (cos t, cos t, sin t)/2 for |t| < π/4, by Simpson's rule.
    let speed = |t: f64| 0.5 * (1.0 + t.sin() * t.sin()).sqrt();
    let (parts, width) = (200, TAU / 4.0 / 200.0);
    let rib: f64 = (0..parts)
        .map(|part| {
            let from = -TAU / 8.0 + f64::from(part) * width;
            width / 6.0 * (speed(from) + 4.0 * speed(from + 0.5 * width) + speed(from + width))
        })
        .sum();
    assert_eq!((ribs.len(), creases.corners.len()), (12, 8));
    for crease in ribs {
        assert!(
            (crease.length - rib).abs() < 1e-9,
            "{} {rib}",
            crease.length
        );
    }
    for corner in &creases.corners {
        let off = corner.position.abs() - DVec3::splat(0.125_f64.sqrt());
        assert!(off.abs().max_element() < 1e-9 && corner.normals.len() == 3);
    }
}

#[test]
fn in_the_plane_creases_are_corners() {
    for body in ["max(abs(p.x), abs(p.y)) - 1", "rectangle(2)(p)"] {
        let square = found(&format!("field f(p in R2) = {body}"), cube(2, 1.7));
        assert_eq!((square.report.undecided, square.corners.len()), (0, 4));
        for corner in &square.corners {
            let off = corner.position.abs() - DVec3::new(1.0, 1.0, 0.0);
            assert!(off.abs().max_element() < 1e-12 && corner.normals.len() == 2);
        }
        assert!(square.points(&|_| 0.1).iter().all(|point| point.is_corner));
    }
    // Two discs: both points in which the circles cross.
    let discs = "min(norm(p - [0.5, 0]) - 1, norm(p + [0.5, 0]) - 1)";
    let discs = found(&format!("field f(p in R2) = {discs}"), cube(2, 1.7));
    let mut heights: Vec<f64> = discs.corners.iter().map(|c| c.position.y).collect();
    heights.sort_by(f64::total_cmp);
    let height = 0.75_f64.sqrt();
    assert_eq!(heights.len(), 2);
    assert!((heights[0] + height).abs() < 1e-12 && (heights[1] - height).abs() < 1e-12);
}

#[test]
fn creases_end_in_the_sides_of_the_box_with_a_point() {
    let creases = found("field f(p in R3) = max(p.x, p.y + 0.3*p.z)", cube(3, 1.0));
    assert_eq!((creases.arcs.len(), creases.corners.len()), (1, 0));
    let crease = &creases.arcs[0];
    let length = 2.0 * (1.0_f64 + 0.09).sqrt();
    assert!(!crease.closed && (crease.length - length).abs() < 1e-9);
    let points = creases.points(&|_| length / 7.2);
    assert_eq!(points.len(), 8);
    let ends = [points[0].position.z, points[7].position.z];
    assert!(ends[0] * ends[1] < 0.0 && ends.iter().all(|z| (z.abs() - 1.0).abs() < 1e-9));
    assert!(points.iter().all(|point| !point.is_corner));
}

#[test]
fn spacing_may_change_along_a_crease() {
    let creases = found("field f(p in R3) = max(p.x, p.y)", cube(3, 1.0));
    let spacing = |p: DVec3| 0.06 + 0.05 * (p.z + 1.0);
    let points = creases.points(&spacing);
    // ∫ dz / h(z) = log(h(1) / h(-1)) / 0.05 distances.
    let gaps = ((0.16_f64 / 0.06).ln() / 0.05).round();
    assert_eq!(points.len(), gaps as usize + 1);
    let mut heights: Vec<f64> = points.iter().map(|point| point.position.z).collect();
    heights.sort_by(f64::total_cmp);
    // In geometric progression: h grows by the same factor from point to point.
    let ratio = (0.16_f64 / 0.06).powf(1.0 / gaps);
    for (place, height) in heights.iter().enumerate() {
        let wanted = 0.06 * ratio.powi(place as i32);
        assert!((spacing(DVec3::Z * *height) - wanted).abs() < 1e-6);
    }
}

/// The outline of a stadium: two straight lines and two half circles, each of a piece of its own.
#[test]
fn creases_that_lead_on_smoothly_from_piece_to_piece_are_one() {
    let stadium = "norm([p.x - clamp(p.x, -0.5, 0.5), p.y]) - 0.5";
    let creases = in_space(&format!("max({stadium}, abs(p.z) - 0.3)"));
    check_loops(&creases, vec![2.0 + TAU * 0.5; 2]);
}

/// A cube with square tunnels (Menger's sponge, one round): the edges of the cube, the rims of the six
/// holes, and the edges of the tunnels, three of which cross in each corner of the cube in the middle.
#[test]
fn creases_that_cross_are_split_where_they_do() {
    let bars = "max(abs(p.x), abs(p.y)), max(abs(p.y), abs(p.z)), max(abs(p.z), abs(p.x))";
    let body = format!("max(max(abs(p)) - 1, 1/3 - min({bars}))");
    let creases = found(&format!("field f(p in R3) = {body}"), cube(3, 1.1));
    assert_eq!(creases.report.undecided, 0);
    // 8 of the cube, 4 for each hole, 8 inside.
    assert_eq!(
        (creases.arcs.len(), creases.corners.len()),
        (12 + 24 + 36, 8 + 24 + 8)
    );
    for crease in &creases.arcs {
        let length = if crease.length > 1.0 { 2.0 } else { 2.0 / 3.0 };
        assert!((crease.length - length).abs() < 1e-9, "{}", crease.length);
    }
    assert!(
        creases
            .corners
            .iter()
            .all(|corner| corner.normals.len() == 3)
    );
}

/// Two cylinders of the same radius meet in two ellipses that cross where the surfaces touch.
#[test]
fn ellipses_that_cross_are_split_where_they_do() {
    let creases = in_space("max(norm(p.xy) - 1, norm(p.yz) - 1)");
    assert_eq!((creases.arcs.len(), creases.corners.len()), (4, 2));
    for corner in &creases.corners {
        assert!((corner.position.abs() - DVec3::Y).abs().max_element() < 1e-5);
    }
    // Half of the circumference of an ellipse with the half axes √2 and 1.
    let speed = |t: f64| (1.0 + t.sin() * t.sin()).sqrt();
    let width = TAU / 2.0 / 400.0;
    let half: f64 = (0..400)
        .map(|part| width * speed((f64::from(part) + 0.5) * width))
        .sum();
    for crease in &creases.arcs {
        assert!(
            (crease.length - half).abs() < 1e-6,
            "{} {half}",
            crease.length
        );
    }
}

/// A sphere by its centre and radius.
type Sphere = (DVec3, f64);

/// Spheres at random, of a linear congruential generator (Knuth's MMIX).
fn random_spheres(count: usize) -> Vec<Sphere> {
    let mut state = 12_345_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count)
        .map(|_| {
            let centre = DVec3::new(next(), next(), next());
            (8.0 * centre - 4.0, 0.5 + 0.8 * next())
        })
        .collect()
}

/// The length of the circle in which two of the spheres meet, as far as it is outside of all others:
/// in terms of the angle, each of these covers one interval.
fn outer_length(spheres: &[Sphere], one: usize, other: usize) -> f64 {
    let ((a, r), (b, s)) = (spheres[one], spheres[other]);
    let apart = a.distance(b);
    if apart >= r + s || apart <= (r - s).abs() {
        return 0.0;
    }
    let axis = (b - a) / apart;
    let along = (apart * apart + r * r - s * s) / (2.0 * apart);
    let radius = (r * r - along * along).sqrt();
    let centre = a + along * axis;
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    let mut covered: Vec<(f64, f64)> = Vec::new();
    for (number, (c, t)) in spheres.iter().enumerate() {
        if number == one || number == other {
            continue;
        }
        // Inside: m + n cos(θ - φ) < 0.
        let from = centre - *c;
        let m = from.length_squared() + radius * radius - t * t;
        let (x, y) = (2.0 * radius * from.dot(u), 2.0 * radius * from.dot(v));
        let n = x.hypot(y);
        if m >= n {
            continue;
        }
        if m <= -n {
            return 0.0;
        }
        let (phi, half) = (y.atan2(x), (-m / n).acos());
        // From φ + half, where it goes inside, to φ + τ - half.
        let (low, high) = ((phi + half).rem_euclid(TAU), TAU - 2.0 * half);
        covered.push((low, (low + high).min(TAU)));
        if low + high > TAU {
            covered.push((0.0, low + high - TAU));
        }
    }
    covered.sort_by(|one, other| one.0.total_cmp(&other.0));
    let (mut free, mut reached) = (0.0, 0.0_f64);
    for (low, high) in covered {
        free += (low - reached).max(0.0);
        reached = reached.max(high);
    }
    radius * (free + (TAU - reached).max(0.0))
}

fn union_of(spheres: &[Sphere]) -> String {
    let shapes: Vec<String> = spheres
        .iter()
        .map(|(c, r)| format!("sphere({r:?}, [{:?}, {:?}, {:?}])", c.x, c.y, c.z))
        .collect();
    format!("field f(p in R3) = union([{}])(p)", shapes.join(", "))
}

#[test]
fn the_circles_of_a_hundred_spheres_are_complete() {
    let spheres = random_spheres(100);
    let mut expected = 0.0;
    for one in 0..spheres.len() {
        for other in 0..one {
            expected += outer_length(&spheres, one, other);
        }
    }
    let creases = found(&union_of(&spheres), cube(3, 5.5));
    let length: f64 = creases.arcs.iter().map(|crease| crease.length).sum();
    assert!(
        (length - expected).abs() < 1e-6 * expected,
        "{length} {expected}"
    );
    assert_eq!(creases.report.undecided, 0);
    // Three arcs end in every corner of a union in general position.
    let ends = creases.arcs.iter().flat_map(|crease| crease.corners);
    assert_eq!(ends.flatten().count(), 3 * creases.corners.len());
    // All points lie on the union.
    let field = field(&union_of(&spheres));
    for point in creases.points(&|_| 0.2) {
        assert!(field.value(point.position).abs() < 1e-9);
    }
}

#[test]
fn the_points_do_not_depend_on_the_number_of_threads() {
    let field = field(&union_of(&random_spheres(25)));
    let points = |threads: usize| -> Vec<CreasePoint> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let found = creases(&field, cube(3, 5.5), TOLERANCE, &Silent).unwrap();
            found.points(&|_| 0.3)
        })
    };
    let one = points(1);
    assert!(one.len() > 20);
    assert_eq!(one, points(3));
}

#[test]
fn pieces_are_the_smooth_functions_that_meet() {
    let meet = |body: &str| {
        let field = field(&format!("field f(p in R3) = {body}"));
        pieces(&field, DVec3::splat(-2.0), DVec3::splat(2.1), 6, &Silent).unwrap()
    };
    // The three spheres that reach each other; the fourth is alone.
    let spheres = "sphere(0.5), sphere(0.5, [0.3, 0, 0]), sphere(0.5, [0, 0.4, 0])";
    let found = meet(&format!(
        "union({spheres}, sphere(0.2, [1.5, 1.5, 1.5]))(p)"
    ));
    assert_eq!(found.fields.len(), 3);
    for centre in [DVec3::ZERO, DVec3::X * 0.3, DVec3::Y * 0.4] {
        let is_sphere = |piece: &CompiledField| {
            [DVec3::ONE, DVec3::new(0.1, -0.7, 0.4)].iter().all(|&at| {
                let (value, distance) = (piece.value(at).abs(), at.distance(centre) - 0.5);
                (value - distance.abs()).abs() < 1e-12
            })
        };
        assert!(found.fields.iter().any(is_sphere));
    }
    // The point where all three meet is in a cell that names them.
    let (x, y) = (0.15, 0.2);
    let z = (0.25_f64 - x * x - y * y).sqrt();
    let mut around = found.around(DVec3::new(x, y, z), 0.0);
    assert!(around.any(|place| found.meetings[place].pieces == [0, 1, 2]));
    // Multiples and other forms of a function are no other pieces.
    let same = meet("max(p.x + p.y, 2*p.y + 2*p.x, -p.z - (p.x - p.z) - p.y, p.z)");
    assert!(same.fields.len() <= 3, "{}", same.fields.len());
    assert!(meet("norm(p) - 1").meetings.is_empty());
}
