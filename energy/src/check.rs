//! Checks that users can run on their own energies.

use nalgebra::DMatrix;

use crate::{Curvature, EnergyBatch, EnergyError, EvalPoint};

/// Largest errors over all stencils, relative to the largest entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivativeReport {
    /// Gradient against differences of the value; `None` for a term that is
    /// not conservative.
    pub gradient: Option<f64>,
    /// Exact second derivative against differences of the gradient.
    pub hessian: f64,
}

/// Steps of the central differences, relative to the size of the stencil. The
/// best one counts: large steps truncate, small ones cancel.
const STEPS: [f64; 5] = [3e-3, 1e-3, 3e-4, 1e-4, 3e-5];

/// Compares gradients and exact second derivatives with fourth-order central
/// differences. Call it with `q_start` different from `q`, or rate-dependent
/// terms are not tested.
///
/// # Errors
/// [`EnergyError::Derivative`] for the first stencil beyond `tolerance`,
/// [`EnergyError::NotFinite`] for one that gives NaN or infinity.
pub fn check_derivatives(
    batch: &dyn EnergyBatch,
    at: &EvalPoint<'_>,
    tolerance: f64,
) -> Result<DerivativeReport, EnergyError> {
    let m = batch.local_dim();
    let mut worst = DerivativeReport {
        gradient: batch.is_conservative().then_some(0.0),
        hessian: 0.0,
    };
    let mut g = vec![0.0; m];
    let mut h = vec![0.0; m * m];
    let mut q = at.q.to_vec();
    for e in 0..batch.len() {
        let value = batch.hessians(at, Curvature::Exact, e..e + 1, &mut g, &mut h);
        finite(batch, e, "value", &[value])?;
        finite(batch, e, "gradient", &g)?;
        finite(batch, e, "hessian", &h)?;
        let unknowns = unknowns(batch, at, e);
        let scale = size(at, batch, e);

        if let Some(worst_gradient) = &mut worst.gradient {
            let err = STEPS
                .iter()
                .map(|step| {
                    let step = step * scale;
                    let numeric: Vec<f64> = unknowns
                        .iter()
                        .map(|&u| {
                            let [d] = difference(&mut q, u, step, |q| {
                                [batch.value(&EvalPoint { q, ..*at }, e..e + 1)]
                            });
                            d
                        })
                        .collect();
                    relative(&g, &numeric)
                })
                .fold(f64::INFINITY, f64::min);
            *worst_gradient = worst_gradient.max(err);
            accept(batch, e, "gradient", err, tolerance)?;
        }

        let err = STEPS
            .iter()
            .map(|step| {
                let step = step * scale;
                let mut numeric = vec![0.0; m * m];
                for (j, &u) in unknowns.iter().enumerate() {
                    let column = difference_vec(&mut q, u, step, m, |q, out| {
                        batch.gradients(&EvalPoint { q, ..*at }, e..e + 1, out);
                    });
                    for i in 0..m {
                        numeric[i * m + j] = column[i];
                    }
                }
                relative(&h, &numeric)
            })
            .fold(f64::INFINITY, f64::min);
        worst.hessian = worst.hessian.max(err);
        accept(batch, e, "hessian", err, tolerance)?;
    }
    Ok(worst)
}

/// Checks that the given second derivative has no eigenvalue below
/// `-tolerance` times its norm. Returns the smallest ratio met.
///
/// # Errors
/// [`EnergyError::Indefinite`] for the first stencil that fails.
pub fn check_projection(
    batch: &dyn EnergyBatch,
    at: &EvalPoint<'_>,
    curvature: Curvature,
    tolerance: f64,
) -> Result<f64, EnergyError> {
    let m = batch.local_dim();
    let mut g = vec![0.0; m];
    let mut h = vec![0.0; m * m];
    let mut worst = f64::INFINITY;
    for e in 0..batch.len() {
        batch.hessians(at, curvature, e..e + 1, &mut g, &mut h);
        finite(batch, e, "hessian", &h)?;
        let eigen = DMatrix::from_row_slice(m, m, &h).symmetric_eigenvalues();
        let norm = eigen.amax();
        let smallest = eigen.min();
        if smallest < -tolerance * norm {
            return Err(EnergyError::Indefinite {
                term: batch.name().into(),
                stencil: e,
                smallest,
                norm,
            });
        }
        if norm > 0.0 {
            worst = worst.min(smallest / norm);
        }
    }
    Ok(worst)
}

/// Checks a term made of points alone: forces and torques sum to zero, and a
/// rigid motion of the end (and start) of the step leaves the value.
///
/// # Errors
/// [`EnergyError::NotInvariant`] for the first stencil beyond `tolerance`.
///
/// # Panics
/// When a node is a scalar.
pub fn check_rigid_motion(
    batch: &dyn EnergyBatch,
    at: &EvalPoint<'_>,
    tolerance: f64,
) -> Result<(), EnergyError> {
    assert!(batch.node_dims().iter().all(|d| *d == 3), "points only");
    // A rotation by 1.1 rad about (1, 2, 2) / 3 and a shift.
    let (s, c) = 1.1_f64.sin_cos();
    let axis = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    let turn = |p: [f64; 3]| {
        let cross = cross(axis, p);
        let along = axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
        let shift = [0.3, -0.2, 0.7];
        std::array::from_fn::<f64, 3, _>(|i| {
            c * p[i] + s * cross[i] + (1.0 - c) * along * axis[i] + shift[i]
        })
    };
    let moved = |q: &[f64]| -> Vec<f64> {
        let (points, scalars) = q.split_at(3 * at.layout.points);
        let (points, _) = points.as_chunks::<3>();
        points
            .iter()
            .flat_map(|p| turn(*p))
            .chain(scalars.iter().copied())
            .collect()
    };
    let (q, q_start) = (moved(at.q), moved(at.q_start));
    let at_moved = EvalPoint {
        q: &q,
        q_start: &q_start,
        ..*at
    };

    let m = batch.local_dim();
    let mut g = vec![0.0; m];
    for e in 0..batch.len() {
        let fail = |what, amount: f64| {
            Err(EnergyError::NotInvariant {
                term: batch.name().into(),
                stencil: e,
                what,
                amount,
            })
        };
        let value = batch.gradients(at, e..e + 1, &mut g);
        let scale = size(at, batch, e);
        let largest = g.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        if largest > 0.0 {
            let mut force = [0.0; 3];
            let mut torque = [0.0; 3];
            let origin = at.point(batch.nodes(e)[0]);
            for (n, f) in batch.nodes(e).iter().zip(g.as_chunks::<3>().0) {
                let p = at.point(*n);
                let arm = std::array::from_fn(|i| p[i] - origin[i]);
                let t = cross(arm, *f);
                for i in 0..3 {
                    force[i] += f[i];
                    torque[i] += t[i];
                }
            }
            let force = force.iter().fold(0.0_f64, |a, b| a.max(b.abs())) / largest;
            let torque = torque.iter().fold(0.0_f64, |a, b| a.max(b.abs())) / (largest * scale);
            if force > tolerance {
                return fail("forces do not sum to zero:", force);
            }
            if torque > tolerance {
                return fail("torques do not sum to zero:", torque);
            }
        }
        let change = (batch.value(&at_moved, e..e + 1) - value).abs();
        let scale = value.abs().max(largest * scale);
        if change > tolerance * scale {
            return fail("a rigid motion changes the value by", change / scale);
        }
    }
    Ok(())
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unknowns(batch: &dyn EnergyBatch, at: &EvalPoint<'_>, e: usize) -> Vec<usize> {
    let mut all = Vec::with_capacity(batch.local_dim());
    for (n, &dim) in batch.nodes(e).iter().zip(batch.node_dims()) {
        let from = at.layout.offset(*n, dim);
        all.extend(from..from + dim);
    }
    all
}

/// Largest distance between two points of the stencil, or 1.
fn size(at: &EvalPoint<'_>, batch: &dyn EnergyBatch, e: usize) -> f64 {
    let points: Vec<[f64; 3]> = batch
        .nodes(e)
        .iter()
        .zip(batch.node_dims())
        .filter(|(_, d)| **d == 3)
        .map(|(n, _)| at.point(*n))
        .collect();
    let mut size = 0.0_f64;
    for a in &points {
        for b in &points {
            size = size.max((0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt());
        }
    }
    if size > 0.0 { size } else { 1.0 }
}

fn difference<const K: usize>(
    q: &mut [f64],
    unknown: usize,
    step: f64,
    mut f: impl FnMut(&[f64]) -> [f64; K],
) -> [f64; K] {
    let centre = q[unknown];
    let mut at = |offset: f64| {
        q[unknown] = centre + offset;
        let value = f(q);
        q[unknown] = centre;
        value
    };
    let (a, b, c, d) = (at(-2.0 * step), at(-step), at(step), at(2.0 * step));
    std::array::from_fn(|k| (a[k] - 8.0 * b[k] + 8.0 * c[k] - d[k]) / (12.0 * step))
}

fn difference_vec(
    q: &mut [f64],
    unknown: usize,
    step: f64,
    m: usize,
    mut f: impl FnMut(&[f64], &mut [f64]),
) -> Vec<f64> {
    let centre = q[unknown];
    let mut sum = vec![0.0; m];
    let mut out = vec![0.0; m];
    for (offset, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
        q[unknown] = centre + offset * step;
        f(q, &mut out);
        for (s, o) in sum.iter_mut().zip(&out) {
            *s += weight * o / (12.0 * step);
        }
    }
    q[unknown] = centre;
    sum
}

fn relative(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().chain(b).fold(0.0_f64, |m, v| m.max(v.abs()));
    let error = a
        .iter()
        .zip(b)
        .fold(0.0_f64, |m, (x, y)| m.max((x - y).abs()));
    if largest > 0.0 { error / largest } else { 0.0 }
}

fn accept(
    batch: &dyn EnergyBatch,
    stencil: usize,
    what: &'static str,
    relative_error: f64,
    allowed: f64,
) -> Result<(), EnergyError> {
    if relative_error <= allowed {
        return Ok(());
    }
    Err(EnergyError::Derivative {
        term: batch.name().into(),
        stencil,
        what,
        relative_error,
        allowed,
    })
}

fn finite(
    batch: &dyn EnergyBatch,
    stencil: usize,
    what: &'static str,
    values: &[f64],
) -> Result<(), EnergyError> {
    if values.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(EnergyError::NotFinite {
        term: batch.name().into(),
        stencil,
        what,
    })
}
