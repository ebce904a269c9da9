//! Pictures of a state: extent, filling, shading, four samples a pixel, PNG.

use super::camera::{self, Basis, Extent, View};
use super::colour::{self, ColourMap};
use super::data::{Field, Point, ReportMesh, ReportSurface};
use super::error::ReportError;
use super::raster::{GBuffer, Shape, Values, Viewport, smooth_normals};
use super::shade::{self, Ground, Ink};
use super::stats::FieldStats;

/// Largest side of a picture \[pixels\].
pub const MAX_SIDE: u32 = 4096;

/// What the cloth's colour means.
#[derive(Debug, Clone, Copy)]
pub enum Paint<'a> {
    /// Fabric: warm on the right side, cool on the wrong side.
    Fabric,
    /// A tint for each panel.
    Panels,
    /// A field with one value a triangle.
    Triangles(&'a Field),
    /// A field with one value a point.
    Points(&'a Field),
}

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// Cloth topology.
    pub mesh: &'a ReportMesh,
    /// Cloth points \[m\].
    pub positions: &'a [Point],
    /// Bodies behind and under the cloth.
    pub bodies: &'a [ReportSurface],
    /// Meaning of the cloth's colour.
    pub paint: Paint<'a>,
}

/// How it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureStyle {
    /// Metres per pixel; `None` fits the picture.
    pub metres_per_pixel: Option<f64>,
    /// Free border as a part of the size.
    pub margin: f64,
    /// Whether a soft shadow falls on the ground (seen from above only).
    pub ground_shadow: bool,
}

impl Default for PictureStyle {
    fn default() -> Self {
        Self {
            metres_per_pixel: None,
            margin: 0.05,
            ground_shadow: false,
        }
    }
}

/// An encoded picture with its scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// PNG file: RGBA, transparent background.
    pub png: Vec<u8>,
    /// Width \[pixels\].
    pub width: u32,
    /// Height \[pixels\].
    pub height: u32,
    /// Size of a pixel \[m\].
    pub metres_per_pixel: f64,
}

/// Draws a picture and encodes it as PNG.
///
/// # Errors
/// See [`picture`].
pub fn picture_png(
    subject: &Subject<'_>,
    view: View,
    size: [u32; 2],
    style: &PictureStyle,
) -> Result<Vec<u8>, ReportError> {
    picture(subject, view, size, style).map(|p| p.png)
}

/// Draws a picture: orthographic, depth-buffered, 2 x 2 samples a pixel. The same
/// input gives the same bytes.
///
/// Triangles with points that are missing or not finite are left out.
///
/// # Errors
/// [`ReportError::PictureSize`] for a side of 0 or beyond [`MAX_SIDE`];
/// [`ReportError::NothingToDraw`] without any finite point.
pub fn picture(
    subject: &Subject<'_>,
    view: View,
    size: [u32; 2],
    style: &PictureStyle,
) -> Result<Picture, ReportError> {
    let [width, height] = size;
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
        return Err(ReportError::PictureSize {
            width,
            height,
            limit: MAX_SIDE,
        });
    }
    let basis = view.basis();
    let extent = subject_extent(subject, &basis)?;
    let metres_per_pixel = style
        .metres_per_pixel
        .filter(|m| m.is_finite() && *m > 0.0)
        .unwrap_or_else(|| fit(&extent, size, style.margin));
    let viewport = Viewport {
        basis,
        centre: extent.centre,
        scale: 2.0 / metres_per_pixel,
    };
    let mut g = GBuffer::new(2 * width as usize, 2 * height as usize);
    fill(&mut g, &viewport, subject);
    let ground = style
        .ground_shadow
        .then(|| ground(subject, &extent))
        .flatten();
    let samples = shade::shade(
        &g,
        viewport.scale,
        &basis,
        viewport.centre,
        ink(subject.paint),
        ground.as_ref(),
    );
    let pixels = resolve(&samples, width as usize, height as usize);
    Ok(Picture {
        png: encode(&pixels, width, height)?,
        width,
        height,
        metres_per_pixel,
    })
}

/// Extent of the subject in a view.
pub(super) fn subject_extent(subject: &Subject<'_>, basis: &Basis) -> Result<Extent, ReportError> {
    let bodies = subject.bodies.iter().map(|b| b.points.as_slice());
    camera::extent(basis, subject.positions, bodies).ok_or_else(|| ReportError::NothingToDraw {
        points: subject.positions.len()
            + subject.bodies.iter().map(|b| b.points.len()).sum::<usize>(),
    })
}

/// Metres per pixel that show the extent with a margin.
pub(super) fn fit(extent: &Extent, size: [u32; 2], margin: f64) -> f64 {
    let inner = (1.0 - 2.0 * margin.clamp(0.0, 0.4)).max(0.1);
    let need = |k: usize| 2.0 * extent.half[k] / (f64::from(size[k]) * inner);
    need(0).max(need(1))
}

fn fill(g: &mut GBuffer, viewport: &Viewport, subject: &Subject<'_>) {
    let normals = smooth_normals(subject.positions, &subject.mesh.triangles);
    let values = match subject.paint {
        Paint::Fabric | Paint::Panels => Values::None,
        Paint::Triangles(f) => Values::Triangle(&f.values),
        Paint::Points(f) => Values::Point(&f.values),
    };
    g.fill(
        viewport,
        &Shape {
            points: subject.positions,
            normals: &normals,
            triangles: &subject.mesh.triangles,
            panels: Some(&subject.mesh.panel),
            values,
        },
    );
    for body in subject.bodies {
        let normals = smooth_normals(&body.points, &body.triangles);
        g.fill(
            viewport,
            &Shape {
                points: &body.points,
                normals: &normals,
                triangles: &body.triangles,
                panels: None,
                values: Values::None,
            },
        );
    }
}

fn ink(paint: Paint<'_>) -> Ink {
    match paint {
        Paint::Fabric => Ink::Fabric,
        Paint::Panels => Ink::Panels,
        Paint::Triangles(f) | Paint::Points(f) => {
            let (low, high) = FieldStats::of(f).scale;
            Ink::Map {
                map: map_of(f),
                low,
                high,
            }
        }
    }
}

/// The colour scale of a field.
pub(super) fn map_of(field: &Field) -> ColourMap {
    if field.diverging {
        ColourMap::Diverging
    } else {
        ColourMap::Sequential
    }
}

/// Shadow on the lowest level of the subject: seen from below, darker where the
/// lowest surface is near, then blurred.
fn ground(subject: &Subject<'_>, extent: &Extent) -> Option<Ground> {
    const SIDE: usize = 160;
    let basis = Basis {
        right: [1.0, 0.0, 0.0],
        up: [0.0, 0.0, 1.0],
        toward: [0.0, -1.0, 0.0],
    };
    let below = subject_extent(subject, &basis).ok()?;
    let level = subject
        .positions
        .iter()
        .chain(subject.bodies.iter().flat_map(|b| &b.points))
        .filter(|p| camera::drawable(p))
        .map(|p| f64::from(p[1]))
        .fold(f64::INFINITY, f64::min);
    let size = extent.half[0].max(extent.half[1]);
    let width = 2.0 * below.half[0].max(below.half[1]) * 1.6;
    let texel = width / SIDE as f64;
    let mut g = GBuffer::new(SIDE, SIDE);
    fill(
        &mut g,
        &Viewport {
            basis,
            centre: below.centre,
            scale: 1.0 / texel,
        },
        subject,
    );
    let mut dark: Vec<f32> = g
        .depth
        .iter()
        .map(|&d| {
            let height = -f64::from(d) - level;
            if height.is_finite() {
                (-height.max(0.0) / (0.9 * size)).exp() as f32
            } else {
                0.0
            }
        })
        .collect();
    // Rows of the buffer grow towards −z; the ground's rows grow towards +z.
    let rows: Vec<f32> = dark.rchunks(SIDE).flatten().copied().collect();
    dark = rows;
    for _ in 0..3 {
        dark = blur(&dark, SIDE, 4);
    }
    let corner = [0, 1].map(|k| below.centre[k] - 0.5 * width);
    Some(Ground {
        level,
        origin: corner,
        texel,
        side: SIDE,
        dark,
    })
}

/// Box blur in both directions.
fn blur(image: &[f32], side: usize, radius: usize) -> Vec<f32> {
    let pass = |image: &[f32], stride: usize, across: usize| {
        let mut out = vec![0.0; side * side];
        for line in 0..side {
            for i in 0..side {
                let (a, b) = (i.saturating_sub(radius), (i + radius).min(side - 1));
                let sum: f32 = (a..=b).map(|k| image[line * across + k * stride]).sum();
                out[line * across + i * stride] = sum / (2 * radius + 1) as f32;
            }
        }
        out
    };
    pass(&pass(image, 1, side), side, 1)
}

/// Averages 2 x 2 samples in linear light; straight alpha, sRGB bytes.
fn resolve(samples: &[[f32; 4]], width: usize, height: usize) -> Vec<u8> {
    const STEPS: f64 = 16_384.0;
    let table: Vec<u8> = (0..=STEPS as u32)
        .map(|i| colour::encode(f64::from(i) / STEPS))
        .collect();
    let mut out = Vec::with_capacity(4 * width * height);
    for y in 0..height {
        for x in 0..width {
            let at = 4 * width * y + 2 * x;
            let mut sum = [0.0f32; 4];
            for s in [at, at + 1, at + 2 * width, at + 2 * width + 1] {
                for k in 0..4 {
                    sum[k] += samples[s][k];
                }
            }
            let alpha = sum[3] / 4.0;
            let colour = |k: usize| {
                let c = if sum[3] > 0.0 { sum[k] / sum[3] } else { 0.0 };
                table[((c * STEPS as f32).round() as usize).min(table.len() - 1)]
            };
            out.extend([
                colour(0),
                colour(1),
                colour(2),
                (alpha * 255.0).round() as u8,
            ]);
        }
    }
    out
}

fn encode(pixels: &[u8], width: u32, height: u32) -> Result<Vec<u8>, ReportError> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(out)
}

#[cfg(test)]
#[path = "picture_tests.rs"]
mod tests;
