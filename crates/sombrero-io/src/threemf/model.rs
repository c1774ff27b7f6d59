//! The XML of a model part: objects, their meshes and components, and what the build shows.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::Point3;

use super::archive::Budget;
use super::package::Package;
use super::xml::{CORE, Step, Tag, Xml};
use crate::attributes::Attributes;
use crate::error::ParseError;
use crate::input::Limits;
use crate::text;

const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";

/// As much of a namespace as a note can take: they differ at their ends.
fn end_of(namespace: &str) -> String {
    let (length, longest) = (namespace.chars().count(), 36);
    let end: String = namespace.chars().skip(length.saturating_sub(longest)).collect();
    let shown = text::quoted(end.as_bytes());
    if length > longest { format!("…{shown}") } else { shown }
}

/// Extensions that say nothing about where vertices are.
const HARMLESS: [&str; 6] = [
    PRODUCTION,
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02",
    "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
    CORE,
];

/// An object: a mesh, or other objects put together.
#[derive(Debug, Default, Clone)]
pub(super) struct Object {
    pub(super) id: u32,
    /// Whether a slicer never prints it, because it says what is done with others.
    pub(super) unprinted: bool,
    /// Whether it is a support, which is not part of the model.
    pub(super) support: bool,
    pub(super) points: Range<usize>,
    pub(super) triangles: Range<usize>,
    pub(super) components: Range<usize>,
}

/// A component or an item of the build: an object, and where it goes.
#[derive(Debug)]
pub(super) struct Link {
    /// The part that holds the object, in the order of mention.
    pub(super) part: usize,
    pub(super) id: u32,
    /// Three rows and the shift, if they are given.
    pub(super) transform: Option<Box<[f64; 12]>>,
    /// Where it stands in its part.
    pub(super) at: usize,
}

/// What a model part holds.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// Its entry in the archive.
    pub(super) entry: usize,
    pub(super) objects: Vec<Object>,
    ids: HashMap<u32, usize>,
    /// Vertices of all objects as they are stored, and where their tags stand.
    pub(super) points: Vec<Point3<f64>>,
    pub(super) slots: Vec<usize>,
    /// Triangles of all objects, each counting the vertices of its own object.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) components: Vec<Link>,
    pub(super) items: Vec<Link>,
    /// Items that slicers are told not to print.
    pub(super) unprinted: Vec<Link>,
}

impl Object {
    /// Whether it has a mesh that is part of the model.
    pub(super) fn is_model(&self) -> bool {
        !self.points.is_empty() && !self.support && !self.unprinted
    }
}

impl Part {
    /// The object of this number.
    pub(super) fn object(&self, id: u32) -> Option<usize> {
        self.ids.get(&id).copied()
    }
}

/// What is worth knowing beside the geometry.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub(super) attributes: Attributes,
    pub(super) notes: Attributes,
}

/// The parts that a model spans, in the order of mention.
struct Mentions<'p, 'a> {
    package: &'p Package<'a>,
    entries: Vec<usize>,
    numbers: HashMap<usize, usize>,
}

impl Mentions<'_, '_> {
    fn number(&mut self, entry: usize) -> usize {
        *self.numbers.entry(entry).or_insert_with(|| {
            self.entries.push(entry);
            self.entries.len() - 1
        })
    }
}

/// Reads the model at `entry` and every part that it mentions.
pub(super) fn read(
    package: &Package<'_>,
    entry: usize,
    budget: &mut Budget,
    limits: Limits,
    findings: &mut Findings,
) -> Result<Vec<Part>, ParseError> {
    let mut mentions = Mentions { package, entries: Vec::new(), numbers: HashMap::new() };
    mentions.number(entry);
    let (mut parts, mut vertices) = (Vec::new(), 0);
    while let Some(&entry) = mentions.entries.get(parts.len()) {
        let bytes = package.model_text(entry, budget)?;
        let mut reader = Reader {
            xml: Xml::new(package.archive.title(entry), &bytes)?,
            number: parts.len(),
            part: Part { entry, ..Part::default() },
            mentions: &mut mentions,
            findings,
            limits,
            before: vertices,
        };
        reader.run()?;
        let part = reader.part;
        vertices += part.points.len();
        parts.push(part);
    }
    Ok(parts)
}

/// The elements that lead to vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Node {
    Model,
    Resources,
    Build,
    Object,
    Mesh,
    Vertices,
    Triangles,
    Components,
    Other,
}

struct Reader<'r, 'p, 'a, 'x> {
    xml: Xml<'x>,
    number: usize,
    part: Part,
    mentions: &'r mut Mentions<'p, 'a>,
    findings: &'r mut Findings,
    limits: Limits,
    /// Vertices of the parts before this one.
    before: usize,
}

impl<'x> Reader<'_, '_, '_, 'x> {
    fn run(&mut self) -> Result<(), ParseError> {
        let mut open: Vec<Node> = Vec::new();
        let mut begun = false;
        loop {
            match self.xml.step()? {
                Step::Open(tag) => {
                    let node = match open.last() {
                        Some(&parent) => self.element(parent, tag)?,
                        None if begun => {
                            return Err(self.malformed(tag, "another element follows the model".into()));
                        }
                        None => self.root(tag)?,
                    };
                    begun = true;
                    if !tag.empty {
                        open.push(node);
                    }
                }
                Step::Close => {
                    open.pop();
                }
                Step::End if begun => return Ok(()),
                Step::End => {
                    let problem = "the part holds no model".into();
                    return Err(self.xml.malformed(0, problem));
                }
            }
            debug_assert_eq!(open.len(), self.xml.depth());
        }
    }

    fn malformed(&self, tag: Tag<'_>, problem: String) -> ParseError {
        self.xml.malformed(tag.at, problem)
    }

    fn root(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        let (prefix, name) = self.xml.name(tag);
        if name != "model" {
            let problem = format!("expected `model`, found `{}`", text::quoted(name.as_bytes()));
            return Err(self.malformed(tag, problem));
        }
        if !self.xml.is_core(tag) {
            let namespace = text::quoted(self.xml.namespace(prefix).as_bytes());
            return Err(ParseError::Unsupported {
                what: format!("the model of `{}` in the namespace `{namespace}`", self.xml.part()),
                cure: "export the model again as 3MF with the core namespace of 2015",
            });
        }
        let [unit, required] = self.xml.pick(tag, ["unit", "requiredextensions"])?;
        let unit = self.xml.maybe(tag, unit)?;
        let unit = unit.as_deref().unwrap_or("millimeter");
        if self.number == 0 {
            self.findings.attributes.note(&format!("unit {}", text::quoted(unit.as_bytes())));
        }
        for prefix in self.xml.maybe(tag, required)?.unwrap_or_default().split_ascii_whitespace() {
            self.require(prefix);
        }
        Ok(Node::Model)
    }

    fn require(&mut self, prefix: &str) {
        let namespace = self.xml.namespace(prefix);
        if !HARMLESS.contains(&namespace) {
            let name = end_of(if namespace.is_empty() { prefix } else { namespace });
            let note = format!("The model requires the extension `{name}`, which is kept as it is.");
            self.findings.notes.note(&note);
        }
    }

    /// Takes in an element and tells what it is.
    fn element(&mut self, parent: Node, tag: Tag<'x>) -> Result<Node, ParseError> {
        if parent == Node::Other {
            return Ok(Node::Other);
        }
        let (_, name) = self.xml.name(tag);
        let node = match (parent, name) {
            _ if !self.xml.is_core(tag) => Node::Other,
            (Node::Vertices, "vertex") => return self.vertex(tag),
            (Node::Triangles, "triangle") => return self.triangle(tag),
            (Node::Components, "component") => return self.component(tag),
            (Node::Build, "item") => return self.item(tag),
            (Node::Resources, "object") => return self.object(tag),
            (Node::Model, "resources") => Node::Resources,
            (Node::Model, "build") => Node::Build,
            (Node::Object, "mesh") => return self.mesh(tag),
            (Node::Object, "components") => Node::Components,
            (Node::Mesh, "vertices") => Node::Vertices,
            (Node::Mesh, "triangles") => Node::Triangles,
            _ => Node::Other,
        };
        if let Some(attribute) = attribute(name) {
            self.findings.attributes.note(attribute);
        }
        Ok(node)
    }

    fn object(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        let [id, kind] = self.xml.pick(tag, ["id", "type"])?;
        let id = self.id(tag, id, "id")?;
        let kind = self.xml.maybe(tag, kind)?;
        if self.part.ids.insert(id, self.part.objects.len()).is_some() {
            return Err(self.malformed(tag, format!("there are two objects {id}")));
        }
        let (points, triangles) = (self.part.points.len(), self.part.triangles.len());
        let components = self.part.components.len();
        self.part.objects.push(Object {
            id,
            // What slicers call the volumes that say what is done with others.
            unprinted: kind.as_deref() == Some("other"),
            support: matches!(kind.as_deref(), Some("support" | "solidsupport")),
            points: points..points,
            triangles: triangles..triangles,
            components: components..components,
        });
        Ok(Node::Object)
    }

    fn mesh(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        match self.part.objects.last() {
            Some(object) if !object.points.is_empty() => {
                let problem = format!("object {} has two meshes", object.id);
                Err(self.malformed(tag, problem))
            }
            _ => Ok(Node::Mesh),
        }
    }

    fn vertex(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        let spans = self.xml.pick(tag, ["x", "y", "z"])?;
        let mut point = Point3::origin();
        for (span, value) in spans.into_iter().zip(point.iter_mut()) {
            let missing = || self.malformed(tag, "a vertex needs `x`, `y` and `z`".into());
            *value = self.number(tag, span.ok_or_else(missing)?)?;
        }
        self.part.points.push(point);
        self.part.slots.push(tag.at);
        self.limits.check_vertices(self.before + self.part.points.len())?;
        if let Some(object) = self.part.objects.last_mut() {
            object.points.end = self.part.points.len();
        }
        Ok(Node::Other)
    }

    fn triangle(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        let spans = self.xml.pick(tag, ["v1", "v2", "v3"])?;
        let count = self.part.objects.last().map_or(0, |object| object.points.len());
        let mut triangle = [0; 3];
        for (span, corner) in spans.into_iter().zip(&mut triangle) {
            let missing = || self.malformed(tag, "a triangle needs `v1`, `v2` and `v3`".into());
            let index = self.integer(tag, span.ok_or_else(missing)?)?;
            let known = u32::try_from(index).ok().filter(|&index| (index as usize) < count);
            *corner = known.ok_or_else(|| {
                let place = self.xml.place(tag.at);
                ParseError::IndexOutOfRange { place, index, first: 0, count }
            })?;
        }
        self.part.triangles.push(triangle);
        if let Some(object) = self.part.objects.last_mut() {
            object.triangles.end = self.part.triangles.len();
        }
        Ok(Node::Other)
    }

    fn component(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        let link = self.link(tag)?;
        self.part.components.push(link);
        if let Some(object) = self.part.objects.last_mut() {
            object.components.end = self.part.components.len();
        }
        Ok(Node::Other)
    }

    fn item(&mut self, tag: Tag<'x>) -> Result<Node, ParseError> {
        let link = self.link(tag)?;
        let [printable] = self.xml.pick(tag, ["printable"])?;
        let is_printed = self.xml.maybe(tag, printable)?.is_none_or(|value| &*value != "0");
        // Only the model that the package names has a say in what is built.
        match (self.number, is_printed) {
            (0, true) => self.part.items.push(link),
            (0, false) => self.part.unprinted.push(link),
            _ => {}
        }
        Ok(Node::Other)
    }

    fn link(&mut self, tag: Tag<'x>) -> Result<Link, ParseError> {
        let [id, transform] = self.xml.pick(tag, ["objectid", "transform"])?;
        let id = self.id(tag, id, "objectid")?;
        let transform = transform.map(|span| self.transform(tag, span)).transpose()?;
        let part = match self.xml.attribute_of(tag, PRODUCTION, "path")? {
            None => self.number,
            Some(path) => match self.mentions.package.find(&path) {
                Some(entry) => self.mentions.number(entry),
                None => {
                    let path = text::quoted(path.as_bytes());
                    return Err(self.malformed(tag, format!("the archive holds no part `{path}`")));
                }
            },
        };
        Ok(Link { part, id, transform, at: tag.at })
    }

    fn transform(&self, tag: Tag<'x>, span: Range<usize>) -> Result<Box<[f64; 12]>, ParseError> {
        let value = self.xml.value(tag, span)?;
        let mut numbers = Box::new([0.0; 12]);
        let mut words = value.split_ascii_whitespace();
        for number in numbers.iter_mut() {
            let word = words.next().ok_or_else(|| self.not_twelve(tag))?;
            *number = text::number(word.as_bytes()).ok_or_else(|| self.not_a_number(tag, word))?;
        }
        if words.next().is_some() { Err(self.not_twelve(tag)) } else { Ok(numbers) }
    }

    fn not_twelve(&self, tag: Tag<'x>) -> ParseError {
        self.malformed(tag, "a transform needs 12 numbers".into())
    }

    fn not_a_number(&self, tag: Tag<'x>, word: &str) -> ParseError {
        ParseError::NotANumber { place: self.xml.place(tag.at), found: text::quoted(word.as_bytes()) }
    }

    fn number(&self, tag: Tag<'x>, span: Range<usize>) -> Result<f64, ParseError> {
        let value = self.xml.value(tag, span)?;
        text::number(value.trim().as_bytes()).ok_or_else(|| self.not_a_number(tag, &value))
    }

    fn integer(&self, tag: Tag<'x>, span: Range<usize>) -> Result<i64, ParseError> {
        let value = self.xml.value(tag, span)?;
        text::integer(value.trim().as_bytes()).ok_or_else(|| self.not_a_number(tag, &value))
    }

    fn id(&self, tag: Tag<'x>, span: Option<Range<usize>>, name: &str) -> Result<u32, ParseError> {
        let span = span.ok_or_else(|| self.malformed(tag, format!("the tag has no `{name}`")))?;
        let id = self.integer(tag, span)?;
        u32::try_from(id).map_err(|_| self.malformed(tag, format!("`{name}` is {id}, which numbers nothing")))
    }
}

/// What an element tells about the file.
fn attribute(name: &str) -> Option<&'static str> {
    match name {
        "basematerials" | "compositematerials" | "multiproperties" => Some("materials"),
        "colorgroup" => Some("colours"),
        "texture2dgroup" => Some("texture coordinates"),
        "texture2d" => Some("textures"),
        "metadata" | "metadatagroup" => Some("metadata"),
        "beamlattice" => Some("beam lattices"),
        "slicestack" => Some("slices"),
        "components" => Some("components"),
        "trianglesets" => Some("triangle sets"),
        "displacementmesh" => Some("displacement meshes"),
        "booleanshape" => Some("boolean shapes"),
        _ => None,
    }
}
