/// Sorts pairs by counting their first index, then row by row: linear time for
/// the short rows that meshes give. Equal pairs must not occur.
#[derive(Clone, Debug)]
pub(super) struct RowSorter<T> {
    next: Vec<u32>,
    sorted: Vec<T>,
}

impl<T> Default for RowSorter<T> {
    fn default() -> Self {
        Self {
            next: Vec::new(),
            sorted: Vec::new(),
        }
    }
}

impl<T: Copy + Default> RowSorter<T> {
    pub fn sort(&mut self, items: &mut Vec<T>, rows: usize, pair: impl Fn(&T) -> [u32; 2]) {
        if items.len() > u32::MAX as usize {
            items.sort_unstable_by_key(pair);
            return;
        }
        self.next.clear();
        self.next.resize(rows + 1, 0);
        for item in items.iter() {
            self.next[pair(item)[0] as usize + 1] += 1;
        }
        for i in 0..rows {
            self.next[i + 1] += self.next[i];
        }
        self.sorted.clear();
        self.sorted.resize(items.len(), T::default());
        for item in items.iter() {
            let slot = &mut self.next[pair(item)[0] as usize];
            self.sorted[*slot as usize] = *item;
            *slot += 1;
        }
        let mut from = 0;
        for end in &self.next[..rows] {
            let end = *end as usize;
            self.sorted[from..end].sort_unstable_by_key(|item| pair(item)[1]);
            from = end;
        }
        std::mem::swap(items, &mut self.sorted);
    }

    pub fn heap_bytes(&self) -> usize {
        4 * self.next.capacity() + size_of::<T>() * self.sorted.capacity()
    }
}
