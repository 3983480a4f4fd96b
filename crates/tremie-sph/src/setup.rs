//! What a case means to particles.

use tremie_case::{Case, Isph, Method, StrainConvention, StressStep};
use tremie_simulation::scattered::largest_viscosity;

use crate::{Fluid, Stepping};

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

/// How steps of a case are taken.
pub(crate) fn stepping(case: &Case) -> Stepping {
    let settings = settings(case);
    Stepping {
        courant: settings.courant,
        longest: case.gauges.interval,
        explicit: settings.stress == StressStep::Explicit,
    }
}
