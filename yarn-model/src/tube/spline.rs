use crate::vec3::{V, perpendicular};

/// A place on a curve: its point, the unit tangent and a unit vector across
/// that turns no more than the tangent does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    pub centre: V,
    pub tangent: V,
    pub across: V,
}

/// Centripetal Catmull-Rom spline through points, `samples` places a segment
/// and the last point, with a parallel-transported frame:
///
/// ```text
/// d_i = √|p_{i+1} − p_i|
/// m_i = (p_i − p_{i−1})/d_{i−1} − (p_{i+1} − p_{i−1})/(d_{i−1} + d_i) + (p_{i+1} − p_i)/d_i
/// u'  = u − (u·t')/(1 + t·t') (t + t')          (least rotation from t to t')
/// ```
///
/// Points that coincide with their neighbours take the tangent from the other
/// side.
pub(super) fn rings(points: &[V], samples: usize, out: &mut Vec<Ring>) {
    let first = out.len();
    let last = points.len() - 1;
    let chord = |i: usize| points[i + 1] - points[i];
    let root = |i: usize| chord(i).norm().sqrt();
    // Slope at a point, per unit of the parameter.
    let slope = |i: usize| -> V {
        let before = (i > 0).then(|| (chord(i - 1), root(i - 1)));
        let after = (i < last).then(|| (chord(i), root(i)));
        match (before.filter(|b| b.1 > 0.0), after.filter(|a| a.1 > 0.0)) {
            (Some((a, da)), Some((b, db))) => a / da - (a + b) / (da + db) + b / db,
            (Some((a, da)), None) => a / da,
            (None, Some((b, db))) => b / db,
            (None, None) => V::zeros(),
        }
    };
    for i in 0..last {
        let (p, c, d) = (points[i], chord(i), root(i));
        let (m, n) = (slope(i) * d, slope(i + 1) * d);
        for k in 0..samples {
            let s = k as f64 / samples as f64;
            // Hermite form about the first point.
            let centre = p + c * (s * s * (3.0 - 2.0 * s)) + m * (s * (1.0 - s) * (1.0 - s))
                - n * (s * s * (1.0 - s));
            let tangent = c * (6.0 * s * (1.0 - s))
                + m * ((1.0 - s) * (1.0 - 3.0 * s))
                + n * (s * (3.0 * s - 2.0));
            let tangent = if k == 0 { slope(i) } else { tangent };
            push(out, first, centre, tangent);
        }
    }
    push(out, first, points[last], slope(last));
    // Rings before the first direction take it.
    let known = out[first..].iter().position(|r| r.tangent != V::zeros());
    let frame = known.map_or((V::x(), V::y()), |k| {
        (out[first + k].tangent, out[first + k].across)
    });
    for ring in &mut out[first..first + known.unwrap_or(last * samples + 1)] {
        (ring.tangent, ring.across) = frame;
    }
}

/// Adds a ring with the frame transported from the one before.
fn push(out: &mut Vec<Ring>, first: usize, centre: V, tangent: V) {
    let before = out[first..]
        .last()
        .filter(|r| r.tangent != V::zeros())
        .copied();
    let unit = tangent.try_normalize(f64::MIN_POSITIVE);
    let (tangent, across) = match (before, unit) {
        (Some(r), None) => (r.tangent, r.across),
        (None, None) => (V::zeros(), V::zeros()),
        (None, Some(t)) => (t, perpendicular(t)),
        (Some(r), Some(t)) => {
            let cos = r.tangent.dot(&t);
            let turned = match 1.0 + cos > 1e-9 {
                true => r.across - (r.tangent + t) * (r.across.dot(&t) / (1.0 + cos)),
                false => r.across,
            };
            // Round-off does not grow along the yarn.
            let across = turned - t * t.dot(&turned);
            (
                t,
                across
                    .try_normalize(0.1)
                    .unwrap_or_else(|| perpendicular(t)),
            )
        }
    };
    out.push(Ring {
        centre,
        tangent,
        across,
    });
}
