//! A small backward Euler-Newton loop with dense matrices, and helpers.
#![allow(dead_code)] // each test binary uses some of it

use nalgebra::{DMatrix, DVector};
use selvedge_collision::{Aabb, Body, ContactResponse, ContactSource, StepStart, SurfaceSample};
use selvedge_energy::{DofLayout, EvalPoint};

/// Free particles under gravity and contact.
pub struct World {
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub masses: Vec<f64>,
    pub fixed: Vec<bool>,
    pub gravity: [f64; 3],
    pub time: f64,
    pub sources: Vec<Box<dyn ContactSource>>,
    /// Forces of the last accepted evaluation.
    pub response: ContactResponse,
}

impl World {
    pub fn new(q: Vec<f64>, masses: Vec<f64>, sources: Vec<Box<dyn ContactSource>>) -> Self {
        let n = masses.len();
        Self {
            v: vec![0.0; q.len()],
            q,
            masses,
            fixed: vec![false; n],
            gravity: [0.0; 3],
            time: 0.0,
            sources,
            response: ContactResponse::default(),
        }
    }

    /// Some converged steps.
    pub fn run(&mut self, steps: usize, dt: f64) {
        for _ in 0..steps {
            self.step(dt);
        }
    }

    /// One converged step; returns the Newton iterations.
    pub fn step(&mut self, dt: f64) -> usize {
        let n = self.masses.len();
        let layout = DofLayout::points(n);
        let start = self.q.clone();
        let free = |i: usize| !self.fixed[i / 3];
        let guess: Vec<f64> = (0..3 * n)
            .map(|i| {
                let a = if free(i) { self.gravity[i % 3] } else { 0.0 };
                start[i] + dt * self.v[i] + dt * dt * a
            })
            .collect();
        let mut predicted = guess.clone();
        let (mut q, mut out, mut iterations);
        let mut attempts = 0;
        loop {
            (q, out, iterations) = self.solve(&start, &guess, &predicted, dt);
            let at = EvalPoint {
                layout,
                q: &q,
                q_start: &start,
                dt,
            };
            if self.sources.iter().all(|s| s.covers(&at)) {
                break;
            }
            // Detect again where the solution has gone.
            attempts += 1;
            assert!(attempts < 20, "detection does not catch up");
            predicted.copy_from_slice(&q);
        }
        let at = EvalPoint {
            layout,
            q: &q,
            q_start: &start,
            dt,
        };
        for s in &mut self.sources {
            s.commit(&at);
        }
        for i in 0..3 * n {
            self.v[i] = (q[i] - start[i]) / dt;
        }
        self.q = q;
        self.time += dt;
        self.response = out;
        iterations
    }

    fn solve(
        &mut self,
        start: &[f64],
        guess: &[f64],
        predicted: &[f64],
        dt: f64,
    ) -> (Vec<f64>, ContactResponse, usize) {
        let n = self.masses.len();
        let layout = DofLayout::points(n);
        let free = |i: usize| !self.fixed[i / 3];
        for s in &mut self.sources {
            s.detect(&StepStart {
                q_start: start,
                q_predicted: predicted,
                dt,
                time: self.time,
            })
            .unwrap();
        }
        let mut q = predicted.to_vec();
        let mut out = ContactResponse::default();
        let mut evaluate = |q: &[f64], out: &mut ContactResponse| {
            out.clear();
            for s in &mut self.sources {
                let at = EvalPoint {
                    layout,
                    q,
                    q_start: start,
                    dt,
                };
                let e = s.evaluate(&at, true, out).unwrap();
                assert!(e.is_finite());
            }
            let force = spread(n, out);
            let mut r = DVector::zeros(3 * n);
            for i in 0..3 * n {
                if free(i) {
                    r[i] = self.masses[i / 3] * (q[i] - guess[i]) - dt * dt * force[i];
                }
            }
            r
        };
        let mut r = evaluate(&q, &mut out);
        let mut iterations = 0;
        // Speeds below 1e-12 m/s are noise.
        let size = |r: &DVector<f64>| {
            (0..3 * n)
                .map(|i| (r[i] / self.masses[i / 3]).powi(2))
                .sum::<f64>()
                .sqrt()
                / dt
        };
        while size(&r) > 1e-12 && iterations < 200 {
            let mut h = DMatrix::zeros(3 * n, 3 * n);
            add_curvature(&mut h, &out, dt * dt);
            for i in 0..3 * n {
                h[(i, i)] += self.masses[i / 3];
            }
            let unknowns: Vec<usize> = (0..3 * n).filter(|i| free(*i)).collect();
            let h = h.select_rows(&unknowns).select_columns(&unknowns);
            let x = h
                .cholesky()
                .expect("positive definite")
                .solve(&r.select_rows(&unknowns));
            let mut d = DVector::zeros(3 * n);
            unknowns.iter().zip(x.iter()).for_each(|(i, x)| d[*i] = *x);
            let before = size(&r);
            let mut t = 1.0;
            let from = q.clone();
            for halving in 0..8 {
                for i in 0..3 * n {
                    q[i] = from[i] - t * d[i];
                }
                r = evaluate(&q, &mut out);
                if size(&r) < before || halving == 7 {
                    break;
                }
                t *= 0.5;
            }
            iterations += 1;
        }
        (q, out, iterations)
    }

    pub fn point(&self, i: usize) -> [f64; 3] {
        [self.q[3 * i], self.q[3 * i + 1], self.q[3 * i + 2]]
    }

    pub fn velocity(&self, i: usize) -> [f64; 3] {
        [self.v[3 * i], self.v[3 * i + 1], self.v[3 * i + 2]]
    }
}

/// Nodal forces of a response.
pub fn spread(points: usize, r: &ContactResponse) -> Vec<f64> {
    let mut f = vec![0.0; 3 * points];
    for c in 0..r.nodes.len() {
        for i in 0..4 {
            for k in 0..3 {
                f[3 * r.nodes[c][i] as usize + k] += r.weights[c][i] * r.force[c][k];
            }
        }
    }
    for c in 0..r.body_nodes.len() {
        for k in 0..3 {
            f[3 * r.body_nodes[c] as usize + k] += r.body_force[c][k];
        }
    }
    f
}

/// Adds `s Σ w wᵀ ⊗ K`.
pub fn add_curvature(h: &mut DMatrix<f64>, r: &ContactResponse, s: f64) {
    for c in 0..r.nodes.len() {
        for i in 0..4 {
            for j in 0..4 {
                let w = s * r.weights[c][i] * r.weights[c][j];
                for k in 0..3 {
                    for l in 0..3 {
                        let at = (
                            3 * r.nodes[c][i] as usize + k,
                            3 * r.nodes[c][j] as usize + l,
                        );
                        h[at] += w * r.curvature[c][k][l];
                    }
                }
            }
        }
    }
    for c in 0..r.body_nodes.len() {
        for k in 0..3 {
            for l in 0..3 {
                let n = 3 * r.body_nodes[c] as usize;
                h[(n + k, n + l)] += s * r.body_curvature[c][k][l];
            }
        }
    }
}

/// Energy and response of a source at `q`.
pub fn evaluate(
    s: &mut dyn ContactSource,
    q: &[f64],
    q_start: &[f64],
    dt: f64,
) -> (f64, ContactResponse) {
    let mut out = ContactResponse::default();
    let at = EvalPoint {
        layout: DofLayout::points(q.len() / 3),
        q,
        q_start,
        dt,
    };
    let e = s.evaluate(&at, true, &mut out).unwrap();
    (e, out)
}

/// Detection for motions from `q_start` to `q_end`.
pub fn detect(s: &mut dyn ContactSource, q_start: &[f64], q_end: &[f64], dt: f64) {
    s.detect(&StepStart {
        q_start,
        q_predicted: q_end,
        dt,
        time: 0.0,
    })
    .unwrap();
}

/// Force, and minus the central difference of the energy at `q`, along random
/// directions.
///
/// With the smallest step that round-off allows: energies of contact bend where
/// pairs enter.
pub fn along_random_ways(
    s: &mut dyn ContactSource,
    q: &[f64],
    q_start: &[f64],
    force: &[f64],
    seed: u64,
) -> Vec<[f64; 2]> {
    let h = 1e-9;
    let mut random = Random(seed);
    let way = |_| {
        let way: Vec<f64> = q.iter().map(|_| random.next()).collect();
        let slope: f64 = way.iter().zip(force).map(|(w, f)| w * f).sum();
        let mut energy = |t: f64| {
            let moved: Vec<f64> = q.iter().zip(&way).map(|(q, w)| q + t * w).collect();
            evaluate(s, &moved, q_start, 1e-3).0
        };
        [slope, -(energy(h) - energy(-h)) / (2.0 * h)]
    };
    (0..8).map(way).collect()
}

/// `y ≤ height(t)`, moving along x at `speed`.
pub struct Floor {
    pub speed: [f64; 3],
}

impl Body for Floor {
    fn name(&self) -> &str {
        "floor"
    }
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
        SurfaceSample {
            distance: p[1] - self.speed[1] * time,
            normal: [0.0, 1.0, 0.0],
            velocity: self.speed,
        }
    }
    fn bounds(&self, time: f64) -> Aabb {
        let i = f64::INFINITY;
        Aabb {
            min: [-i; 3],
            max: [i, self.speed[1] * time, i],
        }
    }
    fn to_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        std::array::from_fn(|i| p[i] - self.speed[i] * time)
    }
    fn from_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        std::array::from_fn(|i| p[i] + self.speed[i] * time)
    }
}

/// SplitMix64 in [-1, 1].
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn point(&mut self, s: f64) -> [f64; 3] {
        [0; 3].map(|_| s * self.next())
    }
}

/// `nx × ny` cells of size `a` in the plane `z = height`, two triangles each,
/// appended to `q` and `triangles`.
pub fn add_sheet(
    q: &mut Vec<f64>,
    triangles: &mut Vec<[u32; 3]>,
    nx: usize,
    ny: usize,
    a: f64,
    height: f64,
) {
    let base = (q.len() / 3) as u32;
    for j in 0..=ny {
        for i in 0..=nx {
            q.extend([i as f64 * a, j as f64 * a, height]);
        }
    }
    let at = |i: usize, j: usize| base + (j * (nx + 1) + i) as u32;
    for j in 0..ny {
        for i in 0..nx {
            let (p, r, s, t) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if (i + j) % 2 == 0 {
                triangles.extend([[p, r, s], [p, s, t]]);
            } else {
                triangles.extend([[p, r, t], [r, s, t]]);
            }
        }
    }
}
