//! The cone of EN 12350-2 and -8, removed at once.

use std::cell::Cell;

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_case::Method;
use tremie_lbm::Plan;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;

use super::benchmark::{Check, Context, shown};
use super::flow::{Flow, cell_at, centres};
use super::report;

/// Yield stress in Pa and plastic viscosity in Pa s of the mixes; the longest run first.
const MIXES: [(f64, f64); 4] = [(20.0, 50.0), (50.0, 50.0), (50.0, 30.0), (100.0, 50.0)];

/// Volume in m3 of the cone of EN 12350-2.
const CONE_VOLUME: f64 = std::f64::consts::PI / 12.0 * 0.3 * (0.2 * 0.2 + 0.2 * 0.1 + 0.1 * 0.1);

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

/// Cells in m of the runs of the cone that spreads for ever; the longer run first.
const CURRENT_CELLS: [f64; 2] = [0.0075, 0.010];

/// A Newtonian cone that spreads for ever.
pub(super) fn gravity_current(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs: anyhow::Result<Vec<Vec<Check>>> =
        CURRENT_CELLS.par_iter().with_max_len(1).map(|size| current(context, *size)).collect();
    Ok(runs?.concat())
}

fn current(context: &Context, cell_size: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let Method::Lbm(lbm) = &mut case.method;
    lbm.cell_size = cell_size;
    let viscosity = case.material.curve.plastic_viscosity() / case.material.density;
    let mut flow = Flow::new(case);
    let mut checks = Vec::new();
    for time in [4.0, 8.0, 12.0] {
        flow.until(time)?;
        let spread = flow.readings().spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
        let huppert = 2.0 * 0.894 * (9.81 * CONE_VOLUME.powi(3) / (3.0 * viscosity) * time).powf(0.125);
        let axes = 0.5 * (spread.x + spread.y);
        let what = |quantity: &str| format!("{quantity} at {time} s, {} mm", cell_size * 1e3);
        checks.push(context.relative("spread", what("spread"), "m", huppert, spread.mean)?);
        checks.push(context.relative("round", what("axes against diagonal"), "m", spread.diagonal, axes)?);
    }
    Ok(checks)
}

/// Hydrostatic density errors of the two runs of the cone that cannot flow; the first is the default, and judged.
const DENSITY_ERRORS: [f64; 2] = [0.02, 0.001];

/// A cone too stiff to flow.
///
/// Below its yield stress the lattice is an elastic body: it settles under its weight by a share of the hydrostatic density
/// error. A second run at a small one shows whether the shape changes in proportion to it.
pub(super) fn cone_rigid(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs: anyhow::Result<Vec<RigidCone>> =
        DENSITY_ERRORS.par_iter().with_max_len(1).map(|error| rigid_cone(context, *error)).collect();
    let [coarse, fine] = &runs?[..] else { anyhow::bail!("there are two runs") };
    let order = (coarse.shape / fine.shape).ln() / (coarse.density_error / fine.density_error).ln();
    let mut checks = vec![
        context.relative("shape", "spread", "m", coarse.first.0, coarse.last.0)?,
        context.relative("shape", "height", "m", coarse.first.1, coarse.last.1)?,
        context.relative("shape", "volume", "m3", coarse.first.2, coarse.last.2)?,
        context.zero("shape", "shape (L1 of the fill)", "", coarse.shape)?,
        shown("shape, small density error", fine.shape),
        context.at_least("order", "order of the shape's change in the density error", order)?,
    ];
    for (name, run) in [("default", coarse), ("small", fine)] {
        let what = |quantity: &str| format!("{quantity}, {name} density error");
        checks.push(context.zero("speed", what("99 % of the speeds at 10 s"), "m/s", run.speeds[3])?);
        let decay = [run.speeds[1] / run.speeds[2], run.speeds[2] / run.speeds[3]];
        checks.push(context.at_least("decay", what("speed at 4 s over that at 7 s"), decay[0])?);
        checks.push(context.at_least("decay", what("speed at 7 s over that at 10 s"), decay[1])?);
    }
    Ok(checks)
}

/// What became of a cone that cannot flow.
struct RigidCone {
    /// Hydrostatic density error that the time step gives; less than allowed where the speed sets the step.
    density_error: f64,
    /// Spread in m, height in m and volume in m3 at the start and at the end.
    first: (f64, f64, f64),
    last: (f64, f64, f64),
    /// Sum of the changes of the fill over the volume.
    shape: f64,
    /// 99th percentile of the speed in m/s at 1, 4, 7 and 10 s.
    speeds: Vec<f64>,
}

fn rigid_cone(context: &Context, allowed: f64) -> anyhow::Result<RigidCone> {
    let mut case = context.case("case.toml")?;
    let Method::Lbm(lbm) = &mut case.method;
    lbm.hydrostatic_error = allowed;
    let density_error = Plan::new(&case).hydrostatic_error;
    let mut flow = Flow::new(case);
    let measures = |flow: &Flow| {
        let now = flow.readings();
        let spread = now.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
        anyhow::Ok((spread.mean, spread.height, now.volume))
    };
    let (start, first) = (flow.cells(), measures(&flow)?);
    let mut speeds = Vec::new();
    for time in [1.0, 4.0, 7.0, 10.0] {
        flow.until(time)?;
        speeds.push(flow.readings().speed_p99);
    }
    let shape = fill_difference(&start, &flow.cells());
    Ok(RigidCone { density_error, first, last: measures(&flow)?, shape, speeds })
}

/// Sum of the differences between the fills of two snapshots, as a share of the volume.
fn fill_difference(a: &Cells, b: &Cells) -> f64 {
    let fill = |cells: &Cells, place| cell_at(cells, place).map_or(0.0, |n| cells.fill[n]);
    let sum: f64 = centres(a).map(|place| (fill(a, place) - fill(b, place)).abs()).sum();
    sum / a.fill.iter().sum::<f64>()
}
