//! Slump flow (EN 12350-8): the diameter to which a cone of fresh concrete spreads.
//!
//! The cone is lifted at a speed, or taken away at once instead of within 1 s to 3 s; T500 counts from that moment. Reported is the mean of two
//! diameters at right angles to the nearest 10 mm, and the time to the first touch of the 500 mm circle to 0.1 s. Classes
//! (EN 206, European Guidelines 2005) are told from these rounded figures, so that none falls between two classes:
//! SF1 550 to 650 mm, SF2 660 to 750 mm, SF3 760 to 850 mm; VS1 below 2.0 s, VS2 from 2.0 s.

use std::process::ExitCode;

use clap::Args;
use serde_json::json;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::cone::{self, CONE, ConeTest, Spreading, to_ten};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "slump-flow";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab slump-flow
  tremie lab slump-flow --yield-stress 50Pa --viscosity 30Pa.s --density 2300kg/m3
  tremie lab slump-flow --lift 0.15m/s
  tremie lab slump-flow --yield-stress 20Pa --cell-size 3mm --out runs/fine

The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    test: ConeTest,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let spreading = Spreading {
        title: "Slump flow",
        test: "Slump flow (EN 12350-8)",
        cone: CONE,
        parts: String::new(),
        gauges: String::new(),
    };
    let text = spreading.case_text(&arguments.test).map_err(WrongInput)?;
    let case = Case::parse("slump flow", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The figures of the experiment, if the case measures a spread.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let spread = summary.readings.spread?;
    let [.., start] = cone::dimensions(case)?;
    let flow_mm = 1e3 * 0.5 * (spread.x + spread.y);
    let slump_mm = 1e3 * (start - spread.height).max(0.0);
    let (sf, vs) = (flow_class(flow_mm), summary.t500.map(viscosity_class));
    let t500 = t500(summary);
    let estimate =
        cone::spread_of_a_sheet(cone::VOLUME, case.material.curve.yield_stress(), case.material.density);
    let cell_size = case.method.resolution();
    let class = [Some(sf), vs].into_iter().flatten().collect::<Vec<_>>().join(", ");
    let headline = vec![
        ("slump flow", format!("{} mm", to_ten(flow_mm))),
        ("T500", t500.clone()),
        ("class", class.clone()),
    ];
    let rows = vec![
        (
            "slump flow",
            format!(
                "{:.0} mm ({:.0} x {:.0} mm), to the nearest 10 mm: {} mm",
                flow_mm,
                1e3 * spread.x,
                1e3 * spread.y,
                to_ten(flow_mm)
            ),
        ),
        ("T500", t500),
        ("", touch(case)),
        ("class", class),
        ("final height", format!("{:.0} mm in the middle", 1e3 * spread.height)),
        ("slump", format!("{slump_mm:.0} mm")),
        (
            "spreading formula",
            format!("{:.0} mm, from yield stress = 225 rho g V^2 / (128 pi^2 R^5)", 1e3 * estimate),
        ),
        ("", "(Roussel and Coussot 2005; for slow spreading to a thin sheet,".to_owned()),
        ("", format!("height over radius well below 1: here {:.2})", 2.0 * spread.height / spread.mean)),
        (
            "resolution",
            format!(
                "cells of {} mm, {:.1} over the final height",
                significant(1e3 * cell_size),
                spread.height / cell_size
            ),
        ),
    ];
    let json = [
        ("slump_flow_mm", json!(flow_mm)),
        ("slump_mm", json!(slump_mm)),
        ("sf_class", json!(sf)),
        ("vs_class", json!(vs)),
    ];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

/// The time to 500 mm, for people.
pub(super) fn t500(summary: &Summary) -> String {
    summary.t500.map_or_else(|| "not reached".to_owned(), |time| format!("{time:.1} s"))
}

/// From when it counts.
pub(super) fn touch(case: &Case) -> String {
    match cone::lift(case) {
        Some(speed) => {
            format!("(first touch, from when the cone begins to rise at {} m/s)", significant(speed))
        }
        None => "(first touch; here the cone vanishes at once, a real one is lifted in 1 s to 3 s: --lift)"
            .to_owned(),
    }
}

fn flow_class(flow_mm: f64) -> &'static str {
    match to_ten(flow_mm) {
        ..550 => "below SF1",
        550..=650 => "SF1",
        660..=750 => "SF2",
        760..=850 => "SF3",
        _ => "above SF3",
    }
}

fn viscosity_class(t500: f64) -> &'static str {
    if (10.0 * t500).round() < 20.0 { "VS1" } else { "VS2" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_have_no_gaps() {
        let classes = [544.9, 545.0, 654.9, 655.0, 754.9, 755.0, 854.9, 855.0].map(flow_class);
        assert_eq!(classes, ["below SF1", "SF1", "SF1", "SF2", "SF2", "SF3", "SF3", "above SF3"]);
        assert_eq!([1.94, 1.96, 2.0].map(viscosity_class), ["VS1", "VS2", "VS2"]);
    }
}
