use std::process::ExitCode;

use selvedge_shell_model::fabric::library;

use crate::Failure;
use crate::args::FabricCommand;

/// `selvedge fabric`
pub fn fabric(command: &FabricCommand) -> Result<ExitCode, Failure> {
    let usage = |e: selvedge_shell_model::fabric::FabricError| Failure::Usage(e.to_string());
    match command {
        FabricCommand::Show { name } => print!("{}", library::text(name).map_err(usage)?),
        FabricCommand::List => {
            println!(
                "{:<24} {:>8} {:>12} {:>12} {:>12} {:>12}",
                "fabric", "kg/m2", "warp N/m", "weft N/m", "B warp N m", "bending mm"
            );
            for name in library::names() {
                let f = library::get(name).map_err(usage)?;
                println!(
                    "{:<24} {:>8.3} {:>12.0} {:>12.0} {:>12.2e} {:>12.1}",
                    name,
                    f.density,
                    f.membrane.warp,
                    f.membrane.weft,
                    f.bending.warp,
                    1e3 * f.bending_length_warp()
                );
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}
