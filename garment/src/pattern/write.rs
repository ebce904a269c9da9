//! Writing GarmentCode's JSON.

use super::{Curve, Panel, Pattern};
use serde_json::{Map, Value, json};

/// Units per metre in written files: centimetres, as GarmentCode uses.
const UNITS_IN_METER: f64 = 100.0;

impl Pattern {
    /// The pattern as GarmentCode's JSON, in centimetres. Reading it back
    /// gives the same pattern up to rounding of the unit conversion.
    pub fn to_json(&self) -> String {
        let name = |panel: u32| {
            self.panels
                .get(panel as usize)
                .map_or("", |p| p.name.as_str())
        };
        let mut panels = Map::new();
        for p in &self.panels {
            panels.insert(p.name.clone(), panel_json(p));
        }
        let stitches: Vec<Value> = self
            .stitches
            .iter()
            .map(|s| {
                let mut sides: Vec<Value> = [s.a, s.b]
                    .iter()
                    .map(|e| json!({"panel": name(e.panel), "edge": e.edge}))
                    .collect();
                if s.right_wrong {
                    sides.push(json!("right_wrong"));
                }
                Value::Array(sides)
            })
            .collect();
        let order: Vec<&str> = self.panels.iter().map(|p| p.name.as_str()).collect();
        let root = json!({
            "pattern": {"panels": panels, "stitches": stitches, "panel_order": order},
            "properties": {
                "curvature_coords": "relative",
                "normalize_panel_translation": false,
                "normalized_edge_loops": true,
                "units_in_meter": UNITS_IN_METER,
            },
        });
        format!("{root:#}")
    }
}

fn panel_json(panel: &Panel) -> Value {
    let scaled = |p: &[f64]| -> Vec<f64> { p.iter().map(|x| x * UNITS_IN_METER).collect() };
    let edges: Vec<Value> = panel
        .edges
        .iter()
        .map(|e| {
            let mut edge = json!({"endpoints": e.ends});
            if let Some(c) = curve_json(&e.curve) {
                edge["curvature"] = c;
            }
            if let Some(l) = &e.label {
                edge["label"] = json!(l);
            }
            edge
        })
        .collect();
    let vertices: Vec<Vec<f64>> = panel.vertices.iter().map(|v| scaled(v)).collect();
    let mut out = json!({
        "vertices": vertices,
        "edges": edges,
        "translation": scaled(&panel.translation),
        "rotation": panel.rotation_degrees,
    });
    if let Some(l) = &panel.label {
        out["label"] = json!(l);
    }
    out
}

fn curve_json(curve: &Curve) -> Option<Value> {
    match *curve {
        Curve::Line => None,
        Curve::Quadratic { control } => Some(json!({"type": "quadratic", "params": [control]})),
        Curve::Cubic { controls } => Some(json!({"type": "cubic", "params": controls})),
        Curve::Circle {
            radius,
            large,
            right,
        } => Some(json!({
            "type": "circle",
            "params": [radius * UNITS_IN_METER, u8::from(large), u8::from(right)],
        })),
    }
}
