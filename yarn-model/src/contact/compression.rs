use rayon::prelude::*;

use super::normal::InterfaceNormals;
use super::stack::pair_compression;
use super::wraps::Wraps;
use super::{StackRule, stack_compression};
use crate::force::bending::bending_force;
use crate::force::stretch::stretch_force;
use crate::vec3::V;
use crate::{NONE, YarnNetwork};

/// Strands or interfaces that a thread takes at once, at least.
pub(super) const GRAIN: usize = 256;

/// Whose tension presses yarns on each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TensionRule {
    /// Of the yarns as they are, with all yarns of a node in one point.
    #[default]
    Network,
    /// Of the copy in which yarns lie beside each other [Cirio2017]. Its
    /// segments are longer: where the network's rest lengths are those of the
    /// flat cloth, the copy is under tension at rest.
    Offset,
}

/// Settings of [`Compression`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompressionSettings {
    /// How stacks of more than two yarns press on each other.
    pub stack: StackRule,
    /// Whose tension presses.
    pub tension: TensionRule,
    /// Distance of yarns that touch over the sum of their radii, `c_r` [1].
    pub crimp: f64,
}

impl Default for CompressionSettings {
    /// Yarns that keep their thickness.
    fn default() -> Self {
        Self {
            stack: StackRule::default(),
            tension: TensionRule::default(),
            crimp: 1.0,
        }
    }
}

/// How hard yarns press on each other at every interface of a network.
///
/// The forces `F_i` on the yarns of a node, from stretch and bending (and
/// wrapping, where there are stitches) along themselves, are those of a copy of
/// the geometry in which yarns lie beside each other instead of in the same
/// point [Cirio2017]:
///
/// ```text
/// x_i = x + o_i n,   o_i = c_r (R_0 + 2 R_1 + … + 2 R_{i−1} + R_i − H/2)
/// ```
///
/// with `n` the mean normal of the node, front to back, and `H` the distance of
/// the outermost axes; for equal radii `o_i = (i − (n−1)/2) 2 R c_r`.
/// [`stack_compression`] makes compressions of the forces.
///
/// **Deviation.** The copy gives directions, bends and wraps, but by default not
/// the tension, see [`TensionRule`]: in a stockinette of the sweater's yarn with
/// flat rest lengths its segments in the contacts are twice too long at rest,
/// and press with 17 N instead of 1 mN.
///
/// Interface `k` of node `v`, between its strands `k` and `k + 1`, has the
/// index `offsets[v] − v + k`.
///
/// Degenerate cases: segments whose arc lengths are in the wrong order have no
/// force; a force that is not a number presses with zero.
#[derive(Clone, Debug)]
pub struct Compression {
    normals: InterfaceNormals,
    settings: CompressionSettings,
    offsets: Vec<u32>,
    strands: Vec<Fibre>,
    kinds: Vec<Kind>,
    wraps: Wraps,
    // What `update` writes.
    normal: Vec<V>,
    places: Vec<V>,
    parts: Vec<Part>,
    lambda: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Fibre {
    node: u32,
    prev: u32,
    next: u32,
    kind: u32,
    /// Whether bends of its yarn jam.
    jams: bool,
}

/// What compression needs of a material.
#[derive(Clone, Copy, Debug)]
struct Kind {
    /// `c_r R` [m].
    radius: f64,
    stretch: f64,
    bending: f64,
}

/// Forces [N] on a strand, and on those before and after it, of the segment
/// after it and the bend at it.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    own: V,
    before: V,
    after: V,
}

impl Compression {
    /// Compressions of a network.
    pub fn new(network: &YarnNetwork, settings: CompressionSettings) -> Self {
        let (normals, normal) = InterfaceNormals::new(network);
        let strands = network.strands.iter().map(|s| Fibre {
            node: s.node,
            prev: s.prev,
            next: s.next,
            kind: network.yarns[s.yarn as usize].material,
            jams: network.yarns[s.yarn as usize].jams,
        });
        let kinds = network.materials.iter().map(|m| Kind {
            radius: settings.crimp * m.radius,
            stretch: m.stretch_stiffness(),
            bending: m.bending_stiffness(),
        });
        Self {
            settings,
            offsets: network.offsets.clone(),
            strands: strands.collect(),
            kinds: kinds.collect(),
            wraps: Wraps::new(network),
            lambda: vec![0.0; normals.len()],
            normals,
            normal,
            places: vec![V::zeros(); network.strands.len()],
            parts: vec![Part::default(); network.strands.len()],
        }
    }

    /// Number of interfaces.
    pub fn len(&self) -> usize {
        self.lambda.len()
    }

    /// Whether no yarn touches another.
    pub fn is_empty(&self) -> bool {
        self.lambda.is_empty()
    }

    /// Compression of every interface [N], as of the last update.
    pub fn lambda(&self) -> &[f64] {
        &self.lambda
    }

    /// Unit normals of all interfaces, front to back, three numbers each: at
    /// rest, then as of the last update.
    pub fn normals(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.normal.iter().map(|n| (*n).into())
    }

    /// Force on a strand from along its yarn [N], beside the other yarns, as of
    /// the last update.
    pub fn force(&self, strand: u32) -> [f64; 3] {
        self.along(strand as usize).into()
    }

    /// Computes all compressions from flat points [m], the strands' arc lengths
    /// [m] and the normals of the step before, three numbers each.
    ///
    /// # Panics
    /// When a slice is too short.
    pub fn update(&mut self, points: &[f64], arcs: &[f64], previous: &[f64]) {
        self.normals.update(points, previous, &mut self.normal);
        let mut places = std::mem::take(&mut self.places);
        places
            .par_iter_mut()
            .enumerate()
            .with_min_len(GRAIN)
            .for_each(|(s, place)| *place = self.place(s, points));
        self.places = places;
        let mut parts = std::mem::take(&mut self.parts);
        parts
            .par_iter_mut()
            .enumerate()
            .with_min_len(GRAIN)
            .for_each(|(s, part)| {
                *part = match self.strands[s].jams {
                    true => self.part::<true>(s, points, arcs),
                    false => self.part::<false>(s, points, arcs),
                }
            });
        self.parts = parts;
        self.wraps.update(&self.places);
        let mut lambda = std::mem::take(&mut self.lambda);
        lambda
            .par_iter_mut()
            .enumerate()
            .with_min_len(GRAIN)
            .for_each_init(Scratch::default, |scratch, (k, lambda)| {
                *lambda = self.pressed(k, scratch);
            });
        self.lambda = lambda;
    }

    /// Strands of a node, and its first interface.
    #[inline(always)]
    fn stack(&self, node: usize) -> (std::ops::Range<usize>, usize) {
        let first = self.offsets[node] as usize;
        (first..self.offsets[node + 1] as usize, first - node)
    }

    /// Where strand `s` lies beside the others of its node.
    fn place(&self, s: usize, points: &[f64]) -> V {
        let node = self.strands[s].node as usize;
        let x = V::from(points.as_chunks::<3>().0[node]);
        let (strands, interface) = self.stack(node);
        let radius = |s: usize| self.kinds[self.strands[s].kind as usize].radius;
        match strands.len() {
            0 | 1 => x,
            2 => {
                let half = 0.5 * (radius(strands.start) + radius(strands.start + 1));
                let o = if s == strands.start { -half } else { half };
                x + self.normal[interface] * o
            }
            n => {
                let mut height = 0.0;
                let mut o = 0.0;
                for t in strands.start + 1..strands.end {
                    height += radius(t - 1) + radius(t);
                    if t == s {
                        o = height;
                    }
                }
                let sum: V = self.normal[interface..interface + n - 1].iter().sum();
                x + sum.try_normalize(1e-9).unwrap_or_default() * (o - 0.5 * height)
            }
        }
    }

    fn part<const JAMMING: bool>(&self, s: usize, points: &[f64], arcs: &[f64]) -> Part {
        let Fibre {
            prev, next, kind, ..
        } = self.strands[s];
        let mut part = Part::default();
        if next == NONE {
            return part;
        }
        let kind = &self.kinds[kind as usize];
        let (x, x1) = (self.places[s], self.places[next as usize]);
        let (u, u1) = (arcs[s], arcs[next as usize]);
        if u1 > u {
            part.after = match self.settings.tension {
                TensionRule::Offset => stretch_force(kind.stretch, x, u, x1, u1),
                TensionRule::Network => {
                    let points = points.as_chunks::<3>().0;
                    let end = |s: usize| V::from(points[self.strands[s].node as usize]);
                    let length = (end(next as usize) - end(s)).norm();
                    let tension = kind.stretch * (length / (u1 - u) - 1.0);
                    let t = (x1 - x).try_normalize(f64::MIN_POSITIVE);
                    t.unwrap_or_default() * -tension
                }
            };
            part.own = -part.after;
        }
        if prev == NONE {
            return part;
        }
        let du = u1 - arcs[prev as usize];
        if du > 0.0 && kind.bending > 0.0 {
            let x2 = self.places[prev as usize];
            let [f2, f, f1] = bending_force::<JAMMING>(kind.bending, x2, x, x1, du);
            part.before = f2;
            part.own += f;
            part.after += f1;
        }
        part
    }

    /// Force on a strand along its yarn [N].
    #[inline(always)]
    fn along(&self, s: usize) -> V {
        let Fibre { prev, next, .. } = self.strands[s];
        let mut force = self.parts[s].own;
        if prev != NONE {
            force += self.parts[prev as usize].after;
        }
        if next != NONE {
            force += self.parts[next as usize].before;
        }
        force + self.wraps.force(s)
    }

    fn pressed(&self, k: usize, scratch: &mut Scratch) -> f64 {
        let node = self.normals.node(k);
        let (strands, interface) = self.stack(node);
        if strands.len() == 2 {
            let s = strands.start;
            return pair_compression(self.normal[k], self.along(s), self.along(s + 1));
        }
        // Every interface solves its whole stack: stacks are few.
        let Scratch {
            normals,
            forces,
            lambda,
        } = scratch;
        let m = strands.len() - 1;
        let around = &self.normal[interface..interface + m];
        normals.clear();
        normals.extend(around.iter().map(|n| <[f64; 3]>::from(*n)));
        forces.clear();
        forces.extend(strands.map(|s| <[f64; 3]>::from(self.along(s))));
        lambda.resize(m, 0.0);
        stack_compression(normals, forces, self.settings.stack, lambda);
        lambda[k - interface]
    }

    /// Heap memory held [bytes].
    pub fn heap_bytes(&self) -> usize {
        self.normals.heap_bytes()
            + size_of_val(&self.offsets[..])
            + size_of_val(&self.strands[..])
            + size_of_val(&self.kinds[..])
            + self.wraps.heap_bytes()
            + size_of_val(&self.normal[..])
            + size_of_val(&self.places[..])
            + size_of_val(&self.parts[..])
            + size_of_val(&self.lambda[..])
    }
}

#[derive(Default)]
struct Scratch {
    normals: Vec<[f64; 3]>,
    forces: Vec<[f64; 3]>,
    lambda: Vec<f64>,
}
