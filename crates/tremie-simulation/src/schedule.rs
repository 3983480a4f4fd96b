//! When something that recurs in simulated time is due: at the first step at or past each multiple of its interval.
//!
//! The moments depend on simulated time alone, so that results do not depend on the machine.

use serde::{Deserialize, Serialize};

/// Relative tolerance within which a time counts as a multiple of the interval: time steps add up with rounding.
const TOLERANCE: f64 = 1e-9;

/// What has been done so far. The interval in s is the case's and is said when asking.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Schedule {
    /// Multiple of the interval that comes next.
    next: u64,
    /// How many times it has been done, which is the number of the next file.
    pub(crate) count: u64,
    /// Time in s of the last one.
    last: Option<f64>,
}

impl Schedule {
    pub(crate) fn due(&self, time: f64, interval: f64) -> bool {
        multiple(time, interval) >= self.next
    }

    pub(crate) fn done(&mut self, time: f64, interval: f64) {
        self.next = multiple(time, interval) + 1;
        self.count += 1;
        self.last = Some(time);
    }

    /// Whether it has been done at this very time.
    pub(crate) fn done_at(&self, time: f64) -> bool {
        self.last == Some(time)
    }
}

/// Whether a time has reached a moment, both in s.
pub(crate) fn reached(time: f64, moment: f64) -> bool {
    time * (1.0 + TOLERANCE) >= moment
}

/// Largest multiple of the interval that a time has reached.
fn multiple(time: f64, interval: f64) -> u64 {
    (time / interval * (1.0 + TOLERANCE)).floor() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times at which something every `interval` is done in `steps` steps of `step`.
    fn times(interval: f64, step: f64, steps: usize) -> Vec<f64> {
        let (mut schedule, mut time, mut done) = (Schedule::default(), 0.0, Vec::new());
        for _ in 0..=steps {
            if schedule.due(time, interval) {
                schedule.done(time, interval);
                assert!(schedule.done_at(time) && !schedule.due(time, interval));
                done.push((time * 1e6f64).round() / 1e6);
            }
            time += step;
        }
        done
    }

    #[test]
    fn multiples_are_met_in_spite_of_rounding() {
        assert_eq!(times(0.3, 0.1, 10), [0.0, 0.3, 0.6, 0.9]);
    }

    #[test]
    fn the_first_step_past_a_multiple_counts_and_multiples_in_between_are_left_out() {
        assert_eq!(times(1.0, 0.4, 6), [0.0, 1.2, 2.0]);
        assert_eq!(times(0.1, 0.25, 4), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }
}
