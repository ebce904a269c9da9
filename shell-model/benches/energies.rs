//! Time per stencil of the shell energies, in one thread, in ranges of 64.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use selvedge_energy::{Curvature, DofLayout, EnergyBatch, EvalPoint};
use selvedge_shell_model::{
    BendingModel, BendingOptions, BendingRigidity, DampingKind, Fabric, MembraneModuli,
    bending_term, membrane_term, sheet,
};

fn sweep(term: &dyn EnergyBatch, at: &EvalPoint<'_>, curvature: Option<Curvature>) -> f64 {
    let m = term.local_dim();
    let (mut g, mut h) = (vec![0.0; 64 * m], vec![0.0; 64 * m * m]);
    let mut sum = 0.0;
    let mut from = 0;
    while from < term.len() {
        let to = (from + 64).min(term.len());
        sum += match curvature {
            Some(c) => term.hessians(at, c, from..to, &mut g, &mut h),
            None => term.gradients(at, from..to, &mut g),
        };
        black_box((&g, &h));
        from = to;
    }
    sum
}

fn energies(criterion: &mut Criterion) {
    let sheet = sheet::equilateral_edge([0.5, 0.5], 0.01).expect("a valid sheet");
    let fabric = Fabric::new(
        "bench",
        0.2,
        MembraneModuli {
            warp: 2000.0,
            weft: 1500.0,
            shear: 50.0,
            coupling: 100.0,
        },
        BendingRigidity {
            warp: 2e-5,
            weft: 1.5e-5,
            bias: 1e-5,
        },
    )
    .expect("a valid fabric");
    let fabrics = [fabric];
    let wavy = |phase: f64| {
        sheet.positions(|[u, v]| {
            [
                u,
                0.01 * (40.0 * u + phase).sin() * (30.0 * v).cos(),
                -1.01 * v,
            ]
        })
    };
    let (q, q_start) = (wavy(0.1), wavy(0.0));
    let layout = DofLayout::points(sheet.mesh.points());
    let at = EvalPoint {
        layout,
        q: &q,
        q_start: &q_start,
        dt: 1e-3,
    };

    for damping in [
        DampingKind::Off,
        DampingKind::Rate,
        DampingKind::Incremental,
    ] {
        let bend = |model| BendingOptions {
            damping,
            model,
            ..Default::default()
        };
        let terms = [
            ("membrane", membrane_term(&sheet.mesh, &fabrics, damping)),
            (
                "hinge",
                bending_term(&sheet.mesh, &fabrics, &bend(BendingModel::Hinge)),
            ),
            (
                "quadratic",
                bending_term(&sheet.mesh, &fabrics, &bend(BendingModel::Quadratic)),
            ),
        ];
        for (name, term) in terms {
            if name == "quadratic" && damping != DampingKind::Off {
                continue;
            }
            let term = term.expect("a valid term");
            let mut group = criterion.benchmark_group(format!("{name}/{damping:?}"));
            group.throughput(Throughput::Elements(term.len() as u64));
            group.bench_function("gradient", |b| b.iter(|| sweep(&*term, &at, None)));
            for curvature in [
                Curvature::Exact,
                Curvature::Projected,
                Curvature::GaussNewton,
            ] {
                group.bench_function(format!("{curvature:?}"), |b| {
                    b.iter(|| sweep(&*term, &at, Some(curvature)))
                });
            }
            group.finish();
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(800));
    targets = energies
}
criterion_main!(benches);
