//! Squeeze flow: a round sample between two plates without slip, of which the upper one comes down under a constant load or at a constant speed.
//!
//! The sample stands on the lower plate and fills the gap from the start; the upper plate is wider than it ever gets and has no mass of its own. A quarter is computed. Reported are
//! the height that is left, or the force that it took, beside the theory of lubrication (`tremie calc squeeze`).

use std::f64::consts::PI;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;
use tremie_case::Case;
use tremie_geometry::{Motion, Shape};
use tremie_simulation::Summary;

use super::Figures;
use super::setup::{Mix, Setup, at_rest, cuboid, fitting, frustum, tidy, whole};
use crate::calc::{Bingham, squeezed_to_rest, squeezing_force};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{force, length, speed};
use crate::run::{Job, Manner, Place};

/// What the experiment is called.
pub(crate) const NAME: &str = "squeeze-flow";

/// What the plate is called.
const PLATE: &str = "plate";
/// Domain over what the sample is to spread to.
const ROOM: f64 = 1.3;
/// Cells over the last gap, at least.
const FEWEST: f64 = 3.0;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie lab squeeze-flow
  tremie lab squeeze-flow --yield-stress 200Pa --load 50N
  tremie lab squeeze-flow --speed 5mm/s --gap 10mm

The folder's case.toml can be edited and run again with `tremie run`.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    mix: Mix,
    /// Diameter of the sample
    #[arg(long, value_name = "LENGTH", default_value = "100mm", value_parser = length)]
    diameter: f64,
    /// Height of the sample
    #[arg(long, value_name = "LENGTH", default_value = "25mm", value_parser = length)]
    height: f64,
    /// Load on the upper plate
    #[arg(long, value_name = "FORCE", default_value = "10N", value_parser = force, conflicts_with = "speed")]
    load: f64,
    /// Speed at which the upper plate comes down, instead of a load
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    speed: Option<f64>,
    /// Gap at which it ends [default: half of the height]
    #[arg(long, value_name = "LENGTH", value_parser = length, requires = "speed")]
    gap: Option<f64>,
    /// Edge of the cells
    #[arg(long, value_name = "LENGTH", default_value = "2.5mm", value_parser = length)]
    cell_size: f64,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    manner: Manner,
}

/// Does the experiment.
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let text = case_text(&arguments).map_err(WrongInput)?;
    let case = Case::parse(NAME, &text)?;
    Job::new(case, arguments.place, NAME, Some(NAME))?.run(arguments.manner)
}

/// The case file of an experiment, or why there is none.
fn case_text(arguments: &Arguments) -> Result<String, String> {
    let &Arguments { ref mix, diameter, height, load, speed, cell_size, .. } = arguments;
    fitting(cell_size, &[("the height", height)])?;
    let volume = 0.25 * PI * diameter * diameter * height;
    let gap = match speed {
        Some(_) => arguments.gap.unwrap_or(0.5 * height),
        None => squeezed_to_rest(mix.yield_stress, volume, load).min(height),
    };
    if speed.is_some() && gap >= height {
        return Err(format!(
            "the plate stands {} mm high at the start; give a smaller --gap",
            significant(1e3 * height)
        ));
    }
    if gap < FEWEST * cell_size {
        let least = significant(1e3 * gap / FEWEST);
        return Err(format!(
            "the sample is squeezed to {} mm, less than three cells; give a --cell-size of {least} mm at most, or less of a {}",
            significant(1e3 * gap),
            if speed.is_some() { "way: a larger --gap" } else { "--load" }
        ));
    }
    let radius = whole(ROOM * (volume / (PI * gap)).sqrt() + 4.0 * cell_size, cell_size);
    let motion = match speed {
        Some(speed) => {
            format!("[solid.motion.uniform]\nvelocity = [\"0 m/s\", \"0 m/s\", \"{} m/s\"]\n", tidy(-speed))
        }
        None => format!(
            "[solid.motion.load]\nforce = [\"0 N\", \"0 N\", \"{} N\"]\nmass = \"0 kg\"\n",
            tidy(-load)
        ),
    };
    let parts = format!(
        "# The sample, of which a quarter is computed.\n[[fluid]]\n{sample}\n\n# The upper plate.\n[[solid]]\nname = \"{PLATE}\"\n{surface}{plate}\n{motion}",
        sample = frustum([0.0; 3], [diameter; 2], height),
        surface = mix.surface(),
        plate = cuboid([-1.0, -1.0, height], [1.0, 1.0, 1.0 + height]),
    );
    let setup = Setup {
        test: "Squeeze flow: a round sample between two plates.".to_owned(),
        title: "Squeeze flow",
        mix,
        domain: "A quarter of the sample and room for it to spread.".to_owned(),
        min: [0.0; 3],
        max: [radius, radius, height + 2.0 * cell_size],
        symmetry: vec!["x_min", "y_min"],
        parts,
        cell_size,
        gauges: "spread = { centre = [\"0 mm\", \"0 mm\"] }\n".to_owned(),
        stop_time: speed.map_or(mix.stop_time(), |speed| (height - gap) / speed),
        stop: match speed {
            Some(_) => "[stop]\ntime = TIME\n".to_owned(),
            None => at_rest("{ speed = \"0.2 mm/s\" }"),
        },
        intervals: speed.map_or([0.5, 5.0], |speed| [0.1, 0.5].map(|share| share * (height - gap) / speed)),
    };
    Ok(setup.text())
}

/// The figures of the experiment, if the case has a plate on a round sample.
pub(crate) fn figures(case: &Case, summary: &Summary) -> Option<Figures> {
    let readings = &summary.readings;
    let plate = case.solids.iter().find(|solid| solid.name == PLATE)?;
    let (_, bearing) = readings.solids.iter().find(|(name, _)| name == PLATE)?;
    let Shape::Cone { height: first, .. } = case.fluid.first()?.shape else { return None };
    let come = match (&readings.travel, &plate.motion) {
        (Some((_, travel)), _) => *travel,
        (None, Motion::Uniform(velocity)) => velocity.length() * readings.time,
        _ => return None,
    };
    let (height, spread) = (first - come, readings.spread?);
    let curve = &case.material.curve;
    let fluid = Bingham { yield_stress: curve.yield_stress(), viscosity: curve.plastic_viscosity() };
    let millimetres = |length: f64| format!("{} mm", significant(1e3 * length));
    let newtons = |force: f64| format!("{} N", significant(force));
    let radius = (readings.volume / (PI * height)).sqrt();
    let mut rows = vec![
        ("height", format!("{}, of {} at the start", millimetres(height), millimetres(first))),
        ("force on the plate", newtons(bearing.force.z)),
        ("spread", format!("{:.0} mm", 1e3 * spread.mean)),
    ];
    let mut json = vec![
        ("height_mm", json!(1e3 * height)),
        ("force_N", json!(bearing.force.z)),
        ("spread_mm", json!(1e3 * spread.mean)),
    ];
    let headline = match plate.load {
        Some(load) => {
            let rest = squeezed_to_rest(fluid.yield_stress, readings.volume, load.force.length());
            rows.push((
                "by the formula",
                format!("{} at rest, under {}", millimetres(rest), newtons(load.force.length())),
            ));
            json.push(("formula_height_mm", json!(1e3 * rest)));
            vec![("height", millimetres(height)), ("load", newtons(load.force.length()))]
        }
        None => {
            let speed = plate.motion.largest_speed(0.0);
            let force = squeezing_force(fluid, radius, height, speed);
            rows.push((
                "by the formula",
                format!("{}, at {} mm/s", newtons(force), significant(1e3 * speed)),
            ));
            json.push(("formula_force_N", json!(force)));
            vec![("force", newtons(bearing.force.z)), ("height", millimetres(height))]
        }
    };
    rows.push((
        "",
        format!(
            "(lubrication: Covey and Stanmore 1981; for flat samples: here height over radius {:.2},",
            height / radius
        ),
    ));
    rows.push(("", "without weight and inertia)".to_owned()));
    let cell_size = case.method.resolution();
    rows.push((
        "resolution",
        format!("cells of {}, {:.1} over the height", millimetres(cell_size), height / cell_size),
    ));
    Some(Figures {
        headline,
        rows,
        json: json.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use tremie_geometry::Body;

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
    fn a_plate_rests_on_the_sample_and_comes_down() {
        let case = Case::parse("x", &text(&[]).unwrap()).unwrap_or_else(|error| panic!("{error}"));
        let plate = &case.solids[0];
        let Body::Shape(Shape::Box { min, .. }) = plate.body else { panic!("a plate") };
        assert!((min.z - 0.025).abs() < 1e-12);
        // A quarter of the load on a quarter of the plate.
        let loaded = case.loaded().unwrap();
        assert!((loaded.force - 2.5).abs() < 1e-12 && loaded.direction.z == -1.0);
        let even = text(&["--speed", "5mm/s", "--gap", "10mm"]).unwrap();
        let case = Case::parse("x", &even).unwrap_or_else(|error| panic!("{error}"));
        assert!((case.solids[0].motion.offset(case.stop.time).z + 0.015).abs() < 1e-9);
    }

    #[test]
    fn nonsense_is_refused_with_advice() {
        assert!(text(&["--load", "1kN"]).unwrap_err().contains("less than three cells"));
        assert!(text(&["--speed", "1mm/s", "--gap", "30mm"]).unwrap_err().contains("smaller --gap"));
    }
}
