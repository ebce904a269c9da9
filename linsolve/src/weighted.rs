//! Blocks that couple four points through one 3×3 matrix.

use crate::pattern::{ROW_CHUNK, fresh_id};
use crate::vector::tree;
use crate::{LinearOperator, Real};
use std::sync::{Mutex, PoisonError};

/// Contacts of a chunk in the first phase of the product.
const CONTACT_CHUNK: usize = 512;

/// Sum of weighted blocks: the part of a matrix whose pattern changes often.
///
/// ```text
/// A = Σ_c  (w_c w_cᵀ) ⊗ K_c ,    f_c = K_c Σ_a w_ca x_a ,    y_i += Σ_c w_ci f_c
/// ```
/// `w_c` four weights \[1\], `K_c` symmetric 3×3. A contact costs 13 numbers
/// instead of the 144 of its blocks, and nothing is sorted: the product
/// computes every `f_c`, then every touched row gathers its contacts in the
/// order in which they were given. Both phases run in parallel without
/// atomics and do not depend on the number of threads.
#[derive(Debug, Default)]
pub struct WeightedBlocks<T> {
    points: usize,
    contacts: Vec<Contact<T>>,
    /// Touched rows, ascending, with their entries `starts[k]..starts[k + 1]`.
    rows: Vec<u32>,
    starts: Vec<u32>,
    entries: Vec<(u32, T)>,
    /// First touched row of every row chunk.
    chunks: Vec<u32>,
    counts: Vec<u32>,
    structure: u64,
    forces: Mutex<Vec<[T; 3]>>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Contact<T> {
    nodes: [u32; 4],
    len: u32,
    weights: [T; 4],
    /// xx, xy, xz, yy, yz, zz
    k: [T; 6],
}

impl<T: Real> Contact<T> {
    fn full(&self) -> [f64; 9] {
        let k = self.k.map(T::to_f64);
        [k[0], k[1], k[2], k[1], k[3], k[4], k[2], k[4], k[5]]
    }
}

impl<T: Real> WeightedBlocks<T> {
    /// No blocks on `points` points.
    pub fn new(points: usize) -> Self {
        Self {
            points,
            ..Self::default()
        }
    }

    /// Replaces all blocks by `scale · (w wᵀ) ⊗ k`, reusing memory.
    ///
    /// Entries of weight 0 are ignored, whatever their node; a node named twice
    /// by one contact gets the sum of its weights. Only the symmetric part of
    /// `k` is used.
    ///
    /// # Panics
    /// If the arrays differ in length or a node of non-zero weight is ≥ `points`.
    pub fn rebuild(
        &mut self,
        points: usize,
        nodes: &[[u32; 4]],
        weights: &[[f64; 4]],
        k: &[[[f64; 3]; 3]],
        scale: f64,
    ) {
        assert!(
            nodes.len() == weights.len() && nodes.len() == k.len(),
            "one weight set and one block for each contact"
        );
        let mut same = self.points == points && self.contacts.len() == nodes.len();
        self.points = points;
        self.contacts.resize(nodes.len(), Contact::default());
        for (c, contact) in self.contacts.iter_mut().enumerate() {
            let next = pack(points, &nodes[c], &weights[c], &k[c], scale);
            same &= contact.nodes == next.nodes && contact.len == next.len;
            *contact = next;
        }
        if !same || self.structure == 0 {
            self.structure = fresh_id();
        }
        self.index(same);
    }

    /// Lists the contacts of every touched row.
    fn index(&mut self, same: bool) {
        if !same {
            self.counts.clear();
            self.counts.resize(self.points, 0);
            for contact in &self.contacts {
                for &i in &contact.nodes[..contact.len as usize] {
                    self.counts[i as usize] += 1;
                }
            }
            self.rows.clear();
            self.starts.clear();
            self.chunks.clear();
            let mut total = 0;
            for (i, count) in self.counts.iter_mut().enumerate() {
                if i % ROW_CHUNK == 0 {
                    self.chunks.push(self.rows.len() as u32);
                }
                if *count > 0 {
                    self.rows.push(i as u32);
                    self.starts.push(total);
                    total += *count;
                }
            }
            self.chunks.push(self.rows.len() as u32);
            self.starts.push(total);
            self.entries.resize(total as usize, (0, T::ZERO));
        }
        for (&i, &start) in self.rows.iter().zip(&self.starts) {
            self.counts[i as usize] = start;
        }
        for (c, contact) in self.contacts.iter().enumerate() {
            for a in 0..contact.len as usize {
                let at = &mut self.counts[contact.nodes[a] as usize];
                self.entries[*at as usize] = (c as u32, contact.weights[a]);
                *at += 1;
            }
        }
    }

    /// Removes all blocks, keeping memory.
    pub fn clear(&mut self) {
        let points = self.points;
        self.rebuild(points, &[], &[], &[], 1.0);
    }

    /// Copies blocks of another precision.
    pub fn copy_from<U: Real>(&mut self, other: &WeightedBlocks<U>) {
        let same = self.structure == other.structure && self.points == other.points;
        self.points = other.points;
        self.structure = other.structure;
        self.contacts.clear();
        self.contacts.extend(other.contacts.iter().map(|c| Contact {
            nodes: c.nodes,
            len: c.len,
            weights: c.weights.map(|w| T::from_f64(w.to_f64())),
            k: c.k.map(|k| T::from_f64(k.to_f64())),
        }));
        self.index(same && !self.starts.is_empty());
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.contacts.len()
    }

    /// Whether there is no contact.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Number of points with at least one contact.
    pub fn touched(&self) -> usize {
        self.rows.len()
    }

    /// Identity of the set of coupled points; 0 when there is no contact.
    pub fn structure_id(&self) -> u64 {
        if self.is_empty() { 0 } else { self.structure }
    }

    /// Phase 1: `f_c` of every contact.
    pub(crate) fn gather_forces(&self, x: &[T]) -> Vec<[T; 3]> {
        // taken out, not held: a thread that waits inside the product may
        // start another product on this matrix
        let mut forces = std::mem::take(&mut *self.scratch());
        forces.resize(self.contacts.len(), [T::ZERO; 3]);
        let x = x.as_chunks::<3>().0;
        tree(
            (self.contacts.as_slice(), forces.as_mut_slice()),
            CONTACT_CHUNK,
            2 * CONTACT_CHUNK,
            &|(contacts, forces): (&[Contact<T>], &mut [[T; 3]])| {
                for (c, f) in contacts.iter().zip(forces) {
                    let mut d = [T::ZERO; 3];
                    for a in 0..c.len as usize {
                        let x = x[c.nodes[a] as usize];
                        for k in 0..3 {
                            d[k] = c.weights[a].fma(x[k], d[k]);
                        }
                    }
                    let k = &c.k;
                    *f = [
                        k[0] * d[0] + k[1] * d[1] + k[2] * d[2],
                        k[1] * d[0] + k[3] * d[1] + k[4] * d[2],
                        k[2] * d[0] + k[4] * d[1] + k[5] * d[2],
                    ];
                }
                []
            },
        );
        forces
    }

    /// Phase 2 on the rows `first..first + y.len()`, one row chunk.
    pub(crate) fn add_rows(&self, forces: &[[T; 3]], first: usize, y: &mut [[T; 3]]) {
        let chunk = first / ROW_CHUNK;
        for t in self.chunks[chunk] as usize..self.chunks[chunk + 1] as usize {
            let mut sum = [T::ZERO; 3];
            for &(c, w) in &self.entries[self.starts[t] as usize..self.starts[t + 1] as usize] {
                let f = &forces[c as usize];
                for k in 0..3 {
                    sum[k] = w.fma(f[k], sum[k]);
                }
            }
            let y = &mut y[self.rows[t] as usize - first];
            for k in 0..3 {
                y[k] += sum[k];
            }
        }
    }

    pub(crate) fn give_back(&self, forces: Vec<[T; 3]>) {
        *self.scratch() = forces;
    }

    fn scratch(&self) -> std::sync::MutexGuard<'_, Vec<[T; 3]>> {
        self.forces.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds the diagonal blocks (row-major).
    pub(crate) fn add_diagonal_blocks(&self, out: &mut [[f64; 9]]) {
        for c in &self.contacts {
            let k = c.full();
            for a in 0..c.len as usize {
                let w = c.weights[a].to_f64().powi(2);
                for (o, v) in out[c.nodes[a] as usize].iter_mut().zip(&k) {
                    *o += w * v;
                }
            }
        }
    }

    /// Calls `visit(i, j, w_i w_j K)` with `i ≥ j`, each pair once.
    pub(crate) fn visit_blocks(&self, visit: &mut dyn FnMut(usize, usize, &[f64; 9])) {
        for c in &self.contacts {
            let k = c.full();
            for a in 0..c.len as usize {
                for b in 0..=a {
                    let w = c.weights[a].to_f64() * c.weights[b].to_f64();
                    let (i, j) = (c.nodes[a] as usize, c.nodes[b] as usize);
                    visit(i.max(j), i.min(j), &k.map(|v| w * v));
                }
            }
        }
    }

    /// Heap memory in bytes.
    pub fn heap_bytes(&self) -> usize {
        self.contacts.capacity() * size_of::<Contact<T>>()
            + self.entries.capacity() * size_of::<(u32, T)>()
            + 4 * (self.rows.capacity() + self.starts.capacity())
            + 4 * (self.chunks.capacity() + self.counts.capacity())
            + self.scratch().capacity() * size_of::<[T; 3]>()
    }
}

fn pack<T: Real>(
    points: usize,
    nodes: &[u32; 4],
    weights: &[f64; 4],
    k: &[[f64; 3]; 3],
    scale: f64,
) -> Contact<T> {
    let mut out = Contact::default();
    let mut sums = [0.0; 4];
    for (&i, &w) in nodes.iter().zip(weights) {
        if w == 0.0 {
            continue;
        }
        assert!((i as usize) < points, "contact names point {i} of {points}");
        let len = out.len as usize;
        let at = out.nodes[..len].iter().position(|&n| n == i).unwrap_or(len);
        out.nodes[at] = i;
        sums[at] += w;
        out.len = out.len.max(at as u32 + 1);
    }
    out.weights = sums.map(T::from_f64);
    let sym = |r: usize, c: usize| T::from_f64(0.5 * scale * (k[r][c] + k[c][r]));
    out.k = [
        sym(0, 0),
        sym(0, 1),
        sym(0, 2),
        sym(1, 1),
        sym(1, 2),
        sym(2, 2),
    ];
    out
}

impl<T: Real> Clone for WeightedBlocks<T> {
    fn clone(&self) -> Self {
        let mut out = Self::new(self.points);
        out.copy_from(self);
        out
    }
}

impl<T: Real> LinearOperator<T> for WeightedBlocks<T> {
    fn dim(&self) -> usize {
        3 * self.points
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        assert!(x.len() == self.dim() && y.len() == self.dim());
        y.fill(T::ZERO);
        if self.is_empty() {
            return;
        }
        let forces = self.gather_forces(x);
        let y = y.as_chunks_mut::<3>().0;
        for (chunk, y) in y.chunks_mut(ROW_CHUNK).enumerate() {
            self.add_rows(&forces, chunk * ROW_CHUNK, y);
        }
        self.give_back(forces);
    }
}
