use std::io::Write;
use std::path::Path;

use crate::atomic::write_atomically;
use crate::{RecordError, Recording};

/// Frames a second that a point cache counts its start in.
const RATE: f64 = 24.0;

/// Writes a point cache: a header of 32 bytes and `f32` coordinates.
pub(super) fn write(
    recording: &Recording,
    indices: &[usize],
    path: &Path,
) -> Result<(), RecordError> {
    let points = recording.header().points;
    let too_many = |_| RecordError::Export {
        reason: format!("too large for PC2: {points} points"),
    };
    let count = i32::try_from(points).map_err(too_many)?;
    let samples = i32::try_from(indices.len()).map_err(too_many)?;
    let times: Vec<f64> = indices
        .iter()
        .map(|&i| recording.frames()[i].time)
        .collect();
    let interval = interval(&times)?;
    let mut failed = None;
    let written = write_atomically(path, |out| {
        out.write_all(b"POINTCACHE2\0")?;
        out.write_all(&1_i32.to_le_bytes())?;
        out.write_all(&count.to_le_bytes())?;
        out.write_all(&((times[0] * RATE) as f32).to_le_bytes())?;
        out.write_all(&((interval * RATE) as f32).to_le_bytes())?;
        out.write_all(&samples.to_le_bytes())?;
        for &index in indices {
            let frame = match recording.frame(index) {
                Ok(frame) => frame,
                Err(error) => {
                    failed = Some(error);
                    return Err(std::io::ErrorKind::Other.into());
                }
            };
            for x in &frame.positions[..3 * points] {
                out.write_all(&(*x as f32).to_le_bytes())?;
            }
        }
        Ok(())
    });
    match failed {
        Some(error) => Err(error),
        None => written,
    }
}

/// The format knows one distance between samples, so frames must be even.
fn interval(times: &[f64]) -> Result<f64, RecordError> {
    let [first, .., last] = times else {
        return Ok(1.0 / RATE);
    };
    let interval = (last - first) / (times.len() - 1) as f64;
    for (i, time) in times.iter().enumerate() {
        let off = time - (first + interval * i as f64);
        if off.abs() > 0.01 * interval {
            let reason =
                format!("PC2 needs evenly spaced frames: frame at {time} s is off by {off} s");
            return Err(RecordError::Export { reason });
        }
    }
    Ok(interval)
}
