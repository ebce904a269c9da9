//! Which stencils may be scattered at the same time.

use std::ops::Range;

/// Consecutive stencils in chunks, chunks in colours.
///
/// Chunks of one colour share no point, so threads may add their blocks to one
/// value array with plain loads and stores
/// ([`SharedValues`](crate::SharedValues)); colours run one after the other.
/// The order of the additions to a block is the order of (colour, stencil) for
/// any number of threads. Keeping neighbours together keeps the blocks of a
/// chunk in cache, which colours of single stencils do not.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChunkColouring {
    /// Stencils of each chunk.
    pub chunks: Vec<Range<u32>>,
    /// Chunks of each colour, ascending.
    pub colours: Vec<Vec<u32>>,
}

/// Colours chunks of at most `size` consecutive stencils, each with the lowest
/// colour that none of its points carries yet.
///
/// Number the points first so that neighbours are close
/// ([`reverse_cuthill_mckee`](crate::reverse_cuthill_mckee)) and sort the
/// stencils accordingly: scattered stencils make every chunk touch every other.
///
/// # Panics
/// If `size` is 0, a stencil names a point ≥ `points`, or there are 2³²
/// stencils.
pub fn colour_chunks<'a>(
    points: usize,
    stencils: impl IntoIterator<Item = &'a [u32]>,
    size: usize,
) -> ChunkColouring {
    assert!(size > 0, "a chunk holds at least one stencil");
    let mut out = ChunkColouring::default();
    let mut masks = Masks::new(points);
    let (mut nodes, mut count, mut start) = (Vec::new(), 0u32, 0u32);
    let mut close = |nodes: &mut Vec<u32>, chunk: Range<u32>| {
        nodes.sort_unstable();
        nodes.dedup();
        let colour = masks.take(nodes);
        if colour == out.colours.len() {
            out.colours.push(Vec::new());
        }
        out.colours[colour].push(out.chunks.len() as u32);
        out.chunks.push(chunk);
        nodes.clear();
    };
    for stencil in stencils {
        nodes.extend_from_slice(stencil);
        count = count.checked_add(1).expect("fewer than 2^32 stencils");
        if (count - start) as usize == size {
            close(&mut nodes, start..count);
            start = count;
        }
    }
    if start < count {
        close(&mut nodes, start..count);
    }
    out
}

/// Order in which single stencils choose their colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourOrder {
    /// As they come.
    Natural,
    /// Most neighbours first \[WelshPowell1967\].
    LargestFirst,
    /// The one with the fewest remaining neighbours last, repeatedly: on
    /// meshes usually optimal \[MatulaBeck1983\].
    #[default]
    SmallestLast,
}

/// Stencils in colours: no two of a colour share a point.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Colouring {
    /// Stencils of each colour, ascending.
    pub colours: Vec<Vec<u32>>,
    /// Most stencils at one point: no colouring has fewer colours.
    pub lower_bound: usize,
}

/// Colours single stencils greedily.
///
/// # Panics
/// If a stencil names a point ≥ `points`.
pub fn colour_stencils<'a>(
    points: usize,
    stencils: impl IntoIterator<Item = &'a [u32]>,
    order: ColourOrder,
) -> Colouring {
    let graph = Graph::new(points, stencils);
    let n = graph.starts.len() - 1;
    let sequence: Vec<u32> = match order {
        ColourOrder::Natural => (0..n as u32).collect(),
        ColourOrder::LargestFirst => {
            let degrees = graph.degrees();
            let mut all: Vec<u32> = (0..n as u32).collect();
            all.sort_by_key(|&e| std::cmp::Reverse(degrees[e as usize]));
            all
        }
        ColourOrder::SmallestLast => graph.smallest_last(),
    };
    let mut out = Colouring {
        colours: Vec::new(),
        lower_bound: graph.incident.iter().map(Vec::len).max().unwrap_or(0),
    };
    let mut masks = Masks::new(points);
    for e in sequence {
        let colour = masks.take(graph.nodes(e));
        if colour == out.colours.len() {
            out.colours.push(Vec::new());
        }
        out.colours[colour].push(e);
    }
    for colour in &mut out.colours {
        colour.sort_unstable();
    }
    out
}

/// Colours carried by each point, as bits.
struct Masks {
    words: usize,
    bits: Vec<u64>,
    points: usize,
}

impl Masks {
    fn new(points: usize) -> Self {
        Self {
            words: 1,
            bits: vec![0; points],
            points,
        }
    }

    /// Lowest colour free on all nodes, marked as used on them.
    fn take(&mut self, nodes: &[u32]) -> usize {
        let free = |bits: &[u64], words: usize, word: usize| {
            !nodes
                .iter()
                .fold(0, |m, &p| m | bits[p as usize * words + word])
        };
        let found = (0..self.words).find_map(|word| {
            let free = free(&self.bits, self.words, word);
            (free != 0).then(|| 64 * word + free.trailing_zeros() as usize)
        });
        let colour = found.unwrap_or_else(|| {
            let old = self.words;
            self.grow();
            64 * old
        });
        for &p in nodes {
            self.bits[p as usize * self.words + colour / 64] |= 1 << (colour % 64);
        }
        colour
    }

    /// One more word for each point: a hub with over 64 stencils.
    fn grow(&mut self) {
        let words = self.words + 1;
        let mut bits = vec![0; self.points * words];
        for (new, old) in bits
            .chunks_exact_mut(words)
            .zip(self.bits.chunks_exact(self.words))
        {
            new[..self.words].copy_from_slice(old);
        }
        (self.words, self.bits) = (words, bits);
    }
}

struct Graph {
    starts: Vec<usize>,
    nodes: Vec<u32>,
    incident: Vec<Vec<u32>>,
}

impl Graph {
    fn new<'a>(points: usize, stencils: impl IntoIterator<Item = &'a [u32]>) -> Self {
        let (mut starts, mut nodes) = (vec![0], Vec::new());
        let mut incident = vec![Vec::new(); points];
        for (e, stencil) in stencils.into_iter().enumerate() {
            nodes.extend_from_slice(stencil);
            starts.push(nodes.len());
            for &p in stencil {
                // a stencil may name a point twice
                if incident[p as usize].last() != Some(&(e as u32)) {
                    incident[p as usize].push(e as u32);
                }
            }
        }
        Self {
            starts,
            nodes,
            incident,
        }
    }

    fn nodes(&self, e: u32) -> &[u32] {
        &self.nodes[self.starts[e as usize]..self.starts[e as usize + 1]]
    }

    /// Distinct stencils that share a point with `e`, itself left out.
    fn neighbours(&self, e: u32, out: &mut Vec<u32>) {
        out.clear();
        for &p in self.nodes(e) {
            out.extend_from_slice(&self.incident[p as usize]);
        }
        out.sort_unstable();
        out.dedup();
        out.retain(|&n| n != e);
    }

    fn degrees(&self) -> Vec<usize> {
        let mut list = Vec::new();
        (0..self.starts.len() - 1)
            .map(|e| {
                self.neighbours(e as u32, &mut list);
                list.len()
            })
            .collect()
    }

    fn smallest_last(&self) -> Vec<u32> {
        let mut degree = self.degrees();
        let most = degree.iter().copied().max().unwrap_or(0);
        // buckets by remaining degree; stale entries are skipped
        let mut buckets = vec![Vec::new(); most + 1];
        for (e, &d) in degree.iter().enumerate().rev() {
            buckets[d].push(e as u32);
        }
        let (mut removed, mut order) = (vec![false; degree.len()], Vec::new());
        let (mut at, mut list) = (0, Vec::new());
        while at < buckets.len() {
            let Some(e) = buckets[at].pop() else {
                at += 1;
                continue;
            };
            if removed[e as usize] || degree[e as usize] != at {
                continue;
            }
            removed[e as usize] = true;
            order.push(e);
            self.neighbours(e, &mut list);
            for &n in &list {
                if !removed[n as usize] {
                    let d = &mut degree[n as usize];
                    *d -= 1;
                    buckets[*d].push(n);
                    at = at.min(*d);
                }
            }
        }
        order.reverse();
        order
    }
}
