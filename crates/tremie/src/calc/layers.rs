//! How long a layer of concrete may rest before the next no longer mixes with it.

use clap::Args;

use super::answer::{Answer, KG_PER_M3, M_PER_S, MINUTE, MM, PA, PA_PER_S, PA_S, quantity};
use crate::lab::GRAVITY;
use crate::quantities::{density, length, speed, stress_rate, viscosity};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc layers --stiffening 0.5Pa/s --thickness 100mm
  tremie calc layers --stiffening 0.5Pa/s --thickness 100mm --viscosity 50Pa.s --speed 0.2m/s")]
pub(super) struct Arguments {
    /// Growth of the yield stress at rest of the lower layer, A_thix
    #[arg(long, value_name = "STRESS/TIME", value_parser = stress_rate)]
    stiffening: f64,
    /// Thickness of the upper layer
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    thickness: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
    /// Plastic viscosity of the upper layer
    #[arg(long, value_name = "VISCOSITY", value_parser = viscosity, requires = "speed")]
    viscosity: Option<f64>,
    /// Speed at which the upper layer flows
    #[arg(long, value_name = "SPEED", value_parser = speed, requires = "viscosity")]
    speed: Option<f64>,
}

/// Stress in Pa that an upper layer of `thickness` m exerts on the lower one: by its weight and by its flow at `speed`
/// m/s.
fn stress(density: f64, thickness: f64, viscosity: f64, speed: f64) -> f64 {
    let weight = density * GRAVITY * thickness / 12f64.sqrt();
    weight.hypot(2.0 * viscosity * speed / thickness)
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Answer {
    let &Arguments { stiffening, thickness, density, viscosity, speed } = arguments;
    let stress = stress(density, thickness, viscosity.unwrap_or(0.0), speed.unwrap_or(0.0));
    let mut inputs = vec![
        quantity("stiffening A_thix", "stiffening_Pa_s", stiffening, PA_PER_S),
        quantity("thickness", "thickness_m", thickness, MM),
        quantity("density", "density_kg_m3", density, KG_PER_M3),
    ];
    inputs.extend(viscosity.map(|value| quantity("plastic viscosity", "viscosity_Pa_s", value, PA_S)));
    inputs.extend(speed.map(|value| quantity("speed", "speed_m_s", value, M_PER_S)));
    let time = stress / stiffening;
    Answer {
        title: "Longest rest between two layers",
        inputs,
        results: vec![
            quantity("longest rest", "time_s", time, MINUTE),
            quantity("stress on the lower layer", "stress_Pa", stress, PA),
        ],
        equation: &[
            "t = sqrt((rho g h)^2 / 12 + (2 mu V / h)^2) / A_thix",
            "rho density, g = 9.81 m/s2, h thickness, mu plastic viscosity, V speed",
        ],
        source: "N. Roussel, F. Cussigh, Cem. Concr. Res. 38 (2008), 624-632 (from memory: check it against the paper)",
        validity: &[
            "a lower layer that rests undisturbed and stiffens at a constant rate: for an hour or so",
        ],
        warnings: super::answer::warnings([(
            time > 3600.0,
            "that is more than an hour, for which concrete hardly stiffens at a constant rate".to_owned(),
        )]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_are_those_that_others_have_worked_out() {
        // A_thix in Pa/s, longest rest in min for 100 mm of 2300 kg/m3 that hardly flow.
        for (stiffening, minutes) in [(0.1, 109.0), (0.5, 22.0), (1.0, 11.0)] {
            let time = stress(2300.0, 0.1, 0.0, 0.0) / stiffening / 60.0;
            assert!((time - minutes).abs() < 0.5, "{time}");
        }
    }

    #[test]
    fn a_fast_layer_shears_as_between_walls() {
        // Twice the mean shear rate V / h, where weight is nothing.
        assert!((stress(1e-9, 0.1, 50.0, 0.2) - 50.0 * 2.0 * 0.2 / 0.1).abs() < 1e-6);
    }
}
