//! Reading GarmentCode's JSON.

use super::curve::relative_control;
use super::json::{
    array, control, flag, index, lengths, member, nearest, number, object, present, shorten,
    string, wrong,
};
use super::{Curve, EdgeId, Panel, PanelEdge, Pattern, Stitch};
use crate::GarmentError;
use serde_json::{Map, Value};

impl Pattern {
    /// Reads a pattern from GarmentCode's JSON.
    ///
    /// Lengths are converted to metres by `properties.units_in_meter`
    /// (default 100: centimetres). Entries that do not describe geometry
    /// (`parameters`, `panel_order` beyond the order, …) are ignored.
    ///
    /// # Errors
    /// A [`GarmentError`] that names the JSON path, the panel and the nearest
    /// valid name; syntax errors carry line and column.
    ///
    /// ```
    /// use selvedge_garment::Pattern;
    /// let square = r#"{"pattern": {"panels": {"square": {
    ///     "vertices": [[0, 0], [30, 0], [30, 30], [0, 30]],
    ///     "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
    ///               {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
    ///     "translation": [0, 100, 20], "rotation": [0, 0, 0]}}}}"#;
    /// let pattern = Pattern::from_json(square.as_bytes())?;
    /// assert_eq!(pattern.panels[0].vertices[2], [0.3, 0.3]);
    /// # Ok::<(), selvedge_garment::GarmentError>(())
    /// ```
    pub fn from_json(bytes: &[u8]) -> Result<Self, GarmentError> {
        let root: Value = serde_json::from_slice(bytes).map_err(|e| GarmentError::Json {
            line: e.line(),
            column: e.column(),
            message: strip_location(&e.to_string()),
        })?;
        read_pattern(&root)
    }
}

/// serde_json appends " at line L column C", which the error already says.
fn strip_location(message: &str) -> String {
    match message.rfind(" at line ") {
        Some(i) => message[..i].to_owned(),
        None => message.to_owned(),
    }
}

fn read_pattern(root: &Value) -> Result<Pattern, GarmentError> {
    let root = object(root, "$")?;
    let pattern = object(member(root, "$", "pattern")?, "$.pattern")?;
    let units = read_units(root)?;
    let absolute = read_absolute(root)?;
    let panels_json = object(member(pattern, "$.pattern", "panels")?, "$.pattern.panels")?;
    let mut panels = Vec::with_capacity(panels_json.len());
    for name in ordered_names(pattern, panels_json)? {
        let path = format!("$.pattern.panels.{name}");
        panels.push(read_panel(
            &panels_json[name],
            name,
            &path,
            units,
            absolute,
        )?);
    }
    if panels.is_empty() {
        return Err(GarmentError::NoPanels);
    }
    let mut stitches = Vec::new();
    if let Some(list) = present(pattern, "stitches") {
        for (i, s) in array(list, "$.pattern.stitches")?.iter().enumerate() {
            let path = format!("$.pattern.stitches[{i}]");
            stitches.push(read_stitch(s, &path, &panels)?);
        }
    }
    Ok(Pattern { panels, stitches })
}

/// Units of the file per metre.
fn read_units(root: &Map<String, Value>) -> Result<f64, GarmentError> {
    let path = "$.properties.units_in_meter";
    let Some(properties) = present(root, "properties") else {
        return Ok(100.0);
    };
    match present(object(properties, "$.properties")?, "units_in_meter") {
        None => Ok(100.0),
        Some(v) => {
            let value = number(v, path)?;
            if (1e-3..=1e6).contains(&value) {
                Ok(value)
            } else {
                Err(GarmentError::OutOfRange {
                    path: path.to_owned(),
                    value,
                    allowed: "0.001 to 1000000",
                })
            }
        }
    }
}

/// Whether control points are panel coordinates instead of relative to edges.
fn read_absolute(root: &Map<String, Value>) -> Result<bool, GarmentError> {
    let Some(properties) = present(root, "properties") else {
        return Ok(false);
    };
    let path = "$.properties.curvature_coords";
    match present(object(properties, "$.properties")?, "curvature_coords") {
        None => Ok(false),
        Some(v) => match v.as_str() {
            Some("relative") => Ok(false),
            Some("absolute") => Ok(true),
            _ => Err(wrong(path, "\"relative\" or \"absolute\"", v)),
        },
    }
}

/// Panel names: those of `panel_order` first, then the others by name.
fn ordered_names<'a>(
    pattern: &'a Map<String, Value>,
    panels: &'a Map<String, Value>,
) -> Result<Vec<&'a str>, GarmentError> {
    let mut names: Vec<&str> = Vec::with_capacity(panels.len());
    if let Some(order) = present(pattern, "panel_order") {
        for (i, n) in array(order, "$.pattern.panel_order")?.iter().enumerate() {
            let path = format!("$.pattern.panel_order[{i}]");
            let name = string(n, &path)?;
            if !panels.contains_key(name) {
                return Err(GarmentError::UnknownPanel {
                    path,
                    name: shorten(name),
                    nearest: nearest(name, panels.keys().map(String::as_str)),
                });
            }
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    for name in panels.keys() {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    Ok(names)
}

fn read_panel(
    value: &Value,
    name: &str,
    path: &str,
    units: f64,
    absolute: bool,
) -> Result<Panel, GarmentError> {
    let panel = object(value, path)?;
    let at = |key: &str| format!("{path}.{key}");
    let vertices_json = array(member(panel, path, "vertices")?, &at("vertices"))?;
    let mut vertices = Vec::with_capacity(vertices_json.len());
    for (i, v) in vertices_json.iter().enumerate() {
        vertices.push(lengths::<2>(v, &format!("{path}.vertices[{i}]"), units)?);
    }
    let edges_json = array(member(panel, path, "edges")?, &at("edges"))?;
    let mut edges = Vec::with_capacity(edges_json.len());
    for (i, e) in edges_json.iter().enumerate() {
        let path = format!("{path}.edges[{i}]");
        edges.push(read_edge(e, &path, name, &vertices, units, absolute)?);
    }
    let optional = |key: &str, units: f64| match present(panel, key) {
        Some(v) => lengths::<3>(v, &at(key), units),
        None => Ok([0.0; 3]),
    };
    Ok(Panel {
        name: name.to_owned(),
        label: label(panel, path)?,
        vertices,
        edges,
        translation: optional("translation", units)?,
        rotation_degrees: optional("rotation", 1.0)?,
    })
}

fn read_edge(
    value: &Value,
    path: &str,
    panel: &str,
    vertices: &[[f64; 2]],
    units: f64,
    absolute: bool,
) -> Result<PanelEdge, GarmentError> {
    let edge = object(value, path)?;
    let ends_path = format!("{path}.endpoints");
    let list = array(member(edge, path, "endpoints")?, &ends_path)?;
    let mut ends = [0u32; 2];
    if list.len() != 2 {
        return Err(wrong(&ends_path, "two vertex numbers", &edge["endpoints"]));
    }
    for k in 0..2 {
        let path = format!("{ends_path}[{k}]");
        let vertex = index(&list[k], &path)?;
        if vertex >= vertices.len() as u64 {
            return Err(GarmentError::UnknownVertex {
                path,
                panel: shorten(panel),
                vertex,
                count: vertices.len(),
            });
        }
        ends[k] = vertex as u32;
    }
    let [a, b] = ends.map(|v| vertices[v as usize]);
    let curve = match present(edge, "curvature") {
        None => Curve::Line,
        Some(c) => read_curve(c, &format!("{path}.curvature"), units, |p| {
            if absolute {
                relative_control(a, b, p.map(|x| x / units)).unwrap_or([0.5, 0.0])
            } else {
                p
            }
        })?,
    };
    Ok(PanelEdge {
        ends,
        curve,
        label: label(edge, path)?,
    })
}

fn read_curve(
    value: &Value,
    path: &str,
    units: f64,
    relative: impl Fn([f64; 2]) -> [f64; 2],
) -> Result<Curve, GarmentError> {
    // Older files: a bare control point.
    if value.is_array() {
        return Ok(Curve::Quadratic {
            control: relative(control(value, path)?),
        });
    }
    let curve = object(value, path)?;
    let kind_path = format!("{path}.type");
    let kind = string(member(curve, path, "type")?, &kind_path)?;
    let params_path = format!("{path}.params");
    let params_json = member(curve, path, "params")?;
    let params = array(params_json, &params_path)?;
    let at = |i: usize| format!("{params_path}[{i}]");
    match (kind, params.len()) {
        ("quadratic", 1) => Ok(Curve::Quadratic {
            control: relative(control(&params[0], &at(0))?),
        }),
        ("cubic", 2) => Ok(Curve::Cubic {
            controls: [
                relative(control(&params[0], &at(0))?),
                relative(control(&params[1], &at(1))?),
            ],
        }),
        ("circle", 3) => {
            let radius = number(&params[0], &at(0))? / units;
            if !(radius > 0.0 && radius <= 1e9) {
                return Err(GarmentError::OutOfRange {
                    path: at(0),
                    value: radius,
                    allowed: "a radius above 0",
                });
            }
            Ok(Curve::Circle {
                radius,
                large: flag(&params[1], &at(1))?,
                right: flag(&params[2], &at(2))?,
            })
        }
        ("quadratic", _) => Err(wrong(&params_path, "one control point", params_json)),
        ("cubic", _) => Err(wrong(&params_path, "two control points", params_json)),
        ("circle", _) => Err(wrong(
            &params_path,
            "[radius, large_arc, right]",
            params_json,
        )),
        (name, _) => Err(GarmentError::UnknownCurve {
            path: kind_path,
            name: shorten(name),
            nearest: nearest(name, ["quadratic", "cubic", "circle"].into_iter()),
        }),
    }
}

fn read_stitch(value: &Value, path: &str, panels: &[Panel]) -> Result<Stitch, GarmentError> {
    let list = array(value, path)?;
    let expected = "two {panel, edge} objects, optionally followed by \"right_wrong\"";
    if !(2..=3).contains(&list.len()) {
        return Err(wrong(path, expected, value));
    }
    let right_wrong = match list.get(2) {
        None => false,
        Some(v) => match v.as_str() {
            Some("right_wrong") => true,
            Some("right_right" | "wrong_wrong") => false,
            _ => return Err(wrong(&format!("{path}[2]"), "\"right_wrong\"", v)),
        },
    };
    let mut sides = [EdgeId { panel: 0, edge: 0 }; 2];
    for k in 0..2 {
        let path = format!("{path}[{k}]");
        let side = object(&list[k], &path)?;
        let name_path = format!("{path}.panel");
        let name = string(member(side, &path, "panel")?, &name_path)?;
        let Some(panel) = panels.iter().position(|p| p.name == name) else {
            return Err(GarmentError::UnknownPanel {
                path: name_path,
                name: shorten(name),
                nearest: nearest(name, panels.iter().map(|p| p.name.as_str())),
            });
        };
        let edge_path = format!("{path}.edge");
        let edge = index(member(side, &path, "edge")?, &edge_path)?;
        if edge >= panels[panel].edges.len() as u64 {
            return Err(GarmentError::UnknownEdge {
                path: edge_path,
                panel: shorten(name),
                edge,
                last: panels[panel].edges.len().saturating_sub(1),
            });
        }
        sides[k] = EdgeId {
            panel: panel as u32,
            edge: edge as u32,
        };
    }
    Ok(Stitch {
        a: sides[0],
        b: sides[1],
        right_wrong,
    })
}

fn label(map: &Map<String, Value>, path: &str) -> Result<Option<String>, GarmentError> {
    match present(map, "label") {
        None => Ok(None),
        Some(v) => {
            let text = string(v, &format!("{path}.label"))?;
            Ok((!text.is_empty()).then(|| text.to_owned()))
        }
    }
}
