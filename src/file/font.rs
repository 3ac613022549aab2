//! Outlines of text in the letters of a TrueType or OpenType font.
//!
//! Letters stand side by side by their advance widths, without kerning, on the x axis; a line break
//! goes down by the font's line height. Curves become [`STEPS`] chords each.

use ttf_parser::{Face, OutlineBuilder};

/// A closed polygon.
pub type Outline = Vec<[f64; 2]>;

/// Chords of a curve: of a circle in four curves they are within 0.5 % of the radius.
const STEPS: u32 = 8;

/// The outlines of all letters, `size` being the length of the font's em. The error says what is
/// wrong with the font or the text.
pub(super) fn outlines(data: &[u8], text: &str, size: f64) -> Result<Vec<Outline>, String> {
    let face = Face::parse(data, 0).map_err(|error| format!("not a font: {error}"))?;
    let scale = size / f64::from(face.units_per_em());
    let line = f64::from(face.height()) + f64::from(face.line_gap());
    let mut pen = Pen {
        scale,
        ..Pen::default()
    };
    for letter in text.chars() {
        if letter == '\n' {
            pen.origin = [0.0, pen.origin[1] - line];
            continue;
        }
        let Some(glyph) = face.glyph_index(letter) else {
            return Err(format!("the font has no letter `{letter}`"));
        };
        // A space has no outline.
        face.outline_glyph(glyph, &mut pen);
        pen.origin[0] += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0));
    }
    Ok(pen.outlines)
}

/// Collects outlines, in units of the font relative to the letter's origin.
#[derive(Default)]
struct Pen {
    scale: f64,
    origin: [f64; 2],
    at: [f64; 2],
    outline: Outline,
    outlines: Vec<Outline>,
}

impl Pen {
    fn add(&mut self, point: [f64; 2]) {
        self.at = point;
        let [x, y] = [0, 1].map(|axis| (self.origin[axis] + point[axis]) * self.scale);
        if self.outline.last() != Some(&[x, y]) {
            self.outline.push([x, y]);
        }
    }

    /// Adds the points of a curve, given at t from 0 to 1.
    fn curve(&mut self, point: impl Fn(f64) -> [f64; 2]) {
        for step in 1..=STEPS {
            self.add(point(f64::from(step) / f64::from(STEPS)));
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.outline.clear();
        self.add([x.into(), y.into()]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.add([x.into(), y.into()]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (a, b, c) = (self.at, [x1, y1].map(f64::from), [x, y].map(f64::from));
        self.curve(|t| {
            let s = 1.0 - t;
            [0, 1].map(|axis| s * s * a[axis] + 2.0 * s * t * b[axis] + t * t * c[axis])
        });
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (a, b) = (self.at, [x1, y1].map(f64::from));
        let (c, d) = ([x2, y2].map(f64::from), [x, y].map(f64::from));
        self.curve(|t| {
            let s = 1.0 - t;
            [0, 1].map(|axis| {
                let (first, last) = (s * s * s * a[axis], t * t * t * d[axis]);
                first + 3.0 * s * t * (s * b[axis] + t * c[axis]) + last
            })
        });
    }

    fn close(&mut self) {
        while self.outline.len() > 1 && self.outline.first() == self.outline.last() {
            self.outline.pop();
        }
        let outline = std::mem::take(&mut self.outline);
        if outline.len() >= 3 {
            self.outlines.push(outline);
        }
    }
}
