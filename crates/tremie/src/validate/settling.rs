//! Single spheres that sink, or do not.
//!
//! The fluid fills a closed box and is given no weight, so that it is not pressed together by it; the spheres feel theirs less that of the fluid in
//! their place.

use rayon::prelude::*;
use tremie_case::Case;
use tremie_numerics::DQuat;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_suspension::{ContactLaw, Form, Inclusions, Kind, Method, Suspension};

use super::benchmark::{Check, Context, shown};
use super::flow::{Flow, lattice};

/// Acceleration of gravity in m/s2.
const GRAVITY: f64 = 9.81;

/// A sphere at rest in the fluid of a case with the lattice viscosity given.
fn sphere(mut case: Case, viscosity: f64, diameter: f64, density: f64, place: DVec3) -> Flow {
    let cell = lattice(&mut case).cell_size;
    let kinematic = case.material.curve.plastic_viscosity() / case.material.density;
    lattice(&mut case).time_step = Some(viscosity * cell * cell / kinematic);
    let kinds = vec![Kind { name: "sphere".into(), form: Form::Sphere { diameter }, density }];
    let mut bodies = Inclusions { kinds, ..Inclusions::default() };
    bodies.add(0, 0, place, DQuat::IDENTITY);
    let (origin, periods) = (case.domain.min, case.periods());
    let suspension = Suspension::new(bodies, Method::default(), ContactLaw::default(), origin, periods);
    Flow::with(case, suspension.under(-GRAVITY * DVec3::Z))
}

/// Height and speed of the fall of the sphere.
fn fall(flow: &Flow) -> (f64, f64) {
    let bodies = flow.simulation.snapshot().inclusions;
    (bodies.position[0].z, -bodies.velocity[0].z)
}

/// The sphere of ten Cate et al. in their four oils.
pub(super) fn settling_sphere(context: &Context) -> anyhow::Result<Vec<Check>> {
    const DIAMETER: f64 = 0.015;
    const DENSITY: f64 = 1120.0;
    /// Height in m of the sphere's lowest point over the floor.
    const RELEASED: f64 = 0.12;
    let experiments = context.reference()?;
    let measured = context.table("velocity.csv")?;
    let falls: anyhow::Result<Vec<Vec<(f64, f64)>>> = experiments
        .par_iter()
        .map(|experiment| {
            let mut case = context.case("case.toml")?;
            case.material.density = experiment["rho_f_kg_m3"];
            case.material.curve = FlowCurve::Newtonian { viscosity: experiment["mu_f_Pa_s"] };
            let middle = 0.5 * (case.domain.min + case.domain.max);
            let place = middle.with_z(case.domain.min.z + RELEASED + 0.5 * DIAMETER);
            let mut flow = sphere(case, experiment["lattice_viscosity"], DIAMETER, DENSITY, place);
            let mut seen = vec![(0.0, 0.0)];
            while flow.simulation.time() < experiment["until_s"] {
                flow.steps(5)?;
                seen.push((flow.simulation.time(), fall(&flow).1));
            }
            Ok(seen)
        })
        .collect();
    let mut checks = Vec::new();
    for (experiment, seen) in experiments.iter().zip(falls?) {
        let reynolds = experiment["Re"];
        let points: Vec<(f64, f64)> = measured
            .iter()
            .filter(|row| row["Re"] == reynolds)
            .map(|row| (row["t_s"], -row["velocity_m_s"]))
            .collect();
        let largest = |of: &[(f64, f64)]| of.iter().map(|(_, speed)| *speed).fold(0.0, f64::max);
        let (reference, peak) = (largest(&points), largest(&seen));
        let name = format!("largest speed, Reynolds number {reynolds}");
        checks.push(context.relative("peak", name, "m/s", reference, peak)?);
        // How the speed grows: where both are known.
        let at = |time: f64| {
            let after = seen.partition_point(|(t, _)| *t < time).clamp(1, seen.len() - 1);
            let ((t, u), (s, v)) = (seen[after - 1], seen[after]);
            u + (v - u) * (time - t) / (s - t)
        };
        let off: Vec<f64> = points
            .iter()
            .filter(|(time, _)| *time < experiment["until_s"])
            .map(|(time, speed)| (at(*time) - speed).powi(2))
            .collect();
        let off = (off.iter().sum::<f64>() / off.len() as f64).sqrt() / reference;
        checks
            .push(shown(format!("speed over time, Reynolds number {reynolds} (RMS over the largest)"), off));
    }
    Ok(checks)
}

/// Heavy spheres in a Bingham fluid, smaller and larger than those that its yield stress holds.
pub(super) fn yield_stress_sphere(context: &Context) -> anyhow::Result<Vec<Check>> {
    const CELLS: f64 = 8.0;
    const VISCOSITY: f64 = 0.2;
    const STEPS: u64 = 6000;
    let case = context.case("case.toml")?;
    let reference = context.reference()?;
    let critical = reference.first().map_or(f64::NAN, |row| row["d_crit_m"]);
    let excess = reference.first().map_or(f64::NAN, |row| row["drho_kg_m3"]);
    let sizes = [0.7, 1.0, 1.4];
    let speeds: anyhow::Result<Vec<[f64; 2]>> = sizes
        .par_iter()
        .map(|size| {
            let mut case = case.clone();
            let diameter = size * critical;
            let (old, cell) = (lattice(&mut case).cell_size, diameter / CELLS);
            lattice(&mut case).cell_size = cell;
            case.domain.max = case.domain.min + cell / old * (case.domain.max - case.domain.min);
            let middle = 0.5 * (case.domain.min + case.domain.max);
            let (fluid, viscosity) = (case.material.density, case.material.curve.plastic_viscosity());
            let mut flow = sphere(case, VISCOSITY, diameter, fluid + excess, middle);
            flow.steps(STEPS / 2)?;
            let (time, height) = (flow.simulation.time(), fall(&flow).0);
            flow.steps(STEPS / 2)?;
            let speed = (height - fall(&flow).0) / (flow.simulation.time() - time);
            let fluid = flow.cells().velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
            let free = excess * GRAVITY * diameter * diameter / (18.0 * viscosity);
            Ok([speed / free, fluid / free])
        })
        .collect();
    let speeds = speeds?;
    let [small, limit, large] = [speeds[0], speeds[1], speeds[2]];
    let name = "0.7 times the limit: speed over that without yield stress";
    Ok(vec![
        context.zero("stays", name, "", small[0])?,
        context.at_least("sinks", "1.4 times the limit: the same", large[0])?,
        shown("at the limit: the same", limit[0]),
        shown("0.7 times the limit: largest speed of the fluid, over the same", small[1]),
        shown("at the limit: the same", limit[1]),
        shown("1.4 times the limit: the same", large[1]),
    ])
}
