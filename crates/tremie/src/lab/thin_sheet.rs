//! The sheet to which a yield-stress fluid spreads on a plate (N. Roussel, P. Coussot, Journal of Rheology 49, 2005,
//! 705-718).
//!
//! At rest the weight that drives the fluid outwards is held by the yield stress at the plate alone:
//! `h(r) = sqrt(2 tau0 (R - r) / (rho g))`, which holds the volume V for `tau0 = 225 rho g V^2 / (128 pi^2 R^5)`. This
//! neglects inertia, normal stresses, surface tension and slip, and holds for slow spreading to heights well below
//! the radius.

use std::f64::consts::PI;

/// The sheet of a volume of fluid, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ThinSheet {
    /// Radius of its edge in m.
    pub(crate) radius: f64,
    /// 2 tau0 / (rho g) in m.
    slope: f64,
}

impl ThinSheet {
    /// The sheet of `volume` m3 of a fluid of a positive yield stress in Pa and a density in kg/m3 under gravity in m/s2.
    pub(crate) fn new(volume: f64, yield_stress: f64, density: f64, gravity: f64) -> Self {
        let weight = density * gravity;
        let fifth = 225.0 * weight * volume * volume / (128.0 * PI * PI * yield_stress);
        Self { radius: fifth.powf(0.2), slope: 2.0 * yield_stress / weight }
    }

    /// The yield stress in Pa at which `volume` m3 of a fluid of a density in kg/m3 spread to `radius` m under gravity
    /// in m/s2.
    pub(crate) fn yield_stress(volume: f64, radius: f64, density: f64, gravity: f64) -> f64 {
        225.0 * density * gravity * volume * volume / (128.0 * PI * PI * radius.powi(5))
    }

    /// Height in m at the distance `r` m from the axis.
    pub(crate) fn height(&self, r: f64) -> f64 {
        (self.slope * (self.radius - r).max(0.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_the_volume() {
        let sheet = ThinSheet::new(5.498e-3, 50.0, 2300.0, 9.81);
        let step = sheet.radius / 1e5;
        let ring = |n: i32| {
            let r = (f64::from(n) + 0.5) * step;
            2.0 * PI * r * step * sheet.height(r)
        };
        let volume: f64 = (0..100_000).map(ring).sum();
        assert!((volume / 5.498e-3 - 1.0).abs() < 1e-5, "{volume}");
        // As others have worked out.
        assert!((sheet.radius - 0.299987).abs() < 1e-5 && (sheet.height(0.0) - 0.036463).abs() < 1e-5);
    }
}
