//! Aggregates and interpolation weights from the pattern alone.

use crate::Pattern;

/// Neighbours this much weaker than the strongest ones are not aggregated.
const STRONG: f32 = 0.5;
/// Damping of the step that smooths the interpolation.
const DAMPING: f32 = 0.8;
/// Weights below this are dropped, the others rescaled to sum 1.
const DROP: f32 = 0.08;

const NONE: u32 = u32::MAX;

/// Undirected graph without loops, neighbours ascending, symmetric weights.
#[derive(Debug, Clone, Default)]
pub(super) struct Graph {
    pub starts: Vec<u32>,
    pub columns: Vec<u32>,
    weights: Vec<f32>,
}

/// Sparse rows of positive weights.
#[derive(Debug, Clone, Default)]
pub(super) struct Weights {
    pub starts: Vec<u32>,
    pub columns: Vec<u32>,
    pub weights: Vec<f32>,
}

impl Weights {
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        let row = self.starts[i] as usize..self.starts[i + 1] as usize;
        let columns = self.columns[row.clone()].iter().copied();
        columns.zip(self.weights[row].iter().copied())
    }

    pub fn heap_bytes(&self) -> usize {
        4 * (self.starts.capacity() + self.columns.capacity() + self.weights.capacity())
    }

    /// Renumbers rows (`row_order[new] = old`) and columns (`column_place[old] = new`).
    pub fn permuted(&self, row_order: &[u32], column_place: &[u32]) -> Self {
        let mut out = Self::default();
        out.starts.push(0);
        let mut row = Vec::new();
        for &old in row_order {
            row.clear();
            row.extend(
                self.row(old as usize)
                    .map(|(j, w)| (column_place[j as usize], w)),
            );
            row.sort_unstable_by_key(|e| e.0);
            out.columns.extend(row.iter().map(|e| e.0));
            out.weights.extend(row.iter().map(|e| e.1));
            out.starts.push(out.columns.len() as u32);
        }
        out
    }

    pub fn transposed(&self, columns: usize) -> Self {
        let mut starts = vec![0u32; columns + 1];
        for &j in &self.columns {
            starts[j as usize + 1] += 1;
        }
        for j in 0..columns {
            starts[j + 1] += starts[j];
        }
        let mut fill = starts.clone();
        let mut out = Self {
            columns: vec![0; self.columns.len()],
            weights: vec![0.0; self.columns.len()],
            starts,
        };
        for i in 0..self.starts.len() - 1 {
            for (j, w) in self.row(i) {
                let at = &mut fill[j as usize];
                out.columns[*at as usize] = i as u32;
                out.weights[*at as usize] = w;
                *at += 1;
            }
        }
        out
    }
}

impl Graph {
    /// Edges of a pattern, weighted by the number of neighbours that both ends
    /// have in common: on a mesh it falls with the distance.
    pub fn of_pattern(pattern: &Pattern) -> Self {
        let mut out = Self::default();
        out.starts.push(0);
        for i in 0..pattern.points() {
            let row = pattern.columns(i);
            for &j in row.iter().filter(|&&j| j as usize != i) {
                out.columns.push(j);
                out.weights
                    .push((common(row, pattern.columns(j as usize)) as f32).powi(4));
            }
            out.starts.push(out.columns.len() as u32);
        }
        out
    }

    pub fn points(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        let row = self.starts[i] as usize..self.starts[i + 1] as usize;
        let columns = self.columns[row.clone()].iter().copied();
        columns.zip(self.weights[row].iter().copied())
    }

    /// Lowest colour that no neighbour has yet, in natural order.
    pub fn colours(&self) -> Vec<u32> {
        let mut colour = vec![NONE; self.points()];
        let mut seen: Vec<u32> = Vec::new(); // last point that met a colour
        for i in 0..self.points() {
            for (j, _) in self.row(i) {
                if let Some(s) = seen.get_mut(colour[j as usize] as usize) {
                    *s = i as u32;
                }
            }
            let free = seen.iter().position(|&s| s != i as u32);
            let free = free.unwrap_or_else(|| {
                seen.push(NONE);
                seen.len() - 1
            });
            colour[i] = free as u32;
        }
        colour
    }

    fn strong(&self) -> Vec<bool> {
        let top: Vec<f32> = (0..self.points())
            .map(|i| self.row(i).fold(0.0, |m, (_, w)| w.max(m)))
            .collect();
        let mut out = Vec::with_capacity(self.columns.len());
        for i in 0..self.points() {
            out.extend(
                self.row(i)
                    .map(|(j, w)| w >= STRONG * (top[i] * top[j as usize]).sqrt()),
            );
        }
        out
    }

    /// Aggregate of every point ([`NONE`] without neighbours) and their number.
    fn aggregates(&self, strong: &[bool]) -> (Vec<u32>, usize) {
        let n = self.points();
        let neighbours = |i: usize| {
            let first = self.starts[i] as usize;
            self.row(i)
                .enumerate()
                .filter(move |(k, _)| strong[first + k])
                .map(|(_, e)| e)
        };
        let mut of = vec![NONE; n];
        let mut count = 0;
        // whole neighbourhoods first
        for i in 0..n {
            if of[i] != NONE
                || neighbours(i).next().is_none()
                || neighbours(i).any(|(j, _)| of[j as usize] != NONE)
            {
                continue;
            }
            of[i] = count;
            for (j, _) in neighbours(i) {
                of[j as usize] = count;
            }
            count += 1;
        }
        // what is left joins the aggregate it is tied to most
        let first = of.clone();
        for i in 0..n {
            if of[i] != NONE {
                continue;
            }
            let mut best = (0.0, NONE);
            for (j, w) in neighbours(i) {
                let a = first[j as usize];
                if a != NONE && w > best.0 {
                    best = (w, a);
                }
            }
            of[i] = best.1;
        }
        for i in 0..n {
            if of[i] != NONE || neighbours(i).next().is_none() {
                continue;
            }
            of[i] = count;
            for (j, _) in neighbours(i) {
                if of[j as usize] == NONE {
                    of[j as usize] = count;
                }
            }
            count += 1;
        }
        (of, count as usize)
    }

    /// Smoothed interpolation from the aggregates, rows of sum 1 (or empty).
    pub fn interpolation(&self) -> (Weights, usize) {
        let strong = self.strong();
        let (of, count) = self.aggregates(&strong);
        let mut out = Weights::default();
        out.starts.push(0);
        let mut row: Vec<(u32, f32)> = Vec::new();
        for i in 0..self.points() {
            row.clear();
            if of[i] != NONE {
                let first = self.starts[i] as usize;
                let mut total = 0.0;
                for (k, (j, w)) in self.row(i).enumerate() {
                    if strong[first + k] && of[j as usize] != NONE {
                        total += w;
                        add(&mut row, of[j as usize], w);
                    }
                }
                for e in &mut row {
                    e.1 *= DAMPING / total;
                }
                add(
                    &mut row,
                    of[i],
                    if total > 0.0 { 1.0 - DAMPING } else { 1.0 },
                );
                row.retain(|e| e.1 >= DROP);
                let sum: f32 = row.iter().map(|e| e.1).sum();
                row.sort_unstable_by_key(|e| e.0);
                out.columns.extend(row.iter().map(|e| e.0));
                out.weights.extend(row.iter().map(|e| e.1 / sum));
            }
            out.starts.push(out.columns.len() as u32);
        }
        (out, count)
    }

    /// `Pᵀ W P` without loops: the graph of the coarse points.
    pub fn coarse(&self, p: &Weights, points: usize) -> Self {
        let pt = p.transposed(points);
        let mut out = Self::default();
        out.starts.push(0);
        let (mut at, mut sum) = (vec![NONE; points], Vec::<(u32, f32)>::new());
        for i in 0..points as u32 {
            sum.clear();
            let mut add = |j: u32, w: f32| {
                if j == i {
                    return;
                }
                let slot = at[j as usize] as usize;
                match sum.get_mut(slot) {
                    Some(e) if e.0 == j => e.1 += w,
                    _ => {
                        at[j as usize] = sum.len() as u32;
                        sum.push((j, w));
                    }
                }
            };
            for (fine, wi) in pt.row(i as usize) {
                // the diagonal couples all coarse points of a fine one
                for (c, _) in p.row(fine as usize) {
                    add(c, 0.0);
                }
                for (j, w) in self.row(fine as usize) {
                    for (c, wj) in p.row(j as usize) {
                        add(c, wi * w * wj);
                    }
                }
            }
            sum.sort_unstable_by_key(|e| e.0);
            out.columns.extend(sum.iter().map(|e| e.0));
            out.weights.extend(sum.iter().map(|e| e.1));
            out.starts.push(out.columns.len() as u32);
        }
        out
    }
}

fn add(row: &mut Vec<(u32, f32)>, column: u32, w: f32) {
    match row.iter_mut().find(|e| e.0 == column) {
        Some(e) => e.1 += w,
        None => row.push((column, w)),
    }
}

/// Number of common entries of two ascending lists.
fn common(a: &[u32], b: &[u32]) -> usize {
    let (mut i, mut j, mut count) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        let (x, y) = (a[i], b[j]);
        count += usize::from(x == y);
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    count
}
