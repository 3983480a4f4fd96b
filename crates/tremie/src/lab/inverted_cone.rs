//! Inverted cone: how long concrete takes to flow out of the slump cone that is turned upside down and lifted.
//!
//! The cone of EN 12350-2 stands on its small end, is filled, and is lifted at a steady speed. Reported is the time from then until light is first
//! seen through it from above, a measure of viscosity. The test is being written for
//! tremie concrete; heights and speeds are not yet settled.

use std::process::ExitCode;

use clap::Args;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::cone::{CONE, shell};
use super::emptying::{self, Emptying};
use super::setup::{Mix, frustum, liftable, lifted, whole};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{length, speed};
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "inverted-cone";

/// Half the width of the plate in m.
const PLATE: f64 = 0.35;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab inverted-cone
  tremie lab inverted-cone --yield-stress 150Pa --viscosity 40Pa.s --lift 0.2m/s

The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
    /// Speed at which the cone is lifted
    #[arg(long, value_name = "SPEED", default_value = "0.1m/s", value_parser = speed)]
    lift: f64,
    /// Height to which it is lifted
    #[arg(long, value_name = "LENGTH", default_value = "400mm", value_parser = length)]
    height: f64,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = length)]
    cell_size: f64,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments).map_err(WrongInput)?;
    let case = Case::parse("inverted cone", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { ref mix, lift, height, cell_size, .. } = arguments;
    let [large, small, tall] = CONE;
    liftable("a cone", lift)?;
    if !(tall / 600.0..=tall / 15.0).contains(&cell_size) {
        return Err(format!(
            "cells of {} mm do not suit an end of 100 mm; give a --cell-size from 0.5 mm to 20 mm",
            significant(1e3 * cell_size)
        ));
    }
    let (far, surface) = (whole(PLATE, cell_size), mix.surface());
    let emptying = Emptying {
        test: "Inverted cone: concrete flows out of a slump cone turned upside down.".to_owned(),
        title: "Inverted cone",
        symmetry: vec!["x_min", "y_min"],
        min: [0.0; 3],
        max: [far, far, whole(height + tall, cell_size) + 2.0 * cell_size],
        parts: format!(
            "# The cone is full.\n[[fluid]]\n{}\n\n# It is lifted.\n[[solid]]\nname = \"mould\"\n{}\n{}{}",
            frustum([0.0; 3], [small, large], tall),
            shell([0.0; 3], [small, large, tall], cell_size),
            if surface.is_empty() { "surface = \"no_slip\"\n" } else { &surface },
            lifted(height, lift)
        ),
        view: [[0.0; 3], [0.5 * small, 0.5 * small, tall]],
        with: Some("mould"),
    };
    Ok(emptying.case_text(mix, cell_size))
}

/// The figures of the experiment, if the case looks for light.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    case.gauges.light.first()?;
    let speed = case.solids.first()?.motion.largest_speed(0.0);
    let notes = vec![("lift", format!("at {} m/s", significant(speed)))];
    Some(emptying::figures("flow time", "flow_time_s", None, notes, case, summary))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(extra: &[&str]) -> Result<Case, String> {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        let line: Line = clap::Parser::try_parse_from([&["x"], extra].concat()).unwrap();
        let text = case_text(&line.arguments)?;
        Ok(Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}")))
    }

    #[test]
    fn one_looks_through_the_cone_on_its_way() {
        for cell in ["5mm", "10mm", "3mm"] {
            let case = case(&["--cell-size", cell]).unwrap();
            assert_eq!(case.gauges.light[0].with.as_deref(), Some("mould"));
            assert!(case.domain.max.z > case.solids[0].swept(0.0, 10.0).1.z);
        }
        assert!(case(&["--lift", "9m/s"]).unwrap_err().contains("from 1 cm/s to 5 m/s"));
        assert!(case(&["--cell-size", "30mm"]).unwrap_err().contains("from 0.5 mm to 20 mm"));
    }
}
