//! Binary glTF 2.0 meshes: one file that every viewer and engine opens.
//!
//! glTF is y up and right-handed: a vertex (x, y, z) of ours is written as (x, z, −y), metres. Positions are `f32`
//! relative to the lowest corner of the mesh's box, which the node's translation carries in full precision, so a vertex
//! is good to half an ulp of `f32` at the size of the mesh, not at the size of a map coordinate.

use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};

use super::atomic::atomic_write;
use super::error::{Failure, WriteError, name_file};
use crate::mesh::Mesh;

/// "glTF", "JSON" and "BIN\0" as little-endian words.
const MAGIC: u32 = 0x4654_6C67;
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BINARY_CHUNK: u32 = 0x004E_4942;

/// Component types and buffer targets of the format.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes a mesh: vertices with normals and attributes if it has them, and triangles. An attribute `resistance` is called
/// `_RESISTANCE`, as the format asks of what it does not define.
///
/// # Errors
/// [`WriteError`]: a mesh that is not sound (see [`Mesh::check`]) or has no triangle, one of 4 GiB or more, or the file
/// system.
pub fn write(path: &Path, mesh: &Mesh) -> Result<(), WriteError> {
    mesh.check().map_err(|error| WriteError::cannot(path, error, "repair the mesh"))?;
    if mesh.triangles.is_empty() {
        return Err(WriteError::cannot(path, "a mesh without triangles", "choose a region with terrain"));
    }
    // An index of all ones restarts a primitive, so it may not be used as one.
    if mesh.positions.len() > u32::MAX as usize {
        return Err(WriteError::cannot(path, "more vertices than glTF can index", "write a smaller mesh"));
    }
    atomic_write(path, |file| to_writer(file, mesh)).map_err(name_file(path))
}

/// Our axes to those of the format.
fn y_up([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, z, -y]
}

fn to_writer(file: &mut impl Write, mesh: &Mesh) -> Result<(), Failure> {
    let origin = mesh.lowest_corner();
    let local = |p: &[f64; 3]| {
        let p = y_up([p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]);
        // + 0 makes 0 of −0.
        p.map(|x| x as f32 + 0.0)
    };
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for p in mesh.positions.iter().map(local) {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }

    let (vertices, indices) = (mesh.positions.len(), 3 * mesh.triangles.len());
    let normals = if mesh.normals.is_some() { 12 * vertices } else { 0 };
    let binary = 12 * vertices + normals + 4 * vertices * mesh.attributes.len() + 4 * indices;
    let json = serde_json::to_vec(&describe(mesh, origin, [low, high])).map_err(Failure::other)?;
    // Every view is a multiple of four bytes already; the text is filled up with spaces.
    let padding = json.len().next_multiple_of(4) - json.len();
    let total = 12 + 8 + json.len() + padding + 8 + binary;
    let Ok(total) = u32::try_from(total) else {
        return Err(Failure::other("a binary glTF file holds less than 4 GiB; use fewer triangles"));
    };

    let mut words = |words: &[u32]| words.iter().try_for_each(|word| file.write_all(&word.to_le_bytes()));
    words(&[MAGIC, 2, total, (json.len() + padding) as u32, JSON_CHUNK])?;
    file.write_all(&json)?;
    file.write_all(&b"   "[..padding])?;
    let mut words = |words: &[u32]| words.iter().try_for_each(|word| file.write_all(&word.to_le_bytes()));
    words(&[binary as u32, BINARY_CHUNK])?;
    for p in mesh.positions.iter().map(local) {
        words(&p.map(f32::to_bits))?;
    }
    for &normal in mesh.normals.iter().flatten() {
        words(&y_up(normal).map(|n| (n as f32 + 0.0).to_bits()))?;
    }
    for attribute in &mesh.attributes {
        attribute.values.iter().try_for_each(|value| words(&[(value + 0.0).to_bits()]))?;
    }
    for triangle in &mesh.triangles {
        words(triangle)?;
    }
    Ok(())
}

/// The text of the file: one scene, one node, one mesh; views and accessors of positions, normals and attributes if any, and
/// indices.
fn describe(mesh: &Mesh, origin: [f64; 3], [low, high]: [[f32; 3]; 2]) -> Value {
    let vertices = mesh.positions.len();
    let mut offset = 0;
    let mut views = Vec::new();
    let mut view = |length: usize, target: u32| {
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "target": target }));
        offset += length;
        views.len() - 1
    };
    let of = |view: usize, component: u32, count: usize, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let mut positions = of(view(12 * vertices, ARRAY_BUFFER), FLOAT, vertices, "VEC3");
    positions["min"] = json!(low);
    positions["max"] = json!(high);
    let mut accessors = vec![positions];
    let mut attributes = json!({ "POSITION": 0 });
    if mesh.normals.is_some() {
        attributes["NORMAL"] = json!(accessors.len());
        accessors.push(of(view(12 * vertices, ARRAY_BUFFER), FLOAT, vertices, "VEC3"));
    }
    for attribute in &mesh.attributes {
        attributes[format!("_{}", attribute.name.to_ascii_uppercase())] = json!(accessors.len());
        accessors.push(of(view(4 * vertices, ARRAY_BUFFER), FLOAT, vertices, "SCALAR"));
    }
    let last = accessors.len();
    let count = 3 * mesh.triangles.len();
    accessors.push(of(view(4 * count, ELEMENT_ARRAY_BUFFER), UNSIGNED_INT, count, "SCALAR"));
    json!({
        "asset": { "version": "2.0", "generator": "terrain-lab" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "terrain", "translation": y_up(origin).map(|x| x + 0.0) }],
        "meshes": [{ "name": "terrain", "primitives": [{ "attributes": attributes, "indices": last, "mode": 4 }] }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": offset }],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far from the origin, with coordinates that f32 cannot hold there.
    fn mesh() -> Mesh {
        Mesh {
            positions: vec![
                [5e5 + 0.125, 4e6 + 0.25, 10.0],
                [5e5 + 30.0, 4e6 + 0.25, 20.5],
                [5e5 + 30.0, 4e6 + 31.0, 5.0],
                [5e5 + 0.125, 4e6 + 31.0, 7.75],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            normals: None,
            attributes: Vec::new(),
        }
    }

    /// A small reader: the JSON and the binary chunk, checked for their frame.
    fn read(bytes: &[u8]) -> (Value, Vec<u8>) {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(&bytes[..4], b"glTF");
        assert_eq!((word(4), word(8) as usize), (2, bytes.len()));
        let length = word(12) as usize;
        assert_eq!((length % 4, &bytes[16..20]), (0, &b"JSON"[..]));
        let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let at = 20 + length;
        assert_eq!((word(at) as usize, &bytes[at + 4..at + 8]), (bytes.len() - at - 8, &b"BIN\0"[..]));
        (json, bytes[at + 8..].to_vec())
    }

    /// The words of an accessor, through its view.
    fn words(json: &Value, binary: &[u8], accessor: &Value) -> Vec<[u8; 4]> {
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [at, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        let each = if accessor["type"] == "VEC3" { 3 } else { 1 };
        assert_eq!((at % 4, length), (0, 4 * each * accessor["count"].as_u64().unwrap() as usize));
        binary[at..at + length].as_chunks().0.to_vec()
    }

    fn floats(words: Vec<[u8; 4]>) -> Vec<f32> {
        words.into_iter().map(f32::from_le_bytes).collect()
    }

    fn written(mesh: &Mesh) -> (Value, Vec<u8>) {
        let mut bytes = Vec::new();
        to_writer(&mut bytes, mesh).unwrap();
        read(&bytes)
    }

    #[test]
    fn attributes_have_a_view_of_scalars_each() {
        let values: Vec<f32> = (0..mesh().positions.len()).map(|k| k as f32 * 0.25).collect();
        let attribute = crate::mesh::Attribute { name: "resistance".to_owned(), values: values.clone() };
        let made = Mesh { attributes: vec![attribute], ..mesh() };
        let mut bytes = Vec::new();
        to_writer(&mut bytes, &made).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let accessor = json["meshes"][0]["primitives"][0]["attributes"]["_RESISTANCE"].as_u64().unwrap() as usize;
        let accessor = &json["accessors"][accessor];
        assert_eq!(accessor["type"], "SCALAR");
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let first = 20 + length + 8 + view["byteOffset"].as_u64().unwrap() as usize;
        let read: Vec<f32> =
            bytes[first..].chunks(4).take(values.len()).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(read, values);
        assert_eq!(json["buffers"][0]["byteLength"].as_u64().unwrap() as usize, bytes.len() - length - 28);
    }

    #[test]
    fn every_number_comes_back_through_another_reader() {
        let mesh = mesh().with_normals();
        let (json, binary) = written(&mesh);
        assert_eq!(json["asset"]["version"], "2.0");
        assert_eq!(json["buffers"][0]["byteLength"].as_u64().unwrap() as usize, binary.len());
        let primitive = &json["meshes"][0]["primitives"][0];
        let positions = floats(words(&json, &binary, &primitive["attributes"]["POSITION"]));
        let normals = floats(words(&json, &binary, &primitive["attributes"]["NORMAL"]));
        let indices = words(&json, &binary, &primitive["indices"]);
        let translation: Vec<f64> =
            json["nodes"][0]["translation"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert_eq!(translation, [5e5 + 0.125, 5.0, -(4e6 + 0.25)]);
        for (k, [x, y, z]) in mesh.positions.iter().enumerate() {
            // Exact: the offsets within this mesh are short binary fractions.
            let world = [0, 1, 2].map(|axis| f64::from(positions[3 * k + axis]) + translation[axis]);
            assert_eq!(world, [*x, *z, -*y]);
            let [nx, ny, nz] = mesh.normals.as_ref().unwrap()[k];
            assert_eq!(normals[3 * k..3 * k + 3], [nx as f32, nz as f32, -ny as f32]);
        }
        let indices: Vec<u32> = indices.into_iter().map(u32::from_le_bytes).collect();
        assert_eq!(indices, [0, 1, 2, 0, 2, 3]);
        // Turned, not mirrored: up is y, and the triangles still face there.
        let p = |k: usize| glam::Vec3::from_slice(&positions[3 * k..]);
        assert!((p(1) - p(0)).cross(p(2) - p(0)).y > 0.0);
        assert!(normals[1] > 0.0);
    }

    #[test]
    fn the_least_and_greatest_position_are_those_of_the_numbers_written() {
        let (json, binary) = written(&mesh());
        let positions = floats(words(&json, &binary, &json!(0)));
        for (key, pick) in [("min", f32::min as fn(f32, f32) -> f32), ("max", f32::max)] {
            for axis in 0..3 {
                let found = positions.iter().skip(axis).step_by(3).copied().reduce(pick).unwrap();
                assert_eq!(json["accessors"][0][key][axis].as_f64(), Some(f64::from(found)));
            }
        }
        assert!(json["accessors"][1].get("min").is_none() && json["accessors"].as_array().unwrap().len() == 2);
    }

    #[test]
    fn what_cannot_be_drawn_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        let broken = Mesh { triangles: vec![[0, 1, 4]], ..mesh() };
        assert!(write(&path, &broken).unwrap_err().to_string().contains("triangle 0"));
        assert!(write(&path, &Mesh::default()).unwrap_err().to_string().contains("without triangles"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        write(&path, &mesh()).unwrap();
        assert_eq!(read(&std::fs::read(&path).unwrap()).0["scene"], 0);
    }
}
