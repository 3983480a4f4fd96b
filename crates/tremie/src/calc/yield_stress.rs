//! The yield stress from what a test has measured.

use clap::Args;

use super::answer::{Answer, KG_PER_M3, MM, ONE, PA, quantity, warnings};
use super::channel_at_rest::{self, LBox, LcpcBox};
use super::slump::{self, Criterion};
use super::spread;
use crate::failure::WrongInput;
use crate::lab::{CONE, CONE_VOLUME, GRAVITY, ThinSheet};
use crate::numbers::significant;
use crate::quantities::{density, length, number};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc yield-stress --slump-flow 600mm
  tremie calc yield-stress --slump 120mm --density 2400kg/m3
  tremie calc yield-stress --lcpc-box 700mm
  tremie calc yield-stress --l-box 0.8")]
pub(super) struct Arguments {
    #[command(flatten)]
    test: Test,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Test {
    /// Slump flow of the cone of EN 12350-8
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    slump_flow: Option<f64>,
    /// Slump of the cone of EN 12350-2
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    slump: Option<f64>,
    /// Length over which 6 l have spread in the LCPC box
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    lcpc_box: Option<f64>,
    /// H2/H1 in the L-box without bars (EN 12350-10; the 700 mm count from the back of the column)
    #[arg(long, value_name = "RATIO", value_parser = number)]
    l_box: Option<f64>,
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let density = arguments.density;
    match arguments.test {
        Test { slump_flow: Some(spread), .. } => of_slump_flow(spread, density),
        Test { slump: Some(slump), .. } => of_slump(slump, density),
        Test { lcpc_box: Some(length), .. } => of_lcpc_box(length, density),
        Test { l_box: Some(ratio), .. } => of_l_box(ratio, density),
        _ => Err(WrongInput(
            "give what a test has measured: --slump-flow, --slump, --lcpc-box or --l-box".to_owned(),
        )),
    }
}

const SLUMP_FLOW_VALIDITY: &[&str] = &[
    spread::SPREADING_VALIDITY[0],
    spread::SPREADING_VALIDITY[1],
    "A rheometer may well tell half or twice as much",
];

fn of_slump_flow(spread: f64, density: f64) -> Result<Answer, WrongInput> {
    if spread <= CONE[0] {
        return Err(WrongInput(
            "a slump flow is more than the 200 mm of the cone's base; give a larger --slump-flow".to_owned(),
        ));
    }
    let radius = 0.5 * spread;
    let yield_stress = ThinSheet::yield_stress(CONE_VOLUME, radius, density, GRAVITY);
    let height = ThinSheet::new(CONE_VOLUME, yield_stress, density, GRAVITY).height(0.0);
    Ok(Answer {
        title: "Yield stress from the slump flow",
        inputs: vec![
            quantity("slump flow", "slump_flow_m", spread, MM),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
        ],
        results: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("height in the middle", "height_m", height, MM),
        ],
        equation: spread::SPREADING,
        source: spread::SPREADING_SOURCE,
        validity: SLUMP_FLOW_VALIDITY,
        warnings: spread::thickness_warnings(height / radius, height > CONE[2]),
    })
}

fn of_slump(slump: f64, density: f64) -> Result<Answer, WrongInput> {
    if slump >= CONE[2] {
        return Err(WrongInput(
            "a slump is less than the 300 mm of the cone; give a smaller --slump".to_owned(),
        ));
    }
    let [tresca, von_mises] = [Criterion::Tresca, Criterion::VonMises].map(|criterion| {
        density * GRAVITY * CONE[2] * slump::dimensionless_yield_stress(slump / CONE[2], criterion)
    });
    let mm = 1e3 * slump;
    let mut results = vec![
        quantity("theory, Tresca", "tresca_Pa", tresca, PA),
        quantity("theory, von Mises", "von_mises_Pa", von_mises, PA),
        quantity("Ferraris and de Larrard", "ferraris_de_larrard_Pa", slump::ferraris(density, mm), PA),
        quantity("Hu", "hu_Pa", slump::hu(density, mm), PA),
    ];
    if (50.0..=250.0).contains(&mm) {
        results.push(quantity("Roussel", "roussel_Pa", slump::roussel(density, mm), PA));
    }
    Ok(Answer {
        title: "Yield stress from the slump",
        inputs: vec![
            quantity("slump", "slump_m", slump, MM),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
        ],
        results,
        equation: &[
            "theory: as `tremie calc slump`, solved for the yield stress",
            "Ferraris and de Larrard: tau0 = rho (300 - s) / 347 + 212",
            "Hu: tau0 = rho (300 - s) / 270,  Roussel: tau0 = rho (255 - s) / 176",
            "tau0 in Pa, rho in kg/m3, slump s in mm",
        ],
        source: "Schowalter and Christensen 1998; Ferraris and de Larrard 1998; Hu and others 1996; Roussel 2006 (from memory)",
        validity: &[
            "theory: slumps up to 195 mm that are even; Roussel: 50 mm to 250 mm;",
            "Ferraris and Hu: fits to one rheometer and to finite elements. They differ by a factor of two to three:",
            "so uncertain is a yield stress from a slump",
        ],
        warnings: warnings([
            (
                slump > slump::LARGEST_SLUMP * CONE[2],
                "a slump above 195 mm: friction on the base counts, theory is too low; better give --slump-flow"
                    .to_owned(),
            ),
            (
                mm < 100.0,
                "concrete of so small a slump often shears off or crumbles, and then tells little of its yield stress"
                    .to_owned(),
            ),
        ]),
    })
}

fn of_lcpc_box(length: f64, density: f64) -> Result<Answer, WrongInput> {
    let geometry = LcpcBox::STANDARD;
    let yield_stress = geometry.yield_stress(length, density);
    let state = geometry.at_rest(yield_stress, density);
    Ok(Answer {
        title: "Yield stress from the LCPC box",
        inputs: vec![
            quantity("spread", "spread_m", length, MM),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
        ],
        results: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("height at the back", "height_m", state.height, MM),
        ],
        equation: channel_at_rest::LCPC_EQUATION,
        source: channel_at_rest::LCPC_SOURCE,
        validity: channel_at_rest::LCPC_VALIDITY,
        warnings: geometry.warnings(&state),
    })
}

fn of_l_box(ratio: f64, density: f64) -> Result<Answer, WrongInput> {
    if ratio >= 1.0 {
        return Err(WrongInput(format!(
            "H2/H1 is {}, but below 1 for any yield stress; give a smaller --l-box",
            significant(ratio)
        )));
    }
    let geometry = LBox::STANDARD;
    let yield_stress = geometry.yield_stress(ratio, density);
    let other = LBox::LONGER.yield_stress(ratio, density);
    Ok(Answer {
        title: "Yield stress from the L-box without bars",
        inputs: vec![
            quantity("H2/H1", "ratio", ratio, ONE),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
        ],
        results: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("if the 700 mm start at the gate", "yield_stress_longer_Pa", other, PA),
        ],
        equation: channel_at_rest::L_BOX_EQUATION,
        source: channel_at_rest::L_BOX_SOURCE,
        validity: channel_at_rest::L_BOX_VALIDITY,
        warnings: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_test_can_have_measured_is_refused() {
        assert!(of_slump_flow(0.2, 2300.0).is_err() && of_slump_flow(0.21, 2300.0).is_ok());
        assert!(of_slump(0.3, 2300.0).is_err() && of_slump(0.29, 2300.0).is_ok());
        assert!(of_l_box(1.0, 2300.0).is_err() && of_l_box(0.99, 2300.0).is_ok());
    }
}
