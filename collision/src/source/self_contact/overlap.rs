use super::NAME;
use crate::CollisionError;

/// Overlaps that the cloth begins with, taken back slowly.
///
/// ```text
/// force(g) = f(g + s),   s = max_i s_i · max(0, 1 − (t − t₀)/T),   s_i = max (δ − |g₀|)
/// ```
/// `g` gap [m], `δ` thickness [m], `f` the repulsion; `s_i` is the largest
/// overlap of all pairs at point `i` when contact is first looked at, at `t₀`
/// [s]. Layers that begin in each other thus part at about `δ/T`; without
/// this the whole potential is released at once.
#[derive(Clone, Debug, Default)]
pub(super) struct Overlap {
    /// Whether the start has been looked at.
    pub measured: bool,
    start: f64,
    /// `s_i` [m]; empty where nothing overlaps, or nothing any more.
    points: Vec<f64>,
    /// Share of it that is still allowed.
    share: f64,
}

impl Overlap {
    /// Takes over the overlaps of all points at a time [s].
    pub fn set(&mut self, time: f64, points: Vec<f64>) {
        self.measured = true;
        self.start = time;
        self.points = points;
        if self.points.iter().all(|s| *s == 0.0) {
            self.points = Vec::new();
        }
    }

    /// Prepares for a step from `time` [s] to `time + dt`, with the time in
    /// which overlaps go [s].
    pub fn begin_step(&mut self, time: f64, dt: f64, release: f64) {
        if self.points.is_empty() {
            return;
        }
        self.share = (1.0 - (time + dt - self.start) / release).clamp(0.0, 1.0);
        if time >= self.start + release {
            self.points = Vec::new();
        }
    }

    /// The overlaps of points that come `from` these at a time [s]: what is left of
    /// these, or what is `fresh` [m] where that is more.
    pub fn changed(&self, from: &[u32], fresh: &[f64], time: f64, release: f64) -> Self {
        let mut next = Self::default();
        if !self.measured || !(release > 0.0) {
            return next;
        }
        let left = (1.0 - (time - self.start) / release).clamp(0.0, 1.0);
        let of = |p: &u32| left * self.points.get(*p as usize).copied().unwrap_or(0.0);
        let both = from.iter().zip(fresh);
        next.set(time, both.map(|(p, f)| of(p).max(*f)).collect());
        next
    }

    /// What a pair may still overlap [m].
    #[inline]
    pub fn allowed(&self, nodes: &[u32; 4]) -> f64 {
        if self.points.is_empty() {
            return 0.0;
        }
        let most = nodes.iter().map(|n| self.points[*n as usize]);
        self.share * most.fold(0.0, f64::max)
    }

    /// How many numbers follow, and they: nothing before the start has been
    /// looked at, its time, the overlaps.
    pub fn to_numbers(&self) -> Vec<f64> {
        let mut out = vec![0.0];
        if self.measured {
            out.push(self.start);
            out.extend_from_slice(&self.points);
        }
        out[0] = (out.len() - 1) as f64;
        out
    }

    /// Inverse of [`to_numbers`](Self::to_numbers) for `points` points; also
    /// gives the numbers that follow.
    pub fn from_numbers(numbers: &[f64], points: usize) -> Result<(Self, &[f64]), CollisionError> {
        let fail = |reason| CollisionError::History {
            source_name: NAME.into(),
            reason,
        };
        let (&count, rest) = numbers.split_first().ok_or_else(|| fail("no header"))?;
        let whole = count >= 0.0 && count.fract() == 0.0;
        if !whole || count as usize > rest.len() {
            return Err(fail("wrong length"));
        }
        let (own, rest) = rest.split_at(count as usize);
        let mut overlap = Self::default();
        if let Some((&start, of_points)) = own.split_first() {
            if ![0, points].contains(&of_points.len()) {
                return Err(fail("made with another mesh"));
            }
            overlap.set(start, of_points.to_vec());
        }
        Ok((overlap, rest))
    }

    pub fn heap_bytes(&self) -> usize {
        8 * self.points.capacity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The allowance falls linearly to nothing and survives a checkpoint.
    #[test]
    fn overlap_goes_in_time() {
        let mut o = Overlap::default();
        o.set(1.0, vec![0.0, 4e-4, 0.0, 0.0, 0.0]);
        o.begin_step(1.0, 5e-3, 0.02);
        assert!((o.allowed(&[0, 1, 2, 3]) - 3e-4).abs() < 1e-15);
        assert_eq!(o.allowed(&[0, 2, 3, 4]), 0.0);
        let mut numbers = o.to_numbers();
        numbers.push(7.0);
        let (mut again, rest) = Overlap::from_numbers(&numbers, 5).expect("its own numbers");
        assert_eq!(rest, [7.0]);
        let fresh = [0.0, 0.0, 5e-5];
        let mut changed = o.changed(&[1, 1, 4], &fresh, 1.01, 0.02);
        changed.begin_step(1.01, 5e-3, 0.02);
        assert!((changed.allowed(&[1, 1, 1, 1]) - 0.75 * 2e-4).abs() < 1e-15);
        assert!((changed.allowed(&[2, 2, 2, 2]) - 0.75 * 5e-5).abs() < 1e-15);
        for o in [&mut o, &mut again] {
            o.begin_step(1.01, 5e-3, 0.02);
            assert!((o.allowed(&[0, 1, 2, 3]) - 1e-4).abs() < 1e-15);
            o.begin_step(1.03, 5e-3, 0.02);
            assert_eq!(o.allowed(&[0, 1, 2, 3]), 0.0);
        }
        assert!(Overlap::from_numbers(&numbers, 6).is_err());
        assert!(Overlap::from_numbers(&[0.5], 5).is_err());
        let fresh = Overlap::default().to_numbers();
        assert!(
            !Overlap::from_numbers(&fresh, 5)
                .expect("nothing")
                .0
                .measured
        );
    }
}
