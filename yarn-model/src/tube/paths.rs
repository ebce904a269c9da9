use crate::vec3::V;
use crate::{NONE, YarnError, YarnNetwork, plane_normal};

/// Part of `|t_k| |t_{k+1}|` that `n·(t_k × t_{k+1})` must reach to decide a
/// sign.
pub(super) const PARALLEL: f64 = 0.05;

/// The ways of yarns over nodes, and which of them lies in front of which: all
/// of a network that its tubes need.
#[derive(Clone, Debug, PartialEq)]
pub struct StrandPaths {
    offsets: Vec<u32>,
    nodes: Vec<u32>,
    layers: Vec<u8>,
    radii: Vec<f64>,
    sides: Vec<i8>,
    /// First entry of every node in `stacks`, and the number of entries.
    starts: Vec<u32>,
    /// Visits by node, front to back.
    stacks: Vec<u32>,
}

impl StrandPaths {
    /// Ways given visit by visit, yarn after yarn.
    ///
    /// `offsets` is the first visit of every yarn and the number of visits;
    /// `nodes` and `layers` are the node of each visit and its place in the
    /// node's stack, 0 in front; `radii` those of the yarns [m]. `sides` has an
    /// entry for every pair of neighbours in a stack, node by node and front to
    /// back: the sign of `n·(t_k × t_{k+1})` at rest with `n` away from the
    /// viewer of the right side, 0 for parallel yarns.
    ///
    /// # Errors
    /// [`YarnError`] for the first thing that does not fit together.
    pub fn new(
        node_count: usize,
        offsets: Vec<u32>,
        nodes: Vec<u32>,
        layers: Vec<u8>,
        radii: Vec<f64>,
        sides: Vec<i8>,
    ) -> Result<Self, YarnError> {
        let mut paths = Self::sorted(node_count, offsets, nodes, layers, radii)?;
        let pairs = paths.pairs();
        if sides.len() != pairs {
            return Err(YarnError::OutOfRange {
                what: "side",
                index: sides.len(),
                count: pairs,
            });
        }
        paths.sides = sides;
        Ok(paths)
    }

    /// The ways of a network; its points and fronts give the sides.
    pub fn of(network: &YarnNetwork) -> Self {
        let mut paths = Self {
            offsets: vec![0],
            nodes: Vec::with_capacity(network.strands.len()),
            layers: Vec::with_capacity(network.strands.len()),
            radii: Vec::with_capacity(network.yarns.len()),
            sides: Vec::new(),
            starts: network.offsets.clone(),
            stacks: vec![NONE; network.strands.len()],
        };
        for (y, yarn) in network.yarns.iter().enumerate() {
            for s in network.along(y as u32) {
                let node = network.strands[s as usize].node;
                paths.stacks[s as usize] = paths.nodes.len() as u32;
                paths.nodes.push(node);
                paths
                    .layers
                    .push((s - network.strands_of(node).start) as u8);
            }
            paths.offsets.push(paths.nodes.len() as u32);
            paths
                .radii
                .push(network.materials[yarn.material as usize].radius);
        }
        paths.sides = paths.rest_sides(&network.points, &network.front);
        paths
    }

    fn sorted(
        node_count: usize,
        offsets: Vec<u32>,
        nodes: Vec<u32>,
        layers: Vec<u8>,
        radii: Vec<f64>,
    ) -> Result<Self, YarnError> {
        let range = |what, index: usize, count| Err(YarnError::OutOfRange { what, index, count });
        if offsets.len() != radii.len() + 1 || layers.len() != nodes.len() {
            return range("yarn", radii.len(), offsets.len().saturating_sub(1));
        }
        if offsets.first() != Some(&0) || offsets.last() != Some(&(nodes.len() as u32)) {
            return range("visit", nodes.len(), *offsets.last().unwrap_or(&0) as usize);
        }
        for (yarn, ends) in offsets.windows(2).enumerate() {
            if ends[1] < ends[0] + 2 {
                return Err(YarnError::ShortYarn {
                    yarn,
                    visits: ends[1].saturating_sub(ends[0]) as usize,
                });
            }
        }
        if let Some(index) = radii.iter().position(|r| !(*r > 0.0 && r.is_finite())) {
            return Err(YarnError::NotFinite {
                what: "radius of yarn",
                index,
            });
        }
        let mut starts = vec![0u32; node_count + 1];
        for &node in &nodes {
            if node as usize >= node_count {
                return range("node", node as usize, node_count);
            }
            starts[node as usize + 1] += 1;
        }
        for node in 0..node_count {
            starts[node + 1] += starts[node];
        }
        let mut stacks: Vec<u32> = (0..nodes.len() as u32).collect();
        stacks.sort_by_key(|&v| (nodes[v as usize], layers[v as usize], v));
        for node in 0..node_count {
            let stack = &stacks[starts[node] as usize..starts[node + 1] as usize];
            let layer = |v: &u32| layers[*v as usize];
            if stack
                .iter()
                .enumerate()
                .any(|(k, v)| k != layer(v) as usize)
            {
                return Err(YarnError::Layers {
                    node,
                    layers: stack.iter().map(layer).collect(),
                    last: stack.len() - 1,
                });
            }
        }
        Ok(Self {
            offsets,
            nodes,
            layers,
            radii,
            sides: Vec::new(),
            starts,
            stacks,
        })
    }

    fn pairs(&self) -> usize {
        let stack = self.starts.windows(2);
        stack
            .map(|s| (s[1] - s[0]).saturating_sub(1) as usize)
            .sum()
    }

    fn rest_sides(&self, points: &[[f64; 3]], front: &[[f64; 3]]) -> Vec<i8> {
        let mut sides = Vec::with_capacity(self.pairs());
        for node in 0..self.node_count() as u32 {
            let stack = self.stack(node);
            if stack.len() < 2 {
                continue;
            }
            let front = V::from(front[node as usize]);
            let n = plane_normal(&self.around(node, points)).map_or(-front, V::from);
            let n = if n.dot(&front) > 0.0 { -n } else { n };
            for pair in stack.windows(2) {
                let side = self.side(pair, points, n);
                sides.push(match side.abs() >= PARALLEL {
                    true => side.signum() as i8,
                    false => 0,
                });
            }
        }
        sides
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of yarns.
    pub fn yarn_count(&self) -> usize {
        self.radii.len()
    }

    /// First visit of every yarn, and the number of visits.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// Node of each visit.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Place of each visit in the stack of its node, 0 in front.
    pub fn layers(&self) -> &[u8] {
        &self.layers
    }

    /// Radius of each yarn [m].
    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Signs of neighbours in stacks, see [`new`](Self::new).
    pub fn sides(&self) -> &[i8] {
        &self.sides
    }

    /// Visits of a yarn.
    pub fn visits(&self, yarn: usize) -> std::ops::Range<usize> {
        self.offsets[yarn] as usize..self.offsets[yarn + 1] as usize
    }

    /// Visits of a node, front to back.
    pub(super) fn stack(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.stacks[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// Nodes before and after a visit; beyond a yarn's end its own node.
    pub(super) fn beside(&self, visit: u32) -> [u32; 2] {
        let own = self.nodes[visit as usize];
        // Ends of yarns are few; a search among them is exact.
        let first = self.offsets.binary_search(&visit).is_ok();
        let last = self.offsets.binary_search(&(visit + 1)).is_ok();
        let at = |k: usize| self.nodes[k];
        let visit = visit as usize;
        [
            if first { own } else { at(visit - 1) },
            if last { own } else { at(visit + 1) },
        ]
    }

    /// A node's point and those before and after it on all of its yarns.
    pub(super) fn around(&self, node: u32, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut around = vec![points[node as usize]];
        for &v in self.stack(node) {
            let others = self.beside(v).into_iter().filter(|n| *n != node);
            around.extend(others.map(|n| points[n as usize]));
        }
        around
    }

    /// Unit direction of a yarn at a visit, or zero.
    pub(super) fn direction(&self, visit: u32, points: &[[f64; 3]]) -> V {
        let [a, b] = self.beside(visit).map(|n| V::from(points[n as usize]));
        (b - a).try_normalize(0.0).unwrap_or_else(V::zeros)
    }

    /// `n·(t_k × t_{k+1})` of two visits.
    pub(super) fn side(&self, pair: &[u32], points: &[[f64; 3]], n: V) -> f64 {
        let [a, b] = [pair[0], pair[1]].map(|v| self.direction(v, points));
        n.dot(&a.cross(&b))
    }
}
