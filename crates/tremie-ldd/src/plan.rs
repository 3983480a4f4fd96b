//! What a case means for nodes: how many, how long steps are, and how much memory they take. Known before anything runs.

use tremie_case::Case;
use tremie_simulation::scattered::{self, Plan};

use crate::nodes::{bytes_of_node, longest_step};
use crate::setup;

/// Works out the numbers of a case.
///
/// # Panics
/// If the case is for another method.
pub fn plan(case: &Case) -> Plan {
    let (space, _) = scattered::space(case);
    let (fluid, stepping) = (setup::fluid(case), setup::stepping(case));
    let (positions, velocities) = scattered::nodes(case, &space);
    let step = |speed: f64| longest_step(space.spacing, speed, &stepping, fluid.gravity);
    let bytes = bytes_of_node(space.dimension);
    Plan::new(case, &space, (&positions, &velocities), fluid.largest_viscosity, step, bytes)
}
