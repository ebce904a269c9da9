//! Friction laws against golden vectors.

use selvedge_collision::{AnchorState, FrictionAnchored, FrictionLagged};
use serde_json::Value;

fn golden() -> Value {
    serde_json::from_str(include_str!("golden/friction.json")).unwrap()
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap()
}

fn vector<const N: usize>(v: &Value) -> [f64; N] {
    std::array::from_fn(|i| number(&v[i]))
}

fn assert_close<const N: usize>(what: &str, found: [f64; N], expected: [f64; N]) {
    let scale = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f - e).abs() <= 1e-12 * scale,
            "{what}: {f:e} instead of {e:e}"
        );
    }
}

/// Trial, cap, direction, dragged anchor and Jacobians of the anchored law.
#[test]
fn anchored() {
    for c in golden()["anchor"].as_array().unwrap() {
        let state = AnchorState {
            displacement: vector(&c["u"]),
            velocity: vector(&c["v_t"]),
            normal: [0.0; 3], // not used by the force
            normal_force: number(&c["f_n"]),
            stiffness: number(&c["k_t"]),
            damping: number(&c["d_t"]),
        };
        let answer = FrictionAnchored::new(number(&c["mu"])).respond(&state, 1e-3);
        assert_eq!(answer.slipping, c["slipping"].as_bool().unwrap());
        assert_close("force", answer.force, vector(&c["force"]));
        assert_close("anchor", answer.displacement, vector(&c["new_u"]));
        // The oracle differentiates in space: -k_t share (I - τ τᵀ).
        for i in 0..3 {
            let row: [f64; 3] = std::array::from_fn(|j| {
                let t = answer.direction.unwrap_or([0.0; 3]);
                answer.share * (f64::from(u8::from(i == j)) - t[i] * t[j])
            });
            let du: [f64; 3] = vector(&c["dfdu"][i]);
            let dv: [f64; 3] = vector(&c["dfdv"][i]);
            let scale = state.stiffness * answer.share;
            for j in 0..3 {
                assert!((-state.stiffness * row[j] - du[j]).abs() <= 1e-12 * scale);
                let scale = state.damping * answer.share;
                assert!((-state.damping * row[j] - dv[j]).abs() <= 1e-12 * scale);
            }
        }
    }
}

/// The reported energy of the anchored law has the force as its gradient,
/// sticking and slipping, with displacement and velocity moving together.
#[test]
fn anchored_is_a_potential_of_the_step() {
    let f = FrictionAnchored::new(0.4);
    let dt = 2e-3;
    let at = |x: [f64; 2]| {
        let state = AnchorState {
            displacement: [1e-5 + x[0], x[1] - 2e-5, 0.0],
            velocity: [x[0] / dt, x[1] / dt, 0.0],
            normal: [0.0, 0.0, 1.0],
            normal_force: 5e-3,
            stiffness: 80.0,
            damping: 0.02,
        };
        f.respond(&state, dt)
    };
    let mut kinds = [false; 2];
    for x in [[1e-6, 2e-6], [3e-5, -1e-5], [1e-4, 2e-4], [-6e-6, 5e-6]] {
        let e = 1e-9;
        let a = at(x);
        kinds[usize::from(a.slipping)] = true;
        for i in 0..2 {
            let (mut p, mut m) = (x, x);
            p[i] += e;
            m[i] -= e;
            let slope = (at(p).energy - at(m).energy) / (2.0 * e);
            assert!((slope + a.force[i]).abs() < 1e-6 * 2e-3, "{x:?}");
        }
    }
    assert_eq!(kinds, [true, true]);
}

/// Energy, force and second derivative of the smoothed law.
#[test]
fn smoothed() {
    for c in golden()["smoothed"].as_array().unwrap() {
        let e = number(&c["eps_h"]);
        let f = FrictionLagged {
            coefficient: number(&c["mu"]),
            creep_speed: e / 1e-3,
        };
        let [x, y] = vector(&c["u"]);
        let a = f.respond([x, y, 0.0], [0.0, 0.0, 1.0], number(&c["lam"]), 1e-3);
        assert_close("energy", [a.energy], [number(&c["energy"])]);
        let g: [f64; 2] = vector(&c["gradient"]);
        assert_close("force", a.force, [-g[0], -g[1], 0.0]);
        let h: [[f64; 2]; 2] = [vector(&c["hessian"][0]), vector(&c["hessian"][1])];
        let flat = [
            a.curvature[0][0],
            a.curvature[0][1],
            a.curvature[1][0],
            a.curvature[1][1],
        ];
        assert_close("hessian", flat, [h[0][0], h[0][1], h[1][0], h[1][1]]);
        for k in 0..3 {
            assert_eq!(a.curvature[2][k], 0.0, "no stiffness along the normal");
        }
    }
    let rest = FrictionLagged::new(0.5).respond([0.0; 3], [0.0, 1.0, 0.0], 2.0, 1e-3);
    assert_eq!(rest.force, [0.0; 3]);
    assert!((rest.curvature[0][0] - 0.5 * 2.0 * 2.0 / 1e-6).abs() < 1e-3);
}
