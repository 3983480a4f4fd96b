//! Methods without a mesh against closed forms, and against the lattice on the same case.

use std::f64::consts::TAU;

use anyhow::anyhow;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_case::Case;
use tremie_cloud::{
    Dimension, Gradients, Kernel, Method, Multigrid, Neighbours, Settings, Smoothing, Space, Wall, nodes,
    solve,
};
use tremie_geometry::{Body, Motion, Shape};
use tremie_ldd::Nodes;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_simulation::Cells;
use tremie_sph::Particles;

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

/// A method whose nodes a benchmark puts where it likes.
pub(super) trait Moving: Sized {
    /// Nodes at rest of a fluid of 1000 kg/m3 with a viscosity in Pa s, under gravity in m/s2 downwards.
    fn water(positions: Vec<DVec3>, space: Space, viscosity: f64, gravity: f64) -> Self;
    /// Goes on by a step.
    fn go_on(&mut self) -> anyhow::Result<()>;
    /// Time in s.
    fn now(&self) -> f64;
    /// Places in m, velocities in m/s and pressures in Pa.
    fn state(&mut self) -> (&[DVec3], &mut [DVec3], &[f64]);
}

impl Moving for Particles {
    fn water(positions: Vec<DVec3>, space: Space, viscosity: f64, gravity: f64) -> Self {
        let fluid = tremie_sph::Fluid {
            density: 1000.0,
            curve: FlowCurve::Newtonian { viscosity },
            largest_viscosity: viscosity,
            gravity: -gravity * DVec3::Z,
            as_printed: false,
        };
        let stepping = tremie_sph::Stepping { courant: 0.25, longest: 0.1, explicit: false };
        Self::new(positions, space, fluid, stepping)
    }

    fn go_on(&mut self) -> anyhow::Result<()> {
        Ok(self.advance()?)
    }

    fn now(&self) -> f64 {
        self.time()
    }

    fn state(&mut self) -> (&[DVec3], &mut [DVec3], &[f64]) {
        (&self.positions, &mut self.velocities, &self.pressures)
    }
}

impl Moving for Nodes {
    fn water(positions: Vec<DVec3>, space: Space, viscosity: f64, gravity: f64) -> Self {
        let fluid = tremie_ldd::Fluid {
            density: 1000.0,
            curve: FlowCurve::Newtonian { viscosity },
            largest_viscosity: viscosity,
            gravity: -gravity * DVec3::Z,
        };
        let stepping = tremie_ldd::Stepping {
            courant: 0.3,
            longest: 0.1,
            coupling: tremie_ldd::Coupling::Incremental,
            scheme: tremie_ldd::Scheme::Lagged,
            operators: tremie_ldd::Operators::Exact,
        };
        Self::new(positions, space, fluid, stepping)
    }

    fn go_on(&mut self) -> anyhow::Result<()> {
        Ok(self.advance()?)
    }

    fn now(&self) -> f64 {
        self.time()
    }

    fn state(&mut self) -> (&[DVec3], &mut [DVec3], &[f64]) {
        (&self.positions, &mut self.velocities, &self.pressures)
    }
}

/// A column at rest whose particles stand in disorder, but for the uppermost.
pub(super) fn hydrostatic_cloud<M: Moving>(context: &Context) -> anyhow::Result<Vec<Check>> {
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
            let mut column = M::water(positions, space, 1.0, 9.81);
            for _ in 0..STEPS {
                column.go_on()?;
            }
            let top = HEIGHT - 0.5 * spacing;
            let (positions, velocities, pressures) = column.state();
            let off = positions.iter().zip(pressures);
            let off = off.map(|(at, p)| (p - 9810.0 * (top - at.z)).abs()).fold(0.0, f64::max);
            let fastest = velocities.iter().map(|u| u.length()).fold(0.0, f64::max);
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
pub(super) fn taylor_green<M: Moving>(context: &Context) -> anyhow::Result<Vec<Check>> {
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
        let mut vortices = M::water(positions, space, viscosity, 0.0);
        let (positions, velocities, _) = vortices.state();
        for (at, u) in positions.iter().zip(velocities) {
            let (x, z) = (TAU * at.x, TAU * at.z);
            *u = DVec3::new(x.sin() * z.cos(), 0.0, -x.cos() * z.sin());
        }
        let energy = |vortices: &mut M| vortices.state().1.iter().map(|u| u.length_squared()).sum::<f64>();
        let first = energy(&mut vortices);
        while vortices.now() < END {
            vortices.go_on()?;
        }
        // Energy falls as exp(-4 nu k^2 t).
        Ok(-(energy(&mut vortices) / first).ln() / vortices.now())
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

/// What pairs of nodes count for in derivatives.
#[derive(Clone, Copy)]
enum Weights {
    /// Those of Lagrangian differencing dynamics, with a Laplacian that is exact for quadratic fields.
    Exact,
    /// The same with the Laplacian of the paper.
    Paper,
    /// The slope of the kernel of smoothed particles.
    Kernel,
}

impl Weights {
    fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact Laplacian",
            Self::Paper => "that of the paper",
            Self::Kernel => "kernel of Wendland",
        }
    }

    /// The kernel over nodes so far from each other in m.
    fn kernel(self, dimension: Dimension, spacing: f64) -> Smoothing {
        match self {
            Self::Exact => Smoothing::new(Kernel::Cubic, dimension, 2.1 * spacing),
            Self::Paper => Smoothing::new(Kernel::Cubic, dimension, 1.6 * spacing),
            Self::Kernel => Space::free(dimension, spacing).kernel(),
        }
    }
}

/// Derivatives and problems of Poisson on nodes that stand in disorder, as Lagrangian differencing dynamics has them.
pub(super) fn operators(context: &Context) -> anyhow::Result<Vec<Check>> {
    derivatives(context, &[(Weights::Exact, true), (Weights::Paper, false)])
}

/// The same as smoothed particles have them.
pub(super) fn kernels(context: &Context) -> anyhow::Result<Vec<Check>> {
    derivatives(context, &[(Weights::Kernel, true)])
}

/// The same with several weights, of which some are judged.
fn derivatives(context: &Context, all: &[(Weights, bool)]) -> anyhow::Result<Vec<Check>> {
    const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-9, iterations: 1000 };
    let mut checks = Vec::new();
    for (dimension, edges, name) in
        [(Dimension::Two, [16, 32, 64, 128], "plane"), (Dimension::Three, [8, 12, 18, 27], "space")]
    {
        for jitter in [0.1, 0.2] {
            for (weights, judged) in all.iter().copied() {
                let clouds = edges.map(|edge| Disorder::new(dimension, edge, jitter, weights));
                let with = weights.name();
                if judged {
                    let what = format!("linear field, {name}, disorder {jitter}");
                    checks.push(context.zero("linear", what, "", clouds[0].linear())?);
                }
                for (varies, of) in [(false, "constant"), (true, "variable")] {
                    let mut errors = Vec::new();
                    for cloud in &clouds {
                        errors.push(cloud.poisson(varies, &SETTINGS)?);
                    }
                    let what = format!("order, {name}, disorder {jitter}, {of} coefficient, {with}");
                    let order = observed_order(&edges, &errors);
                    let what_error = format!("error on the finest, {name}, disorder {jitter}, {of}, {with}");
                    checks.push(if judged {
                        context.at_least("order", what, order)?
                    } else {
                        shown(what, order)
                    });
                    checks.push(shown(what_error, errors[errors.len() - 1]));
                }
            }
        }
    }
    Ok(checks)
}

/// Nodes of a square or a cube of 1 m, so many to an edge and one more; those inside are up to a share of their spacing off the corners of a grid.
struct Disorder {
    dimension: Dimension,
    spacing: f64,
    nodes: Vec<DVec3>,
    near: Neighbours,
    weights: Weights,
}

impl Disorder {
    fn new(dimension: Dimension, edge: usize, jitter: f64, weights: Weights) -> Self {
        let spacing = 1.0 / edge as f64;
        let layers = if dimension == Dimension::Two { 1 } else { edge + 1 };
        let mut random = Pcg64Mcg::seed_from_u64(11);
        let mut nodes = Vec::new();
        for n in 0..(edge + 1) * (edge + 1) * layers {
            let corner = [n % (edge + 1), n / ((edge + 1) * (edge + 1)), n / (edge + 1) % (edge + 1)];
            let at = spacing * DVec3::from(corner.map(|k| k as f64));
            let [x, y, z] = [(); 3].map(|()| jitter * spacing * random.random_range(-1.0..1.0));
            let off = DVec3::new(x, if dimension == Dimension::Two { 0.0 } else { y }, z);
            nodes.push(if edge_of(dimension, at, spacing) { at } else { at + off });
        }
        let near = Neighbours::within(&nodes, weights.kernel(dimension, spacing).support());
        Self { dimension, spacing, nodes, near, weights }
    }

    /// What derivatives are formed with.
    fn gradients(&self) -> Gradients<'_> {
        let kernel = self.weights.kernel(self.dimension, self.spacing);
        let slope = matches!(self.weights, Weights::Kernel);
        let weight = move |_, _, r: f64| if slope { -kernel.slope(r) / r } else { kernel.weight(r) };
        Gradients::new(&self.nodes, &self.near, self.dimension, weight)
    }

    /// Largest error of the gradient of a linear field whose slope is 1, those on the edge included.
    fn linear(&self) -> f64 {
        let slope = match self.dimension {
            Dimension::Two => DVec3::new(0.6, 0.0, -0.8),
            Dimension::Three => DVec3::new(0.48, 0.64, -0.6),
        };
        let (f, gradients): (Vec<f64>, _) =
            (self.nodes.iter().map(|at| slope.dot(*at)).collect(), self.gradients());
        (0..f.len()).map(|n| gradients.gradient(n, &f).distance(slope)).fold(0.0, f64::max)
    }

    /// Error (root of the mean square) of the solution of -div(k grad f) = s with f = sin(2 x) cos(3 z) exp(y/2) given on the edge, k = 1 or 1 + x + z^2.
    fn poisson(&self, varies: bool, settings: &Settings) -> anyhow::Result<f64> {
        let value = |at: DVec3| (2.0 * at.x).sin() * (3.0 * at.z).cos() * (0.5 * at.y).exp();
        let k = |at: DVec3| if varies { 1.0 + at.x + at.z * at.z } else { 1.0 };
        let source = |at: DVec3| {
            let high = if self.dimension == Dimension::Two { 0.0 } else { 0.25 };
            let slope_x = 2.0 * (2.0 * at.x).cos() * (3.0 * at.z).cos() * (0.5 * at.y).exp();
            let slope_z = -3.0 * (2.0 * at.x).sin() * (3.0 * at.z).sin() * (0.5 * at.y).exp();
            let of_k = if varies { slope_x + 2.0 * at.z * slope_z } else { 0.0 };
            -k(at) * (high - 13.0) * value(at) - of_k
        };
        let given = |n: usize| edge_of(self.dimension, self.nodes[n], self.spacing);
        let coefficients: Vec<f64> = self.nodes.iter().map(|at| k(*at)).collect();
        let matrix =
            self.gradients().diffusion(&coefficients, given, !matches!(self.weights, Weights::Paper));
        let right: Vec<f64> = (0..self.nodes.len())
            .map(|n| if given(n) { value(self.nodes[n]) } else { source(self.nodes[n]) })
            .collect();
        let multigrid = Multigrid::<1, 1>::new(&matrix, &self.nodes, self.spacing);
        let mut f = vec![0.0; right.len()];
        solve(&matrix, Some(&multigrid), &right, &mut f, settings)?;
        let squares: f64 = self.nodes.iter().zip(&f).map(|(at, f)| (f - value(*at)).powi(2)).sum();
        Ok((squares / f.len() as f64).sqrt())
    }
}

/// Whether a place is on the edge of the square or cube.
fn edge_of(dimension: Dimension, at: DVec3, spacing: f64) -> bool {
    let on = |x: f64| !(0.5 * spacing..1.0 - 0.5 * spacing).contains(&x);
    on(at.x) || on(at.z) || (dimension == Dimension::Three && on(at.y))
}

/// The same slump by particles and by the lattice: what is at the lower side of y.
pub(super) fn both_methods(context: &Context) -> anyhow::Result<Vec<Check>> {
    held_against(context, "isph.toml", "lbm.toml", "")
}

/// The paper's slump in space, with its regularisation and with the exact law.
pub(super) fn slump_abrams(context: &Context) -> anyhow::Result<Vec<Check>> {
    let paper = held_against(context, "ldd-papanastasiou.toml", "lbm-papanastasiou.toml", ", m = 1 s")?;
    let exact = held_against(context, "ldd-exact.toml", "lbm-exact.toml", ", exact law")?;
    Ok([paper, exact].concat())
}

/// A slump by the case for particles or nodes, and by that for the lattice.
fn held_against(context: &Context, one: &str, other: &str, law: &str) -> anyhow::Result<Vec<Check>> {
    const TIMES: [f64; 6] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
    let run = |case: Case| -> anyhow::Result<Vec<Cells>> {
        let mut flow = Flow::new(case);
        TIMES.iter().map(|time| flow.until(*time).map(|()| flow.cells())).collect()
    };
    let particles = run(context.case(one)?)?;
    let lattice = run(context.case(other)?)?;
    let mut checks = Vec::new();
    for ((time, particles), lattice) in TIMES.iter().zip(&particles).zip(&lattice) {
        let what = format!("half of the spread at {time} s{law}");
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
    checks.push(context.zero(
        "profile",
        format!("profile at the end: difference over the volume{law}"),
        "",
        off,
    )?);
    checks.push(shown(
        format!("area of the profile by particles over that by the lattice{law}"),
        volume(&one) / volume(&other),
    ));
    Ok(checks)
}
