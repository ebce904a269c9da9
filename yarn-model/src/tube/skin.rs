use super::paths::StrandPaths;
use super::spline::rings;
use crate::vec3::V;

/// How finely yarns are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tubes {
    /// Corners of the cross-section, three at least.
    pub sides: usize,
    /// Rings a segment, one at least.
    pub samples: usize,
    /// Every how many visits of a yarn are on the curve; its ends always are.
    pub stride: usize,
}

/// Triangles of tubes; they depend on the ways of the yarns alone, not on where
/// these are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TubeMesh {
    /// Number of vertices.
    pub points: usize,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Yarn of each triangle.
    pub yarns: Vec<u32>,
    /// Visit at which the segment of each triangle begins.
    pub segments: Vec<u32>,
}

/// From fine to coarse; beyond these every second visit goes, again and again.
const DETAIL: [[usize; 2]; 7] = [[12, 6], [8, 4], [8, 3], [6, 2], [4, 2], [4, 1], [3, 1]];

impl Tubes {
    /// The finest tubes of at most `budget` triangles. Where even triangular
    /// tubes through every visit have more, visits are left out; two rings a
    /// yarn remain in any case.
    pub fn within(budget: usize, paths: &StrandPaths) -> Self {
        let mut all = DETAIL.iter().map(|&[sides, samples]| Self {
            sides,
            samples,
            stride: 1,
        });
        let fits = |tubes: &Self| tubes.triangle_count(paths) <= budget;
        let longest = paths.offsets().windows(2).map(|o| o[1] - o[0]).max();
        all.find(fits).unwrap_or_else(|| {
            let mut stride = 2;
            loop {
                let tubes = Self {
                    sides: 3,
                    samples: 1,
                    stride,
                };
                if fits(&tubes) || stride >= longest.unwrap_or(0) as usize {
                    return tubes;
                }
                stride *= 2;
            }
        })
    }

    /// Number of triangles.
    pub fn triangle_count(&self, paths: &StrandPaths) -> usize {
        let yarns = 0..paths.yarn_count();
        let one = |y| 2 * self.sides * (self.ring_count(paths, y) - 1) + 2 * (self.sides - 2);
        yarns.map(one).sum()
    }

    fn ring_count(&self, paths: &StrandPaths, yarn: usize) -> usize {
        (paths.visits(yarn).len() - 1).div_ceil(self.stride) * self.samples + 1
    }

    /// Triangles of the tubes.
    ///
    /// # Panics
    /// If a tube has fewer than three sides, or no sample or stride.
    pub fn mesh(&self, paths: &StrandPaths) -> TubeMesh {
        self.check();
        let count = self.triangle_count(paths);
        let mut mesh = TubeMesh {
            points: 0,
            triangles: Vec::with_capacity(count),
            yarns: Vec::with_capacity(count),
            segments: Vec::with_capacity(count),
        };
        let sides = self.sides as u32;
        for yarn in 0..paths.yarn_count() {
            let visits = paths.visits(yarn);
            let rings = self.ring_count(paths, yarn);
            let start = mesh.points as u32;
            let mut add = |triangle: [u32; 3], ring: usize| {
                mesh.triangles.push(triangle.map(|p| start + p));
                mesh.yarns.push(yarn as u32);
                let visit = visits.start + ring / self.samples * self.stride;
                mesh.segments.push(visit as u32);
            };
            for k in 1..sides - 1 {
                add([0, k + 1, k], 0);
            }
            for ring in 0..rings - 1 {
                let (here, next) = (ring as u32 * sides, (ring as u32 + 1) * sides);
                for k in 0..sides {
                    let l = (k + 1) % sides;
                    add([here + k, here + l, next + k], ring);
                    add([next + k, here + l, next + l], ring);
                }
            }
            let end = (rings as u32 - 1) * sides;
            for k in 1..sides - 1 {
                add([end, end + k, end + k + 1], rings - 2);
            }
            mesh.points += rings * self.sides;
        }
        mesh
    }

    /// Vertices of [`mesh`](Self::mesh) [m] for centre lines as
    /// [`strand_centres`](super::strand_centres) gives them: the corners lie on
    /// the circle of the yarn's radius across the curve.
    ///
    /// # Panics
    /// As [`mesh`](Self::mesh), and if there is no centre for each visit.
    pub fn points(&self, paths: &StrandPaths, centres: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.check();
        assert_eq!(
            centres.len(),
            paths.nodes().len(),
            "a centre for each visit"
        );
        let turn = std::f64::consts::TAU / self.sides as f64;
        let corners: Vec<[f64; 2]> = (0..self.sides)
            .map(|k| {
                let (sin, cos) = (turn * k as f64).sin_cos();
                [cos, sin]
            })
            .collect();
        let mut points = Vec::new();
        let (mut curve, mut along) = (Vec::new(), Vec::new());
        for (yarn, radius) in paths.radii().iter().enumerate() {
            let line = &centres[paths.visits(yarn)];
            curve.clear();
            let but_last = line[..line.len() - 1].iter().step_by(self.stride);
            curve.extend(but_last.map(|c| V::from(*c)));
            curve.push(V::from(line[line.len() - 1]));
            along.clear();
            rings(&curve, self.samples, &mut along);
            for ring in &along {
                let other = ring.tangent.cross(&ring.across);
                let corner = |[cos, sin]: &[f64; 2]| {
                    ring.centre + (ring.across * *cos + other * *sin) * *radius
                };
                points.extend(corners.iter().map(|c| -> [f64; 3] { corner(c).into() }));
            }
        }
        points
    }

    fn check(&self) {
        assert!(
            self.sides >= 3 && self.samples >= 1 && self.stride >= 1,
            "three sides, one sample and a stride of one at least"
        );
    }
}
