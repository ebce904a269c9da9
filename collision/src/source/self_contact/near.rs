use std::ops::Range;

use super::bounds::Moves;

/// Candidates that may be in contact around one place, by chunks of all of
/// them: evaluations of a step are close together and need look at no others.
#[derive(Clone, Debug, Default)]
pub(super) struct Near {
    list: Vec<u32>,
    /// Where the part of every chunk ends.
    ends: Vec<u32>,
    /// Ways of the points at that place [m].
    moved: Vec<[f32; 3]>,
    /// By how much pairs may come closer than there [m]; none without a list.
    room: Option<f32>,
}

impl Near {
    /// Forgets the list: candidates, their bounds or what they remember are
    /// others.
    pub fn clear(&mut self) {
        self.room = None;
    }

    /// Begins a list for places where no pair is closer than at `moves` by
    /// more than `room` [m].
    pub fn begin(&mut self, moves: &Moves, room: f32) {
        self.list.clear();
        self.ends.clear();
        self.moved.clear();
        self.moved.extend_from_slice(moves.ways());
        self.room = Some(room);
    }

    /// Adds the next chunk.
    pub fn push(&mut self, chunk: &[u32]) {
        self.list.extend_from_slice(chunk);
        self.ends.push(self.list.len() as u32);
    }

    /// Whether the list is good for other ways from the same start.
    pub fn holds(&self, moves: &Moves) -> bool {
        let Some(room) = self.room else { return false };
        let each = 0.5 * (room - moves.slack());
        let limit = if each > 0.0 { each * each } else { -1.0 };
        let mut both = self.moved.iter().zip(moves.ways());
        both.all(|(a, b)| {
            let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
            d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= limit
        })
    }

    /// Candidates of a chunk.
    pub fn of(&self, chunk: usize) -> &[u32] {
        let from = chunk.checked_sub(1).map_or(0, |c| self.ends[c]);
        &self.list[from as usize..self.ends[chunk] as usize]
    }

    pub fn heap_bytes(&self) -> usize {
        4 * (self.list.capacity() + self.ends.capacity()) + 12 * self.moved.capacity()
    }
}

/// Candidates that one task looks at.
#[derive(Clone, Debug)]
pub(super) enum Visit<'a> {
    All(Range<usize>),
    Near(std::slice::Iter<'a, u32>),
}

impl Iterator for Visit<'_> {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        match self {
            Self::All(range) => range.next(),
            Self::Near(list) => list.next().map(|i| *i as usize),
        }
    }
}
