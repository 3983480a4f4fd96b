//! Surface tension.

use std::f64::consts::PI;

use tremie_case::{Case, Side};
use tremie_geometry::Shape;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;

use super::benchmark::{Check, Context};
use super::flow::{Flow, lattice};

/// Cells to the radius of the drop.
const RESOLUTIONS: [u32; 3] = [8, 12, 16];
/// Viscosity in Pa s of a paste.
const STIFF: f64 = 1.0;

/// Radius in m, density in kg/m3, tension in N/m and kinematic viscosity in m2/s of a drop.
struct Drop {
    radius: f64,
    density: f64,
    tension: f64,
    viscosity: f64,
}

impl Drop {
    fn new(case: &Case) -> Self {
        let (low, high) = case.fluid[0].shape.bounds();
        let (density, tension) = (case.material.density, case.material.surface_tension);
        let viscosity = case.material.curve.plastic_viscosity() / density;
        Self { radius: 0.5 * (high.x - low.x), density, tension, viscosity }
    }

    /// Angular frequency in 1/s of small oscillations in the lowest mode, and how fast they decay, of a drop of the radius.
    fn oscillation(&self) -> [f64; 2] {
        let frequency = (8.0 * self.tension / (self.density * self.radius.powi(3))).sqrt();
        let decay = 5.0 * self.viscosity / self.radius.powi(2);
        [(frequency * frequency - decay * decay).sqrt(), decay]
    }
}

/// Middles in m of the cells of a snapshot.
fn places(cells: &Cells) -> impl Iterator<Item = DVec3> {
    let [nx, ny, _] = cells.count;
    (0..cells.fill.len()).map(move |n| cells.centre(n % nx, n / nx % ny, n / nx / ny))
}

/// A drop by its surface tension alone.
pub(super) fn capillary_drop(context: &Context) -> anyhow::Result<Vec<Check>> {
    let whole = context.case("case.toml")?;
    let mut checks = Vec::new();
    for cells in RESOLUTIONS {
        let mut case = whole.clone();
        lattice(&mut case).cell_size = Drop::new(&case).radius / f64::from(cells);
        let finest = cells == RESOLUTIONS[RESOLUTIONS.len() - 1];
        let mut stiff = case.clone();
        stiff.material.curve = FlowCurve::Newtonian { viscosity: STIFF };
        let thin = at_rest(context, &case)?;
        let thin = thin.map(|check| Check { quantity: format!("{}, 20 mPa s", check.quantity), ..check });
        let of_case = at_rest(context, &stiff)?.into_iter().chain(thin).chain(oscillating(context, case)?);
        checks.extend(of_case.map(|check| Check {
            quantity: format!("{}, {cells} cells to the radius", check.quantity),
            tolerance: check.tolerance.filter(|_| finest),
            ..check
        }));
    }
    Ok(checks)
}

/// Pressure in a sphere, and how still it lies.
fn at_rest(context: &Context, case: &Case) -> anyhow::Result<[Check; 2]> {
    /// Moments that are looked at, over the last tenth of the time.
    const LOOKS: u32 = 20;
    let drop = Drop::new(case);
    let (low, high) = case.fluid[0].shape.bounds();
    let middle = 0.5 * (low + high);
    let mut flow = Flow::new(case.clone());
    let (mut pressure, mut fastest) = (0.0, 0.0f64);
    for look in 0..LOOKS {
        flow.until(case.stop.time * (0.9 + 0.1 * f64::from(look) / f64::from(LOOKS)))?;
        let cells = flow.cells();
        let (mut sum, mut count) = (0.0, 0u32);
        for (n, place) in places(&cells).enumerate() {
            fastest = fastest.max(cells.velocity[n].length());
            if place.distance(middle) < 0.7 * drop.radius {
                sum += cells.pressure[n];
                count += 1;
            }
        }
        pressure += sum / f64::from(count * LOOKS);
    }
    let scale = (drop.tension / (drop.density * drop.radius)).sqrt();
    let laplace = 2.0 * drop.tension / drop.radius;
    Ok([
        context.relative("pressure", "pressure in a sphere", "Pa", laplace, pressure)?,
        context.zero(
            "rest",
            "fastest fluid in it over sqrt(tension/(density radius))",
            "",
            fastest / scale,
        )?,
    ])
}

/// Period and decay of a capsule that becomes a sphere.
fn oscillating(context: &Context, mut case: Case) -> anyhow::Result<[Check; 2]> {
    /// Moments that are looked at in a period.
    const LOOKS: u32 = 200;
    /// Times that the second moment is zero.
    const ZEROS: usize = 6;
    let Drop { radius, .. } = Drop::new(&case);
    let end = 0.1 * radius * DVec3::Z;
    case.fluid[0].shape = Shape::Capsule { start: -end, end, radius };
    case.domain.min = DVec3::ZERO;
    for axis in 0..3 {
        case.domain.sides[2 * axis] = Side::Symmetry;
    }
    let volume = 4.0 / 3.0 * PI * radius.powi(3) + PI * radius.powi(2) * 2.0 * end.z;
    let drop = Drop { radius: (0.75 * volume / PI).cbrt(), ..Drop::new(&case) };
    let [frequency, decay] = drop.oscillation();
    let (mut flow, step) = (Flow::new(case), 2.0 * PI / frequency / f64::from(LOOKS));
    let moment = |flow: &Flow| -> f64 {
        let cells = flow.cells();
        let of = |(n, at): (usize, DVec3)| cells.fill[n] * (2.0 * at.z * at.z - at.x * at.x - at.y * at.y);
        places(&cells).enumerate().map(of).sum()
    };
    let (mut before, mut zeros, mut largest) = ((0.0, moment(&flow)), Vec::new(), vec![0.0f64]);
    while zeros.len() < ZEROS {
        flow.until(flow.simulation.time() + step)?;
        let now = (flow.simulation.time(), moment(&flow));
        if now.1 * before.1 < 0.0 {
            zeros.push(before.0 + (now.0 - before.0) * before.1 / (before.1 - now.1));
            largest.push(0.0);
        }
        if let Some(largest) = largest.last_mut() {
            *largest = largest.max(now.1.abs());
        }
        before = now;
    }
    let periods = (ZEROS - 1) as f64 / 2.0;
    let period = (zeros[ZEROS - 1] - zeros[0]) / periods;
    // Between the extremes after the first zero and before the last there are half a period less.
    let found = (largest[1] / largest[ZEROS - 1]).ln() / ((ZEROS - 2) as f64 / 2.0 * period);
    Ok([
        context.relative(
            "period",
            "period of a capsule that becomes a sphere",
            "s",
            2.0 * PI / frequency,
            period,
        )?,
        context.relative("decay", "rate at which its oscillation decays", "1/s", decay, found)?,
    ])
}
