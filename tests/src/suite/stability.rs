//! Stiffness of flat strips: equilibrium in their plane, stability out of it,
//! and the energy of small prescribed deflections.

use std::sync::Arc;

use selvedge_energy::{Curvature, DofLayout, EnergyBatch, EvalPoint};
use selvedge_linsolve::{
    BlockFilter, Bsr, Direct, LinearOperator, LinearSolver, LinsolveError, Pattern,
};
use selvedge_shell_model::sheet::Sheet;
use selvedge_shell_model::{BendingOptions, DampingKind, bending_term, membrane_term};

use crate::{plain_fabric, straight_rows};

/// A flat strip in the plane z = 0 with its material coordinates as x and y,
/// and its energies.
pub struct Flat {
    points: usize,
    terms: Vec<Box<dyn EnergyBatch>>,
    pattern: Arc<Pattern>,
}

/// Whether rows of points are kept straight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rows {
    /// Free to curl across the strip.
    Free,
    /// On the line between their ends, by springs of so many N/m.
    Straight(f64),
}

impl Flat {
    /// A strip of one fabric with Poisson's ratio zero in its plane, of
    /// modulus `stiffness` [N/m] and `rigidity` [N·m].
    pub fn new(sheet: &Sheet, stiffness: f64, rigidity: f64, rows: Rows) -> Self {
        let fabric = [plain_fabric(stiffness, rigidity, 1.0)];
        let membrane = membrane_term(&sheet.mesh, &fabric, DampingKind::Off).expect("membrane");
        let options = BendingOptions {
            damping: DampingKind::Off,
            ..BendingOptions::default()
        };
        let bending = bending_term(&sheet.mesh, &fabric, &options).expect("bending");
        let mut terms = vec![membrane, bending];
        if let Rows::Straight(springs) = rows {
            terms.push(straight_rows(sheet, springs));
        }
        let groups = terms.iter().flat_map(|t| (0..t.len()).map(|e| t.nodes(e)));
        let pattern = Arc::new(Pattern::from_groups(sheet.flat.len(), groups));
        Self {
            points: sheet.flat.len(),
            terms,
            pattern,
        }
    }

    /// Gradient [N] and exact second derivative [N/m] of the elastic energy.
    pub fn derivatives(&self, q: &[f64]) -> (Vec<f64>, Bsr<f64>) {
        let at = EvalPoint {
            layout: DofLayout::points(self.points),
            q,
            q_start: q,
            dt: 1.0,
        };
        let mut gradient = vec![0.0; q.len()];
        let mut matrix = Bsr::<f64>::zeros(Arc::clone(&self.pattern));
        for term in &self.terms {
            let m = term.local_dim();
            let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
            for e in 0..term.len() {
                term.hessians(&at, Curvature::Exact, e..e + 1, &mut g, &mut h);
                let nodes = term.nodes(e);
                for (a, &i) in nodes.iter().enumerate() {
                    for r in 0..3 {
                        gradient[3 * i as usize + r] += g[3 * a + r];
                    }
                    for (b, &j) in nodes.iter().enumerate() {
                        let block = std::array::from_fn(|r| {
                            std::array::from_fn(|c| h[m * (3 * a + r) + 3 * b + c])
                        });
                        // The pattern holds one triangle of a symmetric matrix.
                        if let Some(slot) = self.pattern.slot(i, j) {
                            matrix.add_block(slot as usize, &block, 1.0);
                        }
                    }
                }
            }
        }
        (gradient, matrix)
    }

    /// Brings `q` to equilibrium with dead forces [N] in its own plane.
    ///
    /// # Panics
    /// When Newton's method does not converge.
    pub fn settle(&self, q: &mut [f64], forces: &[f64], held: &[u32]) {
        let mut filter = BlockFilter::new();
        for p in 0..self.points as u32 {
            filter.constrain(p, [0.0, 0.0, 1.0], 0.0).expect("a plane");
        }
        hold(&mut filter, held);
        let mut solver = Direct::default();
        for _ in 0..20 {
            let (gradient, matrix) = self.derivatives(q);
            let b: Vec<f64> = forces.iter().zip(&gradient).map(|(f, g)| f - g).collect();
            let mut x = vec![0.0; q.len()];
            solver
                .solve(&matrix, &b, &filter, &mut x)
                .expect("stable in its plane");
            let moved = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (q, x) in q.iter_mut().zip(&x) {
                *q += x;
            }
            if moved < 1e-13 {
                return;
            }
        }
        panic!("no equilibrium in the plane of the strip");
    }

    /// Whether the equilibrium `q` is stable with respect to all motions of
    /// the points not held: whether the second derivative is positive definite
    /// there, by the pivots of its Cholesky factor.
    ///
    /// # Panics
    /// When the factorisation fails for another reason.
    pub fn is_stable(&self, q: &[f64], held: &[u32]) -> bool {
        definite(&self.derivatives(q).1, held)
    }

    /// Whether every motion of the points not held about the equilibrium `q`
    /// is faster than `ω` with `ω²` given [1/s²]: whether `K − ω² M` is
    /// positive definite. `masses` are those of the points [kg].
    ///
    /// # Panics
    /// As [`is_stable`](Self::is_stable).
    pub fn is_faster(&self, q: &[f64], held: &[u32], masses: &[f64], squared: f64) -> bool {
        let (_, mut matrix) = self.derivatives(q);
        for (i, m) in masses.iter().enumerate() {
            matrix.add_diagonal(i, -squared * m);
        }
        definite(&matrix, held)
    }

    /// Energy [J] and displacements [m] of the least deflection out of the
    /// plane, in the linear theory, with `held` points deflected by `w` [m].
    ///
    /// # Panics
    /// When the linear system has no solution.
    pub fn deflected(&self, flat: &[f64], held: &[(u32, f64)]) -> (f64, Vec<f64>) {
        let (_, matrix) = self.derivatives(flat);
        let mut filter = BlockFilter::new();
        let (mut x, b) = (vec![0.0; flat.len()], vec![0.0; flat.len()]);
        for &(p, w) in held {
            filter.fix(p, [0.0; 3]).expect("a point");
            x[3 * p as usize + 2] = w;
        }
        Direct::default()
            .solve(&matrix, &b, &filter, &mut x)
            .expect("deflection");
        let mut kx = vec![0.0; x.len()];
        matrix.apply(&x, &mut kx);
        let energy = 0.5 * x.iter().zip(&kx).map(|(x, k)| x * k).sum::<f64>();
        (energy, x)
    }
}

fn definite(matrix: &Bsr<f64>, held: &[u32]) -> bool {
    let mut filter = BlockFilter::new();
    hold(&mut filter, held);
    let zero = vec![0.0; matrix.dim()];
    match Direct::default().solve(matrix, &zero, &filter, &mut zero.clone()) {
        Ok(_) => true,
        Err(LinsolveError::Indefinite { .. }) => false,
        Err(e) => panic!("{e}"),
    }
}

fn hold(filter: &mut BlockFilter, held: &[u32]) {
    for &p in held {
        filter.fix(p, [0.0; 3]).expect("a point");
    }
}

/// The load at which `stable` turns false, to a relative 1e-7, from a guess.
///
/// # Panics
/// When it is not within a factor of two of the guess.
pub fn onset(guess: f64, mut stable: impl FnMut(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.9 * guess, 1.1 * guess);
    while !stable(low) {
        high = low;
        low *= 0.9;
        assert!(low > 0.5 * guess, "unstable at half the expected load");
    }
    while stable(high) {
        low = high;
        high *= 1.1;
        assert!(high < 2.0 * guess, "stable at twice the expected load");
    }
    while high - low > 1e-7 * guess {
        let middle = 0.5 * (low + high);
        if stable(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}
