use crate::{YarnError, YarnMaterial};

/// Index of something that is absent.
pub const NONE: u32 = u32::MAX;

/// A yarn's passage through a node. Its index is the index of its arc-length
/// unknown: strands of a node are consecutive, front to back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strand {
    /// The node.
    pub node: u32,
    /// The yarn.
    pub yarn: u32,
    /// Strand before on the yarn, or [`NONE`].
    pub prev: u32,
    /// Strand after on the yarn, or [`NONE`].
    pub next: u32,
    /// Rest arc length of the material at the node [m].
    pub arc: f64,
    /// Whether the arc length is prescribed: yarn ends, nodes of a single yarn,
    /// yarns of a cast-on.
    pub held: bool,
}

/// A yarn: its strands form a list from `first` to `last` with growing arc
/// lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yarn {
    /// Index of its material.
    pub material: u32,
    /// First strand.
    pub first: u32,
    /// Last strand.
    pub last: u32,
    /// Number of strands.
    pub strands: u32,
    /// Whether its bends jam, as those of knitted cloth do.
    pub jams: bool,
}

/// What holds the yarns of a node together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeContact {
    /// One yarn passes; nothing slides.
    Rod,
    /// Warp and weft of a woven cloth; index into the crossings.
    Crossing(u32),
    /// Outer, lower node A of a stitch contact.
    StitchA(u32),
    /// Inner, upper node B of a stitch contact.
    StitchB(u32),
}

/// A crossing of a woven cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The node.
    pub node: u32,
    /// Strand of the warp.
    pub warp: u32,
    /// Strand of the weft.
    pub weft: u32,
}

/// One side of a stitch: a child loop drawn through one or more parent loops.
///
/// Front to back the yarns are, for a knit stitch, parents then child at A and
/// child then parents at B; for a purl stitch the other way round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchContact {
    /// Outer, lower node.
    pub a: u32,
    /// Inner, upper node.
    pub b: u32,
    /// Purl instead of knit, seen from the right side.
    pub purl: bool,
    /// −1 left, +1 right of the stitch, seen from the right side.
    pub side: i8,
    /// Number of parents.
    pub parents: u8,
    /// Rest length L of the contact [m].
    pub rest: f64,
    /// Row of the child loop.
    pub row: u32,
    /// Column of the child loop in its row.
    pub column: u32,
}

/// Yarns, the nodes where they meet, and how they lie at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct YarnNetwork {
    /// Position of every node [m].
    pub points: Vec<[f64; 3]>,
    /// Place of every node in the plane of its panel [m].
    pub flat: Vec<[f64; 2]>,
    /// Unit normal of the cloth at every node, towards the viewer of its right
    /// side.
    pub front: Vec<[f64; 3]>,
    /// What holds every node.
    pub contacts: Vec<NodeContact>,
    /// Strands by node, front to back.
    pub strands: Vec<Strand>,
    /// First strand of every node, and the number of strands.
    pub offsets: Vec<u32>,
    /// The yarns.
    pub yarns: Vec<Yarn>,
    /// Their materials.
    pub materials: Vec<YarnMaterial>,
    /// Crossings of woven cloth.
    pub crossings: Vec<Crossing>,
    /// Stitch contacts of knitted cloth.
    pub stitches: Vec<StitchContact>,
}

/// A yarn's visit to a node, for [`NetworkBuilder::yarn`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// The node.
    pub node: u32,
    /// Place in the node's stack, 0 in front.
    pub layer: u8,
    /// Rest arc length [m].
    pub arc: f64,
    /// Whether the arc length is prescribed.
    pub held: bool,
}

/// Collects nodes, yarns and contacts of a [`YarnNetwork`].
#[derive(Clone, Debug, Default)]
pub struct NetworkBuilder {
    points: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    front: Vec<[f64; 3]>,
    materials: Vec<YarnMaterial>,
    yarns: Vec<(u32, Vec<Visit>)>,
    /// Nodes of crossings; the warp is the yarn with the lower index.
    crossings: Vec<u32>,
    stitches: Vec<StitchContact>,
}

impl NetworkBuilder {
    /// Nothing but the kinds of yarn.
    pub fn new(materials: Vec<YarnMaterial>) -> Self {
        Self {
            materials,
            ..Self::default()
        }
    }

    /// Adds a node at a place [m] of its panel, and returns its index.
    pub fn node(&mut self, point: [f64; 3], flat: [f64; 2], front: [f64; 3]) -> u32 {
        self.points.push(point);
        self.flat.push(flat);
        self.front.push(front);
        (self.points.len() - 1) as u32
    }

    /// Adds a yarn through nodes that exist already, and returns its index.
    /// First and last visit are held whatever they say.
    pub fn yarn(&mut self, material: u32, visits: Vec<Visit>) -> u32 {
        self.yarns.push((material, visits));
        (self.yarns.len() - 1) as u32
    }

    /// Declares a node a crossing of two yarns, of which the one added first
    /// is the warp.
    pub fn crossing(&mut self, node: u32) {
        self.crossings.push(node);
    }

    /// Declares two nodes a stitch contact.
    pub fn stitch(&mut self, contact: StitchContact) -> u32 {
        self.stitches.push(contact);
        (self.stitches.len() - 1) as u32
    }

    /// Joins everything.
    ///
    /// # Errors
    /// [`YarnError`] for the first thing that does not fit together.
    pub fn build(self) -> Result<YarnNetwork, YarnError> {
        for material in &self.materials {
            material.validate()?;
        }
        let nodes = self.points.len();
        let finite = |what, index, ok: bool| match ok {
            true => Ok(()),
            false => Err(YarnError::NotFinite { what, index }),
        };
        for i in 0..nodes {
            let numbers = self.points[i].iter().chain(&self.flat[i]);
            let mut numbers = numbers.chain(&self.front[i]);
            finite("node", i, numbers.all(|x| x.is_finite()))?;
        }
        // Strands sorted by node and layer.
        let mut all: Vec<(Visit, u32, u32)> = Vec::new();
        for (y, (material, visits)) in self.yarns.iter().enumerate() {
            exists("material", *material, self.materials.len())?;
            if visits.len() < 2 {
                return Err(YarnError::ShortYarn {
                    yarn: y,
                    visits: visits.len(),
                });
            }
            for (k, visit) in visits.iter().enumerate() {
                exists("node", visit.node, nodes)?;
                finite("yarn", y, visit.arc.is_finite())?;
                if k > 0 && visit.arc <= visits[k - 1].arc {
                    return Err(YarnError::ArcNotIncreasing {
                        yarn: y,
                        visit: k,
                        arc: visit.arc,
                        before: visits[k - 1].arc,
                    });
                }
                all.push((*visit, y as u32, k as u32));
            }
        }
        let mut order: Vec<u32> = (0..all.len() as u32).collect();
        order.sort_by_key(|&i| {
            let (visit, yarn, k) = &all[i as usize];
            (visit.node, visit.layer, *yarn, *k)
        });
        let mut place = vec![0u32; all.len()];
        for (at, &i) in order.iter().enumerate() {
            place[i as usize] = at as u32;
        }
        let mut strands = Vec::with_capacity(all.len());
        for &i in &order {
            let (visit, yarn, k) = all[i as usize];
            let count = self.yarns[yarn as usize].1.len() as u32;
            strands.push(Strand {
                node: visit.node,
                yarn,
                prev: if k == 0 { NONE } else { place[i as usize - 1] },
                next: if k + 1 == count {
                    NONE
                } else {
                    place[i as usize + 1]
                },
                arc: visit.arc,
                held: visit.held || k == 0 || k + 1 == count,
            });
        }
        let knitted = !self.stitches.is_empty();
        let mut first = 0u32;
        let yarns = self.yarns.iter().map(|(material, visits)| {
            let count = visits.len() as u32;
            let yarn = Yarn {
                material: *material,
                first: place[first as usize],
                last: place[(first + count - 1) as usize],
                strands: count,
                jams: knitted,
            };
            first += count;
            yarn
        });
        let yarns = yarns.collect();
        let layers: Vec<u8> = order.iter().map(|&i| all[i as usize].0.layer).collect();
        let offsets = offsets(nodes, &strands, &layers)?;
        let mut network = YarnNetwork {
            contacts: vec![NodeContact::Rod; nodes],
            points: self.points,
            flat: self.flat,
            front: self.front,
            strands,
            offsets,
            yarns,
            materials: self.materials,
            crossings: Vec::new(),
            stitches: Vec::new(),
        };
        for node in self.crossings {
            network.add_crossing(node)?;
        }
        for contact in self.stitches {
            network.add_stitch(contact)?;
        }
        for node in 0..nodes {
            if network.contacts[node] == NodeContact::Rod {
                for s in network.strands_of(node as u32) {
                    network.strands[s as usize].held = true;
                }
            }
        }
        Ok(network)
    }
}

fn exists(what: &'static str, index: u32, count: usize) -> Result<(), YarnError> {
    if (index as usize) < count {
        return Ok(());
    }
    let index = index as usize;
    Err(YarnError::OutOfRange { what, index, count })
}

/// First strand of every node; strands are sorted by node and layer.
fn offsets(nodes: usize, strands: &[Strand], layers: &[u8]) -> Result<Vec<u32>, YarnError> {
    let mut offsets = vec![0u32; nodes + 1];
    for s in strands {
        offsets[s.node as usize + 1] += 1;
    }
    for node in 0..nodes {
        if offsets[node + 1] == 0 {
            return Err(YarnError::LooseNode { node });
        }
        offsets[node + 1] += offsets[node];
        let layers = &layers[offsets[node] as usize..offsets[node + 1] as usize];
        if layers.iter().enumerate().any(|(k, l)| k != *l as usize) {
            return Err(YarnError::Layers {
                node,
                layers: layers.to_vec(),
                last: layers.len() - 1,
            });
        }
    }
    Ok(offsets)
}

impl YarnNetwork {
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.points.len()
    }

    /// Strands of a node, front to back.
    pub fn strands_of(&self, node: u32) -> std::ops::Range<u32> {
        self.offsets[node as usize]..self.offsets[node as usize + 1]
    }

    /// Strands of a yarn in order.
    pub fn along(&self, yarn: u32) -> impl Iterator<Item = u32> + '_ {
        let first = self.yarns[yarn as usize].first;
        std::iter::successors(Some(first), |&s| match self.strands[s as usize].next {
            NONE => None,
            next => Some(next),
        })
    }

    /// Segments of all yarns as pairs of strands, yarn by yarn, in order.
    pub fn segments(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        (0..self.yarns.len() as u32).flat_map(|y| {
            self.along(y)
                .filter_map(|s| match self.strands[s as usize].next {
                    NONE => None,
                    next => Some([s, next]),
                })
        })
    }

    /// Material of a strand's yarn.
    pub fn material_of(&self, strand: u32) -> &YarnMaterial {
        let yarn = self.strands[strand as usize].yarn;
        &self.materials[self.yarns[yarn as usize].material as usize]
    }

    /// Strand of the child at node A.
    pub fn child_at_a(&self, contact: &StitchContact) -> u32 {
        let s = self.strands_of(contact.a);
        if contact.purl { s.start } else { s.end - 1 }
    }

    /// Strand of the child at node B.
    pub fn child_at_b(&self, contact: &StitchContact) -> u32 {
        let s = self.strands_of(contact.b);
        if contact.purl { s.end - 1 } else { s.start }
    }

    /// Strands of the parents at node A, front to back.
    pub fn parents_at_a(&self, contact: &StitchContact) -> std::ops::Range<u32> {
        let s = self.strands_of(contact.a);
        if contact.purl {
            s.start + 1..s.end
        } else {
            s.start..s.end - 1
        }
    }

    /// Strands of the parents at node B, front to back.
    pub fn parents_at_b(&self, contact: &StitchContact) -> std::ops::Range<u32> {
        let s = self.strands_of(contact.b);
        if contact.purl {
            s.start..s.end - 1
        } else {
            s.start + 1..s.end
        }
    }

    fn add_crossing(&mut self, node: u32) -> Result<(), YarnError> {
        exists("node", node, self.nodes())?;
        let s = self.strands_of(node);
        if s.len() != 2 {
            return Err(YarnError::StitchStack {
                contact: self.crossings.len(),
                node: node as usize,
                strands: s.len(),
                expected: 2,
            });
        }
        let yarn = |s: u32| self.strands[s as usize].yarn;
        let (front, back) = (s.start, s.start + 1);
        let (warp, weft) = match yarn(front) < yarn(back) {
            true => (front, back),
            false => (back, front),
        };
        self.contacts[node as usize] = NodeContact::Crossing(self.crossings.len() as u32);
        self.crossings.push(Crossing { node, warp, weft });
        Ok(())
    }

    fn add_stitch(&mut self, contact: StitchContact) -> Result<(), YarnError> {
        let index = self.stitches.len();
        for node in [contact.a, contact.b] {
            exists("node", node, self.nodes())?;
            let strands = self.strands_of(node).len();
            let expected = usize::from(contact.parents) + 1;
            if strands != expected || contact.parents == 0 {
                return Err(YarnError::StitchStack {
                    contact: index,
                    node: node as usize,
                    strands,
                    expected,
                });
            }
        }
        if !(contact.rest > 0.0 && contact.rest.is_finite()) {
            return Err(YarnError::Parameter {
                what: "rest length of a stitch contact",
                value: contact.rest,
                allowed: "positive and finite",
            });
        }
        self.contacts[contact.a as usize] = NodeContact::StitchA(index as u32);
        self.contacts[contact.b as usize] = NodeContact::StitchB(index as u32);
        self.stitches.push(contact);
        Ok(())
    }
}
