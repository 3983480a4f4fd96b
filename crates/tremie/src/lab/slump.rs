//! Slump (EN 12350-2): how far a cone of fresh concrete sinks.
//!
//! The cone is lifted at a speed, or taken away at once; a real one is lifted in 2 s to 5 s. Reported is the mould's height of 300 mm less that of the highest
//! point, to the nearest 10 mm. Classes as in EN 206, from memory of the standard: S1 10 to 40 mm, S2 50 to 90 mm, S3 100 to 150 mm, S4 160
//! to 210 mm, S5 from 220 mm; they are told from the rounded figure, so that none falls between two classes.
//!
//! A Bingham fluid sinks evenly. Real concrete of a low slump shears off or crumbles, which needs a model with friction: below class S4 the
//! figure is a rough one.

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
pub(crate) const NAME: &str = "slump";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab slump --yield-stress 500Pa --viscosity 50Pa.s
  tremie lab slump --yield-stress 1kPa --lift 0.1m/s

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
        title: "Slump",
        test: "Slump (EN 12350-2)",
        cone: CONE,
        parts: String::new(),
        gauges: String::new(),
    };
    let text = spreading.case_text(&arguments.test).map_err(WrongInput)?;
    let case = Case::parse("slump", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The figures of the experiment.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let [.., start] = cone::dimensions(case)?;
    let slump_mm = 1e3 * (start - summary.readings.top).max(0.0);
    let class = class(slump_mm);
    let cell_size = case.method.resolution();
    let headline = vec![("slump", format!("{} mm", to_ten(slump_mm))), ("class", class.to_owned())];
    let mut rows = vec![
        ("slump", format!("{slump_mm:.0} mm, to the nearest 10 mm: {} mm", to_ten(slump_mm))),
        ("class", format!("{class} (limits of EN 206 from memory: check them against the standard)")),
        ("final height", format!("{:.0} mm", 1e3 * summary.readings.top)),
    ];
    if let Some(spread) = summary.readings.spread {
        rows.push(("spread", format!("{:.0} mm", 1e3 * spread.mean)));
    }
    rows.push(("resolution", format!("cells of {} mm", significant(1e3 * cell_size))));
    if slump_mm < 155.0 {
        rows.push((
            "",
            "(real concrete as stiff as this shears off or crumbles, which a Bingham fluid does not)"
                .to_owned(),
        ));
    }
    let json = [("slump_mm", json!(slump_mm)), ("slump_class", json!(class))];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

fn class(slump_mm: f64) -> &'static str {
    match to_ten(slump_mm) {
        ..10 => "below S1",
        10..=40 => "S1",
        50..=90 => "S2",
        100..=150 => "S3",
        160..=210 => "S4",
        _ => "S5",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_have_no_gaps() {
        let classes = [4.9, 5.0, 44.9, 45.0, 94.9, 95.0, 154.9, 155.0, 214.9, 215.0].map(class);
        assert_eq!(classes, ["below S1", "S1", "S1", "S2", "S2", "S3", "S3", "S4", "S4", "S5"]);
    }
}
