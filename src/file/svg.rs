//! SVG: a drawing of plane curves, one path each, in the coordinates of the curves except that y
//! is negated, because it points downward in SVG.

use std::io::{self, Write};

use crate::geometry::{Bounds, Curves, Polyline};

/// Free space around the curves, as a part of the longer side of their bounds.
const MARGIN: f64 = 0.05;

/// The width of the lines, likewise.
const STROKE_WIDTH: f64 = 0.004;

/// One path for each curve that has a point, closed with `Z` if the curve is closed.
///
/// An error if a coordinate is not finite.
pub(super) fn write_curves(output: &mut dyn Write, curves: &Curves) -> io::Result<()> {
    let points = || {
        curves
            .polylines
            .iter()
            .flat_map(|polyline| &polyline.points)
    };
    if !points().all(|point| point.is_finite()) {
        let message = "a point of a curve is not finite";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    let bounds = curves.bounds();
    let extent = bounds.map_or(0.0, |bounds| bounds.size().max_element());
    // A drawing of one point, or of nothing, has a size all the same.
    let scale = if extent > 0.0 { extent } else { 1.0 };
    write_header(output, bounds, scale)?;
    for polyline in curves
        .polylines
        .iter()
        .filter(|polyline| !polyline.points.is_empty())
    {
        write_path(output, polyline)?;
    }
    writeln!(output, "</g>")?;
    writeln!(output, "</svg>")
}

fn write_header(output: &mut dyn Write, bounds: Option<Bounds>, scale: f64) -> io::Result<()> {
    let margin = MARGIN * scale;
    let (left, top, width, height) = match bounds {
        Some(bounds) => {
            let around = bounds.expanded(margin);
            let size = around.size();
            (around.min.x, upward(around.max.y), size.x, size.y)
        }
        None => (-margin, -margin, 2.0 * margin, 2.0 * margin),
    };
    let stroke_width = STROKE_WIDTH * scale;
    writeln!(
        output,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" \
         viewBox=\"{left:?} {top:?} {width:?} {height:?}\">"
    )?;
    writeln!(
        output,
        "<g fill=\"none\" stroke=\"black\" stroke-width=\"{stroke_width:?}\" \
         stroke-linejoin=\"round\" stroke-linecap=\"round\">"
    )
}

fn write_path(output: &mut dyn Write, polyline: &Polyline) -> io::Result<()> {
    write!(output, "<path d=\"")?;
    for (command, point) in std::iter::once("M")
        .chain(std::iter::repeat("L"))
        .zip(&polyline.points)
    {
        write!(output, "{command}{:?} {:?}", point.x, upward(point.y))?;
    }
    writeln!(output, "{}\"/>", if polyline.closed { "Z" } else { "" })
}

/// −y, but 0 for 0.
fn upward(y: f64) -> f64 {
    0.0 - y
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::test_values::{plane_curves, text};
    use super::*;

    /// The value of each attribute of that name, in their order.
    fn attributes<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
        let start = format!(" {name}=\"");
        text.split(&start)
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap())
            .collect()
    }

    fn numbers(text: &str) -> Vec<f64> {
        let words = text
            .split([' ', 'M', 'L', 'Z'])
            .filter(|word| !word.is_empty());
        words.map(|word| word.parse().unwrap()).collect()
    }

    #[test]
    fn paths_read_back_exactly_with_y_turned_over() {
        let curves = plane_curves();
        let text = text(write_curves, &curves);
        let paths = attributes(&text, "d");
        let drawn = curves.polylines.iter().filter(|p| !p.points.is_empty());
        assert_eq!(paths.len(), drawn.clone().count());
        for (path, polyline) in paths.iter().zip(drawn) {
            let points: Vec<DVec3> = numbers(path)
                .chunks(2)
                .map(|pair| DVec3::new(pair[0], -pair[1], 0.0))
                .collect();
            assert_eq!(points, polyline.points);
            assert_eq!(path.ends_with('Z'), polyline.closed);
            assert!(path.starts_with('M'));
        }
    }

    #[test]
    fn the_view_contains_the_curves_and_a_margin() {
        let square = |side: f64| Curves {
            dimension: 2,
            polylines: vec![Polyline {
                points: vec![
                    DVec3::new(1.0, 2.0, 0.0),
                    DVec3::new(1.0 + side, 2.0 + side, 0.0),
                ],
                closed: false,
            }],
        };
        let text_of_square = text(write_curves, &square(20.0));
        assert_eq!(
            numbers(attributes(&text_of_square, "viewBox")[0]),
            [0.0, -23.0, 22.0, 22.0]
        );
        assert_eq!(
            numbers(attributes(&text_of_square, "stroke-width")[0]),
            [0.08]
        );
        let text_of_point = text(write_curves, &square(0.0));
        let view = numbers(attributes(&text_of_point, "viewBox")[0]);
        assert!(view[2] > 0.0 && view[3] > 0.0);
    }

    #[test]
    fn no_curves_give_an_empty_drawing_and_infinite_points_an_error() {
        let mut curves = Curves {
            dimension: 2,
            polylines: Vec::new(),
        };
        let text = text(write_curves, &curves);
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
        assert!(attributes(&text, "d").is_empty());
        curves.polylines.push(Polyline {
            points: vec![DVec3::ZERO, DVec3::INFINITY],
            closed: false,
        });
        let error = write_curves(&mut Vec::new(), &curves).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
    }
}
