//! The iteration.

use super::{Mpcg, StopNorm, Work, fused};
use crate::preconditioner::Pointwise;
use crate::{Filter, LinearOperator, Preconditioner, Real, SolveReport, SolveStatus, Sums, vector};

/// The true residual may exceed the tolerance by this factor: it differs from
/// the recursive one by rounding.
const SLACK: f64 = 1.1;
/// Restarts from the true residual before the precision counts as exhausted.
const RESTARTS: usize = 8;
/// Looks at a residual led by rounding that did not halve it, before the
/// precision counts as exhausted.
const LOOKS: usize = 3;

/// Squares in the three norms; `stop` is the one of the stop test.
#[derive(Clone, Copy)]
struct Squares {
    rr: f64,
    rz: f64,
    stop: f64,
}

/// What has been seen of rounding.
#[derive(Default)]
struct Rounding {
    /// Squares of the best iterate seen, which `Work::best` keeps.
    best: Option<Squares>,
    restarts: usize,
    last_restart: Option<f64>,
    looks: usize,
    halved: Option<f64>,
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
        let sums = self.settings.sums;
        let rr = dot(sums, &w.r, &w.r);
        let rz = if identity(&*self.preconditioner) {
            rr
        } else {
            self.preconditioner.apply(a, &w.r, &mut w.z);
            filter.project(&mut w.z);
            dot(sums, &w.r, &w.z)
        };
        let stop = self.stop(rr, rz);
        Squares { rr, rz, stop }
    }

    fn stop(&self, rr: f64, rz: f64) -> f64 {
        match &self.settings.norm {
            StopNorm::Euclidean => rr,
            StopNorm::Weighted(w) => match self.settings.sums {
                Sums::Double => fused::weighted_square::<f64, T>(w, &self.work.r),
                Sums::OfVectors => fused::weighted_square::<T, T>(w, &self.work.r),
            },
            StopNorm::Preconditioned => rz,
        }
    }

    fn iterate(
        &mut self,
        a: &dyn LinearOperator<T>,
        filter: &dyn Filter<T>,
        limit: f64,
        now: Squares,
    ) -> (SolveStatus, usize, Squares) {
        let mut rounding = Rounding::default();
        let (status, done, last) = self.descend(a, filter, limit, now, &mut rounding);
        let Some(best) = rounding.best else {
            return (status, done, last);
        };
        // a comparison with NaN is false
        let kept = status == SolveStatus::Converged || last.stop <= best.stop;
        let last = if kept {
            last
        } else {
            self.work.x.copy_from_slice(&self.work.best);
            best
        };
        // what is left is rounding: curvature and growth say nothing about A
        let status = match status {
            SolveStatus::NegativeCurvature | SolveStatus::Diverged => SolveStatus::Stagnated,
            other => other,
        };
        (status, done, last)
    }

    fn descend(
        &mut self,
        a: &dyn LinearOperator<T>,
        filter: &dyn Filter<T>,
        limit: f64,
        mut now: Squares,
        rounding: &mut Rounding,
    ) -> (SolveStatus, usize, Squares) {
        let needs_z = self.settings.norm == StopNorm::Preconditioned;
        let sums = self.settings.sums;
        let growth = self.settings.divergence.powi(2) * now.rr;
        self.first_direction(filter);
        for done in 0.. {
            if !(now.rr.is_finite() && now.rz.is_finite() && now.rr <= growth) {
                return (SolveStatus::Diverged, done, now);
            }
            if now.stop <= limit {
                now = self.true_squares(a, filter);
                if now.stop <= SLACK * SLACK * limit {
                    return (SolveStatus::Converged, done, now);
                }
                self.keep(rounding, now);
                rounding.restarts += 1;
                let same = rounding.last_restart.is_some_and(|s| now.stop > 0.25 * s);
                if rounding.restarts > RESTARTS || same || now.rz <= 0.0 {
                    return (SolveStatus::Stagnated, done, now);
                }
                rounding.last_restart = Some(now.stop);
                self.first_direction(filter);
            }
            if done == self.settings.max_iterations {
                let now = self.true_squares(a, filter);
                return (SolveStatus::IterationLimit, done, now);
            }
            let w = &mut self.work;
            let curvature = a.apply_dot(&w.c, &mut w.q, sums);
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
                let (x, r, z) = (&mut w.x, &mut w.r, &mut w.z);
                let [rr, rz] = match sums {
                    Sums::Double => fused::advance::<f64, T>(p, step, c, q, x, r, z),
                    Sums::OfVectors => fused::advance::<T, T>(p, step, c, q, x, r, z),
                };
                now = Squares { rr, rz, stop: rr };
                now.stop = self.stop(rr, rz);
            } else {
                let (c, q, x, r) = (&w.c, &w.q, &mut w.x, &mut w.r);
                let rr = match sums {
                    Sums::Double => vector::step::<f64, T>(step, c, q, x, r),
                    Sums::OfVectors => vector::step::<T, T>(step, c, q, x, r),
                };
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
                    dot(sums, &w.r, &w.z)
                };
                let stop = if needs_z { rz } else { stop };
                now = Squares { rr, rz, stop };
            }
            let interval = self.settings.true_residual_interval.max(1);
            if (done + 1) % interval == 0 && now.stop > limit && now.rr.is_finite() {
                let w = &mut self.work;
                w.q.copy_from_slice(&w.r);
                now = self.true_squares(a, filter);
                // what rounding has added since the last look: half of what is left?
                let w = &mut self.work;
                vector::axpy(-T::ONE, &w.r, &mut w.q);
                let leads = 4.0 * dot(sums, &w.q, &w.q) > now.rr;
                if leads {
                    if self.exhausted(rounding, now) {
                        return (SolveStatus::Stagnated, done + 1, now);
                    }
                    // ρ'/ρ of a true and a recursive residual would blow c up
                    self.first_direction(filter);
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

    /// Keeps the iterate if its true residual is the smallest so far.
    fn keep(&mut self, rounding: &mut Rounding, now: Squares) {
        if now.stop.is_finite() && rounding.best.is_none_or(|b| now.stop < b.stop) {
            rounding.best = Some(now);
            self.work.best.clone_from(&self.work.x);
        }
    }

    /// Whether the true residual has not halved for [`LOOKS`] looks.
    fn exhausted(&mut self, rounding: &mut Rounding, now: Squares) -> bool {
        self.keep(rounding, now);
        if rounding.halved.is_none_or(|s| now.stop <= 0.25 * s) {
            rounding.halved = Some(now.stop);
            rounding.looks = 0;
        }
        rounding.looks += 1;
        rounding.looks >= LOOKS
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

fn dot<T: Real>(sums: Sums, x: &[T], y: &[T]) -> f64 {
    match sums {
        Sums::Double => vector::dot_in::<f64, T>(x, y),
        Sums::OfVectors => vector::dot_in::<T, T>(x, y),
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
