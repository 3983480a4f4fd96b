//! Flow through a round pipe, against the closed form of Buckingham (1921) and Reiner (1926).

use anyhow::bail;
use rayon::prelude::*;
use tremie_rheology::FlowCurve;

use super::benchmark::{Check, Context, Row, observed_order, shown};
use super::flow::{Flow, lattice};

/// Cells across the pipe; those that are judged are `JUDGED`.
const CELLS: [usize; 3] = [12, 24, 48];
const JUDGED: usize = 24;
/// Change of the velocities over a diffusion time, as a share of the largest, from which on the flow is steady. The plug, which is elastic,
/// goes on ringing by a tenth of that.
const STEADY: f64 = 1e-3;
/// Cells along the pipe, in which nothing changes.
const ALONG: f64 = 8.0;

/// Flow rates of a Bingham fluid at three plugs and three resolutions.
pub(super) fn pipe_bingham(context: &Context) -> anyhow::Result<Vec<Check>> {
    let rows = context.reference()?;
    let runs: Vec<(&Row, usize)> =
        rows.iter().flat_map(|row| CELLS.iter().rev().map(move |cells| (row, *cells))).collect();
    let checks: anyhow::Result<Vec<Check>> =
        runs.par_iter().with_max_len(1).map(|(row, cells)| pipe(context, row, *cells)).collect();
    let mut checks = checks?;
    for (row, checks_of) in rows.iter().zip(checks.clone().chunks(CELLS.len())) {
        let errors: Vec<f64> = checks_of.iter().rev().map(|check| check.error).collect();
        let name = format!("order of the flow rate from 12 to 48 cells, plug {}", row["phi"]);
        checks.push(shown(name, observed_order(&CELLS, &errors)));
    }
    Ok(checks)
}

/// The flow rate through a pipe of so many cells across.
fn pipe(context: &Context, row: &Row, cells: usize) -> anyhow::Result<Check> {
    let mut case = context.case("case.toml")?;
    let [wall] = case.solids.as_slice() else { bail!("the case has not one solid") };
    // The axis goes through the corner.
    let radius = wall.body.signed_distance(case.domain.min);
    let size = 2.0 * radius / cells as f64;
    lattice(&mut case).cell_size = size;
    case.domain.max.x = case.domain.min.x + ALONG * size;
    let gradient = case.material.density * case.domain.gravity.x;
    let (phi, plastic_viscosity) = (row["phi"], case.material.curve.plastic_viscosity());
    case.material.curve =
        FlowCurve::Bingham { yield_stress: phi * 0.5 * gradient * radius, plastic_viscosity };
    let diffusion_time = radius * radius * case.material.density / plastic_viscosity;
    let steady = Flow::new(case).until_steady(diffusion_time, STEADY)?;
    // A quarter of the section, at the lower end.
    let [_, across, up] = steady.count;
    let section = (0..across * up).map(|n| steady.index(0, n % across, n / across));
    let quarter = section.map(|n| steady.fill[n] * steady.velocity[n].x).sum::<f64>() * size * size;
    let mean_speed = gradient * radius * radius / (plastic_viscosity * row["G_star"]);
    let exact = std::f64::consts::PI * radius * radius * mean_speed;
    let what = format!("flow rate, plug {phi}, {cells} cells");
    let check = context.relative("flow rate", what, "m3/s", exact, 4.0 * quarter)?;
    Ok(if cells == JUDGED { check } else { Check { tolerance: None, ..check } })
}
