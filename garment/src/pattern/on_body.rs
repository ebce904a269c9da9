//! Checking a pattern's placement against a body.

use super::doctor::sampled;
use super::{Finding, Pattern, Place, Severity};

/// Checks where the panels are placed relative to a body, given as its signed
/// distance [m] and gradient at a point.
///
/// A panel with points inside the body is a warning, with the fraction of its
/// area that is inside.
pub fn examine_on_body(pattern: &Pattern, sdf: crate::place::BodyField<'_>) -> Vec<Finding> {
    const STEPS: usize = 40;
    let mut out = Vec::new();
    for panel in &pattern.panels {
        let Some(polygon) = sampled(panel, 8).map(|s| s.0) else {
            continue;
        };
        let frame = panel.frame();
        let mut low = [f64::MAX; 2];
        let mut high = [f64::MIN; 2];
        for p in &polygon {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let (mut total, mut inside) = (0usize, 0usize);
        let mut deepest = (0.0, [0.0; 3]);
        for i in 0..STEPS * STEPS {
            let t = [(i % STEPS) as f64, (i / STEPS) as f64].map(|x| (x + 0.5) / STEPS as f64);
            let p = [
                low[0] + t[0] * (high[0] - low[0]),
                low[1] + t[1] * (high[1] - low[1]),
            ];
            if !contains(&polygon, p) {
                continue;
            }
            total += 1;
            let world = frame.place(p);
            let (d, _) = sdf(world);
            if d < 0.0 {
                inside += 1;
            }
            if d < deepest.0 {
                deepest = (d, world);
            }
        }
        if inside > 0 {
            out.push(Finding {
                severity: Severity::Warning,
                panel: Some(panel.name.clone()),
                edge: None,
                place: Some(Place::World(deepest.1)),
                message: format!(
                    "panel `{}` starts {:.0} % inside the body, up to {:.1} cm deep",
                    panel.name,
                    100.0 * inside as f64 / total as f64,
                    -100.0 * deepest.0
                ),
                help: "move the panel away from the body with its `translation`".into(),
            });
        }
    }
    out
}

/// Even-odd rule.
fn contains(polygon: &[[f64; 2]], p: [f64; 2]) -> bool {
    let mut inside = false;
    for i in 0..polygon.len() {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        {
            inside = !inside;
        }
    }
    inside
}
