//! 3MF, the 3D Manufacturing Format (core specification 1.3): a zip archive with an XML document.
//!
//! A unit is a millimetre and z is up. A watertight manifold mesh becomes an object of type `model`,
//! as the specification has it for what is printed; any other one is a `surface`.

use std::io::{self, BufWriter, Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::geometry::Mesh;

/// Where the parts of the archive are.
const TYPES: &str = "[Content_Types].xml";
const RELATIONS: &str = "_rels/.rels";
const MODEL: &str = "3D/3dmodel.model";

/// The first line of an XML document.
const XML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";

/// The bytes of an XML document above which an archive needs 64-bit sizes; far from the limit of
/// 2³², since the size is an estimate.
const LARGE: usize = 2 << 30;

/// The most bytes of a vertex or a triangle in the document.
const LONGEST_ELEMENT: usize = 100;

/// The most vertices, from 3MF's type of indices.
const MOST_VERTICES: usize = i32::MAX as usize;

/// The three parts: types of content, the relation that leads to the model, and the model.
///
/// An error if a coordinate is not finite, if there are no triangles, or more than 2³¹ − 1 vertices. The archive
/// is made in memory, because its directory needs the places of what was written.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    if !mesh.positions.iter().all(|position| position.is_finite()) {
        let message = "a coordinate is not finite";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    if mesh.triangles.is_empty() {
        let message = "3MF cannot hold a mesh without triangles";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    if mesh.positions.len() > MOST_VERTICES {
        let message = "3MF files hold at most 2147483647 vertices";
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    let elements = mesh.positions.len() + mesh.triangles.len();
    // Without the feature for it no time is written: the same mesh gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .large_file(elements.saturating_mul(LONGEST_ELEMENT) > LARGE);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    archive.start_file(TYPES, options)?;
    write_types(&mut archive)?;
    archive.start_file(RELATIONS, options)?;
    write_relations(&mut archive)?;
    archive.start_file(MODEL, options)?;
    let mut model = BufWriter::new(&mut archive);
    write_model(&mut model, mesh)?;
    model.flush()?;
    drop(model);
    output.write_all(archive.finish()?.get_ref())
}

fn write_types(output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "{XML}")?;
    writeln!(
        output,
        "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
    )?;
    for (extension, kind) in [
        (
            "rels",
            "application/vnd.openxmlformats-package.relationships+xml",
        ),
        (
            "model",
            "application/vnd.ms-package.3dmanufacturing-3dmodel+xml",
        ),
    ] {
        writeln!(
            output,
            "<Default Extension=\"{extension}\" ContentType=\"{kind}\"/>"
        )?;
    }
    writeln!(output, "</Types>")
}

fn write_relations(output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "{XML}")?;
    writeln!(
        output,
        "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    )?;
    writeln!(
        output,
        "<Relationship Id=\"model\" Target=\"/{MODEL}\" \
         Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>"
    )?;
    writeln!(output, "</Relationships>")
}

fn write_model(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let topology = mesh.topology();
    let is_solid = topology.watertight && topology.manifold;
    let kind = if is_solid { "model" } else { "surface" };
    writeln!(output, "{XML}")?;
    writeln!(
        output,
        "<model unit=\"millimeter\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">"
    )?;
    writeln!(output, "<metadata name=\"Application\">Imp</metadata>")?;
    writeln!(output, "<resources>")?;
    writeln!(output, "<object id=\"1\" type=\"{kind}\">")?;
    writeln!(output, "<mesh>")?;
    writeln!(output, "<vertices>")?;
    for position in &mesh.positions {
        let [x, y, z] = position.to_array();
        writeln!(output, "<vertex x=\"{x:?}\" y=\"{y:?}\" z=\"{z:?}\"/>")?;
    }
    writeln!(output, "</vertices>")?;
    writeln!(output, "<triangles>")?;
    for [a, b, c] in &mesh.triangles {
        // The specification demands three different vertices.
        if a == b || b == c || c == a {
            continue;
        }
        writeln!(output, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")?;
    }
    writeln!(output, "</triangles>")?;
    writeln!(output, "</mesh>")?;
    writeln!(output, "</object>")?;
    writeln!(output, "</resources>")?;
    writeln!(output, "<build>")?;
    writeln!(output, "<item objectid=\"1\"/>")?;
    writeln!(output, "</build>")?;
    writeln!(output, "</model>")
}
