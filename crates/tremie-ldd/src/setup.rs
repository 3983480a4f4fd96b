//! What a case means to nodes.

use tremie_case::{Case, Ldd, LddCoupling, LddLaplacian, LddScheme, Method};
use tremie_simulation::scattered::largest_viscosity;

use crate::{Coupling, Fluid, Operators, Scheme, Stepping};

/// Settings of a case for this method.
///
/// # Panics
/// If the case is for another method.
pub(crate) fn settings(case: &Case) -> &Ldd {
    match &case.method {
        Method::Ldd(ldd) => ldd,
        other => panic!("a case for the method {} is no case for nodes", other.name()),
    }
}

/// The fluid of a case.
pub(crate) fn fluid(case: &Case) -> Fluid {
    Fluid {
        density: case.material.density,
        curve: case.material.curve,
        largest_viscosity: settings(case).largest_viscosity.unwrap_or_else(|| largest_viscosity(case)),
        gravity: case.domain.gravity,
    }
}

/// How steps of a case are taken.
pub(crate) fn stepping(case: &Case) -> Stepping {
    let settings = settings(case);
    Stepping {
        courant: settings.courant,
        longest: settings.time_step.unwrap_or(f64::INFINITY).min(case.gauges.interval),
        coupling: match settings.coupling {
            LddCoupling::Incremental => Coupling::Incremental,
            LddCoupling::PressureFirst => Coupling::PressureFirst,
        },
        scheme: match settings.scheme {
            LddScheme::Lagged => Scheme::Lagged,
            LddScheme::Implicit => Scheme::Implicit,
            LddScheme::Paper => Scheme::Paper,
        },
        operators: match settings.laplacian {
            LddLaplacian::Exact => Operators::Exact,
            LddLaplacian::Paper => Operators::Paper,
        },
    }
}
