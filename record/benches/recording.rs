//! Time a frame of a large garment: 50,176 points, 99,458 triangles.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use selvedge_record::compare::{SurfaceOptions, compare_surfaces};
use selvedge_record::{Recorder, RecorderOptions, Recording, RunHeader, Surface};
use serde_json::json;

const SIDE: usize = 224;

/// A wrinkled sheet with noise in the last digits, as a solver leaves it.
fn state(frame: u64) -> (Vec<f64>, Vec<f64>) {
    let t = frame as f64 / 60.0;
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64 ^ frame;
    let mut noise = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut q, mut v) = (Vec::new(), Vec::new());
    for p in 0..SIDE * SIDE {
        let (x, z) = ((p / SIDE) as f64 * 0.01, (p % SIDE) as f64 * 0.01);
        let phase = 9.0 * x + 5.0 * (3.0 * z).sin() + 4.0 * t;
        q.extend([
            x + 1e-5 * noise(),
            0.05 * phase.sin() + 1e-5 * noise(),
            z + 1e-5 * noise(),
        ]);
        v.extend([
            1e-3 * noise(),
            0.2 * phase.cos() + 1e-3 * noise(),
            1e-3 * noise(),
        ]);
    }
    (q, v)
}

fn header() -> RunHeader {
    let quad = |i: usize| [i, i + SIDE, i + SIDE + 1, i + 1].map(|p| p as u32);
    let quads = (0..SIDE * (SIDE - 1))
        .filter(|i| i % SIDE != SIDE - 1)
        .map(quad);
    RunHeader {
        points: SIDE * SIDE,
        triangles: quads
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        ..RunHeader::default()
    }
}

fn recording(c: &mut Criterion) {
    let folder = std::env::temp_dir().join(format!("selvedge-record-bench-{}", std::process::id()));
    let header = header();
    let states: Vec<_> = (0..16).map(state).collect();
    let mut group = c.benchmark_group("frame of 50k points");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(3));
    for (name, mesh_channel, compression_level) in [
        ("state", false, 1),
        ("state, level 3", false, 3),
        ("state and mesh", true, 1),
    ] {
        let path = folder.join(format!("{name}.mcap"));
        let options = RecorderOptions {
            mesh_channel,
            compression_level,
            ..Default::default()
        };
        let mut recorder = Recorder::create(&path, &header, options).unwrap();
        let mut step = 0;
        group.bench_function(name, |b| {
            b.iter(|| {
                let (q, v) = &states[step as usize % states.len()];
                recorder.frame(step as f64 / 60.0, step, q, v).unwrap();
                step += 1;
            });
        });
        let path = recorder.finish(&json!({})).unwrap();
        let bytes = std::fs::metadata(&path).unwrap().len() as f64;
        println!("{name}: {:.3} MB a frame", bytes / 1e6 / step as f64);
        let per_frame = format!("open, {name}");
        group.bench_function(per_frame, |b| {
            b.iter_custom(|n| {
                let start = std::time::Instant::now();
                for _ in 0..n {
                    black_box(Recording::open(&path).unwrap());
                }
                start.elapsed() / step as u32
            });
        });
    }
    group.finish();

    let (q, _) = state(3);
    let coarse: Vec<f64> = q.iter().map(|x| x + 1e-3).collect();
    let (a, b) = (Surface::of(&header, &q), Surface::of(&header, &coarse));
    c.benchmark_group("compare").sample_size(10).bench_function(
        "surfaces of 50k points",
        |bench| {
            bench.iter(|| compare_surfaces(&a, &b, &SurfaceOptions::default()).unwrap());
        },
    );
    let d = compare_surfaces(&a, &b, &SurfaceOptions::default()).unwrap();
    println!(
        "Hausdorff distance {:.3e} to {:.3e} m",
        d.hausdorff, d.hausdorff_bound
    );
    let _ = std::fs::remove_dir_all(&folder);
}

criterion_group!(benches, recording);
criterion_main!(benches);
