//! One level: a matrix in colour order and the sweeps over it.

use super::graph::Graph;
use crate::bsr::row_product;
use crate::preconditioner::block_times;
use crate::small;
use crate::vector::{From, tree};

/// Rows of a task, and rows below which one thread does the work.
const ROWS: usize = 512;
const SERIAL: usize = 8192;
/// The same for the rows of one colour.
const SERIAL_COLOUR: usize = 2048;

/// Strictly lower or upper block rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Half {
    pub starts: Vec<u32>,
    /// Lower: from the first row; upper: from the end of the row's colour.
    pub columns: Vec<u32>,
    pub blocks: Vec<[f32; 9]>,
}

impl Half {
    #[inline(always)]
    fn product(&self, i: usize, x: &[[f32; 3]]) -> [f32; 3] {
        let row = self.starts[i] as usize..self.starts[i + 1] as usize;
        row_product(&self.columns[row.clone()], &self.blocks[row], x)
    }

    fn heap_bytes(&self) -> usize {
        4 * (self.starts.capacity() + self.columns.capacity()) + 36 * self.blocks.capacity()
    }
}

/// Symmetric matrix whose rows are sorted by colour: rows of one colour do not
/// couple, so a Gauss-Seidel sweep may take them in any order or at once.
#[derive(Debug, Clone, Default)]
pub(super) struct Level {
    /// First row of every colour, then the number of rows.
    pub colours: Vec<usize>,
    pub lower: Half,
    pub upper: Half,
    /// Of every upper block, the lower block it is the transpose of.
    pub mirror: Vec<u32>,
    pub diagonal: Vec<[f32; 9]>,
    pub inverse: Vec<[f32; 6]>,
    /// Right-hand side, iterate, residual.
    pub b: Vec<[f32; 3]>,
    pub x: Vec<[f32; 3]>,
    pub r: Vec<[f32; 3]>,
}

impl Level {
    /// Pattern and order (`order[new] = old`) for a graph.
    pub fn new(graph: &Graph) -> (Self, Vec<u32>) {
        let n = graph.points();
        let colour = graph.colours();
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_by_key(|&i| colour[i as usize]);
        let mut place = vec![0u32; n];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut out = Self::default();
        let mut start = 0;
        while start < n {
            out.colours.push(start);
            let c = colour[order[start] as usize];
            start += order[start..].partition_point(|&i| colour[i as usize] == c);
        }
        out.colours.push(n);
        out.lower.starts.push(0);
        out.upper.starts.push(0);
        let mut row = Vec::new();
        let mut c = 0;
        for (new, &old) in order.iter().enumerate() {
            if new == out.colours[c + 1] {
                c += 1;
            }
            let end = out.colours[c + 1] as u32;
            row.clear();
            row.extend(graph.row(old as usize).map(|(j, _)| place[j as usize]));
            row.sort_unstable();
            for &j in &row {
                if (j as usize) < new {
                    out.lower.columns.push(j);
                } else {
                    out.upper.columns.push(j - end);
                }
            }
            out.lower.starts.push(out.lower.columns.len() as u32);
            out.upper.starts.push(out.upper.columns.len() as u32);
        }
        out.lower.blocks = vec![[0.0; 9]; out.lower.columns.len()];
        out.upper.blocks = vec![[0.0; 9]; out.upper.columns.len()];
        // lower rows come in ascending order, so do the rows of an upper column
        let mut fill: Vec<u32> = out.upper.starts.clone();
        out.mirror = vec![0; out.upper.columns.len()];
        for i in 0..n {
            for k in out.lower.starts[i]..out.lower.starts[i + 1] {
                let at = &mut fill[out.lower.columns[k as usize] as usize];
                out.mirror[*at as usize] = k;
                *at += 1;
            }
        }
        out.diagonal = vec![[0.0; 9]; n];
        out.inverse = vec![[0.0; 6]; n];
        for v in [&mut out.b, &mut out.x, &mut out.r] {
            *v = vec![[0.0; 3]; n];
        }
        (out, order)
    }

    /// End of the colour of a row.
    pub fn colour_end(&self, row: usize) -> usize {
        self.colours[self.colours.partition_point(|&start| start <= row)]
    }

    pub fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// After the lower half and the diagonal have values: the upper half and
    /// the inverted diagonal. False when a diagonal block is not positive.
    pub fn finish(&mut self) -> bool {
        let lower = &self.lower.blocks;
        tree(
            (self.mirror.as_slice(), self.upper.blocks.as_mut_slice()),
            8 * ROWS,
            8 * SERIAL,
            &|(from, to): (&[u32], &mut [[f32; 9]])| {
                for (&k, to) in from.iter().zip(to) {
                    let b = &lower[k as usize];
                    *to = [b[0], b[3], b[6], b[1], b[4], b[7], b[2], b[5], b[8]];
                }
                []
            },
        );
        let [bad] = tree(
            (self.diagonal.as_slice(), self.inverse.as_mut_slice()),
            ROWS,
            SERIAL,
            &|(from, to): (&[[f32; 9]], &mut [[f32; 6]])| {
                let mut bad = 0.0;
                for (d, to) in from.iter().zip(to) {
                    match invert(d) {
                        Some(i) => *to = i,
                        None => bad += 1.0,
                    }
                }
                [bad]
            },
        );
        bad == 0.0
    }

    /// Forward Gauss-Seidel from 0, then the residual in `r`.
    pub fn forward(&mut self) {
        let Self {
            colours,
            lower,
            upper,
            inverse,
            b,
            x,
            r,
            ..
        } = self;
        for c in colours.windows(2) {
            let (done, rest) = x.split_at_mut(c[0]);
            each(c[0], &mut rest[..c[1] - c[0]], SERIAL_COLOUR, &|i, _| {
                let s = lower.product(i, done);
                block_times(&inverse[i], &minus(&b[i], &s))
            });
        }
        // (D + L) x = b is solved: what is left of b is −U x
        for c in colours.windows(2) {
            let later = &x[c[1]..];
            each(c[0], &mut r[c[0]..c[1]], SERIAL_COLOUR, &|i, _| {
                upper.product(i, later).map(|v| -v)
            });
        }
    }

    /// Backward Gauss-Seidel.
    pub fn backward(&mut self) {
        let Self {
            colours,
            lower,
            upper,
            inverse,
            b,
            x,
            ..
        } = self;
        for c in colours.windows(2).rev() {
            let (before, rest) = x.split_at_mut(c[0]);
            let (own, later) = rest.split_at_mut(c[1] - c[0]);
            each(c[0], own, SERIAL_COLOUR, &|i, _| {
                let s = upper.product(i, later);
                let t = lower.product(i, before);
                block_times(&inverse[i], &minus(&minus(&b[i], &s), &t))
            });
        }
    }

    pub fn heap_bytes(&self) -> usize {
        self.lower.heap_bytes()
            + self.upper.heap_bytes()
            + 4 * self.mirror.capacity()
            + 36 * self.diagonal.capacity()
            + 24 * self.inverse.capacity()
            + 12 * (self.b.capacity() + self.x.capacity() + self.r.capacity())
    }
}

#[inline(always)]
fn minus(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `out[k] = f(first + k)`, in parallel.
pub(super) fn rows(
    first: usize,
    out: &mut [[f32; 3]],
    f: &(impl Fn(usize, &[f32; 3]) -> [f32; 3] + Sync),
) {
    each(first, out, SERIAL, f);
}

fn each(
    first: usize,
    out: &mut [[f32; 3]],
    serial: usize,
    f: &(impl Fn(usize, &[f32; 3]) -> [f32; 3] + Sync),
) {
    let n = out.len();
    tree((From(first, n), out), ROWS, serial, &|(from, out): (
        From,
        &mut [[f32; 3]],
    )| {
        for (k, out) in out.iter_mut().enumerate() {
            *out = f(from.0 + k, out);
        }
        []
    });
}

fn invert(d: &[f32; 9]) -> Option<[f32; 6]> {
    let d = d.map(f64::from);
    let trace = small::trace(&d);
    let l = small::cholesky(&d, 1e-9 * trace)?;
    Some(small::inverse(&l).map(|v| v as f32))
}
