//! Systems shared by the tests.
#![allow(dead_code)]

use nalgebra::{DMatrix, DVector, Matrix3};
use selvedge_linsolve::{
    BlockFilter, Bsr, DualMatrix, ExplicitOperator, Pattern, Real, WeightedBlocks,
};
use std::sync::Arc;

/// Small deterministic generator (xorshift64*), uniform in [-1, 1).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((self.bits() >> 33) as usize) % n
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.unit()).collect()
    }

    pub fn block(&mut self) -> [[f64; 3]; 3] {
        std::array::from_fn(|_| std::array::from_fn(|_| self.unit()))
    }

    /// Symmetric positive semi-definite of rank 3.
    pub fn spd_block(&mut self) -> [[f64; 3]; 3] {
        let m = Matrix3::from_fn(|_, _| self.unit());
        let k = m * m.transpose();
        std::array::from_fn(|r| std::array::from_fn(|c| k[(r, c)]))
    }
}

/// Triangles of a grid of `w` × `h` points, alternating diagonals.
pub fn triangles(w: usize, h: usize) -> Vec<[u32; 3]> {
    let mut out = Vec::new();
    for j in 0..h - 1 {
        for i in 0..w - 1 {
            let p = (j * w + i) as u32;
            let (q, r, s) = (p + 1, p + w as u32, p + w as u32 + 1);
            if (i + j) % 2 == 0 {
                out.extend([[p, q, r], [q, s, r]]);
            } else {
                out.extend([[p, q, s], [p, s, r]]);
            }
        }
    }
    out
}

/// Two triangles across every inner edge: the 13-block rows of a cloth sheet.
pub fn hinges(triangles: &[[u32; 3]]) -> Vec<[u32; 4]> {
    let mut edges = std::collections::BTreeMap::new();
    let mut out = Vec::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            if let Some(d) = edges.insert((a.min(b), a.max(b)), c) {
                out.push([a, b, c, d]);
            }
        }
    }
    out
}

/// Random SPD matrix: mass on the diagonal, a random Gram block on each group.
pub fn random_spd<T: Real>(
    random: &mut Random,
    points: usize,
    groups: &[Vec<u32>],
    contacts: usize,
) -> DualMatrix<T> {
    random_spd_of_mass(random, points, groups, contacts, 0.5)
}

pub fn random_spd_of_mass<T: Real>(
    random: &mut Random,
    points: usize,
    groups: &[Vec<u32>],
    contacts: usize,
    mass: f64,
) -> DualMatrix<T> {
    let pattern = Arc::new(Pattern::from_groups(
        points,
        groups.iter().map(Vec::as_slice),
    ));
    let mut stat = Bsr::zeros(Arc::clone(&pattern));
    for i in 0..points {
        stat.add_diagonal(i, mass * (1.0 + 0.8 * random.unit()));
    }
    for group in groups {
        let g: Vec<Matrix3<f64>> = group
            .iter()
            .map(|_| Matrix3::from_fn(|_, _| random.unit()))
            .collect();
        for (a, &i) in group.iter().enumerate() {
            for (b, &j) in group.iter().enumerate() {
                let k = g[a] * g[b].transpose();
                let block = std::array::from_fn(|r| std::array::from_fn(|c| k[(r, c)]));
                let slot = pattern.slot(i, j).expect("group is in the pattern");
                stat.add_block(slot as usize, &block, 1.0);
            }
        }
    }
    let mut a = DualMatrix::new(stat);
    a.dynamic = random_contacts(random, points, contacts);
    a
}

pub fn random_contacts<T: Real>(
    random: &mut Random,
    points: usize,
    contacts: usize,
) -> WeightedBlocks<T> {
    let (mut nodes, mut weights, mut k) = (Vec::new(), Vec::new(), Vec::new());
    for c in 0..contacts {
        nodes.push(std::array::from_fn(|_| random.below(points) as u32));
        let mut w: [f64; 4] = std::array::from_fn(|_| random.unit());
        w[c % 4] = if c % 3 == 0 { 0.0 } else { w[c % 4] };
        weights.push(w);
        k.push(random.spd_block());
    }
    let mut out = WeightedBlocks::new(points);
    out.rebuild(points, &nodes, &weights, &k, 2.0);
    out
}

/// Groups of a small sheet with hinges.
pub fn sheet(w: usize, h: usize) -> (usize, Vec<Vec<u32>>) {
    let t = triangles(w, h);
    let pairs = hinges(&t);
    let groups = pairs.iter().map(|g| g.to_vec());
    let groups = t.iter().map(|g| g.to_vec()).chain(groups).collect();
    (w * h, groups)
}

/// Pins, planes, lines and a free rest.
pub fn random_filter(random: &mut Random, points: usize) -> BlockFilter {
    let mut filter = BlockFilter::new();
    for _ in 0..points / 4 {
        let p = random.below(points) as u32;
        let n = std::array::from_fn(|_| random.unit());
        let value = match random.below(3) {
            0 => filter.fix(p, n),
            1 => filter.constrain(p, n, random.unit()),
            _ => filter.line(p, n),
        };
        value.expect("directions are finite and not zero");
    }
    filter
}

/// Dense symmetric matrix from the lower triangle.
pub fn dense<T: Real>(a: &dyn ExplicitOperator<T>) -> DMatrix<f64> {
    let n = a.dim();
    let mut m = DMatrix::zeros(n, n);
    a.visit_lower(&mut |i, j, v| {
        m[(i, j)] += v;
        if i != j {
            m[(j, i)] += v;
        }
    });
    m
}

pub fn dense_filter(filter: &BlockFilter, n: usize) -> DMatrix<f64> {
    let mut s = DMatrix::identity(n, n);
    for p in filter.points() {
        let block = filter.projector(p).expect("point is constrained");
        for k in 0..9 {
            s[(3 * p as usize + k / 3, 3 * p as usize + k % 3)] = block[k];
        }
    }
    s
}

/// `x = z + (S A S + m (I − S))⁻¹ S (b − A z)` with a dense factorisation.
pub fn reference(a: &DMatrix<f64>, b: &[f64], s: &DMatrix<f64>, z: &[f64]) -> DVector<f64> {
    let n = b.len();
    let (b, z) = (DVector::from_row_slice(b), DVector::from_row_slice(z));
    let m = a.trace() / n as f64;
    let matrix = s * a * s + (DMatrix::identity(n, n) - s) * m;
    let rhs = s * (&b - a * &z);
    let y = matrix.cholesky().expect("system is definite").solve(&rhs);
    s * y + z
}

pub fn relative(a: &[f64], b: &[f64]) -> f64 {
    let scale = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let error = a
        .iter()
        .zip(b)
        .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    error / scale.max(f64::MIN_POSITIVE)
}
