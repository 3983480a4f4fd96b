//! Free surfaces: fluid at rest, carried along, and kept in a box.

use rayon::prelude::*;
use tremie_case::{Case, Precision};
use tremie_lbm::lattice_boltzmann;
use tremie_simulation::{Cells, Fluid};

use super::benchmark::{Check, Context, shown};
use super::collapse::heights;
use super::flow::{Flow, cell_at, centres, lattice};

/// Steps after which liquid at rest must lie still.
const SETTLED: u64 = 20_000;
/// Steps for which mass and rest must last.
const LONG: u64 = 100_000;

fn with_precision(context: &Context, precision: Precision) -> anyhow::Result<Case> {
    let mut case = context.case("case.toml")?;
    lattice(&mut case).precision = precision;
    Ok(case)
}

const PRECISIONS: [(Precision, &str); 2] = [(Precision::F32, "f32"), (Precision::F64, "f64")];

/// Liquid at rest in a box, with a free surface.
pub(super) fn tank_hydrostatic(context: &Context) -> anyhow::Result<Vec<Check>> {
    let runs: anyhow::Result<Vec<Vec<Check>>> =
        PRECISIONS.par_iter().map(|(precision, name)| tank(context, *precision, name)).collect();
    Ok(runs?.concat())
}

fn tank(context: &Context, precision: Precision, name: &str) -> anyhow::Result<Vec<Check>> {
    let case = with_precision(context, precision)?;
    let height = case.fluid[0].shape.bounds().1.z;
    let gravity = -case.domain.gravity.z;
    let weight = case.material.density * gravity;
    let scale = (gravity * height).sqrt();
    let mut flow = Flow::new(case);
    let mut checks = Vec::new();
    for steps in [SETTLED, LONG] {
        flow.steps(steps - (flow.simulation.time() / flow.simulation.time_step()).round() as u64)?;
        let cells = flow.cells();
        let fastest = cells.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
        let (mut pressure, mut level) = (0.0f64, 0.0f64);
        for j in 0..cells.count[1] {
            for i in 0..cells.count[0] {
                let mut column = 0.0;
                for k in 0..cells.count[2] {
                    let n = cells.index(i, j, k);
                    column += cells.fill[n];
                    if cells.fill[n] == 1.0 {
                        let exact = weight * (height - cells.centre(i, j, k).z);
                        pressure = pressure.max((cells.pressure[n] - exact).abs());
                    }
                }
                level = level.max((column - height / cells.size).abs());
            }
        }
        let what = |quantity: &str| format!("{quantity}, {name}, {steps} steps");
        checks.extend([
            context.zero("pressure", what("pressure over rho g H"), "", pressure / (weight * height))?,
            context.zero(&format!("speed {name}"), what("speed over sqrt(g H)"), "", fastest / scale)?,
            context.zero("level", what("level"), "cells", level)?,
        ]);
    }
    Ok(checks)
}

/// Liquid that collapses and sloshes in a closed box: its mass.
pub(super) fn closed_box(context: &Context) -> anyhow::Result<Vec<Check>> {
    let (single, double) = rayon::join(
        || drift(&with_precision(context, Precision::F32)?),
        || drift(&with_precision(context, Precision::F64)?),
    );
    let (single, double) = (single?, double?);
    let name = |precision: &str| format!("largest change of mass, {precision}");
    Ok(vec![
        context.zero("f32", name("f32"), "", single.largest)?,
        context.zero("f64", name("f64"), "", double.largest)?,
        context.zero("f64", "change of mass but for repayments, f64", "", double.accumulated)?,
        shown("change of mass but for repayments, f32", single.accumulated),
    ])
}

/// Relative changes of mass.
struct Drift {
    /// The largest at any time.
    largest: f64,
    /// What it would have come to if rounding had never been repaid.
    accumulated: f64,
}

fn drift(case: &Case) -> anyhow::Result<Drift> {
    /// The solver repays rounding at multiples of this number of steps; mass is read one step earlier, too.
    const REPAID: u64 = 1000;
    let mut fluid = lattice_boltzmann(case);
    let start = fluid.mass();
    let mut drift = Drift { largest: 0.0, accumulated: 0.0 };
    let mut last = start;
    for step in 1..=LONG {
        fluid.advance()?;
        let mass =
            if step % (REPAID / 4) == 0 || step % REPAID == REPAID - 1 { fluid.mass() } else { continue };
        drift.largest = drift.largest.max((mass / start - 1.0).abs());
        if step % REPAID == REPAID - 1 {
            drift.accumulated += (mass - last) / start;
        } else if step % REPAID == 0 {
            last = mass;
        }
    }
    drift.accumulated = drift.accumulated.abs();
    Ok(drift)
}

/// Carries the fluid of the case through its periodic box to the stop time, when it is back where it started.
pub(super) fn advection(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let mut fluid = lattice_boltzmann(&case);
    let mass = fluid.mass();
    let steps = (case.stop.time / fluid.time_step()).round() as u64;
    for _ in 0..steps {
        fluid.advance()?;
    }
    let Fluid::Cells(cells) = fluid.snapshot().fluid;
    let (shape, velocity) = (case.fluid[0].shape, case.fluid[0].velocity);
    let (mut difference, mut volume, mut off) = (0.0, 0.0, 0.0f64);
    for place in centres(&cells) {
        let exact = shape.fill(place, cells.size);
        let (fill, moves) =
            cell_at(&cells, place).map_or((0.0, velocity), |n| (cells.fill[n], cells.velocity[n]));
        difference += (fill - exact).abs();
        volume += exact;
        if fill > 0.5 {
            off = off.max(moves.distance(velocity) / velocity.length());
        }
    }
    Ok(vec![
        context.relative("mass", "mass", "kg", mass, fluid.mass())?,
        context.zero("shape", "shape (L1 of the fill)", "", difference / volume)?,
        shown("velocity furthest off, cells over half full", off),
    ])
}

/// A body that is let go: mean speed over g t, and way of its centre over g t^2/2.
pub(super) fn free_fall(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut fine = context.case("lbm.toml")?;
    lattice(&mut fine).cell_size /= 2.0;
    let runs = [
        ("lbm 10", context.case("lbm.toml")?),
        ("lbm 20", fine),
        ("isph", context.case("isph.toml")?),
        ("ldd", context.case("ldd.toml")?),
    ];
    let fall = |(name, case): (&str, Case)| -> anyhow::Result<Vec<Check>> {
        let (end, gravity) = (case.stop.time, -case.domain.gravity.z);
        let mut flow = Flow::new(case);
        let [start, _] = middle(&flow.cells());
        flow.until(end)?;
        let ([height, speed], time) = (middle(&flow.cells()), flow.simulation.time());
        let (speed, way) = (-speed / (gravity * time), (start - height) / (0.5 * gravity * time * time));
        Ok(vec![
            context.relative(name, format!("speed over g t, {name}"), "", 1.0, speed)?,
            context.relative(name, format!("way over g t^2/2, {name}"), "", 1.0, way)?,
        ])
    };
    let checks: anyhow::Result<Vec<Vec<Check>>> = runs.into_par_iter().map(fall).collect();
    Ok(checks?.concat())
}

/// A lump that falls into a pool, by particles and nodes against the lattice.
pub(super) fn falling_lump(context: &Context) -> anyhow::Result<Vec<Check>> {
    let fall = |case: &str| -> anyhow::Result<(f64, Vec<f64>)> {
        let case = context.case(case)?;
        let end = case.stop.time;
        let mut flow = Flow::new(case);
        let [start, _] = middle(&flow.cells());
        flow.until(end)?;
        let cells = flow.cells();
        let [height, _] = middle(&cells);
        Ok((start - height, heights(&cells)))
    };
    let runs: anyhow::Result<Vec<_>> =
        ["lbm.toml", "isph.toml", "ldd.toml"].into_par_iter().map(fall).collect();
    let runs = runs?;
    let (way, profile) = &runs[0];
    let mut checks = Vec::new();
    for (name, (found, other)) in ["isph", "ldd"].into_iter().zip(&runs[1..]) {
        checks.push(context.relative("middle", format!("way of the middle, {name}"), "m", *way, *found)?);
        let off: f64 = profile.iter().zip(other).map(|(one, other)| (one - other).abs()).sum();
        let off = off / profile.iter().sum::<f64>();
        checks.push(context.zero(
            "profile",
            format!("difference of profiles over the volume, {name}"),
            "",
            off,
        )?);
    }
    Ok(checks)
}

/// Height in m of the middle of the fluid, and its mean velocity in m/s upward.
fn middle(cells: &Cells) -> [f64; 2] {
    let layer = cells.count[0] * cells.count[1];
    let all = cells.fill.iter().zip(&cells.velocity).enumerate();
    let [mass, height, speed] = all.fold([0.0; 3], |[mass, height, speed], (n, (fill, u))| {
        [mass + fill, height + fill * cells.centre(0, 0, n / layer).z, speed + fill * u.z]
    });
    [height / mass, speed / mass]
}
