use crate::CollisionError;
use crate::narrow::PairKind;
use crate::source::side::Side;

/// Sides of all pairs in contact at the end of the last step, in the order of
/// the candidates, and their anchors where friction has any.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    pub records: Vec<Record>,
    pub anchors: Vec<Anchor>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub pair: [u32; 2],
    pub normal: [f32; 3],
    pub kind: PairKind,
    pub behind: bool,
}

/// A point on each feature, and a displacement in a frame that turns with them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Anchor {
    pub weights: [f64; 2],
    pub offset: [f64; 2],
}

impl Record {
    pub(super) fn key(&self) -> (PairKind, [u32; 2]) {
        (self.kind, self.pair)
    }

    pub(super) fn side(&self) -> Side {
        Side {
            normal: self.normal.map(f64::from),
            behind: self.behind,
        }
    }
}

impl Anchor {
    /// All four weights from the two free ones.
    pub(super) fn weights(&self, kind: PairKind) -> [f64; 4] {
        let [a, b] = self.weights;
        match kind {
            PairKind::VertexTriangle => [1.0, a + b - 1.0, -a, -b],
            PairKind::EdgeEdge => [1.0 - a, a, b - 1.0, -b],
        }
    }

    pub(super) fn at(kind: PairKind, w: [f64; 4], offset: [f64; 2]) -> Self {
        let weights = match kind {
            PairKind::VertexTriangle => [-w[2], -w[3]],
            PairKind::EdgeEdge => [w[1], -w[3]],
        };
        Self { weights, offset }
    }
}

impl Memory {
    pub(super) fn clear(&mut self) {
        self.records.clear();
        self.anchors.clear();
    }

    pub(super) fn append(&mut self, other: &mut Self) {
        self.records.append(&mut other.records);
        self.anchors.append(&mut other.anchors);
    }

    /// Numbers of records and anchors, seven numbers a record, four an anchor.
    pub(super) fn to_numbers(&self) -> Vec<f64> {
        let mut out = vec![self.records.len() as f64, self.anchors.len() as f64];
        for r in &self.records {
            let edges = f64::from(u8::from(r.kind == PairKind::EdgeEdge));
            out.extend([edges, r.pair[0].into(), r.pair[1].into()]);
            out.extend(r.normal.map(f64::from));
            out.push(f64::from(u8::from(r.behind)));
        }
        for a in &self.anchors {
            out.extend(a.weights);
            out.extend(a.offset);
        }
        out
    }

    /// Inverse of [`to_numbers`](Self::to_numbers); `limits` are the numbers of
    /// points, triangles and edges.
    pub(super) fn from_numbers(
        numbers: &[f64],
        anchored: bool,
        limits: [usize; 3],
    ) -> Result<Self, CollisionError> {
        let fail = |reason| {
            Err(CollisionError::History {
                source_name: super::NAME.into(),
                reason,
            })
        };
        let [records, anchors, rest @ ..] = numbers else {
            return fail("no header");
        };
        let (n, m) = (*records as usize, *anchors as usize);
        let length = n
            .checked_mul(7)
            .zip(m.checked_mul(4))
            .and_then(|(a, b)| a.checked_add(b));
        if length != Some(rest.len()) {
            return fail("wrong length");
        }
        if m != if anchored { n } else { 0 } {
            return fail("made with another friction model");
        }
        let mut memory = Self::default();
        for r in rest[..7 * n].as_chunks::<7>().0 {
            let kind = if r[0] == 0.0 {
                PairKind::VertexTriangle
            } else {
                PairKind::EdgeEdge
            };
            let pair = [r[1] as u32, r[2] as u32];
            let limits = match kind {
                PairKind::VertexTriangle => [limits[0], limits[1]],
                PairKind::EdgeEdge => [limits[2]; 2],
            };
            if (0..2).any(|i| pair[i] as usize >= limits[i]) {
                return fail("made with another mesh");
            }
            let normal = [r[3] as f32, r[4] as f32, r[5] as f32];
            memory.records.push(Record {
                pair,
                normal,
                kind,
                behind: r[6] != 0.0,
            });
        }
        if !memory.records.is_sorted_by(|a, b| a.key() < b.key()) {
            return fail("not in order");
        }
        for a in rest[7 * n..].as_chunks::<4>().0 {
            memory.anchors.push(Anchor {
                weights: [a[0], a[1]],
                offset: [a[2], a[3]],
            });
        }
        Ok(memory)
    }

    pub(super) fn heap_bytes(&self) -> usize {
        size_of::<Record>() * self.records.capacity()
            + size_of::<Anchor>() * self.anchors.capacity()
    }
}
