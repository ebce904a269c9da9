//! Light on the geometry buffer: a warm key from the upper left, a cool fill,
//! sky and ground ambient, occlusion from the depth buffer, a soft rim.

use super::camera::Basis;
use super::colour::{self, ColourMap};
use super::raster::{Cover, GBuffer};

/// How covered samples get their colour.
#[derive(Clone, Copy)]
pub(super) enum Ink {
    /// One fabric, right and wrong side told apart.
    Fabric,
    /// A tint for each panel.
    Panels,
    /// A field between `low` and `high`.
    Map { map: ColourMap, low: f32, high: f32 },
}

/// A soft shadow on the plane `y = level`.
pub(super) struct Ground {
    pub level: f64,
    pub origin: [f64; 2],
    pub texel: f64,
    pub side: usize,
    /// Darkness 0..=1, row by row in z.
    pub dark: Vec<f32>,
}

type Rgb = [f64; 3];

/// Right side of the fabric: warm linen; wrong side: cool slate (linear light).
pub(super) const RIGHT_SIDE: Rgb = [0.76, 0.56, 0.38];
pub(super) const WRONG_SIDE: Rgb = [0.27, 0.37, 0.47];
pub(super) const BODY: Rgb = [0.40, 0.40, 0.41];

/// Tints before they repeat.
pub(super) const TINTS: usize = 512;

const KEY: Rgb = [-0.449_4, 0.649_2, 0.613_6];
const FILL: Rgb = [0.826_4, 0.110_2, 0.552_2];

/// Colour of a lit sample in linear light.
fn lit(n: Rgb, albedo: Rgb, open: f64, contrast: f64) -> Rgb {
    let key = ((dot(n, KEY) + 0.12) / 1.12).max(0.0) * (0.55 + 0.45 * open);
    let fill = dot(n, FILL).max(0.0) * open;
    let sky = 0.5 + 0.5 * n[1];
    let rim = (1.0 - n[2]).powi(4) * (0.35 + 0.65 * sky) * 0.16 * open;
    let key_colour = [1.04, 0.97, 0.87];
    let fill_colour = [0.13, 0.16, 0.22];
    std::array::from_fn(|k| {
        let ambient = ([0.20, 0.18, 0.17][k] * (1.0 - sky) + [0.30, 0.33, 0.38][k] * sky) * open;
        let light = key_colour[k] * key * 0.88 + fill_colour[k] * fill + ambient;
        albedo[k] * (1.0 - contrast + contrast * light) + rim * contrast
    })
}

/// Shades all samples: premultiplied linear RGB and coverage.
pub(super) fn shade(
    g: &GBuffer,
    scale: f64,
    basis: &Basis,
    centre: [f64; 2],
    ink: Ink,
    ground: Option<&Ground>,
) -> Vec<[f32; 4]> {
    let table: Vec<Rgb> = match ink {
        Ink::Map { map, .. } => (0..512).map(|i| map.linear(f64::from(i) / 511.0)).collect(),
        _ => Vec::new(),
    };
    let tints: Vec<Rgb> = match ink {
        Ink::Panels => (0..TINTS).map(colour::panel_colour).collect(),
        _ => Vec::new(),
    };
    let occlusion = Occlusion::new(g.height, scale);
    let mut out = vec![[0.0f32; 4]; g.width * g.height];
    for y in 0..g.height {
        for x in 0..g.width {
            let at = y * g.width + x;
            let n = g.normal[at].map(f64::from);
            let (albedo, contrast) = match (g.cover[at], ink) {
                (Cover::Nothing, _) => {
                    if let Some(ground) = ground {
                        let u = (x as f64 + 0.5 - 0.5 * g.width as f64) / scale + centre[0];
                        let v = (0.5 * g.height as f64 - y as f64 - 0.5) / scale + centre[1];
                        out[at][3] = 0.42 * ground.shadow(basis, u, v);
                    }
                    continue;
                }
                (Cover::Body, Ink::Map { .. }) => (BODY.map(|c| c * 0.5), 0.9),
                (Cover::Body, _) => (BODY, 1.0),
                (Cover::Cloth { .. }, Ink::Map { low, high, .. }) => {
                    (mapped(&table, g.value[at], low, high), 0.62)
                }
                (Cover::Cloth { right_side, .. }, Ink::Fabric) => {
                    (if right_side { RIGHT_SIDE } else { WRONG_SIDE }, 1.0)
                }
                (Cover::Cloth { panel, right_side }, Ink::Panels) => {
                    let tint = tints[usize::from(panel) % TINTS];
                    (
                        if right_side {
                            tint
                        } else {
                            tint.map(|c| c * 0.55)
                        },
                        1.0,
                    )
                }
            };
            let open = 1.0 - f64::from(occlusion.at(g, x, y));
            let mut c = lit(n, albedo, open, contrast);
            if seam(g, x, y, scale) {
                c = c.map(|c| c * 0.62);
            }
            let c = c.map(|c| c.clamp(0.0, 1.0) as f32);
            out[at] = [c[0], c[1], c[2], 1.0];
        }
    }
    out
}

fn mapped(table: &[Rgb], value: f32, low: f32, high: f32) -> Rgb {
    if !value.is_finite() {
        return colour::MISSING.map(colour::decode);
    }
    let t = (f64::from(value) - f64::from(low)) / (f64::from(high) - f64::from(low));
    let last = table.len() - 1;
    table[((t.clamp(0.0, 1.0) * last as f64).round() as usize).min(last)]
}

/// Directions of the occlusion samples (unit circle) and their radii (0..=1).
const RING: [([f64; 2], f64); 10] = [
    ([1.0, 0.0], 0.12),
    ([-0.737, 0.676], 0.28),
    ([0.087, -0.996], 0.20),
    ([0.608, 0.794], 0.42),
    ([-0.985, -0.174], 0.36),
    ([0.844, -0.536], 0.58),
    ([-0.259, 0.966], 0.52),
    ([-0.461, -0.887], 0.74),
    ([0.939, 0.343], 0.86),
    ([-0.923, 0.386], 1.00),
];

/// Sample offsets for the four samples of a pixel, turned against each other: their
/// mean is smooth, without noise between pixels.
struct Occlusion {
    /// Offset in samples and the same in metres.
    offsets: [[([i32; 2], [f32; 2]); RING.len()]; 4],
    /// Reach \[m\].
    radius: f32,
}

impl Occlusion {
    fn new(height: usize, scale: f64) -> Self {
        let reach = 0.075 * height as f64;
        let offsets = std::array::from_fn(|k| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_8 * k as f64).sin_cos();
            RING.map(|(d, r)| {
                let step = [d[0] * cos - d[1] * sin, d[0] * sin + d[1] * cos]
                    .map(|c| (c * r * reach).round());
                (
                    step.map(|c| c as i32),
                    [(step[0] / scale) as f32, (-step[1] / scale) as f32],
                )
            })
        });
        Self {
            offsets,
            radius: (reach / scale) as f32,
        }
    }

    /// How much of the surrounding light is blocked, from neighbours in the depth
    /// buffer above the tangent plane (obscurance with a quadratic fall-off).
    fn at(&self, g: &GBuffer, x: usize, y: usize) -> f32 {
        let at = y * g.width + x;
        let (n, depth) = (g.normal[at], g.depth[at]);
        let fade = 1.0 / (4.0 * self.radius * self.radius);
        let mut sum = 0.0f32;
        for (step, metres) in &self.offsets[(x & 1) * 2 + (y & 1)] {
            let (sx, sy) = (x as i32 + step[0], y as i32 + step[1]);
            if sx < 0 || sy < 0 || sx >= g.width as i32 || sy >= g.height as i32 {
                continue;
            }
            let other = g.depth[sy as usize * g.width + sx as usize];
            if other == f32::NEG_INFINITY {
                continue;
            }
            let v = [metres[0], metres[1], other - depth];
            let above = v[0] * n[0] + v[1] * n[1] + v[2] * n[2] - 0.02 * self.radius;
            if above > 0.0 {
                let length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
                let fall = (1.0 - length2 * fade).max(0.0);
                sum += fall * above / length2.sqrt().max(1e-9);
            }
        }
        (1.5 * sum / RING.len() as f32).min(0.85)
    }
}

/// Whether a seam between two panels passes through the sample.
fn seam(g: &GBuffer, x: usize, y: usize, scale: f64) -> bool {
    let at = y * g.width + x;
    let Cover::Cloth { panel, right_side } = g.cover[at] else {
        return false;
    };
    [(1, 0), (0, 1), (1, 1), (2, 0), (0, 2)].iter().any(|&(dx, dy)| {
        let (sx, sy) = (x + dx, y + dy);
        if sx >= g.width || sy >= g.height {
            return false;
        }
        let other = sy * g.width + sx;
        matches!(g.cover[other], Cover::Cloth { panel: p, right_side: r } if p != panel && r == right_side)
            && f64::from((g.depth[other] - g.depth[at]).abs()) * scale < 8.0
    })
}

impl Ground {
    /// Darkness where the line of sight through `(u, v)` meets the ground.
    fn shadow(&self, basis: &Basis, u: f64, v: f64) -> f32 {
        if basis.toward[1] < 0.05 {
            return 0.0;
        }
        let at = |k: usize, t: f64| u * basis.right[k] + v * basis.up[k] + t * basis.toward[k];
        let t = (self.level - at(1, 0.0)) / basis.toward[1];
        let x = (at(0, t) - self.origin[0]) / self.texel - 0.5;
        let z = (at(2, t) - self.origin[1]) / self.texel - 0.5;
        let limit = (self.side - 1) as f64;
        if !(x >= 0.0 && z >= 0.0 && x < limit && z < limit) {
            return 0.0;
        }
        let (i, j) = (x as usize, z as usize);
        let (fx, fz) = ((x - i as f64) as f32, (z - j as f64) as f32);
        let d = |i: usize, j: usize| self.dark[j * self.side + i];
        (d(i, j) * (1.0 - fx) + d(i + 1, j) * fx) * (1.0 - fz)
            + (d(i, j + 1) * (1.0 - fx) + d(i + 1, j + 1) * fx) * fz
    }
}

fn dot(a: Rgb, b: Rgb) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
