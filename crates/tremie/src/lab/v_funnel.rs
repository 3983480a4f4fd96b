//! V-funnel (EN 12350-9): how long concrete takes to flow through a narrow outlet.
//!
//! Dimensions of the standard from memory: 515 mm x 75 mm at the top, tapered over 450 mm to an outlet of 65 mm x 75 mm, 150 mm long; 10.5
//! litres. The outlet opens at once over a tray. Reported is t_v to 0.1 s, until light is first seen from above. Classes as in EN 206: VF1 below 9 s, VF2 9 s to 25 s.

use std::process::ExitCode;

use clap::Args;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::emptying::{self, Emptying, block};
use super::setup::{Mix, cuboid, mm, point, whole};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::length;
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "v-funnel";

/// Width of the funnel at the top, and height in m over which it is tapered.
const TOP: [f64; 2] = [0.515, 0.45];
/// The outlet: width, depth and length in m. The funnel is as deep.
const OUTLET: [f64; 3] = [0.065, 0.075, 0.15];
/// Height of the outlet in m above the tray.
const DROP: f64 = 0.15;
/// Width and depth in m of the tray.
const TRAY: [f64; 2] = [0.6, 0.5];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab v-funnel
  tremie lab v-funnel --yield-stress 20Pa --viscosity 60Pa.s
  tremie lab v-funnel --cell-size 2.5mm

Both 65 mm and 75 mm must be whole numbers of cells, such as of 5 mm; cells of 2.5 mm are the first of which a quarter of the funnel
will do. Dimensions are from memory of the standard. The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
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
    let text = case_text(&arguments.mix, arguments.cell_size).map_err(WrongInput)?;
    let case = Case::parse("v-funnel", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(mix: &Mix, cell_size: f64) -> Result<String, String> {
    let [width, depth, length] = OUTLET;
    let [top, taper] = TOP;
    let fits = |length: f64| {
        let cells = length / cell_size;
        (cells - cells.round()).abs() < 1e-6 && cells > 4.5
    };
    if !fits(width) || !fits(depth) {
        return Err(format!(
            "an outlet of 65 mm x 75 mm is no whole number of cells of {} mm, or fewer than five; give a --cell-size of 5 mm, 2.5 mm or 1 mm",
            significant(1e3 * cell_size)
        ));
    }
    // From the middle in whole cells, half a cell more where the outlet is an odd number of them.
    let far = |tray: f64, outlet: f64| 0.5 * outlet + whole(0.5 * (tray - outlet), cell_size);
    let [x, y] = [far(TRAY[0], width), far(TRAY[1], depth)];
    let quarter = fits(0.5 * width) && fits(0.5 * depth);
    let low = if quarter { [0.0, 0.0] } else { [-x, -y] };
    let height = DROP + length + taper;
    let (min, max) = ([low[0], low[1], 0.0], [x, y, whole(height, cell_size) + 2.0 * cell_size]);
    // The slanted walls: what lies before both of two planes is cut away, and so is the outlet.
    let (from, to) = (0.5 * width, 0.5 * top);
    let wall = |side: f64| {
        let (near, far) = if side > 0.0 { (from, x + to) } else { (-x - to, -from) };
        format!(
            "[[solid]]\nname = \"{}\"\n{}difference.from.{}\ndifference.without = [\n    {{ plane = {{ point = {}, normal = [{}, 0, -{}] }} }},\n]\n\n",
            if side > 0.0 { "right" } else { "left" },
            mix.surface(),
            cuboid([near, -2.0 * y, DROP], [far, 2.0 * y, 2.0 * height]),
            point([side * from, 0.0, DROP + length]),
            side * taper,
            to - from
        )
    };
    let slot = [cuboid([-2.0 * x, -0.5 * depth, 0.0], [2.0 * x, 0.5 * depth, 4.0 * height])];
    let walls: String = if quarter { wall(1.0) } else { [wall(1.0), wall(-1.0)].concat() };
    let concrete = cuboid(
        [if quarter { 0.0 } else { -to }, if quarter { 0.0 } else { -0.5 * depth }, DROP],
        [to, 0.5 * depth, height],
    );
    let emptying = Emptying {
        test: "V-funnel (EN 12350-9): concrete flows out of a funnel.".to_owned(),
        title: "V-funnel",
        symmetry: if quarter { vec!["x_min", "y_min"] } else { Vec::new() },
        min,
        max,
        parts: format!(
            "# The funnel is full, {} above a tray.\n[[fluid]]\n{concrete}\n\n{walls}# Its front and back.\n{}",
            mm(DROP).trim_matches('"'),
            block(mix, min, max, DROP, &slot)
        ),
        view: [
            [if quarter { 0.0 } else { -from }, if quarter { 0.0 } else { -0.5 * depth }, DROP],
            [from, 0.5 * depth, max[2]],
        ],
        with: None,
    };
    Ok(emptying.case_text(mix, cell_size))
}

/// The figures of the experiment, if the case looks for light.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    case.gauges.light.first()?;
    let class = emptying::time(summary).map(class);
    let notes = vec![("dimensions", "from memory of EN 12350-9; the outlet opens at once".to_owned())];
    Some(emptying::figures("t_v", "t_v_s", class, notes, case, summary))
}

fn class(time: f64) -> &'static str {
    match (10.0 * time).round() as i64 {
        ..90 => "VF1",
        90..=250 => "VF2",
        _ => "above VF2",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    fn case(mix: &[&str], cell_size: f64) -> Result<Case, String> {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            mix: Mix,
        }
        let line: Line = clap::Parser::try_parse_from([&["x"], mix].concat()).unwrap();
        let text = case_text(&line.mix, cell_size)?;
        Ok(Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}")))
    }

    #[test]
    fn the_funnel_holds_ten_and_a_half_litres() {
        for (cell, copies) in [(0.005, 1.0), (0.0025, 4.0)] {
            let case = case(&[], cell).unwrap();
            let (min, max) = case.fluid[0].shape.bounds();
            // Over its height the funnel is as wide as there is room between its walls; slices of 1 mm.
            let open = |x: f64, z: f64| {
                let p = DVec3::new(x, 0.02, z);
                case.solids.iter().all(|solid| solid.body.signed_distance(p) > 0.0)
            };
            let count = |from: f64, to: f64| ((to - from) / 1e-3).round() as usize;
            let mut columns = 0;
            for k in 0..count(min.z, max.z) {
                let z = min.z + 1e-3 * (k as f64 + 0.5);
                columns +=
                    (0..count(min.x, max.x)).filter(|i| open(min.x + 1e-3 * (*i as f64 + 0.5), z)).count();
            }
            let volume = copies * columns as f64 * 1e-6 * (max.y - min.y);
            assert!((volume / 10.52e-3 - 1.0).abs() < 0.01, "{volume}");
            // The wall of the outlet is a side of cells.
            let faces = (0.0325 - case.domain.min.x) / cell;
            assert!((faces - faces.round()).abs() < 1e-6, "{faces}");
        }
    }

    #[test]
    fn cells_that_do_not_fit_are_refused_and_classes_have_no_gaps() {
        for cell in [0.01, 0.004, 0.00375] {
            assert!(case(&[], cell).unwrap_err().contains("--cell-size of 5 mm"));
        }
        assert_eq!([8.94, 8.96, 25.04, 25.06].map(class), ["VF1", "VF2", "VF2", "above VF2"]);
    }
}
