//! Rest areas from side lengths.

/// Area from the three side lengths; 0 where they make no triangle.
pub(super) fn heron(l: &[f64; 3]) -> f64 {
    let s = 0.5 * (l[0] + l[1] + l[2]);
    (s * (s - l[0]) * (s - l[1]) * (s - l[2])).max(0.0).sqrt()
}

/// Part of a triangle nearest to corner `i`; halves and quarters where it is
/// obtuse. `l[i]` runs from corner `i` to the next.
pub(super) fn voronoi_area(l: &[f64; 3], i: usize) -> f64 {
    let area = heron(l);
    let square: [f64; 3] = std::array::from_fn(|k| l[k] * l[k]);
    // Twice the dot product of the sides that leave corner k.
    let spread = |k: usize| square[k] + square[(k + 2) % 3] - square[(k + 1) % 3];
    if let Some(k) = (0..3).find(|k| spread(*k) <= 0.0) {
        return if k == i { 0.5 * area } else { 0.25 * area };
    }
    let (next, last) = ((i + 1) % 3, (i + 2) % 3);
    // l² cot(opposite angle) / 8 for both sides at i; cot = spread / (4 area).
    (square[i] * spread(last) + square[last] * spread(next)) / (32.0 * area)
}

pub(super) fn edge_areas(
    edges: &[[u32; 2]],
    triangles: &[[u32; 3]],
    lengths: &[[f64; 3]],
) -> Vec<f32> {
    let mut order: Vec<u32> = (0..edges.len() as u32).collect();
    order.sort_unstable_by_key(|e| edges[*e as usize]);
    let mut area = vec![0.0; edges.len()];
    for (t, l) in triangles.iter().zip(lengths) {
        let third = heron(l) / 3.0;
        for i in 0..3 {
            let (a, b) = (t[i], t[(i + 1) % 3]);
            let found = order.binary_search_by_key(&[a.min(b), a.max(b)], |e| edges[*e as usize]);
            if let Ok(k) = found {
                area[order[k] as usize] += third as f32;
            }
        }
    }
    area
}
