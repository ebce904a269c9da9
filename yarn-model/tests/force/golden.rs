//! Against values computed by an independent implementation (complex-step
//! checked); tolerances relative to the largest entry.

use selvedge_energy::{Batch, Curvature, EnergyBatch, MassBatch, RatePoint};
use selvedge_yarn_model::{
    InertiaForce, JAM_ANGLE, JAM_WIDTH, JammingBending, LockedInertia, ParallelYarns, PlainBending,
    SegmentInertia, StitchLength, StitchWrapping, WrapElement, WrapPair, YarnBending, YarnGravity,
    YarnMaterial, YarnShear, YarnStretch, lumped_point_masses, lumped_scalar_masses,
};
use serde_json::Value;

use super::common::{at, chain, close, evaluate, flat, layout, number, oracle, stitch, weave};

/// Places of `x0, x1, u0, u1` in the reference's `x0, u0, x1, u1`.
const SEGMENT: [usize; 8] = [0, 1, 2, 4, 5, 6, 3, 7];
/// Places of `x2, x0, x1, u2, u1` in `x2, u2, x0, u0, x1, u1`.
const BEND: [usize; 11] = [0, 1, 2, 4, 5, 6, 8, 9, 10, 3, 11];

fn pick(from: &[f64], places: &[usize]) -> Vec<f64> {
    places.iter().map(|&i| from[i]).collect()
}

fn pick_matrix(from: &[f64], places: &[usize]) -> Vec<f64> {
    let n = (from.len() as f64).sqrt() as usize;
    let rows = places.iter();
    rows.flat_map(|&i| places.iter().map(move |&j| from[i * n + j]))
        .collect()
}

/// A yarn of line density `rho`, stretch and bending moduli, and radius.
fn yarn(rho: f64, stretch: f64, bending: f64, radius: f64) -> YarnMaterial {
    YarnMaterial {
        radius,
        density: rho / (std::f64::consts::PI * radius * radius),
        stretch_modulus: stretch,
        bending_modulus: bending,
        ..YarnMaterial::default()
    }
}

/// Energy, force and exact second derivative of stencil 0.
fn compare(
    batch: &dyn EnergyBatch,
    at: &selvedge_energy::EvalPoint<'_>,
    case: &Value,
    map: &[usize],
    tolerance: f64,
) {
    let (value, g, h) = evaluate(batch, at, Curvature::Exact, 0);
    let force: Vec<f64> = g.iter().map(|g| -g).collect();
    let name = batch.name();
    close(name, &[value], &[number(&case["E"])], tolerance);
    close(name, &force, &pick(&flat(&case["F"]), map), tolerance);
    if !case["H"].is_null() {
        let expected = pick_matrix(&flat(&case["H"]), map);
        close(name, &h, &expected, tolerance);
    }
}

#[test]
fn stretch_and_gravity() {
    let cases = oracle("eol");
    let straight = [[0.0; 3], [1e-3, 0.0, 0.0]];

    let case = &cases["stretch"];
    let material = yarn(1e-4, number(&case["Y"]), 0.0, number(&case["R"]));
    let network = chain(material, &straight, &[0.0, 1e-3]);
    let q = pick(&flat(&case["q"]), &SEGMENT);
    let batch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
    compare(&batch, &at(&network, &q, &q), case, &SEGMENT, 1e-12);

    let case = &cases["gravity"];
    let network = chain(
        yarn(number(&case["rho"]), 1e7, 0.0, 1e-4),
        &straight,
        &[0.0, 1e-3],
    );
    let q = pick(&flat(&case["q"]), &SEGMENT);
    let g: [f64; 3] = flat(&case["g"]).try_into().unwrap();
    let batch = Batch::<_, 4, 8>::new("gravity", YarnGravity::new(&network, g));
    compare(&batch, &at(&network, &q, &q), case, &SEGMENT, 1e-12);
}

#[test]
fn bending() {
    let cases = &oracle("eol")["bending"];
    assert!((number(&cases["theta_jam"]) - JAM_ANGLE).abs() < 1e-15);
    assert!((number(&cases["ramp_width"]) - JAM_WIDTH).abs() < 1e-15);
    let material = yarn(1e-4, 1e7, number(&cases["B"]), number(&cases["R"]));
    let points = [[0.0; 3], [1e-3, 0.0, 0.0], [2e-3, 0.0, 0.0]];
    let network = chain(material, &points, &[0.0, 1e-3, 2e-3]);
    let jamming: JammingBending = YarnBending::new(&network);
    let plain: PlainBending = YarnBending::new(&network);
    let jamming = Batch::<_, 5, 11>::new("bending", jamming);
    let plain = Batch::<_, 5, 11>::new("bending", plain);
    let samples = cases["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 4);
    for case in samples {
        let all = flat(&case["q"]);
        // Strands 0, 1, 2 are those of x2, x0, x1.
        let q = pick(&all, &[0, 1, 2, 4, 5, 6, 8, 9, 10, 3, 7, 11]);
        compare(&jamming, &at(&network, &q, &q), case, &BEND, 1e-11);
        assert_eq!(flat(&case["F"])[7], 0.0);
        let value = plain.value(&at(&network, &q, &q), 0..1);
        close("no jamming", &[value], &[number(&case["E_nojam"])], 1e-12);
    }
}

#[test]
fn parallel_contact() {
    let case = &oracle("eol")["parallel_contact"];
    let (l, d) = (number(&case["L"]), number(&case["d"]));
    // d = 2 R where the yarn floats, k_c L = 0.1 k_s/L.
    let radius = 0.5 * d;
    let stiffness = number(&case["k_c"]) * l * l / 0.1;
    let modulus = stiffness / (std::f64::consts::PI * radius * radius);
    let network = weave(yarn(1e-4, modulus, 0.0, radius), [2, 2], l, |_, _| true);
    let batch = Batch::<_, 2, 2>::new("parallel", ParallelYarns::new(&network));
    assert_eq!(batch.len(), 4);
    let mut q = vec![0.0; layout(&network).dim()];
    for (strand, u) in batch.nodes(0).iter().zip(flat(&case["u"])) {
        q[12 + *strand as usize] = u;
    }
    compare(&batch, &at(&network, &q, &q), case, &[0, 1], 1e-12);
}

#[test]
fn shear() {
    let cases = &oracle("eol")["shear"];
    let material = YarnMaterial {
        shear_modulus: number(&cases["S"]),
        ..yarn(1e-4, 1e7, 0.0, number(&cases["R"]))
    };
    // d = 2 R where all yarns float, half the distance.
    let network = weave(material, [2, 2], number(&cases["L"]), |_, _| true);
    let batch = Batch::<_, 3, 9>::new("shear", YarnShear::new(&network));
    assert_eq!(batch.len(), 4);
    // The warp of crossing 0 runs to node 1, the weft to node 2.
    assert_eq!(batch.nodes(0), [0, 1, 2]);
    let samples = cases["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 4);
    for case in samples {
        let mut q = flat(&case["q"]);
        q.resize(layout(&network).dim(), 0.0);
        let places: Vec<usize> = (0..9).collect();
        compare(&batch, &at(&network, &q, &q), case, &places, 1e-11);
    }
}

#[test]
fn wrapping() {
    let cases = &oracle("eol")["wrapping"];
    let samples = cases["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 3);
    for case in samples {
        let q = flat(&case["q"]);
        let points: Vec<[f64; 3]> = q.as_chunks::<3>().0.to_vec();
        let length = number(&case["L"]);
        let element = WrapElement {
            points: [0, 1, 2, 3],
            contact: 0,
            pair: WrapPair::ChildAtA,
            sigma: 1.0,
            stiffness: number(&cases["k_w"]) * length,
            length,
        };
        let energy = StitchWrapping::from_elements(&[element], &points, number(&cases["psi0"]));
        let angle = energy.angle(0, q[..].try_into().unwrap()).unwrap();
        close("psi", &[angle], &[number(&case["psi"])], 1e-13);
        let batch = Batch::<_, 4, 12>::new("wrapping", energy);
        let at = selvedge_energy::EvalPoint {
            layout: selvedge_energy::DofLayout::points(4),
            q: &q,
            q_start: &q,
            dt: 1e-3,
        };
        let places: Vec<usize> = (0..12).collect();
        // The reference's second derivative comes from differences.
        let mut loose = case.clone();
        let second = loose["H"].take();
        compare(&batch, &at, &loose, &places, 1e-11);
        let (_, _, h) = evaluate(&batch, &at, Curvature::Exact, 0);
        close("wrapping", &h, &flat(&second), 1e-7);
        if case["name"] == "wings_back" {
            // Exact: k_w L (∇ψ ∇ψᵀ + (ψ − ψ0) ∇²ψ).
            let psi = flat(&case["grad_psi"]);
            let strain = angle - number(&cases["psi0"]);
            let second = flat(&cases["Hess_psi_base"]);
            let expected: Vec<f64> = (0..144)
                .map(|k| element.stiffness * (psi[k / 12] * psi[k % 12] + strain * second[k]))
                .collect();
            close("wrapping", &h, &expected, 1e-11);
        }
    }
}

#[test]
fn stitch_length() {
    let case = &oracle("eol")["stitch_length"];
    let modulus = 0.1 * number(&case["k_l"]) / (std::f64::consts::PI * 1e-8);
    for backwards in [false, true] {
        let mut network = stitch(yarn(1e-4, modulus, 0.0, 1e-4), -1, false, backwards);
        network.stitches[0].rest = number(&case["L"]);
        let batch = Batch::<_, 2, 2>::new("length", StitchLength::new(&network));
        assert_eq!(batch.len(), 2);
        for e in 0..2 {
            let [s0, s1] = batch.nodes(e).try_into().unwrap();
            assert_eq!(network.strands[s0 as usize].next, s1);
            let nodes = [s0, s1].map(|s: u32| network.strands[s as usize].node);
            assert_eq!(nodes, if backwards { [1, 0] } else { [0, 1] });
        }
        let mut q = vec![0.0; layout(&network).dim()];
        for (strand, u) in batch.nodes(0).iter().zip(flat(&case["u"])) {
            q[18 + *strand as usize] = u;
        }
        compare(&batch, &at(&network, &q, &q), case, &[0, 1], 1e-12);
    }
}

#[test]
fn segment_mass() {
    let case = &oracle("eol")["segment_mass"];
    let rho = number(&case["rho"]);
    let straight = [[0.0; 3], [1e-3, 0.0, 0.0]];
    let network = chain(yarn(rho, 1e7, 0.0, 1e-4), &straight, &[0.0, 1e-3]);
    let q = pick(&flat(&case["q"]), &SEGMENT);
    let v = pick(&flat(&case["qdot"]), &SEGMENT);
    let at = RatePoint {
        layout: layout(&network),
        q: &q,
        v: &v,
    };
    let inertia = SegmentInertia::new(&network, InertiaForce::Full);
    let mut m = [f64::NAN; 64];
    inertia.masses(&at, 0..1, &mut m);
    // One segment: both ends get the whole addition.
    let floor = 1e-6 * rho * 1e-3;
    m[6 * 8 + 6] -= floor;
    m[7 * 8 + 7] -= floor;
    close("mass", &m, &pick_matrix(&flat(&case["M"]), &SEGMENT), 1e-12);
    let mut f = [f64::NAN; 8];
    let kinetic = inertia.rate_forces(&at, 0..1, &mut f);
    let expected = number(&case["kinetic"]) + 0.5 * floor * (v[6] * v[6] + v[7] * v[7]);
    close("kinetic", &[kinetic], &[expected], 1e-12);
    let expected = pick(&flat(&case["inertia_force"]), &SEGMENT);
    close("rate force", &f, &expected, 1e-11);

    let constant = SegmentInertia::new(&network, InertiaForce::ConstantMass);
    assert_eq!(constant.rate_forces(&at, 0..1, &mut f), kinetic);
    assert_eq!(f, [0.0; 8]);
    assert_eq!(lumped_point_masses(&network), [0.5e-3 * rho; 2]);
    close(
        "scalars",
        &lumped_scalar_masses(&network),
        &[0.5e-3 * rho + floor; 2],
        1e-14,
    );

    // Locked: ρ Δu/6 [2, 1; 1, 2] at the frozen arc lengths, and no force.
    let locked = LockedInertia::new(&network);
    let at = RatePoint {
        layout: selvedge_energy::DofLayout::points(2),
        q: &q[..6],
        v: &v[..6],
    };
    let mut m = [f64::NAN; 36];
    locked.masses(&at, 0..1, &mut m);
    let expected: Vec<f64> = (0..36)
        .map(|k| match (k / 6 % 3 == k % 3, k / 18 == k % 6 / 3) {
            (true, true) => rho * 1e-3 / 3.0,
            (true, false) => rho * 1e-3 / 6.0,
            _ => 0.0,
        })
        .collect();
    close("locked mass", &m, &expected, 1e-14);
    let mut f = [f64::NAN; 6];
    let kinetic = locked.rate_forces(&at, 0..1, &mut f);
    let dot = |a: usize, b: usize| (0..3).map(|i| v[a + i] * v[b + i]).sum::<f64>();
    let expected = rho * 1e-3 / 6.0 * (dot(0, 0) + dot(0, 3) + dot(3, 3));
    close("locked kinetic", &[kinetic], &[expected], 1e-13);
    assert_eq!(f.map(f64::abs), [0.0; 6]);
}
