//! Orimet: how long concrete takes to flow out of an upright pipe through a narrower orifice.
//!
//! Dimensions from memory: a pipe of 120 mm, 600 mm high, with an orifice of 80 mm at the end of a taper of 100 mm; 6.5 litres fill it. The
//! trap opens at once over a tray. Reported is the time to 0.1 s, until light is first seen from above; EFNARC (2002, from memory) accepts up to 5 s.

use std::process::ExitCode;

use clap::Args;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::emptying::{self, Emptying, block};
use super::setup::{Mix, cuboid, fitting, frustum, whole};
use crate::failure::WrongInput;
use crate::quantities::length;
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "orimet";

/// Diameter and height of the pipe, with its taper, in m.
const PIPE: [f64; 2] = [0.12, 0.6];
/// Height in m over which the pipe is tapered.
const TAPER: f64 = 0.1;
/// Height of the orifice in m above the tray, and half the tray's width.
const DROP: f64 = 0.15;
const TRAY: f64 = 0.25;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab orimet
  tremie lab orimet --orifice 70mm --viscosity 50Pa.s

Dimensions are from memory. The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
    /// Diameter of the orifice: 70 mm, 80 mm or 90 mm
    #[arg(long, value_name = "LENGTH", default_value = "80mm", value_parser = length)]
    orifice: f64,
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
    let case = Case::parse("orimet", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { ref mix, orifice, cell_size, .. } = arguments;
    let [pipe, height] = PIPE;
    if orifice > pipe {
        return Err("the orifice is wider than the pipe of 120 mm; give a smaller --orifice".to_owned());
    }
    fitting(cell_size, &[("half the orifice", 0.5 * orifice)])?;
    let far = whole(TRAY, cell_size);
    let top = whole(DROP + height, cell_size) + 2.0 * cell_size;
    let (min, max) = ([0.0; 3], [far, far, top]);
    let bore = [
        frustum([0.0, 0.0, DROP], [orifice, pipe], TAPER),
        frustum([0.0, 0.0, DROP + TAPER], [pipe, pipe], 2.0 * height),
    ];
    let emptying = Emptying {
        test: "Orimet: concrete flows out of an upright pipe through an orifice.".to_owned(),
        title: "Orimet",
        symmetry: vec!["x_min", "y_min"],
        min,
        max,
        parts: format!(
            "# The pipe is full.\n[[fluid]]\n{}\n\n# The pipe with its taper.\n{}",
            cuboid([0.0, 0.0, DROP], [0.5 * pipe, 0.5 * pipe, DROP + height]),
            block(mix, min, max, DROP, &bore)
        ),
        view: [[0.0, 0.0, DROP], [0.5 * orifice, 0.5 * orifice, top]],
        with: None,
    };
    Ok(emptying.case_text(mix, cell_size))
}

/// The figures of the experiment, if the case looks for light.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    case.gauges.light.first()?;
    let notes = vec![("dimensions", "from memory; EFNARC (2002, from memory) accepts up to 5 s".to_owned())];
    Some(emptying::figures("flow time", "flow_time_s", None, notes, case, summary))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

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
    fn the_pipe_narrows_to_its_orifice() {
        let case = case(&["--orifice", "70mm"]).unwrap();
        let wall = |x: f64, z: f64| case.solids[0].body.signed_distance(DVec3::new(x, 0.0, z)) < 0.0;
        for (z, radius) in [(0.151, 0.035), (0.2, 0.0475), (0.3, 0.06), (0.7, 0.06)] {
            assert!(wall(radius + 0.002, z) && !wall(radius - 0.002, z), "{z}");
        }
        assert!(!wall(0.1, 0.1));
    }

    #[test]
    fn nonsense_is_refused_with_advice() {
        assert!(case(&["--orifice", "130mm"]).unwrap_err().contains("smaller --orifice"));
        assert!(case(&["--cell-size", "7mm"]).unwrap_err().contains("--cell-size of 8 mm"));
    }
}
