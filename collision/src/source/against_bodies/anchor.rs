//! Anchors as the numbers of a checkpoint.

use super::element::{Anchor, BodyPair, Weights};
use crate::CollisionError;

/// One row an anchor: body, element, weights, place.
pub(super) fn to_numbers<W: Weights>(memory: &[Anchor<W>]) -> Vec<f64> {
    let mut out = Vec::with_capacity(row::<W>() * memory.len());
    for a in memory {
        out.extend([f64::from(a.of.body), f64::from(a.of.element)]);
        out.extend(a.weights.as_ref());
        out.extend(a.place);
    }
    out
}

/// Inverse of [`to_numbers`]; `limits` are the numbers of bodies and elements.
pub(super) fn from_numbers<W: Weights>(
    name: &str,
    numbers: &[f64],
    limits: [usize; 2],
) -> Result<Vec<Anchor<W>>, CollisionError> {
    let fail = |reason| {
        Err(CollisionError::History {
            source_name: name.into(),
            reason,
        })
    };
    if !numbers.len().is_multiple_of(row::<W>()) {
        return fail("wrong length");
    }
    let anchor = |r: &[f64]| {
        let mut weights = W::default();
        let (head, place) = r.split_at(r.len() - 3);
        weights.as_mut().copy_from_slice(&head[2..]);
        Anchor {
            of: BodyPair {
                body: r[0] as u32,
                element: r[1] as u32,
            },
            weights,
            place: [place[0], place[1], place[2]],
        }
    };
    let memory: Vec<Anchor<W>> = numbers.chunks_exact(row::<W>()).map(anchor).collect();
    let fits = |p: BodyPair| (p.body as usize) < limits[0] && (p.element as usize) < limits[1];
    if !memory.iter().all(|a| fits(a.of)) {
        return fail("made with other bodies or another mesh");
    }
    if !memory.is_sorted_by(|a, b| a.of < b.of) {
        return fail("not in order");
    }
    Ok(memory)
}

/// Numbers of a row.
fn row<W: Weights>() -> usize {
    5 + W::default().as_ref().len()
}
