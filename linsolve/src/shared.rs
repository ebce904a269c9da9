//! One value array, many writers.

use crate::Real;

/// A value array that several threads add to.
///
/// Two ways to add, to be chosen by who else writes at that moment:
///
/// * [`add_block`](Self::add_block), [`add_point`](Self::add_point),
///   [`add_value`](Self::add_value): the caller
///   guarantees that no other thread adds to the same slot (stencils of one
///   colour, see [`colour_chunks`](crate::colour_chunks)). A relaxed load, an
///   addition, a relaxed store: the instructions of a plain `+=`.
/// * `*_atomic`: any thread may add at any time; a compare-and-swap loop for
///   each number. The sum then depends on the order in which threads arrive.
///
/// Breaking the guarantee of the first loses additions; it is never undefined
/// behaviour, since the slots are atomics.
#[derive(Debug)]
pub struct SharedValues<'a, T: Real> {
    slots: &'a [T::Atomic],
}

impl<T: Real> Clone for SharedValues<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Real> Copy for SharedValues<'_, T> {}

impl<'a, T: Real> SharedValues<'a, T> {
    /// Shares an array: [`Bsr::values_mut`](crate::Bsr::values_mut) or a vector
    /// of forces.
    pub fn new(values: &'a mut [T]) -> Self {
        Self {
            slots: T::as_atomics(values),
        }
    }

    /// Adds `scale · block` (given as rows) to a slot of a [`Bsr`](crate::Bsr).
    ///
    /// # Panics
    /// If the slot does not exist; so do the others.
    #[inline]
    pub fn add_block(&self, slot: usize, block: &[[f64; 3]; 3], scale: f64) {
        let slots = &self.slots[9 * slot..9 * slot + 9];
        for c in 0..3 {
            for r in 0..3 {
                T::add_exclusive(&slots[3 * c + r], T::from_f64(scale * block[r][c]));
            }
        }
    }

    /// [`add_block`](Self::add_block) without the guarantee.
    #[inline]
    pub fn add_block_atomic(&self, slot: usize, block: &[[f64; 3]; 3], scale: f64) {
        let slots = &self.slots[9 * slot..9 * slot + 9];
        for c in 0..3 {
            for r in 0..3 {
                T::add_contended(&slots[3 * c + r], T::from_f64(scale * block[r][c]));
            }
        }
    }

    /// Adds `scale ·` a block given as columns to a slot of a
    /// [`Bsr`](crate::Bsr).
    #[inline]
    pub fn add_columns(&self, slot: usize, columns: &[f64; 9], scale: f64) {
        let slots = &self.slots[9 * slot..9 * slot + 9];
        for k in 0..9 {
            T::add_exclusive(&slots[k], T::from_f64(scale * columns[k]));
        }
    }

    /// [`add_columns`](Self::add_columns) without the guarantee.
    #[inline]
    pub fn add_columns_atomic(&self, slot: usize, columns: &[f64; 9], scale: f64) {
        let slots = &self.slots[9 * slot..9 * slot + 9];
        for k in 0..9 {
            T::add_contended(&slots[k], T::from_f64(scale * columns[k]));
        }
    }

    /// Adds `scale · v` to the three unknowns of a point.
    #[inline]
    pub fn add_point(&self, point: usize, v: &[f64; 3], scale: f64) {
        let slots = &self.slots[3 * point..3 * point + 3];
        for k in 0..3 {
            T::add_exclusive(&slots[k], T::from_f64(scale * v[k]));
        }
    }

    /// Adds `scale · v` to a single entry.
    #[inline]
    pub fn add_value(&self, place: usize, v: f64, scale: f64) {
        T::add_exclusive(&self.slots[place], T::from_f64(scale * v));
    }

    /// [`add_value`](Self::add_value) without the guarantee.
    #[inline]
    pub fn add_value_atomic(&self, place: usize, v: f64, scale: f64) {
        T::add_contended(&self.slots[place], T::from_f64(scale * v));
    }

    /// [`add_point`](Self::add_point) without the guarantee.
    #[inline]
    pub fn add_point_atomic(&self, point: usize, v: &[f64; 3], scale: f64) {
        let slots = &self.slots[3 * point..3 * point + 3];
        for k in 0..3 {
            T::add_contended(&slots[k], T::from_f64(scale * v[k]));
        }
    }
}
