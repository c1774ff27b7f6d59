//! Small valid files, each with other things in it.

use super::{Target, compressed};
use crate::containers::{self, embedded, glb};
use sombrero::io::{Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::{Identity, Secret};
use sombrero::{EmbedOptions, embed};

/// Files that the reader accepts. The same on every call.
pub fn seeds(target: Target) -> Vec<Vec<u8>> {
    let text = |files: &[&str]| files.iter().map(|f| f.as_bytes().to_vec()).collect();
    match target {
        Target::Obj => text(OBJ),
        Target::Ply => ply(),
        Target::Off => text(OFF).into_iter().chain([binary_off()]).collect(),
        Target::Stl => stl(),
        Target::Gltf => gltf().iter().map(|(json, bin)| embedded(json, bin).into_bytes()).collect(),
        Target::Glb => scenes().iter().map(|(json, bin)| glb(json.as_bytes(), bin)).collect(),
        Target::ThreeMf => MODELS.iter().map(|model| archive(model.as_bytes())).collect(),
        Target::Key => vec![key()],
    }
}

const OBJ: &[&str] = &[
    "# all there is\nmtllib m.mtl\no thing\nv 0 0 0 0.5 0.5 1\nv 1.50 0 0\nv 0 1e0 0 1.0\nv -.5 +1 1\nvt 0 0\nvn 0 0 1\n\
     vn 0 .6 .8\ng a b\nusemtl red\ns 1\nf 1/1/1 2/1/1 3/1/2 4/1/2\nf -1//1 -2//2 -3//-1\nl 1 2\np 1\n",
    "v 0 0 \\\n0\r\nv 1 0 0\rv 0 1 0\nv 1 1 1\nf 1 2 3 \\\n4\nf 1 3 2",
    "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\ncstype bezier\ncurv2 1 2\nvp 0 1\nend\n",
    "V 0 0 0\nV nan nan nan\nv 1 0 0\nv 0 1 0\nv .25 .25 0\nVN 0 0 1\nG a\nF 1 3 5 4\nFO 1 3 4\n",
    "v 1\nv 0 0 0.50#a\nv 1 0 0#\nv 0 1 0\nv 1.#QNAN 1 2\nf 2 3 4#b\n",
    "# points\nv 0 0 0 1 0 0\nv 1 2 3 0 1 0\nv 4 5 6\np 1 2 3\n",
];

const OFF: &[&str] = &[
    "OFF\n# counts\n4 2 0\n0 0 0\n1.50 0 0 # here\n0 1 0\n0 0 1e0\n3 0 1 2 255 0 0\n4 0 1 2 3\nmore\n",
    "STCNOFF 3 1\n0 0 0 0 0 1 1 0 0 1 0 0\n1 0 0 0 0 1 1 0 0 1 1 0\n0 1 0 0 0 1 1 0 0 1 0 1\n3 0 1 2\n",
    "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "OFF5 1 0\n0 0 0\n2 0 0\n.5 .5 0\n0 2 0\nnan 0 0\n4 0 1\n 2 3\n",
    "NCOFF# keyword\n3 1 0\n0 0 0 0 0 1 1 0 0 1\n1 0 0#here\n0 1 0 0 0 1 1 0 0 1\n3 0 1 2\n",
    "COFF 3 0 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n",
];

/// With normals, and a colour at one of two polygons.
fn binary_off() -> Vec<u8> {
    let mut bytes = b"NOFF BINARY\n".to_vec();
    let mut words = vec![4_u32, 2, 0];
    words.extend(
        POINTS.iter().flat_map(|p| p.iter().chain(&[0.0, 0.0, 1.0]).map(|c| c.to_bits()).collect::<Vec<_>>()),
    );
    words.extend([3, 0, 2, 1, 3, 1.0_f32.to_bits(), 0, 0, 4, 0, 1, 2, 3, 0]);
    bytes.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    bytes
}

/// Points and faces of a tetrahedron as plain numbers.
const POINTS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.25, 1.0]];
const FACES: [[u8; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

fn ply() -> Vec<Vec<u8>> {
    let ascii = "ply\nformat ascii 1.0\ncomment made by hand\nelement camera 1\nproperty float fov\nelement vertex 4\n\
                 property uchar red\nproperty double x\nproperty float y\nproperty float z\nproperty float nx\n\
                 property float ny\nproperty float nz\nproperty list uchar int extra\nelement face 2\n\
                 property list uchar uint vertex_indices\nproperty float quality\nelement edge 1\nproperty int a\n\
                 end_header\n45.0\n255 0 0 0 0 0 1 2 7 8\n0 1.50 0 0 0 0 1 0\n9 0 1 0 0 .6 .8 1 5\n1 0 0 1 0 0 1 0\n\
                 3 0 1 2 0.5\n4 0 1 2 3 1\n3\n";
    let strips = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                  element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n\
                  8 0 1 2 3 -1 2 1 0\n";
    let cloud = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                 end_header\n0 0 0 7\n1 0 0 \n0 1 0 255 255\n";
    let mut all = [ascii, strips, cloud].map(|text| text.as_bytes().to_vec()).to_vec();
    for (encoding, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let header = format!(
            "ply\nformat {encoding} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\nproperty uchar alpha\nelement face 4\n\
             property list uchar int vertex_indices\nend_header\n"
        );
        let mut bytes = header.into_bytes();
        for p in POINTS {
            for c in p.into_iter().chain([0.0, 0.0, 1.0]) {
                bytes.extend(if big { c.to_be_bytes() } else { c.to_le_bytes() });
            }
            bytes.push(255);
        }
        for f in FACES {
            bytes.push(3);
            f.iter().for_each(|&v| {
                bytes.extend(if big { i32::from(v).to_be_bytes() } else { i32::from(v).to_le_bytes() });
            });
        }
        all.push(bytes);
    }
    all
}

fn stl() -> Vec<Vec<u8>> {
    let text = "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1.50 0 0\n   vertex 0 1e0 0\n  \
                endloop\n endfacet\nendsolid a b\nsolid\nfacet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 \
                vertex 0 0 1 endloop endfacet endsolid\n";
    let mut binary = encode(Format::StlBinary, &tetrahedron()).expect("a tetrahedron can be written");
    binary[..5].copy_from_slice(b"solid");
    let loose = "\u{feff}SOLID x\ncolor 1 0 0\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0 \nvertex 0 1 0\nend loop\n\
                 end facet\r\nendsolidx\nsolid\nfacet normal nan nan nan\nouterloop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\n\
                 endloop\nendfacet\nend solid x\n\u{1a}tail";
    let unfinished =
        "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet";
    let mut uncounted = binary.clone();
    uncounted[80..84].copy_from_slice(&[0; 4]);
    let twice = [binary.as_slice(), &binary].concat();
    let one_line = "solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1.50 0 0 vertex 0 1 0 endloop endfacet color 1 0 0 \
                    facet normal 0 0.60000 0.8 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 0 1 # vertex 3\nendloop endfacet \
                    endsolid a";
    vec![
        text.as_bytes().to_vec(),
        binary,
        loose.as_bytes().to_vec(),
        unfinished.as_bytes().to_vec(),
        uncounted,
        twice,
        one_line.as_bytes().to_vec(),
    ]
}

fn tetrahedron() -> Soup {
    let points = POINTS.iter().map(|p| nalgebra::Point3::from(p.map(f64::from))).collect();
    Soup::new(points, FACES.iter().map(|f| f.map(u32::from)).collect())
}

/// JSON of a GLB, and its buffer.
pub(super) fn scenes() -> Vec<(String, Vec<u8>)> {
    gltf().into_iter().map(|(json, bin)| (json.replace("@BUFFER@", ""), bin)).collect()
}

/// JSON with `@BUFFER@` where the buffer's `uri` would stand, and the buffer.
fn gltf() -> Vec<(String, Vec<u8>)> {
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let flat = POINTS.concat();
    let positions = floats(&flat);
    let indices: Vec<u8> = FACES.concat();
    let plain = (
        r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"name":"a","translation":[1,2,3],"rotation":[0,0.6,0,0.8],"scale":[2,2,3],"children":[1,2]},{"mesh":0},
{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0},{"attributes":{"POSITION":0},"indices":2,"mode":5}]}],
"materials":[{"name":"red"}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"},{"bufferView":1,"byteOffset":2,"componentType":5121,"count":5,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
"buffers":[{@BUFFER@"byteLength":60}]}"#
            .to_owned(),
        [positions.clone(), indices.clone()].concat(),
    );
    let mut rows = Vec::new();
    for p in POINTS {
        rows.extend(floats(&p));
        rows.extend(floats(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]));
    }
    rows.extend(FACES.concat().iter().flat_map(|&v| u16::from(v).to_le_bytes()));
    let interleaved = (
        r#"{"asset":{"version":"2.0","generator":"x"},"nodes":[{"mesh":0,"skin":0}],"skins":[{"joints":[0]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TANGENT":2,"_A":1},"indices":3}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":0,"byteOffset":12,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":0,"byteOffset":24,"componentType":5126,"count":4,"type":"VEC4"},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":160,"byteStride":40},{"buffer":0,"byteOffset":160,"byteLength":24}],
"buffers":[{@BUFFER@"byteLength":184}]}"#
            .to_owned(),
        rows,
    );
    let mut packed = positions;
    packed.extend([1_u16, 3].iter().flat_map(|v| v.to_le_bytes()));
    packed.extend(floats(&[2.0, 0.0, 0.0, 0.0, 0.0, 2.0]));
    packed.extend([0_i16, 0, 0, 0, 32767, 0, 0, 0, 0, 32767, 0, 0].iter().flat_map(|v| v.to_le_bytes()));
    let sparse = (
        r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_mesh_quantization"],"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":1}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":6}]},{"primitives":[{"attributes":{"POSITION":1}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[2,1,2],
"sparse":{"count":2,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2}}},
{"bufferView":3,"componentType":5122,"normalized":true,"count":3,"type":"VEC3","min":[0,0,0],"max":[32767,32767,0]}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":4},
{"buffer":0,"byteOffset":52,"byteLength":24},{"buffer":0,"byteOffset":76,"byteLength":24,"byteStride":8}],
"buffers":[{@BUFFER@"byteLength":100}]}"#
            .to_owned(),
        packed,
    );
    let drawn = (
        r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1},
{"attributes":{"POSITION":2},"mode":0},{"attributes":{"POSITION":0},"mode":3}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4.0,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"},{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":24}],
"buffers":[{@BUFFER@"byteLength":84}]}"#
            .to_owned(),
        [floats(&flat), indices, floats(&flat[3..9])].concat(),
    );
    let mut all = vec![plain, interleaved, sparse, drawn];
    all.extend(compressed::scenes());
    all
}

pub(super) const MODELS: &[&str] = &[
    r##"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
 <metadata name="Title">a &amp; b</metadata>
 <resources>
  <basematerials id="5"><base name="red" displaycolor="#FF0000"/></basematerials>
  <object id="1" type="model" pid="5" pindex="0"><mesh><vertices>
   <vertex x="0" y="0" z="0"/><vertex x="1.50" y='0' z="0" /><vertex z="0" x="0" y="1"></vertex><vertex x="0" y="0" z="1e0"/>
  </vertices><triangles>
   <triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3" pid="5" p1="0"/><triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/>
  </triangles></mesh></object>
  <object id="2"><components><component objectid="1"/><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 0 0"/></components></object>
 </resources>
 <build><item objectid="2" transform="0 1 0 -1 0 0 0 0 2 1 2 3"/><item objectid="1"/></build>
</model>
"##,
    "<m:model xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><!-- c --><m:resources>\
     <m:object id='7'><m:mesh><m:vertices><m:vertex x='0' y='0' z='0'/><m:vertex x='1' y='0' z='0'/>\
     <m:vertex x='0' y='1' z='0'/></m:vertices><m:triangles><m:triangle v1='0' v2='1' v3='2'/></m:triangles>\
     </m:mesh></m:object></m:resources><m:build/></m:model>",
];

/// An archive with this model, stored rather than deflated, so that changes of its bytes reach the reader.
pub(super) fn archive(model: &[u8]) -> Vec<u8> {
    containers::archive(model, zip::CompressionMethod::Stored)
}

fn key() -> Vec<u8> {
    let bytes = encode(Format::Obj, &shapes::bumpy_sphere(300)).expect("a ball can be written");
    let original = sombrero::io::Document::parse(bytes, None).expect("what was just written");
    let mut options = EmbedOptions::default();
    options.parameters.basis.coefficients = 16;
    options.identity = Identity { owner: "a \"museum\"".into(), recipient: "b\u{e9}".into() };
    embed(&original, Secret([7; 32]), &options).expect("a ball can be marked").key.to_json().into_bytes()
}
