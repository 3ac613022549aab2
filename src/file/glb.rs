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
