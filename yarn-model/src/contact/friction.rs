use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::spring::{Law, Pull, StickRule};
use super::{Compression, CompressionSettings};
use crate::{NONE, NodeContact, YarnNetwork};

/// Settings of [`SlidingFriction`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionSettings {
    /// When contacts stick.
    pub stick: StickRule,
    /// Anchor damping over `2 √(k_f ρ L/3)` [1], with `L` the mean rest length
    /// of the segments beside the node. 0 is none.
    pub damping: f64,
    /// How hard yarns press on each other.
    pub compression: CompressionSettings,
}

impl Default for FrictionSettings {
    fn default() -> Self {
        Self {
            stick: StickRule::default(),
            damping: 0.0,
            compression: CompressionSettings::default(),
        }
    }
}

/// Coulomb friction of yarns that slide on each other, by anchored springs on
/// their arc lengths.
///
/// Every interface between two yarns of a node has one stencil, the arc lengths
/// of both. Where the yarns cross, each has a spring of its own to its anchor
/// `ū`; where they are parallel (parents of one stitch), one spring acts on the
/// difference [Cirio2017]:
///
/// ```text
/// crossing   d = u − ū                             for each yarn
/// parallel   d = (u_i − u_{i+1}) − (ū_i − ū_{i+1})
/// T = k_f d + d_f ḋ
/// |T| ≤ μ λ   stick:   ∂V/∂d = T,            ∂²V/∂d² = k_f + d_f/dt
/// otherwise   slip:    ∂V/∂d = sign(T) μ λ,  ∂²V/∂d² = 0
/// ```
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `k_f` | anchor stiffness; of two yarns the harmonic mean | N/m |
/// | `d_f` | anchor damping, see [`FrictionSettings`] | kg/s |
/// | `μ` | geometric mean of both yarns' coefficients | 1 |
/// | `λ` | [`Compression`] of the interface at the start of the step | N |
///
/// After a step that slipped, the anchor follows so far that the spring pulls
/// with `μ λ`; with parallel yarns both anchors move by half. Where nothing
/// presses, the anchor stays with the yarn.
///
/// The compression's own derivative is left out, so that every spring keeps to
/// itself and the matrix stays symmetric and positive semidefinite for all
/// [`Curvature`]s. The value has the gradient given here as long as
/// compression and anchors are frozen; over many steps it is no energy.
///
/// **Deviation.** [`StickRule::Start`] is the rule of the paper. A yarn that
/// slides is then at its limit at the start of every other step, sticks in
/// that step, and pulls with `k_f` times the way of the step too much;
/// [`StickRule::Iterate`] never pulls with more than `μ λ`, and its first
/// iterate is the paper's step.
///
/// Strands whose arc length is held get no force where they cross; an
/// interface with both strands held has no stencil. History: the anchors and
/// the interfaces' last normals.
///
/// ```
/// use selvedge_energy::{Batch, EnergyBatch};
/// use selvedge_yarn_model::{Draft, FrictionSettings, SlidingFriction, Woven, YarnMaterial};
///
/// let cloth = Woven::of_size([0.02, 0.01], [2e-3; 2], YarnMaterial::default());
/// let network = cloth.build(&Draft::named("satin-5")?)?;
/// // Nothing for yarns without friction.
/// if let Some(friction) = SlidingFriction::new(&network, FrictionSettings::default()) {
///     let term = Batch::<_, 2, 2>::new("yarn friction", friction);
///     assert_eq!(term.len(), 10 * 5);
/// }
/// # Ok::<(), selvedge_yarn_model::WeaveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SlidingFriction {
    stencils: Vec<[u32; 2]>,
    springs: Vec<Spring>,
    stick: StickRule,
    /// `μ λ` of every stencil [N].
    limits: Vec<f64>,
    source: Source,
    /// Two anchors a stencil, then three numbers per normal.
    history: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Spring {
    interface: u32,
    parallel: bool,
    held: [bool; 2],
    friction: f64,
    /// `k_f` of both yarns, or twice that of the pair.
    stiffness: [f64; 2],
    damping: [f64; 2],
}

/// Where compressions come from.
#[derive(Clone, Debug)]
enum Source {
    Computed(Box<Compression>),
    Prescribed,
}

impl SlidingFriction {
    /// Friction of all interfaces whose yarns can slide and have friction;
    /// `None` where there is none. Anchors start at the rest arc lengths.
    pub fn new(network: &YarnNetwork, settings: FrictionSettings) -> Option<Self> {
        let mut friction = Self::without_source(network, settings)?;
        let compression = Compression::new(network, settings.compression);
        friction.history.extend(compression.normals().flatten());
        friction.source = Source::Computed(Box::new(compression));
        Some(friction)
    }

    /// As [`new`](Self::new), with the compression [N] of every interface given
    /// once and for all; see [`Compression`] for their order.
    ///
    /// # Panics
    /// When there are not as many compressions as interfaces.
    pub fn prescribed(
        network: &YarnNetwork,
        settings: FrictionSettings,
        lambda: &[f64],
    ) -> Option<Self> {
        let interfaces = network.strands.len() - network.nodes();
        assert_eq!(lambda.len(), interfaces, "a compression per interface");
        let mut friction = Self::without_source(network, settings)?;
        let limit = |s: &Spring| s.friction * lambda[s.interface as usize].max(0.0);
        friction.limits = friction.springs.iter().map(limit).collect();
        Some(friction)
    }

    fn without_source(network: &YarnNetwork, settings: FrictionSettings) -> Option<Self> {
        let mut stencils = Vec::new();
        let mut springs = Vec::new();
        for node in 0..network.nodes() as u32 {
            let strands = network.strands_of(node);
            for s in strands.start..strands.end - 1 {
                let pair = [s, s + 1];
                let held = pair.map(|s| network.strands[s as usize].held);
                let materials = pair.map(|s| network.material_of(s));
                let friction = (materials[0].friction * materials[1].friction).sqrt();
                if friction == 0.0 || held == [true, true] {
                    continue;
                }
                let parallel = parallel(network, node, s);
                let mut stiffness = materials.map(|m| m.anchor_stiffness);
                if parallel {
                    let [a, b] = stiffness;
                    stiffness = [2.0 * a * b / (a + b); 2];
                }
                let mass = pair.map(|s| segment_mass(network, s));
                let mass = match parallel {
                    true => [0.5 * (mass[0] + mass[1]); 2],
                    false => mass,
                };
                stencils.push(pair);
                springs.push(Spring {
                    interface: s - node,
                    parallel,
                    held,
                    friction,
                    stiffness,
                    damping: [0, 1]
                        .map(|k| settings.damping * 2.0 * (stiffness[k] * mass[k] / 3.0).sqrt()),
                });
            }
        }
        if stencils.is_empty() {
            return None;
        }
        let anchors = stencils.iter().flatten();
        let history = anchors.map(|s| network.strands[*s as usize].arc).collect();
        Some(Self {
            limits: vec![0.0; stencils.len()],
            stencils,
            springs,
            stick: settings.stick,
            source: Source::Prescribed,
            history,
        })
    }

    /// Compression of every interface, where it is computed.
    pub fn compression(&self) -> Option<&Compression> {
        match &self.source {
            Source::Computed(compression) => Some(compression),
            Source::Prescribed => None,
        }
    }

    /// `μ λ` of every stencil in this step [N].
    pub fn limits(&self) -> &[f64] {
        &self.limits
    }

    /// Anchors of every stencil [m].
    pub fn anchors(&self) -> &[[f64; 2]] {
        &self.history.as_chunks::<2>().0[..self.stencils.len()]
    }

    /// Puts every anchor where its yarn is; for cloth that starts relaxed.
    ///
    /// # Panics
    /// When there are fewer arc lengths than strands.
    pub fn anchor(&mut self, arcs: &[f64]) {
        let anchors = self.history.as_chunks_mut::<2>().0;
        for (anchor, stencil) in anchors.iter_mut().zip(&self.stencils) {
            *anchor = stencil.map(|s| arcs[s as usize]);
        }
    }

    /// The springs of a stencil, and whether it is one on the difference.
    #[inline(always)]
    fn laws(&self, e: usize, q: &[f64; 2], at: &EvalPoint<'_>) -> ([Option<Law>; 2], bool) {
        let spring = &self.springs[e];
        let start = at.gather_start::<2, 2>(&[1, 1], &self.stencils[e]);
        let anchor = self.anchors()[e];
        let law = |k: usize, d: f64, d_start: f64| {
            Some(Law {
                stick: self.stick,
                stiffness: spring.stiffness[k],
                viscosity: spring.damping[k] / at.dt,
                limit: self.limits[e],
                d,
                d_start,
            })
        };
        if spring.parallel {
            let rest = anchor[0] - anchor[1];
            let law = law(0, q[0] - q[1] - rest, start[0] - start[1] - rest);
            return ([law, None], true);
        }
        let law = |k: usize| match spring.held[k] {
            true => None,
            false => law(k, q[k] - anchor[k], start[k] - anchor[k]),
        };
        ([law(0), law(1)], false)
    }

    #[inline(always)]
    fn pulls(&self, e: usize, q: &[f64; 2], at: &EvalPoint<'_>) -> ([Pull; 2], bool) {
        let (laws, difference) = self.laws(e, q, at);
        let pull = |law: Option<Law>| law.map_or(Pull::default(), |l| l.pull());
        (laws.map(pull), difference)
    }
}

/// Whether the yarns above and below strand `s`'s back run side by side: both
/// are parents of a stitch.
fn parallel(network: &YarnNetwork, node: u32, s: u32) -> bool {
    let child = match network.contacts[node as usize] {
        NodeContact::StitchA(c) => network.child_at_a(&network.stitches[c as usize]),
        NodeContact::StitchB(c) => network.child_at_b(&network.stitches[c as usize]),
        NodeContact::Rod | NodeContact::Crossing(_) => return false,
    };
    s != child && s + 1 != child
}

/// `ρ L` of the segments beside a strand [kg].
fn segment_mass(network: &YarnNetwork, strand: u32) -> f64 {
    let s = &network.strands[strand as usize];
    let arc = |t: u32| network.strands[t as usize].arc;
    let (mut length, mut count) = (0.0, 0.0);
    for (from, to) in [(s.prev, strand), (strand, s.next)] {
        if from != NONE && to != NONE {
            length += arc(to) - arc(from);
            count += 1.0;
        }
    }
    network.material_of(strand).line_density() * length / f64::max(count, 1.0)
}

impl StencilEnergy<2, 2> for SlidingFriction {
    const NODE_DIMS: [usize; 2] = [1, 1];

    fn stencils(&self) -> &[[u32; 2]] {
        &self.stencils
    }

    fn value(&self, e: usize, q: &[f64; 2], at: &EvalPoint<'_>) -> f64 {
        let ([a, b], _) = self.pulls(e, q, at);
        a.value + b.value
    }

    fn gradient(&self, e: usize, q: &[f64; 2], at: &EvalPoint<'_>, g: &mut [f64; 2]) -> f64 {
        let ([a, b], difference) = self.pulls(e, q, at);
        *g = match difference {
            true => [a.gradient, -a.gradient],
            false => [a.gradient, b.gradient],
        };
        a.value + b.value
    }

    fn hessian(
        &self,
        e: usize,
        q: &[f64; 2],
        at: &EvalPoint<'_>,
        _: Curvature,
        g: &mut [f64; 2],
        h: &mut [[f64; 2]; 2],
    ) -> f64 {
        let ([a, b], difference) = self.pulls(e, q, at);
        (*g, *h) = match difference {
            true => (
                [a.gradient, -a.gradient],
                [[a.second, -a.second], [-a.second, a.second]],
            ),
            false => ([a.gradient, b.gradient], [[a.second, 0.0], [0.0, b.second]]),
        };
        a.value + b.value
    }

    fn is_conservative(&self) -> bool {
        false
    }

    fn begin_step(&mut self, at: &EvalPoint<'_>) {
        let Source::Computed(compression) = &mut self.source else {
            return;
        };
        let (points, arcs) = at.q_start.split_at(3 * at.layout.points);
        compression.update(points, arcs, &self.history[2 * self.stencils.len()..]);
        let lambda = compression.lambda();
        for (limit, spring) in self.limits.iter_mut().zip(&self.springs) {
            *limit = spring.friction * lambda[spring.interface as usize];
        }
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        for e in 0..self.stencils.len() {
            let q = at.gather::<2, 2>(&[1, 1], &self.stencils[e]);
            let (laws, difference) = self.laws(e, &q, at);
            let [a, b] = laws.map(|law| law.map_or(0.0, |l| l.follow()));
            let (a, b) = match difference {
                true => (0.5 * a, -0.5 * a),
                false => (a, b),
            };
            self.history[2 * e] += a;
            self.history[2 * e + 1] += b;
        }
        if let Source::Computed(compression) = &self.source {
            let normals = &mut self.history[2 * self.stencils.len()..];
            for (kept, normal) in normals
                .as_chunks_mut::<3>()
                .0
                .iter_mut()
                .zip(compression.normals())
            {
                *kept = normal;
            }
        }
    }

    fn history(&self) -> &[f64] {
        &self.history
    }

    fn restore_history(&mut self, history: &[f64]) {
        self.history.copy_from_slice(history);
    }

    fn heap_bytes(&self) -> usize {
        let compression = self.compression().map_or(0, Compression::heap_bytes);
        size_of_val(&self.stencils[..])
            + size_of_val(&self.springs[..])
            + size_of_val(&self.limits[..])
            + size_of_val(&self.history[..])
            + compression
    }
}
