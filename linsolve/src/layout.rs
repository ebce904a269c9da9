//! How unknowns lie in a vector.

/// Points (3-vectors) first, then scalars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BlockLayout {
    /// Number of 3-vectors.
    pub points: usize,
    /// Number of scalar unknowns behind them.
    pub scalars: usize,
}

impl BlockLayout {
    /// A layout of points only.
    pub fn points(points: usize) -> Self {
        Self { points, scalars: 0 }
    }

    /// Number of unknowns, `3 points + scalars`.
    pub fn dim(&self) -> usize {
        3 * self.points + self.scalars
    }
}
