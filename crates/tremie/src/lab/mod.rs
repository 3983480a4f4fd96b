//! The virtual laboratory: standard tests on fresh concrete.
//!
//! A test is a case made from a few numbers, and figures read from its results. The case is written as text, so that the
//! run's folder holds a case file that can be edited and run again; the run is an ordinary one. Its record names the
//! experiment, so that a resumed run tells the same figures.

mod cone;
mod emptying;
mod inverted_cone;
mod j_ring;
mod l_box;
mod lcpc_box;
mod mini_slump;
mod orimet;
mod setup;
mod slump;
mod slump_flow;
mod squeeze_flow;
mod thin_sheet;
mod u_box;
mod v_funnel;

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
    /// L-box: passing ability of self-compacting concrete (EN 12350-10)
    LBox(l_box::Arguments),
    /// LCPC box: yield stress of self-compacting concrete (Roussel 2007)
    LcpcBox(lcpc_box::Arguments),
    /// J-ring: passing ability of self-compacting concrete (EN 12350-12)
    JRing(j_ring::Arguments),
    /// V-funnel: flow time of self-compacting concrete (EN 12350-9)
    VFunnel(v_funnel::Arguments),
    /// Inverted cone: flow time of tremie concrete
    InvertedCone(inverted_cone::Arguments),
    /// Mini slump: spread of paste, grout and mortar (cones of EN 1015-3, ASTM C230, Kantro)
    MiniSlump(mini_slump::Arguments),
    /// U-box: filling ability of self-compacting concrete
    UBox(u_box::Arguments),
    /// Orimet: flow time of self-compacting concrete
    Orimet(orimet::Arguments),
    /// Squeeze flow: a sample between two plates, under a load or at a speed
    SqueezeFlow(squeeze_flow::Arguments),
}

/// Does an experiment.
pub(crate) fn run(experiment: Experiment) -> anyhow::Result<ExitCode> {
    match experiment {
        Experiment::SlumpFlow(arguments) => slump_flow::run(arguments),
        Experiment::Slump(arguments) => slump::run(arguments),
        Experiment::LBox(arguments) => l_box::run(arguments),
        Experiment::LcpcBox(arguments) => lcpc_box::run(arguments),
        Experiment::JRing(arguments) => j_ring::run(arguments),
        Experiment::VFunnel(arguments) => v_funnel::run(arguments),
        Experiment::InvertedCone(arguments) => inverted_cone::run(arguments),
        Experiment::MiniSlump(arguments) => mini_slump::run(arguments),
        Experiment::UBox(arguments) => u_box::run(arguments),
        Experiment::Orimet(arguments) => orimet::run(arguments),
        Experiment::SqueezeFlow(arguments) => squeeze_flow::run(arguments),
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
    let mut figures = match name {
        slump_flow::NAME => slump_flow::figures(case, summary),
        slump::NAME => slump::figures(case, summary),
        l_box::NAME => l_box::figures(case, summary),
        lcpc_box::NAME => lcpc_box::figures(case, summary),
        j_ring::NAME => j_ring::figures(case, summary),
        v_funnel::NAME => v_funnel::figures(case, summary),
        inverted_cone::NAME => inverted_cone::figures(case, summary),
        mini_slump::NAME => mini_slump::figures(case, summary),
        u_box::NAME => u_box::figures(case, summary),
        orimet::NAME => orimet::figures(case, summary),
        squeeze_flow::NAME => squeeze_flow::figures(case, summary),
        _ => None,
    }?;
    figures.rows.push(("surfaces", setup::surfaces(case)));
    Some(figures)
}

/// Whether the time to a spread of 500 mm belongs to the results of the experiment `name`.
pub(crate) fn tells_t500(name: &str) -> bool {
    [slump_flow::NAME, slump::NAME, j_ring::NAME].contains(&name)
}

/// Name of the standard experiment that a case is, whoever has written it.
pub(crate) fn recognised(case: &Case) -> Option<&'static str> {
    cone::is_one(case).then_some(slump_flow::NAME)
}
