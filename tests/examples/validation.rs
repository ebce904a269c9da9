//! All validations against closed forms, as a page.
//!
//! `cargo run -p selvedge-tests --example validation -- [FILE.md] [CASE]…`
//!
//! Without a file, or with `-`, the page goes to the terminal. `--quick` runs
//! the coarse end of the ladders alone. Ends with status 1 when a limit is
//! missed.

use std::process::ExitCode;
use std::time::Instant;

use selvedge_tests::suite::{Effort, all, markdown};

fn main() -> std::io::Result<ExitCode> {
    let (flags, words): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|a| a.starts_with("--"));
    let effort = if flags.iter().any(|f| f == "--quick") {
        Effort::Quick
    } else {
        Effort::Full
    };
    let (file, names) = match words.split_first() {
        Some((file, names)) => (file.as_str(), names),
        None => ("-", &[][..]),
    };
    let mut results = Vec::new();
    let mut good = true;
    for case in all() {
        if !(names.is_empty() || names.iter().any(|n| n == case.name)) {
            continue;
        }
        let start = Instant::now();
        let measured = (case.run)(effort);
        let seconds = start.elapsed().as_secs_f64();
        let holds = measured.ladders.iter().all(|l| l.finding().holds);
        good &= holds;
        let verdict = if holds { "met" } else { "missed" };
        eprintln!("{}: {verdict}, {seconds:.1} s", case.name);
        results.push((case, measured, seconds));
    }
    let command = "cargo run -p selvedge-tests --example validation -- docs/validation.md";
    let page = markdown(&results, command);
    if file == "-" {
        print!("{page}");
    } else {
        std::fs::write(file, page)?;
    }
    Ok(if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
