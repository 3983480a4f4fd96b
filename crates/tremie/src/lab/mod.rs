//! The virtual laboratory: standard tests on fresh concrete.
//!
//! A test is a case made from a few numbers, and figures read from its results. The case is written as text, so that the
//! run's folder holds a case file that can be edited and run again; the run is an ordinary one. Its record names the
//! experiment, so that a resumed run tells the same figures.

mod cone;
mod slump;
mod slump_flow;
mod thin_sheet;

pub(crate) use cone::{CONE, GRAVITY, VOLUME as CONE_VOLUME};
pub(crate) use thin_sheet::ThinSheet;

use std::process::ExitCode;

use clap::Subcommand;
use serde_json::{Map, Value};
use tremie_case::Case;
use tremie_simulation::Summary;

#[derive(Debug, Subcommand)]
pub(crate) enum Experiment {
    /// Slump flow of self-compacting concrete (EN 12350-8)
    SlumpFlow(slump_flow::Arguments),
    /// Slump of concrete (EN 12350-2)
    Slump(slump::Arguments),
}

/// Does an experiment.
pub(crate) fn run(experiment: Experiment) -> anyhow::Result<ExitCode> {
    match experiment {
        Experiment::SlumpFlow(arguments) => slump_flow::run(arguments),
        Experiment::Slump(arguments) => slump::run(arguments),
    }
}

/// What an experiment tells.
pub(crate) struct Figures {
    /// The few that one takes away.
    pub(crate) headline: Vec<(&'static str, String)>,
    /// For people.
    pub(crate) rows: Vec<(&'static str, String)>,
    /// For `summary.json`.
    pub(crate) json: Map<String, Value>,
}

/// The figures of the experiment `name`, if there is such a one and the case is one of its kind.
pub(crate) fn figures(name: &str, case: &Case, summary: &Summary) -> Option<Figures> {
    match name {
        slump_flow::NAME => slump_flow::figures(case, summary),
        slump::NAME => slump::figures(case, summary),
        _ => None,
    }
}

/// Name of the standard experiment that a case is, whoever has written it.
pub(crate) fn recognised(case: &Case) -> Option<&'static str> {
    cone::is_one(case).then_some(slump_flow::NAME)
}
