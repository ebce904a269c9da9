//! Positions in 16 bits a coordinate, and base64.
//!
//! ```text
//! c ≈ min + step · u,   u in 0..=65534,   step = (max − min) / 65534
//! ```
//! per frame and axis: the error is at most half a step, 8 µm for a metre.
//! `u = 65535` marks a point that is missing or not finite. Strays far outside the
//! rest are moved to the limits of [`stray_limits`], where they do not cost the
//! rest its resolution.

use super::camera::{drawable, stray_limits};
use super::data::Point;

/// Mark of a missing point.
const MISSING: u16 = u16::MAX;

/// A frame's points as they are embedded.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quantised {
    pub min: [f32; 3],
    pub step: [f32; 3],
    /// x, y, z of each point.
    pub words: Vec<u16>,
}

impl Quantised {
    /// Encodes exactly `count` points; those beyond the end are missing.
    pub fn new(points: &[Point], count: usize) -> Self {
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let known = &points[..points.len().min(count)];
        let limits = stray_limits(known, 8.0).unwrap_or_default();
        for p in known.iter().filter(|p| drawable(p)) {
            for k in 0..3 {
                let c = p[k].clamp(limits[k].0, limits[k].1);
                (min[k], max[k]) = (min[k].min(c), max[k].max(c));
            }
        }
        if min[0] > max[0] {
            (min, max) = ([0.0; 3], [0.0; 3]);
        }
        let step: [f32; 3] = std::array::from_fn(|k| (max[k] - min[k]) / f32::from(MISSING - 1));
        let mut words = Vec::with_capacity(3 * count);
        for i in 0..count {
            match points.get(i).filter(|p| drawable(p)) {
                Some(p) => words.extend((0..3).map(|k| {
                    if step[k] > 0.0 {
                        let u = (f64::from(p[k]) - f64::from(min[k])) / f64::from(step[k]);
                        u.round().clamp(0.0, f64::from(MISSING - 1)) as u16
                    } else {
                        0
                    }
                })),
                None => words.extend([MISSING; 3]),
            }
        }
        Self { min, step, words }
    }

    /// Little-endian bytes in base64.
    pub fn base64(&self) -> String {
        base64(self.words.iter().flat_map(|w| w.to_le_bytes()))
    }
}

/// Length of the base64 text of `bytes` bytes.
pub(super) fn base64_len(bytes: usize) -> usize {
    bytes.div_ceil(3) * 4
}

/// Standard base64 with padding (RFC 4648, section 4).
pub(super) fn base64(bytes: impl IntoIterator<Item = u8>) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = bytes.into_iter();
    let mut out = String::with_capacity(base64_len(bytes.size_hint().0));
    while let Some(a) = bytes.next() {
        let (b, c) = (bytes.next(), bytes.next());
        let group = u32::from(a) << 16 | u32::from(b.unwrap_or(0)) << 8 | u32::from(c.unwrap_or(0));
        let digit = |shift: u32| char::from(DIGITS[(group >> shift & 63) as usize]);
        out.push(digit(18));
        out.push(digit(12));
        out.push(if b.is_some() { digit(6) } else { '=' });
        out.push(if c.is_some() { digit(0) } else { '=' });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decoded points are within half a step; missing ones are marked.
    #[test]
    fn round_trip() {
        let points: Vec<Point> = (0..500)
            .map(|i| {
                let a = i as f32 * 0.37;
                [a.sin(), 2.0 + a.cos() * 0.3, a * 1e-2]
            })
            .chain([[f32::NAN, 0.0, 0.0], [0.0, 1e30, 0.0]])
            .collect();
        let q = Quantised::new(&points, points.len() + 1);
        assert_eq!(q.words.len(), 3 * (points.len() + 1));
        for (i, p) in points.iter().enumerate().take(500) {
            for k in 0..3 {
                let back = q.min[k] + q.step[k] * f32::from(q.words[3 * i + k]);
                assert!((back - p[k]).abs() <= 0.51 * q.step[k] + 3e-7, "{i} {k}");
            }
        }
        assert!(q.words[1500..].iter().all(|&w| w == MISSING));
    }

    /// A point thrown far away leaves the others their resolution.
    #[test]
    fn strays_cost_nothing() {
        let mut points: Vec<Point> = (0..400).map(|i| [i as f32 * 2.5e-3, 0.0, 1.0]).collect();
        points.push([9e5, -9e5, 2.0]);
        let q = Quantised::new(&points, points.len());
        for (i, p) in points.iter().enumerate().take(400) {
            let back = q.min[0] + q.step[0] * f32::from(q.words[3 * i]);
            assert!((back - p[0]).abs() < 1e-4, "{back} {}", p[0]);
        }
        assert_eq!(q.words[1200], 65_534);
    }

    /// A single point, a flat frame and an empty frame are exact.
    #[test]
    fn degenerate_boxes() {
        let q = Quantised::new(&[[1.5, -2.0, 3.0]], 1);
        assert_eq!((q.min, q.words), ([1.5, -2.0, 3.0], vec![0, 0, 0]));
        let q = Quantised::new(&[[f32::NAN; 3]], 1);
        assert_eq!((q.min, q.words), ([0.0; 3], vec![MISSING; 3]));
        assert!(Quantised::new(&[], 0).words.is_empty());
    }

    /// Test vectors of RFC 4648, section 10.
    #[test]
    fn base64_vectors() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.bytes()), coded);
            assert_eq!(base64_len(plain.len()), coded.len());
        }
        assert_eq!(base64([0xfb, 0xff, 0xfe]), "+//+");
    }
}
