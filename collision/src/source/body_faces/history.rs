use super::NAME;
use super::pass::Anchor;
use crate::CollisionError;

/// Eight numbers an anchor.
pub(super) fn to_numbers(memory: &[Anchor]) -> Vec<f64> {
    let mut out = Vec::with_capacity(8 * memory.len());
    for a in memory {
        out.extend(a.of.map(f64::from));
        out.extend(a.weights);
        out.extend(a.place);
    }
    out
}

/// Inverse of [`to_numbers`]; `limits` are the numbers of bodies and triangles.
pub(super) fn from_numbers(
    numbers: &[f64],
    limits: [usize; 2],
) -> Result<Vec<Anchor>, CollisionError> {
    let fail = |reason| {
        Err(CollisionError::History {
            source_name: NAME.into(),
            reason,
        })
    };
    let (rows, []) = numbers.as_chunks::<8>() else {
        return fail("wrong length");
    };
    let anchor = |r: &[f64; 8]| Anchor {
        of: [r[0] as u32, r[1] as u32],
        weights: [r[2], r[3], r[4]],
        place: [r[5], r[6], r[7]],
    };
    let memory: Vec<Anchor> = rows.iter().map(anchor).collect();
    if (0..2).any(|i| memory.iter().any(|a| a.of[i] as usize >= limits[i])) {
        return fail("made with other bodies or triangles");
    }
    if !memory.is_sorted_by(|a, b| a.of < b.of) {
        return fail("not in order");
    }
    Ok(memory)
}
