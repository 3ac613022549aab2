//! Cameras: which ray of space each pixel sees.
//!
//! A camera maps *screen coordinates* to points: u counts pixels from the left edge of the image,
//! v from its top, and the depth counts slices from the plane nearest to the eye, so that
//! resolution has nothing to do with the domain's units. The map is written into the field's
//! graph ([`Camera::compose`]), and then a part of the screen with a range of depths is a box for
//! the engine like any other. The camera's numbers are parameters, so that turning it changes
//! q alone, as long as the same of them are 0.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::engine::{CompiledField, Field};
use crate::geometry::Bounds;
use crate::graph::{Graph, Node, NodeId, Op};
use crate::math::scalar;

/// The number of slices is a multiple of this, for the subdivision's sake.
pub(super) const SLICE_GROUP: usize = 32;

/// The most slices, in units of the image's longer side.
const DEEPEST: usize = 4;

/// From where a solid is seen; z is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// How far the camera has gone around the z axis, in radians: at 0 it is in front (at
    /// negative y), at a quarter turn on the right (at positive x).
    pub azimuth: f64,
    /// How high it is above the horizon, in radians: a quarter turn is straight above.
    pub elevation: f64,
}

impl Default for View {
    /// The isometric one.
    fn default() -> View {
        let (_, azimuth, elevation) = NAMED[0];
        View {
            azimuth: azimuth.to_radians(),
            elevation: elevation.to_radians(),
        }
    }
}

/// The views that have names; the first one is the default.
const NAMED: [(&str, f64, f64); 7] = [
    ("isometric", 45.0, ISOMETRIC_ELEVATION),
    ("front", 0.0, 0.0),
    ("back", 180.0, 0.0),
    ("left", 270.0, 0.0),
    ("right", 90.0, 0.0),
    ("top", 0.0, 90.0),
    ("bottom", 0.0, -90.0),
];

/// atan(1/√2) in degrees: all three axes have the same length in the image.
const ISOMETRIC_ELEVATION: f64 = 35.264_389_682_754_654;

impl View {
    /// The view of this name: isometric, front, back, left, right, top or bottom.
    pub fn named(name: &str) -> Option<View> {
        let (_, azimuth, elevation) = NAMED.iter().find(|(known, ..)| *known == name)?;
        Some(View {
            azimuth: azimuth.to_radians(),
            elevation: elevation.to_radians(),
        })
    }

    /// The names of all views.
    pub fn names() -> impl Iterator<Item = &'static str> {
        NAMED.iter().map(|(name, ..)| *name)
    }

    /// Unit vectors to the right and up in the image, and from the scene toward the camera.
    fn frame(&self) -> [DVec3; 3] {
        let [sin_a, cos_a] = sine_cosine(self.azimuth);
        let [sin_e, cos_e] = sine_cosine(self.elevation);
        let toward = DVec3::new(cos_e * sin_a, -cos_e * cos_a, sin_e);
        let right = DVec3::new(cos_a, sin_a, 0.0);
        [right, toward.cross(right), toward]
    }
}

/// Sine and cosine, exact at quarter turns, so that straight views stay straight.
fn sine_cosine(angle: f64) -> [f64; 2] {
    [scalar::sin(angle), scalar::cos(angle)].map(|value| {
        let nearest = value.round();
        if (value - nearest).abs() < 1e-15 {
            nearest
        } else {
            value
        }
    })
}

/// What a camera is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// The box that is seen; of three dimensions.
    pub bounds: Bounds,
    /// From where.
    pub view: View,
    /// The angle of view across the shorter side of the image, in radians between 0 and π;
    /// `None` for parallel rays.
    pub perspective: Option<f64>,
    /// Pixels in a row, and rows.
    pub size: [usize; 2],
}

/// A map from screen coordinates to points.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    bounds: Bounds,
    size: [usize; 2],
    slices: usize,
    /// What u, v and nothing else contribute: `corner + u·across + v·down`, the start of a
    /// parallel ray or the direction of a central one, of length 1 along the view.
    corner: DVec3,
    across: DVec3,
    down: DVec3,
    projection: Projection,
    frame: [DVec3; 3],
}

/// How depth comes in.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Projection {
    /// The point is `start + depth·forward`.
    Parallel { forward: DVec3 },
    /// The point is `eye + (near + depth·step)·direction`.
    Central { eye: DVec3, near: f64, step: f64 },
}

impl Camera {
    /// A camera from which the whole box is seen, as large as possible.
    pub fn new(aim: &Aim) -> Camera {
        let [right, up, toward] = aim.view.frame();
        let half = 0.5 * aim.bounds.size();
        let reach = toward.abs().dot(half);
        let center = aim.bounds.center();
        let pixels = aim.size.map(|count| count as f64);
        let (pixel, plane, projection) = match aim.perspective {
            None => {
                let width = 2.0 * right.abs().dot(half) / pixels[0];
                let pixel = width.max(2.0 * up.abs().dot(half) / pixels[1]);
                let forward = -2.0 * reach * toward;
                let start = center + reach * toward;
                (pixel, start, Projection::Parallel { forward })
            }
            Some(angle) => {
                let tangent = scalar::tan(0.5 * angle);
                let shorter = pixels[0].min(pixels[1]);
                let distance = distance(half, [right, up, toward], pixels, tangent);
                let projection = Projection::Central {
                    eye: center + distance * toward,
                    near: distance - reach,
                    step: 2.0 * reach,
                };
                (2.0 * tangent / shorter, -toward, projection)
            }
        };
        let (across, down) = (pixel * right, -pixel * up);
        Camera {
            bounds: aim.bounds,
            size: aim.size,
            slices: 1,
            corner: plane - 0.5 * (pixels[0] * across + pixels[1] * down),
            across,
            down,
            projection,
            frame: [right, up, toward],
        }
        .sliced()
    }

    /// A camera that sees only this part of the image, in pixels: left, top, right, bottom. The
    /// part is shown whole, in the middle.
    pub fn framed(&self, [left, top, right, bottom]: [f64; 4]) -> Camera {
        let [width, height] = self.size.map(|count| count as f64);
        let scale = ((right - left) / width).max((bottom - top) / height);
        let first = 0.5 * (left + right - scale * width);
        let second = 0.5 * (top + bottom - scale * height);
        Camera {
            corner: self.corner + first * self.across + second * self.down,
            across: scale * self.across,
            down: scale * self.down,
            ..self.clone()
        }
        .sliced()
    }

    /// The same view in an image of another size with the same proportions.
    pub fn resized(&self, size: [usize; 2]) -> Camera {
        let [x, y] = [0, 1].map(|axis| self.size[axis] as f64 / size[axis] as f64);
        Camera {
            size,
            across: x * self.across,
            down: y * self.down,
            ..self.clone()
        }
        .sliced()
    }

    /// The same with slices about as thick as pixels are wide in the middle of the box.
    fn sliced(mut self) -> Camera {
        let mut depth = self.slices as f64;
        let pixel = match &mut self.projection {
            Projection::Parallel { forward } => {
                depth *= forward.length();
                self.across.length()
            }
            Projection::Central { near, step, .. } => {
                depth *= *step;
                self.across.length() * (*near + 0.5 * depth)
            }
        };
        let most = (DEEPEST * self.size[0].max(self.size[1])).next_multiple_of(SLICE_GROUP);
        // Rounding must not add a group of slices to a cube.
        let slices = (depth / pixel * (1.0 - 1e-9)).ceil().min(most as f64) as usize;
        let slices = slices.max(1).next_multiple_of(SLICE_GROUP);
        match &mut self.projection {
            Projection::Parallel { forward } => *forward *= self.slices as f64 / slices as f64,
            Projection::Central { step, .. } => *step *= self.slices as f64 / slices as f64,
        }
        self.slices = slices;
        self
    }

    /// Pixels in a row, and rows.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The number of slices: depths run from 0 to it.
    pub fn slices(&self) -> usize {
        self.slices
    }

    /// The width of a pixel: in space for parallel rays, at distance 1 from the eye for central
    /// ones.
    pub fn pixel(&self) -> f64 {
        self.across.length()
    }

    /// The eye of a central projection.
    pub fn eye(&self) -> Option<DVec3> {
        match self.projection {
            Projection::Parallel { .. } => None,
            Projection::Central { eye, .. } => Some(eye),
        }
    }

    /// Unit vectors to the right and up in the image, and from the scene toward the camera.
    pub fn frame(&self) -> [DVec3; 3] {
        self.frame
    }

    /// The point at these screen coordinates.
    pub fn point(&self, [u, v, depth]: [f64; 3]) -> DVec3 {
        let ray = self.corner + u * self.across + v * self.down;
        match self.projection {
            Projection::Parallel { forward } => ray + depth * forward,
            Projection::Central { eye, near, step } => eye + (near + depth * step) * ray,
        }
    }

    /// The screen coordinates of a point; nothing if it is not in front of the eye.
    pub(super) fn screen(&self, point: DVec3) -> Option<[f64; 3]> {
        let forward = -self.frame[2];
        let (ray, depth) = match self.projection {
            Projection::Parallel { forward: slice } => {
                let depth = (point - self.corner).dot(forward) / slice.length();
                (point - depth * slice, depth)
            }
            Projection::Central { eye, near, step } => {
                let distance = (point - eye).dot(forward);
                if distance <= 0.0 {
                    return None;
                }
                ((point - eye) / distance, (distance - near) / step)
            }
        };
        let offset = ray - self.corner;
        let [u, v] = [self.across, self.down].map(|axis| offset.dot(axis) / axis.length_squared());
        [u, v, depth]
            .iter()
            .all(|part| part.is_finite())
            .then_some([u, v, depth])
    }

    /// The derivatives of the point with respect to the screen coordinates, as columns.
    pub(super) fn jacobian(&self, [u, v, depth]: [f64; 3]) -> DMat3 {
        match self.projection {
            Projection::Parallel { forward } => DMat3::from_cols(self.across, self.down, forward),
            Projection::Central { near, step, .. } => {
                let ray = self.corner + u * self.across + v * self.down;
                let distance = near + depth * step;
                DMat3::from_cols(distance * self.across, distance * self.down, step * ray)
            }
        }
    }

    /// The size of a pixel at this point of the screen.
    pub(super) fn pixel_at(&self, screen: [f64; 3]) -> f64 {
        self.jacobian(screen).x_axis.length()
    }

    /// The unit vector from the point that a pixel sees toward the eye.
    pub(super) fn toward(&self, [u, v]: [f64; 2]) -> DVec3 {
        match self.projection {
            Projection::Parallel { .. } => self.frame[2],
            Projection::Central { .. } => {
                -(self.corner + u * self.across + v * self.down).normalize()
            }
        }
    }

    /// Which sides of the box can be crossed on the screen: lower and upper one for each axis.
    fn crossed(&self) -> [[bool; 2]; 3] {
        let far = [self.size[0], self.size[1], self.slices].map(|count| count as f64);
        let corners = (0..8).map(|corner| {
            let end = |axis: usize| {
                if corner >> axis & 1 == 0 {
                    0.0
                } else {
                    far[axis]
                }
            };
            self.point([end(0), end(1), end(2)])
        });
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in corners {
            (low, high) = (low.min(point), high.max(point));
        }
        // A side that is a side of the screen's box, up to rounding, is not crossed.
        let slack = 1e-12 * (self.bounds.diagonal() + self.bounds.min.abs().max_element());
        [0, 1, 2].map(|axis| {
            [
                low[axis] < self.bounds.min[axis] - slack,
                high[axis] > self.bounds.max[axis] + slack,
            ]
        })
    }

    /// The side of the box on which a point lies to `tolerance`, as its outer normal.
    pub(super) fn side_at(&self, point: DVec3, tolerance: f64) -> Option<DVec3> {
        (0..3).find_map(|axis| {
            let unit = DVec3::AXES[axis];
            if point[axis] <= self.bounds.min[axis] + tolerance {
                Some(-unit)
            } else if point[axis] >= self.bounds.max[axis] - tolerance {
                Some(unit)
            } else {
                None
            }
        })
    }

    /// Whether the point is in the box.
    pub(super) fn sees(&self, point: DVec3) -> bool {
        self.bounds.contains(point)
    }

    /// Whether f32 has digits enough for the box's coordinates, and range enough for their
    /// powers.
    pub(super) fn suits_single_precision(&self) -> bool {
        let largest = self.bounds.min.abs().max(self.bounds.max.abs());
        let middle = [0.5 * self.size[0] as f64, 0.5 * self.size[1] as f64, 0.0];
        suits_single_precision(largest.max_element(), self.pixel_at(middle))
    }

    /// A field as a function of the screen coordinates, negative only where the field is and in
    /// the box.
    pub(super) fn through(&self, field: &CompiledField) -> CompiledField {
        let program = field.program().derived(3, |graph, roots, first| {
            let compose = |&root| self.compose(graph, root, first);
            roots.first().map(compose).into_iter().collect()
        });
        let all = [field.parameters(), &self.parameters()].concat();
        let places = program.parameters().iter();
        let q = places.filter_map(|&place| all.get(place as usize).copied());
        let q = q.collect();
        CompiledField::new(Arc::new(program), q)
    }

    /// The camera's numbers, as [`Camera::compose`] expects them behind q.
    fn parameters(&self) -> Vec<f64> {
        let (last, depth) = match self.projection {
            Projection::Parallel { forward } => (forward, [0.0; 2]),
            Projection::Central { eye, near, step } => (eye, [near, step]),
        };
        let vectors = [
            self.corner,
            self.across,
            self.down,
            last,
            self.bounds.min,
            self.bounds.max,
        ];
        let entries = vectors.into_iter().flat_map(|vector| vector.to_array());
        entries.chain(depth).collect()
    }

    /// The function of screen coordinates that a field F is through this camera, as a node:
    /// max(F, what is positive outside of the box). The camera's numbers are parameters from
    /// the place `first` on; those that are 0 do not occur.
    fn compose(&self, graph: &mut Graph, root: NodeId, first: usize) -> NodeId {
        let values = self.parameters();
        let entry = |graph: &mut Graph, place: usize| {
            (values[place] != 0.0).then(|| graph.parameter(first + place))
        };
        let [u, v, depth] = [0, 1, 2].map(|axis| graph.coordinate(axis));
        let scale = match self.projection {
            Projection::Parallel { .. } => None,
            Projection::Central { .. } => {
                let near = entry(graph, 18);
                let step = entry(graph, 19);
                let along = product(graph, step, depth);
                Some(sum(graph, near, along))
            }
        };
        let point = [0, 1, 2].map(|axis| {
            let start = entry(graph, axis);
            let [across, down, last] = [3, 6, 9].map(|place| entry(graph, place + axis));
            let across = product(graph, across, u);
            let start = sum(graph, start, across);
            let down = product(graph, down, v);
            let ray = sum(graph, start, down);
            let point = match scale {
                None => {
                    let along = product(graph, last, depth);
                    sum(graph, ray, along)
                }
                Some(scale) => {
                    let along = scale.and_then(|scale| product(graph, ray, scale));
                    sum(graph, last, along)
                }
            };
            point.unwrap_or_else(|| graph.constant(0.0))
        });
        let replaced = graph.substitute(&[root], |leaf| match leaf {
            Node::Coordinate(axis) => point.get(usize::from(axis)).copied(),
            _ => None,
        });
        let mut node = replaced.first().copied().unwrap_or(root);
        for (axis, [low, high]) in self.crossed().into_iter().enumerate() {
            let [least, greatest] = [12, 15].map(|place| graph.parameter(first + place + axis));
            for (crossed, ends) in [(low, [least, point[axis]]), (high, [point[axis], greatest])] {
                if crossed {
                    let outside = graph.apply(Op::Subtract, &ends);
                    node = graph.apply(Op::Max, &[node, outside]);
                }
            }
        }
        node
    }
}

/// Whether f32 has digits enough for coordinates up to `largest` and differences of a pixel.
pub(super) fn suits_single_precision(largest: f64, pixel: f64) -> bool {
    largest < 65_536.0 * pixel && (1e-9..1e9).contains(&largest)
}

/// The least distance from which all corners of the box of these half sides are seen.
fn distance(half: DVec3, frame: [DVec3; 3], pixels: [f64; 2], tangent: f64) -> f64 {
    let shorter = pixels[0].min(pixels[1]);
    let mut distance: f64 = 0.0;
    for corner in 0..8 {
        let sign = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
        let corner = half * DVec3::new(sign(0), sign(1), sign(2));
        let [x, y, z] = frame.map(|unit| unit.dot(corner));
        for (offset, count) in [x, y].into_iter().zip(pixels) {
            distance = distance.max(z + offset.abs() * shorter / (count * tangent));
        }
    }
    // The near plane must not go through the eye.
    distance.max(1.001 * frame[2].abs().dot(half))
}

/// The sum of what there is.
fn sum(graph: &mut Graph, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(graph.apply(Op::Add, &[a, b])),
        (one, other) => one.or(other),
    }
}

/// The product; nothing for a factor of 0.
fn product(graph: &mut Graph, a: Option<NodeId>, b: NodeId) -> Option<NodeId> {
    a.map(|a| graph.apply(Op::Multiply, &[a, b]))
}
