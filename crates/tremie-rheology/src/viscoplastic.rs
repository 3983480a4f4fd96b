//! Fluids with a yield stress, as one family, and the usual regularisations of them.

use tremie_numerics::root::turning_point;

use crate::HIGHEST_RATE;

/// A fluid that is rigid up to its yield stress and then flows by `stress^p = yield_stress^p + (consistency s^index)^p`
/// (Shulman 1975): Herschel-Bulkley for p = 1, Bingham if the index is 1 too, Casson for p = 1/2 and an index of 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viscoplastic {
    /// Yield stress in Pa.
    pub yield_stress: f64,
    /// Consistency in Pa s^index.
    pub consistency: f64,
    /// Exponent of the shear rate.
    pub index: f64,
    /// The power p in which yield stress and viscous stress add up.
    pub power: f64,
}

/// What makes a fluid with a yield stress flow, however slowly, at any stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regularisation {
    /// The yield stress grows with the shear rate s as `yield_stress^p (1 - exp(-(m s)^p))`
    /// (Papanastasiou 1987; for Casson fluids Papanastasiou and Boudouvis 1997).
    Papanastasiou {
        /// The exponent m in s.
        exponent: f64,
    },
    /// The viscosity is that of the curve, but no larger than this (after O'Donovan and Tanner 1984).
    BiViscosity {
        /// Largest viscosity in Pa s.
        largest_viscosity: f64,
    },
}

impl Viscoplastic {
    /// Stress in Pa if only a share of `yield_stress^p` is there.
    fn stress_with(&self, share: f64, s: f64) -> f64 {
        let Self { yield_stress, consistency, index, power } = *self;
        let viscous = consistency * s.powf(index);
        if power == 1.0 {
            return share * yield_stress + viscous;
        }
        (share * yield_stress.powf(power) + viscous.powf(power)).powf(1.0 / power)
    }

    /// Shear stress in Pa at the shear rate `s` in 1/s.
    pub(crate) fn stress(&self, s: f64) -> f64 {
        self.stress_with(1.0, s)
    }

    /// Shear rate in 1/s at a shear stress in Pa.
    pub(crate) fn shear_rate(&self, stress: f64) -> f64 {
        let Self { yield_stress, consistency, index, power } = *self;
        if stress <= yield_stress {
            return 0.0;
        }
        let viscous = if power == 1.0 {
            stress - yield_stress
        } else {
            (stress.powf(power) - yield_stress.powf(power)).powf(1.0 / power)
        };
        (viscous / consistency).powf(1.0 / index)
    }

    /// Apparent viscosity in Pa s in the limit of no shear, with `creep` in Pa s for the yield stress over the rate.
    fn viscosity_at_rest(&self, creep: f64) -> f64 {
        let viscous = self.consistency * 0f64.powf(self.index - 1.0);
        (creep.powf(self.power) + viscous.powf(self.power)).powf(1.0 / self.power)
    }

    /// Apparent viscosity in Pa s at the shear rate `s` in 1/s.
    pub(crate) fn viscosity(&self, s: f64) -> f64 {
        if s > 0.0 {
            self.stress(s) / s
        } else {
            self.viscosity_at_rest(if self.yield_stress > 0.0 { f64::INFINITY } else { 0.0 })
        }
    }

    /// Slope of the curve in Pa s at the shear rate `s` > 0 in 1/s.
    pub(crate) fn slope(&self, s: f64) -> f64 {
        let viscous = self.consistency * s.powf(self.index);
        self.index / s * self.stress(s).powf(1.0 - self.power) * viscous.powf(self.power)
    }

    /// The shear rate in 1/s above which the apparent viscosity rises again, if it does.
    fn thickening_rate(&self) -> f64 {
        if self.index > 1.0 {
            (self.yield_stress / ((self.index - 1.0) * self.consistency)).powf(1.0 / self.index)
        } else {
            HIGHEST_RATE
        }
    }

    /// The apparent viscosity in Pa s that the fluid has at least: a largest viscosity must be larger.
    pub fn least_viscosity(&self) -> f64 {
        match self.index {
            1.0 => self.consistency,
            index if index < 1.0 => 0.0,
            _ => self.viscosity(self.thickening_rate()),
        }
    }
}

impl Regularisation {
    /// Shear stress in Pa at the shear rate `s` in 1/s.
    pub(crate) fn stress(&self, of: &Viscoplastic, s: f64) -> f64 {
        match *self {
            Self::Papanastasiou { exponent } => of.stress_with(-(-(exponent * s).powf(of.power)).exp_m1(), s),
            Self::BiViscosity { largest_viscosity } => of.stress(s).min(largest_viscosity * s),
        }
    }

    /// Apparent viscosity in Pa s at the shear rate `s` in 1/s.
    pub(crate) fn viscosity(&self, of: &Viscoplastic, s: f64) -> f64 {
        match *self {
            Self::Papanastasiou { exponent } if s == 0.0 => of.viscosity_at_rest(of.yield_stress * exponent),
            Self::Papanastasiou { .. } => self.stress(of, s) / s,
            Self::BiViscosity { largest_viscosity } => of.viscosity(s).min(largest_viscosity),
        }
    }

    /// Shear rate in 1/s at a shear stress in Pa.
    pub(crate) fn shear_rate(&self, of: &Viscoplastic, stress: f64) -> f64 {
        match *self {
            Self::Papanastasiou { .. } => turning_point(HIGHEST_RATE, |s| self.stress(of, s) < stress),
            Self::BiViscosity { largest_viscosity } => of.shear_rate(stress).max(stress / largest_viscosity),
        }
    }

    /// Stress in Pa at which the curve bends.
    pub(crate) fn bend(&self, of: &Viscoplastic) -> f64 {
        match *self {
            Self::Papanastasiou { .. } => of.yield_stress,
            Self::BiViscosity { largest_viscosity } => {
                largest_viscosity
                    * turning_point(of.thickening_rate(), |s| largest_viscosity * s < of.stress(s))
            }
        }
    }
}
