//! How a run shows its progress: a bar on a terminal, now and then a line elsewhere, or nothing.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use tremie_simulation::{Observer, Progress};

use crate::numbers::{duration, significant};
use crate::terminal;

/// Wall-clock time between two lines.
const LINE_INTERVAL: Duration = Duration::from_secs(5);
/// Length of the bar in steps, much finer than its characters.
const LENGTH: u64 = 1000;

/// Shows the progress of a run that may end before its time if `rests`; the observer to use where it is not `quiet`.
pub(crate) fn observer(quiet: bool, rests: bool) -> Box<dyn Observer> {
    if quiet {
        Box::new(())
    } else if stderr().is_terminal() {
        let bar = ProgressBar::new(LENGTH);
        // The template is constant and right; the default style is no worse if it ever is not.
        if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar}\n{wide_msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Box::new(Bar { bar, rests })
    } else {
        Box::new(Lines { last: None, rests })
    }
}

struct Bar {
    bar: ProgressBar,
    rests: bool,
}

impl Observer for Bar {
    fn progress(&mut self, progress: &Progress) {
        let share = (progress.time / progress.end_time).clamp(0.0, 1.0);
        self.bar.set_position((share * LENGTH as f64) as u64);
        self.bar.set_prefix(moment(progress));
        self.bar.set_message(describe(progress, self.rests));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

struct Lines {
    last: Option<Instant>,
    rests: bool,
}

impl Observer for Lines {
    fn progress(&mut self, progress: &Progress) {
        let first = *self.last.get_or_insert_with(Instant::now);
        if first.elapsed() >= LINE_INTERVAL {
            terminal::note(&format!("{}, {}", moment(progress), describe(progress, self.rests)));
            self.last = Some(Instant::now());
        }
    }
}

fn moment(progress: &Progress) -> String {
    format!("t = {:.2} s of {} s", progress.time, significant(progress.end_time))
}

/// What the run does at present, and how long it will take; `rests` if it may end before its time.
fn describe(progress: &Progress, rests: bool) -> String {
    let mut parts = Vec::new();
    if let Some(spread) = &progress.readings.spread {
        parts.push(format!("spread {:.0} mm", 1e3 * spread.mean));
    }
    parts.push(format!("{:.0} steps/s", progress.steps_per_second));
    parts.push(format!("{:.1} M updates/s", 1e-6 * progress.updates_per_second));
    if let Some(left) = progress.time_left {
        parts.push(format!("{}{} left", if rests { "at most " } else { "" }, duration(left)));
    }
    parts.join(", ")
}
