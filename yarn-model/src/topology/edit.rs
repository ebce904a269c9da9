use super::TopologyEvent;
use crate::{Crossing, NONE, NodeContact, StitchContact, Strand, Yarn, YarnError, YarnNetwork};

/// A network after events, and where its parts come from.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The network.
    pub network: YarnNetwork,
    /// The node that every node was, or was part of; for a new end the node
    /// before the cut.
    pub node_from: Vec<u32>,
    /// The strand that every strand was; [`NONE`] for the ends of a cut.
    pub strand_from: Vec<u32>,
    /// The stitch contact that every stitch contact was.
    pub stitch_from: Vec<u32>,
    /// The two new ends of every cut, and the strands before and after it.
    pub cuts: Vec<[u32; 4]>,
    /// Strands taken out, with those before and after them.
    pub removed: Vec<[u32; 3]>,
}

/// Strands at one place.
struct Group {
    from: u32,
    strands: Vec<u32>,
}

/// A network under change, by the numbers of the old one; ends of cuts follow.
struct Edit<'a> {
    old: &'a YarnNetwork,
    strands: Vec<Strand>,
    from: Vec<u32>,
    groups: Vec<Group>,
    /// Group of every strand.
    group: Vec<u32>,
    crossings: Vec<bool>,
    stitches: Vec<Option<StitchContact>>,
    yarns: Vec<Yarn>,
    cuts: Vec<[u32; 4]>,
    removed: Vec<[u32; 3]>,
}

impl Change {
    /// Makes events happen; see [`TopologyEvent`]. What depends on positions is
    /// left to [`carry`](Self::carry), so that the same events give the same
    /// network.
    ///
    /// # Errors
    /// [`YarnError::OutOfRange`] for an event that names a strand that does not
    /// exist or has nothing of the kind.
    pub fn new(old: &YarnNetwork, events: &[TopologyEvent]) -> Result<Self, YarnError> {
        let mut edit = Edit::new(old);
        for event in events {
            let index = event.strand() as usize;
            let possible = index < old.strands.len() && edit.apply(*event);
            if !possible {
                return Err(YarnError::OutOfRange {
                    what: "change of strand",
                    index,
                    count: old.strands.len(),
                });
            }
        }
        Ok(edit.finish())
    }
}

impl<'a> Edit<'a> {
    fn new(old: &'a YarnNetwork) -> Self {
        let groups = (0..old.nodes() as u32).map(|from| Group {
            from,
            strands: old.strands_of(from).collect(),
        });
        Self {
            strands: old.strands.clone(),
            from: (0..old.strands.len() as u32).collect(),
            groups: groups.collect(),
            group: old.strands.iter().map(|s| s.node).collect(),
            crossings: vec![true; old.crossings.len()],
            stitches: old.stitches.iter().copied().map(Some).collect(),
            yarns: old.yarns.clone(),
            cuts: Vec::new(),
            removed: Vec::new(),
            old,
        }
    }

    fn apply(&mut self, event: TopologyEvent) -> bool {
        match event {
            TopologyEvent::Release { strand } => self.release(strand),
            TopologyEvent::Draw { strand } => {
                let next = self.strands[strand as usize].next;
                next != NONE && self.release(strand) && self.release(next)
            }
            TopologyEvent::Remove { strand } => self.remove(strand),
            TopologyEvent::Cut { strand } => self.cut(strand),
        }
    }

    /// A yarn leaves the contact of one of its strands.
    fn release(&mut self, strand: u32) -> bool {
        let node = self.old.strands[strand as usize].node;
        let c = match self.old.contacts[node as usize] {
            NodeContact::Rod => return false,
            NodeContact::Crossing(c) => {
                self.crossings[c as usize] = false;
                self.part(node);
                return true;
            }
            NodeContact::StitchA(c) | NodeContact::StitchB(c) => c,
        };
        let Some(contact) = self.stitches[c as usize] else {
            return true;
        };
        let there = if node == contact.a {
            contact.b
        } else {
            contact.a
        };
        let known = |s: &u32| *s != NONE && self.strands[*s as usize].node == there;
        let s = &self.strands[strand as usize];
        let sibling = [s.next, s.prev].into_iter().find(known);
        let child =
            strand == self.old.child_at_a(&contact) || strand == self.old.child_at_b(&contact);
        match sibling {
            // A parent of several: the others stay.
            Some(sibling) if !child && contact.parents > 1 => {
                self.leave(strand);
                self.leave(sibling);
                self.stitches[c as usize] = Some(StitchContact {
                    parents: contact.parents - 1,
                    ..contact
                });
            }
            _ => {
                self.stitches[c as usize] = None;
                self.part(contact.a);
                self.part(contact.b);
            }
        }
        true
    }

    /// Every strand of a node gets a place of its own.
    fn part(&mut self, node: u32) {
        let strands = self.groups[node as usize].strands.clone();
        for (k, s) in strands.into_iter().enumerate() {
            self.strands[s as usize].held = true;
            if k > 0 {
                self.leave(s);
            }
        }
    }

    /// A strand gets a place of its own.
    fn leave(&mut self, strand: u32) {
        let group = self.group[strand as usize] as usize;
        let from = self.groups[group].from;
        self.groups[group].strands.retain(|s| *s != strand);
        self.strands[strand as usize].held = true;
        self.group[strand as usize] = self.groups.len() as u32;
        self.groups.push(Group {
            from,
            strands: vec![strand],
        });
    }

    fn remove(&mut self, strand: u32) -> bool {
        let Strand { prev, next, .. } = self.strands[strand as usize];
        let group = self.group[strand as usize] as usize;
        if prev == NONE || next == NONE || self.groups[group].strands != [strand] {
            return false;
        }
        self.strands[prev as usize].next = next;
        self.strands[next as usize].prev = prev;
        self.groups[group].strands.clear();
        self.removed.push([strand, prev, next]);
        true
    }

    fn cut(&mut self, strand: u32) -> bool {
        let next = self.strands[strand as usize].next;
        if next == NONE {
            return false;
        }
        let (a, b) = (self.strands[strand as usize], self.strands[next as usize]);
        let (end, start) = (self.strands.len() as u32, self.strands.len() as u32 + 1);
        let yarn = self.yarns.len() as u32;
        let arc = 0.5 * (a.arc + b.arc);
        for (own, prev, after) in [(a.yarn, strand, NONE), (yarn, NONE, next)] {
            self.group.push(self.groups.len() as u32);
            self.groups.push(Group {
                from: self.groups[self.group[strand as usize] as usize].from,
                strands: vec![self.strands.len() as u32],
            });
            self.from.push(NONE);
            self.strands.push(Strand {
                node: NONE,
                yarn: own,
                prev,
                next: after,
                arc,
                held: true,
            });
        }
        self.strands[strand as usize].next = end;
        self.strands[next as usize].prev = start;
        let old = self.yarns[a.yarn as usize];
        self.yarns[a.yarn as usize].last = end;
        self.yarns.push(Yarn {
            first: start,
            ..old
        });
        let mut s = next;
        while s != NONE {
            self.strands[s as usize].yarn = yarn;
            s = self.strands[s as usize].next;
        }
        self.cuts.push([end, start, strand, next]);
        true
    }

    /// Numbers everything anew: new nodes behind those that they come from.
    fn finish(self) -> Change {
        let mut order: Vec<u32> = (0..self.groups.len() as u32).collect();
        order.retain(|g| !self.groups[*g as usize].strands.is_empty());
        order.sort_by_key(|g| (self.groups[*g as usize].from, *g));
        let mut offsets = vec![0];
        let mut place = vec![NONE; self.strands.len()];
        let mut strands = Vec::with_capacity(self.strands.len());
        let mut strand_from = Vec::with_capacity(self.strands.len());
        // New node of an old one's first group.
        let mut node_of = vec![NONE; self.old.nodes()];
        for (node, &g) in order.iter().enumerate() {
            if let Some(kept) = node_of.get_mut(g as usize) {
                *kept = node as u32;
            }
            for &s in &self.groups[g as usize].strands {
                place[s as usize] = strands.len() as u32;
                strand_from.push(self.from[s as usize]);
                strands.push(Strand {
                    node: node as u32,
                    ..self.strands[s as usize]
                });
            }
            offsets.push(strands.len() as u32);
        }
        let link = |s: u32| if s == NONE { NONE } else { place[s as usize] };
        for s in &mut strands {
            (s.prev, s.next) = (link(s.prev), link(s.next));
        }
        let node_from: Vec<u32> = order
            .iter()
            .map(|g| self.groups[*g as usize].from)
            .collect();
        let mut contacts = vec![NodeContact::Rod; order.len()];
        let (mut crossings, mut stitches, mut stitch_from) = (Vec::new(), Vec::new(), Vec::new());
        for (c, _) in self
            .old
            .crossings
            .iter()
            .zip(&self.crossings)
            .filter(|(_, on)| **on)
        {
            let node = node_of[c.node as usize];
            contacts[node as usize] = NodeContact::Crossing(crossings.len() as u32);
            crossings.push(Crossing {
                node,
                warp: link(c.warp),
                weft: link(c.weft),
            });
        }
        for (old, contact) in self.stitches.iter().enumerate() {
            let Some(contact) = contact else { continue };
            let index = stitches.len() as u32;
            let (a, b) = (node_of[contact.a as usize], node_of[contact.b as usize]);
            contacts[a as usize] = NodeContact::StitchA(index);
            contacts[b as usize] = NodeContact::StitchB(index);
            stitches.push(StitchContact { a, b, ..*contact });
            stitch_from.push(old as u32);
        }
        let mut network = YarnNetwork {
            points: picked(&self.old.points, &node_from),
            flat: picked(&self.old.flat, &node_from),
            front: picked(&self.old.front, &node_from),
            contacts,
            strands,
            offsets,
            yarns: self
                .yarns
                .iter()
                .map(|y| Yarn {
                    first: link(y.first),
                    last: link(y.last),
                    ..*y
                })
                .collect(),
            materials: self.old.materials.clone(),
            crossings,
            stitches,
        };
        for y in 0..network.yarns.len() {
            network.yarns[y].strands = network.along(y as u32).count() as u32;
        }
        for [end, start, s, n] in &self.cuts {
            let ends = [*s, *n].map(|s| network.strands[link(s) as usize].node as usize);
            let [a, b] = ends.map(|n| network.points[n]);
            let [p, r] = ends.map(|n| network.flat[n]);
            for new in [end, start] {
                let node = network.strands[link(*new) as usize].node as usize;
                network.points[node] = std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
                network.flat[node] = std::array::from_fn(|i| 0.5 * (p[i] + r[i]));
            }
        }
        let cuts = self.cuts.iter();
        Change {
            cuts: cuts
                .map(|[e, f, s, n]| [link(*e), link(*f), *s, *n])
                .collect(),
            network,
            node_from,
            strand_from,
            stitch_from,
            removed: self.removed,
        }
    }
}

fn picked<T: Copy>(all: &[T], from: &[u32]) -> Vec<T> {
    from.iter().map(|f| all[*f as usize]).collect()
}
