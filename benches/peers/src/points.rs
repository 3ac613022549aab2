//! Where fields are evaluated: points and boxes in [−1, 1]³, without order.

/// Coordinates of points, by axis.
pub fn points(count: usize) -> [Vec<f64>; 3] {
    [0.371, 0.733, 0.193].map(|step| {
        let coordinates = (0..count).map(|index| (index as f64 * step) % 2.0 - 1.0);
        // Numbers of single precision, so that both programs get the same points.
        coordinates.map(|x| f64::from(x as f32)).collect()
    })
}

/// The same in single precision.
pub fn points_f32(count: usize) -> [Vec<f32>; 3] {
    points(count).map(|column| column.into_iter().map(|x| x as f32).collect())
}

/// The lower and upper sides of boxes, by axis.
pub fn boxes(count: usize) -> [Vec<(f32, f32)>; 3] {
    points_f32(count).map(|column| column.into_iter().map(|x| (x, x + 0.05)).collect())
}
