//! Against values computed by an independent implementation (complex-step
//! checked); tolerances relative to the largest entry.

mod common;

use common::{at, close, evaluate, flat, golden, moduli, relative, smallest_eigenvalue, triangle};
use selvedge_energy::{Batch, Curvature, StencilEnergy};
use selvedge_shell_model::shape::{triangle_forms, triangle_forms_derivative};
use selvedge_shell_model::{
    BendingHinge, HingeRest, IncrementalDamping, MembraneStVk, RateDamping, RestTriangle, Undamped,
};

fn hinge(k: f64, angle: f64, damping: f64) -> HingeRest {
    HingeRest {
        points: [0, 1, 2, 3],
        stiffness: k,
        angle,
        length: 0.0,
        heights: [0.0; 2],
        damping,
    }
}

/// Membrane energy, force and both second derivatives, with stretch to twice,
/// collapse to a line, near-collapse to a point and a 1:1000 sliver. The
/// gradient and tension clamp of the point case are in 60-digit arithmetic.
#[test]
fn membrane() {
    for (i, case) in golden("stvk").as_array().unwrap().iter().enumerate() {
        let tolerance = if i == 10 { 1e-8 } else { 1e-11 };
        let mesh = triangle(&flat(&case["X"]));
        let energy = MembraneStVk::<Undamped>::new(&mesh, &[(moduli(&flat(&case["C"])), 0.0)]);
        let batch = Batch::<_, 3, 9>::new("membrane", energy);
        let q = flat(&case["x"]);
        let at = at(&q, &q, 1e-3);
        let (value, g, h) = evaluate(&batch, &at, Curvature::Exact, 0);
        close(
            &format!("{i} energy"),
            &[value],
            &[case["energy"].as_f64().unwrap()],
            tolerance,
        );
        close(
            &format!("{i} gradient"),
            &g,
            &flat(&case["gradient"]),
            tolerance,
        );
        close(
            &format!("{i} hessian"),
            &h,
            &flat(&case["hessian"]),
            tolerance,
        );
        let (_, _, tension) = evaluate(&batch, &at, Curvature::Projected, 0);
        close(
            &format!("{i} tension"),
            &tension,
            &flat(&case["hessian_tension"]),
            tolerance,
        );
        assert!(smallest_eigenvalue(&tension, 9) > -1e-12);
        let above: Vec<f64> = tension.iter().zip(&h).map(|(a, b)| a - b).collect();
        assert!(
            smallest_eigenvalue(&above, 9) > -1e-9,
            "{i} below the exact one"
        );
    }
}

/// Hinge angle, energy, moment and all second derivatives, flat, folded flat,
/// and with a wing of 1:500.
#[test]
fn bending() {
    for (i, case) in golden("hinge").as_array().unwrap().iter().enumerate() {
        let tolerance = if i == 13 { 1e-6 } else { 1e-9 };
        let k = case["k_e"].as_f64().unwrap();
        let angle = case["theta0"].as_f64().unwrap();
        let q = flat(&case["x"]);
        let at = at(&q, &q, 1e-3);
        let mut energy = BendingHinge::<Undamped>::new(&[hinge(k, angle, 0.0)]);
        let theta = case["theta"].as_f64().unwrap();
        // The reference does not unwrap.
        energy.restore_history(&[theta]);
        energy.commit(&at);
        assert!(
            (energy.history()[0] - theta).abs() < 1e-12,
            "{i} {}",
            energy.history()[0]
        );
        let batch = Batch::<_, 4, 12>::new("bending", energy);
        let (value, g, exact) = evaluate(&batch, &at, Curvature::Exact, 0);
        close(
            &format!("{i} energy"),
            &[value],
            &[case["energy"].as_f64().unwrap()],
            tolerance,
        );
        close(
            &format!("{i} gradient"),
            &g,
            &flat(&case["gradient"]),
            tolerance,
        );
        close(
            &format!("{i} hessian"),
            &exact,
            &flat(&case["hessian"]),
            tolerance,
        );
        for (curvature, key) in [
            (Curvature::Projected, "hessian_split_clamp"),
            (Curvature::GaussNewton, "hessian_gauss_newton"),
        ] {
            let (_, _, h) = evaluate(&batch, &at, curvature, 0);
            close(&format!("{i} {key}"), &h, &flat(&case[key]), tolerance);
            assert!(smallest_eigenvalue(&h, 12) > -1e-12, "{i} {key} indefinite");
        }
    }
}

/// Viscous forces and their derivatives: what friction adds to an undamped
/// term, for friction on rates; the increments' limit for a short step.
#[test]
fn dissipation() {
    let all = golden("dissipation");
    let dt = 1e-3;
    for (i, case) in all["stretch"].as_array().unwrap().iter().enumerate() {
        let beta = case["beta_s"].as_f64().unwrap();
        let mesh = triangle(&flat(&case["X"]));
        let laws = [(moduli(&flat(&case["C"])), beta)];
        let (x, v) = (flat(&case["x"]), flat(&case["v"]));
        let start: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x - dt * v).collect();
        let plain = Batch::<_, 3, 9>::new("", MembraneStVk::<Undamped>::new(&mesh, &laws));
        let damped = Batch::<_, 3, 9>::new("", MembraneStVk::<RateDamping>::new(&mesh, &laws));
        check(
            &format!("stretch {i}"),
            case,
            &plain,
            &damped,
            &x,
            &start,
            dt,
        );
        let damped =
            Batch::<_, 3, 9>::new("", MembraneStVk::<IncrementalDamping>::new(&mesh, &laws));
        check_limit(&format!("stretch increment {i}"), case, &plain, &damped);
    }
    for (i, case) in all["bend"].as_array().unwrap().iter().enumerate() {
        let rest = [hinge(
            case["k_e"].as_f64().unwrap(),
            0.0,
            case["beta_b"].as_f64().unwrap(),
        )];
        let (x, v) = (flat(&case["x"]), flat(&case["v"]));
        let start: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x - dt * v).collect();
        let plain = Batch::<_, 4, 12>::new("", BendingHinge::<Undamped>::new(&rest));
        let damped = Batch::<_, 4, 12>::new("", BendingHinge::<RateDamping>::new(&rest));
        check(&format!("bend {i}"), case, &plain, &damped, &x, &start, dt);
        let damped = Batch::<_, 4, 12>::new("", BendingHinge::<IncrementalDamping>::new(&rest));
        check_limit(&format!("bend increment {i}"), case, &plain, &damped);
    }
}

type Term = dyn selvedge_energy::EnergyBatch;

/// What friction adds to force and second derivative.
fn added(plain: &Term, damped: &Term, x: &[f64], start: &[f64], dt: f64) -> (Vec<f64>, Vec<f64>) {
    let at = at(x, start, dt);
    let (_, g0, h0) = evaluate(plain, &at, Curvature::Exact, 0);
    let (_, g1, h1) = evaluate(damped, &at, Curvature::Exact, 0);
    let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
    (minus(&g0, &g1), minus(&h0, &h1))
}

/// The force of increments goes to that of rates with the first power of dt.
fn check_limit(what: &str, case: &serde_json::Value, plain: &Term, damped: &Term) {
    let (x, v) = (flat(&case["x"]), flat(&case["v"]));
    let error = |dt: f64| {
        let start: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x - dt * v).collect();
        relative(
            &added(plain, damped, &x, &start, dt).0,
            &flat(&case["force"]),
        )
    };
    let (long, short) = (error(1e-5), error(1e-6));
    assert!(
        long < 0.05 && (short / long - 0.1).abs() < 0.02,
        "{what}: {long:.2e} {short:.2e}"
    );
}

fn check(
    what: &str,
    case: &serde_json::Value,
    plain: &Term,
    damped: &Term,
    x: &[f64],
    start: &[f64],
    dt: f64,
) {
    // The reference works on v; recovering it from positions costs digits.
    let (force, dh) = added(plain, damped, x, start, dt);
    close(
        &format!("{what} force"),
        &force,
        &flat(&case["force"]),
        1e-9,
    );
    let by_v = flat(&case["dfdv"]);
    let by_x = flat(&case["dfdx_sym"]);
    let want: Vec<f64> = by_v.iter().zip(&by_x).map(|(v, x)| v / dt + x).collect();
    close(&format!("{what} curvature"), &dh, &want, 1e-9);
    // What is left out is the reference's part that is not symmetric.
    let m = x.len();
    let mut numeric = vec![0.0; m * m];
    let mut moved = x.to_vec();
    for j in 0..m {
        let eps = 1e-6;
        let mut sides = [vec![0.0; m], vec![0.0; m]];
        for (side, s) in sides.iter_mut().zip([1.0, -1.0]) {
            moved[j] = x[j] + s * eps;
            let at = at(&moved, start, dt);
            let mut undamped = vec![0.0; m];
            plain.gradients(&at, 0..1, &mut undamped);
            damped.gradients(&at, 0..1, side);
            for (a, b) in side.iter_mut().zip(&undamped) {
                *a -= b;
            }
        }
        moved[j] = x[j];
        for i in 0..m {
            numeric[i * m + j] = -(sides[0][i] - sides[1][i]) / (2.0 * eps);
        }
    }
    let rest = flat(&case["dfdx_nonsym"]);
    let all: Vec<f64> = want.iter().zip(&rest).map(|(a, b)| a + b).collect();
    close(&format!("{what} whole derivative"), &numeric, &all, 1e-5);
}

/// Fundamental forms of planes, cylinders, spheres and random stencils.
#[test]
fn fundamental_forms() {
    for (i, case) in golden("shape_operator")
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
    {
        let material = flat(&case["X"]);
        let corners = [0, 1, 2].map(|i| [material[2 * i], material[2 * i + 1]]);
        let rest = RestTriangle::new(&corners, 0, false).unwrap();
        let q = flat(&case["x"]);
        let x: [[f64; 3]; 6] = q.as_chunks::<3>().0.try_into().unwrap();
        let forms = triangle_forms(&x, [true; 3], &rest);
        let voigt = |m: &[f64]| [m[0], m[3], m[1]];
        close(
            &format!("{i} I"),
            &forms.first,
            &voigt(&flat(&case["I"])),
            1e-10,
        );
        let want = voigt(&flat(&case["II"]));
        // A plane's curvature is round-off in both.
        if case["kind"] == "plane" {
            assert!(forms.second.iter().all(|x| x.abs() < 1e-9));
        } else {
            close(&format!("{i} II"), &forms.second, &want, 1e-10);
        }
        if let Some(radius) = case["R"].as_f64() {
            let [a, b] = forms.principal_curvatures();
            let trace = case["exact_trace"].as_f64().unwrap();
            assert!(
                (a + b - trace).abs() * radius < 2e-3,
                "{i}: {a} {b} {trace}"
            );
        }
        if !case["dII"].is_null() {
            let mut d = [[0.0; 18]; 3];
            assert_eq!(
                triangle_forms_derivative(&x, [true; 3], &rest, &mut d),
                forms
            );
            let want = flat(&case["dII"]);
            for (row, at) in d.iter().zip([0, 54, 18]) {
                close(&format!("{i} dII"), row, &want[at..at + 18], 1e-10);
            }
        }
    }
}
