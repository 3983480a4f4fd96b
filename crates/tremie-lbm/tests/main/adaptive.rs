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

/// A pool 50 mm deep that stands by its yield stress, and what else is given in mm along x and z, in cells of 10 mm.
fn pool(more: &str) -> Box<dyn Simulation> {
    let text = format!(
        "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"400 Pa\"\nplastic_viscosity = \"20 Pa.s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.3 m\", \"10 mm\", \"0.22 m\"]\n\
         [domain.sides]\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.3 m\", \"10 mm\", \"50 mm\"] }}\n\
         {more}\
         [lbm]\ncell_size = \"10 mm\"\nstepping = \"adaptive\"\n"
    );
    advanced(&case(&text), 0)
}

#[test]
fn a_film_high_up_a_wall_does_not_hold_the_step_small() {
    let film =
        "[[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"50 mm\"], max = [\"10 mm\", \"10 mm\", \"0.2 m\"] }\n";
    let (mut with, alone) = (pool(film), pool(""));
    assert!(with.time_step() < 0.6 * alone.time_step());
    until(&mut *with, 1.0);
    assert!(cells(&*with).fill[cells(&*with).index(0, 0, 18)] > 0.99, "the film stays where it is");
    assert!(with.time_step() > 0.85 * alone.time_step(), "{} {}", with.time_step(), alone.time_step());
}

/// How much a quantity changes between two snapshots of the same cells, as a share of all of it.
fn change(a: &[f64], b: &[f64]) -> f64 {
    let change: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
    change / a.iter().map(|a| a.abs()).sum::<f64>()
}

/// Speed, pressure and stress of all cells.
fn quantities(cells: &Cells) -> [Vec<f64>; 3] {
    let speed = cells.velocity.iter().map(|u| u.length()).collect();
    [speed, cells.pressure.clone(), cells.stress.clone()]
}

#[test]
fn a_step_that_changes_is_a_step_like_any_other() {
    let mut simulation = slump("adaptive");
    let (mut changes, mut compared) = (0, 0);
    // The cells before the last step and after it.
    let mut last = [cells(&*simulation), cells(&*simulation)];
    while simulation.time() < 6.0 {
        let step = simulation.time_step();
        advance(&mut *simulation, 1);
        let now = cells(&*simulation);
        let [before, after] = &last;
        if simulation.time_step() != step {
            changes += 1;
            assert!((length_and_volume(&now).1 / 200.0 - 1.0).abs() < 1e-3);
            if before.count == after.count && after.count == now.count {
                compared += 1;
                let [a, b, c] = [before, after, &now].map(quantities);
                for n in 0..3 {
                    let (usual, this) = (change(&a[n], &b[n]), change(&b[n], &c[n]));
                    // Steps are up to twice as long from here on, so that the fields may change by twice as much.
                    assert!(this < 2.5 * usual, "quantity {n}: {this} after {usual}");
                }
            }
        }
        let [_, after] = last;
        last = [after, now];
    }
    assert!(compared > 0);
    assert!(changes > 1, "{changes}");
}
