//! What a loose linear solve leaves of each piece's momentum.

use selvedge_collision::ContactResponse;

use super::BackwardEuler;
use crate::pins::project;
use crate::{Ledger, Pins, ScenePlan, Scheme, Term};

/// Pieces of cloth: points that stencils join.
#[derive(Default)]
pub(super) struct Pieces {
    /// Piece of every point.
    of: Vec<u32>,
    pieces: Vec<Piece>,
}

#[derive(Clone, Copy, Default)]
struct Piece {
    /// Summed residual [N·s] and mass [kg].
    residual: [f64; 3],
    mass: f64,
    /// Whether a body, other cloth or a pin holds any of its points.
    held: bool,
    /// `d·b` and `d·A d` [J].
    gain: f64,
    curvature: f64,
    /// How far the piece goes along `d` [1].
    factor: f64,
}

impl Pieces {
    /// Pieces of as many points as there are masses.
    fn new(points: usize, terms: &[Term]) -> Self {
        let mut root: Vec<u32> = (0..points as u32).collect();
        for term in terms {
            let batch = term.batch.as_ref();
            for e in 0..batch.len() {
                let stencil = batch.nodes(e).iter().zip(batch.node_dims());
                let mut points = stencil.filter(|(_, dim)| **dim == 3).map(|(p, _)| *p);
                let Some(first) = points.next() else { continue };
                for p in points {
                    let (a, b) = (find(&mut root, first), find(&mut root, p));
                    // the smaller number leads, whatever the order of the stencils
                    root[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let mut count = 0;
        let mut of = vec![0; points];
        for p in 0..points {
            let lead = find(&mut root, p as u32) as usize;
            if lead == p {
                of[p] = count;
                count += 1;
            } else {
                of[p] = of[lead];
            }
        }
        Self {
            of,
            pieces: vec![Piece::default(); count as usize],
        }
    }

    /// Which pieces something holds; whether any is free.
    fn hold(&mut self, contacts: &ContactResponse, pins: Option<&Pins>) -> bool {
        self.pieces.fill(Piece::default());
        let touching = contacts.nodes.as_flattened().iter();
        let pinned = pins.map_or(&[][..], |p| &p.points);
        for &p in touching.chain(&contacts.body_nodes).chain(pinned) {
            self.pieces[self.of[p as usize] as usize].held = true;
        }
        self.pieces.iter().any(|piece| !piece.held)
    }

    /// `d = Σ b / Σ m` of its piece for every point that gravity moves, zero for
    /// scalars: the velocity that would take up the summed residual of a free
    /// piece.
    fn shift(&mut self, b: &[f64], masses: &[f64], weightless: &[u32], d: &mut [f64]) {
        let (b, _) = b.as_chunks::<3>();
        for ((&piece, b), &m) in self.of.iter().zip(b).zip(masses) {
            let piece = &mut self.pieces[piece as usize];
            for i in 0..3 {
                piece.residual[i] += b[i];
            }
            piece.mass += m;
        }
        let (points, scalars) = d.split_at_mut(3 * self.of.len());
        scalars.fill(0.0);
        let (points, _) = points.as_chunks_mut::<3>();
        for (d, &piece) in points.iter_mut().zip(&self.of) {
            let piece = &self.pieces[piece as usize];
            *d = match piece.mass > 0.0 {
                true => piece.residual.map(|r| r / piece.mass),
                false => [0.0; 3],
            };
        }
        for &p in weightless {
            points[p as usize] = [0.0; 3];
        }
    }

    /// Adds `d·b` to every piece's gain.
    fn add_gain(&mut self, b: &[f64], d: &[f64]) {
        let (b, d) = (b.as_chunks::<3>().0, d.as_chunks::<3>().0);
        for ((&piece, b), d) in self.of.iter().zip(b).zip(d) {
            self.pieces[piece as usize].gain += (0..3).map(|i| b[i] * d[i]).sum::<f64>();
        }
    }

    /// With `b − A d` in `b`: how far every piece goes along `d`. A free one as far
    /// as the energy of the linear system falls, those that are held together, or
    /// not at all.
    fn set_factors(&mut self, b: &[f64], d: &[f64], scheme: Scheme) {
        for piece in &mut self.pieces {
            piece.curvature = piece.gain;
        }
        let (b, d) = (b.as_chunks::<3>().0, d.as_chunks::<3>().0);
        for ((&piece, b), d) in self.of.iter().zip(b).zip(d) {
            self.pieces[piece as usize].curvature -= (0..3).map(|i| b[i] * d[i]).sum::<f64>();
        }
        let factor = |gain: f64, curvature: f64| match gain / curvature {
            factor if curvature > 0.0 && factor.is_finite() => factor,
            _ => 0.0,
        };
        let mut held = 0.0;
        if scheme == Scheme::Linearised {
            let of = self.pieces.iter().filter(|piece| piece.held);
            let sums = of.fold((0.0, 0.0), |s, p| (s.0 + p.gain, s.1 + p.curvature));
            held = factor(sums.0, sums.1);
        }
        for piece in &mut self.pieces {
            piece.factor = match piece.held {
                true => held,
                false => factor(piece.gain, piece.curvature),
            };
        }
    }

    pub(super) fn heap_bytes(&self) -> usize {
        size_of_val(self.of.as_slice()) + size_of_val(self.pieces.as_slice())
    }
}

fn find(root: &mut [u32], mut p: u32) -> u32 {
    while root[p as usize] != p {
        root[p as usize] = root[root[p as usize] as usize];
        p = root[p as usize];
    }
    p
}

impl BackwardEuler {
    /// Goes on from velocities whose residual is in `b` along the uniform motions
    /// `d` that the summed residuals of the pieces ask for:
    ///
    /// ```text
    /// d = Σ b / Σ m,   v += (d·b / d·A d) d     for each piece of cloth
    /// ```
    /// Forces within cloth do no work in such motions, so that a piece that
    /// touches nothing gets its impulse exactly, however loosely the system was
    /// solved, for one product a step. Pieces that something holds are left as they
    /// are by Newton's method, whose last residual the motion would not be tested
    /// against; a linearised step goes as far with all of them as the energy of its
    /// linear system falls.
    pub(super) fn share_momentum(&mut self, plan: &mut ScenePlan, ledger: &mut Ledger) {
        let inertia = &plan.inertia;
        let pieces = &mut self.pieces;
        if pieces.of.len() != inertia.masses.len() {
            *pieces = Pieces::new(inertia.masses.len(), &plan.terms);
        }
        let any_free = pieces.hold(&self.contacts.response, plan.pins.as_ref());
        let scheme = self.settings.scheme;
        if scheme == Scheme::Newton && !any_free {
            return;
        }
        let (b, v, d) = (&mut self.b, &mut self.v, &mut self.b_try);
        ledger.time("solve", || {
            pieces.shift(b, &inertia.masses, &inertia.weightless, d);
            project(&plan.pins, d);
            pieces.add_gain(b, d);
            plan.system.subtract_product(d, b);
            pieces.set_factors(b, d, scheme);
            let (v, d) = (v.as_chunks_mut::<3>().0, d.as_chunks::<3>().0);
            for ((v, d), &piece) in v.iter_mut().zip(d).zip(&pieces.of) {
                let factor = pieces.pieces[piece as usize].factor;
                for i in 0..3 {
                    v[i] += factor * d[i];
                }
            }
        });
    }
}
