//! A matrix as the sum of its elements' matrices.

use rayon::prelude::*;
use std::sync::Arc;

use crate::{
    BlockLayout, BorderPattern, BorderedMatrix, Bsr, ChunkColouring, DualMatrix, ExplicitOperator,
    LinearOperator, Pattern, Real, SharedValues, WeightedBlocks, colour_chunks,
};

/// Stencils of one kind: the dimension of each of their nodes, 3 (a point) or 1
/// (a scalar), and the nodes, stencil by stencil.
#[derive(Debug, Clone, Copy)]
pub struct ElementGroup<'a> {
    /// Dimensions of the nodes of a stencil.
    pub dims: &'a [usize],
    /// Nodes of all stencils.
    pub nodes: &'a [u32],
}

/// A matrix that is never put together.
///
/// ```text
/// A = D + Σ_e P_eᵀ H_e P_e
/// ```
/// `D` holds masses and contacts, `H_e` is the matrix of stencil `e` on its own
/// unknowns (lower triangle), which `P_e` picks. A product takes each stencil
/// alone, in chunks whose colours share no point: the sums come in the same
/// order for any number of threads. No pattern, no slots, and assembly is plain
/// writing; in exchange stencils that share unknowns read and multiply what a
/// matrix would have added up.
///
/// For preconditioners the diagonal blocks of nodes (a point with its scalars)
/// are summed as well; other blocks come in parts, stencil by stencil
/// ([`visit_lower`](ExplicitOperator::visit_lower)).
#[derive(Debug, Clone)]
pub struct ElementMatrix<T: Real> {
    /// `D` on the points: masses, and contacts with bodies and among points.
    pub own: DualMatrix<T>,
    /// `D` on the scalars.
    pub own_scalars: Vec<T>,
    /// Nodes' blocks of the second part.
    diagonal: BorderedMatrix<T>,
    groups: Vec<Elements<T>>,
}

#[derive(Debug, Clone)]
struct Elements<T> {
    dims: Vec<u8>,
    /// First unknown of every node.
    unknowns: Vec<u32>,
    /// Lower triangles by rows.
    values: Vec<T>,
    colouring: ChunkColouring,
}

/// What an assembly writes: triangles of the stencils of one group by rows, and
/// nodes' blocks: of points (the slot is the point), couplings of scalars with
/// their owners (the slot is the scalar), entries of scalars with those of the
/// same owner ([`BorderPattern::scalar_slot`]).
pub struct ElementValues<'a, T> {
    /// Triangles.
    pub triangles: &'a mut [T],
    /// Blocks of points.
    pub blocks: &'a mut [T],
    /// Couplings.
    pub coupling: &'a mut [T],
    /// Entries of scalars.
    pub scalars: &'a mut [T],
    /// Pattern of the scalars' entries.
    pub border: Arc<BorderPattern>,
}

impl<T: Real> ElementMatrix<T> {
    /// The zero matrix; `owners` holds the point of every scalar, `chunk` is the
    /// number of stencils in a unit of parallel work.
    ///
    /// # Panics
    /// If owners descend, a node does not exist, `chunk` is 0, or there are 2³²
    /// unknowns.
    pub fn zeros(points: usize, owners: &[u32], groups: &[ElementGroup<'_>], chunk: usize) -> Self {
        assert!(u32::try_from(3 * points + owners.len()).is_ok());
        let alone = || Bsr::zeros(Arc::new(Pattern::from_groups(points, std::iter::empty())));
        let none = std::iter::empty::<(&[u32], &[usize])>();
        let border = BorderPattern::from_groups(points, owners.to_vec(), none);
        let groups = groups.iter().map(|g| {
            let width = g.dims.len().max(1);
            let both = || g.nodes.iter().zip(g.dims.iter().cycle());
            let touched: Vec<u32> = both()
                .map(|(&n, &d)| if d == 3 { n } else { owners[n as usize] })
                .collect();
            let unknown = |(&n, &d): (&u32, &usize)| match d {
                3 => 3 * n,
                _ => 3 * points as u32 + n,
            };
            let m: usize = g.dims.iter().sum();
            Elements {
                dims: g.dims.iter().map(|&d| d as u8).collect(),
                unknowns: both().map(unknown).collect(),
                values: vec![T::ZERO; g.nodes.len() / width * (m * (m + 1) / 2)],
                colouring: colour_chunks(points, touched.chunks_exact(width), chunk),
            }
        });
        Self {
            groups: groups.collect(),
            own: DualMatrix::new(alone()),
            own_scalars: vec![T::ZERO; owners.len()],
            diagonal: BorderedMatrix::zeros(alone(), Arc::new(border)),
        }
    }

    /// Sets every value to zero; contacts among points stay.
    pub fn fill_zero(&mut self) {
        self.own.stat.fill_zero();
        self.own_scalars.fill(T::ZERO);
        self.diagonal.fill_zero();
        for group in &mut self.groups {
            group.values.fill(T::ZERO);
        }
    }

    /// Values of a group, for assembly.
    ///
    /// # Panics
    /// If there is no such group.
    pub fn values_mut(&mut self, group: usize) -> ElementValues<'_, T> {
        let border = Arc::clone(self.diagonal.border());
        let (blocks, coupling, scalars) = self.diagonal.values_mut();
        ElementValues {
            triangles: &mut self.groups[group].values,
            blocks,
            coupling,
            scalars,
            border,
        }
    }

    /// Heap memory in bytes.
    pub fn heap_bytes(&self) -> usize {
        self.own.heap_bytes()
            + self.diagonal.heap_bytes()
            + self.own_scalars.capacity() * size_of::<T>()
            + self.groups.iter().map(Elements::heap_bytes).sum::<usize>()
    }
}

impl<T: Real> Elements<T> {
    fn size(&self) -> usize {
        self.dims.iter().map(|&d| d as usize).sum()
    }

    /// `y += Σ_e P_eᵀ H_e P_e x`
    fn add_product(&self, x: &[T], y: SharedValues<'_, T>) {
        for colour in &self.colouring.colours {
            let one = |&c: &u32| {
                let r = &self.colouring.chunks[c as usize];
                self.add_chunk(r.start as usize..r.end as usize, x, y);
            };
            // A lone chunk is not worth a thread's wake-up.
            if colour.len() < 2 || rayon::current_num_threads() == 1 {
                colour.iter().for_each(one);
            } else {
                colour.par_iter().for_each(one);
            }
        }
    }

    fn add_chunk(&self, range: std::ops::Range<usize>, x: &[T], y: SharedValues<'_, T>) {
        let (width, m) = (self.dims.len(), self.size());
        let packed = m * (m + 1) / 2;
        let mut local = vec![T::ZERO; m];
        let mut sum = vec![T::ZERO; m];
        for e in range {
            let unknowns = &self.unknowns[e * width..(e + 1) * width];
            let mut at = 0;
            for (&from, &d) in unknowns.iter().zip(&self.dims) {
                let (from, d) = (from as usize, d as usize);
                local[at..at + d].copy_from_slice(&x[from..from + d]);
                at += d;
            }
            sum.fill(T::ZERO);
            let mut rest = &self.values[e * packed..(e + 1) * packed];
            for i in 0..m {
                let (row, tail) = rest.split_at(i + 1);
                let own = local[i];
                let mut dot = row[i] * own;
                for ((&h, &x), sum) in row[..i].iter().zip(&local).zip(&mut sum) {
                    dot = h.fma(x, dot);
                    *sum = h.fma(own, *sum);
                }
                sum[i] += dot;
                rest = tail;
            }
            let mut at = 0;
            for (&to, &d) in unknowns.iter().zip(&self.dims) {
                for k in 0..d as usize {
                    y.add_value(to as usize + k, sum[at + k].to_f64(), 1.0);
                }
                at += d as usize;
            }
        }
    }

    /// Global unknowns of a stencil.
    fn places(&self, e: usize) -> impl Iterator<Item = usize> {
        let width = self.dims.len();
        let nodes = self.unknowns[e * width..(e + 1) * width].iter();
        nodes
            .zip(&self.dims)
            .flat_map(|(&from, &d)| from as usize..from as usize + d as usize)
    }

    fn heap_bytes(&self) -> usize {
        let c = &self.colouring;
        self.dims.capacity()
            + 4 * self.unknowns.capacity()
            + size_of::<T>() * self.values.capacity()
            + 8 * c.chunks.capacity()
            + 4 * c.colours.iter().map(Vec::capacity).sum::<usize>()
    }
}

impl<T: Real> LinearOperator<T> for ElementMatrix<T> {
    fn dim(&self) -> usize {
        self.layout().dim()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        let cut = 3 * self.layout().points;
        let (points, scalars) = y.split_at_mut(cut);
        self.own.apply(&x[..cut], points);
        for ((y, &x), &d) in scalars.iter_mut().zip(&x[cut..]).zip(&self.own_scalars) {
            *y = d * x;
        }
        let y = SharedValues::new(y);
        for group in &self.groups {
            group.add_product(x, y);
        }
    }
}

impl<T: Real> ExplicitOperator<T> for ElementMatrix<T> {
    fn layout(&self) -> BlockLayout {
        self.diagonal.layout()
    }

    fn pattern_id(&self) -> u64 {
        self.diagonal.pattern_id()
    }

    fn diagonal_blocks(&self, out: &mut [[f64; 9]]) {
        let mut part = vec![[0.0; 9]; out.len()];
        self.own.diagonal_blocks(out);
        self.diagonal.diagonal_blocks(&mut part);
        for (out, part) in out.as_flattened_mut().iter_mut().zip(part.as_flattened()) {
            *out += part;
        }
    }

    /// Nothing but diagonal blocks.
    fn static_part(&self) -> &Bsr<T> {
        &self.own.stat
    }

    fn dynamic_part(&self) -> Option<&WeightedBlocks<T>> {
        Some(&self.own.dynamic)
    }

    fn diagonal_scalars(&self, out: &mut [f64]) {
        self.diagonal.diagonal_scalars(out);
        for (out, own) in out.iter_mut().zip(&self.own_scalars) {
            *out += own.to_f64();
        }
    }

    fn border(&self) -> Option<&BorderPattern> {
        Some(self.diagonal.border())
    }

    fn border_values(&self) -> (&[[T; 3]], &[T]) {
        self.diagonal.border_values()
    }

    fn own_coupling(&self, scalar: usize, row: &mut [f64]) -> [f64; 3] {
        let coupling = self.diagonal.own_coupling(scalar, row);
        let border = self.diagonal.border();
        let first = border.owned(border.owners()[scalar] as usize).start;
        row[scalar - first] += self.own_scalars[scalar].to_f64();
        coupling
    }

    fn visit_lower(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        self.own.visit_lower(visit);
        let first = 3 * self.layout().points;
        for (s, own) in self.own_scalars.iter().enumerate() {
            visit(first + s, first + s, own.to_f64());
        }
        for group in &self.groups {
            let m = group.size();
            for (e, h) in group
                .values
                .chunks_exact((m * (m + 1) / 2).max(1))
                .enumerate()
            {
                let places: Vec<usize> = group.places(e).collect();
                let mut h = h.iter();
                for (k, &i) in places.iter().enumerate() {
                    for (l, (&j, h)) in places[..=k].iter().zip(&mut h).enumerate() {
                        // an unknown that a stencil names twice couples with itself
                        let twice = if i == j && l < k { 2.0 } else { 1.0 };
                        visit(i.max(j), i.min(j), twice * h.to_f64());
                    }
                }
            }
        }
    }
}
