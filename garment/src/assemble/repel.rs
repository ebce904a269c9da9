//! Keeping layers of cloth apart: points repel each other like balls.
//!
//! Balls of radius 0.35 edge lengths seal a sheet: the middle of an
//! equilateral triangle is 0.58 edge lengths from its corners, less than the
//! distance two points keep. Points within two edges of each other are
//! exempt.

use crate::GarmentMesh;
use crate::math::{dot, sub};

/// Distance points keep, in edge lengths.
const DISTANCE: f64 = 0.7;

pub(super) struct Repel {
    distance: f64,
    /// Two-ring neighbours of each point, ascending.
    start: Vec<u32>,
    near: Vec<u32>,
    passing: Vec<bool>,
    // Hash grid, kept to avoid allocation.
    bucket: Vec<u32>,
    count: Vec<u32>,
    sorted: Vec<u32>,
}

impl Repel {
    pub(super) fn new(mesh: &GarmentMesh) -> Self {
        let points = mesh.points_initial.len();
        let mut first: Vec<Vec<u32>> = vec![Vec::new(); points];
        for t in &mesh.triangles {
            for k in 0..3 {
                first[t[k] as usize].extend([t[(k + 1) % 3], t[(k + 2) % 3]]);
            }
        }
        for s in &mesh.spring_seams {
            first[s.point as usize].extend(s.edge);
            for e in s.edge {
                first[e as usize].push(s.point);
            }
        }
        for list in &mut first {
            list.sort_unstable();
            list.dedup();
        }
        let mut start = vec![0u32];
        let mut near = Vec::new();
        let mut ring = Vec::new();
        for i in 0..points {
            ring.clear();
            for &j in &first[i] {
                ring.push(j);
                ring.extend(&first[j as usize]);
            }
            ring.sort_unstable();
            ring.dedup();
            near.extend(&ring);
            start.push(near.len() as u32);
        }
        let table = points.next_power_of_two().max(64);
        Self {
            distance: DISTANCE * mesh.settings.edge_length,
            start,
            near,
            passing: vec![false; points],
            bucket: vec![0; points],
            count: vec![0; table + 1],
            sorted: vec![0; points],
        }
    }

    fn cell(&self, p: [f64; 3]) -> [i64; 3] {
        p.map(|x| (x / self.distance).floor() as i64)
    }

    fn hash(&self, c: [i64; 3]) -> usize {
        let h = (c[0] as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (c[1] as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ (c[2] as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
        (h ^ (h >> 29)) as usize & (self.count.len() - 2)
    }

    /// Lets these points pass: they repel nothing from now on.
    pub(super) fn set_passing(&mut self, points: &[u32]) {
        self.passing.fill(false);
        for &p in points {
            self.passing[p as usize] = true;
        }
    }

    /// Moves points that are too close apart, each by half of what is
    /// missing.
    pub(super) fn apply(&mut self, x: &mut [[f64; 3]]) {
        self.count.fill(0);
        for (i, p) in x.iter().enumerate() {
            let b = self.hash(self.cell(*p));
            self.bucket[i] = b as u32;
            self.count[b + 1] += 1;
        }
        for b in 1..self.count.len() {
            self.count[b] += self.count[b - 1];
        }
        // Filling from the back leaves `count[b]` at the start of bucket `b`
        // and every bucket in ascending order.
        for i in (0..x.len()).rev() {
            let b = self.bucket[i] as usize + 1;
            self.count[b] -= 1;
            self.sorted[self.count[b] as usize] = i as u32;
        }
        let d2 = self.distance * self.distance;
        for i in 0..x.len() {
            let c = self.cell(x[i]);
            let mut done = [usize::MAX; 27];
            for k in 0..27 {
                let o = [k % 3, (k / 3) % 3, k / 9].map(|o| o as i64 - 1);
                let b = self.hash([c[0] + o[0], c[1] + o[1], c[2] + o[2]]);
                if done[..k].contains(&b) {
                    continue; // two cells in one bucket
                }
                done[k] = b;
                let from = self.count[b + 1] as usize;
                let to = self.count.get(b + 2).map_or(x.len(), |&n| n as usize);
                for s in from..to {
                    let j = self.sorted[s] as usize;
                    if j <= i || self.passing[i] || self.passing[j] {
                        continue;
                    }
                    let d = sub(x[j], x[i]);
                    let l2 = dot(d, d);
                    if l2 >= d2 || l2 < 1e-20 || self.are_near(i, j) {
                        continue;
                    }
                    let l = l2.sqrt();
                    let s = 0.5 * (self.distance - l) / l;
                    for k in 0..3 {
                        x[i][k] -= s * d[k];
                        x[j][k] += s * d[k];
                    }
                }
            }
        }
    }

    fn are_near(&self, i: usize, j: usize) -> bool {
        let ring = &self.near[self.start[i] as usize..self.start[i + 1] as usize];
        ring.binary_search(&(j as u32)).is_ok()
    }
}
