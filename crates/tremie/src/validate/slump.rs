//! The cone of EN 12350-2 and -8, removed at once.

use std::cell::{Cell, RefCell};

use anyhow::anyhow;
use rayon::prelude::*;
use tremie_case::{Case, Stepping};
use tremie_geometry::Motion;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_simulation::gauges::{Readings, TargetTime};
use tremie_simulation::{Cells, Fluid, Snapshot};
use tremie_suspension::{Form, Inclusions};

use super::benchmark::{Check, Context, Row, shown};
use super::flow::{Flow, cell_at, centres, lattice};
use super::report;
use super::thin_layer::ThinLayer;

/// Yield stress in Pa and plastic viscosity in Pa s of the mixes; the longest run first.
const MIXES: [(f64, f64); 4] = [(20.0, 50.0), (50.0, 50.0), (50.0, 30.0), (100.0, 50.0)];

/// Volume in m3 of the cone of EN 12350-2.
const CONE_VOLUME: f64 = std::f64::consts::PI / 12.0 * 0.3 * (0.2 * 0.2 + 0.2 * 0.1 + 0.1 * 0.1);

/// Radius in m of the cylinder that the thin layer starts as; it is soon forgotten.
const THIN_LAYER_RADIUS: f64 = 0.15;

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
    let mut layer = ThinLayer::new(yield_stress, plastic_viscosity, density, THIN_LAYER_RADIUS, CONE_VOLUME);
    layer.until(readings.time);
    Ok(vec![
        context.relative("spread", what("spread"), "m", row["D_corr_m"], spread.mean)?,
        context.relative("height", what("height"), "m", row["h0_corr_m"], spread.height)?,
        context.relative("round", what("axes against diagonal"), "m", spread.diagonal, axes)?,
        shown(what(&format!("a thin layer lacks at {:.0} s", readings.time)), layer.missing()),
    ])
}

/// A cone of fluid with aggregates and fibres in it, and without.
pub(super) fn slump_inclusions(context: &Context) -> anyhow::Result<Vec<Check>> {
    let with = context.case("case.toml")?;
    let mut without = with.clone();
    without.groups.clear();
    without.inclusions = Inclusions::default();
    let at_rest = |case: Case, what: &str| -> anyhow::Result<(Readings, Snapshot)> {
        let next = Cell::new(0.0);
        let mut flow = Flow::new(case);
        let readings = flow.until_rest(|now| {
            if now.time >= next.get() {
                next.set(next.get() + PROGRESS / 5.0);
                report::progress(&format!("{what}: {:.1} s", now.time));
            }
        })?;
        Ok((readings, flow.simulation.snapshot()))
    };
    let (with, snapshot) = at_rest(with, "with aggregates and fibres")?;
    let (without, _) = at_rest(without, "without")?;
    let spread = |readings: &Readings| readings.spread.ok_or_else(|| anyhow!("the case has no spread gauge"));
    let (thick, thin) = (spread(&with)?, spread(&without)?);
    let (Fluid::Cells(cells), bodies) = (&snapshot.fluid, &snapshot.inclusions);
    let low = cells.domain[0].z;
    // How far in cells a place is from all fluid, by the middles of cells around; the surface of fluid that fills half of a cell is at 0.5.
    let away = |place: DVec3| {
        let near =
            (0..7 * 7 * 7).map(|n| DVec3::new((n % 7) as f64, (n / 7 % 7) as f64, (n / 49) as f64) - 3.0);
        let wet = near.filter(|off| {
            cell_at(cells, place + cells.size * *off).is_some_and(|cell| cells.fill[cell] > 0.0)
        });
        wet.map(DVec3::length).fold(f64::INFINITY, f64::min)
    };
    let (mut floor, mut lost, mut out) = (0.0f64, 0, 0.0f64);
    for (n, &at) in bodies.position.iter().enumerate() {
        let (reach, diameter) = match *bodies.form(n) {
            Form::Fibre { length, diameter } => {
                (0.5 * length * bodies.axis(n).z.abs() + 0.5 * diameter, diameter)
            }
            Form::Sphere { diameter } => (0.5 * diameter, diameter),
            Form::Ellipsoid { .. } => anyhow::bail!("the case has an ellipsoid"),
        };
        floor = floor.max((low + reach - at.z) / diameter);
        lost += usize::from(away(at) > 1.0);
        for end in bodies.ends(n).into_iter().flatten() {
            out = out.max(away(end));
        }
    }
    Ok(vec![
        context.at_least("smaller", "spread without bodies over that with", thin.mean / thick.mean)?,
        context.at_least("higher", "height with bodies over that without", thick.height / thin.height)?,
        context.zero("floor", "deepest in the floor, over the diameter", "", floor)?,
        context.zero("lost", "bodies out of the fluid", "", lost as f64)?,
        shown("furthest end of a fibre from fluid (0: in it), cells", out),
        shown("spread with bodies, m", thick.mean),
        shown("spread without, m", thin.mean),
        shown("height with bodies, m", thick.height),
        shown("height without, m", thin.height),
        shown("at rest with bodies, s", with.time),
        shown("at rest without, s", without.time),
    ])
}

/// Speeds in m/s at which the mould is lifted, the slowest first; none where it vanishes at once.
const LIFTS: [Option<f64>; 5] = [Some(0.05), Some(0.1), Some(0.3), Some(1.0), None];

/// What comes of a lift.
struct Lifted {
    /// Spread in m at rest.
    spread: f64,
    /// Time in s to the circle of 500 mm.
    t500: f64,
    /// Share of the fluid above the rim of the mould when it has been lifted.
    left: f64,
}

/// A cone that is lifted from the concrete.
pub(super) fn cone_lift(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs: anyhow::Result<Vec<Lifted>> =
        LIFTS.par_iter().with_max_len(1).map(|speed| lifted(context, *speed)).collect();
    let runs = runs?;
    let (at_once, lifts) = runs.split_last().ok_or_else(|| anyhow!("no lift"))?;
    let mut checks = Vec::new();
    for (run, speed) in lifts.iter().zip(LIFTS.iter().flatten()) {
        let what = |quantity: &str| format!("{quantity}, {speed} m/s");
        checks.push(context.relative("spread", what("spread"), "m", at_once.spread, run.spread)?);
        checks.push(context.zero("left", what("left on the mould"), "", run.left)?);
    }
    for (n, pair) in runs.windows(2).enumerate() {
        let slower =
            LIFTS[n].map_or_else(String::new, |speed| format!("T500, {speed} m/s before the next faster, s"));
        checks.push(context.zero("later", slower, "s", (pair[1].t500 - pair[0].t500).max(0.0))?);
    }
    for (run, speed) in runs.iter().zip(LIFTS) {
        let name = speed.map_or_else(|| "at once".to_owned(), |speed| format!("{speed} m/s"));
        checks.push(shown(format!("T500, {name}"), run.t500));
        checks.push(shown(format!("spread, {name}"), run.spread));
    }
    Ok(checks)
}

fn lifted(context: &Context, speed: Option<f64>) -> anyhow::Result<Lifted> {
    let mut case = context.case("case.toml")?;
    let mut end = 0.0;
    match speed {
        None => case.solids.clear(),
        Some(speed) => {
            let [mould] = case.solids.as_mut_slice() else { anyhow::bail!("the case has not one solid") };
            let Motion::Path(points) = &mut mould.motion else { anyhow::bail!("the mould has no path") };
            let last = points.len() - 1;
            end = points[last].offset.z / speed;
            points[last].time = end;
        }
    }
    let rim = case.solids.first().map(|mould| mould.swept(end, end).0.z);
    let mut flow = Flow::new(case.clone());
    let volume = flow.readings().volume;
    let mut t500 = TargetTime::new(0.5);
    let mut left = 0.0;
    if let Some(rim) = rim {
        while flow.simulation.time() < end {
            flow.until(flow.simulation.time() + case.gauges.interval)?;
            let readings = flow.readings();
            t500.update(readings.time, readings.spread.map_or(0.0, |spread| spread.max));
        }
        let cells = flow.cells();
        let above = centres_and_fills(&cells).filter(|(z, _)| *z > rim).map(|(_, fill)| fill).sum::<f64>();
        left = above * cells.size.powi(3) * cells.copies() / volume;
    }
    let (next, seen) = (Cell::new(0.0), RefCell::new(t500));
    let how = speed.map_or("once".into(), |speed| format!("{speed} m/s"));
    let readings = flow.until_rest(|now| {
        seen.borrow_mut().update(now.time, now.spread.map_or(0.0, |spread| spread.max));
        if now.time >= next.get() {
            next.set(now.time + PROGRESS);
            report::progress(&format!("lift at {how}: {:.1} s", now.time));
        }
    })?;
    let spread = readings.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
    let t500 = seen.into_inner().reached().ok_or_else(|| anyhow!("500 mm are not reached"))?;
    Ok(Lifted { spread: spread.mean, t500, left })
}

/// Height in m and fill of all cells.
fn centres_and_fills(cells: &Cells) -> impl Iterator<Item = (f64, f64)> {
    let layer = cells.count[0] * cells.count[1];
    cells.fill.iter().enumerate().map(move |(n, fill)| (cells.centre(0, 0, n / layer).z, *fill))
}

/// Plastic viscosity in Pa s at which stiff cones are let down so slowly that inertia does not count: shown beside that of the case.
const SLOW: f64 = 1000.0;

/// Slump of three stiff mixes: the mould gone at once or lifted as the standard has it, and in a fluid that sinks slowly.
pub(super) fn slump_stiff(context: &Context) -> anyhow::Result<Vec<Check>> {
    let rows = context.reference()?;
    let ways = [("case.toml", false), ("lifted.toml", false), ("case.toml", true)];
    let runs: Vec<(&Row, &str, bool)> =
        ways.into_iter().flat_map(|(file, slow)| rows.iter().map(move |row| (row, file, slow))).collect();
    runs.par_iter().with_max_len(1).map(|(row, file, slow)| stiff_cone(context, row, file, *slow)).collect()
}

fn stiff_cone(context: &Context, row: &Row, file: &str, slow: bool) -> anyhow::Result<Check> {
    let mut case = context.case(file)?;
    let height = case.fluid[0].shape.bounds().1.z;
    let weight = case.material.density * -case.domain.gravity.z * height;
    let mut plastic_viscosity = case.material.curve.plastic_viscosity();
    if slow {
        plastic_viscosity = SLOW;
        let lbm = lattice(&mut case);
        lbm.cell_size *= 2.0;
        lbm.stepping = Stepping::Adaptive;
    }
    let how = if case.solids.is_empty() { "" } else { ", lifted" };
    case.material.curve = FlowCurve::Bingham { yield_stress: row["tau"] * weight, plastic_viscosity };
    let readings = Flow::new(case).until_rest(|_| {})?;
    let spread = readings.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
    let slump = 1.0 - spread.height / height;
    // The nearest point of the band between the two criteria.
    let band = slump.clamp(row["tresca"], row["von_mises"]);
    let what = format!("slump over H, tau' {}, {plastic_viscosity} Pa s{how}", row["tau"]);
    let check = context.absolute("slump", what, "", band, slump)?;
    Ok(if slow { Check { tolerance: None, ..check } } else { check })
}

/// The slump test of the thesis (Svec 2013, 2.3.1).
pub(super) fn slump_thesis(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let weight = case.material.density * -case.domain.gravity.z;
    let yield_stress = case.material.curve.yield_stress();
    let pi = std::f64::consts::PI;
    let radius = (225.0 * weight * CONE_VOLUME.powi(2) / (128.0 * pi * pi * yield_stress)).powf(0.2);
    let height = (2.0 * yield_stress * radius / weight).sqrt();
    let readings = Flow::new(case).until_rest(|_| {})?;
    let spread = readings.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
    Ok(vec![
        context.relative("radius", "radius", "m", radius, 0.5 * spread.mean)?,
        context.relative("height", "height in the middle", "m", height, spread.height)?,
        shown("time to rest in s", readings.time),
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
    let lbm = lattice(&mut case);
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

/// Hydrostatic density errors of the two runs of the cone that cannot flow; the first is the default.
const DENSITY_ERRORS: [(&str, f64); 2] = [("default", 0.02), ("small", 0.001)];

/// A cone too stiff to flow.
///
/// Below its yield stress the lattice is elastic, with moduli that the hydrostatic density error sets. A second run at a small
/// error would show an effect of that.
pub(super) fn cone_rigid(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs: anyhow::Result<Vec<Vec<Check>>> = DENSITY_ERRORS
        .par_iter()
        .with_max_len(1)
        .map(|(name, error)| rigid_cone(context, name, *error))
        .collect();
    Ok(runs?.concat())
}

fn rigid_cone(context: &Context, name: &str, allowed: f64) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let lbm = lattice(&mut case);
    lbm.hydrostatic_error = allowed;
    let interval = case.gauges.interval;
    let mut flow = Flow::new(case);
    let measures = |flow: &Flow| {
        let now = flow.readings();
        let spread = now.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
        anyhow::Ok((spread.mean, spread.height, now.volume))
    };
    let (start, first) = (flow.cells(), measures(&flow)?);
    // The cone rings, so that one moment says nothing: the largest speed within a second.
    let mut speeds = Vec::new();
    for time in [1.0, 4.0, 7.0, 10.0] {
        flow.until(time - 1.0)?;
        let mut largest: f64 = 0.0;
        while flow.simulation.time() < time {
            flow.until(flow.simulation.time() + interval)?;
            largest = largest.max(flow.readings().speed_p99);
        }
        speeds.push(largest);
    }
    let last = measures(&flow)?;
    let what = |quantity: &str| format!("{quantity}, {name} density error");
    Ok(vec![
        context.relative("shape", what("spread"), "m", first.0, last.0)?,
        context.relative("shape", what("height"), "m", first.1, last.1)?,
        context.relative("shape", what("volume"), "m3", first.2, last.2)?,
        context.zero("shape", what("shape (L1 of the fill)"), "", fill_difference(&start, &flow.cells()))?,
        context.zero("speed", what("99 % of the speeds to 10 s"), "m/s", speeds[3])?,
        context.at_least("decay", what("speed to 4 s over that to 7 s"), speeds[1] / speeds[2])?,
        context.at_least("decay", what("speed to 7 s over that to 10 s"), speeds[2] / speeds[3])?,
    ])
}

/// Sum of the differences between the fills of two snapshots, as a share of the volume.
fn fill_difference(a: &Cells, b: &Cells) -> f64 {
    let fill = |cells: &Cells, place| cell_at(cells, place).map_or(0.0, |n| cells.fill[n]);
    let sum: f64 = centres(a).map(|place| (fill(a, place) - fill(b, place)).abs()).sum();
    sum / a.fill.iter().sum::<f64>()
}
