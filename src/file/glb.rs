//! GLB, the binary form of glTF 2.0 (ISO/IEC 12113:2022): a mesh in one buffer, described by JSON.
//!
//! glTF measures in metres and its y axis points up, so that one unit becomes a metre and [x, y, z],
//! where z is up, becomes [x, z, −y]. Numbers are in single precision, which is all that glTF has.

use std::io::{self, Write};

use glam::{DVec3, Vec3};

use crate::geometry::Mesh;

/// `glTF` and the version of the container.
const MAGIC: [u8; 4] = *b"glTF";
const VERSION: u32 = 2;

/// Names of the chunks.
const JSON_CHUNK: [u8; 4] = *b"JSON";
const BINARY_CHUNK: [u8; 4] = *b"BIN\0";

/// glTF's numbers for types of components, for the use of buffers and for triangles.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const TRIANGLES: u32 = 4;

/// One node with one mesh: positions, normals if there are any, indices.
///
/// A vertex whose normal is not known gets the mean of its triangles', weighted by area: glTF has
/// unit normals for all vertices or for none. An error if there are no triangles, if a coordinate is
/// beyond single precision, or if the file would have more than 2³² − 1 bytes, which the format
/// cannot count.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    if mesh.triangles.is_empty() {
        let message = "glTF cannot hold a mesh without triangles";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    let positions: Vec<Vec3> = mesh.positions.iter().map(|&at| turned(at)).collect();
    if !positions.iter().all(|position| position.is_finite()) {
        let message = "a coordinate is beyond the single precision of glTF";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    let normals = unit_normals(mesh);
    let vectors = [&positions, &normals];
    let bytes = [
        12 * positions.len(),
        12 * normals.len(),
        12 * mesh.triangles.len(),
    ];
    let mut json = description(&positions, normals.len(), mesh.triangles.len(), bytes);
    // Chunks are multiples of four bytes long; all numbers of the other one have four.
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let binary: usize = bytes.iter().sum();
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| {
            let message = "GLB files hold at most 4294967295 bytes";
            io::Error::new(io::ErrorKind::FileTooLarge, message)
        })
    };
    output.write_all(&MAGIC)?;
    output.write_all(&VERSION.to_le_bytes())?;
    output.write_all(&length(12 + 8 + json.len() + 8 + binary)?.to_le_bytes())?;
    output.write_all(&length(json.len())?.to_le_bytes())?;
    output.write_all(&JSON_CHUNK)?;
    output.write_all(json.as_bytes())?;
    output.write_all(&length(binary)?.to_le_bytes())?;
    output.write_all(&BINARY_CHUNK)?;
    for component in vectors.into_iter().flatten().flat_map(Vec3::to_array) {
        output.write_all(&component.to_le_bytes())?;
    }
    for vertex in mesh.triangles.as_flattened() {
        output.write_all(&vertex.to_le_bytes())?;
    }
    Ok(())
}

/// In glTF's directions and precision.
fn turned(vector: DVec3) -> Vec3 {
    // 0 rather than −0 where y is 0.
    DVec3::new(vector.x, vector.z, 0.0 - vector.y).as_vec3()
}

/// A unit normal for each vertex, or none if the mesh has none.
fn unit_normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = mesh.normals.clone();
    if normals.contains(&DVec3::ZERO) {
        let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let doubled_area = (b - a).cross(c - a);
            for &vertex in triangle {
                sums[vertex as usize] += doubled_area;
            }
        }
        for (normal, sum) in normals.iter_mut().zip(sums) {
            if *normal == DVec3::ZERO {
                // Of a vertex without area any direction is as good as another.
                *normal = sum.try_normalize().unwrap_or(DVec3::Z);
            }
        }
    }
    let turned = normals.into_iter().map(turned);
    // Rounded once more, since a reader may insist on the length.
    turned.map(|normal| normal.normalize_or(Vec3::Y)).collect()
}

/// The components with all their digits, so that a reader in double precision finds the same.
fn exact(vector: Vec3) -> [f64; 3] {
    vector.as_dvec3().to_array()
}

/// The JSON that says what the buffer holds: `bytes` of positions, normals and indices.
fn description(
    positions: &[Vec3],
    normals: usize,
    triangles: usize,
    [position_bytes, normal_bytes, index_bytes]: [usize; 3],
) -> String {
    let low = positions
        .iter()
        .fold(Vec3::INFINITY, |low, &at| low.min(at));
    let high = positions
        .iter()
        .fold(Vec3::NEG_INFINITY, |high, &at| high.max(at));
    let view = |start: usize, bytes: usize, target: u32| {
        format!(
            "{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{bytes},\"target\":{target}}}"
        )
    };
    let mut views = vec![
        view(0, position_bytes, ARRAY_BUFFER),
        view(
            position_bytes + normal_bytes,
            index_bytes,
            ELEMENT_ARRAY_BUFFER,
        ),
    ];
    let vertices = positions.len();
    let indices = 3 * triangles;
    let mut accessors = vec![
        format!(
            "{{\"bufferView\":0,\"componentType\":{FLOAT},\"count\":{vertices},\"type\":\"VEC3\",\
             \"min\":{:?},\"max\":{:?}}}",
            exact(low),
            exact(high)
        ),
        format!(
            "{{\"bufferView\":1,\"componentType\":{UNSIGNED_INT},\"count\":{indices},\
             \"type\":\"SCALAR\"}}"
        ),
    ];
    let mut attributes = "\"POSITION\":0".to_owned();
    if normals > 0 {
        views.push(view(position_bytes, normal_bytes, ARRAY_BUFFER));
        accessors.push(format!(
            "{{\"bufferView\":2,\"componentType\":{FLOAT},\"count\":{normals},\"type\":\"VEC3\"}}"
        ));
        attributes.push_str(",\"NORMAL\":2");
    }
    format!(
        "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"Imp\"}},\"scene\":0,\
         \"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{{attributes}}},\"indices\":1,\
         \"mode\":{TRIANGLES}}}]}}],\
         \"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{}}}]}}",
        accessors.join(","),
        views.join(","),
        position_bytes + normal_bytes + index_bytes
    )
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::super::test_values::{bytes, mesh, single_precision_mesh};
    use super::*;

    fn word(bytes: &[u8], at: usize) -> usize {
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
    }

    /// The JSON and the buffer, by the rules of the container.
    fn chunks(bytes: &[u8]) -> (Value, &[u8]) {
        assert_eq!((&bytes[..4], word(bytes, 4)), (&b"glTF"[..], 2));
        assert_eq!(word(bytes, 8), bytes.len());
        let length = word(bytes, 12);
        assert_eq!((length % 4, &bytes[16..20]), (0, &b"JSON"[..]));
        let (json, rest) = bytes[20..].split_at(length);
        assert_eq!(word(rest, 0), rest.len() - 8);
        assert_eq!(&rest[4..8], b"BIN\0");
        (serde_json::from_slice(json).unwrap(), &rest[8..])
    }

    /// The words of an accessor, with their number and type.
    fn accessor<'a>(json: &Value, buffer: &'a [u8], index: &Value) -> (Value, Vec<&'a [u8]>) {
        let accessor = &json["accessors"][index.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let number = |name: &str| view[name].as_u64().unwrap() as usize;
        let bytes = &buffer[number("byteOffset")..][..number("byteLength")];
        let kind = json!([
            accessor["componentType"],
            accessor["type"],
            accessor["count"]
        ]);
        (kind, bytes.chunks(4).collect())
    }

    fn vectors(words: &[&[u8]]) -> Vec<[f32; 3]> {
        let float = |word: &&[u8]| f32::from_le_bytes((*word).try_into().unwrap());
        let floats: Vec<f32> = words.iter().map(float).collect();
        floats
            .chunks(3)
            .map(|three| three.try_into().unwrap())
            .collect()
    }

    #[test]
    fn meshes_read_back_turned_with_y_up() {
        let mesh = single_precision_mesh();
        let bytes = bytes(write_mesh, &mesh);
        let (json, buffer) = chunks(&bytes);
        assert_eq!(json["asset"]["version"], "2.0");
        assert_eq!(json["buffers"], json!([{ "byteLength": buffer.len() }]));
        assert_eq!(json["scenes"][0]["nodes"], json!([0]));
        assert_eq!(json["nodes"][0]["mesh"], 0);
        let primitive = &json["meshes"][0]["primitives"][0];
        assert_eq!(primitive["mode"], 4);

        let (kind, words) = accessor(&json, buffer, &primitive["attributes"]["POSITION"]);
        assert_eq!(kind, json!([5126, "VEC3", 5]));
        let turned = |v: DVec3| [v.x, v.z, -v.y].map(|component| component as f32);
        let expected: Vec<[f32; 3]> = mesh.positions.iter().map(|&at| turned(at)).collect();
        assert_eq!(vectors(&words), expected);
        // x is 0 to 4/8, z is 0 to 16, −y is 1.5.
        assert_eq!(json["accessors"][0]["min"], json!([0.0, 0.0, 1.5]));
        assert_eq!(json["accessors"][0]["max"], json!([0.5, 16.0, 1.5]));

        let (kind, words) = accessor(&json, buffer, &primitive["attributes"]["NORMAL"]);
        assert_eq!(kind, json!([5126, "VEC3", 5]));
        for (found, expected) in vectors(&words).into_iter().zip(&mesh.normals) {
            let difference = Vec3::from(found) - Vec3::from(turned(*expected));
            assert!(difference.length() < 1e-6, "{found:?}");
        }
        let (kind, words) = accessor(&json, buffer, &primitive["indices"]);
        assert_eq!(kind, json!([5125, "SCALAR", 9]));
        let indices: Vec<u8> = words.concat();
        let expected = mesh
            .triangles
            .as_flattened()
            .iter()
            .flat_map(|index| index.to_le_bytes());
        assert_eq!(indices, expected.collect::<Vec<u8>>());
    }

    #[test]
    fn normals_are_left_out_or_found_where_they_are_missing() {
        let mut mesh = Mesh {
            normals: Vec::new(),
            ..single_precision_mesh()
        };
        let without = bytes(write_mesh, &mesh);
        let (json, buffer) = chunks(&without);
        let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
        assert_eq!(*attributes, json!({ "POSITION": 0 }));
        assert_eq!(buffer.len(), 5 * 12 + 9 * 4);
        // A square in the plane y = 0, seen from y < 0: glTF's z axis is −y.
        mesh.positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [9.0, 9.0]]
            .map(|[x, z]| DVec3::new(x, 0.0, z))
            .to_vec();
        mesh.triangles = vec![[0, 1, 2], [0, 2, 3]];
        mesh.normals = vec![DVec3::ZERO; 5];
        mesh.normals[2] = DVec3::X;
        let with = bytes(write_mesh, &mesh);
        let (json, buffer) = chunks(&with);
        let normal = &json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"];
        let (_, words) = accessor(&json, buffer, normal);
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        assert_eq!(vectors(&words), [z, z, x, z, y]);
    }

    #[test]
    fn what_gltf_cannot_hold_is_refused() {
        let message = |mesh: &Mesh| write_mesh(&mut Vec::new(), mesh).unwrap_err().to_string();
        // It has a coordinate of 1e308.
        assert!(message(&mesh()).contains("beyond the single precision"));
        assert!(message(&Mesh::default()).contains("without triangles"));
    }
}
