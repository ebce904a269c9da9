/// Which points are joined by a short way along edges: for every point those
/// with a higher number, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    /// Empty where nothing is near anything.
    start: Vec<u32>,
    above: Vec<u32>,
}

impl Neighbours {
    /// Pairs of points with a way of less than `radius` \[m\] between them; the
    /// lower one has to be `wanted`.
    pub fn within(
        points: usize,
        edges: &[[u32; 2]],
        lengths: &[f64],
        radius: f64,
        wanted: impl Fn(u32) -> bool,
    ) -> Self {
        if edges.is_empty() || radius <= 0.0 {
            return Self::default();
        }
        let (offsets, around) = adjacency(points, edges);
        let mut out = Self {
            start: Vec::with_capacity(points + 1),
            above: Vec::new(),
        };
        out.start.push(0);
        let mut way = vec![f64::INFINITY; points];
        let (mut open, mut reached) = (Vec::new(), Vec::new());
        for p in 0..points as u32 {
            if !wanted(p) {
                out.start.push(out.above.len() as u32);
                continue;
            }
            way[p as usize] = 0.0;
            open.push(p);
            reached.push(p);
            // Label correcting: the set is tiny.
            while let Some(x) = open.pop() {
                let so_far = way[x as usize];
                let range = offsets[x as usize] as usize..offsets[x as usize + 1] as usize;
                for &[y, edge] in &around[range] {
                    let to = so_far + lengths[edge as usize];
                    if to < radius && to < way[y as usize] {
                        if way[y as usize] == f64::INFINITY {
                            reached.push(y);
                        }
                        way[y as usize] = to;
                        open.push(y);
                    }
                }
            }
            let first = out.above.len();
            for x in reached.drain(..) {
                way[x as usize] = f64::INFINITY;
                if x > p {
                    out.above.push(x);
                }
            }
            out.above[first..].sort_unstable();
            out.start.push(out.above.len() as u32);
        }
        out.above.shrink_to_fit();
        out
    }

    /// Whether a point of one edge is near one of the other.
    #[inline]
    pub fn join(&self, a: [u32; 2], b: [u32; 2]) -> bool {
        !self.start.is_empty() && a.iter().any(|x| b.iter().any(|y| self.near(*x, *y)))
    }

    #[inline]
    fn near(&self, a: u32, b: u32) -> bool {
        let low = a.min(b) as usize;
        let range = self.start[low] as usize..self.start[low + 1] as usize;
        a == b || self.above[range].binary_search(&a.max(b)).is_ok()
    }

    pub fn heap_bytes(&self) -> usize {
        4 * (self.start.capacity() + self.above.capacity())
    }
}

/// Points beside each point, with the edges between, in compressed rows.
fn adjacency(points: usize, edges: &[[u32; 2]]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut offsets = vec![0_u32; points + 1];
    for p in edges.as_flattened() {
        offsets[*p as usize + 1] += 1;
    }
    for i in 0..points {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets.clone();
    let mut around = vec![[0; 2]; 2 * edges.len()];
    for (e, &[a, b]) in edges.iter().enumerate() {
        for (from, to) in [(a, b), (b, a)] {
            let slot = &mut next[from as usize];
            around[*slot as usize] = [to, e as u32];
            *slot += 1;
        }
    }
    (offsets, around)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along a chain of points 1 m apart with a shortcut of 0.5 m.
    #[test]
    fn ways_are_shortest() {
        let mut edges: Vec<[u32; 2]> = (1..10).map(|i| [i - 1, i]).collect();
        let mut lengths = vec![1.0; 9];
        edges.push([0, 9]);
        lengths.push(0.5);
        let near = Neighbours::within(10, &edges, &lengths, 2.6, |_| true);
        for a in 0..10_u32 {
            for b in 0..10 {
                let chain = f64::from(a.abs_diff(b));
                let round = f64::from(a.min(b) + 9 - a.max(b)) + 0.5;
                assert_eq!(near.near(a, b), chain.min(round) < 2.6, "{a} {b}");
            }
        }
        assert!(near.join([3, 4], [5, 6]) && near.join([0, 1], [7, 8]));
        assert!(!near.join([0, 1], [4, 5]));
        let of_four = Neighbours::within(10, &edges, &lengths, 2.6, |p| p == 4);
        assert!(of_four.near(4, 6) && !of_four.near(4, 7) && !of_four.near(5, 6));
        let none = Neighbours::within(10, &edges, &lengths, 0.0, |_| true);
        assert!(!none.join([0, 1], [1, 2]));
    }
}
