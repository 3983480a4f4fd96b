//! LCPC boxes at rest, against the balance of weight and friction in a channel.

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_rheology::FlowCurve;

use super::benchmark::{Check, Context, Row};
use super::flow::Flow;

/// Yield stress in Pa up to which normal stresses, which the reference does not know, hardly count.
const JUDGED: f64 = 30.0;

/// Concrete that is poured slowly into a channel.
pub(super) fn lcpc_box(context: &Context) -> anyhow::Result<Vec<Check>> {
    let rows = context.reference()?;
    let checks: anyhow::Result<Vec<Vec<Check>>> =
        rows.par_iter().with_max_len(1).map(|row| at_rest(context, row)).collect();
    Ok(checks?.concat())
}

/// Spread and height at the yield stress of a row of the reference.
fn at_rest(context: &Context, row: &Row) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let yield_stress = row["tau0_Pa"];
    case.material.curve =
        FlowCurve::Bingham { yield_stress, plastic_viscosity: case.material.curve.plastic_viscosity() };
    let readings = Flow::new(case).until_rest(|_| {})?;
    let spread = readings.front("L").ok_or_else(|| anyhow!("the case has no front L"))?;
    let height = readings.level("h0").ok_or_else(|| anyhow!("the case has no level h0"))?;
    let what = |quantity: &str| format!("{quantity}, {yield_stress} Pa, at rest at {:.0} s", readings.time);
    let checks = [
        context.relative("spread", what("L"), "m", row["L_m"], spread)?,
        context.relative("height", what("h0"), "m", row["h0_m"], height)?,
    ];
    let judged = yield_stress <= JUDGED;
    Ok(checks.map(|check| if judged { check } else { Check { tolerance: None, ..check } }).into())
}
