//! Flow curves: how the shear stress of a fluid follows from its shear rate, and back.
//!
//! Conventions: shear rate `s = sqrt(2 D:D)` in 1/s with D the rate-of-strain tensor, stress
//! `sqrt(T:T/2)` in Pa with T the deviatoric stress; in simple shear both are the usual scalars.
//! Curves are exact unless they are regularised on purpose: a yield stress is a yield stress, not a large viscosity.

pub mod bars;
mod thixotropy;
mod viscoplastic;

use tremie_numerics::root::turning_point;

pub use thixotropy::Thixotropy;
pub use viscoplastic::{Regularisation, Viscoplastic};

/// No fluid here shears faster, in 1/s.
const HIGHEST_RATE: f64 = 1e30;

/// A generalised Newtonian fluid. The stress grows with the shear rate, so that each has one inverse.
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
    /// Herschel and Bulkley (1926): rigid up to the yield stress, then `stress = yield_stress + consistency * s^index`.
    HerschelBulkley {
        /// Yield stress in Pa.
        yield_stress: f64,
        /// Consistency in Pa s^index.
        consistency: f64,
        /// Exponent of the shear rate, positive.
        index: f64,
    },
    /// Casson (1959): rigid up to the yield stress, then `sqrt(stress) = sqrt(yield_stress) + sqrt(plastic_viscosity * s)`.
    Casson {
        /// Yield stress in Pa.
        yield_stress: f64,
        /// Viscosity in Pa s that the fluid tends to at high shear rates.
        plastic_viscosity: f64,
    },
    /// Ostwald (1925) and de Waele (1923): `stress = consistency * s^index`.
    PowerLaw {
        /// Consistency in Pa s^index.
        consistency: f64,
        /// Exponent of the shear rate, positive.
        index: f64,
    },
    /// Cross (1965): `viscosity = infinite + (zero - infinite) / (1 + (time * s)^index)`.
    Cross {
        /// Viscosity in Pa s in the limit of no shear.
        zero_shear_viscosity: f64,
        /// Viscosity in Pa s in the limit of infinite shear rate; no larger.
        infinite_shear_viscosity: f64,
        /// Reciprocal in s of the shear rate in the middle of the transition.
        time: f64,
        /// Exponent, positive and at most 1.
        index: f64,
    },
    /// Carreau (1972) and Yasuda (1979): `viscosity = infinite + (zero - infinite) (1 + (time * s)^a)^((index - 1) / a)`.
    CarreauYasuda {
        /// Viscosity in Pa s in the limit of no shear.
        zero_shear_viscosity: f64,
        /// Viscosity in Pa s in the limit of infinite shear rate; no larger.
        infinite_shear_viscosity: f64,
        /// Reciprocal in s of the shear rate at which the viscosity begins to fall.
        time: f64,
        /// Index of the power law in between, positive.
        index: f64,
        /// How abruptly it begins: the exponent a, positive; 2 for Carreau.
        transition: f64,
    },
    /// A fluid with a yield stress that is made to flow, however slowly, at any stress.
    Regularised {
        /// The fluid itself.
        exact: Viscoplastic,
        /// How.
        by: Regularisation,
    },
}

impl FlowCurve {
    /// Whether the viscosity is the same at all shear rates.
    pub fn is_newtonian(&self) -> bool {
        matches!(self, Self::Newtonian { .. })
    }

    /// Parameters of a fluid with a yield stress, be it regularised or not.
    pub fn viscoplastic(&self) -> Option<Viscoplastic> {
        match *self {
            Self::Bingham { yield_stress, plastic_viscosity } => {
                Some(Viscoplastic { yield_stress, consistency: plastic_viscosity, index: 1.0, power: 1.0 })
            }
            Self::HerschelBulkley { yield_stress, consistency, index } => {
                Some(Viscoplastic { yield_stress, consistency, index, power: 1.0 })
            }
            Self::Casson { yield_stress, plastic_viscosity } => {
                Some(Viscoplastic { yield_stress, consistency: plastic_viscosity, index: 1.0, power: 0.5 })
            }
            Self::Regularised { exact, .. } => Some(exact),
            _ => None,
        }
    }

    /// The curve regularised; none if it has no yield stress.
    pub fn regularised(&self, by: Regularisation) -> Option<Self> {
        self.viscoplastic().map(|exact| Self::Regularised { exact, by })
    }

    /// The power law as a fluid without a yield stress, or a fluid with one.
    fn family(&self) -> Option<Viscoplastic> {
        match *self {
            Self::PowerLaw { consistency, index } => {
                Some(Viscoplastic { yield_stress: 0.0, consistency, index, power: 1.0 })
            }
            _ => self.viscoplastic(),
        }
    }

    /// Shear stress in Pa at the shear rate `s` >= 0 in 1/s. At s = 0 the limit from above: the yield stress.
    pub fn stress(&self, shear_rate: f64) -> f64 {
        match self {
            Self::Newtonian { viscosity } => viscosity * shear_rate,
            Self::Bingham { yield_stress, plastic_viscosity } => {
                yield_stress + plastic_viscosity * shear_rate
            }
            Self::Regularised { exact, by } => by.stress(exact, shear_rate),
            _ => match self.family() {
                Some(fluid) => fluid.stress(shear_rate),
                None => self.viscosity(shear_rate) * shear_rate,
            },
        }
    }

    /// Apparent viscosity `stress / s` in Pa s; at s = 0 its limit, which is infinite where there is a yield stress.
    pub fn viscosity(&self, shear_rate: f64) -> f64 {
        match *self {
            Self::Newtonian { viscosity } => viscosity,
            Self::Bingham { yield_stress: 0.0, plastic_viscosity } => plastic_viscosity,
            Self::Bingham { yield_stress, plastic_viscosity } => {
                yield_stress / shear_rate + plastic_viscosity
            }
            Self::Cross { zero_shear_viscosity, infinite_shear_viscosity, time, index } => {
                let thinning = (time * shear_rate).powf(index);
                infinite_shear_viscosity
                    + (zero_shear_viscosity - infinite_shear_viscosity) / (1.0 + thinning)
            }
            Self::CarreauYasuda {
                zero_shear_viscosity,
                infinite_shear_viscosity,
                time,
                index,
                transition,
            } => {
                let thinning = 1.0 + (time * shear_rate).powf(transition);
                infinite_shear_viscosity
                    + (zero_shear_viscosity - infinite_shear_viscosity)
                        * thinning.powf((index - 1.0) / transition)
            }
            Self::Regularised { exact, by } => by.viscosity(&exact, shear_rate),
            Self::HerschelBulkley { .. } | Self::Casson { .. } | Self::PowerLaw { .. } => {
                self.family().map_or(f64::NAN, |fluid| fluid.viscosity(shear_rate))
            }
        }
    }

    /// Shear rate in 1/s at a shear stress >= 0 in Pa; zero up to the yield stress.
    ///
    /// In closed form, or where there is none (Cross, Carreau-Yasuda, Papanastasiou) by bisection down to neighbouring
    /// floating-point numbers.
    pub fn shear_rate(&self, stress: f64) -> f64 {
        match self {
            Self::Newtonian { viscosity } => stress / viscosity,
            Self::Bingham { yield_stress, plastic_viscosity } => {
                ((stress - yield_stress) / plastic_viscosity).max(0.0)
            }
            Self::Regularised { exact, by } => by.shear_rate(exact, stress),
            _ => match self.family() {
                Some(fluid) => fluid.shear_rate(stress),
                None => turning_point(HIGHEST_RATE, |s| self.stress(s) < stress),
            },
        }
    }

    /// Stress in Pa up to which nothing flows: zero for a fluid without a yield stress, and for one that is regularised.
    pub fn yield_stress(&self) -> f64 {
        match self {
            Self::Regularised { .. } => 0.0,
            _ => self.viscoplastic().map_or(0.0, |fluid| fluid.yield_stress),
        }
    }

    /// Stress in Pa about which the viscosity changes most, if there is such a stress, else zero: the yield stress, also of a
    /// regularised fluid, or the stress of the plateau between two viscosities.
    pub fn bend(&self) -> f64 {
        match *self {
            Self::Cross { zero_shear_viscosity, infinite_shear_viscosity, time, .. }
            | Self::CarreauYasuda { zero_shear_viscosity, infinite_shear_viscosity, time, .. } => {
                (zero_shear_viscosity - infinite_shear_viscosity) / time
            }
            Self::Regularised { exact, by } => by.bend(&exact),
            _ => self.yield_stress(),
        }
    }

    /// The viscosity in Pa s that sets the scales of a run: the slope of the curve, without regularisation, at a shear rate
    /// of 1/s.
    ///
    /// For Newtonian and Bingham fluids the slope is the same at any rate. For the others 1/s stands for the rates of
    /// 0.1/s to 10/s at which fresh concrete and its like flow by their weight.
    pub fn plastic_viscosity(&self) -> f64 {
        match *self {
            Self::Newtonian { viscosity } => viscosity,
            Self::Bingham { plastic_viscosity, .. } => plastic_viscosity,
            Self::Cross { zero_shear_viscosity, infinite_shear_viscosity, time, index } => {
                let x = time.powf(index);
                let share = (1.0 + (1.0 - index) * x) / (1.0 + x).powi(2);
                infinite_shear_viscosity + (zero_shear_viscosity - infinite_shear_viscosity) * share
            }
            Self::CarreauYasuda {
                zero_shear_viscosity,
                infinite_shear_viscosity,
                time,
                index,
                transition,
            } => {
                let x = time.powf(transition);
                let share = (1.0 + x).powf((index - 1.0) / transition) * (1.0 + index * x) / (1.0 + x);
                infinite_shear_viscosity + (zero_shear_viscosity - infinite_shear_viscosity) * share
            }
            _ => self.family().map_or(f64::NAN, |fluid| fluid.slope(1.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BINGHAM: FlowCurve = FlowCurve::Bingham { yield_stress: 50.0, plastic_viscosity: 30.0 };

    /// One of each, and each with a yield stress regularised in both ways.
    fn curves() -> Vec<FlowCurve> {
        let rigid = [
            BINGHAM,
            FlowCurve::HerschelBulkley { yield_stress: 50.0, consistency: 20.0, index: 0.5 },
            FlowCurve::HerschelBulkley { yield_stress: 50.0, consistency: 20.0, index: 1.5 },
            FlowCurve::Casson { yield_stress: 50.0, plastic_viscosity: 5.0 },
        ];
        let mut curves = vec![
            FlowCurve::Newtonian { viscosity: 3.0 },
            FlowCurve::PowerLaw { consistency: 20.0, index: 0.5 },
            FlowCurve::PowerLaw { consistency: 20.0, index: 1.5 },
            FlowCurve::Cross {
                zero_shear_viscosity: 1000.0,
                infinite_shear_viscosity: 1.0,
                time: 20.0,
                index: 0.8,
            },
            FlowCurve::CarreauYasuda {
                zero_shear_viscosity: 100.0,
                infinite_shear_viscosity: 0.0,
                time: 2.0,
                index: 0.4,
                transition: 2.0,
            },
        ];
        for curve in rigid {
            curves.push(curve);
            for by in [
                Regularisation::Papanastasiou { exponent: 100.0 },
                Regularisation::BiViscosity { largest_viscosity: 3e4 },
            ] {
                curves.push(curve.regularised(by).unwrap());
            }
        }
        curves
    }

    fn rates() -> impl Iterator<Item = f64> {
        (0..200).map(|k| 10f64.powf(-6.0 + 0.045 * f64::from(k)))
    }

    #[test]
    fn nothing_flows_up_to_the_yield_stress() {
        for curve in curves().into_iter().filter(|curve| curve.yield_stress() > 0.0) {
            assert_eq!(curve.shear_rate(0.0), 0.0);
            assert_eq!(curve.shear_rate(50.0), 0.0);
            assert!(curve.shear_rate(50.1) > 0.0);
            assert_eq!(curve.viscosity(0.0), f64::INFINITY);
        }
        assert_eq!(BINGHAM.shear_rate(80.0), 1.0);
    }

    #[test]
    fn shear_rate_inverts_stress() {
        for curve in curves() {
            for s in rates() {
                let (stress, slope) = (curve.stress(s), curve.stress(1.001 * s) - curve.stress(s));
                let tolerance = 1e-12 * (s + stress * 0.001 * s / slope);
                assert!((curve.shear_rate(stress) - s).abs() <= tolerance, "{curve:?} {s}");
                assert!((curve.viscosity(s) * s - stress).abs() <= 1e-12 * stress, "{curve:?} {s}");
            }
        }
    }

    #[test]
    fn stress_grows_with_the_rate_at_the_slope_of_the_scale() {
        for curve in curves() {
            let stresses: Vec<f64> = rates().map(|s| curve.stress(s)).collect();
            assert!(stresses.is_sorted_by(|a, b| a < b), "{curve:?}");
            let slope = (curve.stress(1.0 + 1e-5) - curve.stress(1.0 - 1e-5)) / 2e-5;
            // A regularised curve has almost come to the exact one there.
            let tolerance = if matches!(curve, FlowCurve::Regularised { .. }) { 1e-2 } else { 1e-6 };
            assert!((slope / curve.plastic_viscosity() - 1.0).abs() < tolerance, "{curve:?} {slope}");
        }
    }

    #[test]
    fn what_is_regularised_creeps_below_the_yield_stress_and_flows_as_before_above() {
        for curve in curves() {
            let FlowCurve::Regularised { exact, .. } = curve else { continue };
            assert_eq!(curve.yield_stress(), 0.0);
            let creep = curve.shear_rate(0.9 * exact.yield_stress);
            assert!(creep > 0.0 && creep < 0.1, "{curve:?} {creep}");
            assert!((curve.stress(30.0) / exact.stress(30.0) - 1.0).abs() < 1e-12);
            assert!(curve.stress(1e-3) < exact.yield_stress);
        }
    }

    #[test]
    fn viscosity_at_rest_is_the_limit() {
        for curve in curves() {
            let (rest, slow) = (curve.viscosity(0.0), curve.viscosity(1e-20));
            match rest {
                0.0 => assert!(slow < 1e-6, "{curve:?}"),
                f64::INFINITY => assert!(slow > 1e9, "{curve:?}"),
                _ => assert!((slow / rest - 1.0).abs() < 1e-3, "{curve:?} {rest} {slow}"),
            }
        }
    }

    #[test]
    fn special_cases_are_those_of_the_simpler_models() {
        let bingham = FlowCurve::Bingham { yield_stress: 0.0, plastic_viscosity: 3.0 };
        assert_eq!(bingham.viscosity(0.0), 3.0);
        assert_eq!(bingham.shear_rate(6.0), 2.0);
        let herschel_bulkley =
            FlowCurve::HerschelBulkley { yield_stress: 50.0, consistency: 30.0, index: 1.0 };
        let power_law = FlowCurve::PowerLaw { consistency: 3.0, index: 1.0 };
        let casson = FlowCurve::Casson { yield_stress: 0.0, plastic_viscosity: 3.0 };
        for s in rates() {
            assert_eq!(herschel_bulkley.stress(s), BINGHAM.stress(s));
            assert_eq!(power_law.stress(s), bingham.stress(s));
            assert!((casson.stress(s) / bingham.stress(s) - 1.0).abs() < 1e-14);
        }
    }
}
