//! Mass, momentum and energy of sliding segments.

use nalgebra::{DMatrix, DVector, Vector3};
use selvedge_energy::{MassBatch, RatePoint};
use selvedge_yarn_model::{
    InertiaForce, SegmentInertia, YarnMaterial, YarnNetwork, lumped_point_masses,
    lumped_scalar_masses,
};

use super::common::{Random, chain, close, layout, unknowns};

const MM: f64 = 1e-3;

fn zigzag() -> YarnNetwork {
    let points: Vec<[f64; 3]> = (0..6)
        .map(|i| {
            let s = f64::from(i);
            [MM * s, MM * (i % 2) as f64, 0.4 * MM * (1.7 * s).sin()]
        })
        .collect();
    let arcs: Vec<f64> = (0..6).map(|i| 1.4 * MM * f64::from(i)).collect();
    chain(YarnMaterial::default(), &points, &arcs)
}

/// Mass matrix, force and kinetic energy of the whole.
fn assemble(network: &YarnNetwork, q: &[f64], v: &[f64]) -> (DMatrix<f64>, DVector<f64>, f64) {
    let inertia = SegmentInertia::new(network, InertiaForce::Full);
    let at = RatePoint {
        layout: layout(network),
        q,
        v,
    };
    let n = inertia.len();
    let (mut masses, mut forces) = (vec![0.0; 64 * n], vec![0.0; 8 * n]);
    inertia.masses(&at, 0..n, &mut masses);
    let kinetic = inertia.rate_forces(&at, 0..n, &mut forces);
    let mut m = DMatrix::zeros(q.len(), q.len());
    let mut f = DVector::zeros(q.len());
    for e in 0..n {
        let mut places = Vec::new();
        for (node, dim) in inertia.nodes(e).iter().zip(inertia.node_dims()) {
            let from = at.layout.offset(*node, *dim);
            places.extend(from..from + dim);
        }
        for (i, &row) in places.iter().enumerate() {
            f[row] += forces[8 * e + i];
            for (j, &column) in places.iter().enumerate() {
                m[(row, column)] += masses[64 * e + 8 * i + j];
            }
        }
    }
    (m, f, kinetic)
}

/// Kinetic energy by three-point Gauss quadrature of the material's velocity,
/// which is differenced at fixed arc length; exact for linear segments.
#[test]
fn quadrature() {
    let network = zigzag();
    let mut random = Random(17);
    let q = random.shake(&unknowns(&network), 0.2 * MM);
    let v: Vec<f64> = (0..q.len()).map(|_| random.next()).collect();
    let rho = network.materials[0].line_density();
    let n = network.nodes();
    let place = |q: &[f64], e: usize, s: f64| {
        let x = |i: usize| Vector3::from_column_slice(&q[3 * i..3 * i + 3]);
        let (u0, u1) = (q[3 * n + e], q[3 * n + e + 1]);
        (x(e) * (u1 - s) + x(e + 1) * (s - u0)) / (u1 - u0)
    };
    let mut expected = 0.0;
    for e in 0..n - 1 {
        let (u0, u1) = (q[3 * n + e], q[3 * n + e + 1]);
        let r = 0.6_f64.sqrt();
        for (z, weight) in [(-r, 5.0 / 18.0), (0.0, 8.0 / 18.0), (r, 5.0 / 18.0)] {
            let s = 0.5 * (u0 + u1) + 0.5 * z * (u1 - u0);
            let h = 1e-7;
            let moved = |h: f64| -> Vec<f64> { q.iter().zip(&v).map(|(q, v)| q + h * v).collect() };
            let velocity = (place(&moved(h), e, s) - place(&moved(-h), e, s)) / (2.0 * h);
            expected += 0.5 * rho * (u1 - u0) * weight * velocity.norm_squared();
        }
    }
    let (m, _, kinetic) = assemble(&network, &q, &v);
    let v = DVector::from_column_slice(&v);
    let from_matrix = 0.5 * v.dot(&(&m * &v));
    close("T", &[from_matrix], &[kinetic], 1e-13);
    // The addition to the arc lengths is 1e-6 of a segment's mass.
    assert!(
        (kinetic / expected - 1.0).abs() < 1e-5,
        "{}",
        kinetic / expected
    );
}

/// A node that moves with its own material costs the addition alone: 1e-6 of
/// the mass of a mean segment.
#[test]
fn null_vector() {
    let network = zigzag();
    let q = unknowns(&network);
    let n = network.nodes();
    let v = vec![0.0; q.len()];
    let (m, _, _) = assemble(&network, &q, &v);
    let w = |e: usize| {
        let x = |i: usize| Vector3::from_column_slice(&q[3 * i..3 * i + 3]);
        (x(e + 1) - x(e)) / (q[3 * n + e + 1] - q[3 * n + e])
    };
    // At a yarn's end there is one segment.
    let mut slide = DVector::zeros(q.len());
    slide.fixed_rows_mut::<3>(0).copy_from(&w(0));
    slide[3 * n] = 1.0;
    let product = &m * &slide;
    let segment = network.materials[0].line_density() * 1.4 * MM;
    for (i, p) in product.iter().enumerate() {
        let expected = if i == 3 * n { 1e-6 * segment } else { 0.0 };
        assert!((p - expected).abs() < 1e-15 * segment, "{i}: {p:e}");
    }
    // Every arc length has that addition once.
    let straight: Vec<[f64; 3]> = (0..6)
        .map(|i| [1.4 * MM * f64::from(i), 0.0, 0.0])
        .collect();
    let arcs: Vec<f64> = (0..6).map(|i| 1.4 * MM * f64::from(i)).collect();
    let network = chain(YarnMaterial::default(), &straight, &arcs);
    let (m, _, _) = assemble(&network, &unknowns(&network), &v);
    for node in 0..n {
        let mut slide = DVector::zeros(q.len());
        slide[3 * node] = 1.0;
        slide[3 * n + node] = 1.0;
        let cost = slide.dot(&(&m * &slide));
        assert!((cost / (1e-6 * segment) - 1.0).abs() < 1e-6, "{cost:e}");
    }
    assert!(m.symmetric_eigenvalues().min() > 0.0);
}

/// Sums of the lumped masses: all of the yarn, and twice its scalars' share.
#[test]
fn lumped() {
    let network = zigzag();
    let total = network.materials[0].line_density() * 7.0 * MM;
    let points = lumped_point_masses(&network);
    close("points", &[points.iter().sum()], &[total], 1e-14);
    // All nodes moving alike is the sum of the consistent matrix.
    let q = unknowns(&network);
    let mut alike = vec![0.0; q.len()];
    for i in 0..network.nodes() {
        alike[3 * i] = 1.0;
    }
    let (m, _, kinetic) = assemble(&network, &q, &alike);
    close("translation", &[2.0 * kinetic], &[total], 1e-13);
    let ones = DVector::from_column_slice(&alike);
    let rows = &m * ones;
    for (i, mass) in points.iter().enumerate() {
        close("row sum", &[rows[3 * i]], &[*mass], 1e-13);
    }
    let scalars = lumped_scalar_masses(&network);
    let floor = 1e-6 * total / 5.0;
    close(
        "scalars",
        &[scalars.iter().sum()],
        &[total + 6.0 * floor],
        1e-13,
    );
}

/// Free flight: `M q̈ = Q` conserves energy and both momenta, while material
/// slides through the nodes. Ends of the yarn do not slide.
#[test]
fn free_flight() {
    let network = zigzag();
    let n = network.nodes();
    let mut random = Random(23);
    let mut q = DVector::from_vec(unknowns(&network));
    let mut v = DVector::from_fn(q.len(), |_, _| 0.1 * random.next());
    let free: Vec<usize> = (0..q.len())
        .filter(|&i| i != 3 * n && i != 4 * n - 1)
        .collect();
    v[3 * n] = 0.0;
    v[4 * n - 1] = 0.0;
    let acceleration = |q: &DVector<f64>, v: &DVector<f64>| {
        let (m, f, _) = assemble(&network, q.as_slice(), v.as_slice());
        let m = m.select_rows(&free).select_columns(&free);
        let f = f.select_rows(&free);
        // Scaled, because arc lengths may weigh little.
        let scale = m.diagonal().map(|d| 1.0 / d.sqrt());
        let s = DMatrix::from_diagonal(&scale);
        let solved = (&s * m * &s).lu().solve(&(&s * f)).unwrap();
        let mut a = DVector::zeros(q.len());
        for (&i, x) in free.iter().zip((s * solved).iter()) {
            a[i] = *x;
        }
        a
    };
    let measures = |q: &DVector<f64>, v: &DVector<f64>| {
        let (m, _, kinetic) = assemble(&network, q.as_slice(), v.as_slice());
        let p = m * v;
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for i in 0..n {
            let (x, p) = (q.fixed_rows::<3>(3 * i), p.fixed_rows::<3>(3 * i));
            linear += p;
            angular += x.cross(&p);
        }
        (kinetic, linear, angular)
    };
    let start = measures(&q, &v);
    let u_start = q[3 * n + 2];
    let h = 2e-6;
    for _ in 0..400 {
        // Runge and Kutta.
        let (k1, l1) = (v.clone(), acceleration(&q, &v));
        let (k2, l2) = (
            &v + &l1 * (0.5 * h),
            acceleration(&(&q + &k1 * (0.5 * h)), &(&v + &l1 * (0.5 * h))),
        );
        let (k3, l3) = (
            &v + &l2 * (0.5 * h),
            acceleration(&(&q + &k2 * (0.5 * h)), &(&v + &l2 * (0.5 * h))),
        );
        let (k4, l4) = (&v + &l3 * h, acceleration(&(&q + &k3 * h), &(&v + &l3 * h)));
        q += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        v += (l1 + l2 * 2.0 + l3 * 2.0 + l4) * (h / 6.0);
    }
    assert!((q[3 * n + 2] - u_start).abs() > 0.01 * MM, "slides");
    let end = measures(&q, &v);
    assert!(
        (end.0 / start.0 - 1.0).abs() < 1e-6,
        "{:e} {:e}",
        start.0,
        end.0
    );
    let size = start.1.norm();
    assert!((end.1 - start.1).norm() < 1e-9 * size);
    let size = start.2.norm();
    assert!((end.2 - start.2).norm() < 1e-9 * size.max(start.1.norm() * MM));
}
