//! L-box (EN 12350-10): concrete flows from a column under a gate, through bars, along a channel.
//!
//! Column, channel and bars of the standard from memory: a column of 100 mm x 200 mm x 600 mm, a channel 150 mm high; three bars of 12 mm
//! with gaps of 41 mm, or two with 59 mm. The 700 mm of the channel count from the back of the column here, 600 mm of them
//! beyond it, as `tremie calc l-box` has it: whether the column counts changes the result much. The gate and the wall above it are
//! two cells thick and stand beyond the column; the bars stand 20 mm beyond the gate, as high as the channel.
//!
//! Reported are H1, the level in the column, H2, that over the last 20 mm of the channel, and PL = H2/H1 to 0.01; the times from when the
//! gate begins to rise to when the front has gone 200 mm and 400 mm beyond the column. Classes as in EN 206: PL1 with two bars, PL2
//! with three, from PL = 0.80.

use std::process::ExitCode;

use clap::{Args, ValueEnum};
use serde_json::json;
use tremie_case::Case;
use tremie_geometry::Body;
use tremie_simulation::Summary;

use super::Figures;
use super::cone::WALL;
use super::setup::{Mix, Setup, at_rest, bar, cuboid, fitting, level, liftable, lifted, seen, whole};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{length, speed};
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "l-box";

/// Length in m of the end of the channel over which H2 is measured.
const END: f64 = 0.02;
/// Clear distance in m between gate and bars.
pub(super) const BEHIND: f64 = 0.02;
/// How far in m beyond the column the front is timed.
const MARKS: [f64; 2] = [0.2, 0.4];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab l-box
  tremie lab l-box --yield-stress 30Pa --viscosity 50Pa.s --bars 2
  tremie lab l-box --bars 0 --gate-speed 1cm/s --channel 700mm
  tremie lab l-box --slip-length 5mm

The 700 mm of the standard's channel count from the back of the column here: 600 mm of them lie beyond it. Dimensions are
from memory of the standard. The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
    /// Number of bars: 3, 2 or none
    #[arg(long, value_enum, default_value_t = Bars::Three)]
    bars: Bars,
    /// Diameter of the bars
    #[arg(long, value_name = "LENGTH", default_value = "12mm", value_parser = length)]
    bar_diameter: f64,
    /// Speed at which the gate is lifted
    #[arg(long, value_name = "SPEED", default_value = "0.3m/s", value_parser = speed)]
    gate_speed: f64,
    /// Length of the channel beyond the column
    #[arg(long, value_name = "LENGTH", default_value = "600mm", value_parser = length)]
    channel: f64,
    /// Width of the box
    #[arg(long, value_name = "LENGTH", default_value = "200mm", value_parser = length)]
    width: f64,
    /// Depth of the column, along the channel
    #[arg(long, value_name = "LENGTH", default_value = "100mm", value_parser = length)]
    column_depth: f64,
    /// Height of the column, which is full of concrete
    #[arg(long, value_name = "LENGTH", default_value = "600mm", value_parser = length)]
    column_height: f64,
    /// Height of the channel, and of the opening under the gate
    #[arg(long, value_name = "LENGTH", default_value = "150mm", value_parser = length)]
    channel_height: f64,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = length)]
    cell_size: f64,
    /// Compute all of the concrete instead of a half beside a plane of symmetry
    #[arg(long)]
    full: bool,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Bars {
    /// No bars
    #[value(name = "0")]
    None,
    /// Two bars
    #[value(name = "2")]
    Two,
    /// Three bars
    #[value(name = "3")]
    Three,
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments).map_err(WrongInput)?;
    let case = Case::parse("l-box", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { ref mix, gate_speed, channel, width, column_depth, column_height, .. } = arguments;
    let &Arguments { channel_height, cell_size, full, bar_diameter, .. } = arguments;
    let half = 0.5 * width;
    let across = if full { ("the width", width) } else { ("half the width", half) };
    let sizes = [("the column's depth", column_depth), across, ("the channel", channel)];
    fitting(cell_size, &sizes)?;
    liftable("a gate", gate_speed)?;
    let wall = WALL * cell_size;
    if channel_height + 2.0 * cell_size > column_height {
        return Err("the channel is as high as the column; give a larger --column-height".to_owned());
    }
    if channel < MARKS[1] {
        return Err("the front is timed 400 mm beyond the column; give a longer --channel".to_owned());
    }
    let low = if full { -half } else { 0.0 };
    let end = column_depth + channel;
    // Beyond the domain where they touch its sides.
    let beyond = 2.0 * width;
    let gate = [column_depth, column_depth + wall];
    let parts = format!(
        r#"# The column is full.
[[fluid]]
{concrete}

# The wall of the column above the opening.
[[solid]]
name = "wall"
{surface}{front}

# The gate is lifted until the opening is free.
[[solid]]
name = "gate"
{surface}{plate}
{motion}{bars}"#,
        surface = mix.surface(),
        concrete = cuboid([0.0, low, 0.0], [column_depth, half, column_height]),
        front = cuboid([gate[0], -beyond, channel_height], [gate[1], beyond, 2.0 * column_height]),
        plate = cuboid([gate[0], -beyond, 0.0], [gate[1], beyond, channel_height + wall]),
        motion = lifted(channel_height, gate_speed),
        bars = bars(arguments, gate[1] + BEHIND + 0.5 * bar_diameter, low)?,
    );
    let front = |mark: f64| {
        format!(
            "    {{ name = \"T{:.0}\", direction = \"x\", at = \"{:.0} mm\" }},\n",
            1e3 * mark,
            1e3 * (column_depth + mark)
        )
    };
    let levels = [level("H1", [0.0, low], [column_depth, half]), level("H2", [end - END, low], [end, half])];
    let setup = Setup {
        test: "L-box (EN 12350-10): concrete flows from a column under a gate and through bars.".to_owned(),
        title: "L-box",
        mix,
        domain: if full { "The box." } else { "Half of the box." }.to_owned(),
        min: [0.0, low, 0.0],
        max: [end, half, whole(column_height, cell_size) + 2.0 * cell_size],
        symmetry: if full { Vec::new() } else { vec!["y_min"] },
        parts,
        cell_size,
        gauges: format!(
            "# H1 in the column, H2 at the end of the channel; the front 200 mm and 400 mm beyond the column.\nlevel = [\n{}]\nfront = [\n{}]\n",
            levels.concat(),
            MARKS.map(front).concat()
        ),
        stop_time: mix.stop_time() + (channel_height / gate_speed).ceil(),
        stop: at_rest("{ level_rate = \"0.05 mm/s\" }"),
        intervals: [0.5, 2.0],
    };
    Ok(setup.text())
}

/// The bars at the place `x` along the channel, of which those count whose middle is not below `low`: with the same gap between them
/// and beside them.
fn bars(arguments: &Arguments, x: f64, low: f64) -> Result<String, String> {
    let &Arguments { bars, bar_diameter: diameter, width, channel_height, cell_size, .. } = arguments;
    let number = match bars {
        Bars::None => return Ok(String::new()),
        Bars::Two => 2.0,
        Bars::Three => 3.0,
    };
    let gap = (width - number * diameter) / (number + 1.0);
    if gap <= 0.0 {
        return Err(format!("there is no room for {number} bars of {} mm", significant(1e3 * diameter)));
    }
    seen(diameter, cell_size)?;
    let place = |n: i32| -0.5 * width + gap + 0.5 * diameter + f64::from(n) * (gap + diameter);
    let all = (0..number as i32).map(place).filter(|y| *y > low - 1e-9);
    let list: Vec<String> =
        all.map(|y| format!("    {},\n", bar([x, y, 0.0], channel_height, diameter))).collect();
    Ok(format!(
        "\n# {number} bars with gaps of {} mm.\n[[bars]]\nname = \"bars\"\nlist.of = [\n{}]\n",
        significant(1e3 * gap),
        list.concat()
    ))
}

/// The figures of the experiment, if the case measures its levels.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let (h1, h2) = (summary.readings.level("H1")?, summary.readings.level("H2")?);
    let ratio = if h1 > 0.0 { h2 / h1 } else { 0.0 };
    let bars = number_of_bars(case);
    let class = class(ratio, bars);
    let times = ["T200", "T400"].map(|name| summary.event(&format!("front_{name}_s")));
    let shown = |time: Option<f64>| time.map_or("not reached".to_owned(), |time| format!("{time:.1} s"));
    let cell_size = case.method.resolution();
    let ratio_row = format!("{ratio:.2}  (H2/H1)");
    let headline = vec![
        ("PL", format!("{ratio:.2}")),
        ("T200, T400", times.map(shown).join(", ")),
        ("class", class.to_owned()),
    ];
    let rows = vec![
        ("passing ability PL", ratio_row),
        ("class", format!("{class}, {bars} bars")),
        ("H1", format!("{:.0} mm, level in the column", 1e3 * h1)),
        ("H2", format!("{:.0} mm, level over the last {:.0} mm of the channel", 1e3 * h2, 1e3 * END)),
        ("T200", shown(times[0])),
        ("T400", shown(times[1])),
        ("", "(from when the gate begins to rise to 200 mm and 400 mm beyond the column)".to_owned()),
        (
            "dimensions",
            "from memory of EN 12350-10; the 700 mm of its channel count from the back of the column"
                .to_owned(),
        ),
        (
            "resolution",
            format!("cells of {} mm, {:.1} over H2", significant(1e3 * cell_size), h2 / cell_size),
        ),
    ];
    let json = [
        ("h1_mm", json!(1e3 * h1)),
        ("h2_mm", json!(1e3 * h2)),
        ("passing_ratio", json!(ratio)),
        ("bars", json!(bars)),
        ("pl_class", json!(class)),
    ];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

/// Number of bars of a case, with those beyond its plane of symmetry.
fn number_of_bars(case: &Case) -> usize {
    let half = case.domain.min.y == 0.0;
    let bars = case.solids.iter().filter_map(|solid| match &solid.body {
        Body::Union(union) if solid.name == "bars" => Some(union.bodies()),
        _ => None,
    });
    bars.flatten()
        .map(|bar| {
            let (min, max) = bar.bounds();
            if half && min.y + max.y > 1e-6 { 2 } else { 1 }
        })
        .sum()
}

fn class(ratio: f64, bars: usize) -> &'static str {
    match ((100.0 * ratio).round() >= 80.0, bars) {
        (true, 2) => "PL1",
        (true, 3) => "PL2",
        (false, 2 | 3) => "none: PL below 0.80",
        _ => "none without the standard's bars",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    fn arguments(extra: &[&str]) -> Arguments {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        clap::Parser::try_parse_from([&["x"], extra].concat()).map(|line: Line| line.arguments).unwrap()
    }

    fn case(extra: &[&str]) -> Case {
        let text = case_text(&arguments(extra)).unwrap();
        Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn concrete_slides_along_walls_and_gate_but_sticks_to_bars() {
        use tremie_case::{Side, Surface};
        let sliding = Surface::Navier { slip_length: 0.005 };
        for (extra, walls) in [(&[][..], Surface::NoSlip), (&["--slip-length", "5mm"], sliding)] {
            let case = case(extra);
            for (n, side) in case.domain.sides.iter().enumerate() {
                let wall = Side::Wall { velocity: DVec3::ZERO, surface: walls };
                assert_eq!(*side, if n == 2 { Side::Symmetry } else { wall }, "{n}");
            }
            for solid in &case.solids {
                assert_eq!(
                    solid.surface,
                    if solid.name == "bars" { Surface::NoSlip } else { walls },
                    "{}",
                    solid.name
                );
            }
        }
    }

    #[test]
    fn the_box_holds_twelve_litres_and_its_bars_have_the_gaps_of_the_standard() {
        for (extra, number, gap) in [
            (&["--bars", "3"][..], 3, 0.041),
            (&["--bars", "2"], 2, 0.0587),
            (&["--bars", "3", "--full"], 3, 0.041),
            (&["--bars", "2", "--full", "--cell-size", "4mm"], 2, 0.0587),
            (&["--bars", "0"], 0, 0.0),
        ] {
            let case = case(extra);
            assert_eq!(number_of_bars(&case), number);
            let (min, max) = case.fluid[0].shape.bounds();
            let copies = if extra.contains(&"--full") { 1.0 } else { 2.0 };
            assert!((copies * (max - min).element_product() - 12e-3).abs() < 1e-12);
            assert!((case.domain.max.x - 0.7).abs() < 1e-12);
            let Some(bars) = case.solids.iter().find(|solid| solid.name == "bars") else { continue };
            // From the bar beside the wall to the wall.
            let wall = case.domain.max.y - bars.body.bounds().1.y;
            assert!((wall - gap).abs() < 1e-4, "{wall}");
            assert!(bars.body.bounds().0.x > case.solids[1].body.bounds().1.x);
        }
    }

    #[test]
    fn the_gate_opens_the_channel_and_no_more() {
        let case = case(&["--gate-speed", "0.15m/s"]);
        let gate = case.solids.iter().find(|solid| solid.name == "gate").unwrap();
        let closed = |z: f64, time: f64| {
            let p = DVec3::new(0.105, 0.05, z) - gate.motion.offset(time);
            gate.body.signed_distance(p) < 0.0
                || case.solids[0].body.signed_distance(p + gate.motion.offset(time)) < 0.0
        };
        assert!(closed(0.001, 0.0) && closed(0.151, 0.0) && closed(0.3, 0.0));
        assert!(!closed(0.07, 0.5) && closed(0.08, 0.5));
        assert!(!closed(0.149, 1.0) && closed(0.151, 1.0) && closed(0.3, 2.0));
    }

    #[test]
    fn classes_are_told_from_the_rounded_ratio() {
        let told = [(0.794, 3), (0.796, 3), (0.8, 2), (0.9, 0)].map(|(ratio, bars)| class(ratio, bars));
        assert_eq!(told, ["none: PL below 0.80", "PL2", "PL1", "none without the standard's bars"]);
    }

    #[test]
    fn nonsense_is_refused_with_advice() {
        for (line, advice) in [
            (["--cell-size", "7mm"], "give a --cell-size of 6.25 mm"),
            (["--cell-size", "60mm"], "give a --cell-size of 25 mm"),
            (["--gate-speed", "1mm/s"], "from 1 cm/s to 5 m/s"),
            (["--cell-size", "10mm"], "give a --cell-size of 8.4 mm at most"),
            (["--bar-diameter", "70mm"], "no room for 3 bars of 70 mm"),
            (["--channel", "300mm"], "give a longer --channel"),
            (["--column-height", "150mm"], "give a larger --column-height"),
        ] {
            let refusal = case_text(&arguments(&line)).unwrap_err();
            assert!(refusal.contains(advice), "{refusal}");
        }
    }
}
