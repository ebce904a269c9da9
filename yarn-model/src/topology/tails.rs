use crate::{NONE, NodeContact, Strand, YarnNetwork};

impl YarnNetwork {
    /// Gives every yarn that ends in a contact a free end of a length \[m\]
    /// beyond it, straight on, so that the contact can slide to the end. Yarns of
    /// which no arc length is free, such as those of a cast-on, stay as they are.
    #[must_use]
    pub fn with_tails(&self, length: f64) -> Self {
        let mut n = self.clone();
        for y in 0..n.yarns.len() as u32 {
            if self.along(y).all(|s| self.strands[s as usize].held) {
                continue;
            }
            let Strand { next, .. } = self.strands[self.yarns[y as usize].first as usize];
            let Strand { prev, .. } = self.strands[self.yarns[y as usize].last as usize];
            n.add_tail(self.yarns[y as usize].first, next, -length);
            n.add_tail(self.yarns[y as usize].last, prev, length);
        }
        n
    }

    /// Extends a yarn beyond its end by an arc length, against the way where it
    /// is negative.
    fn add_tail(&mut self, end: u32, inside: u32, length: f64) {
        let tip = self.strands[end as usize];
        if self.contacts[tip.node as usize] == NodeContact::Rod {
            return;
        }
        let at = tip.node as usize;
        let (x, from) = (
            self.points[at],
            self.points[self.strands[inside as usize].node as usize],
        );
        let way: [f64; 3] = std::array::from_fn(|i| x[i] - from[i]);
        let size = way[0].hypot(way[1]).hypot(way[2]);
        // A yarn may lie back on itself; then its end has no direction.
        let scale = if size > 0.0 { length.abs() / size } else { 0.0 };
        let (node, strand) = (self.nodes() as u32, self.strands.len() as u32);
        self.points
            .push(std::array::from_fn(|i| x[i] + scale * way[i]));
        let flat = self.flat[at];
        self.flat
            .push([flat[0] + scale * way[0], flat[1] + scale * way[1]]);
        self.front.push(self.front[at]);
        self.contacts.push(NodeContact::Rod);
        self.strands[end as usize].held = false;
        let yarn = &mut self.yarns[tip.yarn as usize];
        yarn.strands += 1;
        let (mut prev, mut next) = (NONE, NONE);
        if length > 0.0 {
            yarn.last = strand;
            self.strands[end as usize].next = strand;
            prev = end;
        } else {
            yarn.first = strand;
            self.strands[end as usize].prev = strand;
            next = end;
        }
        self.strands.push(Strand {
            node,
            yarn: tip.yarn,
            prev,
            next,
            arc: tip.arc + length,
            held: true,
        });
        self.offsets.push(strand + 1);
    }
}
