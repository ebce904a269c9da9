//! Projections onto the motions that constraints allow.

use crate::{LinsolveError, Real};

/// Orthogonal projector `S` onto the allowed changes of the unknowns.
///
/// `S² = S = Sᵀ`. What it removes is *prescribed*: a solver leaves that part
/// of its starting vector as it is.
pub trait Filter<T: Real>: Sync {
    /// `v ← S v`.
    fn project(&self, v: &mut [T]);

    /// The same projector as blocks on the points, where it has that form.
    fn as_blocks(&self) -> Option<&BlockFilter> {
        None
    }

    /// Whether `S` is the identity.
    fn is_identity(&self) -> bool {
        false
    }
}

/// No constraint.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoFilter;

impl<T: Real> Filter<T> for NoFilter {
    fn project(&self, _: &mut [T]) {}

    fn is_identity(&self) -> bool {
        true
    }
}

/// Directions closer than this (sine of the angle to the span of the earlier
/// ones) count as repeated: the value they prescribe could not be resolved.
const INDEPENDENT: f64 = 1e-6;

/// One projector per constrained point: pins, planes, lines.
///
/// ```text
/// S_i = 0  (fixed),   d dᵀ  (line),   I − n nᵀ  (plane),   I  (free)      [BaraffWitkin1998, § 5.1]
/// ```
/// Constraints on one point accumulate in any order; the removed directions
/// are orthonormalised, so `S_i² = S_i` to rounding also when they overlap.
/// Each direction carries the value it prescribes. Scalar unknowns pass unless
/// they are fixed at zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BlockFilter {
    constraints: Vec<Constraint>,
    /// Fixed scalars by their place in the vector, ascending.
    scalars: Vec<u32>,
}

#[derive(Debug, Clone, PartialEq)]
struct Constraint {
    point: u32,
    rank: u8,
    /// Orthonormal removed directions.
    basis: [[f64; 3]; 3],
    projector: [f64; 9],
    value: [f64; 3],
}

impl BlockFilter {
    /// No constraint yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Prescribes all three components of a point.
    ///
    /// Returns how far earlier constraints contradict it, in the unit of `value`.
    ///
    /// # Errors
    /// [`LinsolveError::BadConstraint`] for a value that is not finite.
    pub fn fix(&mut self, point: u32, value: [f64; 3]) -> Result<f64, LinsolveError> {
        let mut worst = 0.0f64;
        for k in 0..3 {
            let mut n = [0.0; 3];
            n[k] = 1.0;
            worst = worst.max(self.constrain(point, n, value[k])?);
        }
        Ok(worst)
    }

    /// Lets a point move along `direction` only; the components across are zero.
    ///
    /// # Errors
    /// As [`constrain`](Self::constrain).
    pub fn line(&mut self, point: u32, direction: [f64; 3]) -> Result<f64, LinsolveError> {
        let d = unit(point, direction)?;
        // the axis least along d gives a well-conditioned pair across it
        let k = (0..3).fold(0, |m, k| if d[k].abs() < d[m].abs() { k } else { m });
        let mut e = [0.0; 3];
        e[k] = 1.0;
        let a = cross(d, e);
        let b = cross(d, a);
        Ok(self
            .constrain(point, a, 0.0)?
            .max(self.constrain(point, b, 0.0)?))
    }

    /// Prescribes the component of a point along `normal`: `n · x = value`,
    /// `n` the unit normal.
    ///
    /// Returns the contradiction with earlier constraints: 0 while the normals
    /// are independent, else the amount by which this one is violated; the
    /// earlier ones win.
    ///
    /// # Errors
    /// [`LinsolveError::BadConstraint`] when the normal has no direction or a
    /// number is not finite.
    pub fn constrain(
        &mut self,
        point: u32,
        normal: [f64; 3],
        value: f64,
    ) -> Result<f64, LinsolveError> {
        if !value.is_finite() {
            return Err(LinsolveError::BadConstraint {
                point: point as usize,
                reason: "the prescribed value is not finite",
            });
        }
        let n = unit(point, normal)?;
        let at = match self.constraints.binary_search_by_key(&point, |c| c.point) {
            Ok(at) => at,
            Err(at) => {
                self.constraints.insert(at, Constraint::free(point));
                at
            }
        };
        Ok(self.constraints[at].add(n, value))
    }

    /// Fixes a scalar unknown, given by its place in the vector, at zero.
    pub fn fix_scalar(&mut self, place: u32) {
        if let Err(at) = self.scalars.binary_search(&place) {
            self.scalars.insert(at, place);
        }
    }

    /// Places of the fixed scalars, ascending.
    pub fn fixed_scalars(&self) -> &[u32] {
        &self.scalars
    }

    /// Whether the unknown at a place of the vector is a fixed scalar.
    pub fn is_scalar_fixed(&self, place: u32) -> bool {
        self.scalars.binary_search(&place).is_ok()
    }

    /// Constrained points, ascending.
    pub fn points(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.constraints.iter().map(|c| c.point)
    }

    /// Number of constrained points.
    pub fn len(&self) -> usize {
        self.constraints.len()
    }

    /// Whether nothing is constrained.
    pub fn is_empty(&self) -> bool {
        self.constraints.is_empty() && self.scalars.is_empty()
    }

    /// Number of removed directions of a point, 0 to 3.
    pub fn rank(&self, point: u32) -> usize {
        self.find(point).map_or(0, |c| c.rank as usize)
    }

    /// Projector of a point, row-major; `None` when it is free.
    pub fn projector(&self, point: u32) -> Option<&[f64; 9]> {
        self.find(point).map(|c| &c.projector)
    }

    /// Constrained points with their projectors.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &[f64; 9])> + '_ {
        self.constraints
            .iter()
            .map(|c| (c.point as usize, &c.projector))
    }

    /// Overwrites the constrained part of `x` by the prescribed values; the
    /// allowed part stays.
    ///
    /// # Panics
    /// If `x` is shorter than the constrained points need.
    pub fn prescribe(&self, x: &mut [f64]) {
        Filter::<f64>::project(self, x);
        for c in &self.constraints {
            let x = &mut x[3 * c.point as usize..][..3];
            for k in 0..3 {
                x[k] += c.value[k];
            }
        }
    }

    fn find(&self, point: u32) -> Option<&Constraint> {
        let at = self.constraints.binary_search_by_key(&point, |c| c.point);
        at.ok().map(|at| &self.constraints[at])
    }
}

impl<T: Real> Filter<T> for BlockFilter {
    fn project(&self, v: &mut [T]) {
        for c in &self.constraints {
            let v = &mut v[3 * c.point as usize..][..3];
            if c.rank == 3 {
                v.fill(T::ZERO);
                continue;
            }
            let s = &c.projector;
            let w: [f64; 3] = std::array::from_fn(|k| v[k].to_f64());
            for r in 0..3 {
                v[r] = T::from_f64(s[3 * r] * w[0] + s[3 * r + 1] * w[1] + s[3 * r + 2] * w[2]);
            }
        }
        for &k in &self.scalars {
            v[k as usize] = T::ZERO;
        }
    }

    fn as_blocks(&self) -> Option<&BlockFilter> {
        Some(self)
    }

    fn is_identity(&self) -> bool {
        self.is_empty()
    }
}

impl Constraint {
    fn free(point: u32) -> Self {
        Self {
            point,
            rank: 0,
            basis: [[0.0; 3]; 3],
            projector: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            value: [0.0; 3],
        }
    }

    fn add(&mut self, n: [f64; 3], value: f64) -> f64 {
        let rank = self.rank as usize;
        let mut rest = n;
        for _ in 0..2 {
            // twice is enough for orthogonality to rounding
            for b in &self.basis[..rank] {
                let d = dot(*b, rest);
                rest = std::array::from_fn(|k| rest[k] - d * b[k]);
            }
        }
        let sine = dot(rest, rest).sqrt();
        let missing = value - dot(n, self.value);
        if rank == 3 || sine < INDEPENDENT {
            return missing.abs();
        }
        let mut p = rest.map(|v| v / sine);
        if rank == 2 {
            // the last direction, exactly across the others
            let c = cross(self.basis[0], self.basis[1]);
            let s = dot(c, p).signum() / dot(c, c).sqrt();
            p = c.map(|v| s * v);
        }
        self.basis[rank] = p;
        let lift = missing / dot(n, p);
        self.value = std::array::from_fn(|k| self.value[k] + lift * p[k]);
        self.rank += 1;
        self.projector = self.build();
        0.0
    }

    fn build(&self) -> [f64; 9] {
        let b = &self.basis;
        std::array::from_fn(|k| {
            let (r, c) = (k / 3, k % 3);
            let one = f64::from(u8::from(r == c));
            match self.rank {
                0 => one,
                1 => one - b[0][r] * b[0][c],
                2 => {
                    // d dᵀ, free of the cancellation of I − p pᵀ − q qᵀ
                    let d = cross(b[0], b[1]);
                    d[r] * d[c] / dot(d, d)
                }
                _ => 0.0,
            }
        })
    }
}

fn unit(point: u32, v: [f64; 3]) -> Result<[f64; 3], LinsolveError> {
    // scaled first: squares of tiny components must not vanish
    let top = v.iter().fold(0.0f64, |m, a| m.max(a.abs()));
    if !(v.iter().all(|a| a.is_finite()) && top > 0.0) {
        return Err(LinsolveError::BadConstraint {
            point: point as usize,
            reason: "the direction is zero or not finite",
        });
    }
    let v = v.map(|a| a / top);
    let length = dot(v, v).sqrt();
    Ok(v.map(|a| a / length))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
