use super::NAME;
use super::pass::{Anchor, Candidate};
use crate::CollisionError;

/// Five numbers an anchor.
pub(super) fn to_numbers(memory: &[Anchor]) -> Vec<f64> {
    let mut out = Vec::with_capacity(5 * memory.len());
    for a in memory {
        out.extend([f64::from(a.of.body), f64::from(a.of.point)]);
        out.extend(a.place);
    }
    out
}

/// Inverse of [`to_numbers`]; `limits` are the numbers of bodies and points.
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
    let (rows, []) = numbers.as_chunks::<5>() else {
        return fail("wrong length");
    };
    let anchor = |r: &[f64; 5]| Anchor {
        of: Candidate {
            body: r[0] as u32,
            point: r[1] as u32,
        },
        place: [r[2], r[3], r[4]],
    };
    let memory: Vec<Anchor> = rows.iter().map(anchor).collect();
    let fits = |c: Candidate| (c.body as usize) < limits[0] && (c.point as usize) < limits[1];
    if !memory.iter().all(|a| fits(a.of)) {
        return fail("made with other bodies or points");
    }
    if !memory.is_sorted_by(|a, b| a.of < b.of) {
        return fail("not in order");
    }
    Ok(memory)
}
