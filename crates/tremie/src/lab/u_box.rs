//! U-box: concrete flows from one limb under a gate, through bars, up into another.
//!
//! Dimensions from memory: two limbs of 140 mm x 200 mm, 680 mm high, one of them full (19 litres); an opening of 190 mm between them, and 20 mm behind it
//! three bars of 13 mm, 50 mm apart. The wall between the limbs is two cells thick. Reported are the levels H1 in the limb that
//! was full and H2 in the other; EFNARC (2002, from memory) accepts H1 - H2 up to 30 mm, other sources H2 from 300 mm.

use std::process::ExitCode;

use clap::Args;
use serde_json::json;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::cone::WALL;
use super::l_box::BEHIND;
use super::setup::{Mix, Setup, at_rest, bar, cuboid, fitting, level, liftable, lifted, seen, whole};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{length, speed};
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "u-box";

/// Length, depth and height of a limb in m.
const LIMB: [f64; 3] = [0.14, 0.2, 0.68];
/// Height of the opening in m.
const OPENING: f64 = 0.19;
/// Diameter of the bars and distance between their axes in m.
const BARS: [f64; 2] = [0.013, 0.05];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab u-box
  tremie lab u-box --yield-stress 20Pa --gate-speed 0.5m/s

Dimensions are from memory. The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
    /// Speed at which the gate is lifted
    #[arg(long, value_name = "SPEED", default_value = "0.3m/s", value_parser = speed)]
    gate_speed: f64,
    /// Leave out the bars
    #[arg(long)]
    no_bars: bool,
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
    let case = Case::parse("u-box", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { ref mix, gate_speed, no_bars, cell_size, .. } = arguments;
    let [limb, depth, height] = LIMB;
    fitting(cell_size, &[("a limb", limb), ("half the depth", 0.5 * depth)])?;
    liftable("a gate", gate_speed)?;
    if !no_bars {
        seen(BARS[0], cell_size)?;
    }
    let wall = WALL * cell_size;
    let half = 0.5 * depth;
    let (gate, end) = ([limb, limb + wall], 2.0 * limb + wall);
    let x = gate[1] + BEHIND + 0.5 * BARS[0];
    let list = [0.0, BARS[1]].map(|y| format!("    {},\n", bar([x, y, 0.0], OPENING, BARS[0])));
    let bars = if no_bars {
        String::new()
    } else {
        format!(
            "\n# Three bars, of which one stands beyond the plane of symmetry.\n[[bars]]\nname = \"bars\"\nlist.of = [\n{}]\n",
            list.concat()
        )
    };
    let parts = format!(
        r#"# One limb is full.
[[fluid]]
{concrete}

# The wall between the limbs.
[[solid]]
name = "wall"
{surface}{between}

# The gate is lifted until the opening is free.
[[solid]]
name = "gate"
{surface}{plate}
{motion}{bars}"#,
        surface = mix.surface(),
        concrete = cuboid([0.0; 3], [limb, half, height]),
        between = cuboid([gate[0], -depth, OPENING], [gate[1], depth, 2.0 * height]),
        plate = cuboid([gate[0], -depth, 0.0], [gate[1], depth, OPENING + wall]),
        motion = lifted(OPENING, gate_speed),
    );
    let levels = [level("H1", [0.0; 2], [limb, half]), level("H2", [gate[1], 0.0], [end, half])];
    let setup = Setup {
        test: "U-box: concrete flows from one limb under a gate and through bars into another.".to_owned(),
        title: "U-box",
        mix,
        domain: "Half of the box.".to_owned(),
        min: [0.0; 3],
        max: [end, half, whole(height, cell_size) + 2.0 * cell_size],
        symmetry: vec!["y_min"],
        parts,
        cell_size,
        gauges: format!("# In the limb that was full, and in the other.\nlevel = [\n{}]\n", levels.concat()),
        stop_time: mix.stop_time() + (OPENING / gate_speed).ceil(),
        stop: at_rest("{ level_rate = \"0.05 mm/s\" }"),
        intervals: [0.5, 2.0],
    };
    Ok(setup.text())
}

/// The figures of the experiment, if the case measures its levels.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let [h1, h2] = [summary.readings.level("H1")?, summary.readings.level("H2")?].map(|level| 1e3 * level);
    let cell_size = case.method.resolution();
    let headline = vec![("H1 - H2", format!("{:.0} mm", h1 - h2)), ("H2", format!("{h2:.0} mm"))];
    let rows = vec![
        ("H1 - H2", format!("{:.0} mm", h1 - h2)),
        ("H1", format!("{h1:.0} mm")),
        ("H2", format!("{h2:.0} mm")),
        ("acceptance", "H1 - H2 up to 30 mm (EFNARC 2002, from memory); H2 from 300 mm".to_owned()),
        ("dimensions", "from memory".to_owned()),
        ("resolution", format!("cells of {} mm", significant(1e3 * cell_size))),
    ];
    let json = [("h1_mm", json!(h1)), ("h2_mm", json!(h2)), ("difference_mm", json!(h1 - h2))];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_is_as_it_should_be() {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        for (extra, solids) in [(&[][..], 3), (&["--no-bars"], 2), (&["--cell-size", "4mm"], 3)] {
            let line: Line = clap::Parser::try_parse_from([&["x"], extra].concat()).unwrap();
            let case = Case::parse("x", &case_text(&line.arguments).unwrap());
            let case = case.unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(case.solids.len(), solids);
            let (min, max) = case.fluid[0].shape.bounds();
            assert!((2.0 * (max - min).element_product() - 19.04e-3).abs() < 1e-9);
        }
    }
}
