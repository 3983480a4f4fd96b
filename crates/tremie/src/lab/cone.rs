//! A cone filled with fresh concrete and taken away: that of EN 12350-2 and -8, and the small ones for paste and mortar.
//!
//! The mould vanishes at once, or is lifted at a speed by its height: 2 s for the 300 mm of the standards' tests are 0.15 m/s. A real mould is a
//! thin sheet; here its wall is two cells thick, outwards, and the concrete slides along it.

use std::f64::consts::PI;

use clap::Args;
use tremie_case::Case;
use tremie_geometry::{Body, Motion, Shape};

use super::setup::{Mix, Setup, at_rest, frustum, lifted, mm, point, whole};
use super::thin_sheet::ThinSheet;
use crate::numbers::significant;
use crate::quantities::{length, speed};

/// The cone of EN 12350-2 in m: base and top diameter, height.
pub(crate) const CONE: [f64; 3] = [0.2, 0.1, 0.3];
/// Its volume in m3.
pub(crate) const VOLUME: f64 = volume(CONE);
/// Gravity in m/s2.
pub(crate) const GRAVITY: f64 = 9.81;

/// The plate reaches from the middle at least so far, in heights of the cone: room for the circle of 500 mm.
const LEAST_ROOM: f64 = 1.0;
/// The plate is larger than the expected spread by this factor.
const ROOM: f64 = 1.25;
/// Spread in heights of the cone beyond which the sheet would be thinner than any aggregate.
const LARGEST_SPREAD: f64 = 10.0;
/// Speeds in m/s at which a mould can be lifted.
const LIFTS: [f64; 2] = [0.01, 5.0];
/// Cells through the wall of the mould: more than a step between diagonal neighbours.
pub(super) const WALL: f64 = 2.0;
/// Most and fewest cells over the height of a cone that make sense.
const CELLS: [f64; 2] = [1200.0, 12.0];

/// The volume in m3 of a cone of these diameters and height in m.
pub(super) const fn volume([base, top, height]: [f64; 3]) -> f64 {
    PI / 12.0 * height * (base * base + base * top + top * top)
}

/// What can be said about the concrete and its cone.
#[derive(Debug, Args)]
pub(super) struct ConeTest {
    #[command(flatten)]
    pub(super) mix: Mix,
    /// Lift the cone at this speed instead of taking it away at once (300 mm in 2 s are 0.15 m/s)
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    lift: Option<f64>,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = length)]
    pub(super) cell_size: f64,
    /// Compute all of the concrete instead of a quarter between planes of symmetry
    #[arg(long)]
    pub(super) full: bool,
}

/// Diameter in m at which concrete of a volume in m3 comes to rest if it spreads slowly to a thin sheet.
pub(super) fn spread_of_a_sheet(volume: f64, yield_stress: f64, density: f64) -> f64 {
    2.0 * ThinSheet::new(volume, yield_stress, density, GRAVITY).radius
}

/// A cone that spreads on a plate.
pub(super) struct Spreading<'a> {
    /// Stands above the pictures.
    pub(super) title: &'a str,
    /// What the test is.
    pub(super) test: &'a str,
    /// The cone: diameters below and above, height in m.
    pub(super) cone: [f64; 3],
    /// What else stands on the plate, as text.
    pub(super) parts: String,
    /// What else is measured, as text.
    pub(super) gauges: String,
}

impl Spreading<'_> {
    /// The case file of an experiment, or why there is none.
    pub(super) fn case_text(&self, arguments: &ConeTest) -> Result<String, String> {
        let &ConeTest { ref mix, lift, cell_size, full } = arguments;
        let [base, top, height] = self.cone;
        let spread = spread_of_a_sheet(volume(self.cone), mix.yield_stress, mix.density);
        if spread > LARGEST_SPREAD * height {
            let least = mix.yield_stress * (spread / (LARGEST_SPREAD * height)).powi(5);
            return Err(format!(
                "with a yield stress of {} Pa the concrete would spread to about {spread:.1} m, as thin as a coat of paint; give a --yield-stress of {} Pa at least",
                significant(mix.yield_stress),
                significant(1.005 * least),
            ));
        }
        let [most, fewest] = CELLS.map(|cells| height / cells);
        if !(most..=fewest).contains(&cell_size) {
            let mm = |length: f64| significant(1e3 * length);
            return Err(format!(
                "cells of {} mm do not suit a cone of {} mm x {} mm; give a --cell-size from {} mm to {} mm",
                mm(cell_size),
                mm(base),
                mm(height),
                mm(most),
                mm(fewest)
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
        let room = whole((0.5 * ROOM * spread).max(LEAST_ROOM * height), cell_size);
        let above = whole(if lift.is_some() { 2.0 * height } else { height }, cell_size) + cell_size;
        let low = if full { -room } else { 0.0 };
        let how = if lift.is_some() { "whose mould is lifted" } else { "that is let go at once" };
        let part = if full { "The whole plate." } else { "A quarter of the plate." };
        let mould = lift.map_or_else(String::new, |speed| mould(self.cone, speed, cell_size));
        let setup = Setup {
            test: format!("{}: a cone of fresh concrete {how}.", self.test),
            title: self.title,
            mix,
            domain: format!("{part} The expected spread is {:.0} mm.", 1e3 * spread),
            min: [low, low, 0.0],
            max: [room, room, above],
            symmetry: if full { Vec::new() } else { vec!["x_min", "y_min"] },
            parts: format!("[[fluid]]\n{}\n{mould}{}", frustum([0.0; 3], [base, top], height), self.parts),
            cell_size,
            gauges: format!("spread = {{ centre = [\"0 mm\", \"0 mm\"] }}\n{}", self.gauges),
            stop_time: mix.stop_time() + lift.map_or(0.0, |speed| (height / speed).ceil()),
            stop: format!(
                "# At rest the spread grows by less than 0.05 mm/s (over the last fifth of the time), has less than 0.5 % still to grow, and\n# 99 % of the concrete is slower than 1 mm/s (for 1 s).\n{}",
                at_rest("{}")
            ),
            intervals: [1.0, 2.0],
        };
        Ok(setup.text())
    }
}

/// The mould of a cone that is lifted by its height at a speed in m/s.
fn mould(cone: [f64; 3], speed: f64, cell_size: f64) -> String {
    format!(
        r#"
# The mould is lifted by its height. Its inside is that of the standard; its wall is thick enough for the cells.
[[solid]]
name = "mould"
{}
surface = "free_slip"
{}"#,
        shell([0.0; 3], cone, cell_size),
        lifted(cone[2], speed),
    )
}

/// The mould of a cone, on the centre of its lower end.
pub(super) fn shell(at: [f64; 3], [base, top, height]: [f64; 3], cell_size: f64) -> String {
    format!(
        "cone_shell = {{ base = {}, base_diameter = {}, top_diameter = {}, height = {}, thickness = {} }}",
        point(at),
        mm(base),
        mm(top),
        mm(height),
        mm(WALL * cell_size)
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

/// Diameters below and above and height in m of the cone of a case at the start.
pub(super) fn dimensions(case: &Case) -> Option<[f64; 3]> {
    case.fluid.iter().find_map(|region| match region.shape {
        Shape::Cone { base_radius, top_radius, height, .. } => {
            Some([2.0 * base_radius, 2.0 * top_radius, height])
        }
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

    fn text_of(arguments: &ConeTest) -> Result<String, String> {
        let spreading = Spreading {
            title: "Slump flow",
            test: "Slump flow (EN 12350-8)",
            cone: CONE,
            parts: String::new(),
            gauges: String::new(),
        };
        spreading.case_text(arguments)
    }

    fn arguments(extra: &[&str]) -> ConeTest {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            test: ConeTest,
        }
        clap::Parser::try_parse_from([&["x"], extra].concat()).map(|line: Line| line.test).unwrap()
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
            assert!((spread_of_a_sheet(VOLUME, yield_stress, 2300.0) - spread).abs() < 1e-4);
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
