//! Records a swinging sheet, stops half way, resumes, and reads it all back.

use std::error::Error;

use selvedge_record::export::{Format, FrameRange, export};
use selvedge_record::{
    Checkpoint, Recorder, RecorderOptions, Recording, RunHeader, StepDiagnostics,
};
use serde_json::json;

const SIDE: usize = 20;
const DT: f64 = 0.02;

/// The "simulation": a wave through a square of 1 m.
fn state(step: u64) -> Vec<f64> {
    let t = step as f64 * DT;
    (0..SIDE * SIDE)
        .flat_map(|p| {
            let (x, z) = ((p / SIDE) as f64 / 19.0, (p % SIDE) as f64 / 19.0);
            [x, 1.0 + 0.05 * (6.0 * x + 4.0 * z - 8.0 * t).sin(), z]
        })
        .collect()
}

fn steps(recorder: &mut Recorder, range: std::ops::Range<u64>) -> Result<(), Box<dyn Error>> {
    for step in range {
        let (time, q) = (step as f64 * DT, state(step));
        let d = StepDiagnostics {
            time,
            step,
            dt: DT,
            accepted: true,
            ..Default::default()
        };
        recorder.diagnostics(&d)?;
        recorder.frame(time, step, &q, &vec![0.0; q.len()])?;
        if step % 10 == 9 {
            recorder.checkpoint(&Checkpoint {
                time,
                step,
                sections: vec![("q".into(), q)],
            })?;
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join("selvedge-record-example");
    let path = folder.join("run.mcap");
    let quad = |i: usize| [i, i + SIDE, i + SIDE + 1, i + 1].map(|p| p as u32);
    let quads = (0..SIDE * (SIDE - 1))
        .filter(|i| i % SIDE != SIDE - 1)
        .map(quad);
    let header = RunHeader {
        scene_name: "wave".into(),
        scene_text: "name = \"wave\"\n".into(),
        effective: json!({ "dt": DT }),
        version: env!("CARGO_PKG_VERSION").into(),
        points: SIDE * SIDE,
        triangles: quads
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        ..RunHeader::default()
    };

    let mut recorder = Recorder::create(&path, &header, RecorderOptions::default())?;
    steps(&mut recorder, 0..37)?;
    drop(recorder); // as if it had been interrupted

    let (mut recorder, from) = Recorder::resume(&path, &header, RecorderOptions::default())?;
    println!(
        "resumed after step {} with {} values",
        from.step,
        from.require("q", 1200)?.len()
    );
    assert_eq!(from.step, 29);
    steps(&mut recorder, from.step + 1..50)?;
    recorder.finish(&json!({ "status": "finished" }))?;

    let recording = Recording::open(&path)?;
    assert!(recording.is_complete() && recording.warnings().is_empty());
    assert_eq!(recording.frames().len(), 50);
    assert_eq!(recording.frame(49)?.positions, state(49));
    let bytes = std::fs::metadata(&path)?.len();
    println!(
        "{} frames in {bytes} bytes: {}",
        recording.frames().len(),
        path.display()
    );

    let files = export(
        &recording,
        Format::Glb,
        FrameRange::ALL,
        &folder.join("run.glb"),
    )?;
    println!("exported {}", files[0].display());
    Ok(())
}
