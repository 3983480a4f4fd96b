//! The cone of EN 12350-2 and -8, filled with fresh concrete and taken away: what slump and slump flow have in common.
//!
//! The mould vanishes at once, or is lifted at a speed by its height of 300 mm: 2 s of the standards' tests are 0.15 m/s. A real mould is a
//! thin sheet; here its wall is two cells thick, outwards, and the concrete slides along it.

use std::f64::consts::PI;

use clap::{Args, ValueEnum};
use tremie_case::Case;
use tremie_geometry::{Body, Motion, Shape};

use super::thin_sheet::ThinSheet;
use crate::numbers::significant;
use crate::quantities::{density, length, speed, stress, viscosity};

/// The cone of EN 12350-2 in m: base and top diameter, height.
pub(crate) const CONE: [f64; 3] = [0.2, 0.1, 0.3];
/// Its volume in m3.
pub(crate) const VOLUME: f64 =
    PI / 12.0 * CONE[2] * (CONE[0] * CONE[0] + CONE[0] * CONE[1] + CONE[1] * CONE[1]);
/// Gravity in m/s2.
pub(crate) const GRAVITY: f64 = 9.81;

/// Half a side in m that the plate has at least: room for the circle of 500 mm.
const LEAST_ROOM: f64 = 0.3;
/// The plate is larger than the expected spread by this factor.
const ROOM: f64 = 1.25;
/// Spread in m beyond which the sheet would be thinner than any aggregate.
const LARGEST_SPREAD: f64 = 3.0;
/// Speeds in m/s at which a mould can be lifted.
const LIFTS: [f64; 2] = [0.01, 5.0];
/// Cells through the wall of the mould: more than a step between diagonal neighbours.
const WALL: f64 = 2.0;
/// Cell sizes in m that make sense for the cone.
const CELL_SIZES: [f64; 2] = [2.5e-4, 0.025];

/// What can be said about the concrete and how it is computed.
#[derive(Debug, Args)]
pub(super) struct Mix {
    /// Yield stress
    #[arg(long, value_name = "STRESS", default_value = "50Pa", value_parser = stress)]
    yield_stress: f64,
    /// Plastic viscosity
    #[arg(long, value_name = "VISCOSITY", default_value = "30Pa.s", value_parser = viscosity)]
    viscosity: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
    /// Lift the cone at this speed instead of taking it away at once (its 300 mm in 2 s are 0.15 m/s)
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    lift: Option<f64>,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = length)]
    cell_size: f64,
    /// Compute all of the concrete instead of a quarter between planes of symmetry
    #[arg(long)]
    full: bool,
    /// Format of the numbers in the cells
    #[arg(long, value_enum, default_value_t = Precision::F32)]
    precision: Precision,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Precision {
    /// 32 bits
    F32,
    /// 64 bits
    F64,
}

/// Diameter in m at which the concrete comes to rest if it spreads slowly to a thin sheet.
pub(super) fn spread_of_a_sheet(yield_stress: f64, density: f64) -> f64 {
    2.0 * ThinSheet::new(VOLUME, yield_stress, density, GRAVITY).radius
}

/// The case file of an experiment, or why there is none; `title` stands above the pictures, `test` says what it is.
pub(super) fn case_text(mix: &Mix, title: &str, test: &str) -> Result<String, String> {
    let &Mix { yield_stress, viscosity, density, lift, cell_size, full, precision } = mix;
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
    if let Some(speed) = lift
        && !(LIFTS[0]..=LIFTS[1]).contains(&speed)
    {
        return Err(format!(
            "a mould is not lifted at {} m/s; give a --lift from 1 cm/s to 5 m/s, or none to take it away at once",
            significant(speed)
        ));
    }
    // In whole cells, with at least one of air above the cone, and room to see it lifted.
    let whole = |length: f64| (length / cell_size - 1e-9).ceil();
    let room = whole((0.5 * ROOM * spread).max(LEAST_ROOM));
    let height = whole(if lift.is_some() { 2.0 * CONE[2] } else { CONE[2] }) + 1.0;
    let low = if full { -room } else { 0.0 };
    let mm = |length: f64| format!("\"{} mm\"", tidy(1e3 * length));
    let symmetry = if full { "" } else { "sides = { x_min = \"symmetry\", y_min = \"symmetry\" }\n" };
    let part = if full { "The whole plate." } else { "A quarter of the plate." };
    let precision = match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    };
    Ok(format!(
        r#"# {test}: a cone of fresh concrete {how}.
# Edit it and run it with: tremie run FILE

title = "{title}"
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
{mould}
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
        how = if lift.is_some() { "whose mould is lifted" } else { "that is let go at once" },
        mould = lift.map_or_else(String::new, |speed| mould(speed, cell_size)),
        density = tidy(density),
        yield_stress = tidy(yield_stress),
        viscosity = tidy(viscosity),
        expected = 1e3 * spread,
        min = mm(low * cell_size),
        max = mm(room * cell_size),
        top = mm(height * cell_size),
        cell = mm(cell_size),
        stop = tidy(stop_time(viscosity, yield_stress) + lift.map_or(0.0, |speed| (CONE[2] / speed).ceil())),
    ))
}

/// The mould that is lifted at a speed in m/s.
fn mould(speed: f64, cell_size: f64) -> String {
    format!(
        r#"
# The mould is lifted by its height at {speed} m/s. Its inside is that of the standard; its wall is thick enough for the cells.
[[solid]]
cone_shell = {{ base = ["0 mm", "0 mm", "0 mm"], base_diameter = "200 mm", top_diameter = "100 mm", height = "300 mm", thickness = "{thickness} mm" }}
surface = "free_slip"
[solid.motion.path]
points = [
    {{ time = "0 s", offset = ["0 mm", "0 mm", "0 mm"] }},
    {{ time = "{time} s", offset = ["0 mm", "0 mm", "300 mm"] }},
]
"#,
        thickness = tidy(1e3 * WALL * cell_size),
        time = tidy(CONE[2] / speed),
        speed = tidy(speed),
    )
}

/// Speed in m/s at which a case lifts its mould.
pub(super) fn lift(case: &Case) -> Option<f64> {
    let moulds =
        case.solids.iter().filter(|solid| matches!(solid.body, Body::Shape(Shape::ConeShell { .. })));
    let speeds =
        moulds.filter(|solid| solid.motion != Motion::REST).map(|solid| solid.motion.largest_speed(0.0));
    speeds.reduce(f64::max)
}

/// Time in s by which the concrete has long come to rest: it creeps for a multiple of its viscosity over its yield stress.
fn stop_time(viscosity: f64, yield_stress: f64) -> f64 {
    (200.0 * viscosity / yield_stress).clamp(60.0, 3600.0).ceil()
}

/// Without the noise in the last digits that computing leaves, and without negative zeros.
fn tidy(number: f64) -> f64 {
    format!("{number:.11e}").parse().unwrap_or(number) + 0.0
}

/// Whether a case is this cone, with nothing else in it, and its spread is measured.
pub(super) fn is_one(case: &Case) -> bool {
    let close = |value: f64, wanted: f64| (value / wanted - 1.0).abs() < 1e-6;
    let standard = |shape: &Shape| match *shape {
        Shape::Cone { base_radius, top_radius, height, .. } => {
            close(2.0 * base_radius, CONE[0]) && close(2.0 * top_radius, CONE[1]) && close(height, CONE[2])
        }
        _ => false,
    };
    let mould = |body: &Body| match *body {
        Body::Shape(Shape::ConeShell { base_radius, top_radius, height, .. }) => {
            close(2.0 * base_radius, CONE[0]) && close(2.0 * top_radius, CONE[1]) && close(height, CONE[2])
        }
        _ => false,
    };
    case.gauges.spread.is_some()
        && matches!(case.fluid.as_slice(), [region] if standard(&region.shape))
        && case.solids.iter().all(|solid| mould(&solid.body))
}

/// Height in m of the cone of a case at the start.
pub(super) fn height(case: &Case) -> Option<f64> {
    case.fluid.iter().find_map(|region| match region.shape {
        Shape::Cone { height, .. } => Some(height),
        _ => None,
    })
}

/// To the nearest 10 mm, halves up.
pub(super) fn to_ten(millimetres: f64) -> u32 {
    10 * (millimetres / 10.0).round() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text_of(mix: &Mix) -> Result<String, String> {
        case_text(mix, "Slump flow", "Slump flow (EN 12350-8)")
    }

    fn arguments(extra: &[&str]) -> Mix {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            mix: Mix,
        }
        clap::Parser::try_parse_from([&["x"], extra].concat()).map(|line: Line| line.mix).unwrap()
    }

    #[test]
    fn the_case_is_what_was_asked_for() {
        for cell in ["5mm", "3mm", "7mm", "20mm", "2.5mm", "0.3cm"] {
            for full in [&[][..], &["--full"], &["--lift", "0.15m/s"]] {
                let arguments = arguments(&[&["--cell-size", cell, "--yield-stress", "20Pa"], full].concat());
                let text = text_of(&arguments).unwrap();
                let case = Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}"));
                assert!((case.domain.max.x - 0.5 * ROOM * 0.7206).abs() < 0.02, "{}", case.domain.max.x);
                assert_eq!(case.domain.min.x < 0.0, full == ["--full"]);
                assert_eq!(lift(&case), (full.len() == 2).then_some(0.15));
                assert!(is_one(&case));
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
            (["--lift", "1mm/s"], "from 1 cm/s to 5 m/s"),
        ] {
            let refusal = text_of(&arguments(&line)).unwrap_err();
            assert!(refusal.contains(advice), "{refusal}");
        }
        assert!(text_of(&arguments(&["--yield-stress", "0.0162Pa"])).is_ok());
        assert!(text_of(&arguments(&["--yield-stress", "1MPa"])).is_ok());
    }
}
