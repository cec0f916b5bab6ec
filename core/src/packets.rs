//! The receiver of packets between delimiters. It undoes the byte stuffing when a byte arrives, and keeps the packet in
//! a buffer. The format sees only unstuffed bytes.

use core::cell::Cell;
use core::mem::replace;

use crate::parser::parser_by_own_functions;
use crate::stuffing::{Meaning, Unstuffing};
use crate::{
    Classification, DiscardReason, Found, Frame, LineEvent, PacketFormat, Parser, Stuffing,
};

#[cfg(kani)]
mod verification;

/// The receiver of packets between delimiters, such as those of SLIP, HDLC, COBS and DLE framing.
///
/// It consists of the format, a buffer `B`, and 4 words. `B` is an array (see [`new`](Self::new)), a borrowed slice, or
/// a `Vec` (see [`with_buffer`](Self::with_buffer)). The buffer must have at least
/// [`Format::LONGEST`](crate::Format::LONGEST) bytes. The receiver does not use more.
///
/// # The rule
///
/// A packet between two delimiters is delivered if the format accepts the whole packet, and if no line event lies
/// between the delimiters except a pause directly after the first one. Nothing else is delivered, except frames that
/// end by themselves: they need no second delimiter. The delimiter after a packet is also the delimiter before the next
/// packet. Several delimiters in a row are like one.
///
/// The price: **the very first packet needs a delimiter before it**, and so does the first packet after a line event. A
/// line event inside a packet costs this packet, but no other. Senders that write a delimiter before and after each
/// packet lose nothing else.
///
/// [`Stuffing::Doubled`] has a stronger rule, because otherwise a damaged end would hide the next packet's beginning.
/// Each packet that arrives whole is delivered, unless a delivered packet begins earlier and shares bytes with it.
///
/// # What to expect
///
/// * **Latency.** A packet is delivered with the delimiter after it, or with its last byte if it ends by itself. With
///   [`Stuffing::Break`], the break that follows the packet delivers it.
/// * **Counting.** All counts are of received bytes. [`Found::Frame`] also counts the delimiters before the packet, the
///   bytes that stuffing adds, and with `Doubled` the delimiter after the packet. [`Frame::bytes`] are the unstuffed
///   bytes. The delimiters before a packet stay [pending](Self::pending) until the packet is decided.
/// * **Cost.** Most calls of [`push`](Self::push) only store a byte. The receiver asks the format when the packet has
///   as many bytes as the format has asked for, and at the delimiter. With `Doubled`, a rejected packet may be
///   classified again, once for each pair of bytes that looks like a beginning. So in the worst case the last byte of a
///   packet of `n` bytes costs about `n / 2` classifications.
///
/// # Examples
/// SLIP. The packets have at most 64 bytes, and no checksum.
/// ```
/// use framelock::{
///     Classification, DiscardReason, Format, LineEvent, PacketFormat, PacketReceiver, Stuffing,
/// };
///
/// #[derive(Clone, Copy)]
/// struct Slip;
///
/// impl Format for Slip {
///     const LONGEST: usize = 65;
///     type Message<'a> = &'a [u8];
///
///     fn classify(&self, bytes: &[u8]) -> Classification {
///         if bytes.len() < Self::LONGEST {
///             Classification::Incomplete { at_least: Self::LONGEST }
///         } else {
///             Classification::Rejected(DiscardReason::TooLong)
///         }
///     }
///
///     fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
///         Classification::Frame(bytes.len())
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { frame }
/// }
///
/// impl PacketFormat for Slip {
///     fn stuffing(&self) -> Stuffing { Stuffing::SLIP }
/// }
///
/// let mut receiver = PacketReceiver::<_, [u8; 65]>::new(Slip);
/// let mut packets = Vec::new();
/// receiver.feed(b"tail of a packet\xC0one\xC0\xC0two \xDB\xDC\xC0th", |found| {
///     packets.extend(found.decoded().map(<[u8]>::to_vec));
/// });
/// assert_eq!(packets, [&b"one"[..], b"two \xC0"]);
/// // The delimiter before `th` is pending, too.
/// assert_eq!(receiver.pending(), 3);
/// ```
/// COBS, with an XOR of all bytes at the packet's end. In your format, `check` is usually a CRC.
/// ```
/// # use framelock::{
/// #     Classification, DiscardReason, Format, LineEvent, PacketFormat, PacketReceiver, Stuffing,
/// # };
/// #[derive(Clone, Copy)]
/// struct Checked;
///
/// fn check(bytes: &[u8]) -> u8 { bytes.iter().fold(0, |sum, byte| sum ^ byte) }
///
/// impl Format for Checked {
///     const LONGEST: usize = 65;
///     type Message<'a> = &'a [u8];
/// #   fn classify(&self, bytes: &[u8]) -> Classification {
/// #       if bytes.len() < Self::LONGEST {
/// #           Classification::Incomplete { at_least: Self::LONGEST }
/// #       } else {
/// #           Classification::Rejected(DiscardReason::TooLong)
/// #       }
/// #   }
///
///     fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
///         match bytes {
///             [content @ .., sum] if check(content) == *sum => Classification::Frame(bytes.len()),
///             _ => Classification::Rejected(DiscardReason::ChecksumMismatch),
///         }
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[..frame.len() - 1] }
///     // `classify` is the one of the example above.
/// }
///
/// impl PacketFormat for Checked {
///     fn stuffing(&self) -> Stuffing { Stuffing::Cobs }
/// }
///
/// let mut sent = [0; 16];
/// let packet = [b'a', 0, b'b', b'a' ^ b'b'];
/// let sent = Stuffing::Cobs.stuff(&packet, &mut sent).unwrap();
/// let mut receiver = PacketReceiver::<_, [u8; 65]>::new(Checked);
/// let mut frames = sent.iter().filter_map(|&byte| receiver.push(byte).map(|frame| frame.message().to_vec()));
/// assert_eq!(frames.next(), Some(b"a\0b".to_vec()));
/// ```
#[derive(Clone, Debug)]
pub struct PacketReceiver<F, B> {
    format: F,
    buffer: B,
    /// The packet's unstuffed bytes are `buffer[..length]`.
    length: usize,
    /// Until `length` reaches this number, the receiver asks the format only at a delimiter.
    ask_at: usize,
    /// The number of pending bytes, as received: delimiters, escape bytes, content. Outside a packet, an escape byte of
    /// DLE framing may be pending.
    pending: usize,
    /// Whether a packet has begun.
    is_open: bool,
    unstuffing: Unstuffing,
}

/// A packet that has just become a frame: the number of received bytes, and the number of unstuffed bytes.
type Whole = (usize, usize);

/// A function that is called with each run of discarded bytes.
trait Report: FnMut(usize, DiscardReason) {}
impl<T: FnMut(usize, DiscardReason)> Report for T {}

impl<F: PacketFormat, const N: usize> PacketReceiver<F, [u8; N]> {
    /// Creates a receiver that has an array as its buffer and has received nothing yet.
    ///
    /// An array shorter than [`Format::LONGEST`](crate::Format::LONGEST) does not compile.
    #[must_use]
    pub const fn new(format: F) -> Self {
        const {
            assert!(
                F::LONGEST >= 1 && F::LONGEST <= N,
                "the buffer must hold the longest packet: \
                 make N of PacketReceiver<F, [u8; N]> at least F::LONGEST, or LONGEST smaller"
            );
        }
        Self::empty(format, [0; N])
    }
}

impl<F, B> PacketReceiver<F, B> {
    const fn empty(format: F, buffer: B) -> Self {
        Self {
            format,
            buffer,
            length: 0,
            ask_at: 0,
            pending: 0,
            is_open: false,
            unstuffing: Unstuffing::NEW,
        }
    }
}

impl<F: PacketFormat, B: AsRef<[u8]> + AsMut<[u8]>> PacketReceiver<F, B> {
    /// Creates a receiver that keeps the packet in `buffer`: a borrowed slice, or a `Vec`.
    ///
    /// Returns `None` if the format's [`longest`](crate::Format::longest) is 0, or more than the buffer's length.
    #[must_use]
    pub fn with_buffer(format: F, buffer: B) -> Option<Self> {
        let longest = format.longest();
        (1 <= longest && longest <= buffer.as_ref().len()).then(|| Self::empty(format, buffer))
    }

    /// Takes the next byte of the stream. Returns the frame that this byte completes, if there is one.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Frame<'_, F>> {
        self.push_with(byte, |_| ())
    }

    /// Does the same as [`push`](Self::push), and reports each byte whose outcome is decided.
    #[inline]
    fn push_with(&mut self, byte: u8, mut account: impl FnMut(Found<()>)) -> Option<Frame<'_, F>> {
        let mut report = |count, why| account(Found::discarded(count, why));
        let (received, length) = self.take(byte, &mut report)?;
        account(Found::frame(received, ()));
        Some(self.frame(length))
    }

    /// Takes bytes from the front of the slice until a frame is delivered, and leaves the rest in the slice. Returns
    /// the frame. If no frame is delivered, takes the whole slice and returns `None`.
    ///
    /// Call this function until it returns `None`. By then it has returned the frames that [`feed`](Self::feed) would
    /// report, in the same order.
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Frame<'_, F>> {
        self.next_with(bytes, |_| ())
    }

    /// Does the same as [`next`](Self::next), and reports each byte whose outcome is decided.
    fn next_with(
        &mut self,
        bytes: &mut &[u8],
        mut account: impl FnMut(Found<()>),
    ) -> Option<Frame<'_, F>> {
        while let [byte, rest @ ..] = *bytes {
            *bytes = rest;
            let mut report = |count, why| account(Found::discarded(count, why));
            if let Some((received, length)) = self.take(*byte, &mut report) {
                account(Found::frame(received, ()));
                return Some(self.frame(length));
            }
        }
        None
    }

    /// Takes a slice. Reports the outcome of each byte, except the bytes that are pending at the end. The results do
    /// not depend on how a stream is cut into slices.
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<Frame<'_, F>>)) {
        for &byte in bytes {
            let mut report = |count, why| found(Found::discarded(count, why));
            if let Some((received, length)) = self.take(byte, &mut report) {
                found(Found::frame(received, self.frame(length)));
            }
        }
    }

    /// Takes a line event. Discards the pending bytes. Then the next packet needs a delimiter before it.
    ///
    /// There are two exceptions. Except in DLE framing, [`LineEvent::Idle`] directly after a delimiter changes nothing:
    /// the delimiter stays pending, and the next byte begins a packet. With [`Stuffing::Break`], [`LineEvent::Break`]
    /// is the delimiter. It delivers or rejects the packet before it.
    pub fn line_event(&mut self, event: LineEvent, mut found: impl FnMut(Found<Frame<'_, F>>)) {
        let stuffing = self.format.stuffing();
        let follows_delimiter = self.is_open
            && self.length == 0
            && self.unstuffing == Unstuffing::NEW
            && !matches!(stuffing, Stuffing::Doubled { .. });
        let mut report = |count, why| found(Found::discarded(count, why));
        if event == LineEvent::Break && stuffing == Stuffing::Break {
            if let Some((received, length)) = self.close(&mut report) {
                found(Found::frame(received, self.frame(length)));
            }
            self.open();
        } else if event != LineEvent::Idle || !follows_delimiter {
            self.discard_all_but(0, DiscardReason::LineEvent, &mut report);
        }
    }

    /// Returns the number of pending bytes, as received. Pending bytes are those of the packet that has begun, and the
    /// delimiters before it. In DLE framing, an escape byte outside packets is pending, too.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.pending
    }

    /// Forgets the pending bytes, as if the receiver had never received anything.
    pub const fn reset(&mut self) {
        (self.length, self.pending, self.is_open) = (0, 0, false);
    }

    /// Returns the format.
    #[must_use]
    pub const fn format(&self) -> &F {
        &self.format
    }

    /// Returns the frame that has just become whole.
    #[inline]
    fn frame(&self, length: usize) -> Frame<'_, F> {
        let bytes = self.buffer.as_ref().get(..length);
        Frame::new(self.format.clone(), bytes.unwrap_or_default())
    }

    /// Takes a byte. Returns the packet that this byte makes whole.
    #[inline]
    fn take(&mut self, byte: u8, report: &mut impl Report) -> Option<Whole> {
        if !self.is_open {
            self.take_outside(byte, report);
            return None;
        }
        match self.unstuffing.take(self.format.stuffing(), byte) {
            Meaning::Content(content) => return self.take_content(content, byte, report),
            Meaning::Prefix => self.pending = self.pending.wrapping_add(1),
            Meaning::Delimiter => {
                let whole = self.close(report);
                self.open();
                self.pending = self.pending.wrapping_add(1);
                return whole;
            }
            Meaning::End => {
                self.pending = self.pending.wrapping_add(1);
                let whole = self.close(report);
                // If the packet was empty, its bytes are still pending.
                self.discard_all_but(0, DiscardReason::BadHeader, report);
                return whole;
            }
            Meaning::Start => {
                // The escape byte is pending.
                self.discard_all_but(1, DiscardReason::BrokenStuffing, report);
                self.take_outside(byte, report);
            }
            Meaning::Broken => {
                self.pending = self.pending.wrapping_add(1);
                self.discard_all_but(0, DiscardReason::BrokenStuffing, report);
            }
        }
        None
    }

    /// Takes a byte outside packets.
    fn take_outside(&mut self, byte: u8, report: &mut impl Report) {
        let stuffing = self.format.stuffing();
        let follows_escape = self.pending > 0;
        self.pending = self.pending.wrapping_add(1);
        if stuffing.delimiter() == Some(byte) {
            self.open();
        } else if follows_escape && stuffing.begins_packet(byte) {
            self.open();
            if matches!(stuffing, Stuffing::Doubled { start: None, .. }) {
                self.store(byte);
            }
        } else {
            let kept = usize::from(stuffing.is_doubled(byte));
            self.discard_all_but(kept, DiscardReason::NoSync, report);
        }
    }

    /// Takes `content`, the next byte of the packet. `byte` is the last of the received bytes that stand for `content`.
    #[inline]
    fn take_content(&mut self, content: u8, byte: u8, report: &mut impl Report) -> Option<Whole> {
        let why = DiscardReason::TooLong;
        if self.length >= self.format.longest() && !self.go_on(why, report) {
            let last = self.buffer.as_ref().get(self.length.wrapping_sub(1));
            let is_escape = last.is_some_and(|&last| self.format.stuffing().is_doubled(last));
            self.discard_all_but(usize::from(is_escape), why, report);
            self.take_outside(byte, report);
            return None;
        }
        self.pending = self.pending.wrapping_add(1);
        self.store(content);
        if self.length < self.ask_at {
            return None;
        }
        self.ask(report)
    }

    /// Begins a packet.
    fn open(&mut self) {
        let ends_by_itself = !matches!(self.format.stuffing(), Stuffing::Doubled { .. });
        (self.length, self.is_open, self.unstuffing) = (0, true, Unstuffing::NEW);
        self.ask_at = if ends_by_itself { 1 } else { usize::MAX };
    }

    fn store(&mut self, content: u8) {
        if let Some(place) = self.buffer.as_mut().get_mut(self.length) {
            *place = content;
            self.length = self.length.wrapping_add(1);
        }
    }

    /// Asks the format whether the frame ends here by itself.
    #[inline(never)]
    fn ask(&mut self, report: &mut impl Report) -> Option<Whole> {
        let packet = self.buffer.as_ref().get(..self.length).unwrap_or_default();
        let seen = self.ask_at.saturating_sub(1);
        let classification = self.format.classify_after(packet, seen);
        if let Classification::Incomplete { at_least } = classification {
            self.ask_at = at_least;
            return None;
        }
        self.deliver(classification)
            .map_err(|why| self.discard_all_but(0, why, report))
            .ok()
    }

    /// Ends the packet: delivers a frame, or discards the packet. Does nothing if a complete packet has no bytes.
    #[inline(never)]
    fn close(&mut self, report: &mut impl Report) -> Option<Whole> {
        let mut why = DiscardReason::BrokenStuffing;
        if self.unstuffing.is_complete() {
            loop {
                let packet = self.buffer.as_ref().get(..self.length).unwrap_or_default();
                if packet.is_empty() {
                    return None;
                }
                let classification = match self.format.classify(packet) {
                    Classification::Incomplete { .. } => {
                        self.format.classify_before(packet, LineEvent::Idle)
                    }
                    decided => decided,
                };
                match self.deliver(classification) {
                    Ok(whole) => return Some(whole),
                    Err(reason) => why = reason,
                }
                if !self.go_on(why, report) {
                    break;
                }
            }
        }
        self.discard_all_but(0, why, report);
        None
    }

    /// Ends the packet if this classification makes it a frame. Otherwise returns the reason why the packet is not a
    /// frame. The frame stays in the buffer until the next byte.
    #[inline]
    fn deliver(&mut self, classification: Classification) -> Result<Whole, DiscardReason> {
        match classification {
            Classification::Frame(length) if length == self.length => {
                let received = self.pending;
                self.reset();
                Ok((received, length))
            }
            Classification::Frame(_) => Err(DiscardReason::BadHeader),
            Classification::Rejected(why) if why != DiscardReason::LineEvent => Err(why),
            // The delimiter has come before the end of the frame.
            _ => Err(DiscardReason::BrokenStuffing),
        }
    }

    /// Discards the pending bytes for this reason, except the last `kept` bytes. Ends the packet.
    fn discard_all_but(&mut self, kept: usize, why: DiscardReason, report: &mut impl Report) {
        let count = self.pending.wrapping_sub(kept);
        if count > 0 {
            report(count, why);
        }
        self.reset();
        self.pending = kept;
    }

    /// Goes on with the next packet inside a rejected packet of DLE framing. A packet with a damaged end may contain
    /// the next packet's beginning: an escape byte and a start code. If it does not, returns false and changes nothing.
    fn go_on(&mut self, why: DiscardReason, report: &mut impl Report) -> bool {
        let stuffing = self.format.stuffing();
        let Stuffing::Doubled { start, .. } = stuffing else {
            return false;
        };
        let places = Cell::from_mut(self.buffer.as_mut()).as_slice_of_cells();
        let packet = places.get(..self.length).unwrap_or_default();
        let mut follows_escape = false;
        let begins = |place: &Cell<u8>| {
            let byte = place.get();
            replace(&mut follows_escape, stuffing.is_doubled(byte)) && stuffing.begins_packet(byte)
        };
        let Some(code) = packet.iter().position(begins) else {
            return false;
        };
        // Count the received bytes before the new beginning: the old beginning, and the content before `code`, in which
        // an escape byte counts twice. The last escape byte counts once, because its copy belongs to the new beginning.
        let start_length = usize::from(start.is_some());
        let before = packet.iter().take(code);
        let doubled = before.filter(|place| stuffing.is_doubled(place.get()));
        let count = start_length
            .wrapping_add(code)
            .wrapping_add(doubled.count());
        report(count, why);
        self.pending = self.pending.wrapping_sub(count);
        let rest = packet.get(code.wrapping_add(start_length)..);
        let rest = rest.unwrap_or_default();
        for (place, byte) in places.iter().zip(rest) {
            place.set(byte.get());
        }
        self.length = rest.len();
        true
    }
}

impl<F: PacketFormat, B: AsRef<[u8]> + AsMut<[u8]>> Parser for PacketReceiver<F, B> {
    type Message<'a>
        = Frame<'a, F>
    where
        Self: 'a;

    parser_by_own_functions!(Frame<'_, F>);
}
