//! What the tests have in common: what is said about the concrete, and how a case is written.

use std::f64::consts::SQRT_2;

use clap::{Args, ValueEnum};
use tremie_case::{Case, Side, Surface};

use crate::numbers::significant;
use crate::quantities::{density, length, stress, viscosity};

/// What can be said about the concrete and how it is computed.
#[derive(Debug, Args)]
pub(super) struct Mix {
    /// Yield stress
    #[arg(long, value_name = "STRESS", default_value = "50Pa", value_parser = stress)]
    pub(super) yield_stress: f64,
    /// Plastic viscosity
    #[arg(long, value_name = "VISCOSITY", default_value = "30Pa.s", value_parser = viscosity)]
    pub(super) viscosity: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    pub(super) density: f64,
    /// Slip length of floor, walls and gates: how far behind them the concrete would come to rest; if not given, it sticks
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    slip_length: Option<f64>,
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

impl Mix {
    /// Time in s by which the concrete has long come to rest: it creeps for a multiple of its viscosity over its yield stress.
    pub(super) fn stop_time(&self) -> f64 {
        (200.0 * self.viscosity / self.yield_stress).clamp(60.0, 3600.0).ceil()
    }

    /// The line that says along what kind of surface the concrete flows; none if it sticks.
    pub(super) fn surface(&self) -> String {
        self.slip_length.map_or_else(String::new, |length| {
            format!("surface = {{ navier = {{ slip_length = {} }} }}\n", mm(length))
        })
    }
}

/// The sides of the domain.
const SIDES: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

/// How the concrete goes along what it touches, for people.
pub(super) fn surfaces(case: &Case) -> String {
    let bars = case.solids.iter().any(|solid| solid.name == "bars");
    match case.domain.sides[4] {
        Side::Wall { surface: Surface::Navier { slip_length }, .. } => {
            format!(
                "the concrete slides along floor and walls, slip length {} mm{}",
                significant(1e3 * slip_length),
                if bars { "; it sticks to bars" } else { "" }
            )
        }
        _ => format!("the concrete sticks to floor{}", if bars { ", walls and bars" } else { " and walls" }),
    }
}

/// A case in the making; lengths in m, times in s.
pub(super) struct Setup<'a> {
    /// What the experiment is, in a line.
    pub(super) test: String,
    /// Stands above the pictures.
    pub(super) title: &'a str,
    pub(super) mix: &'a Mix,
    /// What is to be said about the domain, in a line.
    pub(super) domain: String,
    /// Its corners.
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    /// Its sides that are planes of symmetry.
    pub(super) symmetry: Vec<&'a str>,
    /// Fluid, solids and bars, as text.
    pub(super) parts: String,
    pub(super) cell_size: f64,
    /// Gauges besides their interval, as text.
    pub(super) gauges: String,
    pub(super) stop_time: f64,
    /// When it ends earlier, as text.
    pub(super) stop: String,
    /// Simulated time between two pictures, and between two sets of fields.
    pub(super) intervals: [f64; 2],
}

impl Setup<'_> {
    /// The case file.
    pub(super) fn text(&self) -> String {
        let Self { test, title, domain, parts, gauges, stop, .. } = self;
        let Mix { yield_stress, viscosity, density, precision, .. } = self.mix;
        let surface = self.mix.surface();
        let side = |side: &&str| match (self.symmetry.contains(side), surface.trim_end()) {
            (true, _) => format!("{side} = \"symmetry\"\n"),
            (false, "") => String::new(),
            (false, surface) => format!("{side} = {{ {surface} }}\n"),
        };
        let sides: String = SIDES.iter().map(side).collect();
        let sides = if sides.is_empty() { sides } else { format!("[domain.sides]\n{sides}") };
        let precision = match precision {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        };
        format!(
            r#"# {test}
# Edit it and run it with: tremie run FILE

title = "{title}"
method = "lbm"

[material]
density = "{density} kg/m3"
bingham = {{ yield_stress = "{yield_stress} Pa", plastic_viscosity = "{viscosity} Pa s" }}

# {domain}
[domain]
min = {min}
max = {max}
{sides}
{parts}
[lbm]
cell_size = {cell}
stepping = "adaptive"
precision = "{precision}"

[gauges]
interval = "20 ms"
{gauges}
{stop}
[output]
picture_interval = "{picture} s"
snapshot_interval = "{snapshot} s"
"#,
            density = tidy(*density),
            yield_stress = tidy(*yield_stress),
            viscosity = tidy(*viscosity),
            min = point(self.min),
            max = point(self.max),
            cell = mm(self.cell_size),
            picture = tidy(self.intervals[0]),
            snapshot = tidy(self.intervals[1]),
            stop = stop.replace("TIME", &format!("\"{} s\"", tidy(self.stop_time))),
        )
    }
}

/// A length in m as one writes it.
pub(super) fn mm(length: f64) -> String {
    format!("\"{} mm\"", tidy(1e3 * length))
}

/// A point in m as one writes it; in a plan, of two coordinates.
pub(super) fn point<const N: usize>(p: [f64; N]) -> String {
    format!("[{}]", p.map(mm).join(", "))
}

/// A box between two corners.
pub(super) fn cuboid(min: [f64; 3], max: [f64; 3]) -> String {
    format!("box = {{ min = {}, max = {} }}", point(min), point(max))
}

/// An upright frustum on the centre of its lower end, with diameters below and above.
pub(super) fn frustum(base: [f64; 3], diameters: [f64; 2], height: f64) -> String {
    let [below, above] = diameters.map(mm);
    format!(
        "cone = {{ base = {}, base_diameter = {below}, top_diameter = {above}, height = {} }}",
        point(base),
        mm(height)
    )
}

/// A bar along z with its lower end at `base`.
pub(super) fn bar([x, y, z]: [f64; 3], height: f64, diameter: f64) -> String {
    format!(
        "{{ start = {}, end = {}, diameter = {} }}",
        point([x, y, z]),
        point([x, y, z + height]),
        mm(diameter)
    )
}

/// Straight upwards by a way in m at a speed in m/s, from the start on.
pub(super) fn lifted(way: f64, speed: f64) -> String {
    format!(
        r#"[solid.motion.path]
points = [
    {{ time = "0 s", offset = ["0 mm", "0 mm", "0 mm"] }},
    {{ time = "{} s", offset = {} }},
]
"#,
        tidy(way / speed),
        point([0.0, 0.0, way])
    )
}

/// A level gauge over a rectangle.
pub(super) fn level(name: &str, min: [f64; 2], max: [f64; 2]) -> String {
    format!("    {{ name = \"{name}\", min = {}, max = {} }},\n", point(min), point(max))
}

/// The least length in whole cells that is not less than this, in m.
pub(super) fn whole(length: f64, cell_size: f64) -> f64 {
    (length / cell_size - 1e-9).ceil() * cell_size
}

/// Refuses cells of which there is no whole number in each of these lengths in m.
pub(super) fn fitting(cell_size: f64, lengths: &[(&str, f64)]) -> Result<(), String> {
    let fits = |length: f64, size: f64| {
        let cells = length / size;
        (cells - cells.round()).abs() < 1e-6 && cells > 2.5
    };
    let Some((what, length)) = lengths.iter().find(|(_, length)| !fits(*length, cell_size)) else {
        return Ok(());
    };
    // As many cells as near as can be, of a size in whole micrometres, that fits everywhere.
    let shortest = lengths.iter().map(|(_, length)| *length).fold(f64::INFINITY, f64::min);
    let number = (shortest / cell_size).round().max(3.0);
    let near = (0..1000).map(f64::from).flat_map(|more| [number + more, number - more]);
    let micrometres = near.filter(|number| *number >= 3.0).map(|number| 1e6 * shortest / number);
    let sizes = micrometres.filter(|size| (size - size.round()).abs() < 1e-6).map(|size| 1e-6 * size.round());
    let mut sizes = sizes.filter(|size| lengths.iter().all(|(_, length)| fits(*length, *size)));
    let advice = sizes.next().map_or("no size near it fits; change the length".to_owned(), |size| {
        format!("give a --cell-size of {} mm, say", tidy(1e3 * size))
    });
    Err(format!(
        "{what} of {} mm is {:.4} cells of {} mm, not a whole number of three or more; {advice}",
        significant(1e3 * length),
        length / cell_size,
        tidy(1e3 * cell_size)
    ))
}

/// Refuses cells too large to see bars of a diameter in m.
pub(super) fn seen(diameter: f64, cell_size: f64) -> Result<(), String> {
    if diameter >= SQRT_2 * cell_size {
        return Ok(());
    }
    Err(format!(
        "bars of {} mm are too thin for cells of {} mm; give a --cell-size of {} mm at most, better half as much",
        significant(1e3 * diameter),
        significant(1e3 * cell_size),
        significant(0.99e3 * diameter / SQRT_2)
    ))
}

/// Refuses a speed in m/s at which nothing is lifted.
pub(super) fn liftable(what: &str, speed: f64) -> Result<(), String> {
    if (0.01..=5.0).contains(&speed) {
        return Ok(());
    }
    Err(format!("{what} is not lifted at {} m/s; give a speed from 1 cm/s to 5 m/s", significant(speed)))
}

/// Without the noise in the last digits that computing leaves, and without negative zeros.
pub(super) fn tidy(number: f64) -> f64 {
    format!("{number:.11e}").parse().unwrap_or(number) + 0.0
}

/// Ends the run when the fluid rests.
pub(super) fn at_rest(rest: &str) -> String {
    format!("[stop]\ntime = TIME\nrest = {rest}\n")
}

/// Ends the run when that comes for which a gauge waits.
pub(super) fn at_event(name: &str) -> String {
    format!("[stop]\ntime = TIME\nevent = \"{name}\"\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_of_cells_that_is_advised_fits() {
        let lengths = [("the depth", 0.1), ("the channel", 0.6)];
        assert_eq!(fitting(5e-3, &lengths), Ok(()));
        for (size, advised) in [(8e-3, 6.25), (7.69e-3, 6.25), (0.3, 25.0), (1e9, 25.0)] {
            let message = fitting(size, &lengths).unwrap_err();
            assert!(message.ends_with(&format!("give a --cell-size of {advised} mm, say")), "{message}");
            assert_eq!(fitting(1e-3 * advised, &lengths), Ok(()));
        }
        let message = fitting(7.69e-3, &lengths).unwrap_err();
        assert!(message.starts_with("the depth of 100 mm is 13.0039 cells of 7.69 mm"), "{message}");
        // Nor is there long to wait for nonsense.
        assert!(fitting(3.1e7, &[("the depth", 1e8)]).unwrap_err().contains("give a --cell-size of"));
        assert!(fitting(1e-3, &[("the depth", 0.1000007)]).unwrap_err().ends_with("change the length"));
    }
}
