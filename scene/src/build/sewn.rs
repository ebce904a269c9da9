//! A garment in a scene: where it is, and what of it is held.

use selvedge_garment::GarmentMesh;

use super::bodies::{BuiltBody, nearest_surface};

/// A garment and where the scene puts it.
#[derive(Clone)]
pub struct Sewn {
    /// Panels, seams and initial places.
    pub mesh: GarmentMesh,
    /// Rotation matrix of the placement, by rows.
    pub rotation: [[f64; 3]; 3],
    /// Translation of the placement [m].
    pub center: [f64; 3],
}

impl Sewn {
    /// A point of the pattern in the scene.
    pub fn place(&self, p: [f64; 3]) -> [f64; 3] {
        let (r, c) = (&self.rotation, &self.center);
        std::array::from_fn(|i| c[i] + (0..3).map(|j| r[i][j] * p[j]).sum::<f64>())
    }

    /// A point of the scene in the pattern.
    pub fn place_back(&self, p: [f64; 3]) -> [f64; 3] {
        self.turn_back(std::array::from_fn(|i| p[i] - self.center[i]))
    }

    /// A direction of the scene in the pattern.
    pub fn turn_back(&self, d: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| (0..3).map(|j| self.rotation[j][i] * d[j]).sum())
    }

    /// Distance [m] and direction away of the nearest body at its start, for
    /// places of the pattern.
    pub fn field<'a>(
        &'a self,
        bodies: &'a [BuiltBody],
    ) -> impl Fn([f64; 3]) -> (f64, [f64; 3]) + 'a {
        move |p| {
            let (distance, normal) = nearest_surface(bodies, self.place(p));
            (distance, self.turn_back(normal))
        }
    }
}

/// How far a garment may reach above its waist without shoulders to hang
/// from [m].
const ABOVE_WAIST: f64 = 0.1;

/// Labels that are held, `auto` replaced by what it stands for.
pub(super) fn held_labels(mesh: &GarmentMesh, asked: &[String]) -> Vec<String> {
    let height = |p: &u32| mesh.points_initial[*p as usize][1];
    let top = mesh.points_initial.iter().map(|p| p[1]);
    let top = top.fold(f64::NEG_INFINITY, f64::max);
    let hangs = |label: &str| {
        mesh.labels.get(label).is_some_and(|points| {
            let waist = points.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
            label == "strapless_top" || top - waist < ABOVE_WAIST
        })
    };
    let auto = ["strapless_top", "lower_interface"];
    let mut held = Vec::new();
    for label in asked {
        match label.as_str() {
            "auto" => held.extend(auto.iter().filter(|l| hangs(l)).map(ToString::to_string)),
            _ => held.push(label.clone()),
        }
    }
    held.sort();
    held.dedup();
    held
}

#[cfg(test)]
mod tests {
    use super::*;
    use selvedge_garment::{MeshSettings, Pattern};

    /// A square panel with two labelled edges, and perhaps a panel that
    /// reaches 30 cm above it.
    fn mesh(shoulders: bool) -> GarmentMesh {
        let square = |at: f64, labels: [&str; 2]| {
            let edge = |k: usize, label: &str| {
                let label = match label {
                    "" => String::new(),
                    l => format!(r#", "label": "{l}""#),
                };
                format!(r#"{{"endpoints": [{k}, {}]{label}}}"#, (k + 1) % 4)
            };
            format!(
                r#"{{"vertices": [[0, 0], [30, 0], [30, 30], [0, 30]],
                "edges": [{}, {}, {}, {}],
                "translation": [0, {at}, 20], "rotation": [0, 0, 0]}}"#,
                edge(0, ""),
                edge(1, ""),
                edge(2, labels[0]),
                edge(3, labels[1])
            )
        };
        let mut panels = format!(r#""skirt": {}"#, square(70.0, ["lower_interface", "side"]));
        if shoulders {
            panels += &format!(r#", "top": {}"#, square(100.0, ["strapless_top", ""]));
        }
        let text = format!(
            r#"{{"pattern": {{"panels": {{{panels}}}, "stitches": []}},
            "properties": {{"units_in_meter": 100}}}}"#
        );
        let pattern = Pattern::from_json(text.as_bytes()).expect("a pattern");
        let settings = MeshSettings {
            edge_length: 0.1,
            ..MeshSettings::default()
        };
        GarmentMesh::build(&pattern, &settings).expect("a mesh")
    }

    /// A waist is held where nothing above could carry it, a strapless top
    /// always; what is named is held as well, and an empty list is empty.
    #[test]
    fn what_is_held_by_default() {
        let auto = ["auto".to_owned()];
        assert_eq!(held_labels(&mesh(false), &auto), ["lower_interface"]);
        assert_eq!(held_labels(&mesh(true), &auto), ["strapless_top"]);
        let more = [
            "side".to_owned(),
            "auto".to_owned(),
            "lower_interface".to_owned(),
        ];
        assert_eq!(
            held_labels(&mesh(false), &more),
            ["lower_interface", "side"]
        );
        assert!(held_labels(&mesh(false), &[]).is_empty());
    }
}
