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
/// Share of a part's nodes on either side of a cut, at least.
const SIDE: f64 = 0.2;
/// How far behind its first neighbour a node is out of place, in medians of that
/// distance.
const LATE: usize = 2;

/// Order of elimination and parts, children before their parents.
///
/// A part is cut where the fewest nodes behind the cut have a neighbour before
/// it, if these are at most half as many as at the median cut: between the panels
/// of a garment. They separate, and come last. Elsewhere a cut costs more than it
/// gains: along a separator elimination leaves fill of high level, and dropping it
/// spoils pivots (a knitted garment cut into 4 equal parts needs a diagonal shift
/// of 1.6e-2 and 65 iterations, at its seams one of 2.5e-4 and 10). The order inside
/// of parts is kept for the same reason.
///
/// What is not divided begins with the nodes that are out of place: rods along
/// borders, which are numbered after the panel. Eliminated last, each of them would
/// keep a coupling with every yarn that begins at it, of a level that grows along the
/// yarn: dropping it spoils the pivots of the rod. A rod that comes first is a chain,
/// almost without fill, and every yarn goes on from it in its own order.
pub(super) fn dissect(adjacent: &[Vec<u32>]) -> (Vec<u32>, Vec<Part>) {
    let n = adjacent.len();
    let mut d = Dissection {
        adjacent,
        local: vec![u32::MAX; n],
        order: Vec::with_capacity(n),
        parts: Vec::new(),
    };
    d.divide((0..n as u32).collect());
    if d.parts.len() == 1 {
        d.order = late_first(adjacent);
    }
    (d.order, d.parts)
}

/// All nodes, those first that lie far behind their first neighbour or couple with
/// such nodes alone; otherwise in their order.
fn late_first(adjacent: &[Vec<u32>]) -> Vec<u32> {
    let behind =
        |(i, near): (usize, &Vec<u32>)| i - near.iter().fold(i, |first, &q| first.min(q as usize));
    let behind: Vec<usize> = adjacent.iter().enumerate().map(behind).collect();
    let mut sorted = behind.clone();
    sorted.sort_unstable();
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
    let far = |i: u32| behind[i as usize] > LATE * median;
    let late = |&i: &u32| {
        let near = &adjacent[i as usize];
        far(i) || (!near.is_empty() && near.iter().all(|&q| far(q)))
    };
    let (mut order, rest): (Vec<u32>, Vec<u32>) = (0..adjacent.len() as u32).partition(late);
    order.extend(rest);
    order
}

struct Dissection<'a> {
    adjacent: &'a [Vec<u32>],
    /// Place of every node in the part at hand, `u32::MAX` outside of it.
    local: Vec<u32>,
    order: Vec<u32>,
    parts: Vec<Part>,
}

impl Dissection<'_> {
    /// Index of the part.
    fn divide(&mut self, mut nodes: Vec<u32>) -> u32 {
        let start = self.order.len() as u32;
        let mut halves = None;
        if let Some((left, right, between)) = self.cut(&nodes) {
            halves = Some([self.divide(left), self.divide(right)]);
            nodes = between;
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

    /// Two sides and what separates them; none for few nodes, or without a place
    /// where little separates.
    fn cut(&mut self, nodes: &[u32]) -> Option<(Vec<u32>, Vec<u32>, Vec<u32>)> {
        let n = nodes.len();
        if n < 2 * LEAF {
            return None;
        }
        for (k, &p) in nodes.iter().enumerate() {
            self.local[p as usize] = k as u32;
        }
        let first: Vec<usize> = nodes.iter().map(|&p| self.first_neighbour(p)).collect();
        for &p in nodes {
            self.local[p as usize] = u32::MAX;
        }
        // a node separates at the cuts behind its first neighbour up to itself
        let mut change = vec![0i64; n + 1];
        for (k, &first) in first.iter().enumerate() {
            if first < k {
                change[first + 1] += 1;
                change[k + 1] -= 1;
            }
        }
        let sizes = change.iter().scan(0, |size, c| {
            *size += c;
            Some(*size)
        });
        let margin = (SIDE * n as f64) as usize;
        let sizes: Vec<i64> = sizes.take(n - margin).skip(margin).collect();
        let (at, &least) = sizes.iter().enumerate().min_by_key(|e| e.1)?;
        let mut sorted = sizes.clone();
        let (_, &mut median, _) = sorted.select_nth_unstable(sizes.len() / 2);
        if 2 * least > median {
            return None;
        }
        let at = margin + at;
        let mut sides = (nodes[..at].to_vec(), Vec::new(), Vec::new());
        for (&p, &first) in nodes[at..].iter().zip(&first[at..]) {
            if first < at {
                sides.2.push(p);
            } else {
                sides.1.push(p);
            }
        }
        Some(sides)
    }

    /// Place in the part at hand of the first of a node's neighbours there, or of
    /// the node itself.
    fn first_neighbour(&self, node: u32) -> usize {
        let near = self.adjacent[node as usize].iter();
        let places = near.map(|&q| self.local[q as usize]);
        places.fold(self.local[node as usize], u32::min) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four grids in rows, each joined to the one before at five nodes: every node
    /// once, cut between grids, halves that do not touch each other.
    #[test]
    fn cuts_lie_where_little_separates() {
        let (width, height, grids) = (30u32, 50u32, 4u32);
        let size = width * height;
        let n = size * grids;
        let mut adjacent = vec![Vec::new(); n as usize];
        let mut join = |p: u32, q: u32| {
            adjacent[p as usize].push(q);
            adjacent[q as usize].push(p);
        };
        for grid in 0..grids {
            for k in 0..size {
                let p = grid * size + k;
                if k % width > 0 {
                    join(p, p - 1);
                }
                if k >= width {
                    join(p, p - width);
                }
                if grid > 0 && k % width < 5 && k < width {
                    join(p, p - width);
                }
            }
        }
        let (order, parts) = dissect(&adjacent);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..n));
        let mut place = vec![0; order.len()];
        for (k, &p) in order.iter().enumerate() {
            place[p as usize] = k as u32;
        }
        let whole = parts.last().expect("a part");
        assert_eq!((whole.start, whole.end), (0, n));
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
        assert_eq!(divided, 3);
        // within one grid every cut separates alike
        let one: Vec<_> = adjacent[..size as usize].to_vec();
        let inside = |near: &Vec<u32>| near.iter().copied().filter(|&q| q < size).collect();
        let one: Vec<Vec<u32>> = one.iter().map(inside).collect();
        let (order, parts) = dissect(&one);
        assert_eq!(parts.len(), 1);
        assert!(order.into_iter().eq(0..size));
    }

    /// A grid in rows with a rod of nodes at the beginnings of all rows but the last
    /// three, numbered last: the rod is eliminated first, and the grid in its order.
    /// Every fifth node of the rod has no row.
    #[test]
    fn rods_come_first() {
        let (width, height) = (10u32, 40u32);
        let size = width * height;
        let mut adjacent = vec![Vec::new(); size as usize];
        let mut join = |p: u32, q: u32| {
            let n = adjacent.len().max(p.max(q) as usize + 1);
            adjacent.resize(n, Vec::new());
            adjacent[p as usize].push(q);
            adjacent[q as usize].push(p);
        };
        for k in 0..size {
            if k % width > 0 {
                join(k, k - 1);
            }
            if k >= width {
                join(k, k - width);
            }
        }
        let mut rod = size;
        for row in 0..height - 3 {
            for spare in [false, true] {
                if spare && row % 4 != 3 {
                    continue;
                }
                for back in 1..=(rod - size).min(2) {
                    join(rod, rod - back);
                }
                if !spare {
                    join(rod, row * width);
                }
                rod += 1;
            }
        }
        let (order, parts) = dissect(&adjacent);
        assert_eq!(parts.len(), 1);
        assert!(order.into_iter().eq((size..rod).chain(0..size)));
    }
}
