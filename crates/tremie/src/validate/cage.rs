//! Bars that are resolved, against a cage that stands for them.

use anyhow::{bail, ensure};
use tremie_case::Case;

use super::benchmark::{Check, Context, shown};
use super::flow::{Flow, lattice};

/// Case files with what they are, and Bingham numbers.
const PASSAGES: [(&str, &str); 4] = [
    ("spacing-3", "3 diameters"),
    ("spacing-5", "5 diameters"),
    ("spacing-8", "8 diameters"),
    ("one-row", "3 diameters, one row"),
];
const BINGHAM: [f64; 3] = [0.5, 5.0, 50.0];
/// The one at which finer bars are shown, and how many times finer.
const SHOWN: f64 = 5.0;
const FINER: f64 = 2.0;
/// Largest change of a steady force over a diffusion time of half the distance, as a share.
const STEADY: f64 = 1e-3;

/// Head losses through bars and through a zone.
pub(super) fn porous_cage(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    for (file, passage) in PASSAGES {
        let case = context.case(&format!("{file}.toml"))?;
        for number in BINGHAM {
            let name = format!("{passage}, Bingham number {number}");
            let (bars, cage) = alternatives(&at(&case, number)?);
            let (resolved, zone) = (head_loss(&bars)?, head_loss(&cage)?);
            checks.push(context.relative("head loss", format!("head loss, {name}"), "Pa", resolved, zone)?);
            if number == SHOWN {
                let fine = head_loss(&refined(bars))?;
                checks
                    .push(shown(format!("zone over bars of 16 cells, less one, {name}"), zone / fine - 1.0));
            }
        }
    }
    Ok(checks)
}

/// The case at the speed of a Bingham number.
fn at(case: &Case, number: f64) -> anyhow::Result<Case> {
    let mut case = case.clone();
    let ([cage], [inlet]) = (case.cages.as_slice(), case.inlets.as_mut_slice()) else {
        bail!("the case has not one cage and one inlet")
    };
    let curve = case.material.curve;
    let speed = curve.yield_stress() * cage.layers[0].grid.diameter / (curve.plastic_viscosity() * number);
    inlet.flow_rate = speed * inlet.face.area();
    Ok(case)
}

/// The case with its bars alone, and with its cage alone.
fn alternatives(case: &Case) -> (Case, Case) {
    let (mut bars, mut cage) = (case.clone(), case.clone());
    bars.cages.clear();
    cage.solids.clear();
    (bars, cage)
}

/// The case with smaller cells, one layer of them.
fn refined(mut case: Case) -> Case {
    let lbm = lattice(&mut case);
    lbm.cell_size /= FINER;
    case.domain.max.z /= FINER;
    case
}

/// Force along the flow on the bars, or their zone, over the section, in Pa, once it is steady.
fn head_loss(case: &Case) -> anyhow::Result<f64> {
    let size = case.domain.max - case.domain.min;
    let interval = size.y.powi(2) * case.material.density / case.material.curve.plastic_viscosity();
    let mut flow = Flow::new(case.clone());
    let mut before = 0.0;
    loop {
        flow.until(flow.simulation.time() + interval)?;
        let snapshot = flow.simulation.snapshot();
        let loads = snapshot.solids.iter().chain(&snapshot.cages);
        let force: f64 = loads.map(|load| load.force.x).sum();
        if (force - before).abs() <= STEADY * force.abs() {
            return Ok(force / (size.y * size.z));
        }
        ensure!(flow.simulation.time() < case.stop.time, "the force is not steady");
        before = force;
    }
}
