//! Shared by the tests of bodies.
#![allow(dead_code)] // each test file uses a part

use selvedge_collision::body::Body;

pub fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

pub fn add_scaled(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + s * b[i])
}

pub fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Uniform numbers in [0, 1) (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
    pub fn point(&mut self, half: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.within(-half, half))
    }
}

/// Largest difference of the normal to central differences of the distance.
pub fn gradient_error(body: &dyn Body, p: [f64; 3], time: f64, eps: f64) -> f64 {
    let n = body.sample(p, time).normal;
    (0..3)
        .map(|i| {
            let (mut a, mut b) = (p, p);
            a[i] -= eps;
            b[i] += eps;
            let slope =
                (body.sample(b, time).distance - body.sample(a, time).distance) / (2.0 * eps);
            (slope - n[i]).abs()
        })
        .fold(0.0, f64::max)
}

/// A closed sphere of `2 rings (rings − 1) · 2` triangles.
pub fn sphere(center: [f64; 3], radius: f64, rings: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    use std::f64::consts::PI;
    let around = 2 * rings;
    let at = |polar: f64, turn: f64| {
        let d = [
            polar.sin() * turn.cos(),
            polar.cos(),
            polar.sin() * turn.sin(),
        ];
        add_scaled(center, d, radius)
    };
    let mut points = vec![at(0.0, 0.0)];
    for i in 1..rings {
        for j in 0..around {
            points.push(at(
                PI * i as f64 / rings as f64,
                2.0 * PI * j as f64 / around as f64,
            ));
        }
    }
    points.push(at(PI, 0.0));
    let last = points.len() as u32 - 1;
    let ring = |i: usize, j: usize| (1 + (i - 1) * around + j % around) as u32;
    let mut triangles = Vec::new();
    for j in 0..around {
        triangles.push([0, ring(1, j + 1), ring(1, j)]);
        triangles.push([last, ring(rings - 1, j), ring(rings - 1, j + 1)]);
        for i in 1..rings - 1 {
            triangles.push([ring(i, j), ring(i, j + 1), ring(i + 1, j)]);
            triangles.push([ring(i + 1, j), ring(i, j + 1), ring(i + 1, j + 1)]);
        }
    }
    (points, triangles)
}

/// A closed box of 12 triangles.
pub fn cuboid(center: [f64; 3], half: [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let points = (0..8)
        .map(|n| {
            std::array::from_fn(|a| center[a] + if n >> a & 1 == 1 { half[a] } else { -half[a] })
        })
        .collect();
    let quads: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .collect();
    (points, triangles)
}

pub fn joined(
    (mut points, mut triangles): (Vec<[f64; 3]>, Vec<[u32; 3]>),
    other: (Vec<[f64; 3]>, Vec<[u32; 3]>),
) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let offset = points.len() as u32;
    points.extend(other.0);
    triangles.extend(other.1.iter().map(|t| t.map(|p| p + offset)));
    (points, triangles)
}
