//! CSV (RFC 4180 with plain line feeds): a header line, then one line of numbers for each point.

use std::io::{self, Write};

use super::sample_columns;
use crate::geometry::{Curves, Samples};

/// Columns `x,y,z,nx,ny,nz,radius,residual`, with tangents `tx,ty,tz` too and with weights `weight`;
/// one line a sample.
pub(super) fn write_samples(output: &mut dyn Write, samples: &Samples) -> io::Result<()> {
    writeln!(output, "{}", sample_columns::names(samples).join(","))?;
    for row in sample_columns::rows(samples) {
        let mut comma = "";
        for value in row {
            write!(output, "{comma}{value:?}")?;
            comma = ",";
        }
        writeln!(output)?;
    }
    Ok(())
}

/// Columns `curve,x,y`, and `z` for curves in space; the curves are numbered from 0. A closed
/// curve ends with its first point again, so that the rows alone say that it is closed.
pub(super) fn write_curves(output: &mut dyn Write, curves: &Curves) -> io::Result<()> {
    let in_space = curves.dimension == 3;
    writeln!(
        output,
        "{}",
        if in_space { "curve,x,y,z" } else { "curve,x,y" }
    )?;
    for (number, polyline) in curves.polylines.iter().enumerate() {
        let again = polyline.points.first().filter(|_| polyline.closed);
        for point in polyline.points.iter().chain(again) {
            write!(output, "{number},{:?},{:?}", point.x, point.y)?;
            if in_space {
                write!(output, ",{:?}", point.z)?;
            }
            writeln!(output)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::test_values::{plane_curves, samples, samples_of_lines, space_curves, text};
    use super::*;

    /// The header and the numbers of each line.
    fn read(text: &str) -> (&str, Vec<Vec<f64>>) {
        let (header, body) = text.split_once('\n').unwrap();
        let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
        (header, body.lines().map(row).collect())
    }

    #[test]
    fn samples_read_back_exactly() {
        let samples = samples();
        let text = text(write_samples, &samples);
        let (header, rows) = read(&text);
        assert_eq!(header, "x,y,z,nx,ny,nz,radius,residual");
        assert_eq!(rows.len(), samples.positions.len());
        for (k, row) in rows.iter().enumerate() {
            assert_eq!(row[..3], samples.positions[k].to_array());
            assert_eq!(row[3..6], samples.normals[k].to_array());
            assert_eq!(row[6..], [samples.radii[k], samples.residuals[k]]);
        }
    }

    #[test]
    fn tangents_and_weights_have_columns_where_there_are_any() {
        let samples = samples_of_lines();
        let text = text(write_samples, &samples);
        let (header, rows) = read(&text);
        assert_eq!(header, "x,y,z,nx,ny,nz,radius,residual,tx,ty,tz,weight");
        for (k, row) in rows.iter().enumerate() {
            assert_eq!(row[8..11], samples.tangents[k].to_array());
            assert_eq!(row[11..], [samples.weights[k]]);
        }
    }

    #[test]
    fn curves_read_back_exactly_and_closed_ones_return_to_their_start() {
        let plane = text(write_curves, &plane_curves());
        let (header, rows) = read(&plane);
        assert_eq!(header, "curve,x,y");
        let expected: [[f64; 3]; 7] = [
            [0.0, 0.1, 0.2],
            [0.0, 1.0 / 3.0, -4.0],
            [0.0, 7.0, 1e-7],
            [0.0, 0.1, 0.2],
            [1.0, -3.0, 0.0],
            [1.0, 2.0, 123.456],
            [3.0, 1.0, 2.0],
        ];
        assert_eq!(rows, expected);
        let space = text(write_curves, &space_curves());
        let (header, rows) = read(&space);
        assert_eq!(header, "curve,x,y,z");
        for (row, point) in rows.iter().zip(&space_curves().polylines[0].points) {
            assert_eq!(row[1..], point.to_array());
        }
    }

    #[test]
    fn nothing_is_a_header_alone() {
        assert_eq!(text(write_samples, &Samples::default()).lines().count(), 1);
    }
}
