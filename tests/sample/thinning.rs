//! Thinning by δ-cliques.

use std::collections::BTreeSet;

use crate::fields::*;
use glam::DVec3;
use imp::geometry::Samples;
use imp::sample::{Keep, SampleError, thin};

const DELTA: f64 = 0.2;

fn dense() -> Samples {
    run(&sphere(DVec3::ZERO, 1.0), &particles()).samples
}

/// The buckets of side DELTA over the bounding box of `all` that hold points of `some`.
fn buckets(all: &Samples, some: &Samples) -> BTreeSet<[i64; 3]> {
    let low = all.positions.iter().copied().reduce(DVec3::min).unwrap();
    let key = |&p: &DVec3| ((p - low) / DELTA).floor().to_array().map(|k| k as i64);
    some.positions.iter().map(key).collect()
}

#[test]
fn every_bucket_keeps_exactly_one_of_its_points() {
    let dense = dense();
    let thinned = thin(&dense, DELTA, Keep::Representative).unwrap();
    let kept = buckets(&dense, &thinned);
    assert_eq!(kept.len(), thinned.positions.len(), "one a bucket");
    assert_eq!(kept, buckets(&dense, &dense), "no bucket lost");
    assert!(thinned.positions.len() < dense.positions.len() / 3);
    for (place, position) in thinned.positions.iter().enumerate() {
        let origin = dense.positions.iter().position(|p| p == position).unwrap();
        assert_eq!(thinned.normals[place], dense.normals[origin]);
        assert_eq!(thinned.residuals[place], dense.residuals[origin]);
    }
}

#[test]
fn barycentres_are_put_back_onto_the_surface() {
    let field = sphere(DVec3::ZERO, 1.0);
    let dense = dense();
    let thinned = thin(&dense, DELTA, Keep::Barycenter(&field)).unwrap();
    assert_eq!(thinned.positions.len(), buckets(&dense, &dense).len());
    for (place, position) in thinned.positions.iter().enumerate() {
        assert!((position.length() - 1.0).abs() < 4e-9);
        assert!(position.distance(thinned.normals[place]) < 1e-8);
        assert!(thinned.residuals[place] < 4e-9);
    }
    // Barycentres lie more evenly than members of the buckets do.
    let apart = |keep| thin(&dense, DELTA, keep).unwrap().spacing().unwrap();
    let (barycentre, representative) =
        (apart(Keep::Barycenter(&field)), apart(Keep::Representative));
    assert!(barycentre.mean > representative.mean);
}

#[test]
fn radii_are_those_of_the_thinned_sample() {
    let thinned = thin(&dense(), DELTA, Keep::Representative).unwrap();
    for (place, position) in thinned.positions.iter().enumerate() {
        let others = thinned.positions.iter().enumerate();
        let nearest = others
            .filter(|&(other, _)| other != place)
            .map(|(_, other)| other.distance(*position))
            .fold(f64::INFINITY, f64::min);
        assert!((thinned.radii[place] - nearest / 2.0).abs() <= 1e-15);
    }
}

#[test]
fn coincident_points_become_one_and_none_stay_none() {
    let three = Samples {
        dimension: 1,
        positions: vec![DVec3::X; 3],
        normals: vec![DVec3::X; 3],
        radii: vec![0.0; 3],
        residuals: vec![0.0; 3],
        tangents: Vec::new(),
        weights: Vec::new(),
    };
    let one = thin(&three, 0.5, Keep::Representative).unwrap();
    assert_eq!(one.positions, [DVec3::X]);
    assert_eq!(one.radii, [0.0]);
    let none = Samples::default();
    assert_eq!(thin(&none, 1.0, Keep::Representative).unwrap(), none);
}

#[test]
fn a_side_that_makes_no_buckets_is_refused() {
    let dense = dense();
    for delta in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-18] {
        let error = thin(&dense, delta, Keep::Representative).unwrap_err();
        assert!(matches!(
            error,
            SampleError::Option {
                option: "delta",
                ..
            }
        ));
    }
    let line = field(1, |p| (p.x, DVec3::X));
    let error = thin(&dense, 1.0, Keep::Barycenter(&line)).unwrap_err();
    assert!(matches!(error, SampleError::Dimension { .. }));
}
