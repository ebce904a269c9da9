//! Reading, meshing and assembling the T-shirt at 1 cm.

#[path = "../tests/common/mod.rs"]
mod common;

use criterion::{Criterion, criterion_group, criterion_main};
use selvedge_garment::{AssembleSettings, GarmentMesh, MeshSettings, Pattern, preassemble};
use std::hint::black_box;

fn garment(c: &mut Criterion) {
    let bytes = common::tshirt();
    c.bench_function("read", |b| {
        b.iter(|| Pattern::from_json(black_box(&bytes)).unwrap());
    });
    let pattern = Pattern::from_json(&bytes).unwrap();
    let settings = MeshSettings::default();
    let mut group = c.benchmark_group("tshirt_1cm");
    group.sample_size(10);
    group.bench_function("mesh", |b| {
        b.iter(|| GarmentMesh::build(black_box(&pattern), &settings).unwrap());
    });
    let mesh = GarmentMesh::build(&pattern, &settings).unwrap();
    group.bench_function("preassemble", |b| {
        b.iter(|| preassemble(&mesh, &common::person, &AssembleSettings::default()));
    });
    group.finish();
}

criterion_group!(benches, garment);
criterion_main!(benches);
