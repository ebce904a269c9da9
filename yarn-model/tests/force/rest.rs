//! Free patches have states of rest: Newton's method with a line search finds
//! a minimum of the energy, with all forces balanced.

use nalgebra::{DMatrix, DVector};
use selvedge_energy::{Batch, Curvature, DofLayout, EnergyBatch, EvalPoint};
use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::{LockedBending, LockedStretch, StitchWrapping, YarnMaterial};

/// Longest step of a point [m].
const STRIDE: f64 = 3e-4;

struct Patch {
    terms: Vec<Box<dyn EnergyBatch>>,
    q: Vec<f64>,
}

impl Patch {
    /// Of a built-in chart, with arc lengths locked.
    fn new(chart: &str, size: usize) -> Self {
        let pattern = StitchPattern::built_in(chart).unwrap();
        let chart = pattern.chart_of(size, size).unwrap();
        let options = KnitOptions::new(YarnMaterial::sweater());
        let n = knitted(&chart, &options).unwrap().network;
        let mut q = n.points.as_flattened().to_vec();
        // Off the plane in which all forces cancel, 1 µm.
        for (i, x) in q.iter_mut().enumerate() {
            *x += 1e-6 * (f64::from(i as u32) * 1.7).sin();
        }
        let bending = LockedBending::<true>::bending(&n);
        Self {
            terms: vec![
                Box::new(Batch::new("stretch", LockedStretch::stretch(&n))),
                Box::new(Batch::new("bending", bending)),
                Box::new(Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&n))),
            ],
            q,
        }
    }

    /// Energy [J] and its derivatives.
    fn evaluate(&self, q: &[f64]) -> (f64, DVector<f64>, DMatrix<f64>) {
        let at = point(q);
        let mut gradient = DVector::zeros(q.len());
        let mut hessian = DMatrix::zeros(q.len(), q.len());
        let mut value = 0.0;
        for term in &self.terms {
            let m = term.local_dim();
            let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
            for e in 0..term.len() {
                value += term.hessians(&at, Curvature::Exact, e..e + 1, &mut g, &mut h);
                let place = |i: usize| 3 * term.nodes(e)[i / 3] as usize + i % 3;
                for i in 0..m {
                    gradient[place(i)] += g[i];
                    for j in 0..m {
                        hessian[(place(i), place(j))] += h[i * m + j];
                    }
                }
            }
        }
        (value, gradient, hessian)
    }

    /// Whether a step was found; `shift` [N/m] makes the matrix definite.
    fn step(&mut self, shift: &mut f64) -> bool {
        let (value, gradient, hessian) = self.evaluate(&self.q);
        for _ in 0..80 {
            let mut shifted = hessian.clone();
            for i in 0..self.q.len() {
                shifted[(i, i)] += *shift;
            }
            if let Some(factor) = shifted.cholesky() {
                let mut step = factor.solve(&gradient);
                let longest = step.amax();
                if longest > STRIDE {
                    step *= STRIDE / longest;
                }
                let tried: Vec<f64> = self.q.iter().zip(&step).map(|(q, s)| q - s).collect();
                if self.evaluate(&tried).0 <= value * (1.0 + 1e-15) {
                    self.q = tried;
                    *shift *= 0.25;
                    return true;
                }
            }
            *shift = (4.0 * *shift).max(1e-9);
        }
        false
    }
}

fn point(q: &[f64]) -> EvalPoint<'_> {
    EvalPoint {
        layout: DofLayout::points(q.len() / 3),
        q,
        q_start: q,
        dt: 1e-3,
    }
}

/// Every point's forces sum to less than 1e-9 N, where a segment of the yarn
/// weighs 1.7e-5 N, at a minimum: apart from the six rigid motions nothing has
/// a stiffness below zero.
#[test]
fn forces_balance_at_a_minimum() {
    for chart in ["stockinette", "garter"] {
        let mut patch = Patch::new(chart, 4);
        let mut shift = 1.0;
        let mut worst = f64::INFINITY;
        for _ in 0..1500 {
            assert!(patch.step(&mut shift), "{chart}: {worst} N");
            let q = patch.q.clone();
            for term in &mut patch.terms {
                term.commit(&point(&q));
            }
            worst = patch.evaluate(&q).1.amax();
            if worst < 1e-9 {
                break;
            }
        }
        assert!(worst < 1e-9, "{chart}: {worst} N");
        let stiffness = patch.evaluate(&patch.q).2.symmetric_eigenvalues();
        let low = stiffness.iter().filter(|k| **k < 1e-6).count();
        assert_eq!(low, 6, "{chart}");
        assert!(stiffness.min() > -1e-8, "{chart}: {} N/m", stiffness.min());
    }
}
