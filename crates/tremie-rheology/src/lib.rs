//! Flow curves: how the shear stress of a fluid follows from its shear rate, and back.
//!
//! Conventions: shear rate `s = sqrt(2 D:D)` in 1/s with D the rate-of-strain tensor, stress
//! `sqrt(T:T/2)` in Pa with T the deviatoric stress; in simple shear both are the usual scalars.
//! All curves here are exact: a yield stress is a yield stress, not a large viscosity.

/// A generalised Newtonian fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FlowCurve {
    /// Constant viscosity: `stress = viscosity * s`.
    Newtonian {
        /// Dynamic viscosity in Pa s.
        viscosity: f64,
    },
    /// Bingham (1922): rigid up to the yield stress, then `stress = yield_stress + plastic_viscosity * s`.
    Bingham {
        /// Yield stress in Pa.
        yield_stress: f64,
        /// Plastic viscosity in Pa s.
        plastic_viscosity: f64,
    },
}

impl FlowCurve {
    /// Shear stress in Pa at the shear rate `s` >= 0 in 1/s. At s = 0 the limit from above: the yield stress.
    pub fn stress(&self, shear_rate: f64) -> f64 {
        match *self {
            Self::Newtonian { viscosity } => viscosity * shear_rate,
            Self::Bingham { yield_stress, plastic_viscosity } => {
                yield_stress + plastic_viscosity * shear_rate
            }
        }
    }

    /// Apparent viscosity `stress / s` in Pa s; infinite at s = 0 where there is a yield stress.
    pub fn viscosity(&self, shear_rate: f64) -> f64 {
        match *self {
            Self::Newtonian { viscosity } => viscosity,
            Self::Bingham { yield_stress: 0.0, plastic_viscosity } => plastic_viscosity,
            Self::Bingham { yield_stress, plastic_viscosity } => {
                yield_stress / shear_rate + plastic_viscosity
            }
        }
    }

    /// Shear rate in 1/s at a shear stress >= 0 in Pa; zero up to the yield stress.
    pub fn shear_rate(&self, stress: f64) -> f64 {
        match *self {
            Self::Newtonian { viscosity } => stress / viscosity,
            Self::Bingham { yield_stress, plastic_viscosity } => {
                ((stress - yield_stress) / plastic_viscosity).max(0.0)
            }
        }
    }

    /// Yield stress in Pa, zero for a fluid without.
    pub fn yield_stress(&self) -> f64 {
        match *self {
            Self::Newtonian { .. } => 0.0,
            Self::Bingham { yield_stress, .. } => yield_stress,
        }
    }

    /// The viscosity in Pa s that sets the scales of a run: the slope of the curve at high shear rates.
    pub fn plastic_viscosity(&self) -> f64 {
        match *self {
            Self::Newtonian { viscosity } => viscosity,
            Self::Bingham { plastic_viscosity, .. } => plastic_viscosity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BINGHAM: FlowCurve = FlowCurve::Bingham { yield_stress: 50.0, plastic_viscosity: 30.0 };

    #[test]
    fn nothing_flows_up_to_the_yield_stress() {
        assert_eq!(BINGHAM.shear_rate(0.0), 0.0);
        assert_eq!(BINGHAM.shear_rate(50.0), 0.0);
        assert_eq!(BINGHAM.shear_rate(80.0), 1.0);
        assert_eq!(BINGHAM.viscosity(0.0), f64::INFINITY);
    }

    #[test]
    fn shear_rate_inverts_stress() {
        for curve in [FlowCurve::Newtonian { viscosity: 3.0 }, BINGHAM] {
            for k in 0..200 {
                let s = 10f64.powf(-6.0 + 0.045 * f64::from(k));
                let tolerance = 1e-12 * (s + curve.yield_stress() / curve.plastic_viscosity());
                assert!((curve.shear_rate(curve.stress(s)) - s).abs() <= tolerance);
                assert!((curve.viscosity(s) * s - curve.stress(s)).abs() <= 1e-12 * curve.stress(s));
            }
        }
    }

    #[test]
    fn bingham_without_yield_stress_is_newtonian() {
        let bingham = FlowCurve::Bingham { yield_stress: 0.0, plastic_viscosity: 3.0 };
        assert_eq!(bingham.viscosity(0.0), 3.0);
        assert_eq!(bingham.shear_rate(6.0), 2.0);
    }
}
