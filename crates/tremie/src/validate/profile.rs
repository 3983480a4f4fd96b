//! Velocity profiles of plane channels, from the flow curve alone: the stress grows as the distance from the middle, so that
//! with the integral `S(tau)` of the shear rate over the stress
//!
//! ```text
//!     u(y) = H / tau_w (S(tau_w) - S(tau_w |y| / H))
//! ```
//!
//! (half gap H, wall stress tau_w, y from the middle; R. B. Bird, G. C. Dai, B. J. Yarusso, Reviews in Chemical
//! Engineering 1, 1983). S is in closed form, or integrated here; nothing of the crates that are judged is used.

use tremie_rheology::FlowCurve;

/// A flow curve, written down again as the reference.
#[derive(Debug, Clone, Copy)]
pub(super) enum Model {
    /// `stress = yield_stress + consistency s^index` (Herschel and Bulkley 1926); a power law without yield stress.
    HerschelBulkley { yield_stress: f64, consistency: f64, index: f64 },
    /// `sqrt(stress) = sqrt(yield_stress) + sqrt(viscosity s)` (Casson 1959).
    Casson { yield_stress: f64, viscosity: f64 },
    /// `viscosity = infinite + (zero - infinite) / (1 + (time s)^index)` (Cross 1965).
    Cross { zero: f64, infinite: f64, time: f64, index: f64 },
    /// `viscosity = infinite + (zero - infinite) (1 + (time s)^a)^((index - 1)/a)` (Carreau 1972, Yasuda 1979).
    CarreauYasuda { zero: f64, infinite: f64, time: f64, index: f64, a: f64 },
}

impl Model {
    /// The curve that is judged.
    pub(super) fn curve(&self) -> FlowCurve {
        match *self {
            Self::HerschelBulkley { yield_stress: 0.0, consistency, index } => {
                FlowCurve::PowerLaw { consistency, index }
            }
            Self::HerschelBulkley { yield_stress, consistency, index } => {
                FlowCurve::HerschelBulkley { yield_stress, consistency, index }
            }
            Self::Casson { yield_stress, viscosity } => {
                FlowCurve::Casson { yield_stress, plastic_viscosity: viscosity }
            }
            Self::Cross { zero, infinite, time, index } => FlowCurve::Cross {
                zero_shear_viscosity: zero,
                infinite_shear_viscosity: infinite,
                time,
                index,
            },
            Self::CarreauYasuda { zero, infinite, time, index, a } => FlowCurve::CarreauYasuda {
                zero_shear_viscosity: zero,
                infinite_shear_viscosity: infinite,
                time,
                index,
                transition: a,
            },
        }
    }

    /// Stress at a shear rate.
    pub(super) fn stress(&self, s: f64) -> f64 {
        match *self {
            Self::HerschelBulkley { yield_stress, consistency, index } => {
                yield_stress + consistency * s.powf(index)
            }
            Self::Casson { yield_stress, viscosity } => {
                (yield_stress.sqrt() + (viscosity * s).sqrt()).powi(2)
            }
            Self::Cross { zero, infinite, time, index } => {
                s * (infinite + (zero - infinite) / (1.0 + (time * s).powf(index)))
            }
            Self::CarreauYasuda { zero, infinite, time, index, a } => {
                s * (infinite + (zero - infinite) * (1.0 + (time * s).powf(a)).powf((index - 1.0) / a))
            }
        }
    }

    /// Integral of the shear rate over the stress, from none to `stress`.
    fn integral(&self, stress: f64) -> f64 {
        match *self {
            Self::HerschelBulkley { yield_stress, consistency, index } => {
                let excess = (stress - yield_stress).max(0.0) / consistency;
                consistency * index / (index + 1.0) * excess.powf(1.0 + 1.0 / index)
            }
            Self::Casson { yield_stress, viscosity } => {
                let primitive = |tau: f64| {
                    0.5 * tau * tau - 4.0 / 3.0 * yield_stress.sqrt() * tau.powf(1.5) + yield_stress * tau
                };
                (primitive(stress.max(yield_stress)) - primitive(yield_stress)) / viscosity
            }
            // By parts, tau s less the integral of the stress over the rate (Simpson).
            _ => {
                let rate = self.rate(stress);
                let pieces = 2000;
                let at = |k: i32| self.stress(rate * f64::from(k) / f64::from(2 * pieces));
                let sum: f64 = (0..pieces).map(|k| at(2 * k) + 4.0 * at(2 * k + 1) + at(2 * k + 2)).sum();
                stress * rate - sum * rate / f64::from(6 * pieces)
            }
        }
    }

    /// Shear rate at a stress, by bisection.
    fn rate(&self, stress: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        while self.stress(high) < stress {
            high *= 2.0;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if self.stress(middle) < stress { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Velocity in m/s at the share `eta` of the half gap from the middle, for a half gap in m and a wall stress in Pa.
    pub(super) fn velocity(&self, half_gap: f64, wall_stress: f64, eta: f64) -> f64 {
        half_gap / wall_stress * (self.integral(wall_stress) - self.integral(wall_stress * eta.abs()))
    }
}
