//! When a flow has come to rest.
//!
//! A yield-stress fluid never quite stops in a computation: a regularised curve creeps for ever, single cells of the
//! surface jitter, and a plug may be unyielded while it is carried along. Rest is therefore not told by the largest
//! speed nor by the share that has yielded, but by what a technician sees:
//!
//! - the 99th percentile of the speed stays below [`Rest::speed`] (default 1 mm/s) in every reading of the last
//!   [`Rest::duration`] (default 1 s, at least [`SHORTEST_WINDOW`]), and
//! - the spread grows or shrinks by less than [`Rest::spread_rate`] (default 0.05 mm/s; slope of the least-squares
//!   line through the mean spread; only if the case has a spread gauge) over that time, or over a fifth of the time since the
//!   start ([`SPREAD_WINDOW`]) if that is longer, and
//! - what the spread still has to grow by is less than [`Rest::growth`] of it (default 0.5 %): the rate times the time since the start,
//!   which is what a rate that falls with the square of the time leaves.
//!
//! The last matters for thin sheets, which creep for long: that of 20 Pa, slow as 0.05 mm/s, is still 2 % short of its end by the theory of thin layers.
//!
//! In a box whose levels are read, films on its walls run down for minutes after the concrete between them has stopped: by the theory of thin layers one of
//! thickness h goes at up to `(rho g h - tau0)^2 / (2 mu rho g)`, in a concrete of 30 Pa and 30 Pa s 5 mm/s at h = 5 mm, and they are several per cent of what is
//! in an L-box. With a [`Rest::level_rate`] fluid is also at rest if half of it is slow and the levels stay, over the longer window.
//!
//! Both windows must be full, since fluid that has only just been released is slow too. The longer one is needed because a
//! spread grows by small jumps, as one cell after the other fills at the front: between two of them the rate over one
//! second falls below any limit. The rate dies away as a power of time (Matson and Hogg, Journal of Non-Newtonian
//! Fluid Mechanics 142, 2007), so a share of the time is as short a window late as a second is early.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use tremie_case::Rest;

use crate::gauges::Readings;

/// Length in s below which no window is taken, since fluid that is released needs a moment to move.
pub const SHORTEST_WINDOW: f64 = 1.0;

/// Share of the time since the start over which the rate of the spread is taken at least.
pub const SPREAD_WINDOW: f64 = 0.2;

/// Watches for rest. Which limits hold is said when asking, so that only the readings are state.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RestWatch {
    window: VecDeque<Moment>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Moment {
    time: f64,
    spread: Option<f64>,
    /// 99th percentile of the speed.
    speed: f64,
    // Checkpoints of older runs have neither of these.
    #[serde(default)]
    levels: Vec<f64>,
    /// Median of the speed.
    #[serde(default)]
    median: Option<f64>,
}

impl RestWatch {
    /// Takes the next readings.
    pub fn update(&mut self, rest: &Rest, readings: &Readings) {
        self.window.push_back(Moment {
            time: readings.time,
            spread: readings.spread.map(|spread| spread.mean),
            levels: readings.levels.iter().map(|(_, level)| *level).collect(),
            speed: readings.speed_p99,
            median: Some(readings.speed_p50),
        });
        // The reading at or just before the window's start stays, so that a full window can be told.
        let start = readings.time - spread_window(rest, readings.time);
        while self.window.get(1).is_some_and(|second| second.time <= start) {
            self.window.pop_front();
        }
    }

    /// Whether the fluid is at rest by the readings so far.
    pub fn reached(&self, rest: &Rest) -> bool {
        let (Some(first), Some(last)) = (self.window.front(), self.window.back()) else {
            return false;
        };
        let start = last.time - speed_window(rest);
        let slow = |speed: fn(&Moment) -> Option<f64>| {
            let slow = |moment: &Moment| speed(moment).is_some_and(|speed| speed < rest.speed);
            let before = self.window.iter().rev().find(|moment| moment.time <= start);
            before.is_some_and(slow)
                && self.window.iter().rev().take_while(|moment| moment.time > start).all(slow)
        };
        let levels_stay = |limit: f64| {
            let mut rates =
                (0..last.levels.len()).filter_map(|n| self.rate(|moment| moment.levels.get(n).copied()));
            rates.all(|rate| rate.abs() < limit)
        };
        last.time - first.time >= spread_window(rest, last.time)
            && (slow(|moment| Some(moment.speed))
                || rest.level_rate.is_some_and(|limit| slow(|moment| moment.median) && levels_stay(limit)))
            && self.rate(|moment| moment.spread).is_none_or(|rate| {
                let growth = rest.growth * last.spread.unwrap_or(0.0);
                rate.abs() < rest.spread_rate && rate.abs() * last.time < growth
            })
    }

    /// Slope in m/s of the least-squares line through a length in the window; none without its gauge.
    fn rate(&self, length: impl Fn(&Moment) -> Option<f64>) -> Option<f64> {
        let points: Vec<(f64, f64)> =
            self.window.iter().filter_map(|moment| Some((moment.time, length(moment)?))).collect();
        if points.is_empty() {
            return None;
        }
        let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
        let (time, middle) = (mean(|p| p.0), mean(|p| p.1));
        let (mut above, mut below) = (0.0, 0.0);
        for (t, l) in &points {
            above += (t - time) * (l - middle);
            below += (t - time).powi(2);
        }
        Some(above / below)
    }
}

/// Time in s over which the speed must stay low.
fn speed_window(rest: &Rest) -> f64 {
    rest.duration.max(SHORTEST_WINDOW)
}

/// Time in s over which the rate of the spread is taken, at a time in s.
fn spread_window(rest: &Rest, time: f64) -> f64 {
    speed_window(rest).max(SPREAD_WINDOW * time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauges::Spread;

    const REST: Rest = Rest { spread_rate: 5e-5, growth: 5e-3, speed: 1e-3, level_rate: None, duration: 1.0 };

    fn readings(time: f64, spread: Option<f64>, speed: f64) -> Readings {
        let spread =
            spread.map(|mean| Spread { mean, x: mean, y: mean, diagonal: mean, max: mean, height: 0.05 });
        Readings {
            time,
            spread,
            top: 0.05,
            volume: 0.005,
            speed_p50: 0.0,
            speed_p99: speed,
            // Neither the largest speed nor the yielded share says anything about rest.
            speed_max: 0.5,
            kinetic_energy: 0.0,
            potential_energy: 1.0,
            yielded_share: 1.0,
            pressure_max: 1000.0,
            levels: Vec::new(),
            fronts: Vec::new(),
            lights: Vec::new(),
            pressures: Vec::new(),
            solids: Vec::new(),
            travel: None,
            inflow: Vec::new(),
            outflow: None,
            batches_out: Vec::new(),
            bodies: Vec::new(),
        }
    }

    /// Time of the first reading, one every 0.1 s, at which the fluid counts as resting.
    fn rests_at(rest: Rest, spread: impl Fn(f64) -> Option<f64>, speed: impl Fn(f64) -> f64) -> Option<f64> {
        let mut watch = RestWatch::default();
        (0..200).map(|n| f64::from(n) / 10.0).find(|time| {
            watch.update(&rest, &readings(*time, spread(*time), speed(*time)));
            watch.reached(&rest)
        })
    }

    #[test]
    fn fluid_that_has_not_started_to_move_does_not_rest() {
        // Slow for a moment after its release, then fast.
        let speed = |t: f64| if (0.4..5.0).contains(&t) { 0.1 } else { 0.0 };
        assert_eq!(rests_at(REST, |_| Some(0.2), speed), Some(6.0));
        // A short duration does not shorten the window.
        assert_eq!(rests_at(Rest { duration: 0.01, ..REST }, |_| None, speed), Some(6.0));
        assert_eq!(rests_at(Rest { duration: 2.0, ..REST }, |_| None, speed), Some(7.0));
    }

    #[test]
    fn a_creeping_spread_is_not_rest_even_if_it_jitters() {
        let jitter = |t: f64| 2e-6 * (37.0 * t).sin();
        let creep = |rate: f64| rests_at(REST, move |t| Some(0.6 + rate * t + jitter(t)), |_| 1e-4);
        assert_eq!(creep(1e-4), None);
        assert_eq!(creep(-1e-4), None);
        assert_eq!(creep(2e-5), Some(1.0));
        assert_eq!(rests_at(REST, |t| Some(0.6 + 1e-5 * t), |_| 2e-3), None);
    }

    #[test]
    fn a_spread_that_grows_by_jumps_is_not_rest_between_two_of_them() {
        // 0.5 mm every two seconds, five times the limit; without them the spread would be at rest.
        let jumps = |t: f64| Some(0.6 + 5e-4 * (t / 2.0).floor());
        assert_eq!(
            rests_at(REST, |t| if t < 2.0 { None } else { jumps(t) }, |t| if t < 9.0 { 1.0 } else { 0.0 }),
            None
        );
        assert_eq!(rests_at(REST, |_| Some(0.6), |t| if t < 9.0 { 1.0 } else { 0.0 }), Some(10.0));
    }

    #[test]
    fn a_slow_spread_with_a_way_to_go_is_not_rest() {
        // 0.04 mm/s is slow enough; but in 80 s it has made more than half a per cent.
        let creep = |t: f64| Some(0.6 + 4e-5 * (t - 80.0));
        let mut watch = RestWatch::default();
        let at_rest: Vec<bool> = (0..100)
            .map(|t| {
                let t = f64::from(t);
                watch.update(&REST, &readings(t, creep(t), 0.0));
                watch.reached(&REST)
            })
            .collect();
        assert!(at_rest[50] && !at_rest[90]);
    }

    #[test]
    fn levels_that_stay_are_rest_while_films_run_down() {
        let box_at = |time: f64, level: f64| Readings {
            speed_p50: 2e-3 * (-time).exp(),
            levels: vec![("H1".to_owned(), 0.1), ("H2".to_owned(), level)],
            ..readings(time, None, 5e-3)
        };
        let rests_at = |rest: Rest, level: fn(f64) -> f64| {
            let mut watch = RestWatch::default();
            (0..200).map(|n| f64::from(n) / 10.0).find(|time| {
                watch.update(&rest, &box_at(*time, level(*time)));
                watch.reached(&rest)
            })
        };
        let levels = Rest { level_rate: Some(5e-5), ..REST };
        // Half of the fluid is slow for a second from 0.7 s on.
        assert_eq!(rests_at(levels, |_| 0.08), Some(1.7));
        assert_eq!(rests_at(REST, |_| 0.08), None);
        // Fluid that is slow as a whole rests, whatever the levels.
        assert!(rests_at(Rest { speed: 6e-3, ..levels }, |t| 0.08 + 1e-4 * t).is_some());
        assert_eq!(rests_at(levels, |t| 0.08 + 1e-4 * t), None);
        // It rises by 0.1 mm/s until 8 s; the line through the last fifth is flat soon after.
        let end = rests_at(levels, |t| 0.08 + 1e-4 * t.min(8.0)).unwrap();
        assert!((8.5..10.0).contains(&end), "{end}");
    }

    #[test]
    fn checkpoints_that_know_no_levels_are_read() {
        let older = r#"{"window":[{"time":1.0,"spread":null,"speed":0.002}]}"#;
        let watch: RestWatch = serde_json::from_str(older).unwrap();
        assert!(!watch.reached(&Rest { level_rate: Some(1.0), ..REST }));
    }

    #[test]
    fn a_window_may_hold_no_more_than_two_readings() {
        let mut watch = RestWatch::default();
        for (time, at_rest) in [(0.0, false), (5.0, true), (10.0, true)] {
            watch.update(&REST, &readings(time, Some(0.6), 0.0));
            assert_eq!(watch.reached(&REST), at_rest);
            assert!(watch.window.len() <= 2);
        }
    }
}
