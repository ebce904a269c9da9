//! Time of one evaluation of gradients and projected second derivatives by
//! term, on a knit-like network of 100 000 points that is shaken out of rest.
//!
//! `cargo bench -p selvedge-yarn-model --bench forces`

use std::hint::black_box;
use std::time::Instant;

use selvedge_energy::{Batch, Curvature, DofLayout, EnergyBatch, EvalPoint, MassBatch, RatePoint};
use selvedge_yarn_model::{
    InertiaForce, JammingBending, LockedBending, LockedStretch, NetworkBuilder, ParallelYarns,
    SegmentInertia, StitchContact, StitchLength, StitchWrapping, Visit, YarnBending, YarnGravity,
    YarnMaterial, YarnNetwork, YarnStretch,
};

/// Ranges that callers evaluate at a time.
const RANGE: usize = 64;

/// Rows and columns of loops. Every loop has a left and a right contact of its
/// base with the head of the loop below; ends stay loose.
fn stockinette(columns: u32, rows: u32) -> YarnNetwork {
    let pitch = 4e-3;
    let mut builder = NetworkBuilder::new(vec![YarnMaterial::default()]);
    // Contact of loop (j, r): A and B, left then right.
    let node = |j: u32, r: u32, right: u32, b: u32| ((r * columns + j) * 2 + right) * 2 + b;
    let place = |n: u32| {
        let (loop_, right, b) = (n / 4, n / 2 % 2, n % 2);
        let s = if right == 0 { -1.0 } else { 1.0 };
        let (across, up) = if b == 0 { (0.32, -0.1) } else { (0.18, 0.1) };
        let x = f64::from(loop_ % columns) + across * s;
        [pitch * x, 0.75 * pitch * (f64::from(loop_ / columns) + up)]
    };
    for n in 0..4 * rows * columns {
        let [x, y] = place(n);
        builder.node([x, y, 0.0], [x, y], [0.0, 0.0, 1.0]);
    }
    // A yarn per row: child at the contacts below, parent at those above.
    for r in 0..=rows {
        let mut nodes = Vec::new();
        for j in 0..columns {
            let up = [node(j, r, 0, 0), node(j, r, 0, 1)];
            let down = [node(j, r, 1, 1), node(j, r, 1, 0)];
            if r > 0 {
                let below = |right, b| (node(j, r - 1, right, b), true);
                nodes.extend([below(0, 0), below(0, 1)]);
            }
            if r < rows {
                nodes.extend(up.map(|n| (n, false)));
                nodes.extend(down.map(|n| (n, false)));
            }
            if r > 0 {
                let below = |right, b| (node(j, r - 1, right, b), true);
                nodes.extend([below(1, 1), below(1, 0)]);
            }
        }
        let mut arc = 0.0;
        let mut before: Option<[f64; 2]> = None;
        let visits = nodes.iter().map(|&(n, child)| {
            let [x, y] = place(n);
            if let Some([a, b]) = before {
                arc += (x - a).hypot(y - b);
            }
            before = Some([x, y]);
            Visit {
                node: n,
                layer: u8::from(child == (n % 2 == 0)),
                arc,
                held: false,
            }
        });
        builder.yarn(0, visits.collect());
    }
    for r in 0..rows {
        for j in 0..columns {
            for (right, side) in [(0, -1), (1, 1)] {
                let (a, b) = (node(j, r, right, 0), node(j, r, right, 1));
                let ([ax, ay], [bx, by]) = (place(a), place(b));
                builder.stitch(StitchContact {
                    a,
                    b,
                    purl: false,
                    side,
                    parents: 1,
                    rest: (ax - bx).hypot(ay - by),
                    row: r,
                    column: j,
                });
            }
        }
    }
    builder.build().expect("a network")
}

/// Seconds of the fastest of seven runs.
fn fastest(mut run: impl FnMut()) -> f64 {
    (0..7)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() {
    let network = stockinette(250, 100);
    let points = network.nodes();
    let layout = DofLayout {
        points,
        scalars: network.strands.len(),
    };
    let mut seed = 1u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mut q: Vec<f64> = network.points.iter().flatten().copied().collect();
    q.iter_mut().for_each(|x| *x += 2e-4 * random());
    let points_only = q.clone();
    q.extend(network.strands.iter().map(|s| s.arc));
    q[3 * points..]
        .iter_mut()
        .for_each(|u| *u += 5e-5 * random());
    let at = EvalPoint {
        layout,
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };
    let locked_at = EvalPoint {
        layout: DofLayout::points(points),
        q: &points_only,
        q_start: &points_only,
        ..at
    };
    let bending: JammingBending = YarnBending::new(&network);
    let locked: LockedBending<true> = LockedBending::bending(&network);
    let gravity = YarnGravity::new(&network, [0.0, 0.0, -9.81]);
    let terms: [(bool, Box<dyn EnergyBatch>); 8] = [
        (
            true,
            Box::new(Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network))),
        ),
        (
            true,
            Box::new(Batch::<_, 5, 11>::new("bending, jamming", bending)),
        ),
        (true, Box::new(Batch::<_, 4, 8>::new("gravity", gravity))),
        (
            true,
            Box::new(Batch::<_, 4, 12>::new(
                "wrapping",
                StitchWrapping::new(&network),
            )),
        ),
        (
            true,
            Box::new(Batch::<_, 2, 2>::new("length", StitchLength::new(&network))),
        ),
        (
            true,
            Box::new(Batch::<_, 2, 2>::new(
                "parallel",
                ParallelYarns::new(&network),
            )),
        ),
        (
            false,
            Box::new(Batch::<_, 2, 6>::new(
                "stretch, locked",
                LockedStretch::stretch(&network),
            )),
        ),
        (
            false,
            Box::new(Batch::<_, 3, 9>::new("bending, locked", locked)),
        ),
    ];
    println!("{points} points, {} strands", layout.scalars);
    println!(
        "{:<18} {:>9} {:>12} {:>12} {:>10} {:>10}",
        "term", "stencils", "gradient ns", "hessian ns", "ns/point", "B/point"
    );
    let mut sum = 0.0;
    for (sliding, term) in &terms {
        let at = if *sliding { &at } else { &locked_at };
        let (n, m) = (term.len(), term.local_dim());
        let (mut g, mut h) = (vec![0.0; RANGE * m], vec![0.0; RANGE * m * m]);
        let ranges = || (0..n).step_by(RANGE).map(|i| i..(i + RANGE).min(n));
        let gradient = fastest(|| {
            for range in ranges() {
                black_box(term.gradients(at, range, &mut g));
                black_box(&g);
            }
        });
        let hessian = fastest(|| {
            for range in ranges() {
                black_box(term.hessians(at, Curvature::Projected, range, &mut g, &mut h));
                black_box(&h);
            }
        });
        let each = |time: f64| 1e9 * time / n as f64;
        let a_point = 1e9 * hessian / points as f64;
        if *sliding {
            sum += a_point;
        }
        println!(
            "{:<18} {n:>9} {:>12.1} {:>12.1} {a_point:>10.1} {:>10.1}",
            term.name(),
            each(gradient),
            each(hessian),
            term.heap_bytes() as f64 / points as f64
        );
    }
    let inertia = SegmentInertia::new(&network, InertiaForce::Full);
    let v: Vec<f64> = q.iter().map(|_| 0.1 * random()).collect();
    let rates = RatePoint {
        layout,
        q: &q,
        v: &v,
    };
    let n = inertia.len();
    let (mut f, mut masses) = (vec![0.0; RANGE * 8], vec![0.0; RANGE * 64]);
    let time = fastest(|| {
        for i in (0..n).step_by(RANGE) {
            let range = i..(i + RANGE).min(n);
            inertia.masses(&rates, range.clone(), &mut masses);
            black_box(inertia.rate_forces(&rates, range, &mut f));
            black_box((&masses, &f));
        }
    });
    let a_point = 1e9 * time / points as f64;
    println!(
        "{:<18} {n:>9} {:>12} {:>12.1} {a_point:>10.1} {:>10.1}",
        "inertia",
        "",
        1e9 * time / n as f64,
        inertia.heap_bytes() as f64 / points as f64
    );
    println!(
        "all sliding terms and inertia: {:.0} ns a point",
        sum + a_point
    );
}
