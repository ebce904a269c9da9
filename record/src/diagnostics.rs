use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the integrator reports about one step, accepted or rejected.
///
/// Written as JSON with a published schema. JSON has no NaN and no infinity:
/// such a number is written as `null` and read back as NaN.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct StepDiagnostics {
    /// Simulated time at the end of the step, in s.
    #[serde(with = "nullable")]
    #[schemars(with = "Option<f64>")]
    pub time: f64,
    /// Number of accepted steps up to this one.
    pub step: u64,
    /// Step size, in s.
    #[serde(with = "nullable")]
    #[schemars(with = "Option<f64>")]
    pub dt: f64,
    /// Whether the step was taken.
    pub accepted: bool,
    /// Newton iterations.
    pub newton_iterations: u32,
    /// Iterations of the linear solver, summed over the Newton iterations.
    pub linear_iterations: u32,
    /// Halvings of the line search, summed over the Newton iterations.
    pub line_search_halvings: u32,
    /// Residual at the end, as a velocity, in m/s.
    #[serde(with = "nullable")]
    #[schemars(with = "Option<f64>")]
    pub residual: f64,
    /// Potential energies by term, in J.
    #[serde(with = "named")]
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    pub energies: Vec<(String, f64)>,
    /// Kinetic energy, in J.
    #[serde(with = "nullable")]
    #[schemars(with = "Option<f64>")]
    pub kinetic: f64,
    /// Active contacts.
    pub contacts: usize,
    /// Pairs that the broad phase handed on.
    pub candidates: usize,
    /// Deepest penetration, in m.
    #[serde(with = "nullable")]
    #[schemars(with = "Option<f64>")]
    pub max_penetration: f64,
    /// Every pin of the scene.
    pub pins: Vec<PinState>,
    /// Wall-clock seconds by stage. The only part that differs from run to
    /// run.
    #[serde(with = "named")]
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    pub ledger: Vec<(String, f64)>,
    /// Why a step was rejected, or another remark; mostly empty.
    pub note: String,
}

/// What a pin does at the end of a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct PinState {
    /// Its name, `pin.0` and so on in the order of the scene.
    pub name: String,
    /// Sum of the forces with which it holds its points, inertia and friction
    /// included, in N.
    #[serde(with = "nullable::three")]
    #[schemars(with = "[Option<f64>; 3]")]
    pub force: [f64; 3],
    /// Mean position of its points, in m.
    #[serde(with = "nullable::three")]
    #[schemars(with = "[Option<f64>; 3]")]
    pub place: [f64; 3],
}

impl StepDiagnostics {
    /// The JSON schema of the diagnostics channel.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(StepDiagnostics).to_value()
    }

    /// Sum of the potential energies and the kinetic energy, in J.
    pub fn total_energy(&self) -> f64 {
        self.energies.iter().map(|e| e.1).sum::<f64>() + self.kinetic
    }
}

mod nullable {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, s: S) -> Result<S::Ok, S::Error> {
        value.is_finite().then_some(value).serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(d)?.unwrap_or(f64::NAN))
    }

    pub mod three {
        use super::{Deserialize, Deserializer, Serialize, Serializer};

        pub fn serialize<S: Serializer>(value: &[f64; 3], s: S) -> Result<S::Ok, S::Error> {
            value.map(|x| x.is_finite().then_some(x)).serialize(s)
        }

        pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<[f64; 3], D::Error> {
            Ok(<[Option<f64>; 3]>::deserialize(d)?.map(|x| x.unwrap_or(f64::NAN)))
        }
    }
}

/// An object whose keys keep their order.
mod named {
    use std::fmt;

    use serde::de::{Deserializer, MapAccess, Visitor};
    use serde::ser::Serializer;

    pub fn serialize<S: Serializer>(values: &[(String, f64)], s: S) -> Result<S::Ok, S::Error> {
        s.collect_map(values.iter().map(|(k, v)| (k, v.is_finite().then_some(*v))))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<(String, f64)>, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Vec<(String, f64)>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of numbers")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut pairs = Vec::new();
                while let Some((key, value)) = map.next_entry::<String, Option<f64>>()? {
                    pairs.push((key, value.unwrap_or(f64::NAN)));
                }
                Ok(pairs)
            }
        }
        d.deserialize_map(Pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verifies that JSON keeps every bit of finite numbers, the order of the
    /// names, and tells NaN from zero.
    #[test]
    fn json_round_trip() {
        let d = StepDiagnostics {
            time: 0.1 + 0.2,
            step: 7,
            dt: 1.0 / 3.0,
            residual: f64::INFINITY,
            energies: vec![("z".into(), 1e-300), ("a".into(), f64::NAN)],
            pins: vec![PinState {
                name: "pin.0".into(),
                force: [0.1, f64::NAN, -1e-300],
                place: [1.0 / 3.0, 0.0, 7.0],
            }],
            ledger: vec![("solve".into(), 0.123_456_789_012_345_68)],
            ..StepDiagnostics::default()
        };
        let text = serde_json::to_string(&d).unwrap();
        let back: StepDiagnostics = serde_json::from_str(&text).unwrap();
        assert_eq!(back.time.to_bits(), d.time.to_bits());
        assert_eq!(back.ledger, d.ledger);
        assert!(back.residual.is_nan());
        assert_eq!(back.pins[0].place, d.pins[0].place);
        assert_eq!(back.pins[0].force[0], 0.1);
        assert!(back.pins[0].force[1].is_nan());
        assert_eq!(back.energies[0], d.energies[0]);
        assert_eq!(back.energies[1].0, "a");
        assert!(back.energies[1].1.is_nan());
    }
}
