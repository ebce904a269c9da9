//! A polynomial of the matrix.

use super::{BlockJacobi, Preconditioner};
use crate::{BlockFilter, ExplicitOperator, Filter, LinearOperator, LinsolveError, Real, vector};

/// Lanczos steps for the largest eigenvalue.
const LANCZOS: usize = 10;
/// Upper end of the interval over the estimate, which is from below.
const MARGIN: f64 = 1.05;
/// Ratio of the ends of the interval.
const RATIO: f64 = 30.0;

/// Chebyshev polynomial in `D⁻¹ A`, `D` the diagonal blocks: name `"chebyshev"`.
///
/// ```text
/// d = D⁻¹ r/θ;  x = d;  ρ = δ/θ
/// k − 1 times:  r ← r − A d;  ρ' = 1/(2θ/δ − ρ);  d ← ρ'ρ d + (2ρ'/δ) D⁻¹ r;  x += d;  ρ ← ρ'
/// θ, δ: centre and half width of [λ_max/30, 1.05 λ_max]                   [Saad2003, alg. 12.1]
/// ```
/// `λ_max` of `D⁻¹ S A S` comes from ten Lanczos steps at each update. The
/// polynomial is fixed between updates, hence a valid preconditioner for CG,
/// and needs no dot products.
#[derive(Debug, Clone)]
pub struct Chebyshev<T> {
    jacobi: BlockJacobi<T>,
    filter: BlockFilter,
    products: usize,
    largest: f64,
    residual: Vec<T>,
    direction: Vec<T>,
    image: Vec<T>,
}

impl<T: Real> Default for Chebyshev<T> {
    /// Three terms: two products with the matrix.
    fn default() -> Self {
        Self::new(3)
    }
}

impl<T: Real> Chebyshev<T> {
    /// With `terms ≥ 1` terms (`terms − 1` products with the matrix).
    pub fn new(terms: usize) -> Self {
        Self {
            jacobi: BlockJacobi::default(),
            filter: BlockFilter::new(),
            products: terms.saturating_sub(1),
            largest: 1.0,
            residual: Vec::new(),
            direction: Vec::new(),
            image: Vec::new(),
        }
    }

    /// Estimate of the largest eigenvalue of `D⁻¹ S A S` at the last update.
    pub fn largest_eigenvalue(&self) -> f64 {
        self.largest
    }

    /// Extreme eigenvalue of the Lanczos matrix that CG builds.
    fn estimate(&mut self, a: &dyn LinearOperator<T>) -> f64 {
        // fixed pseudo-random start: rich in every eigenvector
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        for r in &mut self.residual {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            *r = T::from_f64((state >> 11) as f64 / (1u64 << 52) as f64 - 1.0);
        }
        // in the energy norm of D the entries count alike: start from D^-1 r
        self.filter.project(&mut self.residual);
        let mut z = vec![T::ZERO; self.residual.len()];
        self.jacobi.times(&self.residual, &mut z);
        self.direction.copy_from_slice(&z);
        let mut rho = vector::dot(&self.residual, &z);
        let (mut diagonal, mut off) = (Vec::new(), Vec::new());
        let mut carry = 0.0;
        for _ in 0..LANCZOS {
            a.apply(&self.direction, &mut self.image);
            self.filter.project(&mut self.image);
            let curvature = vector::dot(&self.direction, &self.image);
            if !(curvature > 0.0 && rho > 0.0 && rho.is_finite()) {
                break;
            }
            let alpha = rho / curvature;
            diagonal.push(1.0 / alpha + carry);
            vector::axpy(T::from_f64(-alpha), &self.image, &mut self.residual);
            self.jacobi.times(&self.residual, &mut z);
            let next = vector::dot(&self.residual, &z);
            let beta = next / rho;
            off.push(beta.max(0.0).sqrt() / alpha);
            carry = beta / alpha;
            vector::xpay(&z, T::from_f64(beta), &mut self.direction);
            rho = next;
        }
        largest_eigenvalue(&diagonal, &off)
    }
}

impl<T: Real> Preconditioner<T> for Chebyshev<T> {
    fn name(&self) -> &str {
        "chebyshev"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        match filter.as_blocks() {
            Some(blocks) => self.filter.clone_from(blocks),
            None if filter.is_identity() => self.filter = BlockFilter::new(),
            None => {
                return Err(LinsolveError::FilterNotBlocks {
                    method: "chebyshev",
                });
            }
        }
        self.jacobi.update(a, filter)?;
        for v in [&mut self.residual, &mut self.direction, &mut self.image] {
            v.resize(a.dim(), T::ZERO);
        }
        let found = self.estimate(a);
        // the mean eigenvalue of D^-1 A is 1: nothing smaller can be the largest
        self.largest = if found.is_finite() {
            found.max(1.0)
        } else {
            1.0
        };
        Ok(())
    }

    fn apply(&mut self, a: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let (high, low) = (MARGIN * self.largest, self.largest / RATIO);
        let (theta, delta) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = theta / delta;
        let Self {
            jacobi,
            filter,
            residual,
            direction,
            image,
            ..
        } = self;
        residual.copy_from_slice(r);
        jacobi.times(residual, direction);
        let first = T::from_f64(1.0 / theta);
        for d in direction.iter_mut() {
            *d *= first;
        }
        z.copy_from_slice(direction);
        let mut rho = 1.0 / sigma;
        for _ in 0..self.products {
            a.apply(direction, image);
            filter.project(image);
            vector::axpy(-T::ONE, image, residual);
            jacobi.times(residual, image);
            let next = 1.0 / (2.0 * sigma - rho);
            let (keep, add) = (T::from_f64(next * rho), T::from_f64(2.0 * next / delta));
            for (d, &s) in direction.iter_mut().zip(image.iter()) {
                *d = keep * *d + add * s;
            }
            vector::axpy(T::ONE, direction, z);
            rho = next;
        }
    }

    fn heap_bytes(&self) -> usize {
        let vectors = [&self.residual, &self.direction, &self.image];
        self.jacobi.heap_bytes()
            + vectors.iter().map(|v| v.capacity()).sum::<usize>() * size_of::<T>()
    }
}

/// Largest eigenvalue of a symmetric tridiagonal matrix by bisection on the
/// signs of its pivots (Sturm); NaN for an empty one.
fn largest_eigenvalue(diagonal: &[f64], off: &[f64]) -> f64 {
    let n = diagonal.len();
    if n == 0 {
        return f64::NAN;
    }
    let side = |k: usize| if k + 1 < n { off[k] } else { 0.0 };
    let reach = |k: usize| side(k) + if k > 0 { off[k - 1] } else { 0.0 };
    let mut low = diagonal.iter().copied().fold(f64::INFINITY, f64::min);
    let mut high = (0..n).fold(0.0f64, |m, k| m.max(diagonal[k] + reach(k)));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let mut pivot = 1.0;
        let above = (0..n).any(|k| {
            let e = if k > 0 { off[k - 1] } else { 0.0 };
            pivot = diagonal[k] - middle - e * e / pivot;
            pivot >= 0.0
        });
        if above {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::largest_eigenvalue;

    /// Second differences have the known extreme eigenvalue 2 + 2 cos(π/(n+1)).
    #[test]
    fn bisection_finds_the_largest_eigenvalue() {
        for n in 1..12usize {
            let expected = 2.0 + 2.0 * (std::f64::consts::PI / (n as f64 + 1.0)).cos();
            let found = largest_eigenvalue(&vec![2.0; n], &vec![1.0; n]);
            assert!((found - expected).abs() < 1e-12, "{n}: {found}");
        }
    }
}
