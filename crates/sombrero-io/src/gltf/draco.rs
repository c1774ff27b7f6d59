//! Primitives whose vertices and triangles are in Draco streams (`KHR_draco_mesh_compression`): each accessor of theirs has a
//! store of its own. Streams are read and never written.

use std::collections::HashMap;

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

use super::accessor::{Accessors, claimed, get};
use super::buffers::{Buffers, Origin};
use super::elements::{Component, Elements, Run};
use super::error::malformed;
use super::json::{Draco, Primitive, Root, Shape};
use super::scene::Shown;
use crate::error::ParseError;
use crate::input::Limits;

/// Why such a file is not marked.
pub(super) const FIXED: &str = "Positions are compressed with Draco, which rounds them again each time they are written; \
                                unpack the file first (`gltf-transform copy in.glb out.glb`, or export without Draco) and give that.";

/// Triangles that a stream may hold without giving a byte for every four of them: what is being unpacked takes far more memory
/// than they do.
const FEW: u64 = 1 << 21;

/// The accessors that stand in the streams of what is shown.
pub(super) fn decoded(
    root: &Root<'_>,
    shown: &[Shown],
    buffers: &mut Buffers<'_>,
    limits: Limits,
) -> Result<HashMap<u32, Elements>, ParseError> {
    let mut reader = Reader {
        root,
        limits,
        left: limits.unpacked(buffers.size()),
        found: HashMap::new(),
        by: HashMap::new(),
    };
    for mesh in shown.iter().filter(|shown| shown.placement.is_some()).map(|shown| shown.mesh) {
        let primitives = root.meshes.get(mesh).map_or(&[][..], |mesh| &mesh.primitives);
        for primitive in primitives.iter().filter(|primitive| primitive.is_surface()) {
            if let Some(draco) = &primitive.extensions.draco {
                reader.read(mesh, primitive, draco, buffers)?;
            }
        }
    }
    Ok(reader.found)
}

struct Reader<'a> {
    root: &'a Root<'a>,
    limits: Limits,
    /// How many bytes may still be unpacked, or looked at once more.
    left: u64,
    found: HashMap<u32, Elements>,
    /// The buffer view of the stream that an accessor stands in, and the number that the stream knows it by.
    by: HashMap<u32, (u32, Option<u32>)>,
}

impl Reader<'_> {
    fn read(
        &mut self,
        mesh: usize,
        primitive: &Primitive,
        draco: &Draco,
        buffers: &mut Buffers<'_>,
    ) -> Result<(), ParseError> {
        let wrong = |problem: &str| malformed("mesh", mesh, problem);
        let (Some(view), Some(number)) = (draco.buffer_view, draco.attributes.position) else {
            return Err(wrong("a primitive with Draco compression does not say where its positions are"));
        };
        let (Some(position), Some(indices)) = (primitive.attributes.position, primitive.indices) else {
            return Err(wrong("a primitive with Draco compression has no indices"));
        };
        let known = [(position, Some(number)), (indices, None)].map(|(accessor, number)| {
            let known = self.by.insert(accessor, (view, number));
            known.map(|known| known == (view, number))
        });
        match known {
            [Some(true), Some(true)] => return Ok(()),
            [Some(false), _] | [_, Some(false)] => {
                return Err(wrong("an accessor stands in two Draco streams"));
            }
            _ => {}
        }
        let decoded = self.decode(view, buffers)?;
        let attribute = decoded.attribute_by_unique_id(number);
        let attribute = attribute.ok_or_else(|| wrong("its Draco stream has no such attribute"))?;
        let points = attribute.read_f32s(decoded.num_points(), 3);
        let accessor = get(self.root, position)?;
        let elements = Elements { count: decoded.num_points(), ..claimed(accessor, position)? };
        if elements.shape != Shape::Vec3 || elements.component == Component::U32 {
            return Err(wrong("positions must be VEC3 of 32-bit floats, or of 8 or 16 bit whole numbers"));
        }
        self.keep(position, elements, points.into_iter().map(f64::from), buffers);
        let elements = Elements {
            component: Component::U32,
            normalized: false,
            shape: Shape::Scalar,
            count: 3 * decoded.num_faces(),
            base: None,
            sparse: Vec::new(),
            sparse_store: 0,
        };
        let corners = decoded.faces().iter().flatten().map(|corner| f64::from(corner.0));
        self.keep(indices, elements, corners, buffers);
        Ok(())
    }

    /// The mesh of a stream.
    fn decode(&mut self, view: u32, buffers: &Buffers<'_>) -> Result<Mesh, ParseError> {
        let nothing = HashMap::new();
        let stream = Accessors::new(self.root, buffers, &nothing).whole_view(view);
        let stream = stream.and_then(|at| buffers.bytes(at.store).get(at.start..at.start + at.size));
        let wrong = |problem: &str| malformed("buffer view", view as usize, problem);
        let stream = stream.ok_or_else(|| wrong("it does not fit into its buffer"))?;
        let most = self.left.min(FEW.max(4 * stream.len() as u64));
        let limits = DecodeLimits::default()
            .with_max_points(most.min(self.limits.max_vertices as u64))
            .with_max_faces(most)
            .with_max_decoded_bytes(self.left);
        let mut mesh = Mesh::new();
        let mut source = DecoderBuffer::new(stream).with_limits(limits);
        MeshDecoder::new()
            .decode(&mut source, &mut mesh)
            .map_err(|error| wrong(&format!("its Draco stream cannot be read ({error})")))?;
        let taken = stream.len() + 12 * (mesh.num_points() + mesh.num_faces());
        let what = || format!("the Draco stream in buffer view {view}");
        self.left = self
            .left
            .checked_sub(taken as u64)
            .ok_or_else(|| ParseError::Unpacked { what: what(), limit: self.left })?;
        Ok(mesh)
    }

    /// Keeps the elements of an accessor in a store of their own.
    fn keep(
        &mut self,
        accessor: u32,
        elements: Elements,
        numbers: impl Iterator<Item = f64>,
        buffers: &mut Buffers<'_>,
    ) {
        let component = elements.component;
        let size = component.size();
        let mut bytes = vec![0; elements.count * elements.size()];
        for (slot, number) in bytes.chunks_mut(size).zip(numbers) {
            component.put(number, slot);
        }
        let run = Run { store: buffers.origins.len(), offset: 0, stride: elements.size() };
        buffers.origins.push(Origin::Decoded(bytes));
        self.found.insert(accessor, Elements { base: Some(run), ..elements });
    }
}
