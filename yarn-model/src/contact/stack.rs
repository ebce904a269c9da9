use crate::vec3::V;

/// How the compression of a stack of yarns is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StackRule {
    /// Non-negative least squares.
    #[default]
    Exact,
    /// `(AᵀA)⁻¹ max(0, −Aᵀb)`, the closed form of [Cirio2017, eq. 4]. Equal to
    /// the least squares for two yarns, and wherever `−Aᵀb ≥ 0`.
    ClosedForm,
}

/// Largest number of interfaces whose active sets are enumerated.
const ENUMERATED: usize = 3;

/// Compression at every interface of a stack of yarns [N].
///
/// Yarns lie front to back; `normals[i]` is the unit normal of the interface
/// from yarn `i` to `i + 1`, `forces[i]` the force [N] on yarn `i` from along
/// itself, at the node. The compressions balance the forces as well as
/// pushing alone can [Cirio2017, eq. 3, 4]:
///
/// ```text
/// u_0 = n_0,  u_{n−1} = n_{n−2},  u_i = (n_{i−1} + n_i)/|n_{i−1} + n_i|
/// f_i = u_i·(F_i + λ_{i−1} n_{i−1} − λ_i n_i) = (A λ + b)_i
/// λ   = argmin_{λ ≥ 0} |A λ + b|²
/// ```
///
/// For two yarns that is `λ = max(0, n·(F_0 − F_1)/2)`. Up to four yarns all
/// active sets are tried, more are solved by active sets that grow and shrink
/// [LawsonHanson1974]. `AᵀA` is tridiagonal.
///
/// Degenerate cases: where neighbouring normals are opposite, `u_i = 0`; an
/// interface without any effect gets no compression. The closed form is cut off
/// at zero, below which it can fall only for normals that differ by more than a
/// right angle.
///
/// # Panics
/// When there are not as many normals and compressions as forces less one.
pub fn stack_compression(
    normals: &[[f64; 3]],
    forces: &[[f64; 3]],
    rule: StackRule,
    lambda: &mut [f64],
) {
    let m = lambda.len();
    assert!(
        normals.len() == m && forces.len() == m + 1,
        "one interface between every two yarns"
    );
    if m == 0 {
        return;
    }
    if m == 1 {
        lambda[0] = pair_compression(normals[0].into(), forces[0].into(), forces[1].into());
        return;
    }
    // Sums over the two rows of every column of A.
    let mut stack = [0.0; 3 * ENUMERATED];
    let mut heap;
    let buffer = if m <= ENUMERATED {
        &mut stack[..3 * m]
    } else {
        heap = vec![0.0; 3 * m];
        &mut heap[..]
    };
    let (diagonal, rest) = buffer.split_at_mut(m);
    let (beside, target) = rest.split_at_mut(m);
    let normal = |i: usize| V::from(normals[i]);
    let direction = |i: usize| match i {
        0 => normal(0),
        i if i == m => normal(m - 1),
        i => {
            let sum = normal(i - 1) + normal(i);
            let length = sum.norm();
            sum * if length > 1e-9 { 1.0 / length } else { 0.0 }
        }
    };
    let mut upper = direction(0);
    for i in 0..m {
        let lower = direction(i + 1);
        let (top, bottom) = (-upper.dot(&normal(i)), lower.dot(&normal(i)));
        diagonal[i] = top * top + bottom * bottom;
        if i + 1 < m {
            beside[i] = -bottom * lower.dot(&normal(i + 1));
        }
        let [above, below] = [forces[i], forces[i + 1]].map(V::from);
        target[i] = -(top * upper.dot(&above) + bottom * lower.dot(&below));
        upper = lower;
    }
    let system = Tridiagonal {
        diagonal,
        beside,
        target,
    };
    match rule {
        StackRule::ClosedForm => {
            for t in system.target.iter_mut() {
                *t = t.max(0.0);
            }
            system.solve(lambda, |_| true);
            for l in lambda.iter_mut() {
                *l = l.max(0.0);
            }
        }
        StackRule::Exact if m <= ENUMERATED => system.enumerate(lambda),
        StackRule::Exact => system.active_set(lambda),
    }
}

/// Compression of two yarns, `max(0, n·(F_0 − F_1)/2)` [N].
#[inline(always)]
pub(super) fn pair_compression(n: V, front: V, back: V) -> f64 {
    (0.5 * n.dot(&(front - back))).max(0.0)
}

/// `AᵀA λ = −Aᵀb`
struct Tridiagonal<'a> {
    diagonal: &'a [f64],
    beside: &'a [f64],
    target: &'a mut [f64],
}

impl Tridiagonal<'_> {
    /// Solves for the unknowns that are free, the others are zero.
    fn solve(&self, x: &mut [f64], free: impl Fn(usize) -> bool) {
        // Elimination from the first unknown on. A pivot without weight, and
        // one that is held, decouples its unknown.
        let m = x.len();
        let mut pivot = 0.0;
        let mut pivots = [0.0; 2 * ENUMERATED];
        let mut many = Vec::new();
        let pivots = if m <= pivots.len() {
            &mut pivots[..m]
        } else {
            many.resize(m, 0.0);
            &mut many[..]
        };
        for i in 0..m {
            let factor = match i > 0 && pivot > 0.0 {
                true => self.beside[i - 1] / pivot,
                false => 0.0,
            };
            let eliminated = match i > 0 {
                true => self.diagonal[i] - factor * self.beside[i - 1],
                false => self.diagonal[i],
            };
            let before = if i > 0 { x[i - 1] } else { 0.0 };
            pivot = match free(i) && eliminated > 1e-12 {
                true => eliminated,
                false => 0.0,
            };
            pivots[i] = pivot;
            x[i] = match pivot > 0.0 {
                true => self.target[i] - factor * before,
                false => 0.0,
            };
        }
        let mut after = 0.0;
        for i in (0..m).rev() {
            if pivots[i] > 0.0 {
                x[i] = (x[i] - self.beside[i] * after) / pivots[i];
            }
            after = x[i];
        }
    }

    /// The best of all sets whose unconstrained solution is not negative. The
    /// minimum is one of them, on its support.
    fn enumerate(&self, lambda: &mut [f64]) {
        let m = lambda.len();
        let mut best = 0.0;
        let mut trial = [0.0; ENUMERATED];
        lambda.fill(0.0);
        for set in 1_u32..1 << m {
            let trial = &mut trial[..m];
            self.solve(trial, |i| set >> i & 1 == 1);
            if trial.iter().any(|x| *x < 0.0) {
                continue;
            }
            // What the residual falls by, `target · λ / 2` at a solution.
            let gain = trial.iter().zip(&*self.target).map(|(x, t)| x * t).sum();
            if gain > best {
                best = gain;
                lambda.copy_from_slice(trial);
            }
        }
    }

    /// Active sets after Lawson and Hanson.
    fn active_set(&self, lambda: &mut [f64]) {
        let m = lambda.len();
        let mut free = vec![false; m];
        let mut trial = vec![0.0; m];
        let largest = self.target.iter().fold(0.0_f64, |a, t| a.max(t.abs()));
        lambda.fill(0.0);
        for _ in 0..3 * m {
            let slope = |i: usize| {
                let mut w = self.target[i] - self.diagonal[i] * lambda[i];
                if i > 0 {
                    w -= self.beside[i - 1] * lambda[i - 1];
                }
                if i + 1 < m {
                    w -= self.beside[i] * lambda[i + 1];
                }
                w
            };
            let steepest = (0..m)
                .filter(|i| !free[*i])
                .map(|i| (slope(i), i))
                .fold((1e-14 * largest, m), |a, b| if b.0 > a.0 { b } else { a });
            if steepest.1 == m {
                return;
            }
            free[steepest.1] = true;
            loop {
                self.solve(&mut trial, |i| free[i]);
                // How far the old solution can go to the new one.
                let (mut reach, mut first) = (1.0, m);
                for i in (0..m).filter(|i| free[*i] && trial[*i] <= 0.0) {
                    let share = match lambda[i] > 0.0 {
                        true => lambda[i] / (lambda[i] - trial[i]),
                        false => 0.0,
                    };
                    if share < reach {
                        (reach, first) = (share, i);
                    }
                }
                if first == m {
                    lambda.copy_from_slice(&trial);
                    break;
                }
                for i in 0..m {
                    lambda[i] += reach * (trial[i] - lambda[i]);
                    if free[i] && (i == first || lambda[i] <= 0.0) {
                        (lambda[i], free[i]) = (0.0, false);
                    }
                }
            }
        }
    }
}
