//! Arrays that derivatives are added to.

use selvedge_linsolve::{Real, SharedValues};

/// Where the scatter of an assembly goes.
pub(crate) trait Sink<T: Real> {
    /// Adds `scale · block` (given as rows) to a slot of a matrix.
    fn add_block(&mut self, slot: usize, block: &[[f64; 3]; 3], scale: f64);
    /// The same of a block given as columns.
    fn add_columns(&mut self, slot: usize, columns: &[f64; 9], scale: f64);
    /// Adds `scale · v` to the three unknowns of a point.
    fn add_point(&mut self, point: usize, v: &[f64; 3], scale: f64);
    /// Adds `scale · v` to a single entry.
    fn add_value(&mut self, place: usize, v: f64, scale: f64);
}

/// An array with one writer.
///
/// The sums are those of [`Shared`] without atomics to the bit, but the compiler
/// may add several numbers by one instruction, which it may not with atomics.
pub(crate) struct Plain<'a, T>(pub &'a mut [T]);

impl<T: Real> Sink<T> for Plain<'_, T> {
    #[inline(always)]
    fn add_block(&mut self, slot: usize, block: &[[f64; 3]; 3], scale: f64) {
        if let Some(out) = self.0.as_chunks_mut::<9>().0.get_mut(slot) {
            for c in 0..3 {
                for r in 0..3 {
                    out[3 * c + r] += T::from_f64(scale * block[r][c]);
                }
            }
        }
    }

    #[inline(always)]
    fn add_columns(&mut self, slot: usize, columns: &[f64; 9], scale: f64) {
        if let Some(out) = self.0.as_chunks_mut::<9>().0.get_mut(slot) {
            for k in 0..9 {
                out[k] += T::from_f64(scale * columns[k]);
            }
        }
    }

    #[inline(always)]
    fn add_point(&mut self, point: usize, v: &[f64; 3], scale: f64) {
        if let Some(out) = self.0.as_chunks_mut::<3>().0.get_mut(point) {
            for k in 0..3 {
                out[k] += T::from_f64(scale * v[k]);
            }
        }
    }

    #[inline(always)]
    fn add_value(&mut self, place: usize, v: f64, scale: f64) {
        if let Some(out) = self.0.get_mut(place) {
            *out += T::from_f64(scale * v);
        }
    }
}

/// An array that several threads write to.
#[derive(Clone)]
pub(crate) struct Shared<'a, T: Real> {
    values: SharedValues<'a, T>,
    atomic: bool,
}

impl<'a, T: Real> Shared<'a, T> {
    /// With `atomic` false, no two threads may add to one place at a time.
    pub fn new(values: &'a mut [T], atomic: bool) -> Self {
        let values = SharedValues::new(values);
        Self { values, atomic }
    }
}

impl<T: Real> Sink<T> for Shared<'_, T> {
    #[inline(always)]
    fn add_block(&mut self, slot: usize, block: &[[f64; 3]; 3], scale: f64) {
        if self.atomic {
            self.values.add_block_atomic(slot, block, scale);
        } else {
            self.values.add_block(slot, block, scale);
        }
    }

    #[inline(always)]
    fn add_columns(&mut self, slot: usize, columns: &[f64; 9], scale: f64) {
        if self.atomic {
            self.values.add_columns_atomic(slot, columns, scale);
        } else {
            self.values.add_columns(slot, columns, scale);
        }
    }

    #[inline(always)]
    fn add_point(&mut self, point: usize, v: &[f64; 3], scale: f64) {
        if self.atomic {
            self.values.add_point_atomic(point, v, scale);
        } else {
            self.values.add_point(point, v, scale);
        }
    }

    #[inline(always)]
    fn add_value(&mut self, place: usize, v: f64, scale: f64) {
        if self.atomic {
            self.values.add_value_atomic(place, v, scale);
        } else {
            self.values.add_value(place, v, scale);
        }
    }
}
