//! Incompressible smoothed particle hydrodynamics against closed forms, and against the lattice on the same case.

use std::f64::consts::TAU;

use anyhow::anyhow;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_case::Case;
use tremie_cloud::{Dimension, nodes};
use tremie_geometry::{Body, Motion, Shape};
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;
use tremie_sph::{Fluid, Particles, Space, Stepping, Wall};

use super::benchmark::{Check, Context, observed_order, shown};
use super::channel::{Poiseuille, column, gap, l2_error, set_cells};
use super::collapse::{front, heights};
use super::flow::Flow;
use super::profile::Model;

/// Particles across a channel.
const ACROSS: [usize; 2] = [32, 16];

/// Plane channels of fluids without and with a yield stress, after many diffusion times.
pub(super) fn channels(context: &Context) -> anyhow::Result<Vec<Check>> {
    let Poiseuille { half_gap, wall_stress, .. } = Poiseuille::of(&context.case("case.toml")?);
    let consistency = context.case("case.toml")?.material.curve.plastic_viscosity();
    let law = |share: f64, index: f64| Model::HerschelBulkley {
        yield_stress: share * wall_stress,
        consistency,
        index,
    };
    let models = [
        ("Newtonian", law(0.0, 1.0)),
        ("Bingham, plug 0.2", law(0.2, 1.0)),
        ("Bingham, plug 0.5", law(0.5, 1.0)),
        ("power law, index 0.5", law(0.0, 0.5)),
    ];
    let mut checks = Vec::new();
    for (name, model) in models {
        for across in ACROSS {
            let mut case = context.case("case.toml")?;
            let height = gap(&case);
            set_cells(&mut case, height / across as f64, across);
            case.material.curve = match model {
                Model::HerschelBulkley { yield_stress, index: 1.0, .. } => {
                    FlowCurve::Bingham { yield_stress, plastic_viscosity: consistency }
                }
                other => other.curve(),
            };
            let end = case.stop.time;
            let mut flow = Flow::new(case);
            flow.until(end)?;
            let exact = |z: f64| model.velocity(half_gap, wall_stress, z / half_gap - 1.0);
            let error = l2_error(&column(&flow.cells()), exact);
            let check =
                context.zero("profile", format!("velocity, {name}, {across} across (L2)"), "", error)?;
            checks.push(if across == ACROSS[0] { check } else { Check { tolerance: None, ..check } });
        }
    }
    Ok(checks)
}

/// Liquid at rest in a tank.
pub(super) fn tank(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let (height, end) = (case.fluid[0].shape.bounds().1.z, case.stop.time);
    let (gravity, density) = (-case.domain.gravity.z, case.material.density);
    let mut flow = Flow::new(case);
    flow.until(end)?;
    let cells = flow.cells();
    let exact = |n: usize| {
        let [nx, ny, _] = cells.count;
        density * gravity * (height - cells.centre(n % nx, n / nx % ny, n / (nx * ny)).z)
    };
    let full: Vec<usize> = (0..cells.fill.len()).filter(|n| cells.fill[*n] == 1.0).collect();
    let squares: f64 = full.iter().map(|n| (cells.pressure[*n] - exact(*n)).powi(2)).sum();
    let error = (squares / full.len() as f64).sqrt() / (density * gravity * height);
    let fastest = cells.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
    let volume: f64 = cells.fill.iter().sum::<f64>() * cells.size.powi(3);
    let size = cells.domain[1] - cells.domain[0];
    Ok(vec![
        context.zero("pressure", "pressure over rho g H (RMS)", "", error)?,
        context.zero("speed", "speed over sqrt(g H)", "", fastest / (gravity * height).sqrt())?,
        context.relative("volume", "volume", "m3", size.x * size.y * height, volume)?,
    ])
}

/// A wall through a point.
fn wall(point: DVec3, normal: DVec3) -> Wall {
    let body = Body::Shape(Shape::HalfSpace { point, normal });
    Wall { body, motion: Motion::REST, sliding: DVec3::ZERO, slip_length: 0.0, hides: false }
}

fn water(viscosity: f64, gravity: f64) -> Fluid {
    Fluid {
        density: 1000.0,
        curve: FlowCurve::Newtonian { viscosity },
        largest_viscosity: viscosity,
        gravity: -gravity * DVec3::Z,
        as_printed: false,
    }
}

const STEPPING: Stepping = Stepping { courant: 0.25, longest: 0.1, explicit: false };

/// A column at rest whose particles stand in disorder, but for the uppermost.
pub(super) fn hydrostatic_cloud(context: &Context) -> anyhow::Result<Vec<Check>> {
    /// Height in m, and steps.
    const HEIGHT: f64 = 0.2;
    const STEPS: usize = 100;
    let mut checks = Vec::new();
    for jitter in [0.1, 0.2] {
        for (dimension, spacing, name) in [(Dimension::Two, 0.01, "plane"), (Dimension::Three, 0.02, "space")]
        {
            let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::splat(HEIGHT) });
            let mut random = Pcg64Mcg::seed_from_u64(5);
            let mut positions = nodes(&full, spacing, dimension, 0.5 * HEIGHT);
            for at in positions.iter_mut().filter(|at| at.z < HEIGHT - spacing) {
                let [x, z, y] = [(); 3].map(|()| jitter * spacing * random.random_range(-1.0..1.0));
                *at += DVec3::new(x, if dimension == Dimension::Two { 0.0 } else { y }, z);
            }
            let far = DVec3::splat(HEIGHT);
            let mut walls =
                vec![wall(DVec3::ZERO, DVec3::X), wall(far, DVec3::NEG_X), wall(DVec3::ZERO, DVec3::Z)];
            if dimension == Dimension::Three {
                walls.extend([wall(DVec3::ZERO, DVec3::Y), wall(far, DVec3::NEG_Y)]);
            }
            let space = Space { walls, ..Space::free(dimension, spacing) };
            let mut particles = Particles::new(positions, space, water(1.0, 9.81), STEPPING);
            for _ in 0..STEPS {
                particles.advance()?;
            }
            let top = HEIGHT - 0.5 * spacing;
            let off = particles.positions.iter().zip(&particles.pressures);
            let off = off.map(|(at, p)| (p - 9810.0 * (top - at.z)).abs()).fold(0.0, f64::max);
            let fastest = particles.velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
            let what = |what: &str| format!("{what}, {name}, disorder {jitter}");
            let off = off / (9810.0 * HEIGHT);
            checks.push(context.zero(
                "pressure",
                what("largest error of the pressure over rho g H"),
                "",
                off,
            )?);
            checks.push(context.zero("speed", what("largest speed"), "m/s", fastest)?);
        }
    }
    Ok(checks)
}

/// Vortices in a periodic square that die away.
pub(super) fn taylor_green(context: &Context) -> anyhow::Result<Vec<Check>> {
    /// Particles along an edge of 1 m, Reynolds number of 1 m and 1 m/s, and time in s.
    const EDGES: [usize; 2] = [32, 64];
    const REYNOLDS: f64 = 100.0;
    const END: f64 = 1.0;
    let decay = |edge: usize| -> anyhow::Result<f64> {
        let spacing = 1.0 / edge as f64;
        let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::ONE });
        let positions = nodes(&full, spacing, Dimension::Two, 0.5);
        let (low, high) = (DVec3::ZERO, DVec3::ONE);
        let space =
            Space { low, high, periodic: [true, false, true], ..Space::free(Dimension::Two, spacing) };
        let viscosity = 1000.0 / REYNOLDS;
        let mut particles = Particles::new(positions, space, water(viscosity, 0.0), STEPPING);
        for (at, u) in particles.positions.iter().zip(&mut particles.velocities) {
            let (x, z) = (TAU * at.x, TAU * at.z);
            *u = DVec3::new(x.sin() * z.cos(), 0.0, -x.cos() * z.sin());
        }
        let energy = |particles: &Particles| -> f64 {
            particles.velocities.iter().map(|u| u.length_squared()).sum::<f64>()
        };
        let first = energy(&particles);
        while particles.time() < END {
            particles.advance()?;
        }
        // Energy falls as exp(-4 nu k^2 t).
        Ok(-(energy(&particles) / first).ln() / particles.time())
    };
    let exact = 4.0 * TAU * TAU / REYNOLDS;
    let (mut checks, mut errors) = (Vec::new(), Vec::new());
    for edge in EDGES {
        let found = decay(edge)?;
        errors.push((found / exact - 1.0).abs());
        let check = context.relative("decay", format!("decay rate, {edge} x {edge}"), "1/s", exact, found)?;
        checks.push(if edge == EDGES[1] { check } else { Check { tolerance: None, ..check } });
    }
    checks.push(context.at_least("order", "order", observed_order(&EDGES, &errors))?);
    Ok(checks)
}

/// The same slump by particles and by the lattice: what is at the lower side of y.
pub(super) fn both_methods(context: &Context) -> anyhow::Result<Vec<Check>> {
    const TIMES: [f64; 6] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
    let run = |case: Case| -> anyhow::Result<Vec<Cells>> {
        let mut flow = Flow::new(case);
        TIMES.iter().map(|time| flow.until(*time).map(|()| flow.cells())).collect()
    };
    let particles = run(context.case("isph.toml")?)?;
    let lattice = run(context.case("lbm.toml")?)?;
    let mut checks = Vec::new();
    for ((time, particles), lattice) in TIMES.iter().zip(&particles).zip(&lattice) {
        let what = format!("half of the spread at {time} s");
        checks.push(context.relative("spread", what, "m", front(lattice), front(particles))?);
    }
    let (Some(particles), Some(lattice)) = (particles.last(), lattice.last()) else {
        return Err(anyhow!("there are no times"));
    };
    let (one, other) = (heights(particles), heights(lattice));
    let volume = |heights: &[f64]| heights.iter().sum::<f64>();
    let number = one.len().max(other.len());
    let of = |heights: &[f64], n: usize| heights.get(n).copied().unwrap_or(0.0);
    let off = (0..number).map(|n| (of(&one, n) - of(&other, n)).abs()).sum::<f64>() / volume(&other);
    checks.push(context.zero("profile", "profile at the end: difference over the volume", "", off)?);
    checks.push(shown("volume by particles over that by the lattice", volume(&one) / volume(&other)));
    Ok(checks)
}
