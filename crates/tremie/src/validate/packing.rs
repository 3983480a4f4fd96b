//! Fibres where they are placed, without flow.

use rayon::prelude::*;
use tremie_numerics::DVec3;
use tremie_suspension::orientation::{Section, crossing};
use tremie_suspension::{Amount, AtWalls, Direction, Form, Inclusions, Kind, Order, Periods, Region, place};

use super::benchmark::{Check, Context};

/// Orientation factor of fibres at random in a beam with this section, in m.
fn orientation_factor(width: f64, height: f64, length: f64) -> anyhow::Result<f64> {
    const NUMBER: usize = 20_000;
    const SECTIONS: usize = 8;
    // So thin that they are not in each other's way.
    let form = Form::Fibre { length, diameter: 1e-4 * length };
    let kinds = vec![Kind { name: "fibres".into(), form, density: 7850.0 }];
    let mut bodies = Inclusions { kinds, ..Inclusions::default() };
    let extent = DVec3::new(4.0 * length, width, height);
    let order = Order {
        kind: 0,
        batch: 0,
        amount: Amount::Number(NUMBER),
        direction: Direction::Isotropic,
        at_walls: AtWalls::Turned,
        seed: 1,
    };
    let distance = |at: DVec3| (-at.y).max(at.y - width).max(-at.z).max(at.z - height);
    let region = Region { low: DVec3::ZERO, high: extent, distance: &distance };
    place(&mut bodies, &order, &region, &Periods([Some(extent.x), None, None]))?;
    let share = NUMBER as f64 * form.volume() / extent.element_product();
    // Sections where fibres do not go on at the other end, which their axes know nothing of.
    let factors = (0..SECTIONS).map(|n| {
        let corner = DVec3::X * length * (1.0 + 2.0 * n as f64 / (SECTIONS - 1) as f64);
        let section = Section { corner, sides: [width * DVec3::Y, height * DVec3::Z] };
        crossing(&bodies, &section).orientation_factor(share)
    });
    Ok(factors.sum::<f64>() / SECTIONS as f64)
}

/// Fibres in beams, against the mean of bulk, walls and corners.
pub(super) fn wall_effect(context: &Context) -> anyhow::Result<Vec<Check>> {
    let reference = context.reference()?;
    let factors: Vec<f64> = reference
        .par_iter()
        .map(|row| orientation_factor(1e-3 * row["b_mm"], 1e-3 * row["h_mm"], 1e-3 * row["lf_mm"]))
        .collect::<anyhow::Result<_>>()?;
    let checks = reference.iter().zip(factors).map(|(row, factor)| {
        let name = format!("{} x {} mm, fibres of {} mm", row["b_mm"], row["h_mm"], row["lf_mm"]);
        context.absolute("factor", name, "", row["alpha"], factor)
    });
    checks.collect()
}
