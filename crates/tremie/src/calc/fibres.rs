//! How many of the fibres in a concrete cross a section.
//!
//! The orientation factor `alpha = N A_f / (V_f A_c)` compares the N fibres of section A_f that cross the area A_c with
//! those that would if all stood across it: 1/2 in space, 2/pi in a plane that the section crosses, 1 aligned
//! (Soroushian and Lee 1990). Within half a fibre of a wall they lie along it, 0.60, and 0.84 in a corner (D. Dupont,
//! L. Vandewalle, Cement and Concrete Composites 27, 2005, 391-398).

use std::f64::consts::PI;

use clap::Args;

use super::answer::{Answer, MM, ONE, quantity};
use crate::failure::WrongInput;
use crate::numbers::significant;
use crate::quantities::{length, number};

/// Orientation factors away from walls, along one, and in a corner.
const FACTORS: [f64; 3] = [0.5, 0.6, 0.84];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc fibres --width 150mm --height 150mm --fibre-length 60mm
  tremie calc fibres --width 150mm --height 125mm --fibre-length 60mm --fibre-diameter 0.75mm --fraction 0.5%")]
pub(super) struct Arguments {
    /// Width of the section
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    width: f64,
    /// Height of the section
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    height: f64,
    /// Length of the fibres
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    fibre_length: f64,
    /// Diameter of the fibres, to count them
    #[arg(long, value_name = "LENGTH", value_parser = length, requires = "fraction")]
    fibre_diameter: Option<f64>,
    /// Share of the volume that the fibres take
    #[arg(long, value_name = "SHARE", value_parser = number, requires = "fibre_diameter")]
    fraction: Option<f64>,
}

/// Orientation factor of a section of `width` by `height` between four walls, no smaller than the fibres' length; all
/// in m.
fn orientation_factor(width: f64, height: f64, fibre: f64) -> f64 {
    let [bulk, wall, corner] = FACTORS;
    let (w, h) = (width - fibre, height - fibre);
    (bulk * w * h + wall * (w + h) * fibre + corner * fibre * fibre) / (width * height)
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let &Arguments { width, height, fibre_length, fibre_diameter, fraction } = arguments;
    if fibre_length > width.min(height) {
        return Err(WrongInput(format!(
            "fibres of {} mm are longer than the section is wide or high; give a shorter --fibre-length",
            significant(1e3 * fibre_length)
        )));
    }
    if fraction.is_some_and(|fraction| fraction >= 1.0) {
        return Err(WrongInput(
            "fibres cannot fill the whole concrete; give a --fraction below 100%".to_owned(),
        ));
    }
    let factor = orientation_factor(width, height, fibre_length);
    let mut inputs = vec![
        quantity("width", "width_m", width, MM),
        quantity("height", "height_m", height, MM),
        quantity("length of the fibres", "fibre_length_m", fibre_length, MM),
    ];
    let mut results = vec![quantity("orientation factor", "orientation_factor", factor, ONE)];
    if let (Some(diameter), Some(fraction)) = (fibre_diameter, fraction) {
        inputs.push(quantity("diameter of the fibres", "fibre_diameter_m", diameter, MM));
        inputs.push(quantity("share of fibres", "fraction", fraction, ONE));
        let of_one = 0.25 * PI * diameter * diameter;
        results.push(quantity(
            "fibres that cross the section",
            "fibres",
            factor * fraction * width * height / of_one,
            ONE,
        ));
    }
    Ok(Answer {
        title: "Orientation factor of fibres in a section",
        inputs,
        results,
        equation: &[
            "alpha = (0.5 (b - l) (h - l) + 0.6 ((b - l) l + (h - l) l) + 0.84 l^2) / (b h),  N = alpha V_f b h / A_f",
            "b width, h height, l length of the fibres; N fibres of section A_f and share V_f cross it",
        ],
        source: "D. Dupont, L. Vandewalle, Cement and Concrete Composites 27 (2005), 391-398",
        validity: &[
            "four walls, straight stiff fibres, and casting that does not orient them: real flow does, by a third",
            "and more; fibres no longer than the section is wide and high",
        ],
        warnings: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_that_others_have_worked_out() {
        // Width, height and length of the fibres in mm.
        for (width, height, fibre, factor) in [
            (150.0, 150.0, 60.0, 0.6024),
            (150.0, 125.0, 30.0, 0.55072),
            (1200.0, 150.0, 50.0, 0.539444),
            (40.0, 160.0, 13.0, 0.544322),
        ] {
            assert!((orientation_factor(width, height, fibre) - factor).abs() < 1e-5);
        }
    }

    #[test]
    fn short_fibres_lie_in_all_directions_and_the_section_can_be_turned() {
        assert!((orientation_factor(1.0, 1.0, 1e-9) - 0.5).abs() < 1e-8);
        assert_eq!(orientation_factor(0.15, 0.1, 0.03), orientation_factor(0.1, 0.15, 0.03));
    }
}
