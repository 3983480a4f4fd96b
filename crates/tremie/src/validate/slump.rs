//! The cone of EN 12350-2 and -8, removed at once.

use std::cell::Cell;

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;

use super::benchmark::{Check, Context, shown};
use super::flow::{Flow, cell_at, centres};
use super::report;

/// Yield stress in Pa and plastic viscosity in Pa s of the mixes; the longest run first.
const MIXES: [(f64, f64); 4] = [(20.0, 50.0), (50.0, 50.0), (50.0, 30.0), (100.0, 50.0)];

/// Simulated time in s between two signs of life.
const PROGRESS: f64 = 5.0;

/// Spread and height at rest of four mixes.
pub(super) fn slump_spread(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs: anyhow::Result<Vec<Vec<Check>>> =
        MIXES.par_iter().with_max_len(1).map(|(tau, mu)| spread(context, *tau, *mu)).collect();
    Ok(runs?.concat())
}

fn spread(context: &Context, yield_stress: f64, plastic_viscosity: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    case.material.curve = FlowCurve::Bingham { yield_stress, plastic_viscosity };
    let density = case.material.density;
    let rows = context.reference()?;
    let row = rows
        .iter()
        .find(|row| row["rho_kg_m3"] == density && row["tau0_Pa"] == yield_stress)
        .ok_or_else(|| anyhow!("reference.csv has no row for {density} kg/m3 and {yield_stress} Pa"))?;
    let what = |quantity: &str| format!("{quantity}, {yield_stress} Pa, {plastic_viscosity} Pa s");
    let next = Cell::new(0.0);
    let readings = Flow::new(case).until_rest(|now| {
        if now.time >= next.get() {
            next.set(next.get() + PROGRESS);
            report::progress(&format!("{}: {:.1} s", what("slump"), now.time));
        }
    })?;
    let spread = readings.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
    let axes = 0.5 * (spread.x + spread.y);
    Ok(vec![
        context.relative("spread", what("spread"), "m", row["D_corr_m"], spread.mean)?,
        context.relative("height", what("height"), "m", row["h0_corr_m"], spread.height)?,
        context.relative("round", what("axes against diagonal"), "m", spread.diagonal, axes)?,
    ])
}

/// A cone too stiff to flow.
pub(super) fn cone_rigid(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut flow = Flow::new(context.case("case.toml")?);
    let (start, first) = (flow.cells(), flow.readings());
    let mut speeds = Vec::new();
    for time in [1.0, 4.0, 7.0, 10.0] {
        flow.until(time)?;
        speeds.push(flow.readings().speed_p99);
    }
    let (end, last) = (flow.cells(), flow.readings());
    let (Some(first_spread), Some(last_spread)) = (first.spread, last.spread) else {
        anyhow::bail!("the case has no spread gauge");
    };
    Ok(vec![
        context.relative("shape", "spread", "m", first_spread.mean, last_spread.mean)?,
        context.relative("shape", "height", "m", first_spread.height, last_spread.height)?,
        context.relative("shape", "volume", "m3", first.volume, last.volume)?,
        context.zero("shape", "shape (L1 of the fill)", "", fill_difference(&start, &end))?,
        context.zero("speed", "99 % of the speeds at 10 s", "m/s", speeds[3])?,
        context.at_least("decay", "speed at 4 s over that at 7 s", speeds[1] / speeds[2])?,
        context.at_least("decay", "speed at 7 s over that at 10 s", speeds[2] / speeds[3])?,
        shown("99 % of the speeds at 1 s, in m/s", speeds[0]),
        shown("99 % of the speeds at 4 s, in m/s", speeds[1]),
    ])
}

/// Sum of the differences between the fills of two snapshots, as a share of the volume.
fn fill_difference(a: &Cells, b: &Cells) -> f64 {
    let fill = |cells: &Cells, place| cell_at(cells, place).map_or(0.0, |n| cells.fill[n]);
    let sum: f64 = centres(a).map(|place| (fill(a, place) - fill(b, place)).abs()).sum();
    sum / a.fill.iter().sum::<f64>()
}
