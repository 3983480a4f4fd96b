//! A yield stress that grows at rest and is broken down by shear, against the closed forms of Roussel's model (2006).

use anyhow::{Context as _, bail};
use tremie_case::{Case, Side};
use tremie_rheology::{FlowCurve, Thixotropy};
use tremie_simulation::Cells;

use super::benchmark::{Check, Context};
use super::channel::{Poiseuille, column, gap, l2_error};
use super::flow::Flow;

/// When the tank is looked at, in s.
const RESTED: f64 = 10.0;
/// When the sheared fluid is looked at, in s: once the shear rate is even, on the way, and in its balance.
const SHEARED: [f64; 3] = [1.0, 3.0, 10.0];
/// When the channel is looked at, in s: on the way, and after its fluid should have stopped (at 48 s).
const STIFFENED: [f64; 2] = [12.0, 50.5];

/// The model, held here by its closed forms.
fn model(case: &Case) -> anyhow::Result<Thixotropy> {
    case.material.thixotropy.context("the fluid must be thixotropic")
}

/// A field's value that is furthest off `exact`, in cells that are at least half full.
fn furthest(cells: &Cells, values: &[f64], exact: f64) -> f64 {
    let full = values.iter().zip(&cells.fill).filter(|(_, fill)| **fill >= 0.5).map(|(value, _)| *value);
    full.fold(exact, |a, b| if (b - exact).abs() > (a - exact).abs() { b } else { a })
}

fn structure(cells: &Cells) -> anyhow::Result<&[f64]> {
    cells.structure.as_deref().context("the snapshot must have a structure")
}

/// A tank at rest, plane shear, and a channel that stiffens.
pub(super) fn thixotropy_box(context: &Context) -> anyhow::Result<Vec<Check>> {
    let shear = || rayon::join(|| couette(context), || stiffen(context));
    let (rest, (couette, stiffen)) = rayon::join(|| rest(context), shear);
    Ok([rest?, couette?, stiffen?].concat())
}

fn rest(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("rest.toml")?;
    let mut flow = Flow::new(case.clone());
    flow.until(RESTED)?;
    let cells = flow.cells();
    let exact = case.material.structure + RESTED / model(&case)?.build_up_time;
    let value = furthest(&cells, structure(&cells)?, exact);
    Ok(vec![context.relative("structure", "structure at rest, furthest off", "", exact, value)?])
}

fn couette(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("couette.toml")?;
    let (Thixotropy { build_up_time, breakdown }, curve) = (model(&case)?, case.material.curve);
    let Side::Wall { velocity, .. } = case.domain.sides[5] else { bail!("the upper side must be a wall") };
    let rate = velocity.x / gap(&case);
    let balance = 1.0 / (build_up_time * breakdown * rate);
    let mut flow = Flow::new(case.clone());
    let [first, later, steady] = SHEARED;
    flow.until(first)?;
    let cells = flow.cells();
    let begun = structure(&cells)?[0];
    flow.until(later)?;
    let cells = flow.cells();
    let exact = balance + (begun - balance) * (-breakdown * rate * (later - first)).exp();
    let on_the_way = furthest(&cells, structure(&cells)?, exact);
    flow.until(steady)?;
    let cells = flow.cells();
    let stress = (1.0 + balance) * curve.yield_stress() + curve.plastic_viscosity() * rate;
    let furthest = |values: &[f64], exact: f64| furthest(&cells, values, exact);
    Ok(vec![
        context.relative("structure", "structure as it breaks down, furthest off", "", exact, on_the_way)?,
        context.relative(
            "structure",
            "structure in steady shear, furthest off",
            "",
            balance,
            furthest(structure(&cells)?, balance),
        )?,
        context.relative(
            "stress",
            "stress in steady shear, furthest off",
            "Pa",
            stress,
            furthest(&cells.stress, stress),
        )?,
        context.relative(
            "shear rate",
            "shear rate in steady shear, furthest off",
            "1/s",
            rate,
            furthest(&cells.shear_rate, rate),
        )?,
    ])
}

fn stiffen(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("stiffen.toml")?;
    let [flows, stopped] = STIFFENED;
    let mut stiffer = case.clone();
    let grown = 1.0 + case.material.structure + flows / model(&case)?.build_up_time;
    stiffer.material.curve = FlowCurve::Bingham {
        yield_stress: grown * case.material.curve.yield_stress(),
        plastic_viscosity: case.material.curve.plastic_viscosity(),
    };
    let exact = Poiseuille::of(&stiffer);
    let mut flow = Flow::new(case);
    let fastest = |cells: &Cells| cells.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
    flow.until(flows)?;
    let on_the_way = flow.cells();
    flow.until(stopped)?;
    let creeps = fastest(&flow.cells()) / fastest(&on_the_way);
    Ok(vec![
        context.zero(
            "velocity",
            "velocity in a channel that stiffens (L2)",
            "",
            l2_error(&column(&on_the_way), |z| exact.at(z)),
        )?,
        context.zero("stopped", "speed once it is too stiff, over that before", "", creeps)?,
    ])
}
