//! Encoding of ROS 2 messages: XCDR1, little endian, after a header of four bytes. Each number is
//! aligned to its own size, relative to the end of the header.

use twinrig_kernel::SimTime;

use crate::EPOCH;

/// Encapsulation header: plain CDR, little endian, no options.
pub(crate) const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Writer that appends values to a message.
#[derive(Debug)]
pub struct CdrWriter<'b> {
    bytes: &'b mut Vec<u8>,
}

impl<'b> CdrWriter<'b> {
    /// Starts a message in `bytes`, discarding their content.
    pub(crate) fn new(bytes: &'b mut Vec<u8>) -> Self {
        bytes.clear();
        bytes.extend(HEADER);
        Self { bytes }
    }

    /// Pads the message to a multiple of `size` and returns the offset of the next value.
    pub(crate) fn align(&mut self, size: usize) -> usize {
        let excess = (self.bytes.len() - HEADER.len()) % size;
        if excess > 0 {
            self.bytes.resize(self.bytes.len() + size - excess, 0);
        }
        self.bytes.len()
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(crate) fn bool(&mut self, value: bool) {
        self.u8(value.into());
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend(value.to_bits().to_le_bytes());
    }

    /// Appends an array of fixed length.
    pub(crate) fn f64s(&mut self, values: &[f64]) {
        for value in values {
            self.f64(*value);
        }
    }

    /// Appends the length of a sequence, which precedes its items.
    pub(crate) fn count(&mut self, count: usize) {
        self.u32(u32::try_from(count).unwrap_or(u32::MAX));
    }

    /// Appends a string with its length and terminating zero.
    pub(crate) fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.u8(0);
    }

    /// Appends a sequence of bytes.
    pub(crate) fn octets(&mut self, octets: &[u8]) {
        self.count(octets.len());
        self.bytes.extend(octets);
    }

    /// Appends a `builtin_interfaces/Time` as returned by [`stamp`] and returns its offset.
    pub(crate) fn stamp(&mut self, stamp: [u8; 8]) -> usize {
        let offset = self.align(4);
        self.bytes.extend(stamp);
        offset
    }
}

/// Message of fixed layout whose numbers are overwritten in offset.
#[derive(Debug, Clone, Default)]
pub(crate) struct Template {
    pub bytes: Vec<u8>,
}

impl Template {
    #[inline]
    pub(crate) fn put(&mut self, offset: usize, value: f64) {
        self.bytes[offset..offset + 8].copy_from_slice(&value.to_bits().to_le_bytes());
    }

    #[inline]
    pub(crate) fn put_all(&mut self, offset: usize, values: &[f64]) {
        for (n, value) in values.iter().enumerate() {
            self.put(offset + 8 * n, *value);
        }
    }

    #[inline]
    pub(crate) fn put_stamp(&mut self, offset: usize, stamp: [u8; 8]) {
        self.bytes[offset..offset + 8].copy_from_slice(&stamp);
    }
}

/// Converts `now` to a `builtin_interfaces/Time` (seconds, nanoseconds) on the time line of
/// recordings. The seconds are signed 32-bit and saturate for runs of more than 68 years.
pub(crate) fn stamp(now: SimTime) -> [u8; 8] {
    let nanos = now.as_nanos().saturating_add(EPOCH.as_nanos());
    let seconds = i32::try_from(nanos / 1_000_000_000).unwrap_or(i32::MAX);
    let rest = u32::try_from(nanos % 1_000_000_000).unwrap_or_default();
    let ([a, b, c, d], [e, f, g, h]) = (seconds.to_le_bytes(), rest.to_le_bytes());
    [a, b, c, d, e, f, g, h]
}

/// Reader of successive values of a message; `None` past its end and for a value invalid for its
/// type.
#[derive(Debug, Clone)]
pub struct CdrReader<'m> {
    message: &'m [u8],
    position: usize,
}

impl<'m> CdrReader<'m> {
    /// Creates a reader of `message`; `None` if its header is another.
    pub(crate) fn new(message: &'m [u8]) -> Option<Self> {
        let message = message.strip_prefix(&HEADER)?;
        Some(Self {
            message,
            position: 0,
        })
    }

    fn take(&mut self, count: usize, size: usize) -> Option<&'m [u8]> {
        let start = self.position.next_multiple_of(size);
        let end = start.checked_add(count)?;
        let taken = self.message.get(start..end)?;
        self.position = end;
        Some(taken)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.take(1, 1)?.first().copied()
    }

    pub(crate) fn bool(&mut self) -> Option<bool> {
        match self.u8()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        let bytes = self.take(4, 4)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    }

    pub(crate) fn f64(&mut self) -> Option<f64> {
        let bytes = self.take(8, 8)?.first_chunk()?;
        Some(f64::from_bits(u64::from_le_bytes(*bytes)))
    }

    pub(crate) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    pub(crate) fn text(&mut self) -> Option<String> {
        let count = usize::try_from(self.u32()?).ok()?;
        let (end, text) = self.take(count, 1)?.split_last()?;
        (*end == 0).then_some(())?;
        String::from_utf8(text.to_vec()).ok()
    }

    pub(crate) fn octets(&mut self) -> Option<&'m [u8]> {
        let count = usize::try_from(self.u32()?).ok()?;
        self.take(count, 1)
    }

    /// Reads a sequence whose items are read by `read`.
    pub(crate) fn each<T>(&mut self, read: impl Fn(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let count = self.u32()?;
        // A wrong count is limited by the end of the message: no capacity is reserved for it.
        (0..count).map(|_| read(self)).collect()
    }

    /// Reads a `builtin_interfaces/Time`.
    pub(crate) fn time(&mut self) -> Option<[u32; 2]> {
        Some([self.u32()?, self.u32()?])
    }

    /// Whether the end of the message is reached.
    pub(crate) fn is_at_end(&self) -> bool {
        self.position == self.message.len()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone, PartialEq)]
    enum Value {
        Byte(u8),
        Bool(bool),
        Count(u32),
        Number(f64),
        Text(String),
        Octets(Vec<u8>),
        Numbers([f64; 3]),
    }

    fn value() -> impl Strategy<Value = Value> {
        let number = any::<f64>().prop_filter("a NaN is not equal to itself", |x| !x.is_nan());
        prop_oneof![
            any::<u8>().prop_map(Value::Byte),
            any::<bool>().prop_map(Value::Bool),
            any::<u32>().prop_map(Value::Count),
            number.prop_map(Value::Number),
            "\\PC{0,9}".prop_map(Value::Text),
            prop::collection::vec(any::<u8>(), 0..9).prop_map(Value::Octets),
            prop::array::uniform3(-9.0..9.0).prop_map(Value::Numbers),
        ]
    }

    proptest! {
        #[test]
        fn written_values_round_trip(values in prop::collection::vec(value(), 0..20)) {
            let mut bytes = vec![7; 3];
            let mut writer = CdrWriter::new(&mut bytes);
            for value in &values {
                match value {
                    Value::Byte(value) => writer.u8(*value),
                    Value::Bool(value) => writer.bool(*value),
                    Value::Count(value) => writer.u32(*value),
                    Value::Number(value) => writer.f64(*value),
                    Value::Text(text) => writer.text(text),
                    Value::Octets(octets) => writer.octets(octets),
                    Value::Numbers(numbers) => writer.f64s(numbers),
                }
            }
            let mut reader = CdrReader::new(&bytes).unwrap();
            for value in &values {
                let read = match value {
                    Value::Byte(_) => reader.u8().map(Value::Byte),
                    Value::Bool(_) => reader.bool().map(Value::Bool),
                    Value::Count(_) => reader.u32().map(Value::Count),
                    Value::Number(_) => reader.f64().map(Value::Number),
                    Value::Text(_) => reader.text().map(Value::Text),
                    Value::Octets(_) => reader.octets().map(|o| Value::Octets(o.to_vec())),
                    Value::Numbers(_) => reader.f64s().map(Value::Numbers),
                };
                prop_assert_eq!(read.as_ref(), Some(value));
            }
            prop_assert!(reader.is_at_end());
        }

        #[test]
        fn arbitrary_messages_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            let message = [&HEADER[..], &bytes].concat();
            let mut reader = CdrReader::new(&message).unwrap();
            let _ = reader.each(|reader| Some((reader.text()?, reader.f64()?, reader.bool()?)));
            let _ = (reader.octets(), reader.time(), reader.f64s::<3>());
        }
    }

    #[test]
    fn numbers_are_aligned_relative_to_the_header_end() {
        let mut bytes = Vec::new();
        let mut writer = CdrWriter::new(&mut bytes);
        writer.u8(1);
        writer.f64(1.0);
        writer.u8(2);
        writer.u32(3);
        assert_eq!(bytes[4..12], [1, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(bytes[12..20], 1.0_f64.to_bits().to_le_bytes());
        assert_eq!(bytes[20..], [2, 0, 0, 0, 3, 0, 0, 0]);
    }

    #[test]
    fn seconds_saturate_at_the_end_of_their_range() {
        let century = SimTime::from_nanos(100 * 31_557_600 * 1_000_000_000);
        assert_eq!(stamp(century)[..4], i32::MAX.to_le_bytes());
        assert_eq!(stamp(SimTime::from_nanos(5)), [1, 0, 0, 0, 5, 0, 0, 0]);
    }
}
