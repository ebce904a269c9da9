//! Nested dissection into parts that the graph alone chooses.

/// Consecutive places: two parts that do not couple, if any, then *own* ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub start: u32,
    pub own: u32,
    pub end: u32,
    pub halves: Option<[u32; 2]>,
}

/// Nodes of a part that is not divided further, at least.
const LEAF: usize = 512;
/// Parts that are not divided, at most: on more processors than that they pay
/// no longer.
const LEAVES: usize = 64;

/// Order of elimination and parts, children before their parents.
///
/// A part is cut in the middle of its nodes' order; those behind the cut with a
/// neighbour before it separate, and come last. In an order of small bandwidth
/// they are few. The order inside of undivided parts is kept, or reversed where
/// it leads away from the separator: elimination towards it drops less.
pub(super) fn dissect(adjacent: &[Vec<u32>]) -> (Vec<u32>, Vec<Part>) {
    let n = adjacent.len();
    let mut d = Dissection {
        adjacent,
        leaf: LEAF.max(n.div_ceil(LEAVES)),
        before: vec![0; n],
        stamp: 0,
        order: Vec::with_capacity(n),
        parts: Vec::new(),
    };
    d.divide((0..n as u32).collect(), false);
    (d.order, d.parts)
}

struct Dissection<'a> {
    adjacent: &'a [Vec<u32>],
    leaf: usize,
    /// The last cut that a node was before.
    before: Vec<u32>,
    stamp: u32,
    order: Vec<u32>,
    parts: Vec<Part>,
}

impl Dissection<'_> {
    /// Index of the part.
    fn divide(&mut self, mut nodes: Vec<u32>, reversed: bool) -> u32 {
        let start = self.order.len() as u32;
        let mut halves = None;
        if let Some((left, right, between)) = self.cut(&nodes) {
            halves = Some([self.divide(left, false), self.divide(right, true)]);
            nodes = between;
        } else if reversed {
            nodes.reverse();
        }
        let own = self.order.len() as u32;
        self.order.append(&mut nodes);
        self.parts.push(Part {
            start,
            own,
            end: self.order.len() as u32,
            halves,
        });
        self.parts.len() as u32 - 1
    }

    /// Two sides and what separates them; none for few nodes, or where the
    /// separator is not small.
    fn cut(&mut self, nodes: &[u32]) -> Option<(Vec<u32>, Vec<u32>, Vec<u32>)> {
        if nodes.len() < 2 * self.leaf {
            return None;
        }
        let (left, rest) = nodes.split_at(nodes.len() / 2);
        self.stamp += 1;
        for &p in left {
            self.before[p as usize] = self.stamp;
        }
        let touches = |p: &u32| {
            let near = &self.adjacent[*p as usize];
            near.iter().any(|&q| self.before[q as usize] == self.stamp)
        };
        let (between, right): (Vec<u32>, Vec<u32>) = rest.iter().partition(|p| touches(p));
        (5 * between.len() < nodes.len()).then(|| (left.to_vec(), right, between))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid in rows: every node once, halves that do not touch each other.
    #[test]
    fn halves_do_not_touch() {
        let (width, height) = (30u32, 200u32);
        let adjacent: Vec<Vec<u32>> = (0..width * height)
            .map(|p| {
                let (i, j) = (p % width, p / width);
                let mut near = Vec::new();
                near.extend((j > 0).then(|| p - width));
                near.extend((i > 0).then(|| p - 1));
                near.extend((i + 1 < width).then_some(p + 1));
                near.extend((j + 1 < height).then_some(p + width));
                near
            })
            .collect();
        let (order, parts) = dissect(&adjacent);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..width * height));
        let mut place = vec![0; order.len()];
        for (k, &p) in order.iter().enumerate() {
            place[p as usize] = k as u32;
        }
        let whole = parts.last().expect("a part");
        assert_eq!((whole.start, whole.end), (0, width * height));
        let mut divided = 0;
        for part in &parts {
            let Some([a, b]) = part.halves.map(|h| h.map(|k| parts[k as usize])) else {
                continue;
            };
            divided += 1;
            assert_eq!((part.start, part.own), (a.start, b.end));
            assert_eq!(a.end, b.start);
            for k in a.start..a.end {
                for &q in &adjacent[order[k as usize] as usize] {
                    assert!(!(b.start..b.end).contains(&place[q as usize]));
                }
            }
        }
        assert!(divided >= 3);
    }
}
