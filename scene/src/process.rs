//! What the operating system knows of this process. Linux only; elsewhere the
//! figures are zero.

use std::fs;
use std::time::{Duration, Instant};

/// Wall and user time since a moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    wall: Instant,
    user: f64,
}

impl Stopwatch {
    pub fn start() -> Self {
        Self {
            wall: Instant::now(),
            user: user_seconds(),
        }
    }

    pub fn wall(&self) -> Duration {
        self.wall.elapsed()
    }

    /// User time of all threads \[s\], to 10 ms.
    pub fn user(&self) -> f64 {
        user_seconds() - self.user
    }
}

/// User time of all threads so far [s], to 10 ms.
pub fn user_seconds() -> f64 {
    let Ok(stat) = fs::read_to_string("/proc/self/stat") else {
        return 0.0;
    };
    // The second field may contain spaces; count from its closing parenthesis.
    let Some((_, rest)) = stat.rsplit_once(')') else {
        return 0.0;
    };
    let ticks = rest
        .split_ascii_whitespace()
        .nth(11)
        .and_then(|t| t.parse::<f64>().ok());
    // The kernel reports in units of USER_HZ, 100 on every Linux.
    ticks.map_or(0.0, |t| t / 100.0)
}

/// Largest resident memory so far [bytes].
pub fn peak_memory_bytes() -> u64 {
    let Ok(status) = fs::read_to_string("/proc/self/status") else {
        return 0;
    };
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|value| value.trim().strip_suffix("kB"))
        .and_then(|value| value.trim().parse::<u64>().ok())
        .map_or(0, |kib| 1024 * kib)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Work shows up in the user time, an allocation in the peak.
    #[cfg(target_os = "linux")]
    #[test]
    fn figures_grow() {
        let block = vec![1u8; 50_000_000];
        assert!(peak_memory_bytes() > 50_000_000);
        let mut sum = 0u64;
        // Other tests of the process may have worked already.
        let end = user_seconds() + 0.02;
        while user_seconds() < end {
            sum = block
                .iter()
                .fold(sum, |s, b| s.wrapping_mul(31).wrapping_add(u64::from(*b)));
        }
        assert!(std::hint::black_box(sum) > 0);
    }
}
