//! The results of a run: `summary.json`.

use serde_json::{Map, Value, json};

use crate::filling::FillingFigures;
use crate::gauges::{Gauges, Peak, Readings};

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndReason {
    /// The fluid came to rest.
    Rest,
    /// That came for which the case waits.
    Event,
    /// The case's end time was reached.
    Time,
    /// The user interrupted it; it can be resumed.
    Interrupted,
}

impl EndReason {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Event => "event",
            Self::Time => "time",
            Self::Interrupted => "interrupted",
        }
    }

    fn named(name: &str) -> Option<Self> {
        [Self::Rest, Self::Event, Self::Time, Self::Interrupted]
            .into_iter()
            .find(|reason| reason.name() == name)
    }
}

/// The results of a run, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Why the run ended.
    pub end_reason: EndReason,
    /// What the gauges read at the end.
    pub readings: Readings,
    /// Time in s at which the largest spread first reached 500 mm, if it did (EN 12350-8).
    pub t500: Option<f64>,
    /// What front and light gauges wait for: its name, and the time in s at which it came, if it did.
    pub events: Vec<(String, Option<f64>)>,
    /// Name of each pressure gauge, and the largest pressure on its wall.
    pub peaks: Vec<(String, Peak)>,
    /// How the form filled, if the case asks for it.
    pub filling: Option<FillingFigures>,
    /// Relative change of the fluid's volume since the start of the run, apart from what came in and left.
    pub volume_error: f64,
    /// Time steps.
    pub steps: u64,
    /// Wall-clock time in s.
    pub wall: f64,
    /// Updates of wet cells or nodes per second of wall-clock time.
    pub updates_per_second: f64,
}

impl Summary {
    /// The summary as it stands in `summary.json`; readings have the names that they have in the time series.
    pub fn json(&self) -> Value {
        let readings = self.readings.columns().into_iter().map(|(name, value)| (name, json!(value)));
        let rest = [
            ("end_reason", json!(self.end_reason.name())),
            ("t500_s", json!(self.t500)),
            ("volume_error", json!(self.volume_error)),
            ("steps", json!(self.steps)),
            ("wall_s", json!(self.wall)),
            ("updates_per_second", json!(self.updates_per_second)),
        ];
        let events = self.events.iter().map(|(name, time)| (name.clone(), json!(time)));
        let peaks = self.peaks.iter().flat_map(|(name, peak)| {
            let values = [peak.pressure, peak.height, peak.time, peak.ratio];
            peak_names(name).into_iter().zip(values.map(|value| json!(value)))
        });
        let filling = self.filling.iter().map(|filling| ("filling".to_owned(), filling.json()));
        let rest = rest.map(|(name, value)| (name.to_owned(), value));
        Value::Object(readings.chain(events).chain(peaks).chain(filling).chain(rest).collect::<Map<_, _>>())
    }

    /// The time in s at which that came what the gauge of the event `name` waits for, such as `front_T200_s`, if it did.
    pub fn event(&self, name: &str) -> Option<f64> {
        self.events.iter().find(|(event, _)| event == name)?.1
    }

    /// A summary as it stands in `summary.json` of a case with these gauges; none if something is missing in it.
    pub fn from_json(json: &Value, gauges: &Gauges) -> Option<Self> {
        let number = |name: &str| json.get(name)?.as_f64();
        let peak = |name: &String| {
            let [pressure, height, time, ratio] = peak_names(name).map(|name| number(&name));
            let peak = Peak { pressure: pressure?, height: height?, time: time?, ratio: ratio? };
            Some((name.clone(), peak))
        };
        Some(Self {
            end_reason: EndReason::named(json.get("end_reason")?.as_str()?)?,
            readings: Readings::from_columns(number, gauges)?,
            t500: number("t500_s"),
            events: gauges
                .events()
                .into_iter()
                .map(|name| (number(&name), name))
                .map(|(t, n)| (n, t))
                .collect(),
            peaks: gauges.pressure_names().map(peak).collect::<Option<_>>()?,
            filling: json.get("filling").and_then(FillingFigures::from_json),
            volume_error: number("volume_error")?,
            steps: json.get("steps")?.as_u64()?,
            wall: number("wall_s")?,
            updates_per_second: number("updates_per_second")?,
        })
    }
}

/// Names of what is told of the largest pressure on the wall of a gauge.
fn peak_names(name: &str) -> [String; 4] {
    ["Pa", "height_m", "s", "ratio"].map(|what| format!("pressure_{name}_max_{what}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SolidLoad;
    use crate::filling::Pocket;
    use crate::gauges::{BodyCount, Spread, WallPressure};
    use tremie_numerics::DVec3;

    #[test]
    fn a_summary_is_read_as_written() {
        let spread = Spread { mean: 0.6, x: 0.61, y: 0.59, diagonal: 0.6, max: 0.62, height: 0.03 };
        let readings = Readings {
            time: 12.5,
            spread: Some(spread),
            top: 0.04,
            volume: 5.5e-3,
            speed_p50: 1e-4,
            speed_p99: 2e-4,
            speed_max: 1.0 / 3.0,
            kinetic_energy: 1e-9,
            potential_energy: 2.0,
            yielded_share: 0.1,
            pressure_max: 800.0,
            levels: vec![("H1".to_owned(), 0.09)],
            fronts: vec![("T200".to_owned(), 0.4)],
            lights: vec![("tv".to_owned(), 0.5)],
            pressures: vec![(
                "form".to_owned(),
                WallPressure { bands: vec![900.0, 300.0], force: 60.0, level: 0.04, ratio: 0.9 },
            )],
            solids: vec![(
                "gate".to_owned(),
                SolidLoad { force: DVec3::new(1.0, 2.0, 3.0), moment: DVec3::new(0.1, 0.2, 0.3) },
            )],
            travel: Some(("plate".into(), 0.012)),
            inflow: vec![2e-3, 0.0],
            outflow: Some(1e-3),
            batches_out: vec![4e-4, 6e-4],
            bodies: vec![("steel".to_owned(), BodyCount { came: 7.0, left: 3.0, present: 4.0 })],
        };
        let gauges = Gauges::of(&readings);
        for (spread, t500) in [(Some(spread), Some(1.5)), (None, None)] {
            let summary = Summary {
                end_reason: EndReason::Rest,
                readings: Readings { spread, ..readings.clone() },
                t500,
                events: vec![("front_T200_s".to_owned(), t500), ("light_tv_s".to_owned(), None)],
                peaks: vec![(
                    "form".to_owned(),
                    Peak { pressure: 950.0, height: 0.01, time: 3.0, ratio: 0.95 },
                )],
                filling: t500.map(|time| FillingFigures {
                    last: vec![(time, DVec3::new(1.0, 0.5, 0.25)), (1.25, DVec3::ZERO)],
                    dead_volume: 2e-3,
                    pockets: vec![Pocket { volume: 1e-4, centre: DVec3::X }],
                }),
                volume_error: -1e-7,
                steps: 1234,
                wall: 4.5,
                updates_per_second: 3e7,
            };
            let json = summary.json();
            assert_eq!(Summary::from_json(&json, &gauges), Some(summary));
            for key in ["top_m", "end_reason", "steps"] {
                let mut json = json.clone();
                json[key] = Value::Null;
                assert_eq!(Summary::from_json(&json, &gauges), None, "{key}");
            }
        }
    }
}
