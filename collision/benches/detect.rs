//! Detection and evaluation on a folded sheet of 170,528 triangles.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use selvedge_collision::{
    BroadPhase, BvhParry, Candidates, CollisionBackend, CollisionMesh, ContactResponse,
    ContactSource, HashGrid, ProximityBackend, SelfContact, StepStart,
};
use selvedge_energy::{DofLayout, EvalPoint};

/// Cells along a side: 2 · 292² triangles.
const CELLS: usize = 292;
/// Side of the sheet [m].
const SIDE: f64 = 1.0;

/// A square sheet folded over its middle, slightly wavy, the layers `gap` apart.
fn folded(gap: f64) -> (Vec<f64>, Vec<f64>, Vec<[u32; 3]>) {
    let n = CELLS;
    let (mut rest, mut q, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let radius = 0.5 * gap;
    let arc = std::f64::consts::PI * radius;
    for j in 0..=n {
        for i in 0..=n {
            let (u, v) = (SIDE * i as f64 / n as f64, SIDE * j as f64 / n as f64);
            rest.extend([u, v, 0.0]);
            // Flat, half a circle, and flat back.
            let s = u - 0.5 * (SIDE - arc);
            let (x, z) = if s < 0.0 {
                (s, -radius)
            } else if s < arc {
                let a = s / radius;
                (radius * a.sin(), -radius * a.cos())
            } else {
                (arc - s, radius)
            };
            let wave = 4e-3 * (31.0 * v).sin() * (23.0 * x).cos();
            q.extend([x, v, z + wave]);
        }
    }
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    for j in 0..n {
        for i in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (rest, q, triangles)
}

fn detect(c: &mut Criterion) {
    let (rest, q, triangles) = folded(0.9e-3);
    let mesh = CollisionMesh::from_positions(&rest, triangles, &[], 0.8e-3).unwrap();
    let q_end: Vec<f64> = q.iter().map(|x| x + 1e-5).collect();
    let reach = 1.2e-3;
    let mut group = c.benchmark_group("detect");
    group.sample_size(10);
    let mut out = Candidates::default();
    fn run<B: BroadPhase>(
        group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
        mut backend: ProximityBackend<B>,
        mut detect: impl FnMut(&mut ProximityBackend<B>),
    ) {
        detect(&mut backend);
        println!(
            "{}: {} patch pairs, {:.1} MB",
            backend.name(),
            backend.patch_pair_count(),
            backend.heap_bytes() as f64 * 1e-6
        );
        let name = backend.name().to_string();
        group.bench_function(name, |b| b.iter(|| detect(black_box(&mut backend))));
    }
    run(&mut group, ProximityBackend::new(BvhParry::new()), |b| {
        b.detect(&mesh, &q, &q_end, reach, &mut out).unwrap();
    });
    run(&mut group, ProximityBackend::new(HashGrid::new()), |b| {
        b.detect(&mesh, &q, &q_end, reach, &mut out).unwrap();
    });
    println!(
        "{} points: {} vertex-triangle, {} edge-edge candidates; mesh {:.1} MB",
        mesh.points(),
        out.vertex_triangle.len(),
        out.edge_edge.len(),
        mesh.heap_bytes() as f64 * 1e-6
    );
    group.finish();
}

/// The broad phase alone, on boxes of single triangles as well as of patches.
fn traverse(c: &mut Criterion) {
    let (_, q, triangles) = folded(0.9e-3);
    let (points, _) = q.as_chunks::<3>();
    let boxes: Vec<_> = triangles
        .iter()
        .map(|t| {
            let x = t.map(|i| points[i as usize]);
            selvedge_collision::Aabb::of_points(&x).inflate(0.6e-3)
        })
        .collect();
    let mut group = c.benchmark_group("triangle boxes");
    group.sample_size(10);
    let mut pairs = Vec::new();
    let mut bvh = BvhParry::new();
    group.bench_function("bvh", |b| {
        b.iter(|| bvh.overlaps(black_box(&boxes), &mut pairs))
    });
    let mut grid = HashGrid::new();
    group.bench_function("hash-grid", |b| {
        b.iter(|| grid.overlaps(black_box(&boxes), &mut pairs))
    });
    println!("{} pairs of {} boxes", pairs.len(), boxes.len());
    group.finish();
}

fn respond(c: &mut Criterion) {
    let (rest, q, triangles) = folded(0.9e-3);
    let mesh = CollisionMesh::from_positions(&rest, triangles, &[], 0.8e-3).unwrap();
    // Pressed together a little, so that the layers touch.
    let q: Vec<f64> = q
        .iter()
        .enumerate()
        .map(|(i, x)| if i % 3 == 2 { 0.8 * x } else { *x })
        .collect();
    let points = mesh.points();
    let mut s = SelfContact::new(mesh);
    let step = StepStart {
        q_start: &q,
        q_predicted: &q,
        dt: 1e-3,
        time: 0.0,
    };
    s.detect(&step).unwrap();
    let at = EvalPoint {
        layout: DofLayout::points(points),
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };
    let mut out = ContactResponse::default();
    let mut group = c.benchmark_group("self-contact");
    group.sample_size(10);
    group.bench_function("evaluate", |b| {
        b.iter(|| {
            out.clear();
            s.evaluate(black_box(&at), true, &mut out).unwrap()
        });
    });
    group.bench_function("commit", |b| b.iter(|| s.commit(black_box(&at))));
    println!(
        "{points} points: {} candidates, {} active, {:.0} bytes a point",
        s.candidates(),
        s.active(),
        s.heap_bytes() as f64 / points as f64
    );
    group.finish();
}

criterion_group!(benches, detect, traverse, respond);
criterion_main!(benches);
