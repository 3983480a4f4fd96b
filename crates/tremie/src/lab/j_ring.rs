//! J-ring (EN 12350-12): slump flow through a ring of bars.
//!
//! Dimensions of the standard from memory: bars of 18 mm on a circle of 300 mm, 16 of them with gaps of 41 mm or 12 with 59 mm; they end
//! 120 mm above the plate, and the ring that holds them there is left out. Both axes pass between bars.
//!
//! Reported are the slump flow SFJ and the time t500J as in the slump flow, and the blocking step PJ: the level in the middle less the mean of
//! those just outside of the bars on both axes, each over 20 mm x 20 mm. Classes as in EN 206: PJ1 with 12 bars, PJ2 with 16, up to 10 mm.

use std::f64::consts::TAU;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use serde_json::json;
use tremie_case::Case;
use tremie_geometry::Body;
use tremie_simulation::Summary;

use super::cone::{CONE, ConeTest, Spreading, to_ten};
use super::setup::{bar, level, seen};
use super::{Figures, slump_flow};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "j-ring";

/// Diameters in m of the circle on which the bars stand and of the bars, and their height.
const RING: [f64; 3] = [0.3, 0.018, 0.12];
/// Edge in m of the squares over which levels are measured.
const SPOT: f64 = 0.02;
/// Largest blocking step in mm of either class.
const LARGEST_STEP: f64 = 10.0;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab j-ring
  tremie lab j-ring --bars 12 --yield-stress 30Pa --lift 0.15m/s

Compare with `tremie lab slump-flow` of the same mix. Dimensions are from memory of the standard. The folder's case.toml can
be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    test: ConeTest,
    /// Number of bars: 16 (narrow gaps) or 12 (wide gaps)
    #[arg(long, value_enum, default_value_t = Bars::Sixteen)]
    bars: Bars,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Bars {
    /// Twelve bars
    #[value(name = "12")]
    Twelve,
    /// Sixteen bars
    #[value(name = "16")]
    Sixteen,
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments.test, arguments.bars).map_err(WrongInput)?;
    let case = Case::parse("j-ring", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(test: &ConeTest, bars: Bars) -> Result<String, String> {
    let [circle, diameter, height] = RING;
    seen(diameter, test.cell_size)?;
    let number = match bars {
        Bars::Twelve => 12,
        Bars::Sixteen => 16,
    };
    let place = |n: i32| {
        let (sin, cos) = (TAU * (f64::from(n) + 0.5) / f64::from(number)).sin_cos();
        [0.5 * circle * cos, 0.5 * circle * sin, 0.0]
    };
    let inside = |p: &[f64; 3]| test.full || (p[0] > 0.0 && p[1] > 0.0);
    let list: Vec<String> = (0..number)
        .map(place)
        .filter(inside)
        .map(|p| format!("    {},\n", bar(p, height, diameter)))
        .collect();
    let (near, half) = (0.5 * (circle + diameter) + 0.5 * SPOT, 0.5 * SPOT);
    let spot = |name: &str, x: f64, y: f64| level(name, [x - half, y - half], [x + half, y + half]);
    let levels = [
        spot("middle", 0.0, 0.0),
        spot("x1", near, 0.0),
        spot("x2", -near, 0.0),
        spot("y1", 0.0, near),
        spot("y2", 0.0, -near),
    ];
    let spreading = Spreading {
        title: "J-ring",
        test: "J-ring (EN 12350-12)",
        cone: CONE,
        parts: format!(
            "\n# {number} bars on a circle, of which those in the domain.\n[[bars]]\nname = \"ring\"\nlist.of = [\n{}]\n",
            list.concat()
        ),
        gauges: format!("# In the middle, and just outside of the bars.\nlevel = [\n{}]\n", levels.concat()),
    };
    spreading.case_text(test)
}

/// The figures of the experiment, if the case measures spread and levels.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let readings = &summary.readings;
    let spread = readings.spread?;
    let flow_mm = 1e3 * 0.5 * (spread.x + spread.y);
    let outside = ["x1", "x2", "y1", "y2"].map(|name| readings.level(name));
    let outside = outside.into_iter().sum::<Option<f64>>()? / 4.0;
    let middle = readings.level("middle")?;
    let step_mm = 1e3 * (middle - outside);
    let bars = number_of_bars(case);
    let class = class(step_mm, bars);
    let t500 = slump_flow::t500(summary);
    let cell_size = case.method.resolution();
    let headline = vec![
        ("SFJ", format!("{} mm", to_ten(flow_mm))),
        ("t500J", t500.clone()),
        ("PJ", format!("{step_mm:.0} mm")),
        ("class", class.to_owned()),
    ];
    let rows = vec![
        (
            "flow spread SFJ",
            format!(
                "{flow_mm:.0} mm ({:.0} x {:.0} mm), to the nearest 10 mm: {} mm",
                1e3 * spread.x,
                1e3 * spread.y,
                to_ten(flow_mm)
            ),
        ),
        ("t500J", t500),
        ("", slump_flow::touch(case)),
        ("blocking step PJ", format!("{step_mm:.1} mm")),
        ("class", format!("{class}, {bars} bars")),
        (
            "heights",
            format!("{:.0} mm in the middle, {:.0} mm outside of the bars", 1e3 * middle, 1e3 * outside),
        ),
        ("dimensions", "from memory of EN 12350-12; the ring above the bars is left out".to_owned()),
        (
            "resolution",
            format!(
                "cells of {} mm, {:.1} over the diameter of a bar",
                significant(1e3 * cell_size),
                RING[1] / cell_size
            ),
        ),
    ];
    let json = [
        ("sfj_mm", json!(flow_mm)),
        ("pj_mm", json!(step_mm)),
        ("bars", json!(bars)),
        ("pj_class", json!(class)),
    ];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

/// Number of bars of a case, with those beyond its planes of symmetry.
fn number_of_bars(case: &Case) -> usize {
    let ring = case.solids.iter().find(|solid| solid.name == "ring");
    let here = ring.map_or(0, |solid| match &solid.body {
        Body::Union(union) => union.bodies().len(),
        _ => 1,
    });
    if case.domain.min.x == 0.0 { 4 * here } else { here }
}

fn class(step_mm: f64, bars: usize) -> &'static str {
    match (step_mm.round() <= LARGEST_STEP, bars) {
        (true, 12) => "PJ1",
        (true, 16) => "PJ2",
        (false, 12 | 16) => "none: PJ above 10 mm",
        _ => "none without the standard's bars",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    fn case(extra: &[&str]) -> Case {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        let line: Line = clap::Parser::try_parse_from([&["x"], extra].concat()).unwrap();
        let text = case_text(&line.arguments.test, line.arguments.bars).unwrap();
        Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn gaps_are_those_of_the_standard_and_the_axes_pass_between_bars() {
        for (bars, gap) in [("12", 0.0596), ("16", 0.0405)] {
            for full in [&[][..], &["--full"]] {
                let case = case(&[&["--bars", bars], full].concat());
                assert_eq!(number_of_bars(&case).to_string(), bars);
                let ring = &case.solids[0].body;
                let on_axis = ring.signed_distance(DVec3::new(0.15, 0.0, 0.05));
                // From the axis to a bar half a gap, a little more along the circle than along the chord.
                assert!((2.0 * on_axis - gap).abs() < 0.002, "{on_axis}");
                assert!(crate::lab::cone::lift(&case).is_none());
            }
        }
    }

    #[test]
    fn classes_are_told_from_whole_millimetres() {
        let told = [(10.4, 12), (10.4, 16), (10.6, 16), (3.0, 0)].map(|(step, bars)| class(step, bars));
        assert_eq!(told, ["PJ1", "PJ2", "none: PJ above 10 mm", "none without the standard's bars"]);
    }
}
