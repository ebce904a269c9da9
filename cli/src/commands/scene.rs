use std::process::ExitCode;

use selvedge_scene::build::{Built, BuiltScene};
use selvedge_scene::file;

use crate::Failure;
use crate::args::SceneArgs;
use crate::failure::print_findings;
use crate::output::{self, say};
use crate::progress::Reporter;

/// The scene, and on the way what takes its time.
fn read(args: &SceneArgs, json: bool) -> Result<BuiltScene, Failure> {
    let mut reporter = Reporter::new(json);
    let built = BuiltScene::watched(file::read(&args.scene, &args.set)?, &mut reporter);
    reporter.finish();
    Ok(built?)
}

/// `selvedge check`
pub fn check(args: &SceneArgs, json: bool) -> Result<ExitCode, Failure> {
    let built = read(args, json)?;
    // What only shows when the parts are put together.
    assemble(&built)?;
    if json {
        let findings = built.warnings.to_json();
        say!(
            "{}",
            serde_json::json!({ "event": "check", "findings": findings })
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    print_findings(&built.warnings);
    say!(
        "{}: no errors, {} warnings; {} points, {} triangles, {} bodies",
        built.scene().name,
        built.warnings.len(),
        built.geometry.mesh.points(),
        built.geometry.mesh.triangles().len(),
        built.bodies.len()
    )?;
    Ok(ExitCode::SUCCESS)
}

/// `selvedge plan`
pub fn plan(args: &SceneArgs, json: bool) -> Result<ExitCode, Failure> {
    let built = read(args, json)?;
    let Built {
        simulation,
        effects,
        ..
    } = assemble(&built)?;
    if json {
        say!(
            "{}",
            serde_json::json!({ "event": "plan", "effects": effects })
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    say!(
        "{}: {}",
        built.scene().name,
        simulation.plan().system.name()
    )?;
    say!(
        "{:<28} {:<4} {:>10} {:>12}  reason",
        "effect",
        "",
        "stencils",
        "bytes"
    )?;
    for e in &effects {
        let on = if e.on { "on" } else { "off" };
        say!(
            "{:<28} {:<4} {:>10} {:>12}  {}",
            e.name,
            on,
            e.stencils,
            e.bytes,
            e.reason
        )?;
    }
    say!(
        "{} points, {} bytes in all, {:.0} a point",
        built.geometry.mesh.points(),
        simulation.heap_bytes(),
        simulation.heap_bytes() as f64 / built.geometry.mesh.points().max(1) as f64
    )?;
    Ok(ExitCode::SUCCESS)
}

/// `selvedge schema`
pub fn schema(markdown: bool, json: bool) -> Result<ExitCode, Failure> {
    if markdown {
        output::write(format_args!("{}", file::key_reference()))?;
    } else {
        output::value(&file::json_schema(), json)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn assemble(built: &BuiltScene) -> Result<Built, Failure> {
    let state = built.geometry.start();
    Ok(built.simulation(state, &built.drape_stage())?)
}
