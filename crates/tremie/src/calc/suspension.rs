//! What grains do to the fluid in which they are: concrete from its mortar.

use clap::Args;

use super::answer::{Answer, ONE, PA, PA_S, quantity, warnings};
use crate::failure::WrongInput;
use crate::quantities::{number, stress, viscosity};

/// Intrinsic viscosity of spheres (Einstein 1906).
const EINSTEIN: f64 = 2.5;

/// Share of the densest packing above which grains touch all over and friction adds to what is told here.
const CROWDED: f64 = 0.9;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc suspension --fraction 0.3
  tremie calc suspension --fraction 35% --packing 0.64 --yield-stress 20Pa --viscosity 8Pa.s")]
pub(super) struct Arguments {
    /// Share of the volume that the grains take
    #[arg(long, value_name = "SHARE", value_parser = number)]
    fraction: f64,
    /// Largest share that they could take
    #[arg(long, value_name = "SHARE", default_value = "0.6", value_parser = number)]
    packing: f64,
    /// Yield stress without them
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    yield_stress: Option<f64>,
    /// Plastic viscosity without them
    #[arg(long, value_name = "VISCOSITY", value_parser = viscosity)]
    viscosity: Option<f64>,
}

/// Viscosity of a suspension over that of its fluid, by I. M. Krieger and T. J. Dougherty, Transactions of the Society
/// of Rheology 3 (1959), 137-152.
fn relative_viscosity(fraction: f64, packing: f64) -> f64 {
    (1.0 - fraction / packing).powf(-EINSTEIN * packing)
}

/// Yield stress of a suspension over that of its fluid, by X. Chateau, G. Ovarlez and K. Luu Trung, Journal of Rheology
/// 52 (2008), 489-506.
fn relative_yield_stress(fraction: f64, packing: f64) -> f64 {
    ((1.0 - fraction) * relative_viscosity(fraction, packing)).sqrt()
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let &Arguments { fraction, packing, yield_stress, viscosity } = arguments;
    if packing > 1.0 {
        return Err(WrongInput(
            "grains cannot take more than the whole volume; give a --packing up to 1".to_owned(),
        ));
    }
    if fraction >= packing {
        return Err(WrongInput(
            "grains as dense as their densest packing do not flow; give a --fraction below --packing"
                .to_owned(),
        ));
    }
    let (of_viscosity, of_yield_stress) =
        (relative_viscosity(fraction, packing), relative_yield_stress(fraction, packing));
    let mut inputs = vec![
        quantity("share of grains", "fraction", fraction, ONE),
        quantity("densest packing", "packing", packing, ONE),
    ];
    let mut results = vec![
        quantity("relative viscosity", "relative_viscosity", of_viscosity, ONE),
        quantity("relative yield stress", "relative_yield_stress", of_yield_stress, ONE),
    ];
    if let Some(mortar) = yield_stress {
        inputs.push(quantity("yield stress without", "fluid_yield_stress_Pa", mortar, PA));
        results.push(quantity("yield stress", "yield_stress_Pa", of_yield_stress * mortar, PA));
    }
    if let Some(mortar) = viscosity {
        inputs.push(quantity("plastic viscosity without", "fluid_viscosity_Pa_s", mortar, PA_S));
        results.push(quantity("plastic viscosity", "viscosity_Pa_s", of_viscosity * mortar, PA_S));
    }
    Ok(Answer {
        title: "Concrete from its mortar",
        inputs,
        results,
        equation: &[
            "mu / mu0 = (1 - phi / phi_m)^(-2.5 phi_m),  tau / tau0 = sqrt((1 - phi) mu / mu0)",
            "phi share of grains, phi_m densest packing",
        ],
        source: "Krieger and Dougherty, Trans. Soc. Rheol. 3 (1959), 137; Chateau, Ovarlez and Trung, J. Rheol. 52 (2008), 489",
        validity: &[
            "hard round grains much larger than those of the fluid, without friction or attraction, evenly spread",
        ],
        warnings: warnings([(
            fraction > CROWDED * packing,
            "the grains are within a tenth of their densest packing: they rub on each other, which adds to this"
                .to_owned(),
        )]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suspensions_are_those_that_others_have_worked_out() {
        for (fraction, viscosity, viscosity_064, yield_stress) in [
            (0.1, 1.31453, 1.31237, 1.0877),
            (0.2, 1.83712, 1.82123, 1.21231),
            (0.3, 2.82843, 2.7512, 1.40709),
            (0.35, 3.71806, 3.54855, 1.55459),
        ] {
            assert!((relative_viscosity(fraction, 0.6) / viscosity - 1.0).abs() < 1e-5);
            assert!((relative_viscosity(fraction, 0.64) / viscosity_064 - 1.0).abs() < 1e-5);
            assert!((relative_yield_stress(fraction, 0.6) / yield_stress - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn few_grains_do_what_einstein_says() {
        let slope = (relative_viscosity(1e-6, 0.6) - 1.0) / 1e-6;
        assert!((slope - 2.5).abs() < 1e-4, "{slope}");
    }

    #[test]
    fn what_does_not_flow_is_refused() {
        let refused = |fraction: f64, packing: f64| {
            answer(&Arguments { fraction, packing, yield_stress: None, viscosity: None }).is_err()
        };
        assert!(refused(0.6, 0.6) && refused(0.7, 0.6) && refused(0.5, 1.2) && !refused(0.5, 0.6));
    }
}
