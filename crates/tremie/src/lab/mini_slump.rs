//! Mini slump: the spread of a small cone of paste, grout or mortar.
//!
//! Cones from memory of their standards: Haegermann (EN 1015-3: 100 mm and 70 mm, 60 mm high), ASTM C230 (100 mm and 70 mm, 50 mm high),
//! Kantro (38.1 mm and 19 mm, 57.2 mm high). The spread is without jolts; reported is the mean of two diameters at right angles.

use std::process::ExitCode;

use clap::{Args, ValueEnum};
use serde_json::json;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::cone::{self, ConeTest, Spreading};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "mini-slump";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab mini-slump
  tremie lab mini-slump --cone kantro --yield-stress 10Pa --viscosity 0.5Pa.s --cell-size 1mm

Dimensions are from memory of the standards. The folder's case.toml can be edited and run again with `tremie run`.")]
#[command(
    mut_arg("yield_stress", |arg| arg.default_value("30Pa")),
    mut_arg("viscosity", |arg| arg.default_value("2Pa.s")),
    mut_arg("density", |arg| arg.default_value("2100kg/m3")),
    mut_arg("cell_size", |arg| arg.default_value("2mm"))
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    test: ConeTest,
    /// Which cone
    #[arg(long, value_enum, default_value_t = Cone::Haegermann)]
    cone: Cone,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Cone {
    /// Haegermann: 100 mm, 70 mm, 60 mm high (EN 1015-3)
    Haegermann,
    /// ASTM C230: 100 mm, 70 mm, 50 mm high
    AstmC230,
    /// Kantro: 38.1 mm, 19 mm, 57.2 mm high
    Kantro,
}

impl Cone {
    /// Diameters below and above, and height in m.
    fn dimensions(self) -> [f64; 3] {
        match self {
            Self::Haegermann => [0.1, 0.07, 0.06],
            Self::AstmC230 => [0.1, 0.07, 0.05],
            Self::Kantro => [0.0381, 0.019, 0.0572],
        }
    }
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments.test, arguments.cone).map_err(WrongInput)?;
    let case = Case::parse("mini slump", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(test: &ConeTest, cone: Cone) -> Result<String, String> {
    let spreading = Spreading {
        title: "Mini slump",
        test: "Mini slump",
        cone: cone.dimensions(),
        parts: String::new(),
        gauges: String::new(),
    };
    spreading.case_text(test)
}

/// The figures of the experiment, if the case measures a spread.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let spread = summary.readings.spread?;
    let cone = cone::dimensions(case)?;
    let mean = 1e3 * 0.5 * (spread.x + spread.y);
    let sheet = cone::spread_of_a_sheet(
        cone::volume(cone),
        case.material.curve.yield_stress(),
        case.material.density,
    );
    let cell_size = case.method.resolution();
    let headline = vec![("spread", format!("{mean:.0} mm"))];
    let rows = vec![
        ("spread", format!("{mean:.0} mm ({:.0} x {:.0} mm)", 1e3 * spread.x, 1e3 * spread.y)),
        ("relative to the cone", format!("{:.2}  ((D / D0)^2 - 1)", (mean / (1e3 * cone[0])).powi(2) - 1.0)),
        ("final height", format!("{:.1} mm in the middle", 1e3 * spread.height)),
        (
            "spreading formula",
            format!(
                "{:.0} mm (Roussel and Coussot 2005; for thin sheets, without surface tension)",
                1e3 * sheet
            ),
        ),
        (
            "cone",
            format!(
                "{} mm x {} mm, {} mm high, from memory; {} ml; no jolts",
                significant(1e3 * cone[0]),
                significant(1e3 * cone[1]),
                significant(1e3 * cone[2]),
                significant(1e6 * cone::volume(cone))
            ),
        ),
        (
            "resolution",
            format!(
                "cells of {} mm, {:.1} over the final height",
                significant(1e3 * cell_size),
                spread.height / cell_size
            ),
        ),
    ];
    let json = [("spread_mm", json!(mean))];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(extra: &[&str]) -> Arguments {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        clap::Parser::try_parse_from([&["x"], extra].concat()).map(|line: Line| line.arguments).unwrap()
    }

    #[test]
    fn cones_hold_what_others_have_worked_out() {
        for (name, litres) in [("haegermann", 0.344), ("astm-c230", 0.287), ("kantro", 0.0381)] {
            let arguments = arguments(&["--cone", name]);
            let case = Case::parse("x", &case_text(&arguments.test, arguments.cone).unwrap());
            let cone = cone::dimensions(&case.unwrap_or_else(|error| panic!("{error}"))).unwrap();
            assert!((1e3 * cone::volume(cone) / litres - 1.0).abs() < 0.01, "{name}");
        }
    }

    #[test]
    fn the_mix_is_a_mortar_if_nothing_is_said() {
        let test = arguments(&[]).test;
        assert_eq!((test.mix.yield_stress, test.mix.viscosity, test.cell_size), (30.0, 2.0, 0.002));
        assert_eq!(arguments(&["--yield-stress", "5Pa"]).test.mix.yield_stress, 5.0);
    }
}
