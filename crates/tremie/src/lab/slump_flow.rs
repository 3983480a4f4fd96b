//! Slump flow (EN 12350-8): the diameter to which a cone of fresh concrete spreads.
//!
//! The cone is taken away at once instead of within 1 s to 3 s; T500 counts from that moment. Reported is the mean of two
//! diameters at right angles to the nearest 10 mm, and the time to the first touch of the 500 mm circle to 0.1 s. Classes
//! (EN 206, European Guidelines 2005) are told from these rounded figures, so that none falls between two classes:
//! SF1 550 to 650 mm, SF2 660 to 750 mm, SF3 760 to 850 mm; VS1 below 2.0 s, VS2 from 2.0 s.

use std::f64::consts::PI;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use serde_json::json;
use tremie_case::Case;
use tremie_case::units::{self, Dimension};
use tremie_geometry::Shape;
use tremie_simulation::Summary;

use super::Figures;
use super::thin_sheet::ThinSheet;
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "slump-flow";

/// The cone of EN 12350-2 in m: base and top diameter, height.
const CONE: [f64; 3] = [0.2, 0.1, 0.3];
/// Its volume in m3.
const VOLUME: f64 = PI / 12.0 * CONE[2] * (CONE[0] * CONE[0] + CONE[0] * CONE[1] + CONE[1] * CONE[1]);
const GRAVITY: f64 = 9.81;

/// Half a side in m that the plate has at least: room for the circle of 500 mm.
const LEAST_ROOM: f64 = 0.3;
/// The plate is larger than the expected spread by this factor.
const ROOM: f64 = 1.25;
/// Spread in m beyond which the sheet would be thinner than any aggregate.
const LARGEST_SPREAD: f64 = 3.0;
/// Cell sizes in m that make sense for the cone.
const CELL_SIZES: [f64; 2] = [2.5e-4, 0.025];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab slump-flow
  tremie lab slump-flow --yield-stress 50Pa --viscosity 30Pa.s --density 2300kg/m3
  tremie lab slump-flow --yield-stress 20Pa --cell-size 3mm --out runs/fine

The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    /// Yield stress
    #[arg(long, value_name = "STRESS", default_value = "50Pa", value_parser = stress)]
    yield_stress: f64,
    /// Plastic viscosity
    #[arg(long, value_name = "VISCOSITY", default_value = "30Pa.s", value_parser = viscosity)]
    viscosity: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = length)]
    cell_size: f64,
    /// Compute all of the concrete instead of a quarter between planes of symmetry
    #[arg(long)]
    full: bool,
    /// Format of the numbers in the cells
    #[arg(long, value_enum, default_value_t = Precision::F32)]
    precision: Precision,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Precision {
    /// 32 bits
    F32,
    /// 64 bits
    F64,
}

fn positive(text: &str, dimension: Dimension) -> Result<f64, String> {
    match units::parse(text, dimension) {
        Ok(value) if value > 0.0 => Ok(value),
        Ok(_) => Err("it must be positive".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

fn stress(text: &str) -> Result<f64, String> {
    positive(text, Dimension::STRESS)
}

fn viscosity(text: &str) -> Result<f64, String> {
    positive(text, Dimension::VISCOSITY)
}

fn density(text: &str) -> Result<f64, String> {
    positive(text, Dimension::DENSITY)
}

fn length(text: &str) -> Result<f64, String> {
    positive(text, Dimension::LENGTH)
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments).map_err(WrongInput)?;
    let case = Case::parse("slump flow", &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// Diameter in m at which the concrete comes to rest if it spreads slowly to a thin sheet.
fn spread_of_a_sheet(yield_stress: f64, density: f64) -> f64 {
    2.0 * ThinSheet::new(VOLUME, yield_stress, density, GRAVITY).radius
}

/// The case file, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { yield_stress, viscosity, density, cell_size, full, precision, .. } = arguments;
    let spread = spread_of_a_sheet(yield_stress, density);
    if spread > LARGEST_SPREAD {
        let least = yield_stress * (spread / LARGEST_SPREAD).powi(5);
        return Err(format!(
            "with a yield stress of {} Pa the concrete would spread to about {spread:.1} m, as thin as a coat of paint; give a --yield-stress of {} Pa at least",
            significant(yield_stress),
            significant(1.005 * least),
        ));
    }
    if !(CELL_SIZES[0]..=CELL_SIZES[1]).contains(&cell_size) {
        return Err(format!(
            "cells of {} mm do not suit a cone of 200 mm x 300 mm; give a --cell-size from 0.25 mm to 25 mm",
            significant(1e3 * cell_size)
        ));
    }
    // In whole cells, with at least one of air above the cone.
    let whole = |length: f64| (length / cell_size - 1e-9).ceil();
    let room = whole((0.5 * ROOM * spread).max(LEAST_ROOM));
    let height = whole(CONE[2]) + 1.0;
    let low = if full { -room } else { 0.0 };
    let mm = |length: f64| format!("\"{} mm\"", tidy(1e3 * length));
    let symmetry = if full { "" } else { "sides = { x_min = \"symmetry\", y_min = \"symmetry\" }\n" };
    let part = if full { "The whole plate." } else { "A quarter of the plate." };
    let precision = match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    };
    Ok(format!(
        r#"# Slump flow (EN 12350-8): a cone of fresh concrete that is let go at once.
# Edit it and run it with: tremie run FILE

title = "Slump flow"
method = "lbm"

[material]
density = "{density} kg/m3"
bingham = {{ yield_stress = "{yield_stress} Pa", plastic_viscosity = "{viscosity} Pa s" }}

# {part} The expected spread is {expected:.0} mm.
[domain]
min = [{min}, {min}, "0 mm"]
max = [{max}, {max}, {top}]
{symmetry}
# The cone of EN 12350-2.
[[fluid]]
cone = {{ base = ["0 mm", "0 mm", "0 mm"], base_diameter = "200 mm", top_diameter = "100 mm", height = "300 mm" }}

[lbm]
cell_size = {cell}
stepping = "adaptive"
precision = "{precision}"

[gauges]
interval = "20 ms"
spread = {{ centre = ["0 mm", "0 mm"] }}

# At rest the spread grows by less than 0.05 mm/s (over the last fifth of the time), has less than 0.5 % still to grow, and
# 99 % of the concrete is slower than 1 mm/s (for 1 s).
[stop]
time = "{stop} s"
rest = {{}}

[output]
snapshot_interval = "2 s"
picture_interval = "1 s"
"#,
        density = tidy(density),
        yield_stress = tidy(yield_stress),
        viscosity = tidy(viscosity),
        expected = 1e3 * spread,
        min = mm(low * cell_size),
        max = mm(room * cell_size),
        top = mm(height * cell_size),
        cell = mm(cell_size),
        stop = tidy(stop_time(viscosity, yield_stress)),
    ))
}

/// Time in s by which the concrete has long come to rest: it creeps for a multiple of its viscosity over its yield stress.
fn stop_time(viscosity: f64, yield_stress: f64) -> f64 {
    (200.0 * viscosity / yield_stress).clamp(60.0, 3600.0).ceil()
}

/// Without the noise in the last digits that computing leaves, and without negative zeros.
fn tidy(number: f64) -> f64 {
    format!("{number:.11e}").parse().unwrap_or(number) + 0.0
}

/// Whether a case is one of this experiment: the cone of EN 12350-2 alone, and its spread is measured.
pub(crate) fn is_one(case: &Case) -> bool {
    let close = |value: f64, wanted: f64| (value / wanted - 1.0).abs() < 1e-6;
    let standard = |shape: &Shape| match *shape {
        Shape::Cone { base_radius, top_radius, height, .. } => {
            close(2.0 * base_radius, CONE[0]) && close(2.0 * top_radius, CONE[1]) && close(height, CONE[2])
        }
        _ => false,
    };
    case.gauges.spread.is_some() && matches!(case.fluid.as_slice(), [region] if standard(&region.shape))
}

/// The figures of the experiment, if the case measures a spread.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let spread = summary.readings.spread?;
    let start = case.fluid.iter().find_map(|region| match region.shape {
        Shape::Cone { height, .. } => Some(height),
        _ => None,
    })?;
    let flow_mm = 1e3 * 0.5 * (spread.x + spread.y);
    let slump_mm = 1e3 * (start - spread.height).max(0.0);
    let (sf, vs) = (flow_class(flow_mm), summary.t500.map(viscosity_class));
    let t500 = match summary.t500 {
        Some(time) => format!("{time:.1} s"),
        None => "not reached".to_owned(),
    };
    let estimate = spread_of_a_sheet(case.material.curve.yield_stress(), case.material.density);
    let cell_size = tremie_lbm::Plan::new(case).scaling.cell_size;
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
        ("", "(first touch; here the cone vanishes at once, a real one is lifted in 1 s to 3 s)".to_owned()),
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

/// To the nearest 10 mm, halves up.
fn to_ten(millimetres: f64) -> u32 {
    10 * (millimetres / 10.0).round() as u32
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

    fn arguments(extra: &[&str]) -> Arguments {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        clap::Parser::try_parse_from([&["x"], extra].concat()).map(|line: Line| line.arguments).unwrap()
    }

    #[test]
    fn the_case_is_what_was_asked_for() {
        for cell in ["5mm", "3mm", "7mm", "20mm", "2.5mm", "0.3cm"] {
            for full in [&[][..], &["--full"]] {
                let arguments = arguments(&[&["--cell-size", cell, "--yield-stress", "20Pa"], full].concat());
                let text = case_text(&arguments).unwrap();
                let case = Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}"));
                assert!((case.domain.max.x - 0.5 * ROOM * 0.7206).abs() < 0.02, "{}", case.domain.max.x);
                assert_eq!(case.domain.min.x < 0.0, !full.is_empty());
                assert_eq!(case.material.curve.yield_stress(), 20.0);
                assert!(case.domain.max.z > 0.3);
            }
        }
    }

    #[test]
    fn the_formula_gives_what_others_have_worked_out() {
        // Spread in m for 2300 kg/m3 at 20, 50, 100 Pa.
        for (yield_stress, spread) in [(20.0, 0.720642), (50.0, 0.599973), (100.0, 0.52231)] {
            assert!((spread_of_a_sheet(yield_stress, 2300.0) - spread).abs() < 1e-4);
        }
    }

    #[test]
    fn nonsense_is_refused_with_advice() {
        for (line, advice) in [
            (["--yield-stress", "1e-6Pa"], "0.0161 Pa at least"),
            (["--cell-size", "50mm"], "to 25 mm"),
            (["--cell-size", "1um"], "from 0.25 mm"),
        ] {
            let refusal = case_text(&arguments(&line)).unwrap_err();
            assert!(refusal.contains(advice), "{refusal}");
        }
        assert!(case_text(&arguments(&["--yield-stress", "0.0162Pa"])).is_ok());
        assert!(case_text(&arguments(&["--yield-stress", "1MPa"])).is_ok());
    }

    #[test]
    fn classes_have_no_gaps() {
        let classes = [544.9, 545.0, 654.9, 655.0, 754.9, 755.0, 854.9, 855.0].map(flow_class);
        assert_eq!(classes, ["below SF1", "SF1", "SF1", "SF2", "SF2", "SF3", "SF3", "above SF3"]);
        assert_eq!([1.94, 1.96, 2.0].map(viscosity_class), ["VS1", "VS2", "VS2"]);
    }
}
