use std::path::Path;
use std::process::ExitCode;

use selvedge_shell_model::fabric::{Fabric, FabricError, library, read_fabric_file};

use crate::Failure;
use crate::args::FabricCommand;
use crate::output::{self, say};

/// `selvedge fabric`
pub fn fabric(command: &FabricCommand, json: bool) -> Result<ExitCode, Failure> {
    let usage = |e: FabricError| Failure::Usage(e.to_string());
    match command {
        FabricCommand::Show { name } => {
            let text = library::text(name).map_err(usage)?;
            if json {
                say!(
                    "{}",
                    serde_json::json!({ "event": "fabric", "name": name, "text": text })
                )?;
            } else {
                output::write(format_args!("{text}"))?;
            }
        }
        FabricCommand::Eval { material, strain } => {
            let (e, l) = numbers(strain).map_err(Failure::Usage)?;
            let fabric = named(material).map_err(usage)?;
            let state = fabric.evaluate(e, l).map_err(|e| match e {
                FabricError::Value {
                    field,
                    value,
                    allowed,
                } => Failure::Usage(format!(
                    "`--strain`: {field} = {value} is impossible (it has to be {allowed})"
                )),
                other => usage(other),
            })?;
            let value = serde_json::json!({
                "fabric": fabric.name,
                "strain": { "xx": e[0], "xy": e[1], "yy": e[2] },
                "curvature_per_m": { "x": l[0], "y": l[1] },
                "energy_j_per_m2": {
                    "membrane": state.membrane_energy,
                    "bending": state.bending_energy,
                    "total": state.membrane_energy + state.bending_energy,
                },
                "stress_n_per_m": {
                    "xx": state.stress[0],
                    "xy": state.stress[1],
                    "yy": state.stress[2],
                },
                "tangent_n_per_m": state.tangent,
                "moment_n": { "x": state.moments[0], "y": state.moments[1] },
                "bending_tangent_n_m": state.bending_tangent,
            });
            if json {
                let mut event = value;
                event["event"] = "fabric-state".into();
                say!("{event}")?;
            } else {
                say!("{value:#}")?;
            }
        }
        FabricCommand::List if json => {
            for name in library::names() {
                let f = library::get(name).map_err(usage)?;
                let row = serde_json::json!({
                    "event": "fabric",
                    "name": name,
                    "density": f.density,
                    "membrane_warp": f.membrane.warp,
                    "membrane_weft": f.membrane.weft,
                    "bending_warp": f.bending.warp,
                    "bending_length_warp": f.bending_length_warp(),
                });
                say!("{row}")?;
            }
        }
        FabricCommand::List => {
            say!(
                "{:<24} {:>8} {:>12} {:>12} {:>12} {:>12}",
                "fabric",
                "kg/m2",
                "warp N/m",
                "weft N/m",
                "B warp N m",
                "bending mm"
            )?;
            for name in library::names() {
                let f = library::get(name).map_err(usage)?;
                say!(
                    "{:<24} {:>8.3} {:>12.0} {:>12.0} {:>12.2e} {:>12.1}",
                    name,
                    f.density,
                    f.membrane.warp,
                    f.membrane.weft,
                    f.bending.warp,
                    1e3 * f.bending_length_warp()
                )?;
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A fabric of the library, or that of a file.
fn named(material: &str) -> Result<Fabric, FabricError> {
    let path = Path::new(material);
    if path.extension().is_some() || path.is_file() {
        read_fabric_file(path)
    } else {
        library::get(material)
    }
}

/// Strain and curvature of `--strain`.
fn numbers(text: &str) -> Result<([f64; 3], [f64; 2]), String> {
    let wanted = "three numbers xx,xy,yy, or five with the curvatures: 0.01,0,0,20,0";
    let parsed: Result<Vec<f64>, String> = text
        .split(',')
        .map(|word| match word.trim().parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(format!(
                "`--strain`: {word:?} is not a finite number (give {wanted})"
            )),
        })
        .collect();
    match parsed?[..] {
        [xx, xy, yy] => Ok(([xx, xy, yy], [0.0; 2])),
        [xx, xy, yy, x, y] => Ok(([xx, xy, yy], [x, y])),
        ref other => Err(format!(
            "`--strain` has {} numbers (give {wanted})",
            other.len()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three numbers, five, and what is neither.
    #[test]
    fn strains() {
        assert_eq!(numbers("0.01, -0.02,0"), Ok(([0.01, -0.02, 0.0], [0.0; 2])));
        assert_eq!(numbers("0,0,0,-20,1e1"), Ok(([0.0; 3], [-20.0, 10.0])));
        for bad in [
            "",
            "0,0",
            "0,0,0,1",
            "0,0,0,1,2,3",
            "a,0,0",
            "nan,0,0",
            "0,,0",
        ] {
            assert!(numbers(bad).is_err(), "{bad}");
        }
        assert!(named("linnen").is_err() && named("none.toml").is_err());
        assert!(named("linen").is_ok());
    }
}
