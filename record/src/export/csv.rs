use std::io::{self, Write};
use std::path::Path;

use crate::atomic::write_atomically;
use crate::{RecordError, Recording, StepDiagnostics};

/// Writes what the accepted steps report as a table of comma-separated values:
/// time and step [s], energies by term and kinetic energy [J], residual [m/s],
/// contacts, and of every pin the force [N] and the mean place [m] of its points.
/// Names and columns are those of the first accepted step; numbers are written
/// so that every bit is read back, what is not finite as an empty cell.
///
/// # Errors
/// [`RecordError::Export`] without an accepted step, [`RecordError::Write`].
pub fn write_steps_csv(recording: &Recording, path: &Path) -> Result<(), RecordError> {
    let steps = recording.diagnostics().iter().filter(|d| d.accepted);
    let Some(first) = steps.clone().next() else {
        let reason = "no step is recorded".to_owned();
        return Err(RecordError::Export { reason });
    };
    write_atomically(path, |out| {
        head(first, out)?;
        steps.clone().try_for_each(|d| row(first, d, out))
    })
}

fn head(first: &StepDiagnostics, out: &mut dyn Write) -> io::Result<()> {
    write!(
        out,
        "time [s],step,dt [s],residual [m/s],contacts,kinetic [J]"
    )?;
    for (name, _) in &first.energies {
        write!(out, ",{name} [J]")?;
    }
    for pin in &first.pins {
        for (what, unit) in [("force", "N"), ("place", "m")] {
            for axis in ["x", "y", "z"] {
                write!(out, ",{} {what} {axis} [{unit}]", pin.name)?;
            }
        }
    }
    writeln!(out)
}

fn row(first: &StepDiagnostics, d: &StepDiagnostics, out: &mut dyn Write) -> io::Result<()> {
    number(d.time, out)?;
    write!(out, ",{}", d.step)?;
    for value in [d.dt, d.residual] {
        out.write_all(b",")?;
        number(value, out)?;
    }
    write!(out, ",{}", d.contacts)?;
    let energies = first.energies.iter().map(|(name, _)| {
        let of = d.energies.iter().find(|e| e.0 == *name);
        of.map_or(f64::NAN, |e| e.1)
    });
    let pins = first.pins.iter().flat_map(|pin| {
        let of = d.pins.iter().find(|p| p.name == pin.name);
        let none = [f64::NAN; 3];
        let [force, place] = of.map_or([none; 2], |p| [p.force, p.place]);
        force.into_iter().chain(place)
    });
    for value in std::iter::once(d.kinetic).chain(energies).chain(pins) {
        out.write_all(b",")?;
        number(value, out)?;
    }
    writeln!(out)
}

fn number(value: f64, out: &mut dyn Write) -> io::Result<()> {
    match value.is_finite() {
        true => write!(out, "{value:?}"),
        false => Ok(()),
    }
}
