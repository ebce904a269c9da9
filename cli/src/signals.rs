//! Signals that become errors or flags instead of ending the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Lets a write beyond the limit of a file's size fail with an error that
/// names the file; by default the system ends the program without a word.
pub fn oversized_writes_fail() {
    // Nothing reads the flag: a signal that is handled no longer kills. Where
    // it cannot be handled, the program ends as it would have.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// A flag that Ctrl-C raises.
pub fn interrupt() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = flag.clone();
    // Without a handler Ctrl-C ends the program as it always does.
    let _ = ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed));
    flag
}
