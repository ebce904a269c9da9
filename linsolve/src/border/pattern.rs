use crate::pattern::fresh_id;

/// Where scalar unknowns couple, with points and among each other.
///
/// Every scalar has an *owner*, the point that it lives at; owners do not
/// descend, so the scalars of a point are consecutive. A scalar's coupling with
/// its owner and with the other scalars of its owner is always present.
#[derive(Debug, Clone)]
pub struct BorderPattern {
    points: usize,
    owners: Vec<u32>,
    /// First scalar of every point, and the number of scalars.
    owned: Vec<u32>,
    /// Compressed rows scalar → points.
    point_offsets: Vec<u32>,
    point_columns: Vec<u32>,
    /// Compressed rows scalar → scalars, columns ascending.
    scalar_offsets: Vec<u32>,
    scalar_columns: Vec<u32>,
    /// Compressed rows point → (scalar, slot of its row above).
    transposed: Vec<u32>,
    transposed_entries: Vec<[u32; 2]>,
    id: u64,
}

impl BorderPattern {
    /// Pattern in which a group of nodes (a stencil) couples all with all; a
    /// group is its nodes and the dimension of each, 3 (a point) or 1 (a
    /// scalar). `owners` holds the point of every scalar.
    ///
    /// # Panics
    /// If owners descend or name a point ≥ `points`, a group names a node that
    /// does not exist, or there are 2³² couplings.
    pub fn from_groups<'a, I>(points: usize, owners: Vec<u32>, groups: I) -> Self
    where
        I: IntoIterator<Item = (&'a [u32], &'a [usize])>,
        I::IntoIter: Clone,
    {
        let scalars = owners.len();
        assert!(owners.is_sorted(), "owners descend");
        assert!(
            owners.last().is_none_or(|&p| (p as usize) < points),
            "an owner does not exist"
        );
        let mut owned = vec![0u32; points + 1];
        for &p in &owners {
            owned[p as usize + 1] += 1;
        }
        for p in 0..points {
            owned[p + 1] += owned[p];
        }
        let groups = groups.into_iter();
        let own_points = owners.iter().map(|&p| vec![p]);
        let own_scalars = owners
            .iter()
            .map(|&p| (owned[p as usize]..owned[p as usize + 1]).collect());
        let (point_offsets, point_columns) = rows(scalars, groups.clone(), 3, points, own_points);
        let (scalar_offsets, scalar_columns) = rows(scalars, groups, 1, scalars, own_scalars);
        let mut transposed = vec![0u32; points + 1];
        for &p in &point_columns {
            transposed[p as usize + 1] += 1;
        }
        for p in 0..points {
            transposed[p + 1] += transposed[p];
        }
        let mut fill = transposed.clone();
        let mut transposed_entries = vec![[0; 2]; point_columns.len()];
        for s in 0..scalars {
            for slot in point_offsets[s]..point_offsets[s + 1] {
                let at = &mut fill[point_columns[slot as usize] as usize];
                transposed_entries[*at as usize] = [s as u32, slot];
                *at += 1;
            }
        }
        Self {
            points,
            owners,
            owned,
            point_offsets,
            point_columns,
            scalar_offsets,
            scalar_columns,
            transposed,
            transposed_entries,
            id: fresh_id(),
        }
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Number of scalars.
    pub fn scalars(&self) -> usize {
        self.owners.len()
    }

    /// Point of every scalar.
    pub fn owners(&self) -> &[u32] {
        &self.owners
    }

    /// Scalars of a point.
    #[inline]
    pub fn owned(&self, point: usize) -> std::ops::Range<usize> {
        self.owned[point] as usize..self.owned[point + 1] as usize
    }

    /// Number of scalar–point couplings.
    pub fn point_count(&self) -> usize {
        self.point_columns.len()
    }

    /// Number of scalar–scalar couplings, both triangles.
    pub fn scalar_count(&self) -> usize {
        self.scalar_columns.len()
    }

    /// Slot of the coupling of a scalar with a point.
    pub fn point_slot(&self, scalar: u32, point: u32) -> Option<u32> {
        find(&self.point_offsets, &self.point_columns, scalar, point)
    }

    /// Slot of entry (row, column) among the scalars.
    pub fn scalar_slot(&self, row: u32, column: u32) -> Option<u32> {
        find(&self.scalar_offsets, &self.scalar_columns, row, column)
    }

    /// Slots of a scalar's couplings with points.
    #[inline]
    pub fn point_row(&self, scalar: usize) -> std::ops::Range<usize> {
        self.point_offsets[scalar] as usize..self.point_offsets[scalar + 1] as usize
    }

    /// Slots of a scalar's couplings with scalars.
    #[inline]
    pub fn scalar_row(&self, scalar: usize) -> std::ops::Range<usize> {
        self.scalar_offsets[scalar] as usize..self.scalar_offsets[scalar + 1] as usize
    }

    /// Point of every scalar–point slot.
    pub fn point_columns(&self) -> &[u32] {
        &self.point_columns
    }

    /// Column of every scalar–scalar slot.
    pub fn scalar_columns(&self) -> &[u32] {
        &self.scalar_columns
    }

    /// Entries of the transposed rows of a point.
    #[inline]
    pub(crate) fn transposed_row(&self, point: usize) -> std::ops::Range<usize> {
        self.transposed[point] as usize..self.transposed[point + 1] as usize
    }

    /// Scalar and slot of every transposed entry.
    pub(crate) fn transposed_entries(&self) -> &[[u32; 2]] {
        &self.transposed_entries
    }

    /// Identity of this pattern: equal ids mean equal patterns, within a process.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Heap memory in bytes.
    pub fn heap_bytes(&self) -> usize {
        let words = [
            &self.owners,
            &self.owned,
            &self.point_offsets,
            &self.point_columns,
            &self.scalar_offsets,
            &self.scalar_columns,
            &self.transposed,
        ];
        4 * words.iter().map(|w| w.capacity()).sum::<usize>()
            + 8 * self.transposed_entries.capacity()
    }
}

fn find(offsets: &[u32], columns: &[u32], row: u32, column: u32) -> Option<u32> {
    let row = row as usize;
    if row + 1 >= offsets.len() {
        return None;
    }
    let (from, to) = (offsets[row] as usize, offsets[row + 1] as usize);
    let at = columns[from..to].binary_search(&column).ok()?;
    Some((from + at) as u32)
}

/// Compressed rows from every scalar to the nodes of one dimension that share
/// a group with it, and to its own.
fn rows<'a>(
    scalars: usize,
    groups: impl Iterator<Item = (&'a [u32], &'a [usize])> + Clone,
    dim: usize,
    nodes: usize,
    own: impl Iterator<Item = Vec<u32>>,
) -> (Vec<u32>, Vec<u32>) {
    let pick = |(group, dims): (&'a [u32], &'a [usize]), dim: usize| {
        let both = group.iter().zip(dims);
        both.filter(move |(_, d)| **d == dim).map(|(n, _)| *n)
    };
    // Entries of each scalar, by counting.
    let mut first = vec![0usize; scalars + 1];
    for group in groups.clone() {
        let count = pick(group, dim).count();
        for s in pick(group, 1) {
            assert!((s as usize) < scalars, "a group names scalar {s}");
            first[s as usize + 1] += count;
        }
    }
    for s in 0..scalars {
        first[s + 1] += first[s];
    }
    let mut fill = first.clone();
    let mut all = vec![0u32; first[scalars]];
    for group in groups {
        for s in pick(group, 1) {
            for n in pick(group, dim) {
                assert!((n as usize) < nodes, "a group names node {n}");
                all[fill[s as usize]] = n;
                fill[s as usize] += 1;
            }
        }
    }
    let mut offsets = Vec::with_capacity(scalars + 1);
    offsets.push(0);
    let mut columns = Vec::new();
    for (s, mut row) in own.enumerate() {
        row.extend_from_slice(&all[first[s]..first[s + 1]]);
        row.sort_unstable();
        row.dedup();
        columns.extend_from_slice(&row);
        offsets.push(u32::try_from(columns.len()).expect("fewer than 2^32 couplings"));
    }
    (offsets, columns)
}
