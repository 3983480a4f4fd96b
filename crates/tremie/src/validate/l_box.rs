//! L-boxes at rest, against the balance of weight and friction in a channel.

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_rheology::FlowCurve;

use super::benchmark::{Check, Context};
use super::collapse::between;
use super::flow::Flow;

/// Yield stresses in Pa.
const YIELD_STRESSES: [f64; 3] = [20.0, 30.0, 50.0];

/// A box without bars and with a slow gate.
pub(super) fn l_box_rest(context: &Context) -> anyhow::Result<Vec<Check>> {
    let all = YIELD_STRESSES.par_iter().with_max_len(1);
    let checks: anyhow::Result<Vec<Vec<Check>>> = all.map(|tau0| at_rest(context, *tau0)).collect();
    Ok(checks?.concat())
}

/// The levels at a yield stress in Pa, and their ratio.
fn at_rest(context: &Context, yield_stress: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    case.material.curve =
        FlowCurve::Bingham { yield_stress, plastic_viscosity: case.material.curve.plastic_viscosity() };
    let readings = Flow::new(case).until_rest(|_| {})?;
    let level = |name: &str| readings.level(name).ok_or_else(|| anyhow!("the case has no level {name}"));
    let (h1, h2) = (level("H1")?, level("H2")?);
    let rows = context.reference()?;
    let reference = |column: &str| {
        let points: Vec<[f64; 2]> = rows.iter().map(|row| [row["tau0_Pa_at_rho2300"], row[column]]).collect();
        between(&points, yield_stress).ok_or_else(|| anyhow!("reference.csv has no {yield_stress} Pa"))
    };
    let tolerance = format!("{yield_stress} Pa");
    [("H2/H1", "", "PL_h2_over_h1", h2 / h1), ("H1", "m", "h1_m", h1), ("H2", "m", "h2_m", h2)]
        .into_iter()
        .map(|(what, unit, column, value)| {
            context.relative(&tolerance, format!("{what}, {tolerance}"), unit, reference(column)?, value)
        })
        .collect()
}
