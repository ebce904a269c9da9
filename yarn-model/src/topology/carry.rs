use selvedge_energy::StencilEnergy;

use super::Change;
use crate::vec3::V;
use crate::{FrictionSettings, NONE, SlidingFriction, StitchWrapping, WrapPair, YarnNetwork};

fn get(q: &[f64], at: usize) -> V {
    V::from_column_slice(&q[at..at + 3])
}

fn set(q: &mut [f64], at: usize, x: V) {
    q[at..at + 3].copy_from_slice(x.as_slice());
}

/// Unknowns and rates of a network: points, then arc lengths.
struct View<'a> {
    network: &'a YarnNetwork,
    q: &'a [f64],
    v: &'a [f64],
}

impl View<'_> {
    fn arc(&self, s: u32) -> f64 {
        self.q[3 * self.network.nodes() + s as usize]
    }

    fn rate(&self, s: u32) -> f64 {
        self.v[3 * self.network.nodes() + s as usize]
    }

    fn node(&self, s: u32) -> usize {
        3 * self.network.strands[s as usize].node as usize
    }

    fn span(&self, a: u32, b: u32) -> f64 {
        self.arc(b) - self.arc(a)
    }

    /// Velocity of the material at a strand, as seen in the segment from `a`
    /// to `b`, of which it is one [m/s].
    fn material(&self, s: u32, a: u32, b: u32) -> V {
        let w = (get(self.q, self.node(b)) - get(self.q, self.node(a))) / self.span(a, b);
        get(self.v, self.node(s)) - w * self.rate(s)
    }

    /// Momentum of a segment [kg·m/s].
    fn momentum(&self, a: u32, b: u32) -> V {
        let density = self.network.material_of(a).line_density();
        (self.material(a, a, b) + self.material(b, a, b)) * (0.5 * density * self.span(a, b))
    }

    /// Half of the mass of all segments at a strand's node [kg].
    fn mass(&self, s: u32) -> f64 {
        let n = self.network;
        let half = |s: u32| {
            let strand = &n.strands[s as usize];
            let before = if strand.prev == NONE {
                0.0
            } else {
                self.span(strand.prev, s)
            };
            let after = if strand.next == NONE {
                0.0
            } else {
                self.span(s, strand.next)
            };
            0.5 * n.material_of(s).line_density() * (before + after)
        };
        n.strands_of(n.strands[s as usize].node).map(half).sum()
    }

    /// Mean velocity of the material on both sides of a strand, by length.
    fn mean(&self, s: u32) -> V {
        let strand = &self.network.strands[s as usize];
        let (mut sum, mut length) = (V::zeros(), 0.0);
        for (a, b) in [(strand.prev, s), (s, strand.next)] {
            if a != NONE && b != NONE {
                let span = self.span(a, b);
                sum += self.material(s, a, b) * span;
                length += span;
            }
        }
        sum / length
    }
}

impl Change {
    /// The state after the change: unknowns `q` and rates `v`, points then arc
    /// lengths, of the network before. `driven` are the nodes of the new network
    /// whose velocity is prescribed.
    ///
    /// Nodes stay where they are. A strand whose arc length becomes frozen moves
    /// with the mean velocity of the material around it,
    ///
    /// ```text
    /// v = Σ Δu (ẋ − w u̇) / Σ Δu,   w = Δx/Δu,   over the segments on both sides
    /// ```
    ///
    /// and the ends of a cut with the mean of both ends of the segment, so that
    /// every segment keeps its momentum. Where a node is taken out, the momentum
    /// that the straight segment lacks goes to its two ends, each getting the
    /// same velocity more, unless it is driven. Mass is that of the arc lengths
    /// between the ends of the yarns, which stay.
    pub fn carry(
        &self,
        old: &YarnNetwork,
        q: &[f64],
        v: &[f64],
        driven: impl Fn(u32) -> bool,
    ) -> (Vec<f64>, Vec<f64>) {
        let before = View { network: old, q, v };
        let n = &self.network;
        let (points, strands) = (n.nodes(), n.strands.len());
        let (mut x, mut r) = (
            vec![0.0; 3 * points + strands],
            vec![0.0; 3 * points + strands],
        );
        for (new, &from) in self.node_from.iter().enumerate() {
            set(&mut x, 3 * new, get(q, 3 * from as usize));
            set(&mut r, 3 * new, get(v, 3 * from as usize));
        }
        for (new, &from) in self.strand_from.iter().enumerate() {
            if from == NONE {
                continue;
            }
            let (strand, was) = (&n.strands[new], &old.strands[from as usize]);
            x[3 * points + new] = before.arc(from);
            if !strand.held {
                r[3 * points + new] = before.rate(from);
            } else if !was.held {
                set(&mut r, 3 * strand.node as usize, before.mean(from));
            }
        }
        for &[end, start, a, b] in &self.cuts {
            let place = (get(q, before.node(a)) + get(q, before.node(b))) * 0.5;
            let speed = (before.material(a, a, b) + before.material(b, a, b)) * 0.5;
            for new in [end, start] {
                let node = 3 * n.strands[new as usize].node as usize;
                set(&mut x, node, place);
                set(&mut r, node, speed);
                x[3 * points + new as usize] = 0.5 * (before.arc(a) + before.arc(b));
            }
        }
        let mut new_of = vec![NONE; old.strands.len()];
        for (new, &from) in self.strand_from.iter().enumerate() {
            if from != NONE {
                new_of[from as usize] = new as u32;
            }
        }
        for &[gone, a, b] in &self.removed {
            let had = before.momentum(a, gone) + before.momentum(gone, b);
            let ends = [a, b].map(|s| new_of[s as usize]);
            let free = ends.map(|s| !driven(n.strands[s as usize].node));
            let after = View {
                network: n,
                q: &x,
                v: &r,
            };
            let lacks = had - after.momentum(ends[0], ends[1]);
            let mass: f64 = ends
                .iter()
                .zip(free)
                .filter(|(_, f)| *f)
                .map(|(s, _)| after.mass(*s))
                .sum();
            if mass <= 0.0 {
                continue;
            }
            for (end, _) in ends.into_iter().zip(free).filter(|(_, f)| *f) {
                let node = 3 * n.strands[end as usize].node as usize;
                let faster = get(&r, node) + lacks / mass;
                set(&mut r, node, faster);
            }
        }
        (x, r)
    }

    /// History of [`SlidingFriction`] after the change: anchors and normals of
    /// the contacts that remain.
    pub fn friction_history(
        &self,
        old: &YarnNetwork,
        settings: FrictionSettings,
        history: &[f64],
    ) -> Vec<f64> {
        let new = SlidingFriction::new(&self.network, settings);
        let Some((was, now)) = SlidingFriction::new(old, settings).zip(new) else {
            return Vec::new();
        };
        let (before, after) = (was.stencils(), now.stencils());
        let mut carried = now.history().to_vec();
        if history.len() != was.history().len() {
            return carried;
        }
        // Both are sorted by their first strand.
        for (e, pair) in after.iter().enumerate() {
            let pair = pair.map(|s| self.strand_from[s as usize]);
            if let Ok(k) = before.binary_search(&pair) {
                carried[2 * e..2 * e + 2].copy_from_slice(&history[2 * k..2 * k + 2]);
            }
        }
        let first = 2 * after.len();
        for node in 0..self.network.nodes() as u32 {
            let strands = self.network.strands_of(node);
            for s in strands.start..strands.end.saturating_sub(1) {
                let [a, b] = [s, s + 1].map(|s| self.strand_from[s as usize]);
                let was = old.strands[a as usize].node;
                if b == a + 1 && old.strands[b as usize].node == was {
                    let to = first + 3 * (s - node) as usize;
                    let from = 2 * before.len() + 3 * (a - was) as usize;
                    carried[to..to + 3].copy_from_slice(&history[from..from + 3]);
                }
            }
        }
        carried
    }

    /// History of [`StitchWrapping`] after the change, given a new one:
    /// the angles of the contacts that remain.
    pub fn wrapping_history(
        &self,
        old: &YarnNetwork,
        history: &[f64],
        new: &StitchWrapping,
    ) -> Vec<f64> {
        let mut carried = new.history().to_vec();
        let before = keys(old);
        let after = keys(&self.network);
        if before.len() != history.len() || after.len() != carried.len() {
            return carried;
        }
        for (angle, (contact, key)) in carried.iter_mut().zip(after) {
            let was = (self.stitch_from[contact as usize], key);
            if let Ok(k) = before.binary_search(&was) {
                *angle = history[k];
            }
        }
        carried
    }
}

/// Contact of every wrapping element, and its place there; sorted.
fn keys(network: &YarnNetwork) -> Vec<(u32, (bool, u32))> {
    let mut keys: Vec<(u32, (bool, u32))> = Vec::new();
    for e in StitchWrapping::elements(network) {
        let back = e.pair == WrapPair::ChildAtB;
        let nth = match keys.last() {
            Some((contact, (last, nth))) if *contact == e.contact && *last == back => nth + 1,
            _ => 0,
        };
        keys.push((e.contact, (back, nth)));
    }
    keys
}
