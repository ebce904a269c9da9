//! Order of elimination, and where the blocks of a factor lie.

use std::collections::BTreeSet;
use std::ops::Range;

use super::parts::{Part, dissect};
use crate::{BorderPattern, Pattern};

/// Lower triangle of node blocks by rows, in the order of elimination.
///
/// *Places* number the nodes in that order. The values of a row are its strictly
/// lower blocks, columns ascending, then the packed inverse of its diagonal
/// block.
#[derive(Debug, Clone, Default)]
pub(super) struct Plan {
    /// Point at every place.
    pub points: Vec<u32>,
    /// Place of every point.
    pub places: Vec<u32>,
    /// First unknown of every place in node order, and their number.
    pub first: Vec<u32>,
    /// First scalar of every place's point.
    pub scalars: Vec<u32>,
    /// Strictly lower blocks of every row.
    pub starts: Vec<u32>,
    pub columns: Vec<u32>,
    /// First value of every row, and their number.
    pub values: Vec<u32>,
    /// What can be eliminated side by side; the last one is the whole.
    pub parts: Vec<Part>,
}

impl Plan {
    /// `level` of fill: an entry that elimination makes from entries of levels
    /// `a` and `b` has level `a + b + 1`, and is kept up to `level`.
    pub(super) fn new(points: &Pattern, border: Option<&BorderPattern>, level: usize) -> Self {
        let adjacent = neighbours(points, border);
        let n = adjacent.len();
        let (order, parts) = dissect(&adjacent);
        let mut places = vec![0; n];
        for (place, &p) in order.iter().enumerate() {
            places[p as usize] = place as u32;
        }
        let mut plan = Self {
            points: order,
            places,
            parts,
            first: vec![0],
            ..Self::default()
        };
        let mut at = 0;
        for &p in &plan.points {
            let owned = border.map_or(0..0, |b| b.owned(p as usize));
            at += 3 + owned.len() as u32;
            plan.first.push(at);
            plan.scalars.push(owned.start as u32);
        }
        let mut columns = Vec::new();
        let (mut starts, mut values) = (vec![0], vec![0]);
        let counted = |n: usize| u32::try_from(n).expect("fewer than 2^32 values");
        let mut length = 0usize;
        fill(&adjacent, &plan, level, |i, row| {
            let size = plan.size(i);
            columns.extend(row.iter().map(|&(k, _)| k));
            length += size
                * row
                    .iter()
                    .map(|&(k, _)| plan.size(k as usize))
                    .sum::<usize>();
            length += size * (size + 1) / 2;
            starts.push(counted(columns.len()));
            values.push(counted(length));
        });
        columns.shrink_to_fit();
        Self {
            columns,
            starts,
            values,
            ..plan
        }
    }

    /// Unknowns of a place.
    #[inline(always)]
    pub(super) fn size(&self, place: usize) -> usize {
        (self.first[place + 1] - self.first[place]) as usize
    }

    /// Places of the point and of the scalars of a place in a vector of unknowns.
    #[inline(always)]
    pub(super) fn unknowns(&self, place: usize) -> (Range<usize>, Range<usize>) {
        let point = 3 * self.points[place] as usize;
        let scalars = 3 * self.points.len() + self.scalars[place] as usize;
        (point..point + 3, scalars..scalars + self.size(place) - 3)
    }

    /// Columns of the strictly lower blocks of a row.
    #[inline(always)]
    pub(super) fn row(&self, place: usize) -> &[u32] {
        &self.columns[self.starts[place] as usize..self.starts[place + 1] as usize]
    }

    pub(super) fn heap_bytes(&self) -> usize {
        let words = [
            &self.points,
            &self.places,
            &self.first,
            &self.scalars,
            &self.starts,
            &self.columns,
            &self.values,
        ];
        4 * words.iter().map(|w| w.capacity()).sum::<usize>()
            + size_of::<Part>() * self.parts.capacity()
    }
}

/// Strictly lower blocks of every row up to a level of fill, columns ascending with
/// their levels: by the order and the sizes of a plan.
pub(super) fn fill(
    adjacent: &[Vec<u32>],
    plan: &Plan,
    level: usize,
    mut found: impl FnMut(usize, &[(u32, u32)]),
) {
    let n = adjacent.len();
    // by columns with their levels, as far as known
    let mut below: Vec<Vec<(u32, u32)>> = vec![Vec::new(); n];
    let mut of = vec![u32::MAX; n];
    let level = level.try_into().unwrap_or(u32::MAX - 1);
    let mut row = BTreeSet::new();
    let mut levels = Vec::new();
    for i in 0..n {
        let near = &adjacent[plan.points[i] as usize];
        let near = near.iter().map(|&q| plan.places[q as usize]);
        row.clear();
        row.extend(near.filter(|&k| (k as usize) < i));
        for &k in &row {
            of[k as usize] = 0;
        }
        let mut next = row.first().copied();
        while let Some(k) = next {
            let above = of[k as usize];
            if level > 0 {
                // rows after i are not there yet
                for &(j, l) in &below[k as usize] {
                    let made = above.saturating_add(l).saturating_add(1);
                    if made <= level && made < of[j as usize] {
                        of[j as usize] = made;
                        row.insert(j);
                    }
                }
            }
            next = row.range(k + 1..).next().copied();
        }
        levels.clear();
        for &k in &row {
            let l = std::mem::replace(&mut of[k as usize], u32::MAX);
            below[k as usize].push((i as u32, l));
            levels.push((k, l));
        }
        found(i, &levels);
    }
}

/// The nodes that every node couples with, ascending: by the points' pattern,
/// and by scalars through their owners.
pub(super) fn neighbours(points: &Pattern, border: Option<&BorderPattern>) -> Vec<Vec<u32>> {
    let mut near: Vec<Vec<u32>> = (0..points.points())
        .map(|i| points.all_columns()[points.row(i)].to_vec())
        .collect();
    if let Some(border) = border {
        for (s, &i) in border.owners().iter().enumerate() {
            let of_points = border.point_columns()[border.point_row(s)].iter();
            let of_scalars = border.scalar_columns()[border.scalar_row(s)].iter();
            let owners = of_scalars.map(|&t| border.owners()[t as usize]);
            for j in of_points.copied().chain(owners) {
                near[i as usize].push(j);
                near[j as usize].push(i);
            }
        }
    }
    for (i, near) in near.iter_mut().enumerate() {
        near.sort_unstable();
        near.dedup();
        near.retain(|&j| j as usize != i);
    }
    near
}
