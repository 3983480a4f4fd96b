//! Quantities as people write them: a number and a unit, such as `30 Pa s`, `620 mm`, `0.5 l/s`, `2300 kg/m3`.
//!
//! Between number and unit a space may stand or not. Units are multiplied by a space, `.`, `*` or `·` and divided by
//! `/`; after a division only further divisions may follow, because `kg/m s` is read in two ways. Exponents are
//! written `m3`, `m^3`, `m³`, `s-1`, `s^-1` or `s⁻¹`; the consistency of a power law is in `Pa s^n`, whatever its index n. Results are in SI units, plain numbers in 1, angles in rad.

use std::f64::consts::PI;
use std::fmt;

use crate::suggestion::{either, nearest};

/// Exponents of metre, kilogram, second, and of `s^n`, in which n is the index of a power law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dimension([i32; 4]);

impl Dimension {
    /// A number without unit, a share or an angle.
    pub const NUMBER: Self = Self([0, 0, 0, 0]);
    /// Length, SI unit m.
    pub const LENGTH: Self = Self([1, 0, 0, 0]);
    /// Area, SI unit m2.
    pub const AREA: Self = Self([2, 0, 0, 0]);
    /// Volume, SI unit m3.
    pub const VOLUME: Self = Self([3, 0, 0, 0]);
    /// Mass, SI unit kg.
    pub const MASS: Self = Self([0, 1, 0, 0]);
    /// Time, SI unit s.
    pub const TIME: Self = Self([0, 0, 1, 0]);
    /// Rate, SI unit 1/s.
    pub const RATE: Self = Self([0, 0, -1, 0]);
    /// Speed, SI unit m/s.
    pub const SPEED: Self = Self([1, 0, -1, 0]);
    /// Acceleration, SI unit m/s2.
    pub const ACCELERATION: Self = Self([1, 0, -2, 0]);
    /// Volume per time, SI unit m3/s.
    pub const FLOW_RATE: Self = Self([3, 0, -1, 0]);
    /// Density, SI unit kg/m3.
    pub const DENSITY: Self = Self([-3, 1, 0, 0]);
    /// Stress or pressure, SI unit Pa.
    pub const STRESS: Self = Self([-1, 1, -2, 0]);
    /// Stress per time, as concrete stiffens at rest, SI unit Pa/s.
    pub const STRESS_RATE: Self = Self([-1, 1, -3, 0]);
    /// Dynamic viscosity, SI unit Pa s.
    pub const VISCOSITY: Self = Self([-1, 1, -1, 0]);
    /// Consistency of a power law of any index n, SI unit Pa s^n.
    pub const CONSISTENCY: Self = Self([-1, 1, -2, 1]);
    /// Viscosity of a film over its thickness, SI unit Pa s/m.
    pub const FILM_VISCOSITY: Self = Self([-2, 1, -1, 0]);
    /// Force, SI unit N.
    pub const FORCE: Self = Self([1, 1, -2, 0]);
    /// Surface tension, SI unit N/m.
    pub const SURFACE_TENSION: Self = Self([0, 1, -2, 0]);
    /// Torque, SI unit N m.
    pub const TORQUE: Self = Self([2, 1, -2, 0]);
    /// Torque per rate of revolutions, SI unit N m s.
    pub const TORQUE_PER_RATE: Self = Self([2, 1, -1, 0]);

    /// What the dimension is called, and units in which to write it, the SI unit first.
    const NAMES: &[(Self, &str, &[&str])] = &[
        (Self::NUMBER, "a plain number", &[""]),
        (Self::LENGTH, "a length", &["m", "mm"]),
        (Self::AREA, "an area", &["m2"]),
        (Self::VOLUME, "a volume", &["m3", "l"]),
        (Self::MASS, "a mass", &["kg"]),
        (Self::TIME, "a time", &["s", "ms"]),
        (Self::RATE, "a rate", &["1/s"]),
        (Self::SPEED, "a speed", &["m/s"]),
        (Self::ACCELERATION, "an acceleration", &["m/s2"]),
        (Self::FLOW_RATE, "a flow rate", &["l/s"]),
        (Self::DENSITY, "a density", &["kg/m3"]),
        (Self::STRESS, "a stress", &["Pa"]),
        (Self::STRESS_RATE, "a stress per time", &["Pa/s"]),
        (Self::VISCOSITY, "a viscosity", &["Pa s"]),
        (Self::CONSISTENCY, "a consistency", &["Pa s^n"]),
        (Self::FILM_VISCOSITY, "a viscosity over a thickness", &["Pa s/m"]),
        (Self::FORCE, "a force", &["N"]),
        (Self::SURFACE_TENSION, "a surface tension", &["N/m", "mN/m"]),
        (Self::TORQUE, "a torque", &["N m"]),
        (Self::TORQUE_PER_RATE, "a torque per rate", &["N m s"]),
    ];

    fn units(self) -> Vec<String> {
        match Self::NAMES.iter().find(|(dimension, ..)| *dimension == self) {
            Some((_, _, units)) => units.iter().map(ToString::to_string).collect(),
            None => {
                let powers = ["m", "kg", "s", "s^n"].iter().zip(self.0).filter(|(_, power)| *power != 0);
                let powers = powers.map(|(unit, power)| match power {
                    1 => (*unit).to_owned(),
                    _ => format!("{unit}{power}"),
                });
                vec![powers.collect::<Vec<_>>().join(" ")]
            }
        }
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Self::NAMES.iter().find(|(dimension, ..)| dimension == self) {
            Some((_, name, _)) => f.write_str(name),
            None => write!(f, "a quantity in {}", self.units().concat()),
        }
    }
}

/// Why a text is not the quantity wanted; displays as what is wrong and what to write.
#[derive(Debug, Clone, PartialEq)]
pub enum UnitError {
    /// The text does not begin with a number.
    NoNumber {
        /// The text.
        text: String,
        /// What was wanted.
        wanted: Dimension,
    },
    /// The number has a comma in it.
    Comma {
        /// The text.
        text: String,
    },
    /// There is a number only.
    NoUnit {
        /// The number as written.
        number: String,
        /// What was wanted.
        wanted: Dimension,
    },
    /// There is no such unit.
    UnknownUnit {
        /// The unit as written.
        unit: String,
        /// A unit spelled similarly, or two with the space between them that is missing.
        suggestion: Option<String>,
    },
    /// The unit cannot be read.
    Unreadable {
        /// From where on, as written.
        rest: String,
    },
    /// An exponent is missing or too large.
    Exponent {
        /// The unit to which it belongs.
        unit: String,
    },
    /// A product follows a division.
    Ambiguous {
        /// The unit as written.
        unit: String,
    },
    /// The unit is one of another kind of quantity.
    WrongDimension {
        /// The number as written.
        number: String,
        /// The unit as written.
        unit: String,
        /// What it is.
        found: Dimension,
        /// What was wanted.
        wanted: Dimension,
    },
    /// The quantity in SI units is larger than a floating-point number can be.
    OutOfRange {
        /// The text.
        text: String,
    },
}

impl UnitError {
    /// What is wrong.
    pub fn problem(&self) -> String {
        match self {
            Self::NoNumber { text, .. } => format!("\"{text}\" does not begin with a number"),
            Self::Comma { text } => format!("\"{text}\" has a comma in its number"),
            Self::NoUnit { number, .. } => format!("{number} has no unit"),
            Self::UnknownUnit { unit, .. } => format!("there is no unit \"{unit}\""),
            Self::Unreadable { rest } => format!("\"{rest}\" cannot be read as a unit"),
            Self::Exponent { unit } => {
                format!("the exponent of \"{unit}\" is not a whole number from 1 to 9")
            }
            Self::Ambiguous { unit } => format!("\"{unit}\" can be read in two ways"),
            Self::WrongDimension { number, unit, found, wanted } => {
                format!("{} is {found}, not {wanted}", format!("{number} {unit}").trim_end())
            }
            Self::OutOfRange { text } => format!("\"{text}\" is too large to compute with"),
        }
    }

    /// What to write instead.
    pub fn remedy(&self) -> String {
        match self {
            Self::NoNumber { wanted, .. } => format!("write {}", examples("1", *wanted)),
            Self::Comma { .. } => "write a decimal point, and nothing between thousands".to_owned(),
            Self::NoUnit { number, wanted } | Self::WrongDimension { number, wanted, .. } => {
                format!("write {}", examples(number, *wanted))
            }
            Self::UnknownUnit { suggestion: Some(unit), .. } => format!("did you mean \"{unit}\"?"),
            Self::UnknownUnit { suggestion: None, .. } => {
                let units: Vec<&str> = UNITS.iter().map(|unit| unit.name).collect();
                format!("write a unit made of {}, with a prefix if need be", units.join(", "))
            }
            Self::Unreadable { .. } => "write a unit such as \"Pa s\", \"kg/m3\", \"l/s\"".to_owned(),
            Self::Exponent { .. } => "write it such as \"m3\" or \"s^-2\"".to_owned(),
            Self::Ambiguous { .. } => "write products first, then divisions, such as \"kg/m/s\"".to_owned(),
            Self::OutOfRange { .. } => "write a smaller quantity".to_owned(),
        }
    }
}

/// `"50 m" or "50 mm"`.
fn examples(number: &str, dimension: Dimension) -> String {
    either(dimension.units().iter().map(|unit| format!("\"{}\"", format!("{number} {unit}").trim_end())))
}

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.problem(), self.remedy())
    }
}

impl std::error::Error for UnitError {}

/// Reads a quantity of the given dimension; the result is in SI units and finite.
pub fn parse(text: &str, wanted: Dimension) -> Result<f64, UnitError> {
    let text = text.trim();
    let (number, unit_text) = split_number(text);
    let value: f64 = number.parse().map_err(|_| UnitError::NoNumber { text: text.to_owned(), wanted })?;
    if unit_text.starts_with(',') {
        return Err(UnitError::Comma { text: text.to_owned() });
    }
    let unit_text = unit_text.trim_start();
    let unit = Unit::parse(unit_text)?;
    if unit.dimension != wanted {
        let number = number.to_owned();
        return Err(if unit_text.is_empty() {
            UnitError::NoUnit { number, wanted }
        } else {
            UnitError::WrongDimension { number, unit: unit_text.to_owned(), found: unit.dimension, wanted }
        });
    }
    let value = unit.to_si(value);
    if value.is_finite() { Ok(value) } else { Err(UnitError::OutOfRange { text: text.to_owned() }) }
}

/// Splits off the longest beginning that is a number: sign, digits with a point among them, exponent.
fn split_number(text: &str) -> (&str, &str) {
    let digits = |from: usize| from + text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let sign = |from: usize| from + usize::from(text[from..].starts_with(['+', '-']));
    let mut end = digits(sign(0));
    if text[end..].starts_with('.') {
        end = digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let first = sign(end + 1);
        if digits(first) > first {
            end = digits(first);
        }
    }
    text.split_at(end)
}

/// A unit: `factor * 10^ten` SI units. The power of ten is kept apart so that `620 mm` is exactly 0.62 m.
#[derive(Debug, Clone, Copy)]
struct Unit {
    factor: f64,
    ten: i32,
    dimension: Dimension,
}

struct NamedUnit {
    name: &'static str,
    unit: Unit,
    prefixes: bool,
}

const fn unit(name: &'static str, factor: f64, ten: i32, dimension: Dimension, prefixes: bool) -> NamedUnit {
    NamedUnit { name, unit: Unit { factor, ten, dimension }, prefixes }
}

const UNITS: &[NamedUnit] = &[
    unit("m", 1.0, 0, Dimension::LENGTH, true),
    unit("s", 1.0, 0, Dimension::TIME, true),
    unit("g", 1.0, -3, Dimension::MASS, true),
    unit("t", 1.0, 3, Dimension::MASS, false),
    unit("Pa", 1.0, 0, Dimension::STRESS, true),
    unit("bar", 1.0, 5, Dimension::STRESS, true),
    unit("N", 1.0, 0, Dimension::FORCE, true),
    unit("J", 1.0, 0, Dimension([2, 1, -2, 0]), true),
    unit("W", 1.0, 0, Dimension([2, 1, -3, 0]), true),
    unit("l", 1.0, -3, Dimension::VOLUME, true),
    unit("L", 1.0, -3, Dimension::VOLUME, true),
    unit("min", 60.0, 0, Dimension::TIME, false),
    unit("h", 3600.0, 0, Dimension::TIME, false),
    unit("%", 1.0, -2, Dimension::NUMBER, false),
    unit("rad", 1.0, 0, Dimension::NUMBER, false),
    unit("deg", PI / 180.0, 0, Dimension::NUMBER, false),
    unit("°", PI / 180.0, 0, Dimension::NUMBER, false),
];

const PREFIXES: &[(char, i32)] = &[
    ('n', -9),
    ('u', -6),
    ('\u{b5}', -6),  // micro sign
    ('\u{3bc}', -6), // Greek mu
    ('m', -3),
    ('c', -2),
    ('d', -1),
    ('h', 2),
    ('k', 3),
    ('M', 6),
    ('G', 9),
];

const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const TIMES: [char; 4] = ['.', '*', '·', '⋅'];

impl Unit {
    const ONE: Self = Self { factor: 1.0, ten: 0, dimension: Dimension::NUMBER };

    /// Looks up a name, as it stands first (`min` is a minute), then as a prefix and a name.
    fn known(name: &str) -> Option<Self> {
        if let Some(found) = UNITS.iter().find(|unit| unit.name == name) {
            return Some(found.unit);
        }
        let mut rest = name.chars();
        let first = rest.next()?;
        let (_, ten) = PREFIXES.iter().find(|(prefix, _)| *prefix == first)?;
        let NamedUnit { unit, .. } = UNITS.iter().find(|unit| unit.prefixes && unit.name == rest.as_str())?;
        Some(Self { ten: unit.ten + ten, ..*unit })
    }

    fn named(name: &str) -> Result<Self, UnitError> {
        Self::known(name).ok_or_else(|| {
            let mut apart = name.char_indices().skip(1).map(|(at, _)| name.split_at(at));
            // `Pas` is a viscosity; `mins` would be nothing that has a name.
            let product = |(a, b): &(&str, &str)| Some(Self::known(a)?.times(Self::known(b)?).dimension);
            let named = |of| Dimension::NAMES.iter().any(|(dimension, ..)| *dimension == of);
            let apart = apart.find(|names| product(names).is_some_and(named));
            let common: Vec<&str> = UNITS.iter().map(|unit| unit.name).chain(["kg", "mm", "MPa"]).collect();
            let near = || nearest(name, &common).map(ToOwned::to_owned);
            let suggestion = apart.map(|(a, b)| format!("{a} {b}")).or_else(near);
            UnitError::UnknownUnit { unit: name.to_owned(), suggestion }
        })
    }

    fn power(self, exponent: i32) -> Self {
        Self {
            factor: self.factor.powi(exponent),
            ten: self.ten * exponent,
            dimension: Dimension(self.dimension.0.map(|power| power * exponent)),
        }
    }

    fn times(self, other: Self) -> Self {
        let mut dimension = self.dimension;
        for (power, more) in dimension.0.iter_mut().zip(other.dimension.0) {
            *power = power.saturating_add(more);
        }
        Self { factor: self.factor * other.factor, ten: self.ten.saturating_add(other.ten), dimension }
    }

    /// A value in this unit, in SI units. Division, because 0.001 is not a binary number but 1000 is.
    fn to_si(self, value: f64) -> f64 {
        let power = 10f64.powi(self.ten.unsigned_abs().min(999) as i32);
        self.factor * if self.ten < 0 { value / power } else { value * power }
    }

    fn parse(text: &str) -> Result<Self, UnitError> {
        let mut product = Self::ONE;
        let mut divided = false;
        let mut rest = text;
        while !rest.is_empty() {
            // An operator stands before every factor but the first, and may stand before that: `5 /s`.
            let trimmed = rest.trim_start();
            let (divide, after) = match trimmed.strip_prefix('/') {
                Some(after) => (true, after),
                None if rest.len() == text.len() => (false, trimmed),
                None => (false, trimmed.strip_prefix(TIMES).unwrap_or(trimmed)),
            };
            if divided && !divide {
                return Err(UnitError::Ambiguous { unit: text.to_owned() });
            }
            divided = divide;
            let after = after.trim_start();
            if after.is_empty() {
                return Err(UnitError::Unreadable { rest: text.to_owned() });
            }
            let (factor, left) = Self::parse_factor(after)?;
            product = product.times(factor.power(if divide { -1 } else { 1 }));
            rest = left;
        }
        Ok(product)
    }

    /// A name with its exponent, or `1`; and what is left.
    fn parse_factor(text: &str) -> Result<(Self, &str), UnitError> {
        if let Some(rest) = text.strip_prefix("s^n").or_else(|| text.strip_prefix("sⁿ")) {
            return Ok((Self { dimension: Dimension([0, 0, 0, 1]), ..Self::ONE }, rest));
        }
        let is_name = |c: char| c.is_alphabetic() || c == '%' || c == '°';
        let (name, rest) = text.split_at(text.find(|c| !is_name(c)).unwrap_or(text.len()));
        if name.is_empty() {
            return match text.strip_prefix('1') {
                Some(rest) if !rest.starts_with(|c: char| c.is_numeric()) => Ok((Self::ONE, rest)),
                _ => Err(UnitError::Unreadable { rest: text.to_owned() }),
            };
        }
        let unit = Self::named(name)?;
        let is_power = |c: char| "^+-⁻0123456789".contains(c) || SUPERSCRIPTS.contains(c);
        let (power, rest) = rest.split_at(rest.find(|c| !is_power(c)).unwrap_or(rest.len()));
        if power.is_empty() {
            return Ok((unit, rest));
        }
        let plain = |c: char| match SUPERSCRIPTS.chars().position(|s| s == c) {
            Some(digit) => char::from(b'0' + digit as u8),
            None if c == '⁻' => '-',
            None => c,
        };
        let power: String = power.strip_prefix('^').unwrap_or(power).chars().map(plain).collect();
        match power.parse::<i32>() {
            Ok(power) if (1..=9).contains(&power.abs()) => Ok((unit.power(power), rest)),
            _ => Err(UnitError::Exponent { unit: name.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quantities_as_people_write_them() {
        for (text, dimension, value) in [
            ("50 Pa", Dimension::STRESS, 50.0),
            ("50Pa", Dimension::STRESS, 50.0),
            ("30 Pa s", Dimension::VISCOSITY, 30.0),
            ("30 Pa.s", Dimension::VISCOSITY, 30.0),
            ("30Pa.s", Dimension::VISCOSITY, 30.0),
            ("30Pa*s", Dimension::VISCOSITY, 30.0),
            ("30 Pa·s", Dimension::VISCOSITY, 30.0),
            ("30 Pa * s", Dimension::VISCOSITY, 30.0),
            ("30 mPa s", Dimension::VISCOSITY, 0.03),
            ("30 N s/m2", Dimension::VISCOSITY, 30.0),
            ("30 kg/m/s", Dimension::VISCOSITY, 30.0),
            ("20 Pa s^n", Dimension::CONSISTENCY, 20.0),
            ("20 Pa.sⁿ", Dimension::CONSISTENCY, 20.0),
            ("620 mm", Dimension::LENGTH, 0.62),
            ("-1.5e-3 km", Dimension::LENGTH, -1.5),
            (" +.5 cm ", Dimension::LENGTH, 0.005),
            ("3 µm", Dimension::LENGTH, 3e-6),
            ("3 \u{3bc}m", Dimension::LENGTH, 3e-6),
            ("3 um", Dimension::LENGTH, 3e-6),
            ("2300 kg/m3", Dimension::DENSITY, 2300.0),
            ("2300 kg/m^3", Dimension::DENSITY, 2300.0),
            ("2300 kg/m³", Dimension::DENSITY, 2300.0),
            ("2300 kg m-3", Dimension::DENSITY, 2300.0),
            ("2300 kg m⁻³", Dimension::DENSITY, 2300.0),
            ("2.3 t/m3", Dimension::DENSITY, 2300.0),
            ("2.3 g/cm3", Dimension::DENSITY, 2300.0),
            ("2.3 kg/l", Dimension::DENSITY, 2300.0),
            ("0.5 l/s", Dimension::FLOW_RATE, 0.0005),
            ("30 L/min", Dimension::FLOW_RATE, 0.0005),
            ("-9.81 m/s2", Dimension::ACCELERATION, -9.81),
            ("-9.81 m/s/s", Dimension::ACCELERATION, -9.81),
            ("5 1/s", Dimension::RATE, 5.0),
            ("5 /s", Dimension::RATE, 5.0),
            ("5 s^-1", Dimension::RATE, 5.0),
            ("2 min", Dimension::TIME, 120.0),
            ("2 h", Dimension::TIME, 7200.0),
            ("0.2 ms", Dimension::TIME, 0.0002),
            ("3 bar", Dimension::STRESS, 3e5),
            ("3 hPa", Dimension::STRESS, 300.0),
            ("3 J/m3", Dimension::STRESS, 3.0),
            ("3 kN", Dimension::FORCE, 3000.0),
            ("3 W s/m", Dimension::FORCE, 3.0),
            ("2 %", Dimension::NUMBER, 0.02),
            ("180 deg", Dimension::NUMBER, PI),
            ("180°", Dimension::NUMBER, PI),
            ("0.1", Dimension::NUMBER, 0.1),
            ("0.1 1", Dimension::NUMBER, 0.1),
        ] {
            let error = |error| panic!("{text}: {error}");
            let read = parse(text, dimension).unwrap_or_else(error);
            assert!((read - value).abs() <= f64::EPSILON * value.abs(), "{text}: {read}");
        }
    }

    #[test]
    fn refusals_say_what_to_write() {
        for (text, dimension, says) in [
            ("50", Dimension::STRESS, "50 has no unit: write \"50 Pa\""),
            ("5", Dimension::LENGTH, "5 has no unit: write \"5 m\" or \"5 mm\""),
            ("50 pa", Dimension::STRESS, "there is no unit \"pa\": did you mean \"Pa\"?"),
            ("20 Pas", Dimension::VISCOSITY, "there is no unit \"Pas\": did you mean \"Pa s\"?"),
            ("3 kNm", Dimension::TORQUE, "there is no unit \"kNm\": did you mean \"kN m\"?"),
            ("2 mins", Dimension::TIME, "there is no unit \"mins\": did you mean \"min\"?"),
            ("50 psi", Dimension::STRESS, "there is no unit \"psi\": write a unit made of m, s, g,"),
            ("50 m", Dimension::STRESS, "50 m is a length, not a stress: write \"50 Pa\""),
            ("50 m", Dimension::NUMBER, "50 m is a length, not a plain number: write \"50\""),
            ("5 J/s3", Dimension::STRESS, "5 J/s3 is a quantity in m2 kg s-5, not a stress"),
            ("0,5 l/s", Dimension::FLOW_RATE, "has a comma in its number: write a decimal point"),
            (
                "20 Pa s",
                Dimension::CONSISTENCY,
                "20 Pa s is a viscosity, not a consistency: write \"20 Pa s^n\"",
            ),
            ("20 Pa s^n", Dimension::VISCOSITY, "20 Pa s^n is a consistency, not a viscosity"),
            ("fast", Dimension::SPEED, "\"fast\" does not begin with a number: write \"1 m/s\""),
            ("", Dimension::TIME, "does not begin with a number"),
            ("nan s", Dimension::TIME, "does not begin with a number"),
            ("inf", Dimension::NUMBER, "does not begin with a number"),
            ("1e999 s", Dimension::TIME, "\"1e999 s\" is too large to compute with"),
            ("1e308 km", Dimension::LENGTH, "is too large to compute with"),
            ("30 kg/m s", Dimension::VISCOSITY, "\"kg/m s\" can be read in two ways"),
            ("30 kg/m*s", Dimension::VISCOSITY, "\"kg/m*s\" can be read in two ways"),
            ("30 Pa.", Dimension::STRESS, "\"Pa.\" cannot be read as a unit"),
            ("30 Pa//s", Dimension::STRESS, "\"/s\" cannot be read as a unit"),
            ("30 Pa 2", Dimension::STRESS, "\"2\" cannot be read as a unit"),
            ("30 (Pa)", Dimension::STRESS, "\"(Pa)\" cannot be read as a unit"),
            ("3 m^", Dimension::LENGTH, "the exponent of \"m\" is not a whole number from 1 to 9"),
            ("3 m0", Dimension::NUMBER, "the exponent of \"m\""),
            ("3 m99", Dimension::LENGTH, "the exponent of \"m\""),
            ("3 m2^2", Dimension::LENGTH, "the exponent of \"m\""),
        ] {
            let error = parse(text, dimension).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    proptest! {
        #[test]
        fn si_units_change_nothing(value in proptest::num::f64::NORMAL) {
            for (dimension, _, units) in Dimension::NAMES {
                // Only the first is the SI unit, and the flow rate is given in litres.
                if *dimension != Dimension::FLOW_RATE {
                    prop_assert_eq!(parse(&format!("{value:e} {}", units[0]), *dimension), Ok(value));
                }
            }
        }

        #[test]
        fn prefixed_units_return_to_the_same_number(value in -1e6..1e6f64) {
            for (prefix, ten) in PREFIXES {
                let read = parse(&format!("{value} {prefix}m"), Dimension::LENGTH).unwrap();
                prop_assert!((read * 10f64.powi(-ten) - value).abs() <= 4.0 * f64::EPSILON * value.abs());
            }
        }

        #[test]
        fn unit_products_and_quotients_cancel(number in 0..UNITS.len(), power in 1..9) {
            let name = UNITS[number].name;
            let read = parse(&format!("7 {name}{power}/{name}^{power}"), Dimension::NUMBER).unwrap();
            prop_assert!((read - 7.0).abs() < 1e-13);
        }
    }
}
