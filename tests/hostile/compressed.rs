//! Small glTF files with compressed geometry: the tetrahedron of the other seeds, packed by the encoders of meshoptimizer and
//! Draco.

/// Positions as `ATTRIBUTES`, version 0 and 1, and version 1 with the exponential filter.
const POSITIONS: [&[u8]; 3] = [
    &[
        160, 0, 0, 1, 60, 0, 0, 0, 255, 255, 1, 60, 0, 0, 0, 126, 125, 0, 0, 1, 12, 0, 0, 0, 255, 1, 13, 0,
        0, 0, 126, 0, 0, 1, 3, 0, 0, 0, 255, 1, 3, 0, 0, 0, 126, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ],
    &[
        161, 234, 234, 234, 0, 127, 127, 0, 0, 0, 127, 2, 0, 0, 0, 127, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 18, 18, 1,
    ],
    &[
        161, 238, 238, 238, 0, 64, 63, 0, 0, 202, 0, 0, 0, 0, 64, 47, 0, 202, 0, 0, 0, 0, 0, 64, 0, 202, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 142, 0, 0, 0, 142, 0, 0, 0, 142, 0, 0, 0,
    ],
];

/// Corners as `TRIANGLES` and as `INDICES`, of 16 bits.
const CORNERS: [&[u8]; 2] = [
    &[225, 254, 14, 18, 3, 240, 4, 0, 118, 135, 86, 103, 120, 169, 134, 101, 137, 104, 152, 1, 105, 0, 0],
    &[209, 0, 8, 2, 2, 4, 8, 6, 4, 4, 2, 6, 12, 0, 0, 0, 0],
];

/// Normals with the octahedral filter.
const NORMALS: &[u8] = &[
    160, 1, 60, 0, 0, 0, 254, 253, 1, 15, 0, 0, 0, 254, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 0,
];

/// Two triangles in a Draco stream.
const DRACO: &[u8] = &[
    68, 82, 65, 67, 79, 2, 2, 1, 1, 0, 0, 0, 4, 2, 0, 2, 0, 0, 1, 31, 255, 1, 17, 1, 255, 0, 0, 1, 0, 9, 3,
    0, 0, 2, 1, 1, 1, 0, 15, 3, 1, 16, 47, 1, 48, 3, 0, 40, 130, 0, 192, 170, 10, 0, 172, 170, 172, 42, 0,
    160, 170, 86, 85, 0, 0, 0, 0, 0, 0, 0, 255, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 63, 0, 0, 192, 63,
    14,
];

/// JSON with `@BUFFER@` where the buffer's `uri` would stand, and the buffer.
pub(super) fn scenes() -> Vec<(String, Vec<u8>)> {
    let [plain, fine, filtered] = POSITIONS;
    let [triangles, indices] = CORNERS;
    vec![
        meshopt("EXT_meshopt_compression", plain, "NONE", (triangles, "TRIANGLES")),
        meshopt("KHR_meshopt_compression", fine, "NONE", (indices, "INDICES")),
        meshopt("EXT_meshopt_compression", filtered, "EXPONENTIAL", (triangles, "TRIANGLES")),
        draco(),
    ]
}

fn meshopt(name: &str, positions: &[u8], filter: &str, (corners, mode): (&[u8], &str)) -> (String, Vec<u8>) {
    let mut bin = Vec::new();
    let mut views = Vec::new();
    for (stream, plain, length, stride, count, mode, filter) in [
        (positions, 0, 48, 12, 4, "ATTRIBUTES", filter),
        (corners, 48, 24, 2, 12, mode, "NONE"),
        (NORMALS, 72, 16, 4, 4, "ATTRIBUTES", "OCTAHEDRAL"),
    ] {
        bin.resize(bin.len().next_multiple_of(4), 0);
        let (at, size) = (bin.len(), stream.len());
        bin.extend_from_slice(stream);
        views.push(format!(
            r#"{{"buffer":1,"byteOffset":{plain},"byteLength":{length},"extensions":{{"{name}":{{"buffer":0,"byteOffset":{at},"byteLength":{size},"byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}"#
        ));
    }
    bin.resize(bin.len().next_multiple_of(4), 0);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["{name}"],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":2}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}},
{{"bufferView":2,"componentType":5120,"normalized":true,"count":4,"type":"VEC3"}}],
"bufferViews":[{}],
"buffers":[{{@BUFFER@"byteLength":{}}},{{"byteLength":88,"extensions":{{"{name}":{{"fallback":true}}}}}}]}}"#,
        views.join(","),
        bin.len()
    );
    (json, bin)
}

fn draco() -> (String, Vec<u8>) {
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["KHR_draco_mesh_compression"],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,
"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{"POSITION":0}}}}}}}}]}}],
"accessors":[{{"componentType":5126,"count":4,"type":"VEC3"}},{{"componentType":5123,"count":6,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":{0}}}],"buffers":[{{@BUFFER@"byteLength":{0}}}]}}"#,
        DRACO.len()
    );
    (json, DRACO.to_vec())
}
