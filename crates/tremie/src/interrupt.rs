//! Ctrl-C: the first asks a run to end in good order, the second ends the program at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::terminal;

/// Exit code after an interruption: 128 and the number of the signal, as shells have it.
pub(crate) const EXIT_CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on the flag returned becomes true at the first Ctrl-C (or request to terminate).
pub(crate) fn watch() -> anyhow::Result<&'static AtomicBool> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(EXIT_CODE.into());
        }
        terminal::note("\nFinishing the step and saving it; press Ctrl-C again to end at once");
    })?;
    Ok(&REQUESTED)
}
