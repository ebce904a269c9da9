use crate::wire::{Encoder, Fields, Malformed};

/// The ways of yarns over the points of a recording: all that is needed to
/// draw them as tubes. Visits are listed yarn after yarn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct YarnPaths {
    /// First visit of every yarn, and the number of visits.
    pub offsets: Vec<u32>,
    /// Point of each visit.
    pub points: Vec<u32>,
    /// Place of each visit among the yarns at its point, 0 in front.
    pub layers: Vec<u8>,
    /// Rest arc length at each visit \[m\].
    pub arcs: Vec<f64>,
    /// Radius of each yarn \[m\].
    pub radii: Vec<f64>,
    /// Piece of cloth of each yarn, by its index among the panels' names.
    pub panels: Vec<u16>,
    /// For every pair of neighbours in a stack, point by point and front to
    /// back, the sign of `n·(t_k × t_{k+1})` at rest, with `n` away from the
    /// viewer of the right side; 0 for parallel yarns.
    pub sides: Vec<i8>,
}

impl YarnPaths {
    /// Whether there is no yarn.
    pub fn is_empty(&self) -> bool {
        self.radii.is_empty()
    }

    /// Visits of a yarn.
    pub fn visits(&self, yarn: usize) -> std::ops::Range<usize> {
        self.offsets[yarn] as usize..self.offsets[yarn + 1] as usize
    }

    /// What does not fit together, with `points` points.
    pub(crate) fn fault(&self, points: usize) -> Option<String> {
        let (yarns, visits) = (self.radii.len(), self.points.len());
        if yarns == 0 {
            return (*self != Self::default()).then(|| "visits of yarns without yarns".into());
        }
        if self.offsets.len() != yarns + 1
            || self.offsets[0] != 0
            || self.offsets[yarns] as usize != visits
            || self
                .offsets
                .windows(2)
                .any(|o| o[1] < o[0].saturating_add(2))
        {
            return Some(format!("{yarns} yarns do not divide {visits} visits"));
        }
        for (what, length, expected) in [
            ("layers", self.layers.len(), visits),
            ("arc lengths", self.arcs.len(), visits),
            ("panels", self.panels.len(), yarns),
        ] {
            if length != expected {
                return Some(format!("yarns have {length} {what} instead of {expected}"));
            }
        }
        if let Some(p) = self.points.iter().find(|p| **p as usize >= points) {
            return Some(format!("a yarn visits point {p} of {points}"));
        }
        let positive = |r: &f64| *r > 0.0 && r.is_finite();
        if !self.radii.iter().all(positive) || !self.arcs.iter().all(|a| a.is_finite()) {
            return Some("radii or arc lengths of yarns are not finite and positive".into());
        }
        None
    }

    pub(crate) fn encode(&self, e: &mut Encoder<'_>) {
        e.fixed32s(1, self.offsets.iter().copied());
        e.fixed32s(2, self.points.iter().copied());
        e.bytes(3, &self.layers);
        e.doubles(4, self.arcs.iter().copied());
        e.doubles(5, self.radii.iter().copied());
        e.fixed32s(6, self.panels.iter().map(|p| u32::from(*p)));
        let sides: Vec<u8> = self.sides.iter().map(|s| s.cast_unsigned()).collect();
        e.bytes(7, &sides);
    }

    pub(crate) fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let mut yarns = Self::default();
        let mut panels = Vec::new();
        for field in Fields(bytes) {
            let (field, value) = field?;
            match field {
                1 => value.fixed32s(&mut yarns.offsets)?,
                2 => value.fixed32s(&mut yarns.points)?,
                3 => yarns.layers = value.bytes()?.to_vec(),
                4 => value.doubles(&mut yarns.arcs)?,
                5 => value.doubles(&mut yarns.radii)?,
                6 => value.fixed32s(&mut panels)?,
                7 => {
                    let sides = value.bytes()?.iter();
                    yarns.sides = sides.map(|s| s.cast_signed()).collect();
                }
                _ => {}
            }
        }
        let short = |p: &u32| u16::try_from(*p).map_err(|_| Malformed);
        yarns.panels = panels.iter().map(short).collect::<Result<_, _>>()?;
        Ok(yarns)
    }
}
