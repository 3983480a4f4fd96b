//! Fibres as a field, against the same fibres one by one.

use tremie_numerics::{DMat3, DVec3};
use tremie_simulation::{Cells, Fluid};
use tremie_suspension::orientation::{Block, Share};
use tremie_suspension::{Closure, Distribution, Inclusions};

use super::benchmark::{Check, Context, shown};
use super::flow::Flow;

/// Time in s between two looks.
const LOOK: f64 = 0.25;

/// Largest difference in any component.
fn distance(a: &DMat3, b: &DMat3) -> f64 {
    (*a - *b).to_cols_array().into_iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// The middle half of the gap.
fn middle(cells: &Cells) -> [f64; 2] {
    let [low, high] = cells.domain.map(|at| at.z);
    [0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high]
}

/// Mean tensor of the field there.
fn of_field(cells: &Cells) -> anyhow::Result<DMat3> {
    let field =
        cells.lying.as_ref().ok_or_else(|| anyhow::anyhow!("the case must have a field of fibres"))?;
    let [low, high] = middle(cells);
    let (mut sum, mut number) = (DMat3::ZERO, 0.0);
    for n in 0..cells.fill.len() {
        let z = cells.origin.z + cells.size * ((n / (cells.count[0] * cells.count[1])) as f64 + 0.5);
        if (low..high).contains(&z) {
            sum += field.tensor(n);
            number += 1.0;
        }
    }
    Ok(sum * f64::recip(number))
}

/// That of the fibres with their centres there.
fn of_fibres(cells: &Cells, bodies: &Inclusions) -> anyhow::Result<DMat3> {
    let [low, high] = middle(cells);
    let mut share = Share::NONE;
    for n in (0..bodies.len()).filter(|n| (low..high).contains(&bodies.position[*n].z)) {
        share.add(bodies, n, &Block::SPACE);
    }
    share.tensor().ok_or_else(|| anyhow::anyhow!("the case must have fibres"))
}

/// Shear rate in 1/s there.
fn shear_rate(cells: &Cells) -> f64 {
    let layer = |z: f64| {
        let k = ((z - cells.origin.z) / cells.size).floor() as usize;
        let cells_of = cells.count[0] * cells.count[1];
        let sum: f64 = (0..cells_of).map(|n| cells.velocity[n + k * cells_of].x).sum();
        (sum / cells_of as f64, cells.origin.z + (k as f64 + 0.5) * cells.size)
    };
    let [(low, below), (high, above)] = middle(cells).map(layer);
    (high - low) / (above - below)
}

/// The shear cell.
pub(super) fn folgar_tucker_shear(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let mut other = case.clone();
    other.groups.clear();
    other.inclusions = Inclusions::default();
    if let Some(field) = &mut other.fibre_field {
        field.law.closure = Closure::Hybrid;
    }
    let (mut flow, mut hybrid) = (Flow::new(case.clone()), Flow::new(other));
    let (mut strain, mut time) = (0.0, 0.0);
    let [mut each_other, mut field, mut fibres, mut older] = [0.0_f64; 4];
    let mut last = (DMat3::ZERO, DMat3::ZERO, DMat3::ZERO);
    while time < case.stop.time - 0.5 * LOOK {
        // The shear that the fluid has had, by the trapezoidal rule.
        for n in 1..=10 {
            let before = shear_rate(&flow.cells());
            let from = flow.simulation.time();
            flow.until(time + 0.1 * LOOK * f64::from(n))?;
            strain += 0.5 * (before + shear_rate(&flow.cells())) * (flow.simulation.time() - from);
        }
        time += LOOK;
        hybrid.until(time)?;
        let view = flow.simulation.snapshot();
        let Fluid::Cells(cells) = &view.fluid;
        let deformation = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(strain, 0.0, 1.0));
        let exact = Distribution::deformed(&deformation).tensor();
        let (a, b) = (of_field(cells)?, of_fibres(cells, &view.inclusions)?);
        each_other = each_other.max(distance(&a, &b));
        field = field.max(distance(&a, &exact));
        fibres = fibres.max(distance(&b, &exact));
        older = older.max(distance(&of_field(&hybrid.cells())?, &exact));
        last = (a, b, exact);
    }
    let mut checks = vec![
        context.zero("each_other", "field from fibres, largest in a_ij", "", each_other)?,
        context.zero("field", "field from the closed form", "", field)?,
        context.zero("fibres", "fibres from the closed form", "", fibres)?,
        shown("hybrid closure from the closed form", older),
        shown("shear at the end", strain),
    ];
    for (name, a) in [("field", last.0), ("fibres", last.1), ("closed form", last.2)] {
        checks.push(shown(format!("a_xx at the end, {name}"), a.x_axis.x));
        checks.push(shown(format!("a_xz at the end, {name}"), a.x_axis.z));
    }
    Ok(checks)
}
