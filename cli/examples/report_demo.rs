//! Writes a report about a made-up drape (a square sheet over a ball), so that the
//! page can be looked at without a simulation.
//!
//! `cargo run -p selvedge-cli --example report_demo -- /tmp/report.html`

#[path = "support/sheet.rs"]
mod sheet;

fn main() -> std::io::Result<()> {
    let path = std::env::args_os().nth(1).map_or_else(
        || std::env::temp_dir().join("selvedge_report_demo.html"),
        std::path::PathBuf::from,
    );
    let data = sheet::demo(100, 60);
    let start = std::time::Instant::now();
    let html = selvedge_cli::report::render(&data);
    println!(
        "{}: {:.1} MiB in {:.2} s",
        path.display(),
        html.len() as f64 / 1_048_576.0,
        start.elapsed().as_secs_f64()
    );
    assert!(html.len() < selvedge_cli::report::MAX_BYTES);
    std::fs::write(path, html)
}
