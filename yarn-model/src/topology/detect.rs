use super::{LEAST_GAP, TopologyEvent};
use crate::{NONE, NodeContact, YarnNetwork};

/// What happens to a network whose yarns have slid to `arcs` \[m\], one for every
/// strand, in a fixed order: yarn by yarn, first its ends, then along it.
/// No two events share a node, so that what comes of one of them shows only
/// when asked again. Nodes with `kept` are not taken out.
///
/// | event | when |
/// |---|---|
/// | [`Release`](TopologyEvent::Release) | the yarn's end is nearer than `du_min` to a contact |
/// | [`Draw`](TopologyEvent::Draw) | nearer than `du_min`: the two nodes B of a loop with nothing between |
/// | [`Remove`](TopologyEvent::Remove) | nearer than `du_min`: a node of a single yarn and a neighbour |
///
/// with `du_min` = [`LEAST_GAP`] yarn radii [Cirio2017]. Yarns of which no arc
/// length is free, such as those of a cast-on, leave nothing by themselves.
pub fn changes(
    network: &YarnNetwork,
    arcs: &[f64],
    kept: impl Fn(u32) -> bool,
) -> Vec<TopologyEvent> {
    let mut found = Detection {
        network,
        arcs,
        touched: Vec::new(),
        events: Vec::new(),
    };
    for y in 0..network.yarns.len() as u32 {
        found.ends(y);
        found.along(y, &kept);
    }
    found.events
}

struct Detection<'a> {
    network: &'a YarnNetwork,
    arcs: &'a [f64],
    /// Nodes that an event has; empty before the first.
    touched: Vec<bool>,
    events: Vec<TopologyEvent>,
}

impl Detection<'_> {
    fn node(&self, strand: u32) -> u32 {
        self.network.strands[strand as usize].node
    }

    fn gap(&self, a: u32, b: u32) -> f64 {
        self.arcs[b as usize] - self.arcs[a as usize]
    }

    fn single(&self, strand: u32) -> bool {
        self.network.strands_of(self.node(strand)).len() == 1
    }

    fn least(&self, strand: u32) -> f64 {
        LEAST_GAP * self.network.material_of(strand).radius
    }

    /// Ends of a yarn that pass the contact beside them.
    fn ends(&mut self, yarn: u32) {
        let y = self.network.yarns[yarn as usize];
        let strands = &self.network.strands;
        let ends = [
            (y.first, strands[y.first as usize].next),
            (strands[y.last as usize].prev, y.last),
        ];
        for (end, (a, b)) in ends.into_iter().enumerate() {
            let (tip, beside) = if end == 0 { (a, b) } else { (b, a) };
            if self.gap(a, b) < self.least(tip)
                && self.single(tip)
                && !self.single(beside)
                && !strands[beside as usize].held
            {
                self.add(TopologyEvent::Release { strand: beside });
            }
        }
    }

    fn along(&mut self, yarn: u32, kept: &impl Fn(u32) -> bool) {
        let network = self.network;
        let least = self.least(network.yarns[yarn as usize].first);
        let mut s = network.yarns[yarn as usize].first;
        loop {
            let next = network.strands[s as usize].next;
            if next == NONE {
                return;
            }
            if self.gap(s, next) < least {
                // A tip stays; of two nodes the first goes.
                let goes = |t: u32| {
                    let strand = &network.strands[t as usize];
                    let inner = strand.prev != NONE && strand.next != NONE;
                    inner && self.single(t) && !kept(strand.node)
                };
                if goes(s) {
                    self.add(TopologyEvent::Remove { strand: s });
                } else if goes(next) {
                    self.add(TopologyEvent::Remove { strand: next });
                } else if self.is_drawn(s, next) {
                    self.add(TopologyEvent::Draw { strand: s });
                }
            }
            s = next;
        }
    }

    /// Whether two strands are the two nodes B of one child loop.
    fn is_drawn(&self, s: u32, next: u32) -> bool {
        let n = self.network;
        let contact = |s: u32| match n.contacts[self.node(s) as usize] {
            NodeContact::StitchB(c) => Some(&n.stitches[c as usize]),
            _ => None,
        };
        let (Some(a), Some(b)) = (contact(s), contact(next)) else {
            return false;
        };
        let free = |s: u32| !n.strands[s as usize].held;
        (a.row, a.column) == (b.row, b.column)
            && a.side != b.side
            && n.child_at_b(a) == s
            && n.child_at_b(b) == next
            && free(s)
            && free(next)
    }

    /// Takes an event up, unless another one has a node of it.
    fn add(&mut self, event: TopologyEvent) {
        let nodes = nodes(self.network, event);
        if self.touched.is_empty() {
            self.touched = vec![false; self.network.nodes()];
        }
        if nodes.iter().any(|n| self.touched[*n as usize]) {
            return;
        }
        for n in nodes {
            self.touched[n as usize] = true;
        }
        self.events.push(event);
    }
}

/// Nodes that an event reads or changes.
fn nodes(network: &YarnNetwork, event: TopologyEvent) -> Vec<u32> {
    let strand = |s: u32| &network.strands[s as usize];
    let mut own = vec![strand(event.strand()).node];
    let next = strand(event.strand()).next;
    if let TopologyEvent::Draw { .. } = event {
        own.push(strand(next).node);
    }
    if !matches!(event, TopologyEvent::Remove { .. }) {
        for k in 0..own.len() {
            if let NodeContact::StitchA(c) | NodeContact::StitchB(c) =
                network.contacts[own[k] as usize]
            {
                let contact = &network.stitches[c as usize];
                own.extend([contact.a, contact.b]);
            }
        }
    }
    let around = own.iter().flat_map(|n| network.strands_of(*n));
    let beside = around.flat_map(|s| [strand(s).prev, strand(s).next]);
    let beside: Vec<u32> = beside
        .filter(|s| *s != NONE)
        .map(|s| strand(s).node)
        .collect();
    own.extend(beside);
    own
}
