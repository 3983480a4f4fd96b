//! What a case means to nodes of a fluid: where they are, and between which walls.

use tremie_case::{Case, Side, Surface};
use tremie_cloud::{Dimension, Space, Wall};
use tremie_geometry::{Body, Motion, Shape};
use tremie_numerics::DVec3;

/// Strain under half of the yield stress until the stop time by which fluid that has not yielded may creep.
const CREEP: f64 = 0.01;
/// Viscosities over the plastic viscosity that the largest one is at least.
const STIFF: f64 = 1000.0;

/// Whether a case is one in a plane: it is one node deep along y, and nothing bounds it there.
pub fn dimension(case: &Case) -> Dimension {
    let open = |side: &Side| matches!(side, Side::Periodic | Side::Symmetry);
    let deep = case.domain.cells(case.method.resolution())[1];
    if deep == 1 && case.domain.sides[2..4].iter().all(open) { Dimension::Two } else { Dimension::Three }
}

/// Slip length in m of a surface.
fn slip_length(surface: Surface) -> f64 {
    match surface {
        // A case with a film is refused.
        Surface::NoSlip | Surface::Film { .. } => 0.0,
        Surface::FreeSlip => f64::INFINITY,
        Surface::Navier { slip_length } => slip_length,
    }
}

/// The space of a case: walls are the sides of the domain, then its solids. With each wall's number comes that of its side or solid.
pub fn space(case: &Case) -> (Space, Vec<crate::Wall>) {
    let (domain, dimension) = (&case.domain, dimension(case));
    let flat = |axis: usize| dimension == Dimension::Two && axis == 1;
    let (mut walls, mut whose) = (Vec::new(), Vec::new());
    let mut periodic = [false; 3];
    for (number, side) in domain.sides.iter().enumerate().filter(|(number, _)| !flat(number / 2)) {
        let lower = number % 2 == 0;
        let (point, inward) = if lower { (domain.min, 1.0) } else { (domain.max, -1.0) };
        let (sliding, slip_length) = match *side {
            Side::Wall { velocity, surface } => (velocity, slip_length(surface)),
            Side::Symmetry => (DVec3::ZERO, f64::INFINITY),
            Side::Periodic => {
                periodic[number / 2] = true;
                continue;
            }
            Side::Open => continue,
        };
        let normal = inward * DVec3::AXES[number / 2];
        let body = Body::Shape(Shape::HalfSpace { point, normal });
        walls.push(Wall { body, motion: Motion::REST, sliding, slip_length, hides: false });
        whose.push(crate::Wall::Side(number));
    }
    for (number, solid) in case.solids.iter().enumerate() {
        walls.push(Wall {
            body: solid.body.clone(),
            motion: solid.motion.clone(),
            sliding: DVec3::ZERO,
            slip_length: slip_length(solid.surface),
            hides: true,
        });
        whose.push(crate::Wall::Solid(number));
    }
    let spacing = case.method.resolution();
    (Space { dimension, spacing, low: domain.min, high: domain.max, periodic, walls }, whose)
}

/// A shear rate in 1/s that fluid between nodes does not reach.
const FASTEST: f64 = 1e4;

/// The viscosity in Pa s by which fluid under half of its yield stress creeps by so little until the stop time; without a yield stress there is no bound.
pub fn largest_viscosity(case: &Case) -> f64 {
    let curve = &case.material.curve;
    let at_rest = curve.viscosity(0.0);
    match curve.viscoplastic() {
        // What thickens is so viscous at the largest rate that matters.
        _ if at_rest.is_finite() => at_rest.max(curve.viscosity(FASTEST)),
        Some(law) if law.yield_stress > 0.0 => {
            let creeping = 0.5 * law.yield_stress * case.stop.time.max(1.0) / CREEP;
            creeping.max(STIFF * curve.plastic_viscosity())
        }
        // Fluids that thin without bounds are as stiff at rest as they are at the least rate that matters.
        _ => curve.viscosity(1e-3).max(STIFF * curve.plastic_viscosity()),
    }
}

/// Where nodes of a case are at first, and how they move in m/s: those of a lattice that are in the fluid and in no solid.
pub fn nodes(case: &Case, space: &Space) -> (Vec<DVec3>, Vec<DVec3>) {
    let (spacing, domain) = (space.spacing, &case.domain);
    let [nx, ny, nz] = domain.cells(spacing);
    let solids: Vec<(&Body, DVec3)> =
        case.solids.iter().map(|solid| (&solid.body, solid.motion.offset(0.0))).collect();
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    for n in 0..nx * ny * nz {
        let place = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64);
        let at = domain.min + spacing * (place + 0.5);
        let region = case.fluid.iter().find(|region| region.shape.signed_distance(at) < 0.0);
        let Some(region) = region else { continue };
        if solids.iter().all(|(body, offset)| body.signed_distance(at - *offset) > 0.0) {
            positions.push(at);
            velocities.push(region.velocity);
        }
    }
    (positions, velocities)
}

/// Speed in m/s that the load on a solid may give so many nodes.
pub(super) fn pressed_speed(case: &Case, number: usize) -> f64 {
    let mass = number as f64 * case.material.density * case.method.resolution().powi(3);
    case.loaded().map_or(0.0, |loaded| {
        let (low, high) = case.fluid_box();
        loaded.speed(mass, (high - low).dot(loaded.direction.abs()))
    })
}
