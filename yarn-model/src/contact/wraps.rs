use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::compression::GRAIN;
use crate::force::wrapping::wrapping_force;
use crate::vec3::V;
use crate::{NONE, StitchWrapping, WrapElement, WrapPair, YarnNetwork};

/// Wrapping forces by strand. Wings and axis ends belong to the yarn that makes
/// them: `x0` and `x4` to the child, `x1` and `x3` to the parent.
///
/// Angles are the ones nearest to those of the network as built; unlike
/// [`StitchWrapping`] an element that turns further than π from there is not
/// followed.
#[derive(Clone, Debug, Default)]
pub(super) struct Wraps {
    elements: Vec<WrapElement>,
    /// Strands of `x0, x1, x3, x4`.
    strands: Vec<[u32; 4]>,
    /// Angle ψ of the network as built [rad].
    start: Vec<f64>,
    /// Per strand, from where on in `entries`; empty without elements.
    offsets: Vec<u32>,
    /// Four times the element plus the place in it.
    entries: Vec<u32>,
    forces: Vec<[V; 4]>,
}

impl Wraps {
    pub fn new(network: &YarnNetwork) -> Self {
        let elements = StitchWrapping::elements(network);
        if elements.iter().all(|e| e.stiffness == 0.0) {
            return Self::default();
        }
        let energy = StitchWrapping::new(network);
        let start = (0..elements.len()).map(|e| {
            let mut q = [0.0; 12];
            let points = elements[e].points.iter();
            for (x, point) in q.as_chunks_mut::<3>().0.iter_mut().zip(points) {
                *x = network.points[*point as usize];
            }
            energy.angle(e, &q).unwrap_or(0.0)
        });
        let start = start.collect();
        let strands: Vec<_> = strands_of_elements(network, &elements);
        let mut offsets = vec![0; network.strands.len() + 1];
        for s in strands.iter().flatten() {
            offsets[*s as usize + 1] += 1;
        }
        for s in 0..network.strands.len() {
            offsets[s + 1] += offsets[s];
        }
        let mut at = offsets.clone();
        let mut entries = vec![0; 4 * elements.len()];
        for (k, s) in strands.iter().flatten().enumerate() {
            entries[at[*s as usize] as usize] = k as u32;
            at[*s as usize] += 1;
        }
        Self {
            forces: vec![[V::zeros(); 4]; elements.len()],
            elements,
            strands,
            start,
            offsets,
            entries,
        }
    }

    /// Forces at given places of the strands.
    pub fn update(&mut self, places: &[V]) {
        let elements = self.elements.par_iter().zip(&self.strands);
        elements
            .zip(&self.start)
            .zip(&mut self.forces)
            .with_min_len(GRAIN)
            .for_each(|(((element, strands), start), forces)| {
                let x = strands.map(|s| places[s as usize]);
                *forces = wrapping_force(element, FRAC_PI_2, *start, x);
            });
    }

    /// Force on strand `s` [N].
    #[inline(always)]
    pub fn force(&self, s: usize) -> V {
        if self.offsets.is_empty() {
            return V::zeros();
        }
        let entries = self.offsets[s] as usize..self.offsets[s + 1] as usize;
        let entries = self.entries[entries].iter();
        entries
            .map(|e| self.forces[*e as usize / 4][*e as usize % 4])
            .sum()
    }

    pub fn heap_bytes(&self) -> usize {
        size_of_val(&self.elements[..])
            + size_of_val(&self.strands[..])
            + size_of_val(&self.start[..])
            + size_of_val(&self.offsets[..])
            + size_of_val(&self.entries[..])
            + size_of_val(&self.forces[..])
    }
}

/// Strands of every element, which come contact by contact and parent by
/// parent.
fn strands_of_elements(network: &YarnNetwork, elements: &[WrapElement]) -> Vec<[u32; 4]> {
    let mut strands: Vec<[u32; 4]> = Vec::with_capacity(elements.len());
    for contact in &network.stitches {
        for pair in [WrapPair::ChildAtA, WrapPair::ChildAtB] {
            let (child, parents, x0, x1) = match pair {
                WrapPair::ChildAtA => (
                    network.child_at_a(contact),
                    network.parents_at_b(contact),
                    contact.a,
                    contact.b,
                ),
                WrapPair::ChildAtB => (
                    network.child_at_b(contact),
                    network.parents_at_a(contact),
                    contact.b,
                    contact.a,
                ),
            };
            for parent in parents {
                // The same condition as for an element to exist.
                let wings = (wing(network, child, x1), wing(network, parent, x0));
                if let (Some(x4), Some(x3)) = wings {
                    strands.push([child, parent, x3, x4]);
                }
            }
        }
    }
    assert_eq!(strands.len(), elements.len(), "strands of every element");
    strands
}

/// Strand beside a strand that is not at a contact's other node.
fn wing(network: &YarnNetwork, strand: u32, other: u32) -> Option<u32> {
    let s = &network.strands[strand as usize];
    let beside = |s: u32| (s != NONE).then_some(s);
    let at_other = |s: u32| s != NONE && network.strands[s as usize].node == other;
    match (s.prev, s.next) {
        (inside, outside) if at_other(inside) => beside(outside),
        (outside, inside) if at_other(inside) => beside(outside),
        _ => None,
    }
}
