use serde_json::Value as Json;

use crate::wire::{Encoder, Fields, Malformed};
use crate::{RecordError, YarnPaths};

/// The display mesh of an obstacle, in world coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodySurface {
    /// Name in the viewer.
    pub name: String,
    /// Vertices \[m\].
    pub points: Vec<[f64; 3]>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// Everything about a run that does not change with time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunHeader {
    /// Name of the scene.
    pub scene_name: String,
    /// The scene file as it was read; becomes an attachment.
    pub scene_text: String,
    /// Every setting in effect that the result depends on. A run resumes only
    /// with equal ones.
    pub effective: Json,
    /// Anything else worth keeping (threads, host, folders); not compared.
    pub notes: Json,
    /// Version of the program. A run resumes only with the same one.
    pub version: String,
    /// Number of points.
    pub points: usize,
    /// Number of scalar unknowns after the points.
    pub scalars: usize,
    /// Cloth triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Panel of each triangle; may be empty.
    pub panels: Vec<u16>,
    /// Fabric of each triangle; may be empty.
    pub fabrics: Vec<u16>,
    /// Names of the panels; may be empty.
    pub panel_names: Vec<String>,
    /// Names of the fabrics; may be empty.
    pub fabric_names: Vec<String>,
    /// (warp, weft) coordinates of the corners of each triangle \[m\]; may be
    /// empty.
    pub material: Vec<[[f64; 2]; 3]>,
    /// Obstacles to show.
    pub bodies: Vec<BodySurface>,
    /// Ways of the yarns, for cloth that is made of them.
    pub yarns: YarnPaths,
}

impl RunHeader {
    /// Length of the unknowns, `3 points + scalars`.
    pub fn dim(&self) -> usize {
        3 * self.points + self.scalars
    }

    /// Checks that all parts fit together.
    ///
    /// # Errors
    /// [`RecordError::InvalidHeader`].
    pub fn validate(&self) -> Result<(), RecordError> {
        let fail = |reason: String| Err(RecordError::InvalidHeader { reason });
        for (what, count) in [("points", self.points), ("scalars", self.scalars)] {
            if u32::try_from(count).is_err() {
                return fail(format!("{count} {what}"));
            }
        }
        let count = self.triangles.len();
        for (t, triangle) in self.triangles.iter().enumerate() {
            if triangle.iter().any(|p| *p as usize >= self.points) {
                return fail(format!(
                    "triangle {t} {triangle:?} with {} points",
                    self.points
                ));
            }
        }
        for (what, length) in [
            ("panels", self.panels.len()),
            ("fabrics", self.fabrics.len()),
            ("material", self.material.len()),
        ] {
            if length != 0 && length != count {
                return fail(format!("{what} has {length} entries for {count} triangles"));
            }
        }
        if self
            .material
            .iter()
            .flatten()
            .flatten()
            .any(|x| !x.is_finite())
        {
            return fail("material coordinates are not finite".into());
        }
        if let Some(fault) = self.yarns.fault(self.points) {
            return fail(fault);
        }
        for body in &self.bodies {
            if body
                .triangles
                .iter()
                .flatten()
                .any(|p| *p as usize >= body.points.len())
            {
                return fail(format!(
                    "body {:?} has a triangle beyond its points",
                    body.name
                ));
            }
            if body.points.iter().flatten().any(|x| !x.is_finite()) {
                return fail(format!(
                    "body {:?} has points that are not finite",
                    body.name
                ));
            }
        }
        Ok(())
    }

    /// Digest of all that a resumed run must share: everything but the text
    /// of the scene file and the notes.
    pub fn digest(&self) -> String {
        let mut bytes = Vec::new();
        let mut e = Encoder(&mut bytes);
        e.string(1, &self.scene_name);
        e.string(2, &self.version);
        e.string(3, &canonical(&self.effective));
        e.message(4, |e| self.encode_topology(e));
        blake3::hash(&bytes).to_hex().to_string()
    }

    /// The first difference that keeps a run from being resumed.
    pub fn difference(&self, recorded: &RunHeader) -> Option<String> {
        if self.version != recorded.version {
            return Some(format!(
                "it was recorded by version {}, this is version {}",
                recorded.version, self.version
            ));
        }
        if self.scene_name != recorded.scene_name {
            return Some(format!(
                "it belongs to scene {:?}, not {:?}",
                recorded.scene_name, self.scene_name
            ));
        }
        if let Some((path, was, now)) = json_difference("", &recorded.effective, &self.effective) {
            return Some(format!(
                "the settings differ: {path} was {was} and is {now}"
            ));
        }
        for (what, was, now) in [
            ("points", recorded.points, self.points),
            ("scalar unknowns", recorded.scalars, self.scalars),
            ("triangles", recorded.triangles.len(), self.triangles.len()),
        ] {
            if was != now {
                return Some(format!("it has {was} {what}, the scene has {now}"));
            }
        }
        if self.yarns != recorded.yarns {
            return Some("the yarns differ".into());
        }
        if self.bodies != recorded.bodies {
            return Some("the bodies differ".into());
        }
        (self.digest() != recorded.digest()).then(|| "the mesh differs".into())
    }

    pub(crate) fn encode_topology(&self, e: &mut Encoder<'_>) {
        e.uint(1, self.points as u64);
        e.uint(2, self.scalars as u64);
        e.fixed32s(3, self.triangles.as_flattened().iter().copied());
        e.fixed32s(4, self.panels.iter().map(|p| u32::from(*p)));
        e.fixed32s(5, self.fabrics.iter().map(|f| u32::from(*f)));
        e.doubles(
            6,
            self.material.as_flattened().as_flattened().iter().copied(),
        );
        for name in &self.panel_names {
            e.string(7, name);
        }
        for name in &self.fabric_names {
            e.string(8, name);
        }
        for body in &self.bodies {
            e.message(9, |e| {
                e.string(1, &body.name);
                e.doubles(2, body.points.as_flattened().iter().copied());
                e.fixed32s(3, body.triangles.as_flattened().iter().copied());
            });
        }
        // Cloth without yarns is written as ever.
        if !self.yarns.is_empty() {
            e.message(10, |e| self.yarns.encode(e));
        }
    }

    /// Fills in what [`encode_topology`](Self::encode_topology) wrote.
    pub(crate) fn decode_topology(&mut self, bytes: &[u8]) -> Result<(), Malformed> {
        let (mut triangles, mut panels, mut fabrics) = (Vec::new(), Vec::new(), Vec::new());
        let mut material = Vec::new();
        for field in Fields(bytes) {
            let (field, value) = field?;
            match field {
                1 => self.points = count(value.uint()?)?,
                2 => self.scalars = count(value.uint()?)?,
                3 => value.fixed32s(&mut triangles)?,
                4 => value.fixed32s(&mut panels)?,
                5 => value.fixed32s(&mut fabrics)?,
                6 => value.doubles(&mut material)?,
                7 => self.panel_names.push(value.string()?.into()),
                8 => self.fabric_names.push(value.string()?.into()),
                9 => self.bodies.push(decode_body(value.bytes()?)?),
                10 => self.yarns = YarnPaths::decode(value.bytes()?)?,
                _ => {}
            }
        }
        self.triangles = triples(&triangles)?;
        self.panels = shorts(&panels)?;
        self.fabrics = shorts(&fabrics)?;
        let (pairs, rest) = material.as_chunks::<2>();
        let (corners, rest_pairs) = pairs.as_chunks::<3>();
        if !rest.is_empty() || !rest_pairs.is_empty() {
            return Err(Malformed);
        }
        self.material = corners.to_vec();
        Ok(())
    }
}

fn decode_body(bytes: &[u8]) -> Result<BodySurface, Malformed> {
    let mut body = BodySurface::default();
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for field in Fields(bytes) {
        let (field, value) = field?;
        match field {
            1 => body.name = value.string()?.into(),
            2 => value.doubles(&mut points)?,
            3 => value.fixed32s(&mut triangles)?,
            _ => {}
        }
    }
    let (points, rest) = points.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(Malformed);
    }
    body.points = points.to_vec();
    body.triangles = triples(&triangles)?;
    Ok(body)
}

/// Sizes that cannot overflow when multiplied by a few bytes.
fn count(value: u64) -> Result<usize, Malformed> {
    u32::try_from(value)
        .map(|n| n as usize)
        .map_err(|_| Malformed)
}

fn triples(values: &[u32]) -> Result<Vec<[u32; 3]>, Malformed> {
    let (triples, rest) = values.as_chunks::<3>();
    if rest.is_empty() {
        Ok(triples.to_vec())
    } else {
        Err(Malformed)
    }
}

fn shorts(values: &[u32]) -> Result<Vec<u16>, Malformed> {
    values
        .iter()
        .map(|v| u16::try_from(*v).map_err(|_| Malformed))
        .collect()
}

/// JSON with sorted keys, whatever order the map type keeps.
fn canonical(value: &Json) -> String {
    match value {
        Json::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by_key(|(key, _)| *key);
            let entries: Vec<_> = entries
                .into_iter()
                .map(|(key, value)| format!("{}:{}", Json::from(key.as_str()), canonical(value)))
                .collect();
            format!("{{{}}}", entries.join(","))
        }
        Json::Array(values) => {
            format!(
                "[{}]",
                values.iter().map(canonical).collect::<Vec<_>>().join(",")
            )
        }
        other => other.to_string(),
    }
}

/// Path and both values of the first difference, keys in sorted order.
fn json_difference(path: &str, was: &Json, now: &Json) -> Option<(String, String, String)> {
    match (was, now) {
        (Json::Object(a), Json::Object(b)) => {
            let mut keys: Vec<_> = a.keys().chain(b.keys()).collect();
            keys.sort();
            keys.dedup();
            keys.into_iter().find_map(|key| {
                let path = if path.is_empty() {
                    key.clone()
                } else {
                    format!("{path}.{key}")
                };
                match (a.get(key), b.get(key)) {
                    (Some(a), Some(b)) => json_difference(&path, a, b),
                    (a, b) => Some((path, show(a), show(b))),
                }
            })
        }
        (Json::Array(a), Json::Array(b)) => (0..a.len().max(b.len())).find_map(|i| {
            let path = format!("{path}[{i}]");
            match (a.get(i), b.get(i)) {
                (Some(a), Some(b)) => json_difference(&path, a, b),
                (a, b) => Some((path, show(a), show(b))),
            }
        }),
        (a, b) if a == b => None,
        (a, b) => {
            let path = if path.is_empty() { "the whole" } else { path };
            Some((path.into(), show(Some(a)), show(Some(b))))
        }
    }
}

fn show(value: Option<&Json>) -> String {
    value.map_or_else(|| "absent".into(), canonical)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Verifies that the first differing setting is named with both values.
    #[test]
    fn names_the_setting() {
        let header = |max_step: f64, text: &str| RunHeader {
            effective: json!({ "integrator": { "max_step": max_step, "kind": "be" }, "a": [1, 2] }),
            scene_text: text.into(),
            ..RunHeader::default()
        };
        let difference = header(0.02, "").difference(&header(0.01, "")).unwrap();
        assert!(
            difference.contains("integrator.max_step was 0.01 and is 0.02"),
            "{difference}"
        );
        assert_eq!(
            header(0.01, "# comment").difference(&header(0.01, "")),
            None
        );
        assert_eq!(
            header(0.01, "# comment").digest(),
            header(0.01, "").digest()
        );
        assert_ne!(header(0.02, "").digest(), header(0.01, "").digest());
    }
}
