//! Depth-buffered triangle filling into a geometry buffer; shading comes later.

use super::camera::Basis;
use super::data::Point;

/// What covers a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cover {
    Nothing,
    /// Cloth: panel, and whether its right side is seen.
    Cloth {
        panel: u16,
        right_side: bool,
    },
    Body,
}

/// Depth, normal and field value of every sample.
pub(super) struct GBuffer {
    pub width: usize,
    pub height: usize,
    /// Distance towards the viewer \[m\], `NEG_INFINITY` where nothing is.
    pub depth: Vec<f32>,
    /// Unit normal in view coordinates, facing the viewer.
    pub normal: Vec<[f32; 3]>,
    /// Field value.
    pub value: Vec<f32>,
    pub cover: Vec<Cover>,
}

/// Maps view coordinates \[m\] to samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewport {
    pub basis: Basis,
    pub centre: [f64; 2],
    /// Samples per metre.
    pub scale: f64,
}

/// A surface ready to be filled.
pub(super) struct Shape<'a> {
    pub points: &'a [Point],
    pub normals: &'a [[f32; 3]],
    pub triangles: &'a [[u32; 3]],
    /// Cloth (with its panels, perhaps none) or body.
    pub panels: Option<&'a [u16]>,
    pub values: Values<'a>,
}

/// The field that a surface carries.
#[derive(Clone, Copy)]
pub(super) enum Values<'a> {
    None,
    Triangle(&'a [f32]),
    Point(&'a [f32]),
}

impl GBuffer {
    pub fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self {
            width,
            height,
            depth: vec![f32::NEG_INFINITY; n],
            normal: vec![[0.0, 0.0, 1.0]; n],
            value: vec![f32::NAN; n],
            cover: vec![Cover::Nothing; n],
        }
    }

    /// Fills a surface; triangles with missing or non-finite corners are left out.
    pub fn fill(&mut self, view: &Viewport, shape: &Shape<'_>) {
        let projected: Vec<[f64; 3]> = shape
            .points
            .iter()
            .map(|p| {
                let c = view.basis.project(*p);
                [
                    (c[0] - view.centre[0]) * view.scale + 0.5 * self.width as f64,
                    0.5 * self.height as f64 - (c[1] - view.centre[1]) * view.scale,
                    c[2],
                ]
            })
            .collect();
        let normals: Vec<[f64; 3]> = shape
            .normals
            .iter()
            .map(|n| view.basis.project(*n))
            .collect();
        for (t, tri) in shape.triangles.iter().enumerate() {
            let ids = tri.map(|i| i as usize);
            if ids
                .iter()
                .any(|&i| i >= projected.len() || i >= normals.len())
            {
                continue;
            }
            let corners = ids.map(|i| projected[i]);
            if corners.iter().flatten().all(|c| c.abs() < 1e9) {
                self.fill_triangle(shape, t, ids, corners, ids.map(|i| normals[i]));
            }
        }
    }

    fn fill_triangle(
        &mut self,
        shape: &Shape<'_>,
        t: usize,
        ids: [usize; 3],
        p: [[f64; 3]; 3],
        n: [[f64; 3]; 3],
    ) {
        let area =
            (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        // Rows grow downwards: counter-clockwise on the fabric is negative here.
        let right_side = area < 0.0;
        let facing = if right_side { 1.0 } else { -1.0 };
        let cover = match shape.panels {
            None => Cover::Body,
            Some(panels) => Cover::Cloth {
                panel: panels.get(t).copied().unwrap_or(0),
                right_side,
            },
        };
        let span = |k: usize, limit: usize| {
            let (a, b, c) = (p[0][k], p[1][k], p[2][k]);
            let low = (a.min(b).min(c) - 0.5).ceil().max(0.0);
            let high = (a.max(b).max(c) - 0.5).floor().min(limit as f64 - 1.0);
            (low <= high).then_some((low as usize, high as usize))
        };
        let (Some((x0, x1)), Some((y0, y1))) = (span(0, self.width), span(1, self.height)) else {
            return;
        };
        // Barycentric coordinates are affine in the sample position.
        let slope = |a: [f64; 3], b: [f64; 3]| [(a[1] - b[1]) / area, (b[0] - a[0]) / area];
        let (s0, s1) = (slope(p[1], p[2]), slope(p[2], p[0]));
        for y in y0..=y1 {
            for x in x0..=x1 {
                let d = [x as f64 + 0.5 - p[2][0], y as f64 + 0.5 - p[2][1]];
                let w0 = s0[0] * d[0] + s0[1] * d[1];
                let w1 = s1[0] * d[0] + s1[1] * d[1];
                let w2 = 1.0 - w0 - w1;
                if w0 < 0.0 || w1 < 0.0 || w2 < 0.0 {
                    continue;
                }
                let depth = (w0 * p[0][2] + w1 * p[1][2] + w2 * p[2][2]) as f32;
                let at = y * self.width + x;
                if depth <= self.depth[at] {
                    continue;
                }
                self.depth[at] = depth;
                self.cover[at] = cover;
                self.value[at] = match shape.values {
                    Values::None => f32::NAN,
                    Values::Triangle(v) => v.get(t).copied().unwrap_or(f32::NAN),
                    Values::Point(v) => {
                        let v = ids.map(|i| f64::from(v.get(i).copied().unwrap_or(f32::NAN)));
                        (w0 * v[0] + w1 * v[1] + w2 * v[2]) as f32
                    }
                };
                let blend = |k: usize| facing * (w0 * n[0][k] + w1 * n[1][k] + w2 * n[2][k]);
                self.normal[at] = facing_normal([blend(0), blend(1), blend(2)]);
            }
        }
    }
}

/// Unit vector that never points away from the viewer.
fn facing_normal(n: [f64; 3]) -> [f32; 3] {
    let n = [n[0], n[1], n[2].max(0.02)];
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    if length.is_finite() && length > 0.0 {
        n.map(|c| (c / length) as f32)
    } else {
        [0.0, 0.0, 1.0]
    }
}

/// Area-weighted normals at the points; zero where there is no valid triangle.
pub(super) fn smooth_normals(points: &[Point], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0f64; 3]; points.len()];
    for tri in triangles {
        let ids = tri.map(|i| i as usize);
        if ids.iter().any(|&i| i >= points.len()) {
            continue;
        }
        let [a, b, c] = ids.map(|i| points[i].map(f64::from));
        let u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
        let n = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        if n.iter().all(|c| c.is_finite()) {
            for i in ids {
                for k in 0..3 {
                    sums[i][k] += n[k];
                }
            }
        }
    }
    sums.into_iter()
        .map(|n| {
            let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            if length > 0.0 && length.is_finite() {
                n.map(|c| (c / length) as f32)
            } else {
                [0.0; 3]
            }
        })
        .collect()
}
