//! Time steps that grow: the flow must not see it.

use tremie_simulation::{Cells, Simulation};

use crate::{advance, advanced, case, cells};

/// A planar slump of Bingham fluid in cells of 10 mm.
fn slump(stepping: &str) -> Box<dyn Simulation> {
    let text = format!(
        "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"30 Pa\"\nplastic_viscosity = \"20 Pa.s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.7 m\", \"10 mm\", \"0.22 m\"]\n\
         [domain.sides]\nx_min = \"symmetry\"\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"10 mm\", \"0.2 m\"] }}\n\
         [lbm]\ncell_size = \"10 mm\"\nstepping = \"{stepping}\"\n"
    );
    advanced(&case(&text), 0)
}

fn until(simulation: &mut dyn Simulation, time: f64) -> usize {
    let mut steps = 0;
    while simulation.time() < time {
        advance(simulation, 1);
        steps += 1;
    }
    steps
}

/// Distance to which the floor is covered, and volume, in cells.
fn length_and_volume(cells: &Cells) -> (f64, f64) {
    let floor: f64 = (0..cells.count[0]).map(|i| cells.fill[cells.index(i, 0, 0)]).sum();
    (floor, cells.fill.iter().sum())
}

#[test]
fn a_slump_ends_the_same_in_fewer_steps() {
    let (mut fixed, mut adaptive) = (slump("fixed"), slump("adaptive"));
    let (many, few) = (until(&mut *fixed, 10.0), until(&mut *adaptive, 10.0));
    assert!(3 * few < 2 * many, "{few} steps against {many}");
    let (a, b) = (length_and_volume(&cells(&*fixed)), length_and_volume(&cells(&*adaptive)));
    assert!((b.0 / a.0 - 1.0).abs() < 0.01, "{a:?} {b:?}");
    assert!((b.1 / 200.0 - 1.0).abs() < 3e-3, "{b:?}");
}

#[test]
fn a_change_of_the_step_changes_little_else_and_mends_the_volume() {
    let mut simulation = slump("adaptive");
    let (mut changes, mut compared) = (0, 0);
    while simulation.time() < 6.0 {
        let (before, step) = (cells(&*simulation), simulation.time_step());
        advance(&mut *simulation, 1);
        if simulation.time_step() == step {
            continue;
        }
        changes += 1;
        let after = cells(&*simulation);
        assert!((length_and_volume(&after).1 / 200.0 - 1.0).abs() < 1e-3);
        // A step that changes is a step like any other: what it does to speed, pressure and stress is little.
        let speed = |cells: &Cells| cells.velocity.iter().map(|u| u.length()).collect::<Vec<_>>();
        for (a, b) in [
            (speed(&before), speed(&after)),
            (before.pressure.clone(), after.pressure.clone()),
            (before.stress.clone(), after.stress.clone()),
        ] {
            if before.count == after.count {
                let change: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum();
                let all: f64 = a.iter().map(|a| a.abs()).sum();
                assert!(change < 0.05 * all, "{change} of {all}");
                compared += 1;
            }
        }
    }
    assert!(compared > 0);
    assert!(changes > 1, "{changes}");
}
