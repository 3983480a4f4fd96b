//! What a case means to particles.

use tremie_case::{Case, Isph, Method, StrainConvention, StressStep};
use tremie_simulation::scattered::{dimension, largest_viscosity};

use tremie_cloud::Dimension;
use tremie_simulation::Wall;

use crate::{Fluid, Plate, Stepping};

/// Share of the time in which shear spreads over the gap below a plate that a step may take: a tenth of it in a gap that has closed to a third.
const SPREADS: f64 = 0.01;

/// Settings of a case for this method.
///
/// # Panics
/// If the case is for another method.
pub(crate) fn settings(case: &Case) -> &Isph {
    match &case.method {
        Method::Isph(isph) => isph,
        other => panic!("a case for the method {} is no case for particles", other.name()),
    }
}

/// The fluid of a case.
pub(crate) fn fluid(case: &Case) -> Fluid {
    let (settings, material) = (settings(case), &case.material);
    Fluid {
        density: material.density,
        curve: material.curve,
        largest_viscosity: settings.largest_viscosity.unwrap_or_else(|| largest_viscosity(case)),
        gravity: case.domain.gravity,
        as_printed: settings.strain_convention == StrainConvention::Paper,
    }
}

/// The plate that a load moves in a case; `whose` walls those of the particles are.
pub(crate) fn plate(case: &Case, whose: &[Wall]) -> Option<Plate> {
    let loaded = case.loaded()?;
    let wall = whose.iter().position(|whose| *whose == Wall::Solid(loaded.solid))?;
    // In a plane all is per metre of depth.
    let deep = match dimension(case) {
        Dimension::Two => settings(case).spacing,
        Dimension::Three => 1.0,
    };
    let (force, mass) = (loaded.force / deep, loaded.mass / deep);
    Some(Plate { wall, direction: loaded.direction, force, mass, way: 0.0, speed: 0.0 })
}

/// Longest step in s in which the pressure that a load needs is found: what holds it up is friction along the plates, which pressure and viscous part, found one after the other, agree upon only if
/// it takes longer to spread over the gap.
fn settled(case: &Case) -> f64 {
    let Some(loaded) = case.loaded() else { return f64::INFINITY };
    let (low, high) = case.fluid_box();
    let gap = (high - low).dot(loaded.direction.abs());
    SPREADS * case.material.density * gap * gap / case.material.curve.plastic_viscosity()
}

/// How steps of a case are taken.
pub(crate) fn stepping(case: &Case) -> Stepping {
    let settings = settings(case);
    Stepping {
        courant: settings.courant,
        longest: settings.time_step.unwrap_or(f64::INFINITY).min(case.gauges.interval).min(settled(case)),
        explicit: settings.stress == StressStep::Explicit,
    }
}
