//! When a quantity first reaches a level, such as T500, the time to a spread of 500 mm.

use serde::{Deserialize, Serialize};

/// Watches for the first time at which a quantity reaches a level, by linear interpolation between readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TargetTime {
    level: f64,
    /// Whether the quantity counts only once it has been below the level.
    from_below: bool,
    last: Option<(f64, f64)>,
    reached: Option<f64>,
}

impl TargetTime {
    /// Watches for `level`, in the unit of the quantity.
    pub fn new(level: f64) -> Self {
        Self { level, from_below: false, last: None, reached: None }
    }

    /// Watches for `level`, once the quantity has been below it.
    pub fn from_below(level: f64) -> Self {
        Self { from_below: true, ..Self::new(level) }
    }

    /// Takes the next reading, at `time` in s.
    pub fn update(&mut self, time: f64, value: f64) {
        if self.from_below && self.last.is_none() && value >= self.level {
            return;
        }
        if self.reached.is_none() && value >= self.level {
            // The value before was below the level, so that the divisor is positive.
            self.reached = Some(match self.last {
                Some((before, low)) => before + (time - before) * (self.level - low) / (value - low),
                None => time,
            });
        }
        self.last = Some((time, value));
    }

    /// Time in s at which the level was first reached, if it was.
    pub fn reached(&self) -> Option<f64> {
        self.reached
    }
}

/// Time in s at which a series of (time in s, value) first reaches `level`, by linear interpolation.
pub fn first_crossing(series: impl IntoIterator<Item = (f64, f64)>, level: f64) -> Option<f64> {
    let mut target = TargetTime::new(level);
    for (time, value) in series {
        target.update(time, value);
    }
    target.reached()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_crossing_counts() {
        let series = [(0.0, 0.2), (1.0, 0.4), (2.0, 0.6), (3.0, 0.4), (4.0, 0.7)];
        assert!((first_crossing(series, 0.5).unwrap() - 1.5).abs() < 1e-15);
        assert_eq!(first_crossing(series, 0.4), Some(1.0));
        assert_eq!(first_crossing(series, 0.1), Some(0.0));
        assert_eq!(first_crossing(series, 0.8), None);
        assert_eq!(first_crossing([], 0.5), None);
    }

    #[test]
    fn what_begins_above_the_level_counts_once_it_has_been_below() {
        let mut target = TargetTime::from_below(0.5);
        for (time, value) in [(0.0, 1.0), (1.0, 0.7), (2.0, 0.0), (3.0, 0.25), (4.0, 0.75)] {
            target.update(time, value);
        }
        assert_eq!(target.reached(), Some(3.5));
    }

    #[test]
    fn a_value_that_is_not_a_number_reaches_nothing() {
        assert_eq!(first_crossing([(0.0, f64::NAN), (1.0, 0.4)], 0.5), None);
    }
}
