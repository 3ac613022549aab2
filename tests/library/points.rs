//! Points to test at: random ones, the same in every run, and those where formulas go wrong.

/// Half of the side of the cube in which points lie.
pub(crate) const REACH: f64 = 2.0;

/// Random points in a cube, by a linear congruential generator.
pub(crate) fn random(dimension: usize, count: usize) -> Vec<Vec<f64>> {
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        REACH * ((state >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    };
    (0..count)
        .map(|_| (0..dimension).map(|_| next()).collect())
        .collect()
}

/// The origin, points on the axes and diagonals, and points far away.
pub(crate) fn special(dimension: usize) -> Vec<Vec<f64>> {
    let places = [-100.0, -1.0, -0.5, 0.0, 0.5, 1.0];
    let count = places.len().pow(dimension as u32);
    (0..count)
        .map(|index| {
            (0..dimension)
                .map(|axis| places[index / places.len().pow(axis as u32) % places.len()])
                .collect()
        })
        .collect()
}

/// Points along straight ways through the cube, in small steps, so that jumps show.
pub(crate) fn ways(dimension: usize) -> Vec<Vec<Vec<f64>>> {
    const STEPS: usize = 60;
    let ends = random(dimension, 16);
    let point = |from: &[f64], to: &[f64], step: usize| {
        let t = step as f64 / STEPS as f64;
        from.iter().zip(to).map(|(a, b)| a + t * (b - a)).collect()
    };
    ends.chunks(2)
        .map(|pair| {
            (0..=STEPS)
                .map(|step| point(&pair[0], &pair[1], step))
                .collect()
        })
        .collect()
}
