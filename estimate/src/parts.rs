//! From distances between runs to errors.

use selvedge_record::compare::Distances;
use selvedge_scene::summary::{Effectivity, ErrorPart, ErrorReport};

/// Estimates over errors on cases whose exact shape is known, as measured by the test
/// `effectivity_on_exact_shapes`.
pub const EFFECTIVITY: [Effectivity; 2] = [
    Effectivity {
        case: "hanging strip",
        value: 8.95,
    },
    Effectivity {
        case: "falling square",
        value: 1.06,
    },
];

/// Lowest and highest order believed of the mesh: below, the meshes are too
/// coarse to tell; linear triangles have no higher one.
const ORDERS: (f64, f64) = (1.0, 2.0);

/// Error of the mesh from the distances to meshes twice (`near`) and four
/// times as coarse (`far`).
///
/// ```text
/// e = near / (2^p − 1),   p = log2(far / near) ∈ [1, 2]
/// ```
/// Without `far` the order counts as 1.
pub fn space_part(near: Distances, far: Option<Distances>) -> ErrorPart {
    let ratio = far.map(|far| far.mean / near.mean);
    let seen = ratio.filter(|r| r.is_finite() && *r > 0.0).map(f64::log2);
    let order = seen.unwrap_or(ORDERS.0).clamp(ORDERS.0, ORDERS.1);
    let how = match seen {
        Some(p) if p < ORDERS.0 => format!(
            "against meshes 2 and 4 times as coarse; the difference falls with the order {p:.2} \
             only, so that all of it counts"
        ),
        Some(p) => {
            format!(
                "against meshes 2 and 4 times as coarse; the difference falls with the order {p:.2}"
            )
        }
        None => "against a mesh twice as coarse, as if of first order".to_owned(),
    };
    ErrorPart {
        error_m: Some(near.mean / (order.exp2() - 1.0)),
        distance_m: Some([near.mean, near.p95, near.max]),
        order: Some(order),
        how,
    }
}

/// Error of the time step from the distance to a run with half of it: twice
/// that, backward Euler being of first order. `mesh` says what both ran on.
pub fn time_part(halved: Distances, mesh: &str) -> ErrorPart {
    ErrorPart {
        error_m: Some(2.0 * halved.mean),
        distance_m: Some([halved.mean, halved.p95, halved.max]),
        order: Some(1.0),
        how: format!("against steps half as long, {mesh}"),
    }
}

/// Error of a setting whose tightening brings the results no closer, from the
/// distances between them: the largest. Nothing is extrapolated, for another
/// rest shape is no remainder of a series.
pub fn scatter_part(seen: &[Distances], mesh: &str) -> ErrorPart {
    let largest = seen.iter().max_by(|a, b| a.mean.total_cmp(&b.mean));
    let Distances { mean, p95, max, .. } = largest.copied().unwrap_or_default();
    ErrorPart {
        error_m: Some(mean),
        distance_m: Some([mean, p95, max]),
        order: None,
        how: format!(
            "the largest of {} differences that fall no further when it is tightened, {mesh}: \
             the rest repeats no better",
            seen.len()
        ),
    }
}

/// Error of the tolerances from the distance to a run with a tenth of them, as
/// if proportional to them.
pub fn algebraic_part(tightened: Distances, mesh: &str) -> ErrorPart {
    ErrorPart {
        error_m: Some(tightened.mean / 0.9),
        distance_m: Some([tightened.mean, tightened.p95, tightened.max]),
        order: None,
        how: format!("against tolerances ten times tighter, {mesh}"),
    }
}

/// The whole error [m]; `None` when a part is not known.
///
/// ```text
/// e = √((e_a + e_h + e_τ)² + e_p²)
/// ```
/// Mesh `e_a`, steps `e_h` and tolerances `e_τ` may all err to the same side.
/// Which end the path leads to, `e_p`, has nothing to do with them, so that
/// squares add up.
pub fn total(report: &ErrorReport) -> Option<f64> {
    let numerics = numerics([&report.space, &report.time, &report.algebraic])?;
    Some(numerics.hypot(report.path.error_m?))
}

/// Sum of the parts that finer settings lessen [m].
pub(crate) fn numerics<const N: usize>(parts: [&ErrorPart; N]) -> Option<f64> {
    parts.iter().map(|p| p.error_m).sum()
}

/// What the path leaves of a wanted error for mesh, steps and tolerances [m]:
/// nothing where other beginnings alone end farther apart.
pub(crate) fn beside_path(target: f64, path: &ErrorPart) -> f64 {
    let path = path.error_m.unwrap_or(0.0);
    (target * target - path * path).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn mean(mean: f64) -> Distances {
        Distances {
            mean,
            p95: 2.0 * mean,
            max: 3.0 * mean,
            ..Distances::default()
        }
    }

    #[test]
    fn mesh_error_by_observed_order() {
        // x_a = x + c a^p: the distances are c a^p (2^p − 1) and 2^p times that.
        for p in [1.0, 1.5, 2.0f64] {
            let near = p.exp2() - 1.0;
            let part = space_part(mean(near), Some(mean(near * p.exp2())));
            assert_relative_eq!(part.error_m.unwrap(), 1.0, epsilon = 1e-12);
            assert_relative_eq!(part.order.unwrap(), p, epsilon = 1e-12);
        }
        // Faster than the elements can: not believed.
        assert_relative_eq!(
            space_part(mean(3.0), Some(mean(300.0))).error_m.unwrap(),
            1.0
        );
        // Not falling, or nothing to compare with: all of it counts.
        for far in [None, Some(mean(0.1)), Some(mean(0.0))] {
            assert_relative_eq!(space_part(mean(3.0), far).error_m.unwrap(), 3.0);
        }
        // No difference at all is no error.
        assert_eq!(space_part(mean(0.0), Some(mean(0.0))).error_m, Some(0.0));
    }

    #[test]
    fn scatter_is_not_extrapolated() {
        let part = scatter_part(&[mean(1.0), mean(3.0), mean(2.0)], "there");
        assert_eq!(part.error_m, Some(3.0));
        assert_eq!(part.distance_m, Some([3.0, 6.0, 9.0]));
    }

    #[test]
    fn parts_add_up() {
        let mut report = ErrorReport {
            space: space_part(mean(1.0), None),
            time: time_part(mean(1.0), "there"),
            algebraic: algebraic_part(mean(0.9), "there"),
            path: scatter_part(&[mean(3.0)], "there"),
            cpu_s: 0.0,
            target_m: None,
            decisions: Vec::new(),
            effectivity: &EFFECTIVITY,
        };
        assert_relative_eq!(total(&report).unwrap(), 5.0, epsilon = 1e-12);
        // What the path leaves of that is what the others took.
        assert_relative_eq!(beside_path(5.0, &report.path), 4.0, epsilon = 1e-12);
        assert_eq!(beside_path(3.0, &report.path), 0.0);
        for part in 0..4 {
            let mut report = report.clone();
            let parts = [
                &mut report.space,
                &mut report.time,
                &mut report.algebraic,
                &mut report.path,
            ];
            parts.into_iter().nth(part).unwrap().error_m = None;
            assert_eq!(total(&report), None);
        }
        report.path.error_m = Some(0.0);
        assert_relative_eq!(total(&report).unwrap(), 4.0, epsilon = 1e-12);
    }
}
