//! New streams for compressed buffer views whose content changed.
//!
//! A stream that is no longer than the old one takes its place, and zeros follow it. One that is longer pushes what stands
//! behind it back by a multiple of four bytes, and the offsets in the JSON follow. Filters round, so new streams have none.
//! Where the same stands uncompressed for those who cannot read the stream, that changes too.

use std::ops::Range;

use serde::Deserialize;
use serde_json::value::RawValue;

use super::buffers::Origin;
use super::json::span;
use super::meshopt::{self, Filter};
use super::packed::Packed;
use super::patches::Patches;
use super::write::Edit;

/// The numbers of the JSON that say where streams and views stand, as they are spelled.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Spelled<'a> {
    #[serde(default, borrow)]
    buffer_views: Vec<View<'a>>,
    #[serde(default, borrow)]
    buffers: Vec<Buffer<'a>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View<'a> {
    #[serde(borrow)]
    buffer: &'a RawValue,
    #[serde(borrow)]
    byte_offset: Option<&'a RawValue>,
    #[serde(default, borrow)]
    extensions: Extensions<'a>,
}

#[derive(Default, Deserialize)]
struct Extensions<'a> {
    #[serde(borrow, rename = "EXT_meshopt_compression", alias = "KHR_meshopt_compression")]
    packed: Option<Stream<'a>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Stream<'a> {
    #[serde(borrow)]
    buffer: &'a RawValue,
    #[serde(borrow)]
    byte_offset: Option<&'a RawValue>,
    #[serde(borrow)]
    byte_length: &'a RawValue,
    #[serde(borrow)]
    filter: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Buffer<'a> {
    #[serde(borrow)]
    byte_length: &'a RawValue,
}

/// A whole number of the JSON, which may be spelled `36.0`.
fn number(raw: &RawValue) -> Option<u64> {
    let number: serde_json::Number = serde_json::from_str(raw.get()).ok()?;
    number.as_u64().or_else(|| number.as_f64().map(|value| value as u64))
}

/// A stream that takes the place of another.
struct Replaced {
    buffer: u32,
    store: usize,
    /// Where the old one stands.
    at: Range<usize>,
    /// The new one and what fills its room up.
    bytes: Vec<u8>,
}

impl Replaced {
    /// By how much it pushes back what stands behind it.
    fn pushes(&self) -> usize {
        self.bytes.len() - self.at.len()
    }
}

/// Puts new streams into the buffers in place of those whose content changed, and the numbers of the JSON right. `None` when
/// the JSON is not what was read.
pub(super) fn repack(
    text: &str,
    origins: &[Origin],
    patches: &mut Patches<'_>,
    edits: &mut Vec<Edit>,
) -> Option<()> {
    let mut streams = Vec::new();
    for (store, origin) in origins.iter().enumerate() {
        if let Origin::Packed(packed) = origin
            && let Some(new) = patches.changed(store)
        {
            let new = new.to_vec();
            streams.push(new_stream(packed, &new, patches));
            change_plain(packed, &new, patches);
        }
    }
    if streams.is_empty() {
        return Some(());
    }
    let json: Spelled<'_> = serde_json::from_str(text).ok()?;
    let mut edit = |raw: &RawValue, text_of: String| {
        let span = span(text, raw.get())?;
        edits.push(Edit { span, text: text_of });
        Some(())
    };
    for (packed, length, _) in &streams {
        let stream = json.buffer_views.get(packed.view as usize)?.extensions.packed.as_ref()?;
        if *length != packed.stream.len() {
            edit(stream.byte_length, length.to_string())?;
        }
        if let Some(filter) = stream.filter.filter(|_| packed.form.filter != Filter::None) {
            edit(filter, "\"NONE\"".to_owned())?;
        }
    }
    let mut replaced: Vec<Replaced> = streams.into_iter().map(|(_, _, replaced)| replaced).collect();
    replaced.sort_by_key(|replaced| replaced.at.start);
    let shift = |buffer: u64, offset: u64| -> u64 {
        let before = replaced.iter().filter(|r| u64::from(r.buffer) == buffer && r.at.end as u64 <= offset);
        before.map(|r| r.pushes() as u64).sum()
    };
    for view in &json.buffer_views {
        let stream = view.extensions.packed.as_ref();
        let places = [(view.buffer, view.byte_offset)].into_iter();
        for (buffer, offset) in places.chain(stream.map(|stream| (stream.buffer, stream.byte_offset))) {
            let Some(raw) = offset else { continue };
            let old = number(raw)?;
            let shift = shift(number(buffer)?, old);
            if shift > 0 {
                edit(raw, (old + shift).to_string())?;
            }
        }
    }
    for (index, buffer) in (0..).zip(&json.buffers) {
        let shift = shift(index, u64::MAX);
        if shift > 0 {
            edit(buffer.byte_length, (number(buffer.byte_length)? + shift).to_string())?;
        }
    }
    // From the back, so that what is still to be replaced stays where it is.
    for Replaced { store, at, bytes, .. } in replaced.into_iter().rev() {
        patches.change(store)?.splice(at, bytes);
    }
    Some(())
}

/// The new stream of a buffer view that holds `new`, and how long it is without what fills its room up.
fn new_stream<'a>(packed: &'a Packed, new: &[u8], patches: &Patches<'_>) -> (&'a Packed, usize, Replaced) {
    let old = patches.old(packed.store).get(packed.stream.clone()).unwrap_or_default();
    let mut bytes = meshopt::encode(new, packed.form.stride, old);
    let length = bytes.len();
    let room = packed.stream.len();
    bytes.resize(room + length.saturating_sub(room).next_multiple_of(4), 0);
    let replaced = Replaced { buffer: packed.buffer, store: packed.store, at: packed.stream.clone(), bytes };
    (packed, length, replaced)
}

/// Puts the elements that changed where they stand uncompressed.
fn change_plain(packed: &Packed, new: &[u8], patches: &mut Patches<'_>) {
    let Some((store, start)) = packed.plain else { return };
    let stride = packed.form.stride;
    let Some(plain) = patches.change(store) else { return };
    let Some(plain) = plain.get_mut(start..) else { return };
    let pairs = packed.bytes.chunks(stride).zip(new.chunks(stride));
    for ((old, new), slot) in pairs.zip(plain.chunks_mut(stride)) {
        if old != new && slot.len() == new.len() {
            slot.copy_from_slice(new);
        }
    }
}
