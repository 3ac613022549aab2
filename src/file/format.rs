//! The table of file formats: their names, their extensions and what each can hold. Dispatch,
//! error messages and documentation read it.

use std::io::{self, BufRead, Write};
use std::path::Path;

use super::reading::{ReadError, Wrong};
use super::vm::FieldRoot;
use super::{FileError, csv, dxf, glb, obj, off, ply, png, stl, svg, threemf, vm, vtk};
use crate::geometry::{Animation, Curves, Image, Mesh, Samples, Solid};
use crate::graph::{Graph, NodeId};

/// Turns a value into the bytes of a file.
pub(super) type Writer<T> = fn(&mut dyn Write, &T) -> io::Result<()>;

/// Makes a field of the bytes of a file: over the nodes of the three coordinates, from at most so
/// many lines.
type FieldReader =
    fn(&mut dyn BufRead, &mut Graph, [NodeId; 3], u64) -> Result<FieldRoot, ReadError>;

/// Makes a mesh of the bytes of a file.
type MeshReader = fn(&[u8]) -> Result<Mesh, Wrong>;

/// How a file is read.
#[derive(Clone, Copy)]
pub(super) enum Reader {
    Field(FieldReader),
    Mesh(MeshReader),
}

/// A file format. What it cannot hold has no writer, and what cannot be loaded no reader.
pub struct Format {
    /// The usual name.
    pub name: &'static str,
    /// The extensions that choose it, in lower case and without the dot.
    pub extensions: &'static [&'static str],
    /// What is kept in the file, in a sentence.
    pub documentation: &'static str,
    pub(super) mesh: Option<Writer<Mesh>>,
    pub(super) plane_curves: Option<Writer<Curves>>,
    pub(super) space_curves: Option<Writer<Curves>>,
    pub(super) samples: Option<Writer<Samples>>,
    pub(super) solid: Option<Writer<Solid>>,
    pub(super) image: Option<Writer<Image>>,
    pub(super) animation: Option<Writer<Animation>>,
    pub(super) reader: Option<Reader>,
}

/// A format that holds nothing, to begin an entry with.
const EMPTY: Format = Format {
    name: "",
    extensions: &[],
    documentation: "",
    mesh: None,
    plane_curves: None,
    space_curves: None,
    samples: None,
    solid: None,
    image: None,
    animation: None,
    reader: None,
};

/// All formats.
pub static FORMATS: &[Format] = &[
    Format {
        name: "OBJ",
        extensions: &["obj"],
        documentation: "Wavefront text: meshes with normals, curves as lines, samples as points.",
        mesh: Some(obj::write_mesh),
        plane_curves: Some(obj::write_curves),
        space_curves: Some(obj::write_curves),
        samples: Some(obj::write_samples),
        reader: Some(Reader::Mesh(obj::read_mesh)),
        ..EMPTY
    },
    Format {
        name: "STL",
        extensions: &["stl"],
        documentation: "Binary STL: the triangles of a mesh in single precision, with the normals \
                        of the facets. It is read as text, too.",
        mesh: Some(stl::write_mesh),
        reader: Some(Reader::Mesh(stl::read_mesh)),
        ..EMPTY
    },
    Format {
        name: "PLY",
        extensions: &["ply"],
        documentation: "Binary PLY in double precision: meshes with normals, samples with normals, \
                        radii and residuals, tangents and weights where there are any. It is \
                        read as text and in both byte orders.",
        mesh: Some(ply::write_mesh),
        samples: Some(ply::write_samples),
        reader: Some(Reader::Mesh(ply::read_mesh)),
        ..EMPTY
    },
    Format {
        name: "OFF",
        extensions: &["off"],
        documentation: "Geomview text: the vertices and triangles of a mesh, exactly.",
        mesh: Some(off::write_mesh),
        reader: Some(Reader::Mesh(off::read_mesh)),
        ..EMPTY
    },
    Format {
        name: "GLB",
        extensions: &["glb"],
        documentation: "Binary glTF 2.0: a mesh with normals in single precision. A unit is a \
                        metre; z, which is up, is the y axis of glTF.",
        mesh: Some(glb::write_mesh),
        ..EMPTY
    },
    Format {
        name: "3MF",
        extensions: &["3mf"],
        documentation: "3D Manufacturing Format: the vertices and triangles of a mesh, exactly. A \
                        unit is a millimetre and z is up.",
        mesh: Some(threemf::write_mesh),
        ..EMPTY
    },
    Format {
        name: "VTP",
        extensions: &["vtp"],
        documentation: "VTK's XML for polygons, in double precision: meshes with normals, curves \
                        as lines, samples with all that is known of them.",
        mesh: Some(vtk::write_mesh),
        plane_curves: Some(vtk::write_curves),
        space_curves: Some(vtk::write_curves),
        samples: Some(vtk::write_samples),
        ..EMPTY
    },
    Format {
        name: "VTU",
        extensions: &["vtu"],
        documentation: "VTK's XML for unstructured grids, in double precision: a mesh with normals \
                        as cells, a solid as tetrahedra or triangles.",
        mesh: Some(vtk::write_cells),
        solid: Some(vtk::write_solid),
        ..EMPTY
    },
    Format {
        name: "CSV",
        extensions: &["csv"],
        documentation: "A table with a header line: one row a sample, with all that is known of \
                        it, or one row a point of a curve, with the number of the curve.",
        plane_curves: Some(csv::write_curves),
        space_curves: Some(csv::write_curves),
        samples: Some(csv::write_samples),
        ..EMPTY
    },
    Format {
        name: "SVG",
        extensions: &["svg"],
        documentation: "A drawing: one path for each plane curve, y upward.",
        plane_curves: Some(svg::write_curves),
        ..EMPTY
    },
    Format {
        name: "DXF",
        extensions: &["dxf"],
        documentation: "A drawing for computer-aided design (AutoCAD 2000): one polyline for each \
                        plane curve.",
        plane_curves: Some(dxf::write_curves),
        ..EMPTY
    },
    Format {
        name: "PNG",
        extensions: &["png"],
        documentation: "A picture in sRGB with eight bits a channel, with opacity where it is \
                        needed; lossless. An animation is an animated PNG (APNG).",
        image: Some(png::write_image),
        animation: Some(png::write_animation),
        ..EMPTY
    },
    Format {
        name: "VM",
        extensions: &["vm"],
        documentation: "A field as text, one operation a line, as the Prospero benchmark has it; \
                        it is only read.",
        reader: Some(Reader::Field(vm::read_field)),
        ..EMPTY
    },
];

impl Format {
    /// The format that the extension of a file name chooses, in capitals or not.
    ///
    /// [`FileError::UnknownFormat`] if there is none. Looks at the name only, never at the disk.
    pub fn of_path(path: &Path) -> Result<&'static Format, FileError> {
        Format::known(path, |_| true)
    }

    /// The format that the extension chooses, if it can hold values of a kind, in the words of
    /// [`Format::holds`]. Lets a caller refuse a file name before the work.
    ///
    /// [`FileError::UnknownFormat`] and [`FileError::WrongFormat`] name those that can.
    pub fn for_kind(path: &Path, kind: &'static str) -> Result<&'static Format, FileError> {
        let format = Format::known(path, |format| format.holds().contains(&kind))?;
        if format.holds().contains(&kind) {
            return Ok(format);
        }
        Err(format.cannot_hold(kind))
    }

    /// The reader of the format that the extension chooses.
    ///
    /// [`FileError::UnknownFormat`] and [`FileError::OnlyWritten`] name those that have one.
    pub(super) fn reader(path: &Path) -> Result<Reader, FileError> {
        let is_read = |format: &Format| format.reader.is_some();
        let format = Format::known(path, is_read)?;
        format.reader.ok_or_else(|| FileError::OnlyWritten {
            format: format.name,
            suitable: list_extensions(is_read),
        })
    }

    /// The format that the extension chooses; if there is none, those that suit are named.
    fn known(
        path: &Path,
        suitable: impl Fn(&Format) -> bool,
    ) -> Result<&'static Format, FileError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let lower_case = extension.to_lowercase();
        FORMATS
            .iter()
            .find(|format| format.extensions.contains(&&*lower_case))
            .ok_or_else(|| FileError::UnknownFormat {
                extension: extension.into_owned(),
                known: list_extensions(suitable),
            })
    }

    /// The kinds of values that can be written in the format, in words.
    pub fn holds(&self) -> Vec<&'static str> {
        let kinds = [
            (self.mesh.is_some(), "meshes"),
            (self.plane_curves.is_some(), "plane curves"),
            (self.space_curves.is_some(), "curves in space"),
            (self.samples.is_some(), "samples"),
            (self.solid.is_some(), "solids"),
            (self.image.is_some(), "pictures"),
            (self.animation.is_some(), "animations"),
        ];
        let held = kinds.into_iter().filter(|(held, _)| *held);
        held.map(|(_, kind)| kind).collect()
    }

    /// The error for a kind of values that the format cannot hold.
    pub(super) fn cannot_hold(&self, kind: &'static str) -> FileError {
        FileError::WrongFormat {
            format: self.name,
            value: kind,
            suitable: list_extensions(|format| format.holds().contains(&kind)),
        }
    }
}

/// The extensions of the chosen formats, as in `.obj, .ply, .csv`.
fn list_extensions(chosen: impl Fn(&Format) -> bool) -> String {
    let formats = FORMATS.iter().filter(|format| chosen(format));
    let extensions: Vec<String> = formats
        .flat_map(|format| format.extensions)
        .map(|extension| format!(".{extension}"))
        .collect();
    extensions.join(", ")
}
