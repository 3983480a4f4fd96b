//! How a test shows its progress: a bar on a terminal, now and then a line elsewhere, or nothing.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use tremie_fracture::Reading;

use crate::numbers::{duration, significant};
use crate::terminal;

/// Wall-clock time between two lines.
const INTERVAL: Duration = Duration::from_secs(5);

/// Shows how far a test has come.
pub(super) struct Progress {
    bar: Option<ProgressBar>,
    lines: bool,
    shown: Instant,
    begun: Instant,
    /// Steps of all beams, and those that were done before.
    all: u64,
    before: u64,
}

impl Progress {
    /// Of so many steps, of which some were done earlier.
    pub(super) fn new(quiet: bool, all: u64, before: u64) -> Self {
        let terminal = stderr().is_terminal();
        let bar = (!quiet && terminal).then(|| {
            let bar = ProgressBar::new(all);
            // The template is constant and right; the default style is no worse if it ever is not.
            if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar}\n{wide_msg}") {
                bar.set_style(style.progress_chars("=> "));
            }
            bar
        });
        let now = Instant::now();
        Self { bar, lines: !quiet && !terminal, shown: now, begun: now, all, before }
    }

    /// So many steps are done, of which the last gave a reading of a beam.
    pub(super) fn show(&mut self, done: u64, beam: u64, beams: u64, reading: &Reading, end: f64) {
        let since = done.saturating_sub(self.before).max(1);
        let left = self.begun.elapsed().as_secs_f64() / since as f64 * self.all.saturating_sub(done) as f64;
        let opening =
            format!("opening {} of {} mm", significant(1e3 * reading.opening), significant(1e3 * end));
        let prefix = if beams > 1 { format!("beam {beam} of {beams}, {opening}") } else { opening };
        let message = format!(
            "load {:.1} kN, stress {:.2} MPa, {} left",
            1e-3 * reading.load,
            1e-6 * reading.stress,
            duration(left)
        );
        if let Some(bar) = &self.bar {
            bar.set_position(done);
            bar.set_prefix(prefix);
            bar.set_message(message);
        } else if self.lines && self.shown.elapsed() >= INTERVAL {
            terminal::note(&format!("{prefix}, {message}"));
            self.shown = Instant::now();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
