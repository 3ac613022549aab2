//! Pictures against closed forms: silhouettes, depths, normals, areas; and what is no surface.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use imp::engine::{CompiledField, Monitor, Program, Silent};
use imp::geometry::Bounds;
use imp::graph::{Graph, NodeId, Op};
use imp::picture::{
    Aim, Camera, HeightMap, Hit, Options, PictureError, Side, Size, Style, View, bitmap,
    height_map, render,
};

/// A field from the graph that `make` builds of the coordinates.
fn field(dimension: usize, make: impl FnOnce(&mut Graph, [NodeId; 3]) -> NodeId) -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let root = make(&mut graph, coordinates);
    CompiledField::new(
        Arc::new(Program::new(&graph, &[root], dimension)),
        Vec::new(),
    )
}

/// |p|² − r² over the given coordinates.
fn round(graph: &mut Graph, coordinates: &[NodeId], radius: f64) -> NodeId {
    let mut sum = graph.constant(-radius * radius);
    for &coordinate in coordinates {
        let square = graph.apply(Op::Square, &[coordinate]);
        sum = graph.apply(Op::Add, &[sum, square]);
    }
    sum
}

fn ball(radius: f64) -> CompiledField {
    field(3, |graph, p| round(graph, &p, radius))
}

/// The torus with radii 1 and 0.3 around the z axis.
fn torus() -> CompiledField {
    field(3, |graph, [x, y, z]| {
        let plane = round(graph, &[x, y], 0.0);
        let radius = graph.apply(Op::SquareRoot, &[plane]);
        let one = graph.constant(1.0);
        let ring = graph.apply(Op::Subtract, &[radius, one]);
        round(graph, &[ring, z], 0.3)
    })
}

fn cube(half: f64) -> Bounds {
    Bounds::from_sides(&[(-half, half); 3]).unwrap()
}

fn camera(bounds: Bounds, view: &str, perspective: Option<f64>, size: usize) -> Camera {
    Camera::new(&Aim {
        bounds,
        view: View::named(view).unwrap(),
        perspective,
        size: [size; 2],
    })
}

fn map(field: &CompiledField, camera: &Camera) -> HeightMap {
    height_map(field, camera, &Silent).unwrap()
}

fn count(map: &HeightMap, hit: Hit) -> f64 {
    map.hits.iter().filter(|&&found| found == hit).count() as f64
}

/// How far the number of pixels whose middles are in a disc may be from its area: Sierpiński's
/// bound for lattice points is of order R^(2/3); 3 times that holds for all radii used here.
fn lattice_error(radius: f64) -> f64 {
    3.0 * radius.powf(2.0 / 3.0)
}

/// What the hit pixels see, with their screen coordinates.
fn hits<'a>(
    map: &'a HeightMap,
    camera: &'a Camera,
) -> impl Iterator<Item = (Hit, DVec3, DVec3)> + 'a {
    (0..map.hits.len())
        .filter(|&index| map.hits[index] != Hit::Nothing)
        .map(|index| {
            let (u, v) = (index % map.width, index / map.width);
            let depth = f64::from(map.depths[index]);
            let point = camera.point([u as f64 + 0.5, v as f64 + 0.5, depth]);
            (map.hits[index], point, map.normals[index].as_dvec3())
        })
}

#[test]
fn a_ball_looks_the_same_from_everywhere() {
    for view in View::names() {
        let camera = camera(cube(1.25), view, None, 96);
        let map = map(&ball(1.0), &camera);
        let radius = 1.0 / camera.pixel();
        let area = PI * radius * radius;
        let found = count(&map, Hit::Surface);
        assert!(
            (found - area).abs() < lattice_error(radius),
            "{view}: {found} of {area}"
        );
        assert_eq!(
            count(&map, Hit::Cut) + count(&map, Hit::Jump),
            0.0,
            "{view}"
        );
        let toward = camera.frame()[2];
        for (_, point, normal) in hits(&map, &camera) {
            // Depths are stored in f32, whose last digit is 2^-17 slices of 2.5/96 here; the
            // rays' roots are more accurate than that.
            assert!((point.length() - 1.0).abs() < 1e-5, "{view}: {point}");
            assert!(
                point.dot(toward) > -1e-5,
                "{view}: the back is seen at {point}"
            );
            // Gradients are taken at most 1/64 of a slice away from the root, on a ball of 38
            // pixels or more: 1/64/38 = 4e-4.
            assert!(
                (normal - point).length() < 5e-4,
                "{view}: {normal} at {point}"
            );
        }
    }
}

#[test]
fn names_of_views_say_where_the_camera_is() {
    for (view, toward, right) in [
        ("front", -DVec3::Y, DVec3::X),
        ("back", DVec3::Y, -DVec3::X),
        ("right", DVec3::X, DVec3::Y),
        ("left", -DVec3::X, -DVec3::Y),
        ("top", DVec3::Z, DVec3::X),
        ("bottom", -DVec3::Z, DVec3::X),
    ] {
        let frame = camera(cube(1.0), view, None, 8).frame();
        assert!((frame[2] - toward).length() < 1e-15, "{view}");
        assert!((frame[0] - right).length() < 1e-15, "{view}");
        assert!((frame[1] - toward.cross(right)).length() < 1e-15, "{view}");
    }
    let frame = camera(cube(1.0), "isometric", None, 8).frame();
    // All axes are equally short: each has a component of 1/√3 toward the camera.
    assert!((frame[2].abs() - DVec3::splat(1.0 / 3f64.sqrt())).length() < 1e-15);
    assert!(View::named("above").is_none());
}

#[test]
fn a_ball_in_perspective_has_the_silhouette_of_its_tangent_cone() {
    for (view, degrees) in [("front", 40.0), ("isometric", 90.0), ("top", 10.0)] {
        let camera = camera(cube(1.25), view, Some(f64::to_radians(degrees)), 96);
        let map = map(&ball(1.0), &camera);
        let distance = camera.eye().unwrap().length();
        // At distance 1 from the eye the cone has the radius r/√(d² − r²).
        let radius = 1.0 / (distance * distance - 1.0).sqrt() / camera.pixel();
        let (found, area) = (count(&map, Hit::Surface), PI * radius * radius);
        assert!(
            (found - area).abs() < lattice_error(radius),
            "{view}: {found} of {area}"
        );
        for (_, point, normal) in hits(&map, &camera) {
            assert!((point.length() - 1.0).abs() < 1e-5, "{view}: {point}");
            assert!(
                (normal - point).length() < 1e-3,
                "{view}: {normal} at {point}"
            );
        }
    }
}

#[test]
fn the_whole_box_is_in_the_picture_and_touches_its_edge() {
    let bounds = Bounds::from_sides(&[(-1.0, 3.0), (0.0, 0.5), (2.0, 3.0)]).unwrap();
    for perspective in [None, Some(0.6)] {
        for view in View::names() {
            let aim = Aim {
                bounds,
                view: View::named(view).unwrap(),
                perspective,
                size: [80, 60],
            };
            let camera = Camera::new(&aim);
            // Everything is inside, so the box itself is seen.
            let full = field(3, |graph, _| graph.constant(-1.0));
            let map = map(&full, &camera);
            let columns: Vec<usize> = (0..map.hits.len())
                .filter(|&index| map.hits[index] == Hit::Cut)
                .map(|index| index % 80)
                .collect();
            let rows: Vec<usize> = (0..map.hits.len())
                .filter(|&index| map.hits[index] == Hit::Cut)
                .map(|index| index / 80)
                .collect();
            let touches = |found: &[usize], last: usize| {
                // Corners may end within a pixel or two of the edge.
                *found.iter().min().unwrap() <= 2 && *found.iter().max().unwrap() + 3 > last
            };
            assert!(
                touches(&columns, 80) || touches(&rows, 60) || perspective.is_some(),
                "{view}"
            );
            for (hit, point, normal) in hits(&map, &camera) {
                assert_eq!(hit, Hit::Cut, "{view}");
                // Along the box's edges the root is as good as its probes: 1/64 of a slice.
                assert!(bounds.expanded(2e-3).contains(point), "{view}: {point}");
                assert_eq!(normal.abs().element_sum(), 1.0, "{view}: {normal}");
            }
        }
    }
}

#[test]
fn a_torus_has_its_hole_from_above_and_none_from_the_side() {
    let size = 65;
    let seen = |view| map(&torus(), &camera(cube(1.5), view, None, size));
    let middle = size * size / 2;
    for view in ["top", "bottom"] {
        let map = seen(view);
        assert_eq!(map.hits[middle], Hit::Nothing);
        let camera = camera(cube(1.5), view, None, size);
        let [outer, inner] = [1.3, 0.7].map(|radius| radius / camera.pixel());
        let area = PI * (outer * outer - inner * inner);
        let error = lattice_error(outer) + lattice_error(inner);
        assert!((count(&map, Hit::Surface) - area).abs() < error);
    }
    for view in ["front", "left"] {
        let map = seen(view);
        assert_eq!(map.hits[middle], Hit::Surface);
        for row in map.hits.chunks(size) {
            let first = row.iter().position(|&hit| hit != Hit::Nothing);
            let last = row.iter().rposition(|&hit| hit != Hit::Nothing);
            if let (Some(first), Some(last)) = (first, last) {
                assert!(!row[first..last].contains(&Hit::Nothing));
            }
        }
    }
}

#[test]
fn what_the_box_cuts_is_flat() {
    let bounds = Bounds::from_sides(&[(-1.1, 1.1), (-1.1, 1.1), (-1.1, 0.8)]).unwrap();
    for view in ["top", "isometric"] {
        let camera = camera(bounds, view, None, 96);
        let map = map(&ball(1.0), &camera);
        // The cut is a disc of radius √(1 − 0.8²) = 0.6, foreshortened.
        let lean = camera.frame()[2].z;
        let area = PI * 0.36 * lean / (camera.pixel() * camera.pixel());
        let found = count(&map, Hit::Cut);
        let radius = 0.6 / camera.pixel();
        assert!(
            (found - area).abs() < lattice_error(radius),
            "{view}: {found} of {area}"
        );
        for (hit, point, normal) in hits(&map, &camera) {
            if hit == Hit::Cut {
                assert_eq!(normal, DVec3::Z);
                assert!((point.z - 0.8).abs() < 1e-4);
            } else {
                assert!((point.length() - 1.0).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn sheets_of_two_pixels_are_seen_where_rays_meet_them_squarely() {
    // | |p| − 1 | < 0.03, opened by the box at z = 0.
    let shell = field(3, |graph, p| {
        let square = round(graph, &p, 0.0);
        let radius = graph.apply(Op::SquareRoot, &[square]);
        let [one, thin] = [1.0, 0.03].map(|number| graph.constant(number));
        let distance = graph.apply(Op::Subtract, &[radius, one]);
        let distance = graph.apply(Op::Abs, &[distance]);
        graph.apply(Op::Subtract, &[distance, thin])
    });
    let bounds = Bounds::from_sides(&[(-1.2, 1.2), (-1.2, 1.2), (-1.2, 0.0)]).unwrap();
    let camera = camera(bounds, "top", None, 96);
    let map = map(&shell, &camera);
    let radius = 1.03 / camera.pixel();
    let area = PI * radius * radius;
    let found = count(&map, Hit::Surface) + count(&map, Hit::Cut);
    assert!(
        (found - area).abs() < lattice_error(radius),
        "{found} of {area}"
    );
    for (hit, point, normal) in hits(&map, &camera) {
        if hit == Hit::Surface && point.truncate().length() < 0.9 {
            // The bowl's inner side, whose normal is turned to the middle.
            assert!((point.length() - 0.97).abs() < 1e-5, "{point}");
            assert!((normal + point / 0.97).length() < 1e-3);
        }
    }
}

#[test]
fn pictures_may_have_any_proportions() {
    for size in [[10_000, 1], [1, 10_000], [20_000, 3]] {
        let camera = Camera::new(&Aim {
            bounds: cube(1.0),
            view: View::named("front").unwrap(),
            perspective: None,
            size,
        });
        let map = map(&ball(0.9), &camera);
        // The ball is as wide as the shorter side allows: a pixel or some.
        assert!(count(&map, Hit::Surface) <= 9.0);
    }
}

#[test]
fn resolution_has_nothing_to_do_with_units() {
    let of_scale = |scale: f64| {
        let view = "isometric";
        map(&ball(scale), &camera(cube(1.25 * scale), view, None, 64))
    };
    let expected = of_scale(1.0);
    // Powers of two scale every number exactly.
    for scale in [2f64.powi(-24), 2f64.powi(24), 2f64.powi(-60), 2f64.powi(70)] {
        let found = of_scale(scale);
        assert_eq!(found.hits, expected.hits, "{scale}");
        let pairs = found.depths.iter().zip(&expected.depths);
        for (a, b) in pairs.filter(|(a, _)| a.is_finite()) {
            assert!((a - b).abs() < 1e-3, "{scale}: {a} {b}");
        }
    }
    // Far from the origin, with fewer digits left.
    let far = field(3, |graph, [x, y, z]| {
        let shift = graph.constant(1e6);
        let x = graph.apply(Op::Subtract, &[x, shift]);
        round(graph, &[x, y, z], 1.0)
    });
    let bounds = Bounds::from_sides(&[(1e6 - 1.25, 1e6 + 1.25), (-1.25, 1.25), (-1.25, 1.25)]);
    let found = map(&far, &camera(bounds.unwrap(), "front", None, 64));
    let near = map(&ball(1.0), &camera(cube(1.25), "front", None, 64));
    assert_eq!(found.hits, near.hits);
}

#[test]
fn jumps_and_poles_are_no_surfaces() {
    let jump = field(3, |graph, [x, ..]| {
        let floor = graph.apply(Op::Floor, &[x]);
        let half = graph.constant(0.5);
        graph.apply(Op::Add, &[floor, half])
    });
    let pole = field(3, |graph, [x, ..]| {
        let one = graph.constant(1.0);
        graph.apply(Op::Divide, &[one, x])
    });
    let begins = field(3, |graph, [x, ..]| {
        // −1 − √(−x): defined, and inside, on the left only.
        let opposite = graph.apply(Op::Negate, &[x]);
        let root = graph.apply(Op::SquareRoot, &[opposite]);
        let minus_one = graph.constant(-1.0);
        graph.apply(Op::Subtract, &[minus_one, root])
    });
    for field in [&jump, &pole, &begins] {
        let camera = camera(cube(1.1), "right", None, 32);
        let middle = 0.5 * camera.slices() as f32;
        let map = map(field, &camera);
        assert_eq!(count(&map, Hit::Jump), 1024.0);
        assert!(map.depths.iter().all(|depth| (depth - middle).abs() < 1e-3));
    }
    // Roots of higher order and steep ones are surfaces.
    for exponent in [3.0, 9.0, 1.0 / 3.0] {
        let power = field3_power(exponent);
        let camera = camera(cube(1.1), "right", None, 32);
        let middle = 0.5 * camera.slices() as f32;
        let map = map(&power, &camera);
        assert_eq!(count(&map, Hit::Surface), 1024.0, "{exponent}");
        assert!(map.depths.iter().all(|depth| (depth - middle).abs() < 0.05));
    }
}

/// sign(x)·|x|^e
fn field3_power(exponent: f64) -> CompiledField {
    field(3, |graph, [x, ..]| {
        let exponent = graph.constant(exponent);
        let size = graph.apply(Op::Abs, &[x]);
        let power = graph.apply(Op::Power, &[size, exponent]);
        let sign = graph.apply(Op::Sign, &[x]);
        graph.apply(Op::Multiply, &[sign, power])
    })
}

#[test]
fn undefined_places_are_told() {
    let nowhere = field(3, |graph, [x, ..]| {
        let square = graph.apply(Op::Square, &[x]);
        let minus_one = graph.constant(-1.0);
        let negative = graph.apply(Op::Subtract, &[minus_one, square]);
        graph.apply(Op::SquareRoot, &[negative])
    });
    let options = Options {
        size: Size::Longest(32),
        ..Options::new(cube(1.0))
    };
    let picture = render(&nowhere, &options, &Silent).unwrap();
    assert!(picture.statistics.undefined > 0);
    assert_eq!(picture.statistics.covered, 0.0);
    // In the plane √x is undefined on the left half: 32 of 64 columns.
    let half = field(2, |graph, [x, ..]| {
        let root = graph.apply(Op::SquareRoot, &[x]);
        let level = graph.constant(0.5);
        graph.apply(Op::Subtract, &[root, level])
    });
    let square = Bounds::from_sides(&[(-1.0, 1.0); 2]).unwrap();
    let map = bitmap(&half, &square, [64; 2], &Silent).unwrap();
    for row in map.sides.chunks(64) {
        // √x < 1/2 where x < 1/4: 8 columns.
        assert!(row[..32].iter().all(|&side| side == Side::Undefined));
        assert!(row[32..40].iter().all(|&side| side == Side::Inside));
        assert!(row[40..].iter().all(|&side| side == Side::Outside));
    }
    for style in [Style::Shaded, Style::Fill] {
        let options = Options {
            size: Size::Longest(64),
            style,
            ..Options::new(square)
        };
        let picture = render(&half, &options, &Silent).unwrap();
        assert_eq!(picture.statistics.undefined, 64 * 32);
        let [r, g, b, _] = picture.image.pixels[0];
        assert!(r == g && g == b && r > 100 && r < 200, "grey");
    }
}

#[test]
fn a_disc_covers_its_area() {
    let disc = field(2, |graph, [x, y, _]| round(graph, &[x, y], 0.8));
    let square = Bounds::from_sides(&[(-1.0, 1.0); 2]).unwrap();
    let size = 300;
    let radius = 0.8 * size as f64 / 2.0;
    let area = PI * radius * radius;
    let map = bitmap(&disc, &square, [size; 2], &Silent).unwrap();
    let inside = map.sides.iter().filter(|&&side| side == Side::Inside);
    assert!((inside.count() as f64 - area).abs() < lattice_error(radius));
    // Shaded, the picture is opaque inside and on the line, of which 1.1 pixels are outside.
    let options = Options {
        size: Size::Longest(size),
        transparent: true,
        ..Options::new(square)
    };
    let picture = render(&disc, &options, &Silent).unwrap();
    let opacity: f64 = (picture.image.pixels.iter())
        .map(|pixel| f64::from(pixel[3]) / 255.0)
        .sum();
    let with_line = PI * (radius + 1.1) * (radius + 1.1);
    // Coverage is exact but for the curvature: far below a thousandth.
    assert!(
        (opacity / with_line - 1.0).abs() < 1e-3,
        "{opacity} of {with_line}"
    );
    assert_eq!(picture.image.pixels[0], [0; 4]);
    // The line is where the disc ends: darker than everything else.
    let middle = &picture.image.pixels[size * size / 2..][..size];
    let dark = |pixel: &&[u8; 4]| pixel[3] == 255 && pixel[0] < 40;
    let line = middle.iter().filter(dark).count();
    assert!((2..=6).contains(&line), "{line} pixels of two crossings");
}

#[test]
fn a_map_is_in_proportion_and_in_the_middle() {
    let plane = field(2, |_, [x, ..]| x);
    let bounds = Bounds::from_sides(&[(-2.0, 2.0), (0.0, 1.0)]).unwrap();
    let sized = |size| {
        let options = Options {
            size,
            style: Style::Fill,
            ..Options::new(bounds)
        };
        render(&plane, &options, &Silent).unwrap().image
    };
    let image = sized(Size::Longest(64));
    assert_eq!((image.width, image.height), (64, 16));
    assert_ne!(image.pixels[0], image.pixels[63]);
    let image = sized(Size::Exact([64, 64]));
    // 24 rows of paper above and below.
    let paper = [255; 4];
    let rows: Vec<bool> = image
        .pixels
        .chunks(64)
        .map(|row| row.contains(&paper))
        .collect();
    let expected: Vec<bool> = (0..64).map(|row| !(24..40).contains(&row)).collect();
    assert_eq!(rows, expected);
}

#[test]
fn graphs_show_roots_and_break_at_poles() {
    let bounds = Bounds::from_sides(&[(-1.0, 1.0)]).unwrap();
    let options = Options {
        size: Size::Exact([200, 100]),
        transparent: true,
        ..Options::new(bounds)
    };
    let pole = field(1, |graph, [x, ..]| {
        let [place, size] = [0.255, 0.01].map(|number| graph.constant(number));
        let x = graph.apply(Op::Subtract, &[x, place]);
        graph.apply(Op::Divide, &[size, x])
    });
    let image = render(&pole, &options, &Silent).unwrap().image;
    // The middle of the column with the pole, and those beside it: no line goes through.
    let column = 125;
    let opaque = (0..100).filter(|row| image.pixels[row * 200 + column][3] > 128);
    assert!(opaque.count() < 60);
    let line = field(1, |_, [x, ..]| x);
    let image = render(&line, &options, &Silent).unwrap().image;
    // The root is a dark dot at the middle.
    let [r, _, b, opacity] = image.pixels[50 * 200 + 100];
    assert!(opacity == 255 && r < 60 && b < 100, "{r} {b}");
    // And the curve goes from the lower left to the upper right.
    let row = |column: usize| {
        let blue = |row: &usize| {
            let [r, _, b, opacity] = image.pixels[row * 200 + column];
            opacity > 200 && i32::from(b) - i32::from(r) > 60
        };
        (0..100).find(blue)
    };
    assert!(row(20).unwrap() > 60 && row(180).unwrap() < 40);
}

#[test]
fn images_do_not_depend_on_the_number_of_threads() {
    let disc = field(2, |graph, [x, y, _]| round(graph, &[x, y], 0.8));
    let solid = Options {
        size: Size::Exact([90, 70]),
        occlusion: true,
        perspective: Some(0.7),
        transparent: true,
        ..Options::new(cube(1.2))
    };
    let plane = Options {
        size: Size::Longest(300),
        ..Options::new(Bounds::from_sides(&[(-1.0, 1.0); 2]).unwrap())
    };
    let pictures = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            [
                render(&torus(), &solid, &Silent).unwrap(),
                render(&disc, &plane, &Silent).unwrap(),
            ]
        })
    });
    assert_eq!(pictures[0], pictures[1]);
    assert_eq!(pictures[0], pictures[2]);
    // Some of it is clear, some not.
    let pixels = &pictures[0][0].image.pixels;
    assert!(pixels.iter().any(|pixel| pixel[3] == 0) && pixels.iter().any(|pixel| pixel[3] == 255));
}

#[test]
fn occlusion_darkens_corners_only() {
    // Two half spaces that form a valley, z < |x|: light reaches its bottom less.
    let valley = field(3, |graph, [x, _, z]| {
        let wall = graph.apply(Op::Abs, &[x]);
        graph.apply(Op::Subtract, &[z, wall])
    });
    let shown = |occlusion| {
        let options = Options {
            size: Size::Longest(65),
            view: View::named("top").unwrap(),
            samples: 1,
            whole: true,
            occlusion,
            ..Options::new(cube(1.0))
        };
        let image = render(&valley, &options, &Silent).unwrap().image;
        let at = |column: usize| {
            let [r, g, b, _] = image.pixels[32 * 65 + column];
            u32::from(r) + u32::from(g) + u32::from(b)
        };
        [at(31), at(15)]
    };
    let ([bottom, slope], [plain_bottom, plain_slope]) = (shown(true), shown(false));
    assert!(bottom + 30 < plain_bottom, "{bottom} {plain_bottom}");
    assert!(slope.abs_diff(plain_slope) < 6, "{slope} {plain_slope}");
}

#[test]
fn the_picture_shows_what_is_there_unless_the_whole_box_is_wanted() {
    let covered = |whole| {
        let options = Options {
            size: Size::Longest(64),
            whole,
            ..Options::new(cube(4.0))
        };
        let picture = render(&ball(0.5), &options, &Silent).unwrap();
        picture.statistics.covered
    };
    // Framed, the ball nearly fills the square: π/4 less a margin. In the whole box its disc of
    // radius 1/2 is seen in a square of 8·√3/√2·… ≥ 8 units: at most 1.3 %.
    assert!(covered(false) > 0.5, "{}", covered(false));
    assert!(covered(true) < 0.013, "{}", covered(true));
}

#[test]
fn wrong_options_are_refused() {
    struct Stop;
    impl Monitor for Stop {
        fn progress(&self, _phase: &str, _fraction: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let good = Options {
        size: Size::Longest(16),
        ..Options::new(cube(1.0))
    };
    let option = |options: Options| match render(&ball(0.5), &options, &Silent) {
        Err(PictureError::BadOption { option, .. }) => option,
        other => panic!("{other:?}"),
    };
    for size in [
        Size::Longest(0),
        Size::Exact([5, 0]),
        Size::Exact([20_000, 5_001]),
        Size::Longest(usize::MAX),
        Size::Exact([usize::MAX, 2]),
    ] {
        assert_eq!(option(Options { size, ..good }), "size");
    }
    for samples in [0, 9] {
        assert_eq!(option(Options { samples, ..good }), "samples");
    }
    let many = Size::Longest(5_001);
    assert_eq!(option(Options { size: many, ..good }), "samples");
    for angle in [0.0, -1.0, 3.1, f64::NAN, f64::INFINITY] {
        let perspective = Some(angle);
        assert_eq!(
            option(Options {
                perspective,
                ..good
            }),
            "perspective"
        );
    }
    let view = View {
        azimuth: f64::NAN,
        elevation: 0.0,
    };
    assert_eq!(option(Options { view, ..good }), "view");
    let plane = Options::new(Bounds::from_sides(&[(-1.0, 1.0); 2]).unwrap());
    assert!(matches!(
        render(&ball(0.5), &plane, &Silent),
        Err(PictureError::WrongDimension {
            field: 3,
            bounds: 2
        })
    ));
    assert_eq!(
        render(&ball(0.5), &good, &Stop),
        Err(PictureError::Cancelled)
    );
    assert!(render(&ball(0.5), &good, &Silent).is_ok());
}
