//! Quantities on the command line: positive numbers with units, read into SI units.

use tremie_case::units::{self, Dimension};

fn positive(text: &str, dimension: Dimension) -> Result<f64, String> {
    match units::parse(text, dimension) {
        Ok(value) if value > 0.0 => Ok(value),
        Ok(_) => Err("it must be positive".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// A positive number, in 1.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    positive(text, Dimension::NUMBER)
}

/// A positive length, in m.
pub(crate) fn length(text: &str) -> Result<f64, String> {
    positive(text, Dimension::LENGTH)
}

/// A positive time, in s.
pub(crate) fn time(text: &str) -> Result<f64, String> {
    positive(text, Dimension::TIME)
}

/// A positive volume, in m3.
pub(crate) fn volume(text: &str) -> Result<f64, String> {
    positive(text, Dimension::VOLUME)
}

/// A positive speed, in m/s.
pub(crate) fn speed(text: &str) -> Result<f64, String> {
    positive(text, Dimension::SPEED)
}

/// A positive flow rate, in m3/s.
pub(crate) fn flow_rate(text: &str) -> Result<f64, String> {
    positive(text, Dimension::FLOW_RATE)
}

/// A positive density, in kg/m3.
pub(crate) fn density(text: &str) -> Result<f64, String> {
    positive(text, Dimension::DENSITY)
}

/// A positive stress or pressure, in Pa.
pub(crate) fn stress(text: &str) -> Result<f64, String> {
    positive(text, Dimension::STRESS)
}

/// A stress that may be zero, in Pa.
pub(crate) fn stress_or_none(text: &str) -> Result<f64, String> {
    match units::parse(text, Dimension::STRESS) {
        Ok(value) if value >= 0.0 => Ok(value),
        Ok(_) => Err("it must not be negative".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// A positive stress per time, in Pa/s.
pub(crate) fn stress_rate(text: &str) -> Result<f64, String> {
    positive(text, Dimension::STRESS_RATE)
}

/// A positive viscosity, in Pa s.
pub(crate) fn viscosity(text: &str) -> Result<f64, String> {
    positive(text, Dimension::VISCOSITY)
}

/// A positive force, in N.
pub(crate) fn force(text: &str) -> Result<f64, String> {
    positive(text, Dimension::FORCE)
}

/// A positive torque, in N m.
pub(crate) fn torque(text: &str) -> Result<f64, String> {
    positive(text, Dimension::TORQUE)
}

/// A positive torque per rate of revolutions, in N m s.
pub(crate) fn torque_per_rate(text: &str) -> Result<f64, String> {
    positive(text, Dimension::TORQUE_PER_RATE)
}
