//! Pictures of fields: a graph over R1, a map with contour lines in R2, a lit solid in R3; and of
//! samples.
//!
//! One entry, [`render`], makes an image of any field. `line` draws graphs; `plane` evaluates F
//! at every pixel, or only the sign of F where intervals leave it open ([`bitmap`]), and `tone`
//! colours it; `space` finds what each pixel of a [`Camera`] sees ([`height_map`]), `root` where
//! exactly, and `light` shades it; `disks` shows samples, `meshes` triangles, `outlines` what
//! closed curves surround. `color` knows the palette. What is smaller than a pixel can
//! be missed; an image does not depend on the number of threads.

mod camera;
mod color;
mod disks;
mod light;
mod line;
mod march;
mod meshes;
mod outlines;
mod plane;
mod root;
mod space;
mod tone;

use thiserror::Error;

use crate::engine::{CompiledField, Field, Monitor};
use crate::geometry::{Bounds, Image};

pub use camera::{Aim, Camera, View};
pub use disks::{Scene, box_around, render_samples};
pub use meshes::{box_around_points, render_meshes};
pub use outlines::render_outlines;
pub use plane::{Bitmap, Side, bitmap};
pub use space::{HeightMap, Hit, height_map};

/// The most pixels of an image, and the most rays of one.
const LARGEST: usize = 100_000_000;

/// The most samples along a side of a pixel.
const MOST_SAMPLES: usize = 8;

/// Pixels of the rough picture in which a solid is searched for.
const ROUGH: usize = 160;

/// How much larger than the solid the picture is.
const MARGIN: f64 = 1.05;

/// Where a phase of the work is reported.
const PHASE: &str = "rendering";

/// How large an image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Pixels along the longer side. A map has the proportions of its box, a solid's image is
    /// square, and a graph is wider than it is high.
    Longest(usize),
    /// Pixels in a row, and rows.
    Exact([usize; 2]),
}

/// How a field in the plane is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Shades by the distance |F|/|F_x|, contour lines, and a strong line at F = 0.
    Shaded,
    /// Two colours, inside and outside.
    Fill,
}

/// What a picture is to be like.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// What is shown of the plane or line, and what a solid is cut by.
    pub bounds: Bounds,
    /// The image's size.
    pub size: Size,
    /// R2: how the field is shown.
    pub style: Style,
    /// R2: the difference of F between contour lines; `None` for a suitable one.
    pub step: Option<f64>,
    /// R3: from where.
    pub view: View,
    /// R3: the angle of view across the shorter side, in radians; `None` for parallel rays.
    pub perspective: Option<f64>,
    /// R3: whether the picture is of the whole box, not only of what is seen in it.
    pub whole: bool,
    /// R3: whether corners that little light reaches are darker.
    pub occlusion: bool,
    /// R3: rays along each side of a pixel; more make smoother edges.
    pub samples: usize,
    /// Whether what is not the object is left transparent: the outside of it.
    pub transparent: bool,
}

impl Options {
    /// A picture of 512 pixels of this box.
    pub fn new(bounds: Bounds) -> Options {
        Options {
            bounds,
            size: Size::Longest(512),
            style: Style::Shaded,
            step: None,
            view: View::default(),
            perspective: None,
            whole: false,
            occlusion: false,
            samples: 2,
            transparent: false,
        }
    }
}

/// What is known of a picture besides its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// The share of the image that the object covers: the inside, the solid, the curve.
    pub covered: f64,
    /// At how many points that were looked at F is not a number. In R2 these are pixels.
    pub undefined: u64,
    /// R3: how many rays end at the inside without a zero there: at jumps, poles, and where F
    /// begins to be defined.
    pub jumps: u64,
    /// R2: the difference of F between contour lines.
    pub step: Option<f64>,
}

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The pixels.
    pub image: Image,
    /// What is known of it.
    pub statistics: Statistics,
}

/// Why there is no picture.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PictureError {
    /// An option makes no sense.
    #[error("{message}")]
    BadOption {
        /// Its name.
        option: &'static str,
        /// What is wrong.
        message: String,
    },
    /// Box and field, or camera and field, are of different dimensions.
    #[error("the field is defined in R{field}, but the box has {bounds} sides")]
    WrongDimension {
        /// The field's.
        field: usize,
        /// The box's.
        bounds: usize,
    },
    /// The monitor said so.
    #[error("the picture was cancelled")]
    Cancelled,
}

/// A picture of the field.
///
/// # Errors
///
/// A size of 0 or of more than 100 megapixels, an angle that is none, a box of another
/// dimension, or `Cancelled` if the monitor says so.
pub fn render(
    field: &CompiledField,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Picture, PictureError> {
    let (dimension, bounds) = (field.dimension(), options.bounds.dimension);
    if dimension != bounds {
        return Err(PictureError::WrongDimension {
            field: dimension,
            bounds,
        });
    }
    let size = checked_size(options)?;
    let picture = match dimension {
        1 => line::render(field, options, size),
        2 => plane::render(field, options, size, monitor)?,
        _ => solid(field, options, size, monitor)?,
    };
    monitor.progress(PHASE, 1.0);
    Ok(picture)
}

fn bad<T>(option: &'static str, message: String) -> Result<T, PictureError> {
    Err(PictureError::BadOption { option, message })
}

/// Pixels in a row, and rows, if that and the number of samples make sense.
fn checked_size(options: &Options) -> Result<[usize; 2], PictureError> {
    let [width, height] = match options.size {
        Size::Exact(size) => size,
        Size::Longest(longest) => proportioned(&options.bounds, longest),
    };
    if width == 0 || height == 0 {
        return bad("size", "a picture must have at least one pixel".into());
    }
    let megapixels = width as f64 * height as f64 / 1e6;
    if megapixels > LARGEST as f64 / 1e6 {
        let message = format!(
            "{width} by {height} are {megapixels:.0} megapixels; a picture may have {}",
            LARGEST / 1_000_000
        );
        return bad("size", message);
    }
    let samples = options.samples;
    if !(1..=MOST_SAMPLES).contains(&samples) {
        let message = format!("`samples` must be from 1 to {MOST_SAMPLES}, but it is {samples}");
        return bad("samples", message);
    }
    if options.bounds.dimension == 3 && width * height * samples * samples > LARGEST {
        let message = format!(
            "{width} by {height} pixels with {samples} by {samples} samples each are more than \
             the {} million rays that a picture may have",
            LARGEST / 1_000_000
        );
        return bad("samples", message);
    }
    Ok([width, height])
}

/// The size of each of so many pictures, if all of them together are not too large.
fn checked_film(options: &Options, pictures: usize) -> Result<[usize; 2], PictureError> {
    let size = checked_size(options)?;
    if (size[0] * size[1]).saturating_mul(pictures) > LARGEST {
        let message = format!(
            "{pictures} pictures of {} by {} pixels are too many: together at most {LARGEST} pixels",
            size[0], size[1],
        );
        return bad("size", message);
    }
    Ok(size)
}

/// The size with so many pixels along the longer side.
fn proportioned(bounds: &Bounds, longest: usize) -> [usize; 2] {
    let part = |ratio: f64| ((longest as f64 * ratio).round() as usize).clamp(1, longest.max(1));
    match bounds.dimension {
        _ if longest == 0 => [0, 0],
        1 => [longest, part(0.625)],
        2 => {
            let [width, height] = [bounds.size().x, bounds.size().y];
            match width >= height {
                true => [longest, part(height / width)],
                false => [part(width / height), longest],
            }
        }
        _ => [longest, longest],
    }
}

/// Whether the angles of the view make sense.
fn check_angles(options: &Options) -> Result<(), PictureError> {
    if let Some(angle) = options.perspective
        && !(angle > 0.0 && angle < 3.0)
    {
        let degrees = angle.to_degrees();
        let message = format!(
            "the angle of view must be greater than 0 and less than 170 degrees, but it is \
             {degrees:.4}"
        );
        return bad("perspective", message);
    }
    let View { azimuth, elevation } = options.view;
    if !(azimuth.is_finite() && elevation.is_finite()) {
        return bad("view", "the angles of a view must be finite".into());
    }
    Ok(())
}

/// A picture of a solid.
fn solid(
    field: &CompiledField,
    options: &Options,
    size: [usize; 2],
    monitor: &dyn Monitor,
) -> Result<Picture, PictureError> {
    check_angles(options)?;
    let aim = Aim {
        bounds: options.bounds,
        view: options.view,
        perspective: options.perspective,
        size,
    };
    let mut camera = Camera::new(&aim);
    let [width, height] = size.map(|count| count as f64);
    let mut part = [0.0, 0.0, width, height];
    if !options.whole {
        part = seen(field, &camera, monitor)?.unwrap_or(part);
    }
    let [left, top, right, bottom] = part;
    let margin = [right - left, bottom - top].map(|length| 0.5 * (MARGIN - 1.0) * length);
    camera = camera.framed([
        left - margin[0],
        top - margin[1],
        right + margin[0],
        bottom + margin[1],
    ]);
    let fine = camera.resized(size.map(|count| count * options.samples));
    let map = height_map(field, &fine, monitor)?;
    let image = light::shade(&map, &fine, options);
    let count = |hit: Hit| map.hits.iter().filter(|&&found| found == hit).count();
    let (nothing, rays) = (count(Hit::Nothing), map.hits.len());
    Ok(Picture {
        image,
        statistics: Statistics {
            covered: (rays - nothing) as f64 / rays as f64,
            undefined: map.undefined,
            jumps: count(Hit::Jump) as u64,
            step: None,
        },
    })
}

/// The part of the image in which something is seen, in pixels: left, top, right, bottom; to the
/// pixel of a rough picture. Nothing if nothing is seen.
fn seen(
    field: &CompiledField,
    camera: &Camera,
    monitor: &dyn Monitor,
) -> Result<Option<[f64; 4]>, PictureError> {
    let size = camera.size();
    let longest = size[0].max(size[1]);
    let rough = size.map(|count| (count * ROUGH.min(longest)).div_ceil(longest));
    let map = height_map(field, &camera.resized(rough), monitor)?;
    let mut rectangle: Option<[usize; 4]> = None;
    for (index, _) in map
        .hits
        .iter()
        .enumerate()
        .filter(|(_, hit)| **hit != Hit::Nothing)
    {
        let (x, y) = (index % map.width, index / map.width);
        let [left, top, right, bottom] = rectangle.unwrap_or([x, y, x, y]);
        rectangle = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
    }
    let [across, down] = [0, 1].map(|axis| size[axis] as f64 / rough[axis] as f64);
    Ok(rectangle.map(|[left, top, right, bottom]| {
        // What is there may reach into the next pixels.
        [
            (left as f64 - 0.5) * across,
            (top as f64 - 0.5) * down,
            (right as f64 + 1.5) * across,
            (bottom as f64 + 1.5) * down,
        ]
    }))
}
