//! What a run tells of its progress while it goes on.

use std::time::{Duration, Instant};

use crate::gauges::Readings;

/// Shortest wall-clock time between two reports.
const REPORT_INTERVAL: Duration = Duration::from_millis(50);
/// Wall-clock time in s over which rates are averaged, so that they can be read.
const AVERAGING_TIME: f64 = 2.0;

/// Watches a run, to show its progress.
pub trait Observer {
    /// Called about every 50 ms of wall-clock time at most, and at the end.
    fn progress(&mut self, progress: &Progress);
}

/// Shows nothing.
impl Observer for () {
    fn progress(&mut self, _: &Progress) {}
}

/// The progress of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Simulated time in s.
    pub time: f64,
    /// Simulated time in s at which the run ends at the latest.
    pub end_time: f64,
    /// Time steps since the start of the run.
    pub steps: u64,
    /// Time steps per second of wall-clock time, at present.
    pub steps_per_second: f64,
    /// Updates of wet cells or nodes per second of wall-clock time, at present.
    pub updates_per_second: f64,
    /// Wall-clock time in s until `end_time` at the present pace; a run that comes to rest ends earlier.
    pub time_left: Option<f64>,
    /// The latest readings of the gauges.
    pub readings: Readings,
}

/// Decides when to report, and averages rates.
#[derive(Debug)]
pub(crate) struct Meter {
    last: (Instant, Amounts),
    /// Per second of wall-clock time; none before the first report.
    rates: Option<Amounts>,
}

/// What a run has done so far, or does per second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Amounts {
    pub(crate) time: f64,
    pub(crate) steps: f64,
    pub(crate) updates: f64,
}

impl Amounts {
    fn with(self, other: Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            time: combine(self.time, other.time),
            steps: combine(self.steps, other.steps),
            updates: combine(self.updates, other.updates),
        }
    }
}

impl Meter {
    pub(crate) fn new(now: Instant, amounts: Amounts) -> Self {
        Self { last: (now, amounts), rates: None }
    }

    /// Whether enough time has passed for the next report.
    pub(crate) fn due(&self, now: Instant) -> bool {
        now - self.last.0 >= REPORT_INTERVAL
    }

    /// Rates at present, per second of wall-clock time.
    pub(crate) fn rates(&mut self, now: Instant, amounts: Amounts) -> Amounts {
        let seconds = (now - self.last.0).as_secs_f64().max(f64::MIN_POSITIVE);
        let present = amounts.with(self.last.1, |now, last| (now - last) / seconds);
        let weight = 1.0 - (-seconds / AVERAGING_TIME).exp();
        let rates =
            self.rates.map_or(present, |rates| rates.with(present, |old, new| old + weight * (new - old)));
        self.last = (now, amounts);
        self.rates = Some(rates);
        rates
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_pace_is_shown_as_it_is_and_a_new_one_soon() {
        let mut now = Instant::now();
        let mut done = Amounts { time: 1.0, steps: 100.0, updates: 1e6 };
        let mut meter = Meter::new(now, done);
        let mut step = |pace: f64| {
            now += Duration::from_millis(100);
            done = done.with(Amounts { time: 0.1, steps: 10.0, updates: 1e5 }, |a, b| a + pace * b);
            assert!(meter.due(now));
            let rates = meter.rates(now, done);
            assert!(!meter.due(now + Duration::from_millis(40)));
            rates
        };
        for _ in 0..10 {
            assert!((step(1.0).steps - 100.0).abs() < 1e-6);
        }
        let rates = (0..60).map(|_| step(3.0)).last().unwrap();
        assert!((rates.steps - 300.0).abs() < 15.0 && (rates.time - 3.0).abs() < 0.15);
    }
}
