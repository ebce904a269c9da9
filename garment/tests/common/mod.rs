//! What several tests share: data files, and a standing person as a signed
//! distance field.
#![allow(dead_code)]

use std::path::PathBuf;

/// The shared data folder, if this checkout has one.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/data")
        .join(folder);
    if path.is_dir() {
        Some(path)
    } else {
        println!("skipped: {} is absent", path.display());
        None
    }
}

/// The twelve patterns, sorted by name.
pub fn garments() -> Vec<(String, Vec<u8>)> {
    let Some(folder) = shared("garments") else {
        return Vec::new();
    };
    let mut list: Vec<(String, Vec<u8>)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "json"))
        .map(|p| {
            let name = p.file_stem().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read(p).unwrap())
        })
        .collect();
    list.sort();
    list
}

/// The project's own T-shirt.
pub fn tshirt() -> Vec<u8> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../scenes/patterns/tshirt.json"
    );
    std::fs::read(path).unwrap()
}

fn capsule(p: [f64; 3], a: [f64; 3], b: [f64; 3], ra: f64, rb: f64) -> f64 {
    let (mut pa_ba, mut ba_ba) = (0.0, 0.0);
    for k in 0..3 {
        pa_ba += (p[k] - a[k]) * (b[k] - a[k]);
        ba_ba += (b[k] - a[k]).powi(2);
    }
    let t = (pa_ba / ba_ba).clamp(0.0, 1.0);
    let d: f64 = (0..3)
        .map(|k| (p[k] - a[k] - t * (b[k] - a[k])).powi(2))
        .sum();
    d.sqrt() - (ra + t * (rb - ra))
}

fn ellipsoid(p: [f64; 3], c: [f64; 3], r: [f64; 3]) -> f64 {
    let (mut k0, mut k1) = (0.0, 0.0);
    for k in 0..3 {
        let d = p[k] - c[k];
        k0 += (d / r[k]).powi(2);
        k1 += (d / (r[k] * r[k])).powi(2);
    }
    if k1 > 1e-12 {
        k0.sqrt() * (k0.sqrt() - 1.0) / k1.sqrt()
    } else {
        -r[0].min(r[1]).min(r[2])
    }
}

fn distance(q: [f64; 3]) -> f64 {
    let p = [q[0].abs(), q[1], q[2]]; // left and right alike
    [
        ellipsoid(p, [0.0, 1.584, 0.020], [0.074, 0.115, 0.094]),
        capsule(p, [0.0, 1.400, -0.020], [0.0, 1.530, 0.005], 0.056, 0.053),
        ellipsoid(p, [0.0, 1.250, 0.0], [0.158, 0.190, 0.112]),
        ellipsoid(p, [0.0, 1.060, 0.0], [0.122, 0.170, 0.092]),
        ellipsoid(p, [0.0, 0.890, -0.005], [0.166, 0.125, 0.112]),
        capsule(
            p,
            [0.030, 1.435, -0.020],
            [0.170, 1.378, -0.012],
            0.052,
            0.050,
        ),
        capsule(
            p,
            [0.195, 1.372, -0.010],
            [0.410, 1.192, -0.010],
            0.052,
            0.039,
        ),
        capsule(
            p,
            [0.410, 1.192, -0.010],
            [0.601, 1.031, 0.010],
            0.039,
            0.027,
        ),
        capsule(
            p,
            [0.601, 1.031, 0.010],
            [0.690, 0.956, 0.020],
            0.028,
            0.024,
        ),
        capsule(p, [0.086, 0.830, 0.0], [0.092, 0.470, 0.0], 0.084, 0.056),
        capsule(p, [0.092, 0.470, 0.0], [0.098, 0.085, -0.020], 0.055, 0.036),
    ]
    .into_iter()
    .fold(f64::MAX, f64::min)
}

/// A person of 1.70 m, arms 40° below the horizontal: signed distance [m]
/// and gradient.
pub fn person(p: [f64; 3]) -> (f64, [f64; 3]) {
    let mut g = [0.0; 3];
    for k in 0..3 {
        let (mut low, mut high) = (p, p);
        low[k] -= 1e-5;
        high[k] += 1e-5;
        g[k] = (distance(high) - distance(low)) / 2e-5;
    }
    (distance(p), g)
}
