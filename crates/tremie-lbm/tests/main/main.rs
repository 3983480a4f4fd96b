//! The lattice Boltzmann method as a whole, through its door: what must hold whatever the case.

mod adaptive;
mod batches;
mod cages;
mod conservation;
mod fall;
mod fibre_field;
mod friction;
mod inclusions;
mod invariance;
mod loads;
mod passage;
mod pour;
mod rest;
mod solids;
mod textbook;
mod thixotropy;

use tremie_case::Case;
use tremie_simulation::{Cells, Fluid, Simulation};

/// A case of lattice Boltzmann flow with the given sections.
fn case(sections: &str) -> Case {
    let text = format!(
        "title = \"test\"\nmethod = \"lbm\"\n{sections}\n[gauges]\ninterval = \"10 ms\"\n[stop]\ntime = \"1 s\"\n"
    );
    match Case::parse("test.toml", &text) {
        Ok(case) => case,
        Err(error) => panic!("{error}"),
    }
}

/// A simulation after some steps.
fn advanced(case: &Case, steps: usize) -> Box<dyn Simulation> {
    let mut simulation = tremie_lbm::simulation(case);
    advance(&mut *simulation, steps);
    simulation
}

fn advance(simulation: &mut dyn Simulation, steps: usize) {
    for _ in 0..steps {
        if let Err(breakdown) = simulation.advance() {
            panic!("{breakdown}");
        }
    }
}

fn cells(simulation: &dyn Simulation) -> Cells {
    let Fluid::Cells(cells) = simulation.snapshot().fluid;
    cells
}
