//! The last shape of a run as a file, every bit.

use selvedge_record::Surface;

/// Points and triangles in the scene's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Coordinates, three a point \[m\].
    pub positions: Vec<f64>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
}

const MAGIC: &[u8; 8] = b"svshape1";

impl Shape {
    /// As a surface to compare.
    pub fn surface(&self) -> Surface<'_> {
        Surface {
            positions: &self.positions,
            points: self.positions.len() / 3,
            triangles: &self.triangles,
            ..Surface::default()
        }
    }

    /// The contents of its file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        for n in [self.positions.len(), self.triangles.len()] {
            out.extend((n as u64).to_le_bytes());
        }
        out.extend(self.positions.iter().flat_map(|x| x.to_le_bytes()));
        let corners = self.triangles.as_flattened();
        out.extend(corners.iter().flat_map(|p| p.to_le_bytes()));
        out
    }

    /// Reads [`Self::to_bytes`]; `None` when they are not whole.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(MAGIC)?;
        let (head, rest) = rest.split_at_checked(16)?;
        let (counts, _) = head.as_chunks::<8>();
        let [points, triangles] = [0, 1].map(|i| u64::from_le_bytes(counts[i]) as usize);
        let (positions, corners) = rest.split_at_checked(points.checked_mul(8)?)?;
        if corners.len() != triangles.checked_mul(12)? {
            return None;
        }
        let (positions, _) = positions.as_chunks::<8>();
        let (corners, _) = corners.as_chunks::<4>();
        let corners: Vec<u32> = corners.iter().map(|c| u32::from_le_bytes(*c)).collect();
        Some(Self {
            positions: positions.iter().map(|x| f64::from_le_bytes(*x)).collect(),
            triangles: corners.as_chunks::<3>().0.to_vec(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every bit comes back; what is cut off is noticed.
    #[test]
    fn round_trip() {
        let shape = Shape {
            positions: vec![0.1, -0.0, 1e-300, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            triangles: vec![[0, 1, 2]],
        };
        let bytes = shape.to_bytes();
        assert_eq!(Shape::from_bytes(&bytes), Some(shape));
        for n in 0..bytes.len() {
            assert_eq!(Shape::from_bytes(&bytes[..n]), None);
        }
    }
}
