/// Axis-aligned box, closed on all sides \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lowest coordinates \[m\].
    pub min: [f64; 3],
    /// Highest coordinates \[m\].
    pub max: [f64; 3],
}

impl Aabb {
    /// The box that contains nothing: the neutral element of [`merge`](Self::merge).
    pub const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// The box of one point.
    #[inline]
    pub const fn of_point(p: [f64; 3]) -> Self {
        Self { min: p, max: p }
    }

    /// The smallest box around some points; a NaN coordinate is skipped.
    #[inline]
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a [f64; 3]>) -> Self {
        let mut b = Self::EMPTY;
        for p in points {
            b.include(*p);
        }
        b
    }

    /// Grows to contain a point; a NaN coordinate is skipped.
    #[inline]
    pub fn include(&mut self, p: [f64; 3]) {
        for i in 0..3 {
            self.min[i] = self.min[i].min(p[i]);
            self.max[i] = self.max[i].max(p[i]);
        }
    }

    /// The smallest box around two boxes.
    #[inline]
    #[must_use]
    pub fn merge(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|i| self.min[i].min(other.min[i])),
            max: std::array::from_fn(|i| self.max[i].max(other.max[i])),
        }
    }

    /// The box grown by `by` \[m\] on every side.
    #[inline]
    #[must_use]
    pub fn inflate(&self, by: f64) -> Self {
        Self {
            min: self.min.map(|m| m - by),
            max: self.max.map(|m| m + by),
        }
    }

    /// Whether two boxes share a point; touching counts.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|i| self.min[i] <= other.max[i] && other.min[i] <= self.max[i])
    }

    /// Whether a point lies in the box.
    #[inline]
    pub fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|i| self.min[i] <= p[i] && p[i] <= self.max[i])
    }

    /// Whether no point lies in the box.
    #[inline]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|i| self.min[i] > self.max[i])
    }

    /// Whether all coordinates are finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        (0..3).all(|i| self.min[i].is_finite() && self.max[i].is_finite())
    }

    /// Edge lengths \[m\]; negative for an empty box.
    #[inline]
    pub fn extents(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.max[i] - self.min[i])
    }

    /// Centre \[m\].
    #[inline]
    pub fn center(&self) -> [f64; 3] {
        std::array::from_fn(|i| 0.5 * (self.min[i] + self.max[i]))
    }

    /// Half of the surface area \[m²\], 0 for an empty box.
    #[inline]
    pub fn half_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let [x, y, z] = self.extents();
        x * y + y * z + z * x
    }
}

#[cfg(test)]
mod tests {
    use super::Aabb;

    /// Touching boxes overlap, separated ones do not, the empty box never does.
    #[test]
    fn overlap_is_closed() {
        let a = Aabb {
            min: [0.0; 3],
            max: [1.0; 3],
        };
        let b = Aabb {
            min: [1.0, 0.0, 0.0],
            max: [2.0, 1.0, 1.0],
        };
        assert!(a.overlaps(&b) && b.overlaps(&a));
        assert!(!a.overlaps(&b.inflate(-1e-9)));
        assert!(!a.overlaps(&Aabb::EMPTY));
        assert_eq!(a.merge(&Aabb::EMPTY), a);
        assert_eq!(a.half_area(), 3.0);
        assert_eq!(Aabb::EMPTY.half_area(), 0.0);
    }
}
