//! A kind of frames, and what its fields are in one.

use framelock_formats::Layout;
use framelock_formats::layout::Trailer;

use crate::field::Field;
use crate::value::Value;

/// Bytes in the longest frame that may be described: what a length of 16 bits can tell, and 256 more.
pub const LONGEST: usize = 0x1_00FF;

/// One kind of frames: what they look like, and what stands in them.
#[derive(Clone, Debug)]
pub struct Kind {
    /// Its name among several.
    pub name: String,
    /// What a frame looks like.
    pub layout: Layout<'static>,
    /// What stands in it, in the order of the description; those that are always the same too.
    pub fields: Vec<Field>,
    /// Bytes that must be there before the length is known.
    pub(crate) header: usize,
    /// The number of bytes at the end of a frame that hold the parts counted from its end.
    pub from_end: usize,
    /// The messages whose values stand in place of the bytes that are left: the first that fits is shown.
    pub views: Vec<Kind>,
    /// The bytes that tell a view's frames, and the index of the first.
    pub(crate) sign: (usize, Vec<u8>),
    /// Whether the sender leaves out zero bytes at the end of the payload.
    pub has_truncated_zeros: bool,
}

impl Kind {
    /// Returns the kind and its views.
    pub(crate) fn with_views(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.views)
    }

    /// What one of its fields is in a frame; nothing if that is too short to have it. Truncated zeros are there.
    #[inline]
    #[must_use]
    pub fn content<'f>(&self, field: &'f Field, frame: &'f [u8]) -> Option<Content<'f>> {
        let part = match self.layout.trailer() {
            None => frame,
            Some(trailer) => parted(frame, &trailer, field.is_appended),
        };
        let length = self.layout.counted_length(part);
        let cut = || {
            let is_cut = self.has_truncated_zeros && !field.is_appended;
            is_cut.then(|| field.first_bytes(part, length))?
        };
        let bytes = field.item(field.bytes(part, length).or_else(cut)?)?;
        Some(Content { field, bytes })
    }

    /// The view that shows a frame; none if its values or its length are others.
    #[inline]
    pub(crate) fn view(&self, frame: &[u8]) -> Option<usize> {
        self.views.iter().position(|view| view.shows(frame))
    }

    #[inline]
    fn shows(&self, frame: &[u8]) -> bool {
        let (at, bytes) = &self.sign;
        frame.get(*at..at + bytes.len()) == Some(bytes) && self.has_length_of(frame)
    }

    /// Whether each byte is in a field: the frame ends with one of them.
    fn has_length_of(&self, frame: &[u8]) -> bool {
        let appended = self.layout.trailer().map_or(0, |it| it.bytes_after(frame));
        let length = self.layout.counted_length(frame);
        let end = length.saturating_sub(appended + self.from_end);
        let ends_there = |field: &Field| match (field.length(), field.end(0)) {
            (None, _) => true,
            (_, Some(field_end)) if self.has_truncated_zeros => end <= field_end,
            (_, field_end) => field_end == Some(end),
        };
        self.fields
            .iter()
            .any(|field| !field.is_appended && ends_there(field))
    }

    /// Returns the fields whose values differ between frames.
    pub fn varying_fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| field.constant.is_none())
    }

    /// The fields that frames differ in, and what they are in a frame that is long enough to have them.
    pub fn shown<'f>(&'f self, frame: &'f [u8]) -> impl Iterator<Item = (&'f Field, Content<'f>)> {
        let fields = self.varying_fields();
        fields.filter_map(move |field| Some((field, self.content(field, frame)?)))
    }
}

/// Returns the trailer of a frame, or the frame without it.
fn parted<'f>(frame: &'f [u8], trailer: &Trailer, is_appended: bool) -> &'f [u8] {
    let place = frame.len().saturating_sub(trailer.bytes_after(frame));
    let (alone, appended) = frame.split_at_checked(place).unwrap_or_default();
    if is_appended { appended } else { alone }
}

/// What a field is in a frame.
#[derive(Clone, Copy)]
pub struct Content<'f> {
    field: &'f Field,
    bytes: &'f [u8],
}

impl<'f> Content<'f> {
    /// The value, or the first of an array.
    #[inline]
    #[must_use]
    pub fn value(self) -> Value<'f> {
        self.field.value(self.bytes, 0)
    }

    /// The value, or each of an array.
    #[inline]
    pub fn values(self) -> impl Iterator<Item = Value<'f>> {
        self.field.read(self.bytes)
    }
}
