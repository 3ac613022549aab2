//! Pictures of what closed plane curves surround, filled by the even-odd rule, and of the ground below.

use glam::Vec3;
use rayon::prelude::*;

use super::color::{PALETTE, pixel};
use super::{Options, Picture, PictureError, Statistics, checked_film};
use crate::geometry::{Curves, Image};

/// Pictures of sets of closed curves in the plane, all of the box of the options; the ground, if it is shown,
/// is all below y = 0. Of the options the size, the samples and the transparency count besides.
///
/// # Errors
///
/// For a box that is not in R2, and for sizes as in [`super::render`].
pub fn render_outlines(
    scenes: &[Curves],
    ground: bool,
    options: &Options,
) -> Result<Vec<Picture>, PictureError> {
    if options.bounds.dimension != 2 {
        return Err(PictureError::WrongDimension {
            field: 2,
            bounds: options.bounds.dimension,
        });
    }
    let size = checked_film(options, scenes.len())?;
    let pictures = scenes
        .par_iter()
        .map(|curves| picture(curves, ground, options, size));
    Ok(pictures.collect())
}

fn picture(
    curves: &Curves,
    ground: bool,
    options: &Options,
    [width, height]: [usize; 2],
) -> Picture {
    let samples = options.samples;
    let fine = [width * samples, height * samples];
    let bounds = options.bounds;
    let unit = (bounds.size().x / fine[0] as f64).max(bounds.size().y / fine[1] as f64);
    let left = bounds.center().x - 0.5 * unit * fine[0] as f64;
    let top = bounds.center().y + 0.5 * unit * fine[1] as f64;
    let mut counts = vec![[0_u32; 2]; width * height];
    for row in 0..fine[1] {
        let y = top - (row as f64 + 0.5) * unit;
        let line = &mut counts[row / samples * width..][..width];
        for ends in crossings(curves, y).chunks_exact(2) {
            let place =
                |x: f64| ((x - left) / unit - 0.5).ceil().clamp(0.0, fine[0] as f64) as usize;
            for column in place(ends[0])..place(ends[1]) {
                line[column / samples][0] += 1;
            }
        }
        if ground && y < 0.0 {
            for count in line {
                count[1] += samples as u32;
            }
        }
    }
    let whole = (samples * samples) as f32;
    let covered: u64 = counts.iter().map(|count| u64::from(count[0])).sum();
    let shade = |&[solid, below]: &[u32; 2]| {
        let (solid, below) = (solid as f32 / whole, below as f32 / whole);
        // What is in the ground's dents is the solid.
        let below = below.min(1.0 - solid);
        let share = solid + below;
        let light = solid * PALETTE.inside_near + below * PALETTE.undefined;
        match options.transparent {
            true if share > 0.0 => pixel(light / share, share),
            true => pixel(Vec3::ZERO, 0.0),
            false => pixel(light + (1.0 - share) * PALETTE.paper, 1.0),
        }
    };
    Picture {
        image: Image {
            width,
            height,
            pixels: counts.iter().map(shade).collect(),
        },
        statistics: Statistics {
            covered: covered as f64 / (fine[0] * fine[1]) as f64,
            ..Statistics::default()
        },
    }
}

/// Where curves cross a horizontal line, ascending: an even number of places, since they are closed.
fn crossings(curves: &Curves, y: f64) -> Vec<f64> {
    let mut places = Vec::new();
    for polyline in &curves.polylines {
        let points = &polyline.points;
        for (place, from) in points.iter().enumerate() {
            let to = points[(place + 1) % points.len()];
            if (from.y <= y) != (to.y <= y) {
                places.push(from.x + (y - from.y) / (to.y - from.y) * (to.x - from.x));
            }
        }
    }
    places.sort_unstable_by(f64::total_cmp);
    places
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::{Bounds, Polyline};
    use crate::picture::Size;

    #[test]
    fn holes_are_left_out_and_the_ground_is_below() {
        let square = |half: f64| Polyline {
            points: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| DVec3::new(half * x, half * y, 0.0))
                .to_vec(),
            closed: true,
        };
        let curves = Curves {
            dimension: 2,
            polylines: vec![square(0.5), square(0.25)],
        };
        let options = Options {
            size: Size::Longest(64),
            ..Options::new(Bounds::from_sides(&[(-1.0, 1.0); 2]).unwrap())
        };
        let picture = render_outlines(&[curves], true, &options)
            .unwrap()
            .remove(0);
        // (1² − 0.5²) of 2² square units; all corners lie between pixels.
        assert_eq!(picture.statistics.covered, 0.1875);
        let at = |x: usize, y: usize| picture.image.pixels[y * 64 + x];
        assert_eq!(at(1, 1), at(32, 28));
        assert_ne!(at(1, 1), at(32, 18));
        assert_ne!(at(1, 1), at(1, 40));
        assert_eq!(at(1, 40), at(32, 36));
        assert_ne!(at(1, 40), at(32, 46));
    }
}
