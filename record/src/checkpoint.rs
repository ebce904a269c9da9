use crate::RecordError;
use crate::wire::{Encoder, Fields, Malformed};

/// State from which a run continues bit for bit.
///
/// The sections are up to the caller: unknowns, rates, the history of every
/// term and contact source, the state of the step control. Every bit is kept,
/// also of NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Simulated time \[s\].
    pub time: f64,
    /// Number of accepted steps.
    pub step: u64,
    /// Named arrays.
    pub sections: Vec<(String, Vec<f64>)>,
}

impl Checkpoint {
    /// A section.
    pub fn section(&self, name: &str) -> Option<&[f64]> {
        self.sections.iter().find(|s| s.0 == name).map(|s| &s.1[..])
    }

    /// A section of known length.
    ///
    /// # Errors
    /// [`RecordError::Section`] when it is absent or of another length.
    pub fn require(&self, name: &str, length: usize) -> Result<&[f64], RecordError> {
        self.section(name)
            .filter(|s| s.len() == length)
            .ok_or_else(|| RecordError::Section {
                time: self.time,
                name: name.into(),
                expected: length,
            })
    }

    /// Digest of time, step and every bit of every section, in hexadecimal.
    pub fn digest(&self) -> String {
        let mut bytes = Vec::new();
        self.encode_body(&mut bytes);
        blake3::hash(&bytes).to_hex().to_string()
    }

    fn encode_body(&self, bytes: &mut Vec<u8>) {
        let mut e = Encoder(bytes);
        e.double(1, self.time);
        e.uint(2, self.step);
        for (name, values) in &self.sections {
            e.message(3, |e| {
                e.string(1, name);
                e.doubles(2, values.iter().copied());
            });
        }
    }

    pub(crate) fn encode(&self, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        self.encode_body(bytes);
        let digest = blake3::hash(&bytes[start..]);
        Encoder(bytes).bytes(4, digest.as_bytes());
    }

    /// Refuses a checkpoint whose digest does not fit.
    pub(crate) fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let mut checkpoint = Self::default();
        let mut digest = None;
        for field in Fields(bytes) {
            let (field, value) = field?;
            match field {
                1 => checkpoint.time = value.double()?,
                2 => checkpoint.step = value.uint()?,
                3 => {
                    let (mut name, mut values) = (String::new(), Vec::new());
                    for field in Fields(value.bytes()?) {
                        match field? {
                            (1, value) => name = value.string()?.into(),
                            (2, value) => value.doubles(&mut values)?,
                            _ => {}
                        }
                    }
                    checkpoint.sections.push((name, values));
                }
                4 => digest = Some(value.bytes()?),
                _ => {}
            }
        }
        let mut body = Vec::with_capacity(bytes.len());
        checkpoint.encode_body(&mut body);
        if digest == Some(blake3::hash(&body).as_bytes()) {
            Ok(checkpoint)
        } else {
            Err(Malformed)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verifies that every bit survives and that a flipped one is noticed.
    #[test]
    fn bit_exact() {
        let checkpoint = Checkpoint {
            time: -0.0,
            step: 3,
            sections: vec![
                (
                    "q".into(),
                    vec![f64::from_bits(0x7ff8_0000_dead_beef), 5e-324, -0.0],
                ),
                ("empty".into(), vec![]),
            ],
        };
        let mut bytes = Vec::new();
        checkpoint.encode(&mut bytes);
        let back = Checkpoint::decode(&bytes).unwrap();
        assert_eq!(back.digest(), checkpoint.digest());
        assert_eq!(back.sections[0].1[0].to_bits(), 0x7ff8_0000_dead_beef);
        assert!(back.require("empty", 0).is_ok());
        assert!(back.require("q", 4).is_err());
        for i in 0..bytes.len() {
            let mut bad = bytes.clone();
            bad[i] ^= 4;
            assert!(Checkpoint::decode(&bad).is_err(), "byte {i}");
        }
    }
}
