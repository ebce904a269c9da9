//! A small sheet with a made-up motion: every state follows from the step.
#![allow(dead_code)] // each test file uses its part

use std::path::Path;

use selvedge_record::{
    BodySurface, Checkpoint, LogLevel, PinState, RecordError, Recorder, RecorderOptions, Recording,
    RunHeader, StepDiagnostics,
};
use serde_json::json;
use std::time::Duration;

pub const DT: f64 = 1.0 / 60.0;

/// A sheet of `n × n` points in two fabrics, one scalar, one body.
pub fn header(n: usize) -> RunHeader {
    let id = |i: usize, j: usize| (i * n + j) as u32;
    let at = |i: usize, j: usize| [i as f64 * 0.01, j as f64 * 0.01];
    let (mut triangles, mut material) = (Vec::new(), Vec::new());
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let (a, b, c, d) = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1));
            for corners in [[a, b, c], [a, c, d]] {
                triangles.push(corners.map(|(i, j)| id(i, j)));
                material.push(corners.map(|(i, j)| at(i, j)));
            }
        }
    }
    let half = triangles.len() / 2;
    RunHeader {
        scene_name: "sheet".into(),
        scene_text: "name = \"sheet\" # ünïcode\n".into(),
        effective: json!({ "integrator": { "max_step": DT, "kind": "backward-euler" } }),
        notes: json!({ "threads": 2 }),
        version: "0.1.0".into(),
        points: n * n,
        scalars: 1,
        panels: (0..triangles.len()).map(|t| u16::from(t >= half)).collect(),
        fabrics: (0..triangles.len()).map(|t| u16::from(t >= half)).collect(),
        panel_names: vec!["front".into(), "back".into()],
        fabric_names: vec!["cotton".into(), "silk".into()],
        triangles,
        material,
        bodies: vec![BodySurface {
            name: "floor".into(),
            points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1]],
        }],
        ..RunHeader::default()
    }
}

/// Unknowns and rates after `step` steps.
pub fn state(header: &RunHeader, step: u64) -> (Vec<f64>, Vec<f64>) {
    let n = (header.points as f64).sqrt() as usize;
    let t = step as f64 * DT;
    let mut q = Vec::new();
    let mut v = Vec::new();
    for p in 0..header.points {
        let (x, z) = ((p / n) as f64 * 0.01, (p % n) as f64 * 0.01);
        let phase = 20.0 * x + 13.0 * z + 5.0 * t;
        q.extend([x, 1.0 + 0.02 * phase.sin(), z]);
        v.extend([0.0, 0.1 * phase.cos(), 0.0]);
    }
    q.extend(std::iter::repeat_n(t, header.scalars));
    v.extend(std::iter::repeat_n(1.0, header.scalars));
    (q, v)
}

pub fn diagnostics(step: u64) -> StepDiagnostics {
    StepDiagnostics {
        time: step as f64 * DT,
        step,
        dt: DT,
        accepted: true,
        newton_iterations: 3,
        linear_iterations: 40 + step as u32,
        residual: 1e-7 / (1.0 + step as f64),
        energies: vec![
            ("membrane".into(), 0.1 * step as f64),
            ("bending".into(), 1.0 / 3.0),
        ],
        kinetic: 0.25,
        contacts: 5,
        candidates: 50,
        max_penetration: 1e-5,
        pins: vec![PinState {
            name: "pin.0".into(),
            force: [0.1 * step as f64, -1.0 / 3.0, 0.0],
            place: [0.0, 1.0, 2.0],
        }],
        ledger: vec![("assembly".into(), 0.5)],
        ..StepDiagnostics::default()
    }
}

pub fn checkpoint(header: &RunHeader, step: u64) -> Checkpoint {
    let (q, v) = state(header, step);
    Checkpoint {
        time: step as f64 * DT,
        step,
        sections: vec![
            ("q".into(), q),
            ("v".into(), v),
            ("history".into(), vec![f64::NAN, -0.0]),
        ],
    }
}

/// Chunks depend on the frames alone, not on the clock.
pub fn options() -> RecorderOptions {
    RecorderOptions {
        flush_frames: 3,
        flush_interval: Duration::MAX,
        point_channel: true,
        sync_checkpoints: false,
        ..RecorderOptions::default()
    }
}

/// Steps of a run: a frame every step, a checkpoint every `every` steps.
pub fn advance(
    recorder: &mut Recorder,
    header: &RunHeader,
    steps: std::ops::Range<u64>,
    every: u64,
    mut after: impl FnMut(u64),
) -> Result<(), RecordError> {
    for step in steps {
        let (q, v) = state(header, step);
        recorder.diagnostics(&diagnostics(step))?;
        recorder.frame(step as f64 * DT, step, &q, &v)?;
        if step % 7 == 0 {
            recorder.log(step as f64 * DT, LogLevel::Warning, &format!("step {step}"))?;
        }
        if step % every == every - 1 {
            recorder.checkpoint(&checkpoint(header, step))?;
        }
        after(step);
    }
    Ok(())
}

/// A complete run.
pub fn record(path: &Path, header: &RunHeader, steps: u64, every: u64) {
    let mut recorder = Recorder::create(path, header, options()).unwrap();
    advance(&mut recorder, header, 0..steps, every, |_| {}).unwrap();
    recorder.finish(&json!({ "status": "finished" })).unwrap();
}

/// Every frame that is there is the right one, bit for bit.
pub fn assert_frames(recording: &Recording, header: &RunHeader) {
    for (i, info) in recording.frames().iter().enumerate() {
        let (q, v) = state(header, info.step);
        let frame = recording.frame(i).unwrap();
        assert_eq!(frame.time.to_bits(), (info.step as f64 * DT).to_bits());
        assert!(
            bits(&frame.positions) == bits(&q),
            "positions of step {}",
            info.step
        );
        assert!(
            bits(&frame.velocities) == bits(&v),
            "velocities of step {}",
            info.step
        );
    }
}

pub fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}
