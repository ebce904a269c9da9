use std::sync::Arc;

use super::BorderPattern;
use crate::WeightedBlocks;
use crate::bsr::rows_dot;
use crate::vector::{CHUNK, From, SERIAL, piece_dot, tree};
use crate::{BlockLayout, Bsr, DualMatrix, ExplicitOperator, LinearOperator, Real, Sums};

/// A matrix of points with the rows and columns of scalar unknowns.
///
/// ```text
/// A = | P   Cᵀ |      P 3×3 blocks and contacts, C one 1×3 block for each
///     | C   S  |      scalar–point coupling, S single entries
/// ```
/// A yarn segment between two crossings takes 16 numbers a pair of nodes
/// instead of the 25 of 5×5 blocks.
#[derive(Debug, Clone)]
pub struct BorderedMatrix<T: Real> {
    /// Points: energies and contacts.
    pub points: DualMatrix<T>,
    pattern: Arc<BorderPattern>,
    /// `C`, by rows of scalars.
    coupling: Vec<[T; 3]>,
    /// `S`, both triangles.
    scalars: Vec<T>,
}

impl<T: Real> BorderedMatrix<T> {
    /// The zero matrix.
    ///
    /// # Panics
    /// If the patterns differ in their number of points.
    pub fn zeros(points: Bsr<T>, pattern: Arc<BorderPattern>) -> Self {
        assert_eq!(points.pattern().points(), pattern.points());
        Self {
            points: DualMatrix::new(points),
            coupling: vec![[T::ZERO; 3]; pattern.point_count()],
            scalars: vec![T::ZERO; pattern.scalar_count()],
            pattern,
        }
    }

    /// Pattern of the scalars.
    pub fn border(&self) -> &Arc<BorderPattern> {
        &self.pattern
    }

    /// Sets every value of energies to zero; contacts stay.
    pub fn fill_zero(&mut self) {
        self.points.stat.fill_zero();
        self.coupling.fill([T::ZERO; 3]);
        self.scalars.fill(T::ZERO);
    }

    /// Values of the points' blocks, the couplings (three for each
    /// [`point_slot`](BorderPattern::point_slot)) and the scalars' entries (one
    /// for each [`scalar_slot`](BorderPattern::scalar_slot)), for assembly.
    pub fn values_mut(&mut self) -> (&mut [T], &mut [T], &mut [T]) {
        (
            self.points.stat.values_mut(),
            self.coupling.as_flattened_mut(),
            &mut self.scalars,
        )
    }

    /// Entry of a scalar's diagonal.
    fn diagonal(&self, scalar: usize) -> f64 {
        let slot = self.pattern.scalar_slot(scalar as u32, scalar as u32);
        slot.map_or(0.0, |slot| self.scalars[slot as usize].to_f64())
    }

    /// `z[k] = (C x)[first + k] + (S s)[first + k]`
    fn scalar_rows(&self, first: usize, x: &[[T; 3]], s: &[T], z: &mut [T]) {
        let (points, scalars) = (self.pattern.point_columns(), self.pattern.scalar_columns());
        for (k, z) in z.iter_mut().enumerate() {
            let row = self.pattern.point_row(first + k);
            let mut sum = T::ZERO;
            for (c, &p) in self.coupling[row.clone()].iter().zip(&points[row]) {
                let x = &x[p as usize];
                sum = c[2].fma(x[2], c[1].fma(x[1], c[0].fma(x[0], sum)));
            }
            let row = self.pattern.scalar_row(first + k);
            for (a, &c) in self.scalars[row.clone()].iter().zip(&scalars[row]) {
                sum = a.fma(s[c as usize], sum);
            }
            *z = sum;
        }
    }

    /// `y[k] += (Cᵀ s)[first + k]`
    fn add_point_rows(&self, first: usize, s: &[T], y: &mut [[T; 3]]) {
        let entries = self.pattern.transposed_entries();
        for (k, y) in y.iter_mut().enumerate() {
            let row = self.pattern.transposed_row(first + k);
            for &[scalar, slot] in &entries[row] {
                let (c, s) = (&self.coupling[slot as usize], s[scalar as usize]);
                for i in 0..3 {
                    y[i] = c[i].fma(s, y[i]);
                }
            }
        }
    }

    /// The product, and what `points` and `scalars` return for each piece.
    fn product<const K: usize>(
        &self,
        x: &[T],
        y: &mut [T],
        points: impl Fn(&[[T; 3]], usize, &[[T; 3]]) -> [f64; K] + Sync,
        scalars: impl Fn(&[T], &[T]) -> [f64; K] + Sync,
    ) -> [f64; K] {
        let cut = 3 * self.pattern.points();
        let (xp, s) = x.split_at(cut);
        let (yp, z) = y.split_at_mut(cut);
        let blocks = xp.as_chunks::<3>().0;
        let a = self.points.product(xp, yp, |first, y| {
            self.add_point_rows(first, s, y);
            points(blocks, first, y)
        });
        let rows = z.len();
        let b = tree(
            (From(0, rows), z, s),
            CHUNK,
            SERIAL,
            &|(from, z, piece): (From, &mut [T], &[T])| {
                self.scalar_rows(from.0, blocks, s, z);
                scalars(piece, z)
            },
        );
        std::array::from_fn(|k| a[k] + b[k])
    }

    /// Heap memory in bytes, the shared patterns included.
    pub fn heap_bytes(&self) -> usize {
        self.points.heap_bytes()
            + self.pattern.heap_bytes()
            + (3 * self.coupling.capacity() + self.scalars.capacity()) * size_of::<T>()
    }
}

impl<T: Real> LinearOperator<T> for BorderedMatrix<T> {
    fn dim(&self) -> usize {
        self.layout().dim()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.product(x, y, |_, _, _| [], |_, _| []);
    }

    fn apply_dot(&self, x: &[T], y: &mut [T], sums: Sums) -> f64 {
        let [dot] = match sums {
            Sums::Double => self.product(
                x,
                y,
                |x, first, y| [rows_dot::<f64, T>(x, first, y)],
                |s, z| [piece_dot::<f64, T>(s, z)],
            ),
            Sums::OfVectors => self.product(
                x,
                y,
                |x, first, y| [rows_dot::<T, T>(x, first, y)],
                |s, z| [piece_dot::<T, T>(s, z)],
            ),
        };
        dot
    }
}

impl<T: Real> ExplicitOperator<T> for BorderedMatrix<T> {
    fn layout(&self) -> BlockLayout {
        BlockLayout {
            points: self.pattern.points(),
            scalars: self.pattern.scalars(),
        }
    }

    fn pattern_id(&self) -> u64 {
        // the points' id alone would not see scalars that came or went
        self.points.pattern_id() ^ (self.pattern.id() << 48)
    }

    fn diagonal_blocks(&self, out: &mut [[f64; 9]]) {
        self.points.diagonal_blocks(out);
    }

    fn static_part(&self) -> &Bsr<T> {
        &self.points.stat
    }

    fn dynamic_part(&self) -> Option<&WeightedBlocks<T>> {
        Some(&self.points.dynamic)
    }

    fn diagonal_scalars(&self, out: &mut [f64]) {
        for (s, out) in out.iter_mut().enumerate() {
            *out = self.diagonal(s);
        }
    }

    fn border(&self) -> Option<&BorderPattern> {
        Some(&self.pattern)
    }

    fn border_values(&self) -> (&[[T; 3]], &[T]) {
        (&self.coupling, &self.scalars)
    }

    fn own_coupling(&self, scalar: usize, row: &mut [f64]) -> [f64; 3] {
        let owner = self.pattern.owners()[scalar];
        for (t, out) in self.pattern.owned(owner as usize).zip(row) {
            let slot = self.pattern.scalar_slot(scalar as u32, t as u32);
            *out = slot.map_or(0.0, |slot| self.scalars[slot as usize].to_f64());
        }
        let slot = self.pattern.point_slot(scalar as u32, owner);
        slot.map_or([0.0; 3], |slot| {
            self.coupling[slot as usize].map(|c| c.to_f64())
        })
    }

    fn visit_lower(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        self.points.visit_lower(visit);
        let first = 3 * self.pattern.points();
        for s in 0..self.pattern.scalars() {
            for slot in self.pattern.point_row(s) {
                let p = self.pattern.point_columns()[slot] as usize;
                for k in 0..3 {
                    visit(first + s, 3 * p + k, self.coupling[slot][k].to_f64());
                }
            }
            for slot in self.pattern.scalar_row(s) {
                let t = self.pattern.scalar_columns()[slot] as usize;
                if t <= s {
                    visit(first + s, first + t, self.scalars[slot].to_f64());
                }
            }
        }
    }
}
