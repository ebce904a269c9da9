//! The part of the protocol-buffer wire format that our own messages need.
//!
//! Packed doubles are little-endian bytes in one piece, so a frame is written
//! with a copy, not value by value, and any reader of protocol buffers
//! understands it.

/// Field kinds on the wire.
const VARINT: u64 = 0;
const FIXED64: u64 = 1;
const LENGTH: u64 = 2;
const FIXED32: u64 = 5;

/// Appends fields to a buffer.
pub(crate) struct Encoder<'a>(pub &'a mut Vec<u8>);

impl Encoder<'_> {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn key(&mut self, field: u32, kind: u64) {
        self.varint(u64::from(field) << 3 | kind);
    }

    pub fn uint(&mut self, field: u32, value: u64) {
        self.key(field, VARINT);
        self.varint(value);
    }

    pub fn double(&mut self, field: u32, value: f64) {
        self.key(field, FIXED64);
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub fn bytes(&mut self, field: u32, value: &[u8]) {
        self.key(field, LENGTH);
        self.varint(value.len() as u64);
        self.0.extend_from_slice(value);
    }

    pub fn string(&mut self, field: u32, value: &str) {
        self.bytes(field, value.as_bytes());
    }

    pub fn doubles(&mut self, field: u32, values: impl ExactSizeIterator<Item = f64>) {
        if values.len() == 0 {
            return;
        }
        self.key(field, LENGTH);
        self.varint(8 * values.len() as u64);
        self.0.reserve(8 * values.len());
        for value in values {
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    pub fn fixed32s(&mut self, field: u32, values: impl ExactSizeIterator<Item = u32>) {
        if values.len() == 0 {
            return;
        }
        self.key(field, LENGTH);
        self.varint(4 * values.len() as u64);
        self.0.reserve(4 * values.len());
        for value in values {
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    pub fn message(&mut self, field: u32, write: impl FnOnce(&mut Encoder<'_>)) {
        let mut inner = Vec::new();
        write(&mut Encoder(&mut inner));
        self.bytes(field, &inner);
    }
}

/// One field of a message.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Value<'a> {
    Varint(u64),
    Fixed64(u64),
    /// Skipped: single ones of these are only in other people's messages.
    Fixed32,
    Bytes(&'a [u8]),
}

/// Iterates over the fields of a message; `Err` once and then the end when
/// the bytes are no message.
pub(crate) struct Fields<'a>(pub &'a [u8]);

/// The bytes are no message of the expected kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Malformed;

impl<'a> Fields<'a> {
    fn varint(&mut self) -> Result<u64, Malformed> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let (&byte, rest) = self.0.split_first().ok_or(Malformed)?;
            self.0 = rest;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(Malformed)
    }

    fn take(&mut self, count: u64) -> Result<&'a [u8], Malformed> {
        let count = usize::try_from(count).map_err(|_| Malformed)?;
        let (head, rest) = self.0.split_at_checked(count).ok_or(Malformed)?;
        self.0 = rest;
        Ok(head)
    }

    fn field(&mut self) -> Result<(u32, Value<'a>), Malformed> {
        let key = self.varint()?;
        let value = match key & 7 {
            VARINT => Value::Varint(self.varint()?),
            FIXED64 => Value::Fixed64(u64::from_le_bytes(
                self.take(8)?.try_into().map_err(|_| Malformed)?,
            )),
            FIXED32 => {
                self.take(4)?;
                Value::Fixed32
            }
            LENGTH => {
                let count = self.varint()?;
                Value::Bytes(self.take(count)?)
            }
            _ => return Err(Malformed),
        };
        Ok((u32::try_from(key >> 3).map_err(|_| Malformed)?, value))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u32, Value<'a>), Malformed>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let field = self.field();
        if field.is_err() {
            self.0 = &[];
        }
        Some(field)
    }
}

impl<'a> Value<'a> {
    pub fn uint(self) -> Result<u64, Malformed> {
        if let Value::Varint(value) = self {
            Ok(value)
        } else {
            Err(Malformed)
        }
    }

    pub fn double(self) -> Result<f64, Malformed> {
        if let Value::Fixed64(bits) = self {
            Ok(f64::from_bits(bits))
        } else {
            Err(Malformed)
        }
    }

    pub fn bytes(self) -> Result<&'a [u8], Malformed> {
        if let Value::Bytes(bytes) = self {
            Ok(bytes)
        } else {
            Err(Malformed)
        }
    }

    pub fn string(self) -> Result<&'a str, Malformed> {
        std::str::from_utf8(self.bytes()?).map_err(|_| Malformed)
    }

    pub fn doubles(self, out: &mut Vec<f64>) -> Result<(), Malformed> {
        let (values, rest) = self.bytes()?.as_chunks::<8>();
        if !rest.is_empty() {
            return Err(Malformed);
        }
        out.extend(values.iter().map(|v| f64::from_le_bytes(*v)));
        Ok(())
    }

    pub fn fixed32s(self, out: &mut Vec<u32>) -> Result<(), Malformed> {
        let (values, rest) = self.bytes()?.as_chunks::<4>();
        if !rest.is_empty() {
            return Err(Malformed);
        }
        out.extend(values.iter().map(|v| u32::from_le_bytes(*v)));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verifies that every kind of field comes back as written.
    #[test]
    fn round_trip() {
        let mut buffer = Vec::new();
        let mut e = Encoder(&mut buffer);
        e.uint(1, u64::MAX);
        e.double(2, -0.0);
        e.string(3, "grüß");
        e.doubles(4, [f64::NAN, 1.5].into_iter());
        e.fixed32s(5, [7, u32::MAX].into_iter());
        e.message(600, |e| e.uint(1, 300));
        let fields: Vec<_> = Fields(&buffer).map(|f| f.unwrap()).collect();
        assert_eq!(
            fields.iter().map(|f| f.0).collect::<Vec<_>>(),
            [1, 2, 3, 4, 5, 600]
        );
        assert_eq!(fields[0].1.uint(), Ok(u64::MAX));
        assert_eq!(
            fields[1].1.double().unwrap().to_bits(),
            (-0.0_f64).to_bits()
        );
        assert_eq!(fields[2].1.string(), Ok("grüß"));
        let mut doubles = Vec::new();
        fields[3].1.doubles(&mut doubles).unwrap();
        assert_eq!(doubles[0].to_bits(), f64::NAN.to_bits());
        let mut words = Vec::new();
        fields[4].1.fixed32s(&mut words).unwrap();
        assert_eq!(words, [7, u32::MAX]);
        let inner = Fields(fields[5].1.bytes().unwrap())
            .next()
            .unwrap()
            .unwrap();
        assert_eq!((inner.0, inner.1.uint()), (1, Ok(300)));
    }

    /// Verifies that a message cut anywhere inside its last field is refused.
    #[test]
    fn cut_is_an_error() {
        let mut buffer = Vec::new();
        Encoder(&mut buffer).doubles(4, [1.0, 2.0].into_iter());
        for end in 1..buffer.len() {
            assert!(Fields(&buffer[..end]).any(|f| f.is_err()), "{end}");
        }
    }
}
