//! What a case means on the lattice: cells, time step, numbers, memory. Known before anything runs.

use tremie_case::{Case, Incoming, Inlet, Lbm, Method, Precision, Side};
use tremie_geometry::{Face, Motion};
use tremie_numerics::DVec3;
use tremie_suspension::Form;

use crate::scaling::{Flow, Limits, Scaling, time_step};
use crate::textbook;

/// Bytes for each allocated cell: two sets of populations and fill, shape of the surface, mass, kinds.
fn bytes_per_cell(precision: Precision) -> f64 {
    let real = match precision {
        Precision::F32 => 4.0,
        Precision::F64 => 8.0,
    };
    (2.0 * 19.0 + 10.0) * real + 8.0 + 3.0 / 8.0
}

/// Bytes that bodies take: velocities and forces in each allocated cell, and each body and its points.
fn bytes_of_bodies(case: &Case, lbm: &Lbm, allocated: f64, incoming: &[u64]) -> f64 {
    // What a body and a point keep, and what a step works out for them.
    const BODY: f64 = 400.0;
    const POINT: f64 = 110.0;
    if !case.has_bodies() {
        return 0.0;
    }
    let real = match lbm.precision {
        Precision::F32 => 4.0,
        Precision::F64 => 8.0,
    };
    let points = |form: &Form| match *form {
        Form::Fibre { length, .. } => length / lbm.cell_size + 1.0,
        Form::Sphere { .. } | Form::Ellipsoid { .. } => form.volume() / lbm.cell_size.powi(3),
    };
    let bodies = &case.inclusions;
    let body = |form: &Form| BODY + POINT * points(form);
    let first: f64 = (0..bodies.len()).map(|n| body(bodies.form(n))).sum();
    let later = case.incoming().zip(incoming).map(|((_, of), number)| *number as f64 * body(&of.form));
    first + later.sum::<f64>() + 2.0 * 4.0 * real * allocated
}

/// The numbers of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Scales between SI and lattice units.
    pub scaling: Scaling,
    /// Cells of the domain along each axis.
    pub cells: [usize; 3],
    /// Cells that hold fluid at the start.
    pub wet_cells: f64,
    /// Volume in m3 that comes in until the case's stop time.
    pub inflow: f64,
    /// Number of bodies that come in until then, in the order of [`Case::incoming`].
    pub incoming: Vec<u64>,
    /// Steps to the case's stop time.
    pub steps: f64,
    /// Height in m of the fluid along gravity.
    pub height: f64,
    /// Speed in m/s that the fluid may reach.
    pub reference_speed: f64,
    /// Relaxation time 3 nu + 1/2 at the plastic viscosity.
    pub relaxation_time: f64,
    /// Mach number of the reference speed.
    pub mach: f64,
    /// Relative density error of the hydrostatic pressure.
    pub hydrostatic_error: f64,
    /// Bingham number tau0 H / (mu U), with the yield stress of a regularised fluid too.
    pub bingham: f64,
    /// Reynolds number rho U H / mu.
    pub reynolds: f64,
    /// Expected memory for fields and bodies in bytes.
    pub memory: f64,
    /// How much of that is there for bodies.
    pub memory_of_bodies: f64,
}

/// The lattice settings of a case.
///
/// # Panics
/// If the case is for another method.
pub(crate) fn settings(case: &Case) -> &Lbm {
    match &case.method {
        Method::Lbm(lbm) => lbm,
        other => panic!("a case for the method {} is no case for a lattice", other.name()),
    }
}

/// The share of gravity that a free surface feels: none along periodic axes, where it drives a channel flow.
pub(crate) fn confined_gravity(case: &Case) -> DVec3 {
    let along = |axis: usize| match case.domain.sides[2 * axis] {
        Side::Periodic => 0.0,
        _ => case.domain.gravity[axis],
    };
    DVec3::new(along(0), along(1), along(2))
}

impl Plan {
    /// Works out the numbers of a case.
    pub fn new(case: &Case) -> Self {
        let lbm = settings(case);
        let density = case.material.density;
        let viscosity = case.material.curve.plastic_viscosity();
        let yield_stress = case.material.curve.viscoplastic().map_or(0.0, |fluid| fluid.yield_stress);
        let confined = confined_gravity(case);
        let gravity = confined.length();
        let height = fluid_height(case, confined.normalize_or_zero());

        let (low, high) = case.fluid_box();
        let fall = (high - low).dot(confined.normalize_or_zero().abs());
        // Without fluid at the start there is no box.
        let mut speed = if fall > 0.0 { (2.0 * gravity * fall).sqrt() } else { 0.0 };
        for side in &case.domain.sides {
            if let Side::Wall { velocity, .. } = side {
                speed = speed.max(velocity.length());
            }
        }
        for region in &case.fluid {
            speed = speed.max(region.velocity.length());
        }
        for solid in &case.solids {
            speed = speed.max(solid.motion.largest_speed(0.0));
        }
        if let Some(loaded) = case.loaded() {
            speed = speed
                .max(loaded.speed(density * fluid_volume(case), (high - low).dot(loaded.direction.abs())));
        }
        speed = speed.max(inflow_speed(case)).max(channel_speed(case, viscosity / density));

        let limits = Limits {
            lattice_viscosity: lbm.lattice_viscosity,
            lattice_speed: lbm.lattice_speed,
            hydrostatic_error: lbm.hydrostatic_error,
        };
        let tension = case.material.surface_tension;
        let flow = Flow { viscosity, density, gravity, height, tension, speed };
        let chosen = lbm.time_step.unwrap_or_else(|| time_step(lbm.cell_size, &flow, &limits));
        let scaling = Scaling { cell_size: lbm.cell_size, time_step: chosen, density };
        let wet_cells = fluid_volume(case) / lbm.cell_size.powi(3);
        let cells = case.domain.cells(lbm.cell_size);
        let inflow = inflow(case, case.stop.time);
        let due = |(n, of): (usize, &Incoming)| of.due(inflow_of(case, &case.inlets[n], case.stop.time));
        let incoming: Vec<u64> = case.incoming().map(due).collect();
        let all = cells.iter().product::<usize>() as f64;
        let most_cells = (wet_cells + inflow / lbm.cell_size.powi(3)).min(all);
        let memory = match lbm.textbook() {
            Some(textbook) => textbook::bytes_per_cell(textbook.lattice) * all,
            // Blocks of 8 x 8 x 8 cells around a body of that volume are filled to about a third.
            None => 3.0 * most_cells * bytes_per_cell(lbm.precision),
        };
        let memory_of_bodies = bytes_of_bodies(case, lbm, 3.0 * most_cells, &incoming);
        Self {
            scaling,
            cells,
            wet_cells,
            inflow,
            incoming,
            steps: (case.stop.time / chosen).ceil(),
            height,
            reference_speed: speed,
            relaxation_time: 3.0 * scaling.viscosity(viscosity) + 0.5,
            mach: scaling.velocity(speed) * 3f64.sqrt(),
            hydrostatic_error: scaling.hydrostatic_error(gravity, height),
            bingham: yield_stress * height / (viscosity * speed),
            reynolds: density * speed * height / viscosity,
            memory: memory + memory_of_bodies,
            memory_of_bodies,
        }
    }
}

/// Extent in m of the fluid along a direction.
fn fluid_height(case: &Case, direction: DVec3) -> f64 {
    let (mut low, mut high) = case.fluid_box();
    for inlet in &case.inlets {
        // What comes in falls to the end of the domain, and may rise to where it comes in.
        let end = DVec3::select(direction.cmpgt(DVec3::ZERO), case.domain.max, case.domain.min);
        let (min, max) = inlet.face.bounds(0.0);
        let (first, mut last) = inlet.motion.range(inlet.start, case.stop.time);
        if inlet.above_fill.is_some() {
            last.z = f64::INFINITY;
        }
        for corner in [min + first, max + last, end] {
            let corner = corner.clamp(case.domain.min, case.domain.max);
            (low, high) = (low.min(corner), high.max(corner));
        }
    }
    (high - low).dot(direction.abs()).max(0.0)
}

/// Speed in m/s that fluid may reach that comes in and falls on what has come in by then.
fn inflow_speed(case: &Case) -> f64 {
    // Falls are longest where motions, flows, or the time that is left begin or end.
    let turns = case.inlets.iter().flat_map(|inlet| {
        let points = match &inlet.motion {
            Motion::Path(points) => points.as_slice(),
            Motion::Uniform(_) | Motion::Through(..) => &[],
        };
        points.iter().map(|point| point.time).chain([inlet.start, inlet.end()])
    });
    let times: Vec<f64> = turns.chain([0.0, case.stop.time]).collect();
    let flows = |inlet: &Inlet, t: f64| (inlet.start..=inlet.end().min(case.stop.time)).contains(&t);
    let all = case.inlets.iter().flat_map(|inlet| times.iter().map(move |t| (inlet, *t)));
    all.filter(|(inlet, t)| flows(inlet, *t)).map(|(inlet, t)| fall(case, inlet, t)[1]).fold(0.0, f64::max)
}

/// Speed in m/s that fluid which comes in now, or until `soon` in s, has, or may reach if it has not had the time to fall yet. Twice the time
/// of a free fall is allowed for: viscous jets are slower. None if nothing comes in.
pub(crate) fn speed_of_first_fall(case: &Case, time: f64, soon: f64) -> Option<f64> {
    let speed = |inlet: &Inlet| {
        let [start, end] = fall(case, inlet, time.max(inlet.start));
        let falls = (time - inlet.start) * confined_gravity(case).length() <= 2.0 * (end - start);
        (inlet.start <= soon && time <= inlet.end()).then_some(if falls { end } else { start })
    };
    case.inlets.iter().filter_map(speed).reduce(f64::max)
}

/// Speeds in m/s with which fluid comes in at a time in s, and, if it fell freely, with which it gets to what has come in by then.
fn fall(case: &Case, inlet: &Inlet, time: f64) -> [f64; 2] {
    let gravity = confined_gravity(case);
    let end = DVec3::select(gravity.cmpgt(DVec3::ZERO), case.domain.max, case.domain.min);
    let way = end - inlet.face.centre - inlet.motion.offset(time);
    let drawn = way.dot(gravity.normalize_or_zero()) - level(case, time);
    let height = drawn.max(inlet.above_fill.map_or(0.0, |above| above.distance));
    let start = inlet.flow_rate / inlet.face.area();
    [start, (start * start + 2.0 * gravity.length() * height).sqrt()]
}

/// Height in m that all that has come in by a time in s would have in the domain without solids, if it lay level; zero where that is not known.
fn level(case: &Case, time: f64) -> f64 {
    let gravity = confined_gravity(case);
    let axis = gravity.abs().max_position();
    let above = 2 * axis + usize::from(gravity[axis] < 0.0);
    let leaves = (0..6).any(|side| side != above && case.domain.sides[side] == Side::Open);
    if leaves || !case.outlets.is_empty() || gravity[axis].abs() < gravity.length() * (1.0 - 1e-9) {
        return 0.0;
    }
    let size = case.domain.max - case.domain.min;
    inflow(case, time) / (size.x * size.y * size.z / size[axis])
}

/// Volume in m3 that comes into the domain until a time in s.
fn inflow(case: &Case, time: f64) -> f64 {
    case.inlets.iter().map(|inlet| inflow_of(case, inlet, time)).sum()
}

/// How much of that comes by one inlet.
fn inflow_of(case: &Case, inlet: &Inlet, time: f64) -> f64 {
    let face = Face { centre: inlet.face.centre + inlet.motion.offset(inlet.start), ..inlet.face };
    let share = face.share_within(case.domain.min, case.domain.max);
    inlet.flow_rate * (inlet.end().min(time) - inlet.start).max(0.0) * share
}

/// Volume of the fluid within the domain in m3, sampled on a coarse grid.
fn fluid_volume(case: &Case) -> f64 {
    const SAMPLES: usize = 60;
    if case.fluid.is_empty() {
        return 0.0;
    }
    let (low, high) = case.fluid_box();
    let size = high - low;
    let mut inside = 0usize;
    for n in 0..SAMPLES.pow(3) {
        let at = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
        let share = DVec3::new(at(n % SAMPLES), at(n / SAMPLES % SAMPLES), at(n / SAMPLES / SAMPLES));
        let p = low + size * share;
        inside += usize::from(case.fluid.iter().any(|region| region.shape.signed_distance(p) < 0.0));
    }
    inside as f64 / SAMPLES.pow(3) as f64 * size.x * size.y * size.z
}

/// Speed in m/s of the Newtonian channel flow that gravity along periodic axes would drive: an upper bound.
fn channel_speed(case: &Case, kinematic_viscosity: f64) -> f64 {
    let size = case.domain.max - case.domain.min;
    let periodic = |axis: usize| case.domain.sides[2 * axis] == Side::Periodic;
    let driving = (0..3).filter(|a| periodic(*a)).map(|a| case.domain.gravity[a].powi(2)).sum::<f64>().sqrt();
    let gap = (0..3).filter(|a| !periodic(*a)).map(|a| size[a]).fold(f64::INFINITY, f64::min);
    if driving > 0.0 && gap.is_finite() { driving * gap * gap / (2.0 * kinematic_viscosity) } else { 0.0 }
}
