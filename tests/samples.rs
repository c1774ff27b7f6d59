//! Files with everything that real ones have beside positions and faces.

use crate::containers;
use sombrero::mesh::Soup;
use std::fmt::Write;
use std::ops::Range;

/// A file, and what is left of it without the numbers that a mark may change.
pub struct Sample {
    /// For messages.
    pub name: &'static str,
    /// How its name would end.
    pub extension: &'static str,
    /// The file.
    pub bytes: Vec<u8>,
    /// Whether its coordinates are 64-bit numbers or text.
    pub exact: bool,
    mask: Mask,
}

type Mask = Box<dyn Fn(&[u8]) -> Vec<u8> + Send + Sync>;

impl Sample {
    /// `bytes` with every position (in STL normals too, which follow positions) blotted out.
    pub fn masked(&self, bytes: &[u8]) -> Vec<u8> {
        (self.mask)(bytes)
    }
}

/// `soup` in every format.
pub fn samples(soup: &Soup) -> Vec<Sample> {
    let text = |name, extension, text: String, columns: fn(&[&str], usize) -> Range<usize>| Sample {
        name,
        extension,
        bytes: text.into_bytes(),
        exact: true,
        mask: Box::new(move |bytes| masked_text(bytes, columns).into_bytes()),
    };
    let vertices = soup.points.len();
    let mut all = vec![
        text("OBJ", "obj", obj(soup), |words, _| if words.first() == Some(&"v") { 1..4 } else { 0..0 }),
        text("OBJ from another system", "obj", obj(soup).replace('\n', "\r\n"), |words, _| {
            if words.first() == Some(&"v") { 1..4 } else { 0..0 }
        }),
        text("STL, ASCII", "stl", ascii_stl(soup), |words, _| match words.first() {
            Some(&"vertex") => 1..4,
            Some(&"facet") => 2..5,
            _ => 0..0,
        }),
        Sample {
            name: "OFF",
            extension: "off",
            bytes: off(soup).into_bytes(),
            exact: true,
            mask: Box::new(move |bytes| {
                let first = 3;
                let columns =
                    |_: &[&str], line| if (first..first + vertices).contains(&line) { 0..3 } else { 0..0 };
                masked_text(bytes, columns).into_bytes()
            }),
        },
        Sample {
            name: "STL, binary",
            extension: "stl",
            bytes: binary_stl(soup),
            exact: false,
            mask: Box::new(|bytes| {
                let mut bytes = bytes.to_vec();
                bytes[84..].chunks_mut(50).for_each(|facet| facet[..48].fill(b'#'));
                bytes
            }),
        },
    ];
    for (name, encoding, exact) in [
        ("PLY, ASCII", "ascii", true),
        ("PLY, little endian, double", "binary_little_endian", true),
        ("PLY, big endian, double", "binary_big_endian", true),
        ("PLY, little endian, float", "binary_little_endian", false),
        ("PLY, big endian, float", "binary_big_endian", false),
    ] {
        let mask = move |bytes: &[u8]| masked_ply(bytes, vertices, encoding == "ascii", exact);
        all.push(Sample {
            name,
            extension: "ply",
            bytes: ply(soup, encoding, exact),
            exact,
            mask: Box::new(mask),
        });
    }
    all.extend(scenes(soup));
    all
}

/// Files with a scene, in which the mesh is shown twice.
fn scenes(soup: &Soup) -> [Sample; 3] {
    let vertices = soup.points.len();
    let (json, bin) = containers::scene(soup);
    let model = containers::model(soup);
    [
        Sample {
            name: "GLB",
            extension: "glb",
            bytes: containers::glb(json.replace("@BUFFER@", "").as_bytes(), &bin),
            exact: false,
            mask: Box::new(move |bytes| containers::masked_glb(bytes, vertices)),
        },
        Sample {
            name: "glTF",
            extension: "gltf",
            bytes: containers::embedded(&json, &bin).into_bytes(),
            exact: false,
            mask: Box::new(move |bytes| containers::masked_gltf(bytes, vertices)),
        },
        Sample {
            name: "3MF",
            extension: "3mf",
            bytes: containers::archive(model.as_bytes(), zip::CompressionMethod::Deflated),
            exact: true,
            mask: Box::new(containers::masked_archive),
        },
    ]
}

/// A glTF whose buffer is a file of this name, and that file.
pub fn separate_gltf(soup: &Soup, buffer: &str) -> [Vec<u8>; 2] {
    let (json, bin) = containers::scene(soup);
    [json.replace("@BUFFER@", &format!("\"uri\":\"{buffer}\",")).into_bytes(), bin]
}

/// OBJ with quads, three index columns, texture coordinates, normals, colours, groups, materials and comments.
pub fn obj(soup: &Soup) -> String {
    let mut out = String::from("# a ring, \u{fc}ber alles\nmtllib clay.mtl\no  ring of clay\n");
    for (i, p) in soup.points.iter().enumerate() {
        match i % 4 {
            0 => writeln!(out, "v {} {} {}", p.x, p.y, p.z),
            1 => writeln!(out, "v  {:.9}\t{:e} {:.7} 0.25 0.5 1", p.x, p.y, p.z),
            2 => writeln!(out, "v {} {} {} # vertex {i}", p.x, p.y, p.z),
            _ => writeln!(out, "v {:e} {:.8} {} 1.0", p.x, p.y, p.z),
        }
        .unwrap();
        writeln!(out, "vt {} {}", i as f64 * 0.01, 1.0).unwrap();
        if i % 100 == 0 {
            writeln!(out, "\n# {i} so far\nvn 0 0.60 0.8").unwrap();
        }
    }
    out += "g front back\nusemtl clay\ns 1\n";
    for (i, face) in quads(soup).iter().enumerate() {
        if i == 500 {
            out += "usemtl glaze\ns off\n";
        }
        let corners: Vec<String> = face.iter().map(|v| format!("{0}/{0}/1", v + 1)).collect();
        writeln!(out, "f {}", corners.join(" ")).unwrap();
    }
    out + "l 1 2 3\n# the end, without a line end"
}

/// OFF with colours behind polygons, and comments.
pub fn off(soup: &Soup) -> String {
    let faces = quads(soup);
    let mut out = format!("OFF\n# counts\n{} {} 0\n", soup.points.len(), faces.len());
    for (i, p) in soup.points.iter().enumerate() {
        let comment = if i % 50 == 0 { " # here" } else { "" };
        writeln!(out, "{}  {} {:e}{comment}", p.x, p.y, p.z).unwrap();
    }
    for face in faces {
        let corners: Vec<String> = face.iter().map(u32::to_string).collect();
        writeln!(out, "{} {}  200 100 {}", face.len(), corners.join(" "), face[0] % 256).unwrap();
    }
    out
}

/// STL as text: two solids with names of several words.
pub fn ascii_stl(soup: &Soup) -> String {
    let mut out = String::from("solid a ring, 1 of 2\n");
    for (i, corners) in soup.triangles.iter().enumerate() {
        if i == soup.triangles.len() / 2 {
            out += "endsolid a ring, 1 of 2\nsolid 2 of 2\n";
        }
        out += "  facet normal 0.0 0.6 0.8\n    outer loop\n";
        for &v in corners {
            let p = soup.points[v as usize];
            writeln!(out, "      vertex {:.12e} {} {}", p.x, p.y, p.z).unwrap();
        }
        out += "    endloop\n  endfacet\n";
    }
    out + "endsolid 2 of 2\n"
}

/// STL in records, whose header begins like a text and whose attribute bytes hold colours.
pub fn binary_stl(soup: &Soup) -> Vec<u8> {
    let mut out = format!("{:<80}", "solid, yet binary; COLOR=\u{7f}").into_bytes();
    out.extend(u32::try_from(soup.triangles.len()).unwrap().to_le_bytes());
    for (i, corners) in soup.triangles.iter().enumerate() {
        let normal = [0.0, 0.6, 0.8_f32];
        let places = corners.iter().flat_map(|&v| soup.points[v as usize].coords.map(|x| x as f32).data.0[0]);
        normal.into_iter().chain(places).for_each(|x| out.extend(x.to_le_bytes()));
        out.extend(u16::try_from(i % 65536).unwrap().to_le_bytes());
    }
    out
}

/// PLY whose vertices have properties on both sides of their position, and whose file has one more element.
pub fn ply(soup: &Soup, encoding: &str, double: bool) -> Vec<u8> {
    let faces = quads(soup);
    let number = if double { "double" } else { "float" };
    let (vertices, polygons) = (soup.points.len(), faces.len());
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment scanned on a Sunday\nobj_info num_cols 512\nelement vertex {vertices}\n\
         property float confidence\nproperty {number} x\nproperty {number} y\nproperty {number} z\n\
         property uchar red\nelement face {polygons}\nproperty uchar quality\n\
         property list uchar int vertex_indices\nelement light 2\nproperty int lux\nend_header\n"
    )
    .into_bytes();
    let mut row = |values: &[Value]| match encoding {
        "ascii" => {
            let words: Vec<String> = values.iter().map(Value::text).collect();
            out.extend((words.join(" ") + "\n").into_bytes());
        }
        _ => values.iter().for_each(|v| out.extend(v.bytes(encoding == "binary_little_endian"))),
    };
    for (i, p) in soup.points.iter().enumerate() {
        let [x, y, z] =
            [p.x, p.y, p.z].map(|x| if double { Value::Double(x) } else { Value::Float(x as f32) });
        row(&[Value::Float(i as f32 * 0.5), x, y, z, Value::Byte((i % 256) as u8)]);
    }
    for face in &faces {
        let mut values = vec![Value::Byte(7), Value::Byte(face.len() as u8)];
        values.extend(face.iter().map(|&v| Value::Int(v as i32)));
        row(&values);
    }
    for lux in [100, 200] {
        row(&[Value::Int(lux)]);
    }
    out
}

enum Value {
    Byte(u8),
    Int(i32),
    Float(f32),
    Double(f64),
}

impl Value {
    fn text(&self) -> String {
        match self {
            Self::Byte(x) => x.to_string(),
            Self::Int(x) => x.to_string(),
            Self::Float(x) => format!("{x:?}"),
            Self::Double(x) => format!("{x:?}"),
        }
    }

    fn bytes(&self, little: bool) -> Vec<u8> {
        let mut bytes = match self {
            Self::Byte(x) => vec![*x],
            Self::Int(x) => x.to_le_bytes().to_vec(),
            Self::Float(x) => x.to_le_bytes().to_vec(),
            Self::Double(x) => x.to_le_bytes().to_vec(),
        };
        if !little {
            bytes.reverse();
        }
        bytes
    }
}

/// Polygons whose fans are the triangles: two in a row that share their first and middle corner are a quad.
fn quads(soup: &Soup) -> Vec<Vec<u32>> {
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for &[a, b, c] in &soup.triangles {
        match faces.last_mut() {
            Some(last) if last.len() == 3 && last[0] == a && last[2] == b => last.push(c),
            _ => faces.push(vec![a, b, c]),
        }
    }
    faces
}

/// The text with some words of each line blotted out; `columns` picks them by the words and the line's number.
fn masked_text(bytes: &[u8], columns: impl Fn(&[&str], usize) -> Range<usize>) -> String {
    let text = std::str::from_utf8(bytes).unwrap();
    let mut out = String::with_capacity(text.len());
    for (number, line) in text.split_inclusive('\n').enumerate() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let mut rest = line;
        for word in &words[columns(&words, number)] {
            // Words are slices of the line, so that the white space between them is what is left over.
            let at = word.as_ptr() as usize - rest.as_ptr() as usize;
            out.push_str(&rest[..at]);
            out.push('#');
            rest = &rest[at + word.len()..];
        }
        out.push_str(rest);
    }
    out
}

fn masked_ply(bytes: &[u8], vertices: usize, ascii: bool, double: bool) -> Vec<u8> {
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    if ascii {
        let header = bytes[..body].iter().filter(|b| **b == b'\n').count();
        let rows = header..header + vertices;
        return masked_text(bytes, |_, line| if rows.contains(&line) { 1..4 } else { 0..0 }).into_bytes();
    }
    let place = if double { 24 } else { 12 };
    let mut bytes = bytes.to_vec();
    for row in bytes[body..].chunks_mut(4 + place + 1).take(vertices) {
        row[4..4 + place].fill(b'#');
    }
    bytes
}
