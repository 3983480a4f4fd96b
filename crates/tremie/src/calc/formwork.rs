//! Pressure on formwork of concrete that stiffens at rest and hangs on to walls and bars.
//!
//! What was cast a time t ago carries the stress `A_thix t` at walls and bars, and lies `z = R t` below the surface
//! that rises at R. The pressure grows with the depth by `dp/dz = rho g - c A_thix z / R`, so that over the height H
//!
//! ```text
//!     p / (rho g H) = K = 1 - c A_thix H / (2 rho g R)
//! ```
//!
//! with the walls' `c = 2 / e` in a form of thickness e (G. Ovarlez, N. Roussel, Materials and Structures 39, 2006,
//! 269-279), and with vertical bars of diameter d and section S per length of wall `c = (2 + 4 S / d) / (e - S)` (A.
//! Perrot, S. Amziane, G. Ovarlez, N. Roussel, Cement and Concrete Research 39, 2009, 524-528). From the depth `z = rho
//! g R / (c A_thix)` on it would fall again: that is where the concrete carries itself, and the pressure is largest.

use clap::Args;

use super::answer::{Answer, KG_PER_M3, KPA, M, M_PER_H, MM, MM2_PER_M, ONE, PA_PER_S, quantity, warnings};
use crate::failure::WrongInput;
use crate::lab::GRAVITY;
use crate::numbers::significant;
use crate::quantities::{density, length, speed, stress_rate};

/// Time in s for which concrete stiffens at a constant rate, before it begins to set: an hour or so.
const DORMANT: f64 = 3600.0;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc formwork --height 4m --thickness 200mm --rise 5m/h --stiffening 0.2Pa/s
  tremie calc formwork --height 4m --thickness 200mm --rise 5m/h --stiffening 0.2Pa/s --bar-diameter 12mm --bar-area 1000mm2/m")]
pub(super) struct Arguments {
    /// Height of the concrete
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    height: f64,
    /// Thickness of the wall that is cast
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    thickness: f64,
    /// Speed at which the concrete rises
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    rise: f64,
    /// Growth of the yield stress at rest, A_thix
    #[arg(long, value_name = "STRESS/TIME", value_parser = stress_rate)]
    stiffening: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
    /// Diameter of vertical bars
    #[arg(long, value_name = "LENGTH", value_parser = length, requires = "bar_area")]
    bar_diameter: Option<f64>,
    /// Section of vertical bars per length of wall
    #[arg(long, value_name = "AREA/LENGTH", value_parser = length, requires = "bar_diameter")]
    bar_area: Option<f64>,
}

/// A form that is filled.
#[derive(Debug, Clone, Copy)]
struct Form {
    /// Thickness in m.
    thickness: f64,
    /// Speed in m/s.
    rise: f64,
    /// A_thix in Pa/s.
    stiffening: f64,
    /// kg/m3.
    density: f64,
    /// Diameter in m of vertical bars, and their section in m2 per m.
    bars: Option<(f64, f64)>,
}

impl Form {
    /// Surface of walls and bars over the section of the concrete, 1/m.
    fn surface(&self) -> f64 {
        match self.bars {
            None => 2.0 / self.thickness,
            Some((diameter, section)) => (2.0 + 4.0 * section / diameter) / (self.thickness - section),
        }
    }

    /// Pressure in Pa at the depth `z` in m, where the concrete does not carry itself yet.
    fn pressure(&self, z: f64) -> f64 {
        let hydrostatic = self.density * GRAVITY * z;
        hydrostatic - 0.5 * self.surface() * self.stiffening * z * z / self.rise
    }

    /// Depth in m from which on the concrete carries itself.
    fn carried(&self) -> f64 {
        self.density * GRAVITY * self.rise / (self.surface() * self.stiffening)
    }
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let &Arguments { height, thickness, rise, stiffening, density, bar_diameter, bar_area } = arguments;
    if let Some(section) = bar_area
        && section >= thickness
    {
        return Err(WrongInput(format!(
            "bars of {} mm2 per m leave no room in a wall of {} mm; give a smaller --bar-area",
            significant(1e6 * section),
            significant(1e3 * thickness)
        )));
    }
    let form = Form { thickness, rise, stiffening, density, bars: bar_diameter.zip(bar_area) };
    let hydrostatic = density * GRAVITY * height;
    let deepest = form.carried().min(height);
    let largest = form.pressure(deepest);
    let mut inputs = vec![
        quantity("height", "height_m", height, M),
        quantity("thickness", "thickness_m", thickness, MM),
        quantity("rise", "rise_m_s", rise, M_PER_H),
        quantity("stiffening A_thix", "stiffening_Pa_s", stiffening, PA_PER_S),
        quantity("density", "density_kg_m3", density, KG_PER_M3),
    ];
    if let Some((diameter, section)) = form.bars {
        inputs.push(quantity("bars, diameter", "bar_diameter_m", diameter, MM));
        inputs.push(quantity("bars, section", "bar_area_m2_m", section, MM2_PER_M));
    }
    Ok(Answer {
        title: "Pressure on formwork",
        inputs,
        results: vec![
            quantity("largest pressure", "pressure_Pa", largest, KPA),
            quantity("at the depth", "depth_m", deepest, M),
            quantity("hydrostatic at the foot", "hydrostatic_Pa", hydrostatic, KPA),
            quantity("K, their ratio", "ratio", largest / hydrostatic, ONE),
        ],
        equation: &[
            "K = 1 - A_thix H / (rho g e R);  with bars  K = 1 - (d + 2 S) / ((e - S) d) A_thix H / (rho g R)",
            "H height, e thickness, R rise, rho density, g = 9.81 m/s2, d diameter and S section per length of bars;",
            "told is the largest pressure over the height: at the foot, or where K H is largest",
        ],
        source: "G. Ovarlez, N. Roussel, Mater. Struct. 39 (2006), 269; bars: A. Perrot and others, Cem. Concr. Res. 39 (2009), 524",
        validity: &[
            "rough walls and concrete that is left alone: no vibration, no pumping from below, stiffening at a",
            "constant rate (for an hour or so). Not a design standard: guidelines ask for the hydrostatic pressure",
        ],
        warnings: warnings([
            (
                form.carried() < height,
                format!(
                    "from {} m down the concrete carries its own weight: the pressure is largest there, and K for the whole height would tell too little",
                    significant(form.carried())
                ),
            ),
            (
                height / rise > DORMANT,
                format!(
                    "casting takes {} min; after an hour or so concrete no longer stiffens at a constant rate",
                    significant(height / rise / 60.0)
                ),
            ),
        ]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In m.
    const HEIGHT: f64 = 4.0;

    fn form(rise_per_hour: f64) -> Form {
        Form { thickness: 0.2, rise: rise_per_hour / 3600.0, stiffening: 0.2, density: 2400.0, bars: None }
    }

    /// Pressure over the hydrostatic one at the foot.
    fn ratio(form: &Form) -> f64 {
        form.pressure(HEIGHT) / (form.density * GRAVITY * HEIGHT)
    }

    #[test]
    fn slow_casting_relieves_the_form_as_others_have_worked_out() {
        for (rise, k) in [(2.0, 0.69), (5.0, 0.88), (10.0, 0.94)] {
            assert!((ratio(&form(rise)) - k).abs() < 0.005, "{}", ratio(&form(rise)));
        }
    }

    #[test]
    fn bars_count_by_their_surface_and_thin_ones_of_no_section_not_at_all() {
        let plain = form(2.0);
        let none = Form { bars: Some((0.012, 1e-12)), ..plain };
        assert!((ratio(&none) - ratio(&plain)).abs() < 1e-9);
        // As printed by Perrot and others.
        let (d, s, e) = (0.012, 1e-3, 0.2);
        let barred = Form { bars: Some((d, s)), ..plain };
        let k = 1.0 - (d + 2.0 * s) / ((e - s) * d) * 0.2 * 4.0 / (2400.0 * GRAVITY * 2.0 / 3600.0);
        assert!((ratio(&barred) - k).abs() < 1e-12);
        // The same steel in thinner bars has more surface.
        assert!(ratio(&Form { bars: Some((0.5 * d, s)), ..plain }) < ratio(&barred));
    }

    #[test]
    fn the_pressure_is_the_balance_of_thin_slices() {
        let form = form(5.0);
        let slices = 10_000;
        let thickness = HEIGHT / f64::from(slices);
        let pressure: f64 = (0..slices)
            .map(|n| {
                let age = (f64::from(n) + 0.5) * thickness / form.rise;
                thickness * (form.density * GRAVITY - 2.0 / form.thickness * form.stiffening * age)
            })
            .sum();
        assert!((form.pressure(HEIGHT) / pressure - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_pressure_is_largest_where_the_concrete_begins_to_carry_itself() {
        let form = Form { stiffening: 2.0, ..form(2.0) };
        let z = form.carried();
        assert!(z < HEIGHT);
        assert!(form.pressure(z) > form.pressure(0.99 * z) && form.pressure(z) > form.pressure(1.01 * z));
    }
}
