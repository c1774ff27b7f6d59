//! Compressed buffer views (`EXT_meshopt_compression`, `KHR_meshopt_compression`): what each holds is a store of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::accessor::view_of;
use super::buffers::{Buffers, Origin};
use super::error::malformed;
use super::json::{self, Root};
use super::meshopt::{self, Form, Mode};
use crate::error::ParseError;

/// Why a file is not marked in which new streams would change something else.
pub(super) const FIXED: &str = "Compressed positions share bytes with other data or are no attributes, so that they cannot be written \
                                anew; unpack the file first (`gltf-transform copy in.glb out.glb`), and give that.";

/// What a compressed buffer view holds, and where its stream stands.
#[derive(Debug, Clone)]
pub(super) struct Packed {
    pub(super) view: u32,
    /// The buffer that the stream stands in, its store, and where.
    pub(super) buffer: u32,
    pub(super) store: usize,
    pub(super) stream: Range<usize>,
    pub(super) form: Form,
    /// The same for those who cannot read the stream: the store and where it begins.
    pub(super) plain: Option<(usize, usize)>,
    /// Unpacked.
    pub(super) bytes: Vec<u8>,
}

impl Packed {
    /// Reads the stream of a buffer view. What it unpacks to is taken off `left`.
    pub(super) fn unpack(
        root: &Root<'_>,
        buffers: &Buffers<'_>,
        index: u32,
        left: &mut u64,
    ) -> Result<Self, ParseError> {
        let wrong = |problem: &str| malformed("buffer view", index as usize, problem);
        let view = view_of(root, index)?;
        let packed = view.extensions.packed.as_deref().ok_or_else(|| wrong("it is not compressed"))?;
        let store = buffers.store(packed.buffer).ok_or_else(|| wrong("its buffer was not loaded"))?;
        let form = form(packed).filter(Form::is_sound);
        let form = form.ok_or_else(|| wrong("its compression is of a kind that glTF does not know"))?;
        let length = (form.stride as u64).checked_mul(form.count as u64);
        if length != Some(view.byte_length) {
            return Err(wrong("its length is not that of what its compressed data hold"));
        }
        let what = || format!("buffer view {index}");
        let too_much = || ParseError::Unpacked { what: what(), limit: *left };
        *left = left.checked_sub(view.byte_length).ok_or_else(too_much)?;
        let (stream, bytes) = stream(packed, buffers.bytes(store))
            .ok_or_else(|| wrong("its compressed data do not fit into their buffer"))?;
        let bytes = meshopt::decode(bytes, &form).ok_or_else(|| wrong("its compressed data are damaged"))?;
        let plain = buffers.store(view.buffer).zip(usize::try_from(view.byte_offset).ok());
        Ok(Self { view: index, buffer: packed.buffer, store, stream, form, plain, bytes })
    }

    /// Whether its content can be packed again.
    fn can_be_written(&self) -> bool {
        self.form.mode == Mode::Attributes
    }
}

fn form(packed: &json::Packed) -> Option<Form> {
    Some(Form {
        mode: packed.mode,
        filter: packed.filter,
        stride: usize::try_from(packed.byte_stride).ok()?,
        count: usize::try_from(packed.count).ok()?,
    })
}

fn stream<'a>(packed: &json::Packed, buffer: &'a [u8]) -> Option<(Range<usize>, &'a [u8])> {
    let start = usize::try_from(packed.byte_offset).ok()?;
    let end = start.checked_add(usize::try_from(packed.byte_length).ok()?)?;
    Some((start..end, buffer.get(start..end)?))
}

/// Whether some of these stores are compressed in a way in which they cannot be written anew.
pub(super) fn cannot_be_written(
    root: &Root<'_>,
    buffers: &Buffers<'_>,
    stores: impl Iterator<Item = usize>,
) -> bool {
    let entangled = entangled(root, buffers);
    let mut origins = stores.filter_map(|store| buffers.origins.get(store));
    origins.any(|origin| match origin {
        Origin::Packed(packed) => !packed.can_be_written() || entangled.contains(&packed.view),
        _ => false,
    })
}

/// The compressed buffer views whose streams, or what stands uncompressed for them, share bytes with another stretch: new ones
/// would change that, too.
fn entangled(root: &Root<'_>, buffers: &Buffers<'_>) -> BTreeSet<u32> {
    let mut of_buffer: BTreeMap<u32, Vec<(u64, u64, u32)>> = BTreeMap::new();
    for (index, view) in (0..).zip(&root.buffer_views) {
        let packed = view.extensions.packed.as_deref();
        let stream = packed.map(|packed| (packed.buffer, packed.byte_offset, packed.byte_length));
        let plain = Some((view.buffer, view.byte_offset, view.byte_length))
            .filter(|(buffer, ..)| packed.is_none() || buffers.store(*buffer).is_some());
        for (buffer, start, length) in stream.into_iter().chain(plain).filter(|(.., length)| *length > 0) {
            of_buffer.entry(buffer).or_default().push((start, start.saturating_add(length), index));
        }
    }
    let mut found = BTreeSet::new();
    for stretches in of_buffer.values_mut() {
        stretches.sort_unstable();
        // The stretch that reaches furthest so far.
        let mut furthest: Option<(u64, u32)> = None;
        for &(start, end, index) in &*stretches {
            if let Some((reach, other)) = furthest
                && start < reach
            {
                found.extend([other, index]);
            }
            if furthest.is_none_or(|(reach, _)| reach < end) {
                furthest = Some((end, index));
            }
        }
    }
    found
}
