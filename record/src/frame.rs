use crate::wire::{Encoder, Fields, Malformed};

/// State at one instant, every bit as it was recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Simulated time \[s\].
    pub time: f64,
    /// Number of accepted steps.
    pub step: u64,
    /// Unknowns: 3 coordinates a point \[m\], then the scalars.
    pub positions: Vec<f64>,
    /// Their rates.
    pub velocities: Vec<f64>,
}

impl Frame {
    pub(crate) fn encode(
        bytes: &mut Vec<u8>,
        points: usize,
        (time, step): (f64, u64),
        (positions, velocities): (&[f64], &[f64]),
    ) {
        let (x, s) = positions.split_at(3 * points);
        let (v, r) = velocities.split_at(3 * points);
        let mut e = Encoder(bytes);
        e.double(1, time);
        e.uint(2, step);
        e.doubles(3, x.iter().copied());
        e.doubles(4, v.iter().copied());
        e.doubles(5, s.iter().copied());
        e.doubles(6, r.iter().copied());
    }

    pub(crate) fn decode(bytes: &[u8], points: usize, scalars: usize) -> Result<Self, Malformed> {
        let mut frame = Self::default();
        for field in Fields(bytes) {
            let (field, value) = field?;
            match field {
                1 => frame.time = value.double()?,
                2 => frame.step = value.uint()?,
                // In this order on the wire, so the scalars end up behind.
                3 | 5 => value.doubles(&mut frame.positions)?,
                4 | 6 => value.doubles(&mut frame.velocities)?,
                _ => {}
            }
        }
        let dim = 3 * points + scalars;
        if frame.positions.len() == dim && frame.velocities.len() == dim {
            Ok(frame)
        } else {
            Err(Malformed)
        }
    }

    /// Time and step, after a look at the lengths of the arrays.
    pub(crate) fn check(
        bytes: &[u8],
        points: usize,
        scalars: usize,
    ) -> Result<(f64, u64), Malformed> {
        let (mut time, mut step, mut lengths) = (None, None, [0; 4]);
        for field in Fields(bytes) {
            match field? {
                (1, value) => time = Some(value.double()?),
                (2, value) => step = Some(value.uint()?),
                (field @ 3..=6, value) => lengths[field as usize - 3] += value.bytes()?.len(),
                _ => {}
            }
        }
        if lengths != [3 * points, 3 * points, scalars, scalars].map(|n| 8 * n) {
            return Err(Malformed);
        }
        time.zip(step).ok_or(Malformed)
    }
}
