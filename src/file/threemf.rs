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

#[cfg(test)]
mod tests {
    use std::io::Read;

    use glam::DVec3;
    use zip::ZipArchive;

    use super::super::test_values::{bytes, mesh};
    use super::*;

    /// The parts of an archive, by name.
    fn parts(archive: Vec<u8>) -> Vec<(String, String)> {
        let mut archive = ZipArchive::new(Cursor::new(archive)).unwrap();
        let part = |index: usize| {
            let mut file = archive.by_index(index).unwrap();
            let mut text = String::new();
            file.read_to_string(&mut text).unwrap();
            (file.name().unwrap().into_owned(), text)
        };
        (0..3).map(part).collect()
    }

    /// The attributes of each element of that name, in their order.
    fn attributes<'a>(text: &'a str, element: &str) -> Vec<Vec<&'a str>> {
        let start = format!("<{element} ");
        let inner = text
            .split(&start)
            .skip(1)
            .map(|rest| rest.split('>').next().unwrap());
        inner
            .map(|inner| inner.split('"').skip(1).step_by(2).collect())
            .collect()
    }

    fn tetrahedron() -> Mesh {
        Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z / 3.0],
            normals: Vec::new(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        }
    }

    #[test]
    fn the_parts_lead_to_the_model() {
        let parts = parts(bytes(write_mesh, &tetrahedron()));
        let names: Vec<&str> = parts.iter().map(|(name, _)| &**name).collect();
        assert_eq!(
            names,
            ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
        );
        let extensions = attributes(&parts[0].1, "Default");
        assert_eq!([extensions[0][0], extensions[1][0]], ["rels", "model"]);
        assert!(extensions[1][1].ends_with("3dmanufacturing-3dmodel+xml"));
        let relation = &attributes(&parts[1].1, "Relationship")[0];
        assert_eq!(relation[1], "/3D/3dmodel.model");
        assert!(relation[2].ends_with("/2013/01/3dmodel"));
    }

    #[test]
    fn meshes_read_back_exactly() {
        let mesh = mesh();
        let parts = parts(bytes(write_mesh, &mesh));
        let model = &parts[2].1;
        assert_eq!(attributes(model, "model")[0][0], "millimeter");
        let vertices = attributes(model, "vertex").into_iter().map(|vertex| {
            let numbers: Vec<f64> = vertex.iter().map(|word| word.parse().unwrap()).collect();
            DVec3::from_slice(&numbers)
        });
        assert_eq!(vertices.collect::<Vec<_>>(), mesh.positions);
        let triangles = attributes(model, "triangle").into_iter().map(|triangle| {
            let corners: Vec<u32> = triangle.iter().map(|word| word.parse().unwrap()).collect();
            <[u32; 3]>::try_from(corners).unwrap()
        });
        assert_eq!(triangles.collect::<Vec<_>>(), mesh.triangles);
        assert_eq!(attributes(model, "item"), [["1"]]);
    }

    #[test]
    fn what_is_closed_is_a_model_and_the_rest_a_surface() {
        let kind = |mesh: &Mesh| {
            let parts = parts(bytes(write_mesh, mesh));
            attributes(&parts[2].1, "object")[0][1].to_owned()
        };
        let mut mesh = tetrahedron();
        assert_eq!(kind(&mesh), "model");
        mesh.triangles.pop();
        assert_eq!(kind(&mesh), "surface");
    }

    #[test]
    fn triangles_that_repeat_a_vertex_are_left_out() {
        let mut mesh = tetrahedron();
        mesh.triangles.push([0, 1, 1]);
        let parts = parts(bytes(write_mesh, &mesh));
        assert_eq!(attributes(&parts[2].1, "triangle").len(), 4);
    }

    #[test]
    fn the_same_mesh_gives_the_same_bytes() {
        assert_eq!(bytes(write_mesh, &mesh()), bytes(write_mesh, &mesh()));
    }

    #[test]
    fn what_the_format_cannot_hold_is_refused() {
        let message = |mesh: &Mesh| write_mesh(&mut Vec::new(), mesh).unwrap_err().to_string();
        let mut mesh = tetrahedron();
        mesh.positions[0].x = f64::INFINITY;
        assert!(message(&mesh).contains("not finite"));
        assert!(message(&Mesh::default()).contains("without triangles"));
    }
}
