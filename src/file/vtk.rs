//! The XML formats of VTK (<https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>),
//! for ParaView and its like: `.vtp` for polygons, lines and points, `.vtu` for cells.
//!
//! An XML head describes arrays, which follow as bytes (appended, raw, little endian), so that numbers
//! keep all their bits.

use std::io::{self, Write};

use glam::DVec3;

use crate::geometry::{Curves, Mesh, Samples, Solid};

/// VTK's number for a cell that is a triangle.
const TRIANGLE: u8 = 5;

/// The same for a tetrahedron.
const TETRAHEDRON: u8 = 10;

/// Polygons, with normals at the points if there are any.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let mut document = Document::new("PolyData", &mesh.positions, normals(mesh));
    let triangles = mesh.triangles.len();
    document.counts.push(("NumberOfPolys", triangles));
    document.sections.push(("Polys", triangle_cells(mesh)));
    document.write(output)
}

/// Cells, with normals at the points if there are any.
pub(super) fn write_cells(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let mut document = Document::new("UnstructuredGrid", &mesh.positions, normals(mesh));
    let triangles = mesh.triangles.len();
    document.counts.push(("NumberOfCells", triangles));
    let mut cells = triangle_cells(mesh);
    cells.push(Array::new("types", Values::Types(TRIANGLE, triangles)));
    document.sections.push(("Cells", cells));
    document.write(output)
}

/// The simplices of a solid as cells.
pub(super) fn write_solid(output: &mut dyn Write, solid: &Solid) -> io::Result<()> {
    let mut document = Document::new("UnstructuredGrid", &solid.nodes, Vec::new());
    let count = solid.simplices.len();
    let (kind, corners) = match solid.dimension {
        2 => (TRIANGLE, 3),
        _ => (TETRAHEDRON, 4),
    };
    let nodes = solid.simplices.iter();
    let nodes = nodes.flat_map(|simplex| simplex.iter().take(corners));
    let nodes = nodes.map(|&node| node.into()).collect();
    let ends = Values::Multiples {
        of: corners,
        from: 1,
        count,
    };
    document.counts.push(("NumberOfCells", count));
    let cells = vec![
        Array::new("connectivity", Values::Integers(nodes)),
        Array::new("offsets", ends),
        Array::new("types", Values::Types(kind, count)),
    ];
    document.sections.push(("Cells", cells));
    document.write(output)
}

/// One line for each curve, which ends with its first point again if it is closed; a curve of one
/// point is a vertex.
pub(super) fn write_curves(output: &mut dyn Write, curves: &Curves) -> io::Result<()> {
    let points: Vec<DVec3> = curves
        .polylines
        .iter()
        .flat_map(|polyline| polyline.points.iter().copied())
        .collect();
    let (mut vertices, mut lines) = (Cells::default(), Cells::default());
    let mut first = 0;
    for polyline in &curves.polylines {
        let end = first + polyline.points.len() as i64;
        match polyline.points.len() {
            0 => {}
            1 => vertices.push(first..end),
            _ => lines.push((first..end).chain(polyline.closed.then_some(first))),
        }
        first = end;
    }
    let mut document = Document::new("PolyData", &points, Vec::new());
    document.counts.push(("NumberOfVerts", vertices.ends.len()));
    document.counts.push(("NumberOfLines", lines.ends.len()));
    document.sections.push(("Verts", vertices.arrays()));
    document.sections.push(("Lines", lines.arrays()));
    document.write(output)
}

/// One vertex for each sample, with normals, radii and residuals, and tangents and weights where
/// there are any.
pub(super) fn write_samples(output: &mut dyn Write, samples: &Samples) -> io::Result<()> {
    let data = [
        ("normals", Values::Vectors(&samples.normals)),
        ("radius", Values::Numbers(&samples.radii)),
        ("residual", Values::Numbers(&samples.residuals)),
        ("tangents", Values::Vectors(&samples.tangents)),
        ("weight", Values::Numbers(&samples.weights)),
    ];
    let given = data.into_iter().filter(|(_, values)| values.bytes() > 0);
    let data = given.map(|(name, values)| Array::new(name, values));
    let mut document = Document::new("PolyData", &samples.positions, data.collect());
    let count = samples.positions.len();
    document.counts.push(("NumberOfVerts", count));
    document.sections.push((
        "Verts",
        vec![
            Array::new(
                "connectivity",
                Values::Multiples {
                    of: 1,
                    from: 0,
                    count,
                },
            ),
            Array::new(
                "offsets",
                Values::Multiples {
                    of: 1,
                    from: 1,
                    count,
                },
            ),
        ],
    ));
    document.write(output)
}

/// The normals of a mesh as data of its points.
fn normals(mesh: &Mesh) -> Vec<Array<'_>> {
    match mesh.normals.is_empty() {
        true => Vec::new(),
        false => vec![Array::new("normals", Values::Vectors(&mesh.normals))],
    }
}

/// The corners of all triangles, and where each ends among them.
fn triangle_cells(mesh: &Mesh) -> Vec<Array<'_>> {
    let count = mesh.triangles.len();
    vec![
        Array::new("connectivity", Values::Corners(&mesh.triangles)),
        Array::new(
            "offsets",
            Values::Multiples {
                of: 3,
                from: 1,
                count,
            },
        ),
    ]
}

/// Cells of any number of points.
#[derive(Default)]
struct Cells {
    points: Vec<i64>,
    /// Where the points of each cell end.
    ends: Vec<i64>,
}

impl Cells {
    fn push(&mut self, points: impl Iterator<Item = i64>) {
        self.points.extend(points);
        self.ends.push(self.points.len() as i64);
    }

    fn arrays(self) -> Vec<Array<'static>> {
        vec![
            Array::new("connectivity", Values::Integers(self.points)),
            Array::new("offsets", Values::Integers(self.ends)),
        ]
    }
}

/// The values of an array.
enum Values<'a> {
    Vectors(&'a [DVec3]),
    Numbers(&'a [f64]),
    Integers(Vec<i64>),
    Corners(&'a [[u32; 3]]),
    /// `from·of`, `(from + 1)·of` and so on.
    Multiples {
        of: usize,
        from: usize,
        count: usize,
    },
    /// The same type of cell again and again.
    Types(u8, usize),
}

impl Values<'_> {
    /// VTK's name of the type, and the number of components.
    fn kind(&self) -> (&'static str, usize) {
        match self {
            Values::Vectors(_) => ("Float64", 3),
            Values::Numbers(_) => ("Float64", 1),
            Values::Integers(_) | Values::Corners(_) | Values::Multiples { .. } => ("Int64", 1),
            Values::Types(..) => ("UInt8", 1),
        }
    }

    /// How many bytes they take.
    fn bytes(&self) -> usize {
        match self {
            Values::Vectors(vectors) => 24 * vectors.len(),
            Values::Numbers(numbers) => 8 * numbers.len(),
            Values::Integers(integers) => 8 * integers.len(),
            Values::Corners(triangles) => 24 * triangles.len(),
            Values::Multiples { count, .. } => 8 * count,
            Values::Types(_, count) => *count,
        }
    }

    fn write(&self, output: &mut dyn Write) -> io::Result<()> {
        let mut integers = |integers: &mut dyn Iterator<Item = i64>| -> io::Result<()> {
            for integer in integers {
                output.write_all(&integer.to_le_bytes())?;
            }
            Ok(())
        };
        match self {
            Values::Vectors(vectors) => {
                for component in vectors.iter().flat_map(DVec3::to_array) {
                    output.write_all(&component.to_le_bytes())?;
                }
            }
            Values::Numbers(numbers) => {
                for number in *numbers {
                    output.write_all(&number.to_le_bytes())?;
                }
            }
            Values::Integers(list) => integers(&mut list.iter().copied())?,
            Values::Corners(triangles) => {
                integers(&mut triangles.as_flattened().iter().map(|&corner| corner.into()))?;
            }
            Values::Multiples { of, from, count } => {
                integers(&mut (*from..from + count).map(|index| (index * of) as i64))?;
            }
            Values::Types(kind, count) => {
                for _ in 0..*count {
                    output.write_all(&[*kind])?;
                }
            }
        }
        Ok(())
    }
}

/// A named array.
struct Array<'a> {
    name: &'static str,
    values: Values<'a>,
}

impl<'a> Array<'a> {
    fn new(name: &'static str, values: Values<'a>) -> Self {
        Array { name, values }
    }
}

/// A file with one piece.
struct Document<'a> {
    kind: &'static str,
    /// The numbers of things in the piece.
    counts: Vec<(&'static str, usize)>,
    /// Groups of arrays.
    sections: Vec<(&'static str, Vec<Array<'a>>)>,
}

impl<'a> Document<'a> {
    /// A document of points with data; what connects them is to be added.
    fn new(kind: &'static str, points: &'a [DVec3], data: Vec<Array<'a>>) -> Self {
        let positions = vec![Array::new("Points", Values::Vectors(points))];
        Document {
            kind,
            counts: vec![("NumberOfPoints", points.len())],
            sections: vec![("PointData", data), ("Points", positions)],
        }
    }

    /// The head, then each array with its number of bytes before it.
    fn write(&self, output: &mut dyn Write) -> io::Result<()> {
        let kind = self.kind;
        writeln!(output, "<?xml version=\"1.0\"?>")?;
        writeln!(
            output,
            "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">"
        )?;
        writeln!(output, "<{kind}>")?;
        write!(output, "<Piece")?;
        for (name, count) in &self.counts {
            write!(output, " {name}=\"{count}\"")?;
        }
        writeln!(output, ">")?;
        let mut offset = 0;
        for (section, arrays) in &self.sections {
            let has_normals = *section == "PointData" && !arrays.is_empty();
            let active = if has_normals {
                " Normals=\"normals\""
            } else {
                ""
            };
            writeln!(output, "<{section}{active}>")?;
            for Array { name, values } in arrays {
                let (number, components) = values.kind();
                writeln!(
                    output,
                    "<DataArray type=\"{number}\" Name=\"{name}\" \
                     NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
                )?;
                offset += 8 + values.bytes();
            }
            writeln!(output, "</{section}>")?;
        }
        writeln!(output, "</Piece>")?;
        writeln!(output, "</{kind}>")?;
        writeln!(output, "<AppendedData encoding=\"raw\">")?;
        // The underscore says where the bytes begin.
        write!(output, "_")?;
        for Array { values, .. } in self.sections.iter().flat_map(|(_, arrays)| arrays) {
            output.write_all(&(values.bytes() as u64).to_le_bytes())?;
            values.write(output)?;
        }
        writeln!(output)?;
        writeln!(output, "</AppendedData>")?;
        writeln!(output, "</VTKFile>")
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_values::{
        bytes, mesh, mesh_without_normals, plane_curves, samples, samples_of_lines, solid,
    };
    use super::*;

    /// The head of a document, and its arrays as section, name, type and bytes.
    fn read(document: &[u8]) -> (String, Vec<[String; 3]>, Vec<Vec<u8>>) {
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let at = document
            .windows(mark.len())
            .position(|window| window == mark)
            .unwrap();
        let head = String::from_utf8(document[..at].to_vec()).unwrap();
        let body = &document[at + mark.len()..];
        let (mut names, mut values, mut section) = (Vec::new(), Vec::new(), "");
        for line in head.lines() {
            let words: Vec<&str> = line.split('"').collect();
            if !line.starts_with("<DataArray") {
                section = line.trim_matches(['<', '>']).split(' ').next().unwrap();
                continue;
            }
            let kind = format!("{} {}", words[1], words[5]);
            names.push([section.to_owned(), words[3].to_owned(), kind]);
            let start: usize = words[9].parse().unwrap();
            let (length, rest) = body[start..].split_first_chunk().unwrap();
            values.push(rest[..u64::from_le_bytes(*length) as usize].to_vec());
        }
        let all: usize = values.iter().map(|bytes| bytes.len() + 8).sum();
        assert_eq!(&body[all..], b"\n</AppendedData>\n</VTKFile>\n");
        (head, names, values)
    }

    fn names(names: &[[String; 3]]) -> Vec<String> {
        names.iter().map(|name| name.join(" ")).collect()
    }

    fn doubles(bytes: &[u8]) -> Vec<f64> {
        let double = |eight: &[u8]| f64::from_le_bytes(eight.try_into().unwrap());
        bytes.chunks(8).map(double).collect()
    }

    fn integers(bytes: &[u8]) -> Vec<i64> {
        let integer = |eight: &[u8]| i64::from_le_bytes(eight.try_into().unwrap());
        bytes.chunks(8).map(integer).collect()
    }

    fn flat(vectors: &[DVec3]) -> Vec<f64> {
        vectors.iter().flat_map(DVec3::to_array).collect()
    }

    #[test]
    fn meshes_read_back_exactly() {
        let mesh = mesh();
        let (head, found, values) = read(&bytes(write_mesh, &mesh));
        assert!(head.contains("<VTKFile type=\"PolyData\""));
        assert!(head.contains("<Piece NumberOfPoints=\"5\" NumberOfPolys=\"3\">"));
        assert!(head.contains("<PointData Normals=\"normals\">"));
        let expected = [
            "PointData normals Float64 3",
            "Points Points Float64 3",
            "Polys connectivity Int64 1",
            "Polys offsets Int64 1",
        ];
        assert_eq!(names(&found), expected);
        assert_eq!(doubles(&values[0]), flat(&mesh.normals));
        assert_eq!(doubles(&values[1]), flat(&mesh.positions));
        assert_eq!(integers(&values[2]), [0, 1, 2, 2, 1, 3, 3, 4, 0]);
        assert_eq!(integers(&values[3]), [3, 6, 9]);
    }

    #[test]
    fn cells_are_triangles() {
        let (head, found, values) = read(&bytes(write_cells, &mesh_without_normals()));
        assert!(head.contains("<VTKFile type=\"UnstructuredGrid\""));
        assert!(head.contains("<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">"));
        let expected = [
            "Points Points Float64 3",
            "Cells connectivity Int64 1",
            "Cells offsets Int64 1",
            "Cells types UInt8 1",
        ];
        assert_eq!(names(&found), expected);
        assert_eq!(integers(&values[2]), [3, 6, 9]);
        assert_eq!(values[3], [5, 5, 5]);
    }

    #[test]
    fn solids_are_cells_of_their_dimension() {
        let mut solid = solid();
        let (head, _, values) = read(&bytes(write_solid, &solid));
        assert!(head.contains("<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">"));
        assert_eq!(doubles(&values[0]), flat(&solid.nodes));
        assert_eq!(integers(&values[1]), [0, 1, 2, 3, 1, 2, 3, 4]);
        assert_eq!(integers(&values[2]), [4, 8]);
        assert_eq!(values[3], [10, 10]);
        solid.dimension = 2;
        solid.simplices = vec![[0, 1, 2, 2], [2, 1, 3, 3]];
        let (_, _, values) = read(&bytes(write_solid, &solid));
        assert_eq!(integers(&values[1]), [0, 1, 2, 2, 1, 3]);
        assert_eq!(integers(&values[2]), [3, 6]);
        assert_eq!(values[3], [5, 5]);
    }

    #[test]
    fn curves_become_lines_and_closed_ones_return_to_their_start() {
        let (head, found, values) = read(&bytes(write_curves, &plane_curves()));
        assert!(head.contains("NumberOfPoints=\"6\" NumberOfVerts=\"1\" NumberOfLines=\"2\""));
        assert_eq!([&found[1][0], &found[3][0]], ["Verts", "Lines"]);
        let lists: Vec<Vec<i64>> = values[1..].iter().map(|bytes| integers(bytes)).collect();
        assert_eq!(
            lists,
            [vec![5], vec![1], vec![0, 1, 2, 0, 3, 4], vec![4, 6]]
        );
    }

    #[test]
    fn samples_become_vertices_with_all_that_is_known() {
        for samples in [samples(), samples_of_lines()] {
            let (head, found, values) = read(&bytes(write_samples, &samples));
            assert!(head.contains("NumberOfPoints=\"4\" NumberOfVerts=\"4\""));
            let column = |name: &str| {
                let place = found.iter().position(|[_, own, _]| own == name);
                place.map_or(Vec::new(), |place| doubles(&values[place]))
            };
            assert_eq!(column("Points"), flat(&samples.positions));
            assert_eq!(column("normals"), flat(&samples.normals));
            assert_eq!(column("radius"), samples.radii);
            assert_eq!(column("residual"), samples.residuals);
            assert_eq!(column("tangents"), flat(&samples.tangents));
            assert_eq!(column("weight"), samples.weights);
            let cells: Vec<Vec<i64>> = values[values.len() - 2..]
                .iter()
                .map(|bytes| integers(bytes))
                .collect();
            assert_eq!(cells, [[0, 1, 2, 3], [1, 2, 3, 4]]);
        }
    }
}
