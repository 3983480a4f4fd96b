//! Slump flow from the yield stress, by the sheet of Roussel and Coussot (`lab::ThinSheet`).

use std::f64::consts::PI;

use clap::Args;

use super::answer::{Answer, KG_PER_M3, LITRE, MM, ONE, PA, quantity, warnings};
use crate::lab::{CONE, CONE_VOLUME, GRAVITY, ThinSheet};
use crate::numbers::significant;
use crate::quantities::{density, length, stress, volume};

/// Height in the middle over radius above which normal stresses, left out of the formula, make the spread smaller by
/// more than a tenth or so.
pub(super) const THICK: f64 = 0.18;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc slump-flow --yield-stress 50Pa --density 2300kg/m3
  tremie calc slump-flow --yield-stress 30Pa --volume 0.344l --aggregate 2mm")]
pub(super) struct Arguments {
    /// Yield stress
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    yield_stress: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
    /// Volume of the sample [default: that of the cone of EN 12350-2, 5.50 l]
    #[arg(long, value_name = "VOLUME", value_parser = volume)]
    volume: Option<f64>,
    /// Largest grain, to be compared with the thickness of the sheet
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    aggregate: Option<f64>,
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Answer {
    let &Arguments { yield_stress, density, volume, aggregate } = arguments;
    let is_cone = volume.is_none();
    let volume = volume.unwrap_or(CONE_VOLUME);
    let sheet = ThinSheet::new(volume, yield_stress, density, GRAVITY);
    let height = sheet.height(0.0);
    let mean = volume / (PI * sheet.radius * sheet.radius);
    let mut inputs = vec![
        quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
        quantity("density", "density_kg_m3", density, KG_PER_M3),
        quantity("volume", "volume_m3", volume, LITRE),
    ];
    inputs.extend(aggregate.map(|size| quantity("largest grain", "aggregate_m", size, MM)));
    Answer {
        title: "Slump flow from the yield stress",
        inputs,
        results: vec![
            quantity("slump flow", "slump_flow_m", 2.0 * sheet.radius, MM),
            quantity("height in the middle", "height_m", height, MM),
            quantity("mean thickness", "mean_thickness_m", mean, MM),
            quantity("height over radius", "height_over_radius", height / sheet.radius, ONE),
        ],
        equation: SPREADING,
        source: SPREADING_SOURCE,
        validity: SPREADING_VALIDITY,
        warnings: [
            thickness_warnings(height / sheet.radius, is_cone && height > CONE[2]),
            warnings([(
                aggregate.is_some_and(|size| mean < 5.0 * size),
                format!(
                    "the sheet is on average {} grains thick: a concrete is a fluid only over several of its grains",
                    significant(mean / aggregate.unwrap_or(mean))
                ),
            )]),
        ]
        .concat(),
    }
}

/// The spreading formula.
pub(super) const SPREADING: &[&str] = &[
    "tau0 = 225 rho g V^2 / (128 pi^2 R^5)",
    "tau0 yield stress, rho density, g = 9.81 m/s2, V volume, R radius of the spread;",
    "height h(r) = sqrt(2 tau0 (R - r) / (rho g))",
];
pub(super) const SPREADING_SOURCE: &str = "N. Roussel, P. Coussot, Journal of Rheology 49 (2005), 705-718";
pub(super) const SPREADING_VALIDITY: &[&str] = &[
    "slow spreading (no inertia) to a sheet whose height is well below its radius (below 0.18;",
    "beyond, the real spread is smaller by a tenth or more), and many grains thick; no slip",
];

/// Warnings where a sheet is too thick for the formula, or even higher than the mould.
pub(super) fn thickness_warnings(height_over_radius: f64, above_mould: bool) -> Vec<String> {
    warnings([
        (
            height_over_radius > THICK,
            format!(
                "the height is {} of the radius, above {THICK}: normal stresses count, and the real spread is smaller",
                significant(height_over_radius)
            ),
        ),
        (
            above_mould,
            "the sheet would be higher than the mould: such a concrete does not spread; see `tremie calc slump`"
                .to_owned(),
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cone's in m3, to the digits with which the references were worked out.
    const VOLUME: f64 = 5.498e-3;

    #[test]
    fn spreads_are_those_that_others_have_worked_out() {
        // Yield stress in Pa, density in kg/m3; spread and height in m, for 5.498 l.
        for (tau0, rho, spread, height) in [
            (20.0, 2300.0, 0.720642, 0.0252741),
            (56.3, 2300.0, 0.585901, 0.0382356),
            (32.0, 2200.0, 0.650182, 0.0310489),
            (255.0, 2380.0, 0.436102, 0.0690146),
        ] {
            let sheet = ThinSheet::new(VOLUME, tau0, rho, GRAVITY);
            assert!((2.0 * sheet.radius / spread - 1.0).abs() < 5e-5, "{}", sheet.radius);
            assert!((sheet.height(0.0) / height - 1.0).abs() < 5e-5);
        }
    }

    #[test]
    fn yield_stresses_are_those_that_others_have_worked_out() {
        for (spread, tau0) in [(0.45, 210.652), (0.5, 124.388), (0.65, 33.5014), (0.8, 11.8626)] {
            let found = ThinSheet::yield_stress(VOLUME, 0.5 * spread, 2300.0, GRAVITY);
            assert!((found / tau0 - 1.0).abs() < 5e-5, "{found}");
        }
    }
}
