//! A round sample of a Bingham fluid squeezed between two plates without slip: the theory of lubrication.
//!
//! At the radius r the plates that close at V drive out the mean velocity `V r / (2 h)`, for which the flow between
//! parallel walls needs the pressure gradient G(r). The force is `F = pi int_0^R r^2 G dr`: `3 pi mu V R^4 / (2 h^3)`
//! for a Newtonian fluid (Stefan 1874) and `2 pi tau0 R^3 / (3 h)` as V tends to nothing (Covey and Stanmore 1981).

use std::f64::consts::PI;

use clap::Args;

use super::answer::{Answer, LITRE, M_PER_S, MM, NEWTON, ONE, PA, PA_S, quantity, warnings};
use super::duct::{Bingham, channel_velocity, gradient};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{force, length, speed, stress, viscosity, volume};

/// Height over radius above which the theory of lubrication does not hold.
const FLAT: f64 = 0.2;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc squeeze --yield-stress 100Pa --volume 0.1l --force 20N
  tremie calc squeeze --yield-stress 100Pa --volume 0.1l --height 5mm --speed 1mm/s --viscosity 20Pa.s")]
pub(super) struct Arguments {
    /// Yield stress
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    yield_stress: f64,
    /// Volume of the sample
    #[arg(long, value_name = "VOLUME", value_parser = volume)]
    volume: f64,
    /// Constant force under which it comes to rest
    #[arg(long, value_name = "FORCE", value_parser = force, conflicts_with_all = ["height", "speed", "viscosity"])]
    force: Option<f64>,
    /// Height at which the force is wanted
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    height: Option<f64>,
    /// Speed at which the plates close [default: hardly any]
    #[arg(long, value_name = "SPEED", value_parser = speed, requires = "viscosity")]
    speed: Option<f64>,
    /// Plastic viscosity
    #[arg(long, value_name = "VISCOSITY", value_parser = viscosity, requires = "speed")]
    viscosity: Option<f64>,
}

/// Force in N on plates `height` m apart that close at `speed` m/s on a sample of `radius` m.
pub(crate) fn squeeze_force(fluid: Bingham, radius: f64, height: f64, speed: f64) -> f64 {
    const RINGS: i32 = 400;
    let step = radius / f64::from(RINGS);
    let ring = |n: i32| {
        let r = (f64::from(n) + 0.5) * step;
        let outflow = 0.5 * speed * r / height;
        PI * r * r * step * gradient(outflow, |g| channel_velocity(fluid, height, g))
    };
    (0..RINGS).map(ring).sum()
}

/// Force in N/m of depth on plates that close at `speed` m/s on a sample `2 length` m wide in a plane: 2 int_0^L x G dx, of a Newtonian fluid 8 mu V L^3/h^3.
pub(crate) fn squeezed_in_a_plane(fluid: Bingham, length: f64, height: f64, speed: f64) -> f64 {
    const STRIPS: i32 = 400;
    let step = length / f64::from(STRIPS);
    let strip = |n: i32| {
        let x = (f64::from(n) + 0.5) * step;
        2.0 * x * step * gradient(speed * x / height, |g| channel_velocity(fluid, height, g))
    };
    (0..STRIPS).map(strip).sum()
}

/// The same for plates that hardly move.
fn plastic_force(yield_stress: f64, radius: f64, height: f64) -> f64 {
    2.0 * PI * yield_stress * radius.powi(3) / (3.0 * height)
}

/// Height in m at which `volume` m3 come to rest under a force in N.
pub(crate) fn final_height(yield_stress: f64, volume: f64, force: f64) -> f64 {
    (2.0 * yield_stress * volume.powf(1.5) / (3.0 * PI.sqrt() * force)).powf(0.4)
}

/// Radius in m of a round sample.
fn radius_of(volume: f64, height: f64) -> f64 {
    (volume / (PI * height)).sqrt()
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let &Arguments { yield_stress, volume, force, height, speed, viscosity } = arguments;
    let mut inputs = vec![
        quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
        quantity("volume", "volume_m3", volume, LITRE),
    ];
    let mut results = Vec::new();
    let height = match (force, height) {
        (Some(force), _) => {
            let height = final_height(yield_stress, volume, force);
            inputs.push(quantity("force", "force_N", force, NEWTON));
            results.push(quantity("height at rest", "height_m", height, MM));
            height
        }
        (None, Some(height)) => {
            inputs.push(quantity("height", "height_m", height, MM));
            let radius = radius_of(volume, height);
            let force = match (speed, viscosity) {
                (Some(speed), Some(viscosity)) => {
                    inputs.push(quantity("speed", "speed_m_s", speed, M_PER_S));
                    inputs.push(quantity("plastic viscosity", "viscosity_Pa_s", viscosity, PA_S));
                    squeeze_force(Bingham { yield_stress, viscosity }, radius, height, speed)
                }
                _ => plastic_force(yield_stress, radius, height),
            };
            results.push(quantity("force", "force_N", force, NEWTON));
            height
        }
        (None, None) => {
            return Err(WrongInput(
                "give the --force, for the height at rest, or the --height, for the force".to_owned(),
            ));
        }
    };
    let radius = radius_of(volume, height);
    results.push(quantity("radius", "radius_m", radius, MM));
    results.push(quantity("height over radius", "height_over_radius", height / radius, ONE));
    Ok(Answer {
        title: "A sample squeezed between two plates",
        inputs,
        results,
        equation: &[
            "F = pi int_0^R r^2 G(r) dr, where G drives V r / (2 h) between the plates (`tremie calc channel`);",
            "F = 2 pi tau0 R^3 / (3 h) as V tends to 0, and 3 pi mu V R^4 / (2 h^3) without yield stress",
            "F force, V speed, h height, R radius of the sample, whose volume pi R^2 h is kept",
        ],
        source: "G. H. Covey, B. R. Stanmore, Journal of Non-Newtonian Fluid Mechanics 8 (1981), 249-260; J. Stefan 1874",
        validity: &["rough plates wider than the sample, height below 0.2 of its radius, no inertia"],
        warnings: warnings([(
            height > FLAT * radius,
            format!(
                "the height is {} of the radius, above {FLAT}: the sample is not flat, and resists more than this",
                significant(height / radius)
            ),
        )]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_those_that_others_have_worked_out() {
        // Height and Bingham number tau0 h / (mu V); force, all over radius, viscosity and speed.
        for (height, bingham, force) in
            [(0.05, 1.0, 38955.5), (0.1, 0.1, 4743.8), (0.1, 10.0, 7769.18), (0.2, 100.0, 6948.51)]
        {
            let fluid = Bingham { yield_stress: bingham / height, viscosity: 1.0 };
            let found = squeeze_force(fluid, 1.0, height, 1.0);
            assert!((found / force - 1.0).abs() < 1e-4, "{height} {bingham}: {found}");
        }
    }

    #[test]
    fn heights_at_rest_are_those_that_others_have_worked_out() {
        // Radius and force over the height of the cylinder at first, 1, in units of the yield stress; height at rest.
        for (radius, force, height) in [(0.5, 10.0, 0.23291), (0.5, 2.5, 0.405519), (1.0, 10.0, 0.535086)] {
            let volume = PI * radius * radius;
            let found = final_height(1.0, volume, force);
            assert!((found - height).abs() < 1e-5, "{found}");
            assert!((plastic_force(1.0, radius_of(volume, height), height) / force - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn fast_plates_feel_viscosity_alone_and_slow_ones_the_yield_stress() {
        let stefan = 3.0 * PI * 20.0 * 1.0 * 0.08f64.powi(4) / (2.0 * 0.005f64.powi(3));
        let thin = Bingham { yield_stress: 1e-9, viscosity: 20.0 };
        assert!((squeeze_force(thin, 0.08, 0.005, 1.0) / stefan - 1.0).abs() < 1e-4);
        let stiff = Bingham { yield_stress: 100.0, viscosity: 20.0 };
        let slow = squeeze_force(stiff, 0.08, 0.005, 1e-12) / plastic_force(100.0, 0.08, 0.005);
        assert!((slow - 1.0).abs() < 1e-4, "{slow}");
    }
}
