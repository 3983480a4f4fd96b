//! Single bodies that turn in shear.

use std::f64::consts::{FRAC_PI_2, PI};

use anyhow::ensure;
use rayon::prelude::*;
use tremie_numerics::{DQuat, DVec3};
use tremie_suspension::{Form, Freedom, Inclusions, Kind};

use super::benchmark::{Check, Context, shown};
use super::flow::Flow;
use super::shear::{Shear, line};

/// One body in the middle of a cell, at first at rest, its own z along `axis`.
fn alone(shear: &Shear, form: Form, axis: DVec3) -> Flow {
    let kinds = vec![Kind { name: "body".into(), form, density: shear.case.material.density }];
    let mut bodies = Inclusions { kinds, ..Inclusions::default() };
    bodies.add(0, 0, shear.middle(), DQuat::from_rotation_arc(DVec3::Z, axis.normalize()));
    shear.flow(shear.suspension(bodies, Freedom::Free))
}

/// A fibre that is so slender that it turns as a line of the fluid does.
///
/// Jeffery (1922), aspect ratio infinite: with x along the flow and z along its gradient, p_x/p_z of the axis p grows by the shear, and p_y/p_z stays.
pub(super) fn fibre_shear(context: &Context) -> anyhow::Result<Vec<Check>> {
    const LENGTH: f64 = 6.0;
    const CELLS: [usize; 3] = [36, 18, 36];
    const VISCOSITY: f64 = 0.2;
    const REYNOLDS: f64 = 0.1;
    // The flow has come to be steady when the fibre is seen first.
    const SEEN: [f64; 2] = [0.5, 5.5];
    let mut shear = Shear::new(context.case("case.toml")?, CELLS, VISCOSITY, REYNOLDS, LENGTH);
    let size = shear.size();
    let form = Form::Fibre { length: LENGTH * size, diameter: 0.075 * size };
    let runs = [("in the plane of shear", 0.0), ("askew to it", 1.0)];
    let seen: anyhow::Result<Vec<Vec<[f64; 3]>>> = runs
        .par_iter()
        .map(|(_, aside)| {
            let mut flow = alone(&shear, form, DVec3::new(-2.5, *aside, 1.0));
            flow.until(SEEN[0] / shear.rate)?;
            let mut seen = Vec::new();
            for _ in 0..50 {
                flow.until(flow.simulation.time() + (SEEN[1] - SEEN[0]) / 50.0 / shear.rate)?;
                let axis = flow.simulation.snapshot().inclusions.axis(0);
                seen.push([shear.rate * flow.simulation.time(), axis.x / axis.z, axis.y / axis.z]);
            }
            Ok(seen)
        })
        .collect();
    let mut checks = Vec::new();
    for ((name, aside), seen) in runs.iter().zip(seen?) {
        let points: Vec<(f64, f64)> = seen.iter().map(|[shear, along, _]| (*shear, *along)).collect();
        let (start, slope) = line(&points);
        let off = |(shear, along): &(f64, f64)| (along - start - slope * shear).abs();
        let furthest = points.iter().map(off).fold(0.0, f64::max) / (SEEN[1] - SEEN[0]);
        checks.push(context.relative("slope", format!("cot(angle) over shear, {name}"), "", 1.0, slope)?);
        checks.push(context.zero(
            "linear",
            format!("furthest from a straight line, {name}"),
            "",
            furthest,
        )?);
        if *aside > 0.0 {
            let drift = seen.iter().map(|[.., y]| (y / aside - 1.0).abs()).fold(0.0, f64::max);
            checks.push(shown("aside of the plane: p_y/p_z changes by at most", drift));
        }
    }
    Ok(checks)
}

/// Angle of the axis from the direction of the gradient, as it goes on.
fn angle(flow: &Flow) -> f64 {
    let axis = flow.simulation.snapshot().inclusions.axis(0);
    axis.x.atan2(axis.z)
}

/// Shear in which a spheroid turns from `from` to `to`.
fn turning(shear: &Shear, form: Form, from: f64, to: f64, early: f64) -> anyhow::Result<f64> {
    // It starts before, so that the flow is steady when it gets there.
    let start = from - early;
    let mut flow = alone(shear, form, DVec3::new(start.sin(), 0.0, start.cos()));
    let (mut before, mut passed) = ((0.0, start), Vec::new());
    let interval = 0.005 / shear.rate;
    while passed.len() < 2 {
        let time = flow.simulation.time();
        ensure!(shear.rate * time < 50.0, "the spheroid does not turn");
        flow.until(time + interval)?;
        let mut now = angle(&flow);
        while now < before.1 - FRAC_PI_2 {
            now += PI;
        }
        let time = shear.rate * flow.simulation.time();
        for goal in [from, to].into_iter().skip(passed.len()) {
            if before.1 < goal && now >= goal {
                passed.push(before.0 + (goal - before.1) / (now - before.1) * (time - before.0));
            }
        }
        before = (time, now);
    }
    Ok(passed[1] - passed[0])
}

/// Prolate spheroids that turn in the plane of shear.
pub(super) fn jeffery_spheroid(context: &Context) -> anyhow::Result<Vec<Check>> {
    const VISCOSITY: f64 = 0.3;
    let reference = context.reference()?;
    // Aspect ratio, half the short axis, cells, Reynolds number, and from where to where it turns.
    let runs =
        [(2.0, 3.0, [56, 40, 56], 0.1, -FRAC_PI_2, FRAC_PI_2), (5.0, 3.0, [80, 40, 72], 0.5, 0.0, FRAC_PI_2)];
    let ends: anyhow::Result<Vec<f64>> = runs
        .par_iter()
        .map(|&(aspect, short, cells, reynolds, from, to)| {
            let mut shear =
                Shear::new(context.case("case.toml")?, cells, VISCOSITY, reynolds, aspect * short);
            let size = shear.size();
            let form = Form::Ellipsoid { half_axes: size * DVec3::new(short, short, aspect * short) };
            let early = if from == 0.0 { 0.5 } else { 0.15 };
            turning(&shear, form, from, to, early)
        })
        .collect();
    let mut checks = Vec::new();
    for ((aspect, .., from, to), turned) in runs.into_iter().zip(ends?) {
        let row = reference.iter().find(|row| row["aspect_ratio"] == aspect);
        let period = row.map_or(f64::NAN, |row| row["T_gammadot_spheroid"]);
        let part = (to - from) / (2.0 * PI);
        let name = format!("period of aspect ratio {aspect} times shear rate, by {part} of a turn");
        checks.push(context.relative("period", name, "", period, turned / part)?);
    }
    Ok(checks)
}
