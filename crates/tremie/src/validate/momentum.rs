//! What bodies and fluid hand each other: momentum, and moments.

use tremie_numerics::{DQuat, DVec3};
use tremie_simulation::{Fluid, Simulation};
use tremie_suspension::{ContactLaw, Form, Inclusions, Kind, Method, Suspension};

use super::benchmark::{Check, Context};
use super::flow::{Flow, lattice};

/// A fibre and a ball for cells of a size in m.
fn kinds(cell: f64) -> Vec<Kind> {
    let kind = |name: &str, form: Form, density: f64| Kind { name: name.into(), form, density };
    vec![
        kind("fibre", Form::Fibre { length: 6.0 * cell, diameter: 0.1 * cell }, 7850.0),
        kind("ball", Form::Sphere { diameter: 4.0 * cell }, 2600.0),
    ]
}

/// Angular momentum in kg m2/s of the fluid about the origin, as a snapshot shows it.
fn angular_momentum(simulation: &dyn Simulation, unit: f64) -> DVec3 {
    let snapshot = simulation.snapshot();
    let Fluid::Cells(cells) = &snapshot.fluid;
    let [nx, ny, _] = cells.count;
    let of = |n: usize| {
        let at = cells.centre(n % nx, n / nx % ny, n / nx / ny);
        // Pressure is a third of the excess density in units of the lattice.
        (1.0 + 3.0 * cells.pressure[n] / unit) * at.cross(cells.velocity[n])
    };
    cells.density * cells.size.powi(3) * (0..cells.velocity.len()).map(of).sum::<DVec3>()
}

/// Single bodies that are thrown and spun: the moment that the fluid gets against that on the body.
///
/// What a lattice streams and collides keeps its angular momentum to rounding. So this grows by the moment of the forces on the fluid, until what they set
/// going comes to the ends of the box, a cell in each step.
pub(super) fn spread(context: &Context) -> anyhow::Result<Vec<Check>> {
    const STEPS: usize = 10;
    let mut case = context.case("case.toml")?;
    let cell = lattice(&mut case).cell_size;
    let step = 0.05 * cell * cell * case.material.density / case.material.curve.plastic_viscosity();
    lattice(&mut case).time_step = Some(step);
    let unit = case.material.density * (cell / step).powi(2);
    let mut worst = [0.0f64; 2];
    for n in 0..20 {
        let kind = n % 2;
        let mut bodies = Inclusions { kinds: kinds(cell), ..Inclusions::default() };
        let aside = f64::from(n) * DVec3::new(0.37, 0.59, 0.83);
        let place = 0.5 * (case.domain.min + case.domain.max) + aside.fract() * cell;
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.7, -0.4) * f64::from(n + 1));
        bodies.add(kind, 0, place, turn);
        bodies.velocity[0] = DVec3::new(0.05, -0.02, 0.03);
        bodies.angular_velocity[0] = turn * DVec3::new(15.0, -9.0, 6.0);
        let (origin, periods) = (case.domain.min, case.periods());
        let suspension = Suspension::new(bodies, Method::default(), ContactLaw::default(), origin, periods);
        let mut flow = Flow::with(case.clone(), suspension);
        let (mut before, mut last) = (angular_momentum(&*flow.simulation, unit), DVec3::ZERO);
        let (mut off, mut largest) = (0.0f64, 0.0f64);
        for _ in 0..STEPS {
            let centre = flow.simulation.snapshot().inclusions.position[0];
            flow.steps(1)?;
            let now = angular_momentum(&*flow.simulation, unit);
            // A snapshot shows the fluid with half of the forces that it got last once more.
            let got = ((now - before) / step + 0.5 * last) / 1.5;
            let bodies = flow.simulation.snapshot().inclusions;
            let lost = bodies.torque[0] + centre.cross(bodies.drag[0]);
            (off, largest) = (off.max((got + lost).length()), largest.max(bodies.torque[0].length()));
            (before, last) = (now, got);
        }
        worst[usize::from(kind)] = worst[usize::from(kind)].max(off / largest);
    }
    ["fibre", "ball"]
        .into_iter()
        .zip(worst)
        .map(|(name, worst)| {
            let name =
                format!("{name}: moment on the fluid less that on the body, over the largest of the latter");
            context.zero("moment", name, "", worst)
        })
        .collect()
}

/// Bodies thrown into a fluid at rest.
pub(super) fn momentum(context: &Context) -> anyhow::Result<Vec<Check>> {
    let mut case = context.case("case.toml")?;
    let cell = lattice(&mut case).cell_size;
    let density = case.material.density;
    let step = 0.05 * cell * cell * density / case.material.curve.plastic_viscosity();
    lattice(&mut case).time_step = Some(step);
    let mut inclusions = Inclusions { kinds: kinds(cell), ..Inclusions::default() };
    let periods = case.periods();
    for n in 0..30 {
        let place = cell * (f64::from(n) * DVec3::new(7.1, 3.3, 5.7) + 0.5);
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.7, -0.4) * f64::from(n));
        inclusions.add(u16::from(n % 10 == 0), 0, periods.inside(case.domain.min, place), turn);
        inclusions.velocity[n as usize] = DVec3::new(0.05, -0.02, 0.03 * f64::from(n).sin());
    }
    let suspension =
        Suspension::new(inclusions, Method::default(), ContactLaw::default(), case.domain.min, periods);
    let mut flow = Flow::with(case, suspension);
    let all = |simulation: &dyn Simulation| {
        let snapshot = simulation.snapshot();
        let Fluid::Cells(cells) = &snapshot.fluid;
        // Pressure is a third of the excess density in units of the lattice.
        let unit = density * (cell / step).powi(2);
        let mass = |pressure: f64| density * (1.0 + 3.0 * pressure / unit) * cell.powi(3);
        let fluid: DVec3 = cells.velocity.iter().zip(&cells.pressure).map(|(u, p)| mass(*p) * *u).sum();
        let bodies = &snapshot.inclusions;
        let mass = |n: usize| bodies.kinds[usize::from(bodies.kind[n])].density * bodies.form(n).volume();
        let own: DVec3 = (0..bodies.len()).map(|n| mass(n) * bodies.velocity[n]).sum();
        // A snapshot shows the fluid with half of the forces that it got last once more.
        [fluid + 0.5 * step * bodies.drag.iter().sum::<DVec3>(), own]
    };
    let before = all(&*flow.simulation);
    let mut furthest = 0.0f64;
    for _ in 0..100 {
        flow.steps(100)?;
        let now = all(&*flow.simulation);
        let lost = now[0] + now[1] - before[0] - before[1];
        furthest = furthest.max(lost.length() / before[1].length());
    }
    Ok(vec![context.zero("momentum", "momentum gained or lost, over that of the bodies", "", furthest)?])
}
