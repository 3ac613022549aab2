use super::*;

/// Numbers between 0 and 1 that look random.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

fn unit_box() -> Bounds {
    Bounds::from_sides(&[(-1.0, 1.0); 3]).unwrap()
}

/// Fails unless neighbours agree, volumes are positive and fill the cube, and no sphere holds a vertex.
fn check(delaunay: &Delaunay) {
    let mut volume = 0.0;
    for place in 0..delaunay.places() as u32 {
        let own = delaunay.tetrahedra[place as usize];
        if own.is_free() {
            continue;
        }
        let corners = delaunay.corners(place);
        let [a, b, c, d] = corners;
        assert_eq!(side_of_plane(a, b, c, d), Side::Greater);
        volume += (b - a).cross(c - a).dot(d - a) / 6.0;
        for (facet, corners) in FACETS.iter().enumerate() {
            let beyond = own.neighbours[facet];
            if beyond == NONE {
                continue;
            }
            let other = delaunay.tetrahedra[beyond as usize];
            assert!(!other.is_free());
            let back = other.facet_to(place);
            assert_eq!(other.neighbours[back], place);
            let mut ours = corners.map(|corner| own.vertices[corner]);
            let mut theirs = FACETS[back].map(|corner| other.vertices[corner]);
            ours.sort_unstable();
            theirs.sort_unstable();
            assert_eq!(ours, theirs);
        }
        for &vertex in &delaunay.vertices {
            assert_ne!(side_of_sphere(corners, vertex), Side::Greater);
        }
    }
    let side = CUBE * unit_box().diagonal();
    assert!((volume / (side * side * side) - 1.0).abs() < 1e-12);
}

fn triangulated(points: &[DVec3]) -> (Delaunay, Vec<u32>) {
    let mut delaunay = Delaunay::new(&unit_box());
    let doubles = delaunay.extend(points);
    assert_eq!(delaunay.vertices.len(), points.len() + 8);
    check(&delaunay);
    (delaunay, doubles)
}

#[test]
fn no_sphere_holds_a_point() {
    let mut random = Random(7);
    let points: Vec<DVec3> = (0..300)
        .map(|_| 2.0 * random.point() - DVec3::ONE)
        .collect();
    let (_, doubles) = triangulated(&points);
    assert!(doubles.is_empty());
}

#[test]
fn points_of_a_grid_on_a_sphere_in_a_plane_and_on_a_line_are_no_exception() {
    let mut grid = Vec::new();
    for x in -2..=2 {
        for y in -2..=2 {
            grid.extend((-2..=2).map(|z| DVec3::from([x, y, z].map(f64::from)) / 2.0));
        }
    }
    triangulated(&grid);
    let flat: Vec<DVec3> = grid.iter().map(|point| point.with_z(0.0)).collect();
    let (_, doubles) = triangulated(&flat);
    assert_eq!(doubles.len(), 100);
    let straight: Vec<DVec3> = (0..50).map(|n| DVec3::splat(f64::from(n) / 64.0)).collect();
    triangulated(&straight);
    let mut random = Random(3);
    let on_sphere = (0..150).map(|_| (2.0 * random.point() - DVec3::ONE).normalize());
    triangulated(&on_sphere.collect::<Vec<_>>());
}

#[test]
fn points_in_the_same_place_are_told() {
    let points = [0.25, 0.5, 0.25, 0.125, 0.5].map(DVec3::splat);
    let (delaunay, doubles) = triangulated(&points);
    assert_eq!(doubles.len(), 2);
    let facets = (0..delaunay.places() as u32).flat_map(|place| delaunay.facets_of(place));
    let named: Vec<u32> = facets.flat_map(|facet| facet.corners).collect();
    assert!(doubles.iter().all(|double| !named.contains(double)));
    triangulated(&[]);
}

#[test]
fn later_points_may_follow() {
    let mut random = Random(11);
    let points: Vec<DVec3> = (0..120).map(|_| random.point()).collect();
    let mut delaunay = Delaunay::new(&unit_box());
    for part in points.chunks(17) {
        assert!(delaunay.extend(part).is_empty());
    }
    check(&delaunay);
    assert_eq!(delaunay.extend(&points[..3]), [120, 121, 122]);
}

#[test]
fn circumcentres_are_as_far_from_all_corners() {
    let mut random = Random(5);
    let points: Vec<DVec3> = (0..40).map(|_| random.point()).collect();
    let (delaunay, _) = triangulated(&points);
    for place in 0..delaunay.places() as u32 {
        let center = delaunay.circumcentre(place);
        if delaunay.tetrahedra[place as usize].is_free() {
            assert!(center.is_nan());
            continue;
        }
        let radii = delaunay
            .corners(place)
            .map(|corner| corner.distance(center));
        assert!(
            radii
                .iter()
                .all(|radius| (radius / radii[0] - 1.0).abs() < 1e-6)
        );
    }
}
