//! Slump of the cone of EN 12350-2 from the yield stress, and back.
//!
//! In the slump regime each horizontal slice carries what lies above it and spreads freely until it just holds it. The
//! top, down to where the weight reaches the yield stress, keeps its shape; the rest flows. With heights over that of
//! the cone, whose base is twice as wide as its top, `h0` that of the top which keeps its shape, and `t = tau0 / (rho g
//! H)`:
//!
//! ```text
//!     t = ((1 + h0) - (1 + h0)^-2) / 6,    s = 1 - h0 - 2 t ln(7 / ((1 + h0)^3 - 1))
//! ```
//!
//! (J. Murata, Materials and Structures 17, 1984, 117-129, as corrected by W. R. Schowalter and G. Christensen, Journal
//! of Rheology 42, 1998, 865-870). A slice holds twice the yield stress by Tresca, as published, and sqrt(3) times by
//! von Mises, the criterion of flow simulations.

use clap::Args;
use tremie_numerics::root::turning_point;

use super::answer::{Answer, KG_PER_M3, MM, ONE, PA, quantity, warnings};
use crate::lab::{CONE, GRAVITY};
use crate::numbers::significant;
use crate::quantities::{density, stress};

/// Share of the height up to which the formula describes a slump.
pub(super) const LARGEST_SLUMP: f64 = 0.65;

/// How much pressure a slice holds, over what it holds by Tresca.
#[derive(Debug, Clone, Copy)]
pub(super) enum Criterion {
    Tresca,
    VonMises,
}

impl Criterion {
    fn strength(self) -> f64 {
        match self {
            Self::Tresca => 1.0,
            Self::VonMises => 0.5 * 3f64.sqrt(),
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc slump --yield-stress 800Pa
  tremie calc slump --yield-stress 1.2kPa --density 2400kg/m3")]
pub(super) struct Arguments {
    /// Yield stress
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    yield_stress: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
}

/// The equation, for people.
pub(super) const EQUATION: &[&str] = &[
    "t = ((1 + h0) - (1 + h0)^-2) / 6,  s = 1 - h0 - 2 t ln(7 / ((1 + h0)^3 - 1))",
    "t = tau0 / (rho g H) (von Mises: times sqrt(3)/2), s = slump / H, H = 300 mm, g = 9.81 m/s2;",
    "h0 height over H of the top that keeps its shape",
];
pub(super) const SOURCE: &str =
    "Murata 1984, as corrected by Schowalter and Christensen, J. Rheol. 42 (1998), 865";
pub(super) const VALIDITY: &[&str] = &[
    "slumps up to 195 mm: the base spreads without friction, which holds the less the flatter the concrete;",
    "an even slump: concrete below 100 mm or so often shears off or crumbles instead",
];

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Answer {
    let &Arguments { yield_stress, density } = arguments;
    let dimensionless = yield_stress / (density * GRAVITY * CONE[2]);
    let [tresca, von_mises] =
        [Criterion::Tresca, Criterion::VonMises].map(|criterion| slump(dimensionless, criterion));
    Answer {
        title: "Slump from the yield stress",
        inputs: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
        ],
        results: vec![
            quantity("slump, Tresca", "slump_tresca_m", CONE[2] * tresca, MM),
            quantity("slump, von Mises", "slump_von_mises_m", CONE[2] * von_mises, MM),
            quantity("tau0 / (rho g H)", "dimensionless_yield_stress", dimensionless, ONE),
        ],
        equation: EQUATION,
        source: SOURCE,
        validity: VALIDITY,
        warnings: warnings([
            (
                von_mises > LARGEST_SLUMP,
                format!(
                    "a slump of {} mm is above 195 mm, where friction on the base counts; see `tremie calc slump-flow`",
                    significant(1e3 * CONE[2] * von_mises)
                ),
            ),
            (
                CONE[2] * von_mises < 0.1,
                "concrete of so small a slump often shears off or crumbles instead of sinking evenly"
                    .to_owned(),
            ),
            (tresca == 0.0, "so stiff a concrete stands without any slump".to_owned()),
        ]),
    }
}

/// Weight over which the top of relative height `h0` > 0 stands: `tau0 / (rho g H)` by Tresca.
fn strength_of_top(h0: f64) -> f64 {
    removed(h0) / (6.0 * (1.0 + h0) * (1.0 + h0))
}

/// `(1 + h0)^3 - 1` without cancellation.
fn removed(h0: f64) -> f64 {
    h0 * (3.0 + 3.0 * h0 + h0 * h0)
}

/// Slump over height if the top of relative height `h0` in (0, 1] keeps its shape.
fn slump_of_top(h0: f64) -> f64 {
    1.0 - h0 - 2.0 * strength_of_top(h0) * (7f64.ln() - removed(h0).ln())
}

/// Slump over height, from `tau0 / (rho g H)`.
pub(super) fn slump(dimensionless: f64, criterion: Criterion) -> f64 {
    let strength = dimensionless * criterion.strength();
    if strength >= strength_of_top(1.0) {
        return 0.0;
    }
    slump_of_top(turning_point(1.0, |h0| strength_of_top(h0) < strength)).max(0.0)
}

/// `tau0 / (rho g H)` from the slump over height in (0, 1).
pub(super) fn dimensionless_yield_stress(slump: f64, criterion: Criterion) -> f64 {
    strength_of_top(turning_point(1.0, |h0| slump_of_top(h0) > slump)) / criterion.strength()
}

/// Yield stress in Pa from density in kg/m3 and slump in mm: C. Hu, F. de Larrard and O. E. Gjorv 1996, from finite
/// elements.
pub(super) fn hu(density: f64, slump: f64) -> f64 {
    density * (300.0 - slump) / 270.0
}

/// The same: C. F. Ferraris and F. de Larrard 1998, fitted to a rheometer with parallel plates (BTRHEOM).
pub(super) fn ferraris(density: f64, slump: f64) -> f64 {
    density * (300.0 - slump) / 347.0 + 212.0
}

/// The same: N. Roussel 2006, from simulations with slumps of 50 mm to 250 mm.
pub(super) fn roussel(density: f64, slump: f64) -> f64 {
    density * (255.0 - slump) / 176.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slumps_are_those_that_others_have_worked_out() {
        // tau0 / (rho g H), slump over height by Tresca and by von Mises.
        for (t, tresca, von_mises) in [
            (0.01, 0.885216, 0.898056),
            (0.05, 0.595343, 0.635868),
            (0.1, 0.351257, 0.408064),
            (0.2, 0.0737048, 0.12564),
            (0.29, 2.28824e-5, 0.0138847),
            (0.3, 0.0, 0.00853289),
            (0.34, 0.0, 0.0),
        ] {
            for (criterion, expected) in [(Criterion::Tresca, tresca), (Criterion::VonMises, von_mises)] {
                let found = slump(t, criterion);
                assert!((found - expected).abs() < 2e-6, "{t} {criterion:?}: {found}");
                if (0.01..0.9).contains(&expected) {
                    let back = dimensionless_yield_stress(expected, criterion);
                    assert!((back - t).abs() < 2e-5, "{t} {criterion:?}: {back}");
                }
            }
        }
    }

    #[test]
    fn correlations_are_as_published() {
        // Density in kg/m3, slump in mm; yield stresses in Pa.
        for (rho, slump, of_ferraris, of_hu, of_roussel) in
            [(2300.0, 100.0, 1537.65, 1703.7, 2025.57), (2400.0, 200.0, 903.643, 888.889, 750.0)]
        {
            assert!((ferraris(rho, slump) - of_ferraris).abs() < 0.01);
            assert!((hu(rho, slump) - of_hu).abs() < 0.01);
            assert!((roussel(rho, slump) - of_roussel).abs() < 0.01);
        }
    }

    #[test]
    fn fluids_without_strength_collapse_and_stiff_ones_stand() {
        for criterion in [Criterion::Tresca, Criterion::VonMises] {
            for t in [1e-300, 1e-30, 1e-9] {
                assert!((slump(t, criterion) - 1.0).abs() < 1e-6);
            }
            assert_eq!(slump(1e300, criterion), 0.0);
        }
    }
}
