//! One file a command.

mod bench;
mod fabric;
mod hard;
mod results;
mod run;
mod scene;
mod study;

use std::process::ExitCode;

use crate::Failure;
use crate::args::{Cli, Command};
use crate::signals;

pub use study::StudyArgs;

/// Does what the command line asks for.
///
/// # Errors
/// [`Failure`], with the exit status it stands for.
pub fn dispatch(cli: &Cli) -> Result<ExitCode, Failure> {
    signals::oversized_writes_fail();
    match &cli.command {
        Command::Run(args) => run::run(args, cli.json),
        Command::Drape(args) => run::drape(args, cli.json),
        Command::Check(args) => scene::check(args, cli.json),
        Command::Plan(args) => scene::plan(args, cli.json),
        Command::Compare { a, b } => results::compare(a, b, cli.json),
        Command::Export {
            run,
            format,
            output,
            last,
        } => results::export(run, *format, output.as_deref(), *last, cli.json),
        Command::View { run } => results::view(run, cli.json),
        Command::Fabric { command } => fabric::fabric(command, cli.json),
        Command::Schema { markdown } => scene::schema(*markdown, cli.json),
        Command::Study(args) => study::study(args, cli.json),
        Command::StudyJob => study::job(),
        Command::Hard(args) => hard::hard(args, cli.json),
        Command::Bench(args) => bench::bench(args, cli.json),
    }
}
