//! Yield stress and plastic viscosity from a rheometer with coaxial cylinders.
//!
//! Torque and speed of a Bingham fluid that is sheared all over the gap are in a straight line, `T = G + H N`, with N
//! in revolutions per second (M. Reiner and R. Riwlin 1927):
//!
//! ```text
//!     mu = H / (8 pi^2 h) (1/Ri^2 - 1/Ro^2),    tau0 = G / (4 pi h) (1/Ri^2 - 1/Ro^2) / ln(Ro / Ri)
//! ```

use std::f64::consts::PI;

use clap::Args;

use super::answer::{Answer, MM, NEWTON_METRE, NEWTON_METRE_SECOND, ONE, PA, PA_S, quantity};
use crate::failure::WrongInput;
use crate::quantities::{length, torque, torque_per_rate};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc rheometer --intercept 0.8N.m --slope 2.5N.m.s --inner-radius 100mm --outer-radius 145mm --height 200mm")]
pub(super) struct Arguments {
    /// Torque at no speed, G, of the straight line
    #[arg(long, value_name = "TORQUE", value_parser = torque)]
    intercept: f64,
    /// Torque per revolutions in a second, H
    #[arg(long, value_name = "TORQUE*TIME", value_parser = torque_per_rate)]
    slope: f64,
    /// Radius of the inner cylinder
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    inner_radius: f64,
    /// Radius of the outer cylinder
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    outer_radius: f64,
    /// Height of the inner cylinder in the concrete
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    height: f64,
}

/// Coaxial cylinders, in m.
#[derive(Debug, Clone, Copy)]
struct Cylinders {
    inner: f64,
    outer: f64,
    height: f64,
}

impl Cylinders {
    /// 1/Ri^2 - 1/Ro^2.
    fn difference(&self) -> f64 {
        1.0 / (self.inner * self.inner) - 1.0 / (self.outer * self.outer)
    }

    /// Plastic viscosity in Pa s from the slope in N m s.
    fn viscosity(&self, slope: f64) -> f64 {
        slope / (8.0 * PI * PI * self.height) * self.difference()
    }

    /// Yield stress in Pa from the intercept in N m.
    fn yield_stress(&self, intercept: f64) -> f64 {
        intercept / (4.0 * PI * self.height) * self.difference() / (self.outer / self.inner).ln()
    }

    /// Torque in N m from which on the yield stress in Pa is reached at the outer cylinder, too.
    fn all_sheared(&self, yield_stress: f64) -> f64 {
        2.0 * PI * self.outer * self.outer * self.height * yield_stress
    }
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let &Arguments { intercept, slope, inner_radius, outer_radius, height } = arguments;
    if outer_radius <= inner_radius {
        return Err(WrongInput(
            "the outer cylinder must be wider than the inner one; give a larger --outer-radius".to_owned(),
        ));
    }
    let cylinders = Cylinders { inner: inner_radius, outer: outer_radius, height };
    let yield_stress = cylinders.yield_stress(intercept);
    let torque = cylinders.all_sheared(yield_stress);
    Ok(Answer {
        title: "Yield stress and viscosity from a coaxial rheometer",
        inputs: vec![
            quantity("intercept", "intercept_N_m", intercept, NEWTON_METRE),
            quantity("slope", "slope_N_m_s", slope, NEWTON_METRE_SECOND),
            quantity("inner radius", "inner_radius_m", inner_radius, MM),
            quantity("outer radius", "outer_radius_m", outer_radius, MM),
            quantity("height", "height_m", height, MM),
        ],
        results: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("plastic viscosity", "viscosity_Pa_s", cylinders.viscosity(slope), PA_S),
            quantity("all sheared from", "torque_N_m", torque, NEWTON_METRE),
            quantity("that is, revolutions a second", "revolutions_1_s", (torque - intercept) / slope, ONE),
        ],
        equation: &[
            "mu = H / (8 pi^2 h) (1/Ri^2 - 1/Ro^2),  tau0 = G / (4 pi h) (1/Ri^2 - 1/Ro^2) / ln(Ro/Ri)",
            "T = G + H N: torque T, intercept G, slope H, N revolutions a second; radii Ri, Ro, height h",
        ],
        source: "M. Reiner, R. Riwlin, Kolloid-Zeitschrift 43 (1927), 1-5",
        validity: &[
            "speeds at which all of the gap is sheared (slower ones do not belong in the straight line), no slip,",
            "no torque on the ends. Rheometers differ by their absolute values: compare within one only",
        ],
        warnings: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_torque_of_a_known_fluid_gives_it_back() {
        let (tau0, mu) = (80.0, 25.0);
        let cylinders = Cylinders { inner: 0.1, outer: 0.145, height: 0.2 };
        // Revolutions a second at a torque, from the flow curve integrated over thin rings of the gap.
        let speed = |torque: f64| -> f64 {
            let rings = 20_000;
            let step = (cylinders.outer - cylinders.inner) / f64::from(rings);
            let ring = |n: i32| {
                let r = cylinders.inner + (f64::from(n) + 0.5) * step;
                let stress = torque / (2.0 * PI * r * r * cylinders.height);
                (stress - tau0).max(0.0) / mu * step / r
            };
            (0..rings).map(ring).sum::<f64>() / (2.0 * PI)
        };
        let torques = [1.1, 3.0].map(|factor| factor * cylinders.all_sheared(tau0));
        let speeds = torques.map(speed);
        let slope = (torques[1] - torques[0]) / (speeds[1] - speeds[0]);
        let intercept = torques[0] - slope * speeds[0];
        assert!((cylinders.viscosity(slope) / mu - 1.0).abs() < 1e-6);
        assert!((cylinders.yield_stress(intercept) / tau0 - 1.0).abs() < 1e-6);
    }
}
