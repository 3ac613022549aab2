//! Motion: free fall, energy, the ground's support, restitution, and the stiffness of the springs' network.

use glam::DVec3;
use imp::elastic::{Body, Division, Drop, ElasticError, Fall, Ground, Lattice, Material};
use imp::engine::{Field, Silent};

use crate::solids::{ball, cube, cuboid};

const GROUND: Ground = Ground {
    gravity: 10.0,
    restitution: 0.7,
    friction: 0.5,
};

fn material(stiffness: f64, damping: f64) -> Material {
    Material {
        density: 2.0,
        stiffness,
        volume_stiffness: stiffness,
        damping,
    }
}

fn lattice(field: &dyn Field, half: f64, cell: f64) -> Lattice {
    let division = Division {
        cell,
        ..Division::new(cube(field.dimension(), half))
    };
    Lattice::new(field, &division, &Silent).unwrap()
}

/// z = z0 + v t − g t²/2: a body that is not deformed feels gravity alone, and velocities in the middle of steps
/// make that exact, up to the rounding of some thousand steps.
#[test]
fn free_fall_is_a_parabola() {
    let lattice = lattice(&ball(3, 0.5), 0.6, 0.2);
    let mut body = Body::new(&lattice, material(500.0, 0.1), GROUND, 2.0).unwrap();
    let start = body.positions();
    body.throw(DVec3::new(0.5, 0.0, 1.0));
    let step = body.stable_step();
    let begin = body.energy(step);
    while body.time() < 0.5 {
        body.step(step);
    }
    let time = body.time();
    let way = DVec3::new(0.5 * time, 0.0, time - 5.0 * time * time);
    for (position, start) in body.positions().into_iter().zip(start) {
        assert!((position - start - way).length() < 1e-10);
    }
    let end = body.energy(step);
    assert!((end.total() / begin.total() - 1.0).abs() < 1e-10);
    assert!(end.elastic + end.lost.abs() < 1e-10 * begin.total());
}

/// Without damping and with ground that gives all back nothing is lost, and the energy swings by the square of the step
/// times the highest frequency that is excited: through an impact and the vibrations after it.
#[test]
fn energy_is_kept_to_second_order_of_the_step() {
    let lattice = lattice(&ball(2, 0.5), 0.6, 0.15);
    let ground = Ground {
        restitution: 1.0,
        friction: 0.0,
        ..GROUND
    };
    let worst = |parts: f64| {
        let mut body = Body::new(&lattice, material(2000.0, 0.0), ground, 0.5).unwrap();
        let step = body.stable_step() / parts;
        let begin = body.energy(step).total();
        let mut worst: f64 = 0.0;
        while body.time() < 1.0 {
            body.step(step);
            let energy = body.energy(step);
            assert!(energy.lost.abs() < 0.05 * begin);
            worst = worst.max((energy.total() / begin - 1.0).abs());
        }
        worst
    };
    let (coarse, fine) = (worst(1.0), worst(4.0));
    assert!(coarse < 0.02, "{coarse}");
    // Sixteen times less; nodes that meet the ground within a step make it somewhat more.
    assert!(fine < coarse / 4.0, "{coarse} {fine}");
}

/// A body at rest is carried: the forces of the ground are its weight, and it hardly sinks in.
#[test]
fn a_body_at_rest_is_carried() {
    // Not a disk, which would roll.
    let rectangle = cuboid(2, DVec3::new(0.5, 0.3, 0.0));
    let lattice = lattice(&rectangle, 0.6, 0.15);
    let mut body = Body::new(&lattice, material(2000.0, 1.0), GROUND, 0.0).unwrap();
    let step = body.stable_step();
    while body.time() < 3.0 {
        body.step(step);
    }
    let weight = 10.0 * body.mass();
    assert!((body.support_force() / weight - 1.0).abs() < 0.01);
    assert!((-0.01..=0.0).contains(&body.lowest()));
    let energy = body.energy(step);
    assert!(energy.kinetic < 1e-6 * energy.gravity, "{energy:?}");
    let before = body.positions();
    for _ in 0..1000 {
        body.step(step);
    }
    let moved = body.positions().into_iter().zip(before);
    assert!(
        moved
            .into_iter()
            .all(|(now, before)| now.distance(before) < 1e-3)
    );
}

/// A stiff ball rises to e² of the height that it fell from. Vibrations and spin, which its few nodes let it
/// take up, leave it a little less.
#[test]
fn a_stiff_ball_bounces_by_its_restitution() {
    let lattice = lattice(&ball(3, 0.5), 0.6, 0.25);
    for restitution in [0.5, 0.7, 0.9] {
        let mut drop = Drop::new(&lattice, 1.0, 10.0, 1.0);
        drop.material.stiffness *= 100.0;
        drop.material.volume_stiffness *= 100.0;
        drop.material.damping = 0.0;
        drop.ground.restitution = restitution;
        drop.time = 0.94;
        drop.every = 0.01;
        let fall = Fall::new(&lattice, &drop, &Silent).unwrap();
        // The centre's height: it begins half a unit above the lowest point.
        let begin = fall.frames[0].energy.gravity;
        let centre = |frame: &imp::elastic::Frame| 1.5 * frame.energy.gravity / begin;
        let apex = fall.frames[50..].iter().map(centre).fold(0.0, f64::max) - 0.5;
        let expected = restitution * restitution;
        assert!((apex - expected).abs() < 0.08, "{apex} {expected}");
    }
}

/// How far the centre sinks on impact does not depend on the cells, since the energy of a strain does not; the coarse
/// disk has four cells along its radius, which leaves some percent.
#[test]
fn the_impact_does_not_depend_on_the_cells() {
    let sinks = |cell: f64| {
        let lattice = lattice(&ball(2, 0.5), 0.6, cell);
        let mut drop = Drop::new(&lattice, 1.0, 10.0, 1.0);
        drop.time = 0.7;
        drop.every = 0.005;
        let fall = Fall::new(&lattice, &drop, &Silent).unwrap();
        let begin = fall.frames[0].energy.gravity;
        let heights = fall
            .frames
            .iter()
            .map(|frame| 1.5 * frame.energy.gravity / begin);
        0.5 - heights.fold(f64::INFINITY, f64::min)
    };
    let (coarse, fine) = (sinks(0.12), sinks(0.06));
    assert!(fine > 0.05, "{fine}");
    assert!((coarse / fine - 1.0).abs() < 0.2, "{coarse} {fine}");
}

#[test]
fn falls_do_not_depend_on_threads() {
    // More springs than a single thread would be given.
    let lattice = lattice(&ball(3, 0.5), 0.6, 0.09);
    assert!(lattice.springs.len() > 4096);
    let fall = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let mut drop = Drop::new(&lattice, 1.0, 10.0, 0.01);
        (drop.time, drop.every) = (0.08, 0.04);
        pool.unwrap()
            .install(|| Fall::new(&lattice, &drop, &Silent).unwrap().frames)
    };
    assert_eq!(fall(1), fall(3));
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    let lattice = lattice(&ball(2, 0.5), 0.6, 0.2);
    let error = |change: &dyn Fn(&mut Drop)| {
        let mut drop = Drop::new(&lattice, 1.0, 10.0, 1.0);
        change(&mut drop);
        Fall::new(&lattice, &drop, &Silent).unwrap_err()
    };
    let refused = |name: &str, change: &dyn Fn(&mut Drop)| {
        let error = error(change);
        assert!(matches!(error, ElasticError::Number { name: found, .. } if found == name));
    };
    refused("density", &|drop| drop.material.density = 0.0);
    refused("stiffness", &|drop| drop.material.stiffness = f64::NAN);
    refused("damping", &|drop| drop.material.damping = -1.0);
    refused("gravity", &|drop| drop.ground.gravity = f64::INFINITY);
    refused("restitution", &|drop| drop.ground.restitution = 0.0);
    refused("friction", &|drop| drop.ground.friction = -0.1);
    refused("height", &|drop| drop.height = -1.0);
    refused("time", &|drop| drop.time = 0.0);
    refused("every", &|drop| drop.every = f64::NAN);
    // The number of steps grows with the root of the stiffness: it is estimated before any is made.
    let stiff = error(&|drop| drop.material.stiffness = 1e16);
    assert!(matches!(stiff, ElasticError::TooManySteps { steps, .. } if steps > 5e6));
    let film = error(&|drop| drop.every = 1e-7);
    assert!(matches!(
        film,
        ElasticError::TooManySteps { .. } | ElasticError::TooManyPoints { .. }
    ));
}
