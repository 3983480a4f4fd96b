//! Bodies held in flow, against closed forms of the drag.

use std::f64::consts::PI;

use rayon::prelude::*;
use tremie_case::Case;
use tremie_numerics::{DQuat, DVec3};
use tremie_output::picture::{Axis, Style};
use tremie_suspension::{ContactLaw, Coupling, Form, Freedom, Inclusions, Kind, Method, Suspension};

use super::benchmark::{Check, Context, shown};
use super::figure::Figure;
use super::flow::{Flow, lattice};

/// Diffusion times over which flows come to be steady.
const STEADY: f64 = 1.2;

/// One body in the fluid of a case, with the lattice viscosity given.
fn with(
    mut case: Case,
    viscosity: f64,
    form: Form,
    method: Method,
    place: DVec3,
    turn: DQuat,
    spin: DVec3,
) -> Flow {
    let cell = lattice(&mut case).cell_size;
    let kinematic = case.material.curve.plastic_viscosity() / case.material.density;
    lattice(&mut case).time_step = Some(viscosity * cell * cell / kinematic);
    let kinds = vec![Kind { name: "body".into(), form, density: case.material.density }];
    let mut inclusions = Inclusions { kinds, ..Inclusions::default() };
    inclusions.add(0, 0, place, turn);
    inclusions.angular_velocity[0] = spin;
    let suspension =
        Suspension::new(inclusions, method, ContactLaw::default(), case.domain.min, case.periods());
    Flow::with(case, suspension)
}

/// Mean velocity of the fluid in m/s.
fn mean(flow: &Flow) -> DVec3 {
    let cells = flow.cells();
    cells.velocity.iter().sum::<DVec3>() / cells.velocity.len() as f64
}

fn held(coupling: Coupling) -> Method {
    Method { coupling, freedom: Freedom::Held, ..Method::default() }
}

/// Drag per length on a cylinder midway between plates over `mu u_max` (Faxen 1946; Svec 2013, Eq. 3.12), k being its diameter over their distance.
fn faxen(k: f64) -> f64 {
    let f = -k.ln() - 0.915_689_273_2 + 0.054_648_66 * k.powi(4) - 0.264_629_67 * k.powi(6)
        + 0.792_986 * k.powi(8);
    let g = 1.266_539_75 * k.powi(2) - 0.918_043_3 * k.powi(4) + 1.877_101 * k.powi(6) - 4.665_49 * k.powi(8);
    4.0 * PI / (f + g)
}

/// The drag on a cylinder between plates over Faxen's, its diameter in cells.
fn between_plates(case: &Case, diameter: f64, viscosity: f64, coupling: Coupling) -> anyhow::Result<f64> {
    let mut case = case.clone();
    let cell = lattice(&mut case).cell_size;
    let height = case.domain.max.y - case.domain.min.y;
    let mu = case.material.curve.plastic_viscosity();
    // One cell long, with a point at each end: the other half of each is its image.
    let form = Form::Fibre { length: cell, diameter: diameter * cell };
    let middle = 0.5 * (case.domain.min + case.domain.max) + DVec3::X * 0.3 * cell;
    let mut flow = with(case, viscosity, form, held(coupling), middle, DQuat::IDENTITY, DVec3::ZERO);
    let steps = STEADY * (height / cell).powi(2) / viscosity;
    flow.steps(steps as u64)?;
    let drag = flow.simulation.snapshot().inclusions.drag[0].x / cell;
    // The largest speed by the flow rate, which is the same everywhere.
    Ok(drag / (faxen(diameter * cell / height) * mu * 1.5 * mean(&flow).x))
}

/// `number` values from one to the other, even by logarithm.
fn even(from: f64, to: f64, number: usize) -> Vec<f64> {
    (0..number).map(|n| from * (to / from).powf(n as f64 / (number - 1) as f64)).collect()
}

/// A cylinder between plates, by the friction of slender bodies and by the thesis's correction.
pub(super) fn cylinder_drag(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let draws: Vec<(f64, f64, Coupling)> = even(0.005, 0.2, 6)
        .into_iter()
        .flat_map(|viscosity| even(0.05, 2.0, 10).into_iter().map(move |diameter| (diameter, viscosity)))
        .flat_map(|(d, nu)| [Coupling::Slender, Coupling::Svec].map(|coupling| (d, nu, coupling)))
        .collect();
    let ratio = |&(d, nu, coupling): &(f64, f64, Coupling)| between_plates(&case, d, nu, coupling);
    let ratios: Vec<f64> = draws.par_iter().map(ratio).collect::<anyhow::Result<_>>()?;
    draw_ratios(context, &draws, &ratios)?;
    let furthest = |chosen: &dyn Fn(f64, f64, Coupling) -> bool| {
        let all = draws.iter().zip(&ratios).filter(|((d, nu, coupling), _)| chosen(*d, *nu, *coupling));
        let off = |ratio: f64| if ratio.is_nan() { f64::INFINITY } else { (ratio - 1.0).abs() };
        let worst = all.max_by(|a, b| off(*a.1).total_cmp(&off(*b.1)));
        worst.map_or((0.0, 0.0, f64::NAN), |((d, nu, _), ratio)| (*d, *nu, *ratio))
    };
    let mut checks = Vec::new();
    let (d, nu, ratio) = furthest(&|_, _, coupling| coupling == Coupling::Slender);
    let name = format!("friction of slender bodies, furthest off: {d:.2} cells, viscosity {nu:.3}");
    checks.push(context.relative("drag", name, "", 1.0, ratio)?);
    let judged = |d: f64, nu: f64| d <= 0.3 && nu >= 0.05;
    let (d, nu, ratio) = furthest(&|d, nu, coupling| coupling == Coupling::Svec && judged(d, nu));
    let name = format!("correction of the thesis, furthest off: {d:.2} cells, viscosity {nu:.3}");
    checks.push(context.relative("thesis", name, "", 1.0, ratio)?);
    let (d, nu, ratio) = furthest(&|d, nu, coupling| coupling == Coupling::Svec && !judged(d, nu));
    checks.push(shown(format!("the same beyond: {d:.2} cells, viscosity {nu:.3}"), ratio));
    Ok(checks)
}

/// As in Figures 3.5, 3.6 and 3.8 of Svec (2013).
fn draw_ratios(context: &Context, draws: &[(f64, f64, Coupling)], ratios: &[f64]) -> anyhow::Result<()> {
    let couplings = [
        ("slender", "friction of slender bodies", Coupling::Slender),
        ("thesis", "correction of the thesis", Coupling::Svec),
    ];
    let all = || draws.iter().zip(ratios);
    let mut by_time = Vec::new();
    for (name, title, which) in couplings {
        let mut curves: Vec<(String, Style, Vec<[f64; 2]>)> = Vec::new();
        for (&(d, nu, _), &ratio) in all().filter(|(draw, _)| draw.2 == which) {
            let label = format!("viscosity {nu:.3}");
            match curves.last_mut() {
                Some(curve) if curve.0 == label => curve.2.push([d, ratio]),
                _ => curves.push((label, Style::Line, vec![[d, ratio]])),
            }
        }
        context.show(&Figure {
            name,
            title: &format!("Cylinder between plates: {title}"),
            x: Axis::logarithmic("diameter [cells]"),
            y: Axis::linear("drag over Faxen's"),
            curves,
        })?;
        let points =
            all().filter(|(draw, _)| draw.2 == which).map(|((d, nu, _), ratio)| [d * d / nu, *ratio]);
        by_time.push((title.to_owned(), Style::Marks, points.collect()));
    }
    context.show(&Figure {
        name: "time-factor",
        title: "Cylinder between plates",
        x: Axis::logarithmic("time factor: diameter^2 / viscosity, in units of the lattice"),
        y: Axis::linear("drag over Faxen's"),
        curves: by_time,
    })
}

/// A sphere in a periodic box.
pub(super) fn sphere_drag(context: &Context) -> anyhow::Result<Vec<Check>> {
    /// Diameter in cells on which the radius of the points was measured; it judges nothing.
    const CALIBRATED: f64 = 8.0;
    let case = context.case("case.toml")?;
    let sizes = [2.5, 6.0, 7.0, CALIBRATED, 10.0];
    let draws: Vec<(f64, f64)> =
        sizes.into_iter().flat_map(|d| [0.05, 0.1, 0.3].map(|viscosity| (d, viscosity))).collect();
    let ratio = |&(diameter, viscosity): &(f64, f64)| -> anyhow::Result<f64> {
        let mut case = case.clone();
        let cell = lattice(&mut case).cell_size;
        let edge = 4.0 * diameter * cell;
        case.domain.max = case.domain.min + edge;
        let diameter = diameter * cell;
        let mu = case.material.curve.plastic_viscosity();
        let place = case.domain.min + 0.5 * edge + DVec3::new(0.2, 0.4, 0.1) * cell;
        let method = held(Coupling::Slender);
        let form = Form::Sphere { diameter };
        let mut flow = with(case, viscosity, form, method, place, DQuat::IDENTITY, DVec3::ZERO);
        flow.steps((0.5 * STEADY * (edge / cell).powi(2) / viscosity) as u64)?;
        let drag = flow.simulation.snapshot().inclusions.drag[0].x;
        let c = PI / 6.0 * (diameter / edge).powi(3);
        let slower = 1.0 - 1.7601 * c.cbrt() + c - 1.5593 * c * c;
        Ok(drag / (3.0 * PI * mu * diameter * mean(&flow).x / slower))
    };
    let ratios: Vec<f64> = draws.par_iter().map(ratio).collect::<anyhow::Result<_>>()?;
    draws
        .iter()
        .zip(ratios)
        .map(|((diameter, viscosity), ratio)| {
            let name = format!("drag, {diameter} cells, viscosity {viscosity}");
            if *diameter == CALIBRATED {
                return Ok(shown(name, ratio));
            }
            context.relative("drag", name, "", 1.0, ratio)
        })
        .collect()
}

/// A fibre in a periodic box.
pub(super) fn fibre_drag(context: &Context) -> anyhow::Result<Vec<Check>> {
    const LENGTH: f64 = 6.0;
    const ASPECT: f64 = 80.0;
    const VISCOSITY: f64 = 0.1;
    let mut case = context.case("case.toml")?;
    let cell = lattice(&mut case).cell_size;
    let edge = case.domain.max.x - case.domain.min.x;
    let length = LENGTH * cell;
    let mu = case.material.curve.plastic_viscosity();
    let form = Form::Fibre { length, diameter: length / ASPECT };
    let middle = 0.5 * (case.domain.min + case.domain.max) + DVec3::new(0.2, 0.4, 0.1) * cell;
    let gravity = case.domain.gravity.length();
    let axis = DVec3::new(0.48, 0.6, 0.64);
    let turn = DQuat::from_rotation_arc(DVec3::Z, axis);
    let steps = 0.5 * STEADY * (edge / cell).powi(2) / VISCOSITY;
    let method = held(Coupling::Slender);
    // The friction felt in flow along a direction, less what the images do.
    let friction = |direction: DVec3| -> anyhow::Result<f64> {
        let mut case = case.clone();
        case.domain.gravity = gravity * direction;
        let mut flow = with(case, VISCOSITY, form, method, middle, turn, DVec3::ZERO);
        flow.steps(steps as u64)?;
        let drag = flow.simulation.snapshot().inclusions.drag[0].dot(direction);
        Ok(1.0 / (mean(&flow).dot(direction) / drag + 2.8373 / (6.0 * PI * mu * edge)) / mu)
    };
    let turning = || -> anyhow::Result<f64> {
        let mut case = case.clone();
        case.domain.gravity = DVec3::ZERO;
        let spin = axis.any_orthonormal_vector();
        // So slowly that it has hardly turned at the end.
        let step = VISCOSITY * cell * cell * case.material.density / mu;
        let spin = spin * 1e-3 / (steps * step);
        let mut flow = with(case, VISCOSITY, form, method, middle, turn, spin);
        flow.steps(steps as u64)?;
        Ok(-flow.simulation.snapshot().inclusions.torque[0].dot(spin) / spin.length_squared() / mu)
    };
    let across = axis.any_orthonormal_vector();
    let (along, (across, turning)) =
        rayon::join(|| friction(axis), || rayon::join(|| friction(across), turning));
    // Tirado and Garcia de la Torre (1979).
    let log = ASPECT.ln();
    let exact = [
        2.0 * PI * length / (log - 0.207 + 0.980 / ASPECT - 0.133 / ASPECT.powi(2)),
        4.0 * PI * length / (log + 0.839 + 0.185 / ASPECT + 0.233 / ASPECT.powi(2)),
        PI * length.powi(3) / 3.0 / (log - 0.662 + 0.917 / ASPECT - 0.050 / ASPECT.powi(2)),
    ];
    Ok(vec![
        context.relative("along", "friction along, over that of a cylinder", "", 1.0, along? / exact[0])?,
        context.relative("across", "friction across", "", 1.0, across? / exact[1])?,
        context.relative("turning", "friction of turning", "", 1.0, turning? / exact[2])?,
    ])
}
