use std::process::ExitCode;

use selvedge_shell_model::fabric::library;

use crate::Failure;
use crate::args::FabricCommand;
use crate::output::{self, say};

/// `selvedge fabric`
pub fn fabric(command: &FabricCommand, json: bool) -> Result<ExitCode, Failure> {
    let usage = |e: selvedge_shell_model::fabric::FabricError| Failure::Usage(e.to_string());
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
