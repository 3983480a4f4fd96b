//! LCPC box (N. Roussel, Materials and Structures 40, 2007, 889-896): concrete is poured slowly at the end of a channel, and how far it
//! spreads tells its yield stress.
//!
//! Channel of 1200 mm x 200 mm x 150 mm and 6 litres in 30 s, from memory of the paper. Here the concrete comes in evenly over the width
//! through the lower 40 mm of the back wall instead of from a bucket above it: it neither falls nor splashes, as slow pouring would
//! have it.
//!
//! Reported are the spread L, from the back wall to the furthest point of the front, the height h0 over the first 20 mm, and the yield stress
//! that the balance of weight and friction (`tremie calc lcpc-box`) gives back from L.

use std::process::ExitCode;

use clap::Args;
use serde_json::json;
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::cone::WALL;
use super::setup::{Mix, Setup, at_rest, cuboid, fitting, level, mm, point, tidy, whole};
use crate::calc::LcpcBox;
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{length, time, volume};
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "lcpc-box";

/// Height in m, at least, of the opening through which the concrete comes in.
const OPENING: f64 = 0.04;
/// Length in m at the back over which h0 is measured.
const BACK: f64 = 0.02;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab lcpc-box
  tremie lab lcpc-box --yield-stress 30Pa --viscosity 20Pa.s
  tremie lab lcpc-box --volume 5l --pour-time 60s --cell-size 5mm

Dimensions are from memory of Roussel (2007). The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
    /// Volume that is poured
    #[arg(long, value_name = "VOLUME", default_value = "6l", value_parser = volume)]
    volume: f64,
    /// Time in which it is poured
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = time)]
    pour_time: f64,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "10mm", value_parser = length)]
    cell_size: f64,
    /// Compute all of the concrete instead of a half beside a plane of symmetry
    #[arg(long)]
    full: bool,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments).map_err(WrongInput)?;
    let case = Case::parse("lcpc-box", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { ref mix, volume, pour_time, cell_size, full, .. } = arguments;
    let LcpcBox { width, length, height, .. } = LcpcBox::STANDARD;
    let half = 0.5 * width;
    let across = if full { ("the width", width) } else { ("half the width", half) };
    fitting(cell_size, &[across, ("the channel", length)])?;
    let most = width * length * height;
    if volume > most {
        return Err(format!("the box holds {} l; give a smaller --volume", significant(1e3 * most)));
    }
    let low = if full { -half } else { 0.0 };
    let opening = whole(OPENING, cell_size);
    let back = WALL * cell_size;
    let parts = format!(
        r#"# The concrete comes in slowly at the back, over the whole width{share}.
[[inlet]]
rectangle = {{ centre = {centre}, direction = [1, 0, 0], size = {size} }}
flow_rate = "{rate} l/s"
volume = "{litres} l"

# The back wall.
[[solid]]
name = "back"
{wall}
"#,
        share = if full { "" } else { ", of which half is computed" },
        centre = point([0.0, 0.0, 0.5 * opening]),
        size = point([width, opening]),
        rate = tidy(1e3 * volume / pour_time),
        litres = tidy(1e3 * volume),
        wall = cuboid([-1.0, -1.0, -1.0], [0.0, 1.0, 1.0]),
    );
    let setup = Setup {
        test: "LCPC box (Roussel 2007): concrete is poured slowly at the end of a channel.".to_owned(),
        title: "LCPC box",
        mix,
        domain: if full { "The channel." } else { "Half of the channel." }.to_owned(),
        min: [-back, low, 0.0],
        max: [length, half, whole(height, cell_size)],
        symmetry: if full { Vec::new() } else { vec!["y_min"] },
        parts,
        cell_size,
        gauges: format!(
            "# The height at the back, and the spread.\nlevel = [\n{}]\nfront = [{{ name = \"L\", direction = \"x\", at = {} }}]\n",
            level("h0", [0.0, low], [BACK, half]),
            mm(0.0)
        ),
        stop_time: pour_time.ceil() + mix.stop_time(),
        stop: at_rest("{ speed = \"0.2 mm/s\" }"),
        intervals: [1.0, 5.0],
    };
    Ok(setup.text())
}

/// The figures of the experiment, if the case measures the spread.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let readings = &summary.readings;
    let (spread, height) = (readings.front("L")?, readings.level("h0")?);
    let (density, yield_stress) = (case.material.density, case.material.curve.yield_stress());
    if spread <= 0.0 {
        return None;
    }
    let channel = LcpcBox { volume: readings.volume, ..LcpcBox::STANDARD };
    let found = channel.yield_stress(spread, density);
    let doubts = channel.warnings(&channel.at_rest(found, density));
    let cell_size = case.method.resolution();
    let mm = |length: f64| format!("{:.0} mm", 1e3 * length);
    let pascals = format!("{} Pa", significant(found));
    let headline = vec![("spread L", mm(spread)), ("yield stress from L", pascals.clone())];
    let mut rows = vec![
        ("spread L", mm(spread)),
        ("height h0", format!("{}, mean over {} at the back", mm(height), mm(BACK))),
        (
            "yield stress from L",
            format!(
                "{pascals}, by the balance of weight and friction; given: {} Pa",
                significant(yield_stress)
            ),
        ),
    ];
    if yield_stress > 0.0 {
        let state = channel.at_rest(yield_stress, density);
        rows.push(("by the formula", format!("L {}, h0 {}", mm(state.length), mm(state.height))));
    }
    rows.push((
        "",
        "(Roussel 2007; for slow pouring, and a layer that is long against its height:".to_owned(),
    ));
    rows.push(("", format!("here h0 over L {:.2})", height / spread)));
    rows.extend(doubts.iter().map(|doubt| ("doubtful", doubt.clone())));
    rows.push(("dimensions", "from memory of Roussel (2007)".to_owned()));
    rows.push((
        "resolution",
        format!("cells of {} mm, {:.1} over h0", significant(1e3 * cell_size), height / cell_size),
    ));
    let json = [
        ("spread_mm", json!(1e3 * spread)),
        ("h0_mm", json!(1e3 * height)),
        ("yield_stress_from_spread_Pa", json!(found)),
        ("formula_holds", json!(doubts.is_empty())),
    ];
    Some(Figures {
        headline,
        rows,
        json: json.map(|(name, value)| (name.to_owned(), value)).into_iter().collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(extra: &[&str]) -> Result<String, String> {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        let line: Line = clap::Parser::try_parse_from([&["x"], extra].concat()).unwrap();
        case_text(&line.arguments)
    }

    #[test]
    fn six_litres_come_in_thirty_seconds_through_the_foot_of_the_back_wall() {
        for (extra, low) in [(&[][..], 0.0), (&["--full"], -0.1), (&["--cell-size", "6.25mm"], 0.0)] {
            let case = Case::parse("x", &text(extra).unwrap()).unwrap_or_else(|error| panic!("{error}"));
            let [inlet] = case.inlets.as_slice() else { panic!("one inlet") };
            assert!((inlet.volume - 6e-3).abs() < 1e-15 && (inlet.end() - 30.0).abs() < 1e-9);
            let (min, max) = inlet.face.bounds(0.0);
            assert!(min.z.abs() < 1e-12 && (0.04..0.045).contains(&max.z) && min.x.abs() < 1e-12);
            assert!((max.y - 0.1).abs() < 1e-12 && (case.domain.min.y - low).abs() < 1e-12);
            // The face lies in the back wall.
            let wall = &case.solids[0].body;
            assert!(wall.signed_distance(inlet.face.centre).abs() < 1e-12);
            assert!(case.pours(29.9) && !case.pours(30.1));
        }
        let slow = text(&["--volume", "5l", "--pour-time", "50s"]).unwrap();
        assert!(slow.contains("flow_rate = \"0.1 l/s\"\nvolume = \"5 l\""), "{slow}");
    }

    #[test]
    fn nonsense_is_refused_with_advice() {
        assert!(text(&["--cell-size", "7mm"]).unwrap_err().contains("--cell-size of 6.25 mm"));
        assert!(text(&["--volume", "40l"]).unwrap_err().contains("holds 36 l; give a smaller --volume"));
    }
}
