//! Fibres as a field, against the same fibres one by one.

use tremie_numerics::{DMat3, DVec3};
use tremie_simulation::{Cells, Fluid};
use tremie_suspension::orientation::{Block, Share};
use tremie_suspension::{Closure, Direction, Distribution, Inclusions};

use super::benchmark::{Check, Context, shown};
use super::flow::Flow;

/// Time in s between two looks at the shear cell.
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

/// Mean tensor of the field in the fluid where its place lies within.
fn of_field(cells: &Cells, within: impl Fn(DVec3) -> bool) -> anyhow::Result<DMat3> {
    let field =
        cells.lying.as_ref().ok_or_else(|| anyhow::anyhow!("the case must have a field of fibres"))?;
    let (mut sum, mut fluid) = (DMat3::ZERO, 0.0);
    for n in 0..cells.fill.len() {
        let [nx, ny, _] = cells.count;
        let at = [n % nx, n / nx % ny, n / (nx * ny)].map(|i| i as f64 + 0.5);
        if within(cells.origin + cells.size * DVec3::from(at)) {
            sum += field.tensor(n) * cells.fill[n];
            fluid += cells.fill[n];
        }
    }
    Ok(sum * f64::recip(fluid))
}

/// That of the fibres with their centres there.
fn of_fibres(bodies: &Inclusions, within: impl Fn(DVec3) -> bool) -> anyhow::Result<DMat3> {
    let mut share = Share::NONE;
    for n in (0..bodies.len()).filter(|n| within(bodies.position[*n])) {
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
        let [low, high] = middle(cells);
        let within = |at: DVec3| (low..high).contains(&at.z);
        let (a, b) = (of_field(cells, within)?, of_fibres(&view.inclusions, within)?);
        each_other = each_other.max(distance(&a, &b));
        field = field.max(distance(&a, &exact));
        fibres = fibres.max(distance(&b, &exact));
        older = older.max(distance(&of_field(&hybrid.cells(), within)?, &exact));
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

/// The layer that a plate squeezes.
pub(super) fn squeezed_layer(context: &Context) -> anyhow::Result<Vec<Check>> {
    const LOOKS: u32 = 8;
    const ENDS: f64 = 0.2;
    let case = context.case("case.toml")?;
    let (Some(plate), Some(layer), Some(field)) =
        (case.solids.first(), case.fluid.first(), &case.fibre_field)
    else {
        anyhow::bail!("the case must have a plate, a layer, and a field of fibres");
    };
    let Direction::Aligned(direction) = field.direction else { anyhow::bail!("fibres must lie alike") };
    let (low, high) = layer.shape.bounds();
    let mut flow = Flow::new(case.clone());
    let (mut fibres, mut fields) = (0.0_f64, 0.0_f64);
    let mut last = [DMat3::ZERO; 3];
    let whole = plate.motion.offset(case.stop.time).x;
    for n in 1..=LOOKS {
        let pushed = |time: f64| plate.motion.offset(time).x / whole * f64::from(LOOKS);
        while pushed(flow.simulation.time()) < f64::from(n) && flow.simulation.time() < case.stop.time {
            flow.steps(1)?;
        }
        let length = high.x - low.x + plate.motion.offset(flow.simulation.time()).x;
        let stretch = (high.x - low.x) / length;
        let turned = DVec3::new(direction.x / stretch, direction.y, direction.z * stretch).normalize();
        let within = |at: DVec3| (ENDS * length..(1.0 - ENDS) * length).contains(&(at.x - low.x));
        let view = flow.simulation.snapshot();
        let Fluid::Cells(cells) = &view.fluid;
        last = [
            of_fibres(&view.inclusions, within)?,
            of_field(cells, within)?,
            Direction::Aligned(turned).tensor(),
        ];
        fibres = fibres.max(distance(&last[0], &last[2]));
        fields = fields.max(distance(&last[1], &last[2]));
    }
    let mut checks = vec![
        context.zero("fibres", "fibres from the closed form, largest in a_ij", "", fibres)?,
        context.zero("field", "field from the closed form", "", fields)?,
    ];
    for (name, a) in ["fibres", "field", "closed form"].iter().zip(last) {
        checks.push(shown(format!("a_zz at the end, {name}"), a.z_axis.z));
        checks.push(shown(format!("a_xz at the end, {name}"), a.x_axis.z));
    }
    Ok(checks)
}
