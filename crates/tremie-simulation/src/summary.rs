//! The results of a run: `summary.json`.

use serde_json::{Map, Value, json};

use crate::gauges::Readings;

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndReason {
    /// The fluid came to rest.
    Rest,
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
            Self::Time => "time",
            Self::Interrupted => "interrupted",
        }
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
    /// Relative change of the fluid's volume since the start of the run.
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
        Value::Object(
            readings.chain(rest).map(|(name, value)| (name.to_owned(), value)).collect::<Map<_, _>>(),
        )
    }
}
