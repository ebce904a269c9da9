//! The `selvedge` program.

use std::process::ExitCode;

use clap::Parser;
use selvedge_cli::args::{self, Cli};
use selvedge_cli::commands;

fn main() -> ExitCode {
    #[cfg(target_arch = "x86_64")]
    if !(std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma")) {
        eprintln!("error: selvedge is built for processors with AVX2 and FMA");
        return ExitCode::from(3);
    }
    let cli = Cli::parse_from(args::arguments(std::env::args_os()));
    match commands::dispatch(&cli) {
        Ok(code) => code,
        Err(failure) => failure.report(cli.json),
    }
}
