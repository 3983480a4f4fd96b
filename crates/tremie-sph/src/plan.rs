//! What a case means for particles: how many, how long steps are, and how much memory they take. Known before anything runs.

use tremie_case::Case;
use tremie_cloud::Dimension;
use tremie_simulation::scattered::{self, Plan};

use crate::particles::{Particles, longest_fall};
use crate::setup;

/// Bytes that a particle takes, with its lists of neighbours and its rows of both linear systems while they are solved: an estimate.
const BYTES: [f64; 2] = [6e3, 3e4];

/// Works out the numbers of a case.
///
/// # Panics
/// If the case is for another method.
pub fn plan(case: &Case) -> Plan {
    let (space, _) = scattered::space(case);
    let (fluid, stepping) = (setup::fluid(case), setup::stepping(case));
    let (positions, velocities) = scattered::nodes(case, &space);
    let bytes = BYTES[if space.dimension == Dimension::Two { 0 } else { 1 }];
    let particles = Particles::new(positions.clone(), space.clone(), fluid, stepping);
    let length = space.smoothing_length();
    let step = |speed: f64| {
        let explicit = match stepping.explicit {
            true => particles.explicit_limit(fluid.largest_viscosity),
            false => f64::MAX,
        };
        let moving = (stepping.courant * length / speed).min(longest_fall(length, fluid.gravity));
        moving.min(stepping.longest).min(explicit)
    };
    Plan::new(case, &space, (&positions, &velocities), fluid.largest_viscosity, step, bytes)
}
