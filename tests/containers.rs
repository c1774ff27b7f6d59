//! Files that hold a scene rather than a mesh: glTF and 3MF.

use sombrero::mesh::Soup;
use std::fmt::Write as _;
use std::io::{Cursor, Read, Write as _};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// Bytes of a vertex: position, normal, texture coordinates.
const ROW: usize = 32;
/// Bytes before the first vertex: a picture.
const PICTURE: &[u8; 16] = b"\x89PNG, they say..";

/// JSON of a scene with `soup` in it, with `@BUFFER@` where the buffer's `uri` may stand, and the buffer.
///
/// The two halves of the triangles are primitives of their own material with vertices of their own, as
/// texture seams make them, interleaved with normals and texture coordinates. Two nodes show the mesh, under
/// a node that turns and scales.
pub(crate) fn scene(soup: &Soup) -> (String, Vec<u8>) {
    let mut bin = PICTURE.to_vec();
    for p in soup.points.iter().chain(&soup.points) {
        let normal = p.coords.normalize();
        let row = [p.x, p.y, p.z, normal.x, normal.y, normal.z, 0.25, 0.75];
        row.iter().for_each(|&x| bin.extend((x as f32).to_le_bytes()));
    }
    let rows = bin.len() - PICTURE.len();
    soup.triangles.iter().flatten().for_each(|v| bin.extend(v.to_le_bytes()));
    let (vertices, triangles) = (soup.points.len(), soup.triangles.len());
    let half = triangles / 2;
    let [min, max] = [f32::min, f32::max].map(|pick| {
        let of = |axis: usize| soup.points.iter().map(|p| p[axis] as f32).reduce(pick).unwrap();
        format!("[{:?}, {:?}, {:?}]", f64::from(of(0)), f64::from(of(1)), f64::from(of(2)))
    });
    let mut accessors = String::new();
    for copy in 0..2 {
        let start = copy * vertices * ROW;
        let accessor = |at: usize, kind: &str, more: &str| {
            format!(
                "{{\"bufferView\":1,\"byteOffset\":{},\"componentType\":5126,\"count\":{vertices},\"type\":\"{kind}\"{more}}},\n",
                start + at
            )
        };
        accessors += &accessor(0, "VEC3", &format!(", \"min\": {min},\n\"max\": {max}"));
        accessors += &(accessor(12, "VEC3", "") + &accessor(24, "VEC2", ""));
    }
    for (first, count) in [(0, half), (half, triangles - half)] {
        let end = if first == 0 { ",\n" } else { "" };
        write!(
            accessors,
            "{{\"bufferView\":2,\"byteOffset\":{},\"componentType\":5125,\"count\":{},\"type\":\"SCALAR\"}}{end}",
            12 * first,
            3 * count
        )
        .unwrap();
    }
    let primitive = |copy: usize| {
        let attributes =
            format!("\"POSITION\":{},\"NORMAL\":{},\"TEXCOORD_0\":{}", 3 * copy, 3 * copy + 1, 3 * copy + 2);
        format!("{{\"attributes\":{{{attributes}}},\"indices\":{},\"material\":{copy}}}", 6 + copy)
    };
    let length = bin.len();
    let json = format!(
        r#"{{ "asset": {{"version":"2.0", "generator":"hands", "extras":{{"note":"scanned on a Sunday"}}}},
"scene":0, "scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1,2],"rotation":[0,0.6,0,0.8],"scale":[2,2,2],"translation":[1,2,3]}},
{{"mesh":0,"name":"one"}},{{"mesh":0,"name":"other","translation":[8,0,0]}}],
"meshes":[{{"primitives":[{},{}]}}],
"materials":[{{"name":"clay"}},{{"name":"glaze","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
"textures":[{{"source":0}}],"images":[{{"bufferView":0,"mimeType":"image/png"}}],
"accessors":[{accessors}],
"bufferViews":[{{"buffer":0,"byteLength":16}},{{"buffer":0,"byteOffset":16,"byteLength":{rows},"byteStride":{ROW}}},
{{"buffer":0,"byteOffset":{},"byteLength":{}}}],
"buffers":[{{@BUFFER@"byteLength":{length}}}]}}"#,
        primitive(0),
        primitive(1),
        PICTURE.len() + rows,
        length - PICTURE.len() - rows,
    );
    (json, bin)
}

/// A GLB of JSON and its buffer.
pub(crate) fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let size = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let mut out = [&b"glTF"[..], &size(2), &size(28 + json.len() + bin.len())].concat();
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        out.extend(size(chunk.len()));
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// JSON with its buffer inside.
pub(crate) fn embedded(json: &str, bin: &[u8]) -> String {
    use base64::Engine;
    let data = base64::prelude::BASE64_STANDARD.encode(bin);
    json.replace("@BUFFER@", &format!("\"uri\":\"data:application/octet-stream;base64,{data}\","))
}

/// A GLB of [`scene`] without positions and what follows from them: extents, lengths, padding.
pub(crate) fn masked_glb(bytes: &[u8], vertices: usize) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = masked_json(std::str::from_utf8(&bytes[20..20 + length]).unwrap().trim_end());
    let mut bin = bytes[28 + length..].to_vec();
    mask_rows(&mut bin, vertices);
    [&bytes[..8], &bytes[16..20], json.as_bytes(), &bytes[20 + length..28 + length], &bin].concat()
}

/// The same of [`embedded`].
pub(crate) fn masked_gltf(text: &[u8], vertices: usize) -> Vec<u8> {
    use base64::Engine;
    let text = std::str::from_utf8(text).unwrap();
    let from = text.find("base64,").unwrap() + 7;
    let to = from + text[from..].find('"').unwrap();
    let mut bin = base64::prelude::BASE64_STANDARD.decode(&text[from..to]).unwrap();
    mask_rows(&mut bin, vertices);
    [masked_json(&text[..from]).as_bytes(), &bin, masked_json(&text[to..]).as_bytes()].concat()
}

fn mask_rows(bin: &mut [u8], vertices: usize) {
    bin[PICTURE.len()..].chunks_mut(ROW).take(2 * vertices).for_each(|row| row[..12].fill(b'#'));
}

fn masked_json(json: &str) -> String {
    let mut out = String::new();
    let mut rest = json;
    while let Some(at) = ["\"min\": [", "\"max\": ["].iter().filter_map(|key| rest.find(key)).min() {
        let end = at + rest[at..].find(']').unwrap();
        out += &rest[..at + 8];
        rest = &rest[end..];
    }
    out + rest
}

/// XML of a model with `soup` in it, as an object that two items of the build show, one of them through a component.
pub(crate) fn model(soup: &Soup) -> String {
    let mut out = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\r\n<!-- scanned on a Sunday -->\r\n\
         <model unit=\"inch\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\r\n\
         <metadata name=\"Title\">a ring &amp; more</metadata>\r\n<resources>\r\n\
         <basematerials id=\"9\"><base name=\"clay\" displaycolor=\"#AA5500\"/></basematerials>\r\n\
         <object id=\"1\" type=\"model\" pid=\"9\" pindex=\"0\"><mesh><vertices>\r\n",
    );
    for (i, p) in soup.points.iter().enumerate() {
        match i % 3 {
            0 => writeln!(out, "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", p.x, p.y, p.z),
            1 => writeln!(out, "<vertex  z='{:e}' x='{:.9}'\ty='{}' ></vertex>", p.z, p.x, p.y),
            _ => writeln!(out, "<vertex y=\"{:.12}\" z=\"{}\" x=\"{}\" /><!-- {i} -->", p.y, p.z, p.x),
        }
        .unwrap();
    }
    out += "</vertices><triangles>\n";
    for [a, b, c] in &soup.triangles {
        writeln!(out, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\" pid=\"9\" p1=\"0\"/>").unwrap();
    }
    out + "</triangles></mesh></object>\n<object id=\"2\"><components><component objectid=\"1\" \
           transform=\"1 0 0 0 1 0 0 0 1 0 0 7\"/></components></object></resources>\n\
           <build><item objectid=\"1\"/><item objectid=\"2\"/></build></model>\n"
}

const TYPES: &[u8] = br#"<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>"#;
const RELATIONSHIPS: &[u8] = br#"<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;

/// A 3MF archive with this model and a picture.
pub fn archive(model: &[u8], method: zip::CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options =
        SimpleFileOptions::default().compression_method(method).last_modified_time(zip::DateTime::default());
    let parts: [(&str, &[u8]); 4] = [
        ("[Content_Types].xml", TYPES),
        ("_rels/.rels", RELATIONSHIPS),
        ("3D/3dmodel.model", model),
        ("Metadata/thumbnail.png", PICTURE),
    ];
    for (name, bytes) in parts {
        zip.start_file(name, options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Names and contents of an archive in their order, the numbers of vertices blotted out.
pub(crate) fn masked_archive(bytes: &[u8]) -> Vec<u8> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut out = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).unwrap();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).unwrap();
        let name = entry.name().unwrap().into_owned();
        out.extend(name.bytes());
        match name.as_str() {
            "3D/3dmodel.model" => out.extend(masked_model(std::str::from_utf8(&content).unwrap()).bytes()),
            _ => out.extend(content),
        }
    }
    out
}

fn masked_model(xml: &str) -> String {
    let mut out = String::new();
    for tag in xml.split_inclusive('>') {
        let mut rest = tag;
        while let Some(at) = ["x=", "y=", "z="].iter().filter_map(|k| rest.find(k)).min()
            && tag.trim_start().starts_with("<vertex ")
        {
            let quote = &rest[at + 2..at + 3];
            let end = at + 3 + rest[at + 3..].find(quote).unwrap();
            out += &(rest[..at + 3].to_owned() + "#");
            rest = &rest[end..];
        }
        out += rest;
    }
    out
}
