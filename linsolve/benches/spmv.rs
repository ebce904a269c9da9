//! Memory-bound kernels against the bandwidth of a triad in the same run.
//!
//! `cargo bench -p selvedge-linsolve` prints criterion's times and then a table
//! of nanoseconds per unknown and of bandwidth as a fraction of the triad,
//! every figure the best of interleaved rounds: on a shared machine only the
//! ratios mean something. The processor time of all threads (Linux) is free of
//! waiting for a core; run with `RAYON_NUM_THREADS=1` to compare it.

use criterion::Criterion;
use rayon::prelude::*;
use selvedge_linsolve::*;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// A sheet of `SELVEDGE_BENCH_SIDE`² points (316² = 100k by default) with the 13-block rows of triangles and hinges.
fn pattern() -> Arc<Pattern> {
    let n: u32 = setting("SELVEDGE_BENCH_SIDE", 316);
    let points = (n * n) as usize;
    let mut triangles = Vec::new();
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let p = j * n + i;
            triangles.extend([[p, p + 1, p + n], [p + 1, p + n + 1, p + n]]);
        }
    }
    let mut edges = std::collections::BTreeMap::new();
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for t in &triangles {
        for k in 0..3 {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            if let Some(d) = edges.insert((a.min(b), a.max(b)), c) {
                groups.push(vec![a, b, c, d]);
            }
        }
        groups.push(t.to_vec());
    }
    let natural = Pattern::from_groups(points, groups.iter().map(Vec::as_slice));
    let order = reverse_cuthill_mckee(&natural);
    for g in &mut groups {
        order.relabel(g);
    }
    let p = Pattern::from_groups(points, groups.iter().map(Vec::as_slice));
    println!(
        "{} points, {:.2} blocks a row, bandwidth {}",
        p.points(),
        p.block_count() as f64 / p.points() as f64,
        p.bandwidth()
    );
    Arc::new(p)
}

/// Weighted Laplacian blocks plus mass: definite, with full blocks.
fn matrix<T: Real>(pattern: &Arc<Pattern>) -> Bsr<T> {
    let mut a = Bsr::zeros(Arc::clone(pattern));
    for i in 0..pattern.points() {
        for &j in pattern.columns(i) {
            if (j as usize) < i {
                let d: [f64; 3] = [1.0, f64::from(j % 7) * 0.1, f64::from(j % 3) * 0.3];
                let k = std::array::from_fn(|r| std::array::from_fn(|c| d[r] * d[c] + 0.1));
                for (r, c, s) in [
                    (i as u32, j, -1.0),
                    (j, i as u32, -1.0),
                    (j, j, 1.0),
                    (i as u32, i as u32, 1.0),
                ] {
                    if let Some(slot) = pattern.slot(r, c) {
                        a.add_block(slot as usize, &k, s);
                    }
                }
            }
        }
        a.add_diagonal(i, 0.05);
    }
    a
}

struct Case<'a> {
    name: String,
    bytes: f64,
    run: Box<dyn FnMut() + 'a>,
}

fn product_bytes<T>(p: &Pattern) -> f64 {
    // as STREAM counts: everything once, without the fetch before a write
    let (n, blocks) = (p.points() as f64, p.block_count() as f64);
    blocks * (9 * size_of::<T>() + 4) as f64 + n * (4 + 6 * size_of::<T>()) as f64
}

fn iteration_bytes<T>(p: &Pattern) -> f64 {
    // c, q, x, r, blocks read and x, r, z written; then z, c read and c written
    let vectors = (4 * 3 + 6 + 3 * 3) + 3 * 3;
    product_bytes::<T>(p) + (p.points() * vectors * size_of::<T>()) as f64
}

fn operators<'a, T: Real>(a: &'a Bsr<T>, cases: &mut Vec<Case<'a>>) {
    let (p, n) = (a.pattern(), a.dim());
    let (x, mut y) = (vec![T::ONE; n], vec![T::ZERO; n]);
    cases.push(Case {
        name: format!("product {}", T::NAME),
        bytes: product_bytes::<T>(p),
        run: Box::new(move || a.apply(black_box(&x), black_box(&mut y))),
    });
    let b: Vec<f64> = (0..n).map(|k| ((k * 7919) % 1000) as f64 - 500.0).collect();
    let kinds = PRECONDITIONERS.map(|name| (name, Sums::Double));
    // single precision throughout
    let single = (T::NAME == "f32").then_some(("block-jacobi", Sums::OfVectors));
    for (name, sums) in kinds.into_iter().chain(single) {
        // differences of two lengths leave the cost of one iteration
        let settings = MpcgSettings {
            tolerance: 0.0,
            max_iterations: 20,
            sums,
            ..MpcgSettings::default()
        };
        let of = match sums {
            Sums::Double => "",
            Sums::OfVectors => ", sums too",
        };
        let Ok(p) = preconditioner_by_name::<T>(name) else {
            continue;
        };
        let mut solver = Mpcg::new(p, settings);
        let mut out = vec![0.0; n];
        if solver.solve(a, &b, &NoFilter, &mut out).is_err() {
            continue;
        }
        let b = b.clone();
        let pointwise = solver.preconditioner().pointwise().is_some();
        let bytes = iteration_bytes::<T>(a.pattern());
        cases.push(Case {
            name: format!("20 iterations {name} {}{of}", T::NAME),
            bytes: if pointwise { 20.0 * bytes } else { f64::NAN },
            run: Box::new(move || {
                out.fill(0.0);
                let _ = black_box(solver.solve_operator(a, &b, &NoFilter, &mut out));
            }),
        });
        let Ok(mut p) = preconditioner_by_name::<T>(name) else {
            continue;
        };
        if sums == Sums::OfVectors {
            continue;
        }
        cases.push(Case {
            name: format!("update {name} {}", T::NAME),
            bytes: f64::NAN,
            run: Box::new(move || {
                let _ = black_box(p.update(a, &NoFilter));
            }),
        });
    }
}

fn triad<'a>(threads: usize) -> Case<'a> {
    let n = 8 << 20;
    let (mut a, b, c) = (vec![0.0f64; n], vec![1.0f64; n], vec![2.0f64; n]);
    Case {
        name: format!("triad, {threads} threads"),
        bytes: 24.0 * n as f64,
        run: Box::new(move || {
            let piece = n / threads;
            a.par_chunks_mut(piece)
                .zip(b.par_chunks(piece).zip(c.par_chunks(piece)))
                .for_each(|(a, (b, c))| {
                    for (a, (b, c)) in a.iter_mut().zip(b.iter().zip(c)) {
                        *a = 3.0 * c + b;
                    }
                });
            black_box(&mut a);
        }),
    }
}

fn main() {
    // kernels are called from inside the pool, as they are by the solvers
    rayon::scope(|_| run());
}

fn run() {
    let pattern = pattern();
    let (double, single) = (matrix::<f64>(&pattern), matrix::<f32>(&pattern));
    let unknowns = double.dim() as f64;
    let mut cases = vec![triad(rayon::current_num_threads())];
    operators(&double, &mut cases);
    operators(&single, &mut cases);

    // a part of the names, to look at one kernel
    let only: String = setting("SELVEDGE_BENCH_ONLY", String::new());
    cases.retain(|c| c.name.contains(&only) || c.name.starts_with("triad"));

    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    for case in &mut cases {
        if case.name.starts_with("product") || case.name.starts_with("triad") {
            criterion.bench_function(&case.name, |bencher| bencher.iter(&mut case.run));
        }
    }
    if std::env::args().any(|a| a == "--test" || a == "--list") {
        return;
    }

    let rounds = setting("SELVEDGE_BENCH_ROUNDS", 15);
    // best wall time and mean processor time
    let mut best = vec![[f64::INFINITY, 0.0]; cases.len()];
    for _ in 0..rounds {
        for (case, best) in cases.iter_mut().zip(&mut best) {
            let (start, cpu) = (Instant::now(), processor_seconds());
            (case.run)();
            best[0] = best[0].min(start.elapsed().as_secs_f64());
            best[1] += (processor_seconds() - cpu) / f64::from(rounds);
        }
    }
    println!(
        "\n{:<32} {:>8} {:>10} {:>6} {:>6} | {:>8} {:>10} {:>6}",
        "best wall, mean processor time",
        "wall ms",
        "ns/unknown",
        "GB/s",
        "triad",
        "cpu ms",
        "ns/unknown",
        "triad"
    );
    let triad = best[0];
    for (case, best) in cases.iter().zip(&best) {
        let iterations = if case.name.starts_with("20") {
            20.0
        } else {
            1.0
        };
        let [wall, cpu] = best.map(|s| s / iterations);
        let fraction = |k: usize| 100.0 * case.bytes / best[k] * triad[k] / cases[0].bytes;
        println!(
            "{:<32} {:>8.3} {:>10.2} {:>6.1} {:>5.0}% | {:>8.3} {:>10.2} {:>5.0}%",
            case.name,
            1e3 * wall,
            1e9 * wall / unknowns,
            1e-9 * case.bytes / best[0],
            fraction(0),
            1e3 * cpu,
            1e9 * cpu / unknowns,
            fraction(1)
        );
    }
}

/// Time on a core of all threads of this process; NaN where it is not known.
fn processor_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return f64::NAN;
    };
    let nanoseconds = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    tasks.flatten().filter_map(nanoseconds).sum::<f64>() * 1e-9
}

fn setting<V: std::str::FromStr>(name: &str, default: V) -> V {
    let text = std::env::var(name).unwrap_or_default();
    text.parse().unwrap_or(default)
}
