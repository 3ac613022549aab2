//! A mesh whose vertices are samples of the level set: the restricted Delaunay triangulation.
//!
//! A triangle of the samples' Delaunay triangulation is taken where its dual edge, the segment
//! between the centres of the two spheres around its neighbours, crosses the level set (H. Edelsbrunner and
//! N. R. Shah, "Triangulating topological spaces", 1994). Of samples that are dense in comparison with
//! curvature and thickness this is a manifold with the topology of the surface, and its triangles are as good
//! as the samples are spread. It answers the question at the end of A. P. Witkin and P. S. Heckbert, "Using
//! particles to sample and control implicit surfaces" (1994): how to make polygons of particles.
//!
//! In reading order: `cloud` has the samples, `restricted` the triangles, `fans` says where these are no
//! manifold. Where they are not, or where a triangle is far from the level set or athwart it, the
//! farthest crossing of a dual edge is inserted, as L. P. Chew, "Guaranteed-quality mesh
//! generation for curved surfaces" (1993), and J.-D. Boissonnat and S. Oudot, "Provably good
//! sampling and meshing of surfaces" (2005), do from the beginning. What is left after some rounds is made a manifold by
//! giving each fan of triangles at a vertex a vertex of its own.

mod cloud;
mod fans;
mod restricted;

use rayon::prelude::*;

use self::cloud::Cloud;
use self::fans::{Fans, fans};
use self::restricted::{Crossing, Crossings, crossings};
use super::grid::Seen;
use super::{Found, Job, PolygonizeError, Shape, Statistics};
use crate::geometry::{Delaunay, Mesh};

/// Rounds of insertion.
const ROUNDS: usize = 12;

/// A triangle is too far from its corners' samples beyond this multiple of the distances between
/// neighbours: of random samples the widest gaps are that wide.
const GAP: f64 = 4.0;

/// The cosine of the angle that a triangle may have with the level set.
const ATHWART: f64 = 0.5;

/// Points are not inserted nearer to others than this part of the usual distance.
const CLOSEST: f64 = 0.2;

/// The mesh whose vertices are the samples among the options or, without any, floaters at distances of a cell.
pub(super) fn triangulate(job: &Job) -> Result<Found, PolygonizeError> {
    let progress = |part: f64| job.monitor.progress("triangulate", part);
    let mut cloud = Cloud::new(job)?;
    if cloud.len() == 0 {
        let nothing = Shape::Mesh(Mesh::default());
        return Ok((nothing, cloud.surroundings(job), cloud.statistics));
    }
    progress(0.0);
    let mut delaunay = Delaunay::new(&job.options.bounds);
    let doubles = delaunay.extend(&cloud.shaken(0));
    cloud.statistics.left_out += doubles.len();
    let mut round = 0;
    let (found, fans) = loop {
        if job.monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        progress((round + 1) as f64 / (ROUNDS + 2) as f64);
        let found = crossings(job, &delaunay);
        cloud.statistics.evaluations += found.evaluations;
        let fans = fans(&found.crossings, &cloud.positions);
        let wanted = match round {
            ROUNDS => Vec::new(),
            _ => cloud.wanted(&found.crossings, &fans),
        };
        if wanted.is_empty() {
            break (found, fans);
        }
        let first = cloud.len();
        cloud.insert(&wanted);
        delaunay.extend(&cloud.shaken(first));
        round += 1;
    };
    if found.crossings.is_empty() {
        return Err(PolygonizeError::TooSparse {
            samples: cloud.len(),
        });
    }
    Ok(finish(cloud, &delaunay, &found, &fans))
}

/// The mesh of the triangles, with a vertex for each fan.
fn finish(cloud: Cloud, delaunay: &Delaunay, found: &Crossings, fans: &Fans) -> Found {
    let mut mesh = Mesh::default();
    let mut numbers = vec![u32::MAX; 3 * found.crossings.len()];
    let mut owners = vec![false; cloud.len()];
    let mut doubled = 0;
    for (triangle, crossing) in found.crossings.iter().enumerate() {
        let corners = [0, 1, 2].map(|corner| {
            let fan = fans.of_corner[3 * triangle + corner] as usize;
            if numbers[fan] == u32::MAX {
                let sample = crossing.corners[corner] as usize;
                numbers[fan] = mesh.positions.len() as u32;
                mesh.positions.push(cloud.positions[sample]);
                mesh.normals.push(cloud.normals[sample]);
                doubled += usize::from(owners[sample]);
                owners[sample] = true;
            }
            numbers[fan]
        });
        mesh.triangles.push(corners);
    }
    let given = &owners[..cloud.len() - cloud.statistics.inserted];
    let used = given.iter().filter(|&&used| used).count();
    let count = |matches: fn(&Crossing) -> bool| {
        (found.crossings.iter())
            .filter(|crossing| matches(crossing))
            .count()
    };
    let statistics = Statistics {
        cells: delaunay.places(),
        good_roots: mesh.positions.len(),
        poor_roots: count(|crossing| crossing.root.is_poor()),
        domain_ends: count(|crossing| crossing.root.is_domain_end()),
        cut_by_box: fans.borders > 0,
        left_out: cloud.left_out_before + given.len() - used,
        doubled,
        athwart: count(Crossing::is_athwart),
        nan_points: 0,
        ..cloud.statistics
    };
    (Shape::Mesh(mesh), Seen::default(), statistics)
}

impl Crossing {
    /// Whether the triangle is at too large an angle with the level set.
    fn is_athwart(&self) -> bool {
        !self.root.is_poor() && self.cosine < ATHWART
    }
}

impl Cloud {
    /// The crossings that should become samples: where there is no manifold, and where triangles are
    /// too large or athwart; the farthest first, and no two at the same triangle's corners.
    fn wanted(&self, crossings: &[Crossing], fans: &Fans) -> Vec<super::edge_roots::Root> {
        let mut candidates: Vec<(f64, usize)> = (crossings.par_iter().enumerate())
            .filter_map(|(number, crossing)| {
                let usual = self.distance_at(crossing.corners);
                let is_bad = crossing.radius > GAP * usual
                    || crossing.is_athwart()
                    || fans.is_bad(crossing.corners);
                let may = crossing.radius > CLOSEST * usual && !crossing.root.is_poor();
                (is_bad && may).then_some((crossing.radius, number))
            })
            .collect();
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut taken = vec![false; self.len()];
        let mut wanted = Vec::new();
        for (_, number) in candidates {
            let corners = crossings[number].corners.map(|corner| corner as usize);
            if corners.iter().all(|&corner| !taken[corner]) {
                corners.iter().for_each(|&corner| taken[corner] = true);
                wanted.push(crossings[number].root);
            }
        }
        wanted
    }
}
