//! The iteration.

use super::{Mpcg, StopNorm, Work, fused};
use crate::preconditioner::Pointwise;
use crate::{Filter, LinearOperator, Preconditioner, Real, SolveReport, SolveStatus, vector};

/// The true residual may exceed the tolerance by this factor: it differs from
/// the recursive one by rounding.
const SLACK: f64 = 1.1;
/// Restarts from the true residual before the precision counts as exhausted.
const RESTARTS: usize = 8;
/// Where the true residual is this many times the recursive one, rounding has
/// taken over and the old direction is of no use.
const DRIFT: f64 = 2.0;
/// A true residual this many times the best one so far is worth going back.
const GROWTH: f64 = 10.0;

/// Squares in the three norms; `stop` is the one of the stop test.
#[derive(Clone, Copy)]
struct Squares {
    rr: f64,
    rz: f64,
    stop: f64,
}

impl<T: Real> Mpcg<T> {
    /// Operands are checked; `x` is finite on return.
    pub(super) fn run(
        &mut self,
        a: &dyn LinearOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &mut [f64],
    ) -> SolveReport {
        let scale = scale_of(b, x);
        self.work.resize(a.dim());
        let (reference, now) = self.start(a, b, filter, x, scale);
        let report = |status, iterations, s: Squares, limit: f64| SolveReport {
            solver: "cg",
            iterations,
            relative_residual: ratio(s.rr.sqrt(), reference.rr.sqrt()),
            residual: s.rr.sqrt() / scale,
            stop_ratio: ratio(s.stop.sqrt(), limit.sqrt()),
            status,
        };
        let limit = self.settings.tolerance.powi(2) * reference.stop;
        if !(reference.rr.is_finite() && reference.rz.is_finite()) {
            return report(SolveStatus::Diverged, 0, reference, limit);
        }
        if reference.rr == 0.0 {
            // the prescribed part alone solves the system
            if filter.is_identity() {
                x.fill(0.0);
            } else {
                keep_prescribed(filter, &mut self.work, x);
            }
            return report(SolveStatus::Converged, 0, reference, limit);
        }
        let (status, iterations, last) = self.iterate(a, filter, limit, now);
        if status != SolveStatus::Diverged {
            for (x, d) in x.iter_mut().zip(&self.work.x) {
                *x += d.to_f64() / scale;
            }
        }
        report(status, iterations, last, limit)
    }

    /// Residual of the starting vector in `r` and `start`, `d = 0`; returns the
    /// squares of the filtered right-hand side and of that residual.
    fn start(
        &mut self,
        a: &dyn LinearOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &[f64],
        scale: f64,
    ) -> (Squares, Squares) {
        let w = &mut self.work;
        w.x.fill(T::ZERO);
        vector::convert(scale, b, &mut w.r);
        let cold = x.iter().all(|v| *v == 0.0);
        let mut warm = false;
        if !cold {
            // z = (I − S) x in q, through the guess S x in c
            vector::convert(scale, x, &mut w.c);
            w.z.copy_from_slice(&w.c);
            filter.project(&mut w.c);
            for (q, (&x, &s)) in w.q.iter_mut().zip(w.z.iter().zip(&w.c)) {
                *q = x - s;
            }
            warm = w.c.iter().any(|v| *v != T::ZERO);
            a.apply(&w.q, &mut w.start);
            vector::axpy(-T::ONE, &w.start, &mut w.r);
        }
        filter.project(&mut w.r);
        let reference = self.squares(a, filter);
        let mut now = reference;
        if warm {
            let w = &mut self.work;
            a.apply(&w.c, &mut w.q);
            vector::axpy(-T::ONE, &w.q, &mut w.r);
            filter.project(&mut w.r);
            now = self.squares(a, filter);
        }
        self.work.start.copy_from_slice(&self.work.r);
        (reference, now)
    }

    /// `z = S P⁻¹ r` (for the identity `z` stays unused) and the squares of `r`.
    fn squares(&mut self, a: &dyn LinearOperator<T>, filter: &dyn Filter<T>) -> Squares {
        let w = &mut self.work;
        let rr = vector::dot(&w.r, &w.r);
        let rz = if identity(&*self.preconditioner) {
            rr
        } else {
            self.preconditioner.apply(a, &w.r, &mut w.z);
            filter.project(&mut w.z);
            vector::dot(&w.r, &w.z)
        };
        let stop = self.stop(rr, rz);
        Squares { rr, rz, stop }
    }

    fn stop(&self, rr: f64, rz: f64) -> f64 {
        match &self.settings.norm {
            StopNorm::Euclidean => rr,
            StopNorm::Weighted(w) => fused::weighted_square(w, &self.work.r),
            StopNorm::Preconditioned => rz,
        }
    }

    fn iterate(
        &mut self,
        a: &dyn LinearOperator<T>,
        filter: &dyn Filter<T>,
        limit: f64,
        mut now: Squares,
    ) -> (SolveStatus, usize, Squares) {
        let needs_z = self.settings.norm == StopNorm::Preconditioned;
        let growth = self.settings.divergence.powi(2) * now.rr;
        self.first_direction(filter);
        let (mut restarts, mut restarted) = (0, f64::INFINITY);
        // The best true residual so far, whose iterate is kept.
        let mut best: Option<Squares> = None;
        let mut drifted = false;
        for done in 0.. {
            if !(now.rr.is_finite() && now.rz.is_finite() && now.rr <= growth) {
                return match best {
                    // Only rounding undoes what was reached before.
                    Some(best) => (SolveStatus::Stagnated, done, self.back_to(best)),
                    None => (SolveStatus::Diverged, done, now),
                };
            }
            if now.stop <= limit || drifted {
                now = self.true_squares(a, filter);
                if now.stop <= SLACK * SLACK * limit {
                    return (SolveStatus::Converged, done, now);
                }
                restarts += 1;
                // NaN ends the iteration too.
                let better = now.stop <= 0.25 * restarted && now.rz > 0.0;
                self.keep_better(&mut best, now);
                if restarts > RESTARTS || !better {
                    let last = best.map_or(now, |best| self.back_to(best));
                    return (SolveStatus::Stagnated, done, last);
                }
                restarted = now.stop;
                drifted = false;
                self.first_direction(filter);
            }
            if done == self.settings.max_iterations {
                let mut now = self.true_squares(a, filter);
                if let Some(best) = best
                    && (now.stop.is_nan() || now.stop > GROWTH * GROWTH * best.stop)
                {
                    now = self.back_to(best);
                }
                return (SolveStatus::IterationLimit, done, now);
            }
            let w = &mut self.work;
            let curvature = a.apply_dot(&w.c, &mut w.q);
            if !(curvature > 0.0 && now.rz > 0.0) {
                if curvature.is_nan() || now.rz.is_nan() {
                    return (SolveStatus::Diverged, done, now);
                }
                if done == 0 && curvature != 0.0 && curvature.is_finite() {
                    // the direction itself, as long as its curvature suggests
                    let length = T::from_f64(now.rz / curvature.abs());
                    vector::axpy(length, &w.c, &mut w.x);
                    if w.x.iter().any(|v| !v.finite()) {
                        w.x.fill(T::ZERO);
                    }
                }
                let now = self.true_squares(a, filter);
                return (SolveStatus::NegativeCurvature, done, now);
            }
            filter.project(&mut w.q);
            let step = T::from_f64(now.rz / curvature);
            let before = now.rz;
            if let Some(p) = self.preconditioner.pointwise() {
                let (c, q) = (&w.c, &w.q);
                let [rr, rz] = fused::advance(p, step, c, q, &mut w.x, &mut w.r, &mut w.z);
                now = Squares { rr, rz, stop: rr };
                now.stop = self.stop(rr, rz);
            } else {
                let rr = vector::step(step, &w.c, &w.q, &mut w.x, &mut w.r);
                let stop = if needs_z {
                    f64::INFINITY
                } else {
                    self.stop(rr, 0.0)
                };
                let rz = if stop <= limit {
                    1.0 // not needed: the true residual follows
                } else {
                    let w = &mut self.work;
                    self.preconditioner.apply(a, &w.r, &mut w.z);
                    filter.project(&mut w.z);
                    vector::dot(&w.r, &w.z)
                };
                let stop = if needs_z { rz } else { stop };
                now = Squares { rr, rz, stop };
            }
            let interval = self.settings.true_residual_interval.max(1);
            if (done + 1) % interval == 0 && now.stop > limit && now.rr.is_finite() {
                let recursive = now.stop;
                now = self.true_squares(a, filter);
                self.keep_better(&mut best, now);
                if let Some(best) = best
                    && now.stop > GROWTH * GROWTH * best.stop
                {
                    now = self.back_to(best);
                    drifted = true;
                    // A place that was returned to is no progress.
                    restarted = restarted.max(4.0 * best.stop);
                    continue;
                }
                if now.stop > DRIFT * DRIFT * recursive {
                    drifted = true;
                    continue;
                }
            }
            let w = &mut self.work;
            let z = if identity(&*self.preconditioner) {
                &w.r
            } else {
                &w.z
            };
            vector::xpay(z, T::from_f64(now.rz / before), &mut w.c);
            filter.project(&mut w.c);
        }
        unreachable!("the loop has no other exit")
    }

    /// Keeps the iterate if its true residual is the best so far.
    fn keep_better(&mut self, best: &mut Option<Squares>, now: Squares) {
        if now.stop.is_finite() && best.is_none_or(|best| now.stop < best.stop) {
            *best = Some(now);
            let w = &mut self.work;
            w.best.clear();
            w.best.extend_from_slice(&w.x);
        }
    }

    /// Takes the kept iterate back.
    fn back_to(&mut self, best: Squares) -> Squares {
        self.work.x.copy_from_slice(&self.work.best);
        best
    }

    /// `c = S P⁻¹ r`.
    fn first_direction(&mut self, filter: &dyn Filter<T>) {
        let w = &mut self.work;
        let identity = identity(&*self.preconditioner);
        w.c.copy_from_slice(if identity { &w.r } else { &w.z });
        filter.project(&mut w.c);
    }

    /// Replaces the recursive residual by `S (b − A x)`.
    fn true_squares(&mut self, a: &dyn LinearOperator<T>, filter: &dyn Filter<T>) -> Squares {
        let w = &mut self.work;
        a.apply(&w.x, &mut w.r);
        vector::xpay(&w.start, -T::ONE, &mut w.r);
        filter.project(&mut w.r);
        self.squares(a, filter)
    }
}

fn identity<T: Real>(p: &dyn Preconditioner<T>) -> bool {
    matches!(p.pointwise(), Some(Pointwise::Identity))
}

impl<T: Real> Work<T> {
    fn resize(&mut self, n: usize) {
        let Work {
            x,
            r,
            c,
            q,
            z,
            start,
            best: _,
        } = self;
        for v in [x, r, c, q, z, start] {
            v.resize(n, T::ZERO);
        }
    }
}

/// `x ← (I − S) x`, exactly where the filter keeps or removes whole components.
fn keep_prescribed<T: Real>(filter: &dyn Filter<T>, w: &mut Work<T>, x: &mut [f64]) {
    vector::convert(1.0, x, &mut w.c);
    filter.project(&mut w.c);
    for (x, s) in x.iter_mut().zip(&w.c) {
        *x -= s.to_f64();
    }
}

/// Power of two that brings the right-hand side (else the starting vector) to
/// order 1; a power of two rounds nothing.
fn scale_of(b: &[f64], x: &[f64]) -> f64 {
    let top = |v: &[f64]| v.iter().fold(0.0f64, |m, a| m.max(a.abs()));
    let size = match top(b) {
        0.0 => top(x),
        size => size,
    };
    if size == 0.0 {
        return 1.0;
    }
    (-size.log2().floor()).clamp(-1000.0, 1000.0).exp2()
}

fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}
