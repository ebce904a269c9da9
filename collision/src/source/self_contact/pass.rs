use selvedge_energy::EvalPoint;

use super::bounds::{Bounds, Moves};
use super::memory::{Anchor, Memory, Record};
use super::near::Visit;
use super::overlap::Overlap;
use crate::friction::{AnchorState, anchor_damping, from_frame, to_frame};
use crate::narrow::PairKind;
use crate::source::side::{Meeting, Pair, Side, Touch};
use crate::vec3::{Vec3, add, add_outer, axpy, combine, point, scale, sub, tangential};
use crate::{
    Candidates, CollisionMesh, ContactPotential, ContactResponse, Friction, FrictionAnchored,
    Repulsion, pair_friction,
};

/// What evaluation reads.
pub(super) struct Pairs {
    pub mesh: CollisionMesh,
    pub potential: Box<dyn ContactPotential>,
    pub friction: Option<Friction>,
    /// Coefficients of the points; empty where all are that of the friction.
    pub coefficients: Vec<f64>,
    pub inverse_masses: Vec<f64>,
    pub candidates: Candidates,
    pub bounds: Bounds,
    pub memory: Memory,
    pub overlap: Overlap,
}

impl Pairs {
    /// Coefficient of a pair; `common` where all points have the same. The
    /// weights of a pair's sides differ in sign and sum to one each.
    #[inline]
    pub(super) fn coefficient(&self, common: f64, nodes: &[u32; 4], weights: &[f64; 4]) -> f64 {
        if self.coefficients.is_empty() {
            return common;
        }
        let (mut one, mut other) = (0.0, 0.0);
        for (n, w) in nodes.iter().zip(weights) {
            let part = w * self.coefficients[*n as usize];
            if *w > 0.0 {
                one += part;
            } else {
                other -= part;
            }
        }
        pair_friction(one, other)
    }
}

/// Friction of a pair with everything but the displacement frozen.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaggedContact {
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    pub normal: [f64; 3],
    pub force: f64,
}

/// Results of one chunk of candidates.
#[derive(Clone, Debug, Default)]
pub(super) struct Task {
    pub response: ContactResponse,
    pub memory: Memory,
    pub lagged: Vec<LaggedContact>,
    pub energy: f64,
    pub deepest: f64,
    pub active: usize,
    /// Candidates that may be in contact.
    pub near: Vec<u32>,
    /// Contacts on a boundary: their nodes in order, and their place.
    boundary: Vec<([u32; 3], u32)>,
}

/// One walk over candidates at one evaluation point.
pub(super) struct Pass<'a> {
    pairs: &'a Pairs,
    at: &'a EvalPoint<'a>,
    curvature: bool,
    anchored: Option<FrictionAnchored>,
    thickness: f64,
    /// Ways from the start, where the distances there are known.
    moves: Option<&'a Moves>,
}

impl<'a> Pass<'a> {
    pub(super) fn new(pairs: &'a Pairs, at: &'a EvalPoint<'a>, curvature: bool) -> Self {
        let anchored = match pairs.friction {
            Some(Friction::Anchored(f)) => Some(f),
            _ => None,
        };
        Self {
            pairs,
            at,
            curvature,
            anchored,
            thickness: pairs.potential.thickness(),
            moves: None,
        }
    }

    pub(super) fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Passes over what `moves` leave apart.
    pub(super) fn with_moves(self, moves: Option<&'a Moves>) -> Self {
        Self { moves, ..self }
    }

    /// Calls `visit(i, kind, pair, side, anchor)` for some candidates, in order,
    /// with what they remember.
    pub(super) fn each(
        &self,
        candidates: Visit<'_>,
        mut visit: impl FnMut(usize, PairKind, [u32; 2], Option<Side>, Option<Anchor>),
    ) {
        let c = &self.pairs.candidates;
        let Memory { records, anchors } = &self.pairs.memory;
        let split = c.vertex_triangle.len();
        let get = |i: usize| {
            if i < split {
                (PairKind::VertexTriangle, c.vertex_triangle[i])
            } else {
                (PairKind::EdgeEdge, c.edge_edge[i - split])
            }
        };
        let mut next = None;
        for i in candidates {
            let key = get(i);
            let mut r = next.unwrap_or_else(|| records.partition_point(|r| r.key() < key));
            while r < records.len() && records[r].key() < key {
                r += 1;
            }
            let known = r < records.len() && records[r].key() == key;
            let side = known.then(|| records[r].side());
            let anchor = if known { anchors.get(r).copied() } else { None };
            visit(i, key.0, key.1, side, anchor);
            next = Some(r);
        }
    }

    #[inline]
    pub(super) fn nodes(&self, kind: PairKind, pair: [u32; 2]) -> [u32; 4] {
        match kind {
            PairKind::VertexTriangle => self.pairs.mesh.vertex_triangle_nodes(pair),
            PairKind::EdgeEdge => self.pairs.mesh.edge_edge_nodes(pair),
        }
    }

    /// Whether a pair that remembers nothing cannot have come into contact.
    #[inline]
    fn stays_apart(&self, i: usize, kind: PairKind, pair: [u32; 2], side: Option<Side>) -> bool {
        side.is_none() && self.leaves(i, kind, pair, 0.0)
    }

    /// Whether a pair stays farther apart than the thickness and `room` [m].
    #[inline]
    fn leaves(&self, i: usize, kind: PairKind, pair: [u32; 2], room: f32) -> bool {
        self.moves.is_some_and(|moves| {
            let nodes = self.nodes(kind, pair);
            let far = self.thickness as f32 + room;
            self.pairs.bounds.apart(i, kind, &nodes, moves, far)
        })
    }

    /// Candidates that may come into contact when pairs come closer by `room`
    /// [m], and those that remember something.
    pub(super) fn list_near(&self, candidates: Visit<'_>, room: f32, task: &mut Task) {
        task.near.clear();
        self.each(candidates, |i, kind, pair, side, _| {
            if side.is_some() || !self.leaves(i, kind, pair, room) {
                task.near.push(i as u32);
            }
        });
    }

    #[inline]
    pub(super) fn area(&self, kind: PairKind, pair: [u32; 2]) -> f64 {
        let mesh = &self.pairs.mesh;
        match kind {
            _ if !self.pairs.potential.uses_area() => 0.0,
            PairKind::VertexTriangle => mesh.point_area(pair[0]),
            PairKind::EdgeEdge => 0.5 * (mesh.edge_area(pair[0]) + mesh.edge_area(pair[1])),
        }
    }

    /// Distance that a pair keeps [m].
    #[inline]
    fn kept(&self, kind: PairKind, pair: [u32; 2]) -> f64 {
        self.thickness - self.pairs.mesh.spare(kind, pair)
    }

    /// Repulsion at a gap, less what an initial overlap is still allowed.
    #[inline]
    fn repulsion(&self, kind: PairKind, pair: [u32; 2], gap: f64) -> Repulsion {
        let allowed = self.pairs.overlap.allowed(&self.nodes(kind, pair));
        let spare = self.pairs.mesh.spare(kind, pair);
        let area = self.area(kind, pair);
        self.pairs.potential.evaluate(gap + allowed + spare, area)
    }

    #[inline]
    pub(super) fn meet(&self, kind: PairKind, pair: [u32; 2], side: Option<Side>) -> Meeting {
        let nodes = self.nodes(kind, pair);
        let kept = self.kept(kind, pair);
        let start = || nodes.map(|n| point(self.at.q_start, n));
        let fallback = || {
            self.pairs
                .mesh
                .separating_direction(nodes, kind.first_feature(), self.at.q_start)
        };
        let x = nodes.map(|n| point(self.at.q, n));
        let pair = Pair {
            kind,
            x,
            start: &start,
            fallback: &fallback,
            side,
        };
        pair.meet(kept)
    }

    /// Friction with the coefficient of a pair.
    #[inline]
    fn friction_of(
        &self,
        common: &FrictionAnchored,
        kind: PairKind,
        pair: [u32; 2],
        touch: &Touch,
    ) -> FrictionAnchored {
        let nodes = self.nodes(kind, pair);
        FrictionAnchored {
            coefficient: self
                .pairs
                .coefficient(common.coefficient, &nodes, &touch.weights),
            ..*common
        }
    }

    /// State of the anchor of a touching pair.
    fn anchor_state(
        &self,
        friction: &FrictionAnchored,
        kind: PairKind,
        pair: [u32; 2],
        touch: &Touch,
        anchor: Option<Anchor>,
        normal_force: f64,
    ) -> AnchorState {
        let nodes = self.nodes(kind, pair);
        let x = nodes.map(|n| point(self.at.q, n));
        let start = nodes.map(|n| point(self.at.q_start, n));
        let moved: [Vec3; 4] = std::array::from_fn(|i| sub(x[i], start[i]));
        let slid = tangential(combine(&touch.weights, &moved), touch.normal);
        let displacement = match anchor {
            // A new contact is anchored where the step began.
            None => slid,
            Some(a) => {
                let from = tangential(combine(&a.weights(kind), &x), touch.normal);
                match kind.tangent(&x, touch.normal) {
                    Some(t) => axpy(from, 1.0, from_frame(a.offset, t, touch.normal)),
                    None => from,
                }
            }
        };
        let stiffness =
            friction.stiffness_ratio * self.pairs.potential.stiffness(self.area(kind, pair));
        let inverse_mass = (0..4)
            .map(|i| touch.weights[i].powi(2) * self.pairs.inverse_masses[nodes[i] as usize])
            .sum();
        AnchorState {
            displacement,
            velocity: scale(1.0 / self.at.dt, slid),
            normal: touch.normal,
            normal_force,
            stiffness,
            damping: anchor_damping(friction.damping_ratio, stiffness, inverse_mass),
        }
    }

    pub(super) fn evaluate(&self, candidates: Visit<'_>, task: &mut Task) {
        task.response.clear();
        task.boundary.clear();
        (task.energy, task.deepest, task.active) = (0.0, 0.0, 0);
        self.each(candidates, |i, kind, pair, side, anchor| {
            if self.stays_apart(i, kind, pair, side) {
                return;
            }
            let Meeting::Touching(touch) = self.meet(kind, pair, side) else {
                return;
            };
            let repulsion = self.repulsion(kind, pair, touch.gap);
            let mut force = scale(repulsion.force, touch.normal);
            let mut k = [[0.0; 3]; 3];
            add_outer(&mut k, repulsion.curvature, touch.normal);
            task.energy += repulsion.energy;
            if let Some(f) = &self.anchored {
                let f = self.friction_of(f, kind, pair, &touch);
                let state = self.anchor_state(&f, kind, pair, &touch, anchor, repulsion.force);
                let answer = f.respond(&state, self.at.dt);
                force = axpy(force, 1.0, answer.force);
                answer.add_curvature(&state, self.at.dt, &mut k);
                task.energy += answer.energy;
            }
            let nodes = self.nodes(kind, pair);
            if let Some(key) = boundary_key(&nodes, &touch.weights) {
                task.boundary.push((key, task.response.nodes.len() as u32));
            }
            task.response.nodes.push(nodes);
            task.response.weights.push(touch.weights);
            task.response.force.push(force);
            if self.curvature {
                task.response.curvature.push(k);
            }
            let depth = self.kept(kind, pair) - touch.gap;
            task.deepest = task.deepest.max(depth);
            task.active += 1;
        });
        merge(&mut task.response, &mut task.boundary);
    }

    pub(super) fn remember(&self, candidates: Visit<'_>, task: &mut Task) {
        let memory = &mut task.memory;
        memory.clear();
        self.each(candidates, |i, kind, pair, side, anchor| {
            if self.stays_apart(i, kind, pair, side) {
                return;
            }
            let touch = match self.meet(kind, pair, side) {
                Meeting::Apart => return,
                Meeting::Behind => {
                    if let Some(s) = side {
                        let normal = s.normal.map(|c| c as f32);
                        memory.records.push(Record {
                            pair,
                            normal,
                            kind,
                            behind: true,
                        });
                        if self.anchored.is_some() {
                            memory.anchors.push(anchor.unwrap_or_default());
                        }
                    }
                    return;
                }
                Meeting::Touching(t) => t,
            };
            let normal = touch.normal.map(|c| c as f32);
            memory.records.push(Record {
                pair,
                normal,
                kind,
                behind: touch.gap < 0.0,
            });
            let Some(f) = &self.anchored else { return };
            let repulsion = self.repulsion(kind, pair, touch.gap);
            let f = self.friction_of(f, kind, pair, &touch);
            let state = self.anchor_state(&f, kind, pair, &touch, anchor, repulsion.force);
            let answer = f.respond(&state, self.at.dt);
            memory.anchors.push(match anchor {
                Some(a) if !answer.slipping => a,
                _ => {
                    let x = self.nodes(kind, pair).map(|n| point(self.at.q, n));
                    let offset = kind.tangent(&x, touch.normal);
                    let offset = offset.map(|t| to_frame(answer.displacement, t, touch.normal));
                    Anchor::at(kind, touch.weights, offset.unwrap_or_default())
                }
            });
        });
    }

    /// Normal forces, for lagged friction.
    pub(super) fn lag(&self, candidates: Visit<'_>, task: &mut Task) {
        task.lagged.clear();
        self.each(candidates, |_, kind, pair, side, _| {
            let Meeting::Touching(t) = self.meet(kind, pair, side) else {
                return;
            };
            let force = self.repulsion(kind, pair, t.gap).force;
            let nodes = self.nodes(kind, pair);
            let (weights, normal) = (t.weights, t.normal);
            task.lagged.push(LaggedContact {
                nodes,
                weights,
                normal,
                force,
            });
        });
    }
}

/// What tells the closest features of a contact with at most three nodes: the
/// node that is alone on its side, then the others in order.
fn boundary_key(nodes: &[u32; 4], weights: &[f64; 4]) -> Option<[u32; 3]> {
    let mut key = [u32::MAX; 3];
    let mut signs = [0.0; 3];
    let mut count = 0;
    for i in 0..4 {
        if weights[i] != 0.0 {
            *key.get_mut(count)? = nodes[i];
            signs[count] = weights[i].signum();
            count += 1;
        }
    }
    if count < 3 {
        key.sort_unstable();
        return Some(key);
    }
    let majority = signs[0] + signs[1] + signs[2];
    let alone = signs.iter().position(|s| s * majority < 0.0)?;
    key.swap(0, alone);
    key[1..].sort_unstable();
    Some(key)
}

/// Adds up contacts between the same boundary features: six triangles around
/// a vertex give one contact of six times the force. Where two meshes lie
/// vertex on vertex, this saves most of the memory and of the matrix.
fn merge(response: &mut ContactResponse, boundary: &mut [([u32; 3], u32)]) {
    boundary.sort_unstable();
    let weight = |r: &ContactResponse, c: usize, node: u32| -> f64 {
        (0..4)
            .filter(|i| r.nodes[c][*i] == node)
            .map(|i| r.weights[c][i])
            .sum()
    };
    let mut merged = false;
    for run in boundary.chunk_by(|a, b| a.0 == b.0) {
        let into = run[0].1 as usize;
        for &(key, from) in &run[1..] {
            let from = from as usize;
            // The two features may come in either order.
            let same = weight(response, into, key[0]) * weight(response, from, key[0]) > 0.0;
            let sign = if same { 1.0 } else { -1.0 };
            response.force[into] = axpy(response.force[into], sign, response.force[from]);
            if !response.curvature.is_empty() {
                for i in 0..3 {
                    let k = response.curvature[from][i];
                    response.curvature[into][i] = add(response.curvature[into][i], k);
                }
            }
            response.weights[from] = [0.0; 4];
            merged = true;
        }
    }
    if merged {
        let ContactResponse {
            nodes,
            weights,
            force,
            curvature,
            ..
        } = response;
        let mut kept = 0;
        for c in 0..nodes.len() {
            if weights[c] == [0.0; 4] {
                continue;
            }
            nodes[kept] = nodes[c];
            weights[kept] = weights[c];
            force[kept] = force[c];
            if !curvature.is_empty() {
                curvature[kept] = curvature[c];
            }
            kept += 1;
        }
        nodes.truncate(kept);
        weights.truncate(kept);
        force.truncate(kept);
        curvature.truncate(kept);
    }
}
