//! Networks put together and numbered anew.

use crate::network::{Crossing, NONE, NodeContact, StitchContact, Strand, YarnNetwork};

impl YarnNetwork {
    /// Adds another network behind this one; nothing connects the two.
    pub fn append(&mut self, other: &YarnNetwork) {
        let nodes = self.points.len() as u32;
        let strands = self.strands.len() as u32;
        let yarns = self.yarns.len() as u32;
        let materials = self.materials.len() as u32;
        let (crossings, stitches) = (self.crossings.len() as u32, self.stitches.len() as u32);
        let link = |s: u32| if s == NONE { NONE } else { strands + s };
        self.points.extend_from_slice(&other.points);
        self.flat.extend_from_slice(&other.flat);
        self.front.extend_from_slice(&other.front);
        self.contacts.extend(other.contacts.iter().map(|c| match c {
            NodeContact::Rod => NodeContact::Rod,
            NodeContact::Crossing(k) => NodeContact::Crossing(crossings + k),
            NodeContact::StitchA(k) => NodeContact::StitchA(stitches + k),
            NodeContact::StitchB(k) => NodeContact::StitchB(stitches + k),
        }));
        self.strands.extend(other.strands.iter().map(|s| Strand {
            node: nodes + s.node,
            yarn: yarns + s.yarn,
            prev: link(s.prev),
            next: link(s.next),
            ..*s
        }));
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        let ends = other.offsets.iter().skip(1);
        self.offsets.extend(ends.map(|o| strands + o));
        self.yarns.extend(other.yarns.iter().map(|y| crate::Yarn {
            material: materials + y.material,
            first: strands + y.first,
            last: strands + y.last,
            ..*y
        }));
        self.materials.extend_from_slice(&other.materials);
        self.crossings
            .extend(other.crossings.iter().map(|c| Crossing {
                node: nodes + c.node,
                warp: strands + c.warp,
                weft: strands + c.weft,
            }));
        self.stitches
            .extend(other.stitches.iter().map(|c| StitchContact {
                a: nodes + c.a,
                b: nodes + c.b,
                ..*c
            }));
    }

    /// The same network with its nodes in another order; `new_of_old` is a
    /// permutation of the nodes.
    ///
    /// # Panics
    /// If it is not as long as there are nodes, or names one that does not exist.
    #[must_use]
    pub fn renumbered(&self, new_of_old: &[u32]) -> Self {
        let nodes = self.nodes();
        assert_eq!(new_of_old.len(), nodes, "one new number for each node");
        let mut old_of_new = vec![0u32; nodes];
        for (old, &new) in new_of_old.iter().enumerate() {
            old_of_new[new as usize] = old as u32;
        }
        let mut offsets = Vec::with_capacity(nodes + 1);
        offsets.push(0u32);
        let mut place = vec![0u32; self.strands.len()];
        for (new, &old) in old_of_new.iter().enumerate() {
            let first = offsets[new];
            let old = self.strands_of(old);
            for (k, s) in old.clone().enumerate() {
                place[s as usize] = first + k as u32;
            }
            offsets.push(first + old.len() as u32);
        }
        let link = |s: u32| if s == NONE { NONE } else { place[s as usize] };
        let node = |n: u32| new_of_old[n as usize];
        let mut strands = self.strands.clone();
        for (old, s) in self.strands.iter().enumerate() {
            strands[place[old] as usize] = Strand {
                node: node(s.node),
                prev: link(s.prev),
                next: link(s.next),
                ..*s
            };
        }
        Self {
            points: pick(&self.points, &old_of_new),
            flat: pick(&self.flat, &old_of_new),
            front: pick(&self.front, &old_of_new),
            contacts: pick(&self.contacts, &old_of_new),
            strands,
            offsets,
            yarns: self
                .yarns
                .iter()
                .map(|y| crate::Yarn {
                    first: link(y.first),
                    last: link(y.last),
                    ..*y
                })
                .collect(),
            materials: self.materials.clone(),
            crossings: self
                .crossings
                .iter()
                .map(|c| Crossing {
                    node: node(c.node),
                    warp: link(c.warp),
                    weft: link(c.weft),
                })
                .collect(),
            stitches: self
                .stitches
                .iter()
                .map(|c| StitchContact {
                    a: node(c.a),
                    b: node(c.b),
                    ..*c
                })
                .collect(),
        }
    }

    /// Node of every strand: the points at which the arc lengths live.
    pub fn owners(&self) -> Vec<u32> {
        self.strands.iter().map(|s| s.node).collect()
    }

    /// Rest arc length of every strand [m].
    pub fn arcs(&self) -> Vec<f64> {
        self.strands.iter().map(|s| s.arc).collect()
    }
}

fn pick<T: Clone>(all: &[T], old_of_new: &[u32]) -> Vec<T> {
    let picked = old_of_new.iter().map(|&old| all[old as usize].clone());
    picked.collect()
}
