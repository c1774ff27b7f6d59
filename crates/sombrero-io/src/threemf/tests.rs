//! The archives are made and checked by another implementation of ZIP, the crate `zip`.

use std::io::{Cursor, Read, Write};
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use sombrero_mesh::Soup;
use zip::write::{FullFileOptions, SimpleFileOptions};
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::testing::{lifted, parse_error, read};
use crate::{Document, Format, Limits, ParseError, Place, WriteError, encode};

const TYPES: &str = r#"<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"/>"#;
const RELS: &str = r#"<?xml version="1.0"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/Metadata/thumb.png" Id="a" Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>
 <Relationship Target="/3D/3dmodel.model" Id="b" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>"#;
const MODEL: &str = "3D/3dmodel.model";
const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";

/// One triangle, or as many as are asked for, whose corners are 0, x and y.
fn mesh(triangles: usize) -> String {
    format!(
        "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1.50\" y=\"0\" z=\"0\"/>\
         <vertex x=\"0\" y=\"2\" z=\"0\"/></vertices><triangles>{}</triangles></mesh>",
        "<triangle v1=\"0\" v2=\"1\" v3=\"2\"/>".repeat(triangles)
    )
}

fn object(id: u32, content: &str) -> String {
    format!("<object id=\"{id}\">{content}</object>\n")
}

fn model(resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xmlns=\"{CORE}\" \
         xmlns:p=\"{PRODUCTION}\">\n<resources>\n{resources}</resources>\n<build>{build}</build>\n</model>\n"
    )
}

fn item(id: u32) -> String {
    format!("<item objectid=\"{id}\"/>")
}

fn simple() -> String {
    model(&object(1, &mesh(1)), &item(1))
}

fn zip_with(method: CompressionMethod, parts: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in parts {
        let options = SimpleFileOptions::default().compression_method(method);
        zip.start_file(*name, options).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn zip(parts: &[(&str, &[u8])]) -> Vec<u8> {
    zip_with(CompressionMethod::Deflated, parts)
}

fn package(model: &str) -> Vec<u8> {
    zip(&[
        ("[Content_Types].xml", TYPES.as_bytes()),
        ("_rels/.rels", RELS.as_bytes()),
        (MODEL, model.as_bytes()),
    ])
}

fn open(model: &str) -> Document {
    read(package(model), "3mf")
}

fn error(model: &str) -> ParseError {
    parse_error(package(model), "3mf")
}

fn part(archive: &[u8], name: &str) -> String {
    let mut text = String::new();
    let mut archive = ZipArchive::new(Cursor::new(archive)).unwrap();
    archive.by_name(name).unwrap().read_to_string(&mut text).unwrap();
    text
}

/// What a document's model becomes when `change` has changed its points.
fn changed(document: &Document, change: impl Fn(&Point3<f64>) -> Point3<f64>) -> String {
    part(&document.with_points(&lifted(document, change)).unwrap(), MODEL)
}

fn up(p: &Point3<f64>) -> Point3<f64> {
    p + Vector3::new(0.0, 0.0, 0.25)
}

fn bits(points: &[Point3<f64>]) -> Vec<[u64; 3]> {
    points.iter().map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect()
}

fn near(a: &[Point3<f64>], b: &[Point3<f64>]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).norm() < 1e-9, "{a} is not {b}");
    }
}

#[test]
fn a_minimal_file_is_read_and_only_its_numbers_change() {
    let document = open(&simple());
    assert_eq!(document.format(), Format::ThreeMf);
    assert_eq!(document.points()[1], Point3::new(1.5, 0.0, 0.0));
    assert_eq!(document.triangles(), [[0, 1, 2]]);
    assert_eq!(document.attributes(), ["unit millimeter"]);
    assert!(document.notes().is_empty());
    assert_eq!(document.with_points(document.points()).unwrap(), document.bytes());
    let points = lifted(&document, |p| p + Vector3::new(p.x / 6.0, 0.0, 0.0));
    let bytes = document.with_points(&points).unwrap();
    assert_eq!(part(&bytes, MODEL), simple().replace("1.50", "1.75"));
    assert_eq!(read(bytes, "3mf").points(), points);
}

#[test]
fn numbers_keep_their_decimals_and_their_spelling_where_they_stay() {
    let text = simple().replace("x=\"1.50\" y=\"0\"", "x=\"1.500000\" y=\"+0.0e0\"");
    assert_eq!(
        changed(&open(&text), |p| Point3::new(p.x * 2.0, p.y, p.z)),
        text.replace("1.500000", "3.000000")
    );
}

#[test]
fn tags_may_be_written_in_many_ways() {
    let plain = "<vertex x=\"1.50\" y=\"0\" z=\"0\"/>";
    for other in [
        "<vertex z='0' y = '0'\r\n\tx\n=\n'1.50' />",
        "<vertex x=\"1.50\" y=\"0\" z=\"0\"></vertex>",
        "<vertex x=\" 1.50\n\" y=\"0\" z=\"0\"><!-- <vertex x='9'/> --></vertex>",
        "<!-- a > b --><vertex p:UUID=\"a>b/\" x=\"1.50\" q='\"' y=\"0\" z=\"0\"/>",
        "<![CDATA[<vertex>]]><vertex x=\"1.50\"y=\"0\"z=\"0\"/><?pi <vertex?>",
        "<vertex x=\"1&#46;5&#x30;\" y=\"0\" z=\"&#48;\"/>",
        "<vertex äöü='ß' x=\"1.50\" y=\"0\" z=\"0\"/>",
    ] {
        for end in ["\n", "\r\n", "\r"] {
            let text = simple().replace(plain, other).replace('\n', end);
            let document = open(&text);
            assert_eq!(bits(document.points()), bits(open(&simple()).points()), "{other}");
            let spelled = if text.contains("&#46;") { "1&#46;5&#x30;" } else { "1.50" };
            let decimals = if text.contains("&#46;") { "7.5" } else { "7.50" };
            let expected = text.replace(spelled, decimals);
            assert_eq!(changed(&document, |p| Point3::new(p.x * 5.0, p.y, p.z)), expected);
        }
    }
}

#[test]
fn all_axes_change_in_whatever_order_they_stand() {
    let text = simple().replace("x=\"1.50\" y=\"0\" z=\"0\"", "z=\"0\" x=\"1.50\" y=\"0\"");
    let document = open(&text);
    let moved = lifted(&document, |p| p + Vector3::new(1.0, 2.0, 3.0));
    let bytes = document.with_points(&moved).unwrap();
    assert!(part(&bytes, MODEL).contains("z=\"3.0\" x=\"2.50\" y=\"2.0\""));
    assert_eq!(read(bytes, "3mf").points(), moved);
}

#[test]
fn a_byte_order_mark_is_kept() {
    let text = format!("\u{feff}{}", simple());
    assert_eq!(changed(&open(&text), |p| Point3::new(p.x * 2.0, p.y, p.z)), text.replace("1.50", "3.00"));
}

#[test]
fn any_prefix_will_do_and_foreign_elements_are_none_of_the_core() {
    let mut text = simple().replace(&format!("xmlns=\"{CORE}\""), &format!("xmlns:c=\"{CORE}\""));
    for name in [
        "model",
        "resources",
        "object",
        "mesh",
        "vertices",
        "vertex",
        "triangles",
        "triangle",
        "build",
        "item",
    ] {
        for end in [" ", ">", "/>"] {
            text = text.replace(&format!("<{name}{end}"), &format!("<c:{name}{end}"));
            text = text.replace(&format!("</{name}{end}"), &format!("</c:{name}{end}"));
        }
    }
    let text =
        text.replace("<c:vertices>", "<c:vertices><vertex x='a'/><x:vertex xmlns:x='http://x' x='5'/>");
    let document = open(&text);
    assert_eq!(document.points().len(), 3);
    assert_eq!(changed(&document, |p| Point3::new(p.x * 2.0, p.y, p.z)), text.replace("1.50", "3.00"));
}

#[test]
fn a_namespace_ends_with_its_element() {
    let text = simple().replace("<vertices>", "<vertices><vertex xmlns=\"http://x\" x='5'/>");
    assert_eq!(open(&text).points().len(), 3);
    let text = simple().replace(CORE, "http://schemas.microsoft.com/3dmanufacturing/2099/01");
    assert!(error(&text).to_string().contains("in the namespace `http://schemas"));
    // The first edition says the same of vertices and triangles.
    let text = simple().replace(CORE, "http://schemas.microsoft.com/3dmanufacturing/2013/01");
    assert_eq!(open(&text).points().len(), 3);
}

/// Row vectors: a quarter turn about z, doubled, then a shift.
const TURN: &str = "0 2 0 -2 0 0 0 0 2 10 20 30";

fn turned(p: &Point3<f64>) -> Point3<f64> {
    Point3::new(-2.0 * p.y + 10.0, 2.0 * p.x + 20.0, 2.0 * p.z + 30.0)
}

#[test]
fn transforms_are_for_row_vectors_and_nest() {
    let resources = object(1, &mesh(1))
        + &object(2, &format!("<components><component objectid=\"1\" transform=\"{TURN}\"/></components>"));
    let shift = "1 0 0 0 1 0 0 0 1 100 0 0";
    let text = model(&resources, &format!("<item transform=\"{shift}\" objectid=\"2\"/>"));
    let document = open(&text);
    let stored = open(&simple());
    let expected = lifted(&stored, |p| turned(p) + Vector3::new(100.0, 0.0, 0.0));
    near(document.points(), &expected);
    let points = lifted(&document, |p| p + Vector3::new(0.0, 3.0, 0.0));
    let bytes = document.with_points(&points).unwrap();
    near(read(&bytes, "3mf").points(), &points);
    // Where the build turns, y of the world is half of x in the file; the other axes keep their spelling.
    let expected = text.replace("\"1.50\" y=\"0\"", "\"3.00\" y=\"0\"").replace("x=\"0\"", "x=\"1.5\"");
    assert_eq!(part(&bytes, MODEL), expected);
}

#[test]
fn shared_meshes_come_once_and_are_counted() {
    let pair = "<components><component objectid=\"1\"/><component objectid=\"1\" \
                transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/></components>";
    let resources = object(1, &mesh(3)) + &object(2, pair);
    let text = model(&resources, &format!("{}{}{}", item(2), item(2), item(1)));
    let document = open(&text);
    assert_eq!(document.triangles().len(), 3);
    assert_eq!(document.triangles_with_instances(), 15);
    assert_eq!(document.points()[1], Point3::new(1.5, 0.0, 0.0));
    assert_eq!(document.attributes(), ["unit millimeter", "components"]);
}

#[test]
fn the_first_path_decides_and_files_give_the_order() {
    let resources = object(1, &mesh(1))
        + &object(2, &mesh(2))
        + &object(
            3,
            "<components><component objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 0 0 7\"/></components>",
        );
    let document = open(&model(&resources, &format!("{}{}{}", item(3), item(2), item(1))));
    assert_eq!(document.points()[0], Point3::origin());
    assert_eq!(document.points()[3], Point3::new(0.0, 0.0, 7.0));
    assert_eq!(document.triangles(), [[0, 1, 2], [3, 4, 5], [3, 4, 5]]);
    assert_eq!(document.triangles_with_instances(), 5);
}

#[test]
fn items_that_are_not_to_be_printed_are_not_shown_unless_nothing_else_is() {
    let objects = [1, 2].map(|id| object(id, &mesh(1))).concat();
    let read_with = |first: &str, second: &str| {
        let build = format!("<item objectid=\"1\" {first}/><item objectid=\"2\" {second}/>");
        read(package(&model(&objects, &build)), "3mf")
    };
    let note = "UNMARKED: 1 object that the build does not show, or says not to print, stays as it is.";
    let document = read_with("printable=\"1\"", "printable=\"0\"");
    assert_eq!(document.points().len(), 3);
    assert_eq!(document.notes(), [note]);
    for both in ["", "printable=\"0\""] {
        assert_eq!(read_with(both, both).points().len(), 6, "{both}");
    }
}

fn package_with(model: &str, name: &str, content: &str) -> Vec<u8> {
    zip(&[
        ("[Content_Types].xml", TYPES.as_bytes()),
        ("_rels/.rels", RELS.as_bytes()),
        (MODEL, model.as_bytes()),
        (name, content.as_bytes()),
    ])
}

const UNPRINTED: &str = "UNMARKED: 1 volume of a slicer (modifier, negative or for supports) stays as it is.";

/// Two volumes of one triangle each in one mesh, as PrusaSlicer has them.
fn volumes(config: &str) -> Document {
    let content = "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>\
                   <vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"9\" y=\"9\" z=\"9\"/><vertex x=\"9\" y=\"8\" z=\"9\"/>\
                   <vertex x=\"8\" y=\"9\" z=\"9\"/></vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/>\
                   <triangle v1=\"3\" v2=\"4\" v3=\"5\"/></triangles></mesh>";
    let text = model(&object(1, content), &item(1));
    read(package_with(&text, "Metadata/Slic3r_PE_model.config", config), "3mf")
}

#[test]
fn modifiers_within_a_mesh_are_not_shown() {
    let config = |first: &str, second: &str| {
        format!(
            "<?xml version=\"1.0\"?><config><object id=\"1\"><metadata type=\"object\" key=\"name\" value=\"a\"/>\
             <volume firstid=\"0\" lastid=\"0\">{first}</volume><volume firstid=\"1\" lastid=\"1\">{second}</volume>\
             </object></config>"
        )
    };
    let kind = |kind: &str| format!("<metadata type=\"volume\" key=\"volume_type\" value=\"{kind}\"/>");
    let printed = kind("ModelPart");
    for other in ["ParameterModifier", "NegativeVolume", "SupportBlocker", "SupportEnforcer"] {
        let document = volumes(&config(&printed, &kind(other)));
        assert_eq!(document.triangles(), [[0, 1, 2]], "{other}");
        assert_eq!(document.notes(), [UNPRINTED]);
        let document = volumes(&config(&kind(other), &printed));
        assert_eq!(document.triangles(), [[3, 4, 5]], "{other}");
    }
    let old = "<metadata type=\"volume\" key=\"modifier\" value=\"1\"/>";
    assert_eq!(volumes(&config("", old)).triangles(), [[0, 1, 2]]);
    // All printed, nothing said, of another object, beyond the mesh, and no XML.
    for config in [
        config(&printed, &printed),
        config("", ""),
        config(&printed, &kind("ParameterModifier")).replace("id=\"1\"", "id=\"7\""),
        config(&printed, &kind("ParameterModifier"))
            .replace("=\"1\" lastid=\"1\"", "=\"5\" lastid=\"99999999999\""),
        "<config><object id=\"1\"><volume".to_owned(),
        "not xml".to_owned(),
    ] {
        assert_eq!(volumes(&config).triangles().len(), 2, "{config}");
    }
}

#[test]
fn components_that_are_not_printed_are_not_shown() {
    let components = "<components><component objectid=\"1\"/><component objectid=\"2\"/></components>";
    let resources = object(1, &mesh(1)) + &object(2, &mesh(1)) + &object(3, components);
    let text = model(&resources, &item(3));
    let settings = |kind: &str| {
        format!(
            "<config><object id=\"3\"><metadata key=\"name\" value=\"a\"/><part id=\"1\" subtype=\"normal_part\"/>\
             <part id=\"2\" subtype=\"{kind}\"><metadata key=\"matrix\" value=\"1\"/></part></object></config>"
        )
    };
    for kind in ["modifier_part", "negative_part", "support_enforcer", "support_blocker"] {
        let document = read(package_with(&text, "Metadata/model_settings.config", &settings(kind)), "3mf");
        assert_eq!(document.triangles(), [[0, 1, 2]], "{kind}");
        assert_eq!(document.notes(), [UNPRINTED]);
    }
    let all = read(package_with(&text, "Metadata/model_settings.config", &settings("normal_part")), "3mf");
    assert_eq!((all.triangles().len(), all.notes().len()), (2, 0));
    // The same by the type that such objects have in the model itself; unless there is nothing else.
    let other = text.replace("<object id=\"2\"", "<object type=\"other\" id=\"2\"");
    assert_eq!(open(&other).triangles(), [[0, 1, 2]]);
    let nothing_else = other.replace("<object id=\"1\"", "<object type=\"other\" id=\"1\"");
    assert_eq!(open(&nothing_else).triangles().len(), 2);
}

#[test]
fn unused_vertices_may_be_anything() {
    let lost = "<vertices><vertex x=\"nan\" y=\"NaN\" z=\"inf\"/>";
    let content = mesh(1)
        .replace("<vertices>", lost)
        .replace("v1=\"0\" v2=\"1\" v3=\"2\"", "v1=\"1\" v2=\"2\" v3=\"3\"");
    let document = open(&model(&object(1, &content), &item(1)));
    assert_eq!(document.points()[0], document.points()[1]);
    let text = changed(&document, |p| Point3::new(p.x * 2.0, p.y, p.z));
    assert!(text.contains(lost) && text.contains("3.00"), "{text}");
}

#[test]
fn what_is_not_shown_stays() {
    let flat = "<components><component objectid=\"4\" transform=\"1 0 0 0 1 0 0 0 0 0 0 0\"/></components>";
    let support = format!("<object type=\"support\" id=\"3\">{}</object>", mesh(1));
    let resources = object(1, &mesh(1))
        + &object(2, &mesh(1))
        + &support
        + &object(4, &mesh(1))
        + &object(5, flat)
        + &object(6, &mesh(1));
    let text = model(&resources, &format!("{}{}{}", item(1), item(3), item(5)));
    let document = open(&text);
    assert_eq!(document.points().len(), 3);
    assert_eq!(
        document.notes(),
        [
            "UNMARKED: 2 objects that the build does not show stay as they are.",
            "UNMARKED: 1 object for support stays as it is.",
            "UNMARKED: 1 object that the build flattens or puts out of all bounds stays as it is."
        ]
    );
    let expected = text.replacen("1.50", "3.00", 1);
    assert_eq!(changed(&document, |p| Point3::new(p.x * 2.0, p.y, p.z)), expected);
}

#[test]
fn without_a_build_every_mesh_is_shown() {
    let document = open(&model(&(object(1, &mesh(1)) + &object(9, &mesh(2))), ""));
    assert_eq!(document.triangles().len(), 3);
    assert_eq!(document.triangles_with_instances(), 3);
}

fn production() -> Vec<u8> {
    let main = model(
        &object(7, "<components><component objectid=\"1\" p:path=\"/3D/Objects/a%20b.model\"/></components>"),
        "<item objectid=\"7\"/><item objectid=\"1\" p:path=\"/3d/objects/C.model\"/>",
    );
    // What a part says about a build does not count.
    let first = model(&object(1, &mesh(1)), "<item objectid=\"99\"/>");
    let second = model(&(object(1, &mesh(2)) + &object(2, &mesh(5))), "");
    zip(&[
        ("3D/Objects/c.model", second.as_bytes()),
        ("3D/Objects/a b.model", first.as_bytes()),
        ("_rels/.rels", RELS.as_bytes()),
        (MODEL, main.as_bytes()),
    ])
}

#[test]
fn parts_that_the_production_extension_names_are_read() {
    let archive = production();
    let document = read(&archive, "3mf");
    assert_eq!(document.triangles(), [[0, 1, 2], [3, 4, 5], [3, 4, 5]]);
    assert_eq!(document.notes(), ["UNMARKED: 1 object that the build does not show stays as it is."]);
    let mut points = document.points().to_vec();
    points[4].x = 9.5;
    let bytes = document.with_points(&points).unwrap();
    for name in ["_rels/.rels", MODEL, "3D/Objects/a b.model"] {
        assert_eq!(part(&bytes, name), part(&archive, name));
    }
    let expected = part(&archive, "3D/Objects/c.model").replacen("1.50", "9.50", 1);
    assert_eq!(part(&bytes, "3D/Objects/c.model"), expected);
}

/// Entries of many kinds: with comments, times, extra fields, stored, packed, large, empty.
fn rich(model: &str) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(b"".to_vec()));
    let time = DateTime::from_date_and_time(2019, 7, 8, 9, 10, 12).unwrap();
    let full = || FullFileOptions::default().last_modified_time(time).with_file_comment("a remark");
    let mut tagged = full().compression_method(CompressionMethod::Deflated).unix_permissions(0o640);
    tagged.add_extra_field(0xabcd, b"extra", false).unwrap();
    zip.start_file(MODEL, tagged).unwrap();
    zip.write_all(model.as_bytes()).unwrap();
    zip.start_file("_rels/.rels", full().compression_method(CompressionMethod::Deflated)).unwrap();
    zip.write_all(RELS.as_bytes()).unwrap();
    zip.add_directory("Metadata/", SimpleFileOptions::default()).unwrap();
    zip.start_file("Metadata/thumb.png", full().compression_method(CompressionMethod::Stored)).unwrap();
    zip.write_all(b"\x89PNG not really").unwrap();
    zip.start_file("3D/Textures/t.png", full().large_file(true)).unwrap();
    zip.write_all(&[7; 5000]).unwrap();
    zip.start_file("Metadata/slicer.config", full()).unwrap();
    zip.write_all(b"layer_height = 0.2").unwrap();
    zip.start_file("strange/\u{fc}.xyz", full()).unwrap();
    zip.set_comment("PK archive remark").unwrap();
    zip.finish().unwrap().into_inner()
}

type Row = (Vec<u8>, Vec<u8>, String, Option<DateTime>, CompressionMethod, Option<Vec<u8>>);

/// All that can be said about the entries, their packed bytes included, but not where they stand.
fn listing(bytes: &[u8]) -> Vec<Row> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    (0..archive.len())
        .map(|i| {
            let mut file = archive.by_index_raw(i).unwrap();
            let mut raw = Vec::new();
            file.read_to_end(&mut raw).unwrap();
            let (comment, extra) = (file.comment().to_owned(), file.extra_data());
            (file.name_raw().to_vec(), raw, comment, file.last_modified(), file.compression(), extra)
        })
        .collect()
}

#[test]
fn every_other_entry_stays_to_the_byte() {
    let archive = rich(&simple());
    let document = read(&archive, "3mf");
    assert_eq!(document.attributes(), ["unit millimeter", "thumbnails", "textures", "print settings"]);
    let bytes = document.with_points(&lifted(&document, up)).unwrap();
    let (before, after) = (listing(&archive), listing(&bytes));
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        let model = before.0 == MODEL.as_bytes();
        assert_eq!(before.1 == after.1, !model);
        assert_eq!((&before.0, &before.2, &before.3), (&after.0, &after.2, &after.3));
        assert_eq!((&before.4, &before.5), (&after.4, &after.5));
    }
    let mut opened = ZipArchive::new(Cursor::new(&bytes)).unwrap();
    assert_eq!(opened.comment(), b"PK archive remark");
    for i in 0..opened.len() {
        let mut content = Vec::new();
        opened.by_index(i).unwrap().read_to_end(&mut content).unwrap();
    }
    opened.validate_header_consistency().unwrap();
    near(read(&bytes, "3mf").points(), &lifted(&document, up));
}

#[test]
fn putting_the_old_positions_back_gives_the_old_text() {
    let text = simple().replace("z=\"0\"", "z=\"0.00\"");
    let document = open(&text);
    let moved = read(document.with_points(&lifted(&document, up)).unwrap(), "3mf");
    assert_eq!(part(&moved.with_points(document.points()).unwrap(), MODEL), text);
}

/// An archive whose entries have their sizes behind them, as programs that cannot go back write it.
fn streamed(model: &str) -> Vec<u8> {
    let mut zip = ZipWriter::new_stream(Vec::new());
    for (name, content) in [("_rels/.rels", RELS), (MODEL, model), ("Metadata/x.config", "x = 1")] {
        zip.start_file(name, SimpleFileOptions::default()).unwrap();
        zip.write_all(content.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// An archive in the form that large ones need.
fn wide(model: &str) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in [("_rels/.rels", RELS), (MODEL, model), ("Metadata/x.config", "x = 1")] {
        zip.start_file(name, SimpleFileOptions::default().large_file(true)).unwrap();
        zip.write_all(content.as_bytes()).unwrap();
    }
    let mut bytes = zip.finish().unwrap().into_inner();
    // The end of large archives, which the crate writes only for large ones.
    let end = bytes.len() - 22;
    let size = u32::from_le_bytes(bytes[end + 12..end + 16].try_into().unwrap());
    let start = u32::from_le_bytes(bytes[end + 16..end + 20].try_into().unwrap());
    let mut ends = b"PK\x06\x06".to_vec();
    ends.extend(44_u64.to_le_bytes());
    ends.extend([45, 0, 45, 0]);
    ends.extend([0; 8]);
    for number in [3, 3, u64::from(size), u64::from(start)] {
        ends.extend(number.to_le_bytes());
    }
    ends.extend(b"PK\x06\x07\0\0\0\0");
    ends.extend((end as u64).to_le_bytes());
    ends.extend(1_u32.to_le_bytes());
    bytes.splice(end..end, ends);
    let end = bytes.len() - 22;
    bytes[end + 8..end + 20].fill(0xff);
    bytes
}

#[test]
fn other_ways_to_write_sizes_are_kept() {
    for archive in [streamed(&simple()), wide(&simple())] {
        let document = read(&archive, "3mf");
        let bytes = document.with_points(&lifted(&document, up)).unwrap();
        assert_eq!(part(&bytes, MODEL), simple().replace("z=\"0\"", "z=\"0.25\""));
        assert_eq!(part(&bytes, "Metadata/x.config"), "x = 1");
        assert_eq!(read(&bytes, "3mf").points(), lifted(&document, up));
        // Put back, the text is not quite the same, but archives of the same text are the same.
        let again = document.with_points(&lifted(&document, up)).unwrap();
        assert_eq!(again, bytes);
        let mut opened = ZipArchive::new(Cursor::new(&bytes)).unwrap();
        opened.validate_header_consistency().unwrap();
    }
}

#[test]
fn sizes_behind_the_content_are_those_of_the_new_content() {
    let document = read(streamed(&simple()), "3mf");
    let bytes = document.with_points(&lifted(&document, up)).unwrap();
    let mut opened = ZipArchive::new(Cursor::new(&bytes)).unwrap();
    for i in 0..opened.len() {
        let file = opened.by_index_raw(i).unwrap();
        let end = (file.data_start().unwrap() + file.compressed_size()) as usize;
        let sizes = [file.crc32(), file.compressed_size() as u32, file.size() as u32];
        assert_eq!(bytes[end..end + 4], *b"PK\x07\x08");
        assert_eq!(bytes[end + 4..end + 16], *sizes.map(u32::to_le_bytes).as_flattened());
        let header = file.header_start() as usize;
        assert_eq!(bytes[header + 14..header + 26], [0; 12]);
    }
}

#[test]
fn a_stored_model_stays_stored() {
    let text = simple();
    let parts: [(&str, &[u8]); 2] = [("_rels/.rels", RELS.as_bytes()), (MODEL, text.as_bytes())];
    let document = read(zip_with(CompressionMethod::Stored, &parts), "3mf");
    let bytes = document.with_points(&lifted(&document, up)).unwrap();
    assert!(memchr::memmem::find(&bytes, b"z=\"0.25\"").is_some());
    assert_eq!(read(bytes, "3mf").points(), lifted(&document, up));
}

#[test]
fn the_model_is_found_without_relationships_if_there_is_one() {
    let text = simple();
    let document = read(zip(&[("3d/other.MODEL", text.as_bytes())]), "3mf");
    assert_eq!(document.points().len(), 3);
    let two = zip(&[("3D/a.model", text.as_bytes()), ("3D/b.model", text.as_bytes())]);
    assert!(parse_error(two, "3mf").to_string().contains("several 3MF models"));
    let gone = zip(&[("_rels/.rels", RELS.as_bytes()), ("3D/b.model", text.as_bytes())]);
    assert!(parse_error(gone, "3mf").to_string().contains("names `/3D/3dmodel.model` as its model"));
}

#[test]
fn other_archives_are_named() {
    let rels = RELS.replace("schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel", "word");
    for parts in [
        vec![("_rels/.rels", rels.as_bytes()), ("word/document.xml", &b"<a/>"[..])],
        vec![("META-INF/MANIFEST.MF", &b"x"[..])],
    ] {
        let error = parse_error(zip(&parts), "3mf").to_string();
        assert!(error.contains("a ZIP archive without a 3MF model"), "{error}");
    }
}

#[test]
fn errors_name_the_part_and_the_line() {
    let at = |line| Place::PartLine { part: MODEL.into(), line };
    let cases = [
        ("x=\"1.50\"", "x=\"1,5\"", ParseError::NotANumber { place: at(4), found: "1,5".into() }),
        ("x=\"1.50\"", "x=\"inf\"", ParseError::NonFinite { place: at(4) }),
        ("x=\"1.50\"", "x=\"1e999\"", ParseError::NonFinite { place: at(4) }),
        ("v3=\"2\"", "v3=\"3\"", ParseError::IndexOutOfRange { place: at(4), index: 3, first: 0, count: 3 }),
        (
            "v3=\"2\"",
            "v3=\"-1\"",
            ParseError::IndexOutOfRange { place: at(4), index: -1, first: 0, count: 3 },
        ),
    ];
    for (before, after, expected) in cases {
        assert_eq!(error(&simple().replace(before, after)), expected);
    }
    let shown = error(&simple().replace(" v3=\"2\"", "")).to_string();
    assert!(shown.starts_with("line 4 of `3D/3dmodel.model`: a triangle needs"), "{shown}");
}

#[test]
fn broken_models_are_refused() {
    let twice = object(1, &mesh(1)) + &object(1, &mesh(1));
    let cases = [
        (simple().replace("x=\"1.50\"", ""), "a vertex needs `x`, `y` and `z`"),
        (simple().replace("x=\"1.50\"", "x=\"1\" x=\"2\""), "gives `x` twice"),
        (simple().replace("x=\"1.50\"", "x=1"), "not of the form"),
        (simple().replace("x=\"1.50\"", "x=\"&a;\""), "line 4"),
        (
            simple().replace("objectid=\"1\"", "objectid=\"2\""),
            "line 6 of `3D/3dmodel.model`: there is no object 2",
        ),
        (simple().replace("objectid=\"1\"", "transform=\"1\" objectid=\"1\""), "12 numbers"),
        (
            simple().replace("objectid=\"1\"", "transform=\"1 0 0 0 1 0 0 0 x 0 0 0\" objectid=\"1\""),
            "found `x`",
        ),
        (simple().replace("objectid=\"1\"", "p:path=\"/no.model\" objectid=\"1\""), "no part `/no.model`"),
        (simple().replace("objectid=\"1\"", ""), "no `objectid`"),
        (simple().replace("object id=\"1\"", "object id=\"-1\""), "numbers nothing"),
        (model(&twice, &item(1)), "two objects 1"),
        (model(&object(1, &(mesh(1) + &mesh(1))), &item(1)), "two meshes"),
        (simple().replace("</model>", ""), "although tags are open"),
        (simple().replace("</mesh>", "</mash>"), "line 4"),
        (simple() + "<model/>", "another element follows"),
        (String::from("<models/>"), "expected `model`"),
        (String::new(), "holds no model"),
        (simple().replace("<model", "<!DOCTYPE model [<!ENTITY a \"1\">]><model"), "DOCTYPE"),
        (model("", ""), "nothing that it shows has triangles"),
    ];
    for (text, expected) in cases {
        let error = error(&text).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn other_encodings_are_refused() {
    let utf16: Vec<u8> = simple().encode_utf16().flat_map(u16::to_le_bytes).collect();
    let marked = [&b"\xff\xfe"[..], &utf16].concat();
    for text in [utf16, marked] {
        let error = parse_error(zip(&[(MODEL, &text)]), "3mf");
        assert!(error.to_string().starts_with("UTF-16 in the part"), "{error}");
    }
    let latin = simple().replace("<mesh>", "<mesh>\n").into_bytes();
    let latin: Vec<u8> = latin.iter().map(|&b| if b == b'U' { 0xfc } else { b }).collect();
    assert!(parse_error(zip(&[(MODEL, &latin)]), "3mf").to_string().contains("not UTF-8"));
}

#[test]
fn encryption_is_refused_by_name() {
    let secure = "xmlns:sc=\"http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04\" \
                  requiredextensions=\"p sc\" unit";
    // Files that require it without encrypting anything can be read.
    let note =
        "The model requires the extension `…dmanufacturing/securecontent/2019/04`, which is kept as it is.";
    assert_eq!(open(&simple().replace("unit", secure)).notes(), [note]);
    let rels = RELS.replace("2006/relationships/metadata/thumbnail", "2019/04/keystore");
    let archive = zip(&[("_rels/.rels", rels.as_bytes()), (MODEL, simple().as_bytes())]);
    assert!(parse_error(archive, "3mf").to_string().contains("3MF Secure Content"));
    assert!(error("%3McF").to_string().contains("the encrypted model part"));
    let mut archive = package(&simple());
    for at in memchr::memmem::find_iter(&archive.clone(), b"PK\x01\x02") {
        archive[at + 8] |= 1;
    }
    assert!(parse_error(archive, "3mf").to_string().contains("the encrypted entry `_rels/.rels`"));
}

#[test]
fn what_is_required_but_unknown_is_noted() {
    let text = simple().replace("unit", "xmlns:v=\"http://v\" requiredextensions=\"p v\" unit");
    let note = "The model requires the extension `http://v`, which is kept as it is.";
    assert_eq!(open(&text).notes(), [note]);
}

#[test]
fn a_signature_is_noted() {
    let rels = RELS.replace("relationships/metadata/thumbnail", "relationships/digital-signature/origin");
    let archive = zip(&[("_rels/.rels", rels.as_bytes()), (MODEL, simple().as_bytes())]);
    assert_eq!(
        read(archive, "3mf").notes(),
        ["The digital signature no longer holds once positions change."]
    );
}

#[test]
fn materials_and_metadata_are_noted() {
    let extra =
        "<basematerials id=\"5\"/><m:colorgroup xmlns:m=\"http://m\"/><metadata name=\"a\">b</metadata>";
    let text = simple().replace("<resources>", &format!("<resources>{extra}"));
    assert_eq!(open(&text).attributes(), ["unit millimeter", "materials", "colours", "metadata"]);
}

#[test]
fn cycles_are_refused() {
    let link = |id| format!("<components><component objectid=\"{id}\"/></components>");
    let text = model(&(object(1, &link(2)) + &object(2, &link(1))), &item(1));
    let error = error(&text);
    assert!(
        error.to_string().contains("line 5 of `3D/3dmodel.model`: object 1 is a component of itself"),
        "{error}"
    );
}

#[test]
fn more_paths_than_anyone_can_follow_are_only_counted() {
    let mut resources = object(1, &mesh(1));
    for id in 2..200 {
        let twice = format!("<component objectid=\"{}\"/>", id - 1).repeat(2);
        resources += &object(id, &format!("<components>{twice}</components>"));
    }
    let start = Instant::now();
    let document = open(&model(&resources, &item(61)));
    assert_eq!(document.triangles_with_instances(), 1 << 60);
    let document = open(&model(&resources, &item(199)));
    assert_eq!(document.triangles_with_instances(), u64::MAX);
    assert!(start.elapsed() < Duration::from_secs(2));
}

#[test]
fn components_may_be_nested_deeper_than_any_stack() {
    let mut resources = object(0, &mesh(1));
    for id in 1..100_000 {
        resources += &object(id, &format!("<components><component objectid=\"{}\"/></components>", id - 1));
    }
    assert_eq!(open(&model(&resources, &item(99_999))).points().len(), 3);
}

#[test]
fn bombs_are_refused() {
    let start = Instant::now();
    let bomb = simple().replace("<mesh>", &format!("<mesh>{}", " ".repeat(80 << 20)));
    let archive = package(&bomb);
    assert!(archive.len() < 200_000);
    let unpacked = start.elapsed();
    let error = parse_error(archive, "3mf");
    assert!(matches!(error, ParseError::Unpacked { limit: 67_108_864, .. }), "{error}");
    assert!(start.elapsed() - unpacked < Duration::from_secs(2));
    let limits = Limits::default().with_max_bytes(1000);
    let error = Document::parse_within(
        package(&simple().replace("<mesh>", &format!("<mesh>{}", " ".repeat(1000)))),
        None,
        limits,
    );
    assert!(matches!(error, Err(ParseError::Unpacked { limit: 1000, .. })));
}

/// Models of very many small things, their numbers divided by `share`.
fn crowded(share: usize) -> Vec<Vec<u8>> {
    let texts = [
        "<a/>".repeat((15 << 20) / share),
        "<a>".repeat((20 << 20) / share),
        (0..1_500_000 / share).map(|id| format!("<object id=\"{id}\"/>")).collect(),
        " xmlns:a=\"b\"".repeat(1_000_000 / share),
        format!("<a {}/>", "b=\"\" ".repeat((5 << 20) / share)),
        "&amp;".repeat((5 << 20) / share),
        format!("<object id=\"2\"><components>{}", "<component objectid=\"1\"/>".repeat(2_600_000 / share)),
        format!(
            "<object id=\"2\"><components>{}",
            format!("<component objectid=\"1\" transform=\"{TURN}\"/>").repeat(1_000_000 / share)
        ),
        format!(
            "<object id=\"2\"><mesh><vertices>{}",
            "<vertex x=\"1\"y=\"1\"z=\"1\"/>".repeat(2_400_000 / share)
        ),
    ];
    let whole = |text: String| match text.starts_with(" xmlns") {
        true => format!("<model{text}/>"),
        false => simple().replace("<resources>", &format!("<resources>{text}")),
    };
    texts.into_iter().map(|text| package(&whole(text))).collect()
}

/// Eight times as many take about eight times as long, or are refused at once; what looks each of them up among all takes
/// sixty-four times as long. Both are timed beside whatever else the machine does.
#[test]
fn many_small_elements_are_read_in_time_or_refused() {
    let seconds = |archive: Vec<u8>| {
        let start = Instant::now();
        let _ = Document::parse(archive, None);
        start.elapsed().as_secs_f64()
    };
    for (which, (few, many)) in crowded(8).into_iter().zip(crowded(1)).enumerate() {
        let (few, many) = (seconds(few), seconds(many));
        assert!(many < 24.0 * few + 0.5, "{which}: {few} s, of eight times as many {many} s");
    }
}

#[test]
fn truncated_archives_are_refused() {
    let archive = package(&simple());
    for length in 5..archive.len() {
        let error = parse_error(&archive[..length], "3mf");
        assert!(error.to_string().starts_with("the ZIP archive has no directory at its end"), "{error}");
    }
}

#[test]
fn damaged_archives_are_refused() {
    let archive = package(&simple());
    let central = memchr::memmem::rfind(&archive, b"PK\x01\x02").unwrap();
    let broken = |at: usize, value: u8| {
        let mut archive = archive.clone();
        archive[at] = value;
        parse_error(archive, "3mf").to_string()
    };
    assert!(broken(central + 10, 14).contains("compression by LZMA in the entry `3D/3dmodel.model`"));
    assert!(broken(central + 10, 77).contains("compression method 77"));
    assert!(broken(central + 16, archive[central + 16] ^ 1).contains("damaged"));
    assert!(broken(central + 23, 200).contains("not where the directory says"));
    assert!(broken(central, 0).contains("breaks off at entry 2"));
    let end = archive.len() - 22;
    assert!(broken(end + 16, 255).contains("not where its end says"));
    // Two entries in one place.
    let first = memchr::memmem::find(&archive, b"PK\x01\x02").unwrap();
    let mut shared = archive.clone();
    shared.copy_within(central + 42..central + 46, first + 42);
    shared.copy_within(central + 16..central + 28, first + 16);
    assert!(parse_error(shared, "3mf").to_string().contains("other entries in the same bytes"));
}

#[test]
fn a_part_must_be_there_once() {
    let text = simple();
    let archive =
        zip(&[("3D/3DMODEL.model", b"<a/>"), (MODEL, text.as_bytes()), ("_rels/.rels", RELS.as_bytes())]);
    assert!(parse_error(archive, "3mf").to_string().contains("more than once"));
}

#[test]
fn too_many_vertices_are_refused() {
    let limits = Limits::default().with_max_vertices(5);
    let text = model(&(object(1, &mesh(1)) + &object(2, &mesh(1))), &item(1));
    let error = Document::parse_within(package(&text), None, limits).unwrap_err();
    assert_eq!(error, ParseError::TooManyVertices { limit: 5 });
}

#[test]
fn what_the_transform_cannot_hold_is_refused() {
    let text = simple().replace("objectid=\"1\"", "objectid=\"1\" transform=\"1e-9 0 0 0 1 0 0 0 1 0 0 0\"");
    let document = open(&text);
    let points = lifted(&document, |_| Point3::new(1e300, 0.0, 0.0));
    assert!(matches!(document.with_points(&points), Err(WriteError::NonFinite { vertex: 0 })));
}

#[test]
fn a_new_file_needs_triangles_and_is_always_the_same() {
    let points = vec![Point3::new(1.0, 2.0, 3.0), Point3::new(1e-10, -0.0, 1e300), Point3::origin()];
    let soup = Soup::new(points, vec![[0, 1, 2]]);
    let bytes = encode(Format::ThreeMf, &soup).unwrap();
    assert_eq!(encode(Format::ThreeMf, &soup).unwrap(), bytes);
    assert!(part(&bytes, MODEL).contains("<vertex x=\"1e-10\" y=\"-0.0\" z=\"1e300\"/>"));
    let mut opened = ZipArchive::new(Cursor::new(&bytes)).unwrap();
    opened.validate_header_consistency().unwrap();
    assert_eq!(opened.by_index(0).unwrap().last_modified(), Some(DateTime::default()));
    let empty = Soup::new(soup.points, Vec::new());
    assert!(matches!(encode(Format::ThreeMf, &empty), Err(WriteError::Nothing { .. })));
}

/// A file with all that the reader follows.
fn seed() -> String {
    let pair = format!(
        "<components><component objectid=\"1\"/><component objectid=\"1\" transform=\"{TURN}\"/></components>"
    );
    let resources = object(1, &mesh(2)) + &object(2, &pair) + &object(3, &mesh(1));
    model(&resources, &format!("{}<item objectid=\"3\" transform=\"{TURN}\"/>", item(2)))
}

/// Whatever is read can be written, or says why not, and is then read again.
fn check(bytes: Vec<u8>) {
    let Ok(document) = Document::parse(bytes, Some("3mf")) else { return };
    if document.format() != Format::ThreeMf {
        return;
    }
    assert_eq!(document.with_points(document.points()).unwrap(), document.bytes());
    let points = lifted(&document, |p| p + Vector3::new(0.5, -0.25, 1.0));
    let Ok(bytes) = document.with_points(&points) else { return };
    let again = read(bytes, "3mf");
    assert_eq!(again.triangles(), document.triangles());
    assert_eq!(again.notes(), document.notes());
}

fn edits() -> impl Strategy<Value = Vec<(prop::sample::Index, u8)>> {
    prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)
}

fn edited(mut bytes: Vec<u8>, edits: &[(prop::sample::Index, u8)]) -> Vec<u8> {
    for (at, value) in edits {
        let at = at.index(bytes.len());
        bytes[at] = *value;
    }
    bytes
}

proptest! {
    #[test]
    fn no_archive_panics(edits in edits(), way in 0..4) {
        let archive = match way {
            0 => package(&seed()),
            1 => streamed(&seed()),
            2 => wide(&seed()),
            _ => rich(&seed()),
        };
        check(edited(archive, &edits));
    }

    #[test]
    fn no_directory_panics(edits in edits(), way in 0..4) {
        let mut archive = match way {
            0 => package(&seed()),
            1 => streamed(&seed()),
            2 => wide(&seed()),
            _ => rich(&seed()),
        };
        let directory = memchr::memmem::find(&archive, b"PK\x01\x02").unwrap();
        let tail = edited(archive.split_off(directory), &edits);
        archive.extend(tail);
        check(archive);
    }

    #[test]
    fn no_text_panics(edits in edits()) {
        let text = edited(seed().into_bytes(), &edits);
        check(zip_with(CompressionMethod::Stored, &[("_rels/.rels", RELS.as_bytes()), (MODEL, &text)]));
    }

    #[test]
    fn no_change_of_words_panics(
        swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..6),
    ) {
        let text = seed();
        let mut words: Vec<&str> = text.split_inclusive(['<', '>', ' ', '"']).collect();
        for (a, b) in swaps {
            let (a, b) = (a.index(words.len()), b.index(words.len()));
            words.swap(a, b);
        }
        let text = words.concat();
        check(zip_with(CompressionMethod::Stored, &[("_rels/.rels", RELS.as_bytes()), (MODEL, text.as_bytes())]));
    }

    #[test]
    fn what_is_written_is_read_to_the_bit(
        points in prop::collection::vec(
            prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO),
            1..20,
        ),
        corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..20),
    ) {
        let points: Vec<_> = points.into_iter().map(Point3::from).collect();
        let count = points.len();
        let triangles = corners.into_iter().map(|c| c.map(|c| c.index(count) as u32)).collect();
        let soup = Soup::new(points, triangles);
        let document = read(encode(Format::ThreeMf, &soup).unwrap(), "3mf");
        prop_assert_eq!(bits(document.points()), bits(&soup.points));
        prop_assert_eq!(document.triangles(), &soup.triangles);
    }
}

#[test]
fn an_entry_that_reaches_beyond_the_file_may_reach_anywhere() {
    // Found by mutation: the larger file that moved points made had room for what the entry claims.
    let bytes = encode(Format::ThreeMf, &sombrero_shapes::tetrahedron()).unwrap();
    let first = memchr::memmem::find(&bytes, b"PK\x01\x02").unwrap();
    let mut bytes = bytes.clone();
    let claimed = u32::try_from(bytes.len()).unwrap() - 40;
    bytes[first + 20..first + 24].copy_from_slice(&claimed.to_le_bytes());
    let error = parse_error(bytes, "3mf");
    assert!(error.to_string().contains("other entries in the same bytes"), "{error}");
}
