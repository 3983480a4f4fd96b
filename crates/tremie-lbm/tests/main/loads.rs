//! What walls bear.

use tremie_numerics::DVec3;
use tremie_simulation::{Fluid, Snapshot, Wall, WallFace};

use crate::{advance, advanced, case};

const WEIGHT: f64 = 9.81;

/// Sides, solids and inlets, all together.
fn total(snapshot: &Snapshot) -> DVec3 {
    let walls = &snapshot.walls;
    walls.sides.iter().chain(&walls.inlets).chain(&snapshot.solids).map(|load| load.force).sum()
}

#[test]
fn a_tank_at_rest_presses_on_its_walls_as_a_fluid_at_rest_does() {
    // A box stands in a corner of it; the other half of the tank is a mirror image.
    let (level, density) = (0.1537, 1000.0);
    let text = format!(
        "[material]\ndensity = \"{density} kg/m3\"\n[material.newtonian]\nviscosity = \"1 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.1 m\", \"0.1 m\", \"0.2 m\"]\n\
         sides = {{ y_max = \"symmetry\" }}\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"0.1 m\", \"{level} m\"] }}\n\
         [[solid]]\nbox = {{ min = [\"0.07 m\", \"-0.1 m\", \"-0.1 m\"], max = [\"0.2 m\", \"0.04 m\", \"0.05 m\"] }}\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\nhydrostatic_error = \"0.01 %\"\n"
    );
    let simulation = advanced(&case(&text), 20_000);
    let snapshot = simulation.snapshot();
    // The fluid above the box is at rest too.
    let volume = 0.1 * 0.1 * level - 0.03 * 0.04 * 0.05;
    let weight = density * WEIGHT * volume;
    let force = total(&snapshot);
    assert!((force - DVec3::new(0.0, 0.0, -weight)).length() < 1e-4 * weight, "{force} {weight}");
    let upright = |length: f64, from: f64| 0.5 * density * WEIGHT * (level - from).powi(2) * length;
    let [x_min, .., y_max, z_min, _] = snapshot.walls.sides.map(|load| load.force);
    // Up to the surface, which lies within a cell: its share of the force is known to half a cell's own weight.
    let within = |force: f64, exact: f64| (force / exact - 1.0).abs() < 2e-3;
    assert!(within(-x_min.x, upright(0.1, 0.0)), "{x_min}");
    assert!(within(y_max.y, upright(0.1, 0.0)), "{y_max}");
    assert!(within(-z_min.z, density * WEIGHT * level * (0.01 - 0.03 * 0.04)), "{z_min}");
    let depth = level - 0.05;
    let solid = snapshot.solids[0].force;
    assert!(within(-solid.z, density * WEIGHT * depth * 0.03 * 0.04), "{solid}");
    assert!(within(solid.x, upright(0.04, 0.0) - upright(0.04, 0.05)), "{solid}");
    // Where the wall goes on beyond a cell, cell by cell; what the pressure adds to the density is a hundredth of a per cent.
    for face in
        snapshot.walls.faces.iter().filter(|face| face.fill > 0.999 && (face.area / 1e-4 - 1.0).abs() < 1e-6)
    {
        let bottom = face.wall == Wall::Side(4) || matches!(face.wall, Wall::Solid(_)) && face.cell.z > 0.05;
        let exact = density * WEIGHT * (level - face.cell.z + if bottom { 0.005 } else { 0.0 });
        assert!((face.force / face.area / exact - 1.0).abs() < 1e-3, "{face:?}, {exact} Pa");
    }
}

#[test]
fn a_wall_that_bears_weight_is_pressed_less() {
    // Between walls that rise slowly a Bingham fluid hangs by its wall stress t: p grows by rho g - 2 t/e over the depth. The walls drag up as much
    // as sinks between them, at the mean speed U of the walls: t from plane Poiseuille flow, U = t e/(6 mu) (1 - 3/2 f + f^3/2) with f = tau0/t.
    let (density, yield_stress, viscosity, width, speed) = (2300.0, 200.0, 20.0, 0.08, 5e-3);
    let text = format!(
        "[material]\ndensity = \"{density} kg/m3\"\n\
         [material.bingham]\nyield_stress = \"{yield_stress} Pa\"\nplastic_viscosity = \"{viscosity} Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"{width} m\", \"5 mm\", \"0.5 m\"]\n\
         [domain.sides]\ny_min = \"periodic\"\ny_max = \"periodic\"\n\
         x_min = {{ velocity = [\"0 m/s\", \"0 m/s\", \"{speed} m/s\"] }}\n\
         x_max = {{ velocity = [\"0 m/s\", \"0 m/s\", \"{speed} m/s\"] }}\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"{width} m\", \"5 mm\", \"0.4 m\"] }}\n\
         [lbm]\ncell_size = \"5 mm\"\nprecision = \"f64\"\n"
    );
    let (mut low, mut high) = (yield_stress, 3.0 * yield_stress);
    for _ in 0..60 {
        let stress = 0.5 * (low + high);
        let f: f64 = yield_stress / stress;
        let mean = stress * width / (6.0 * viscosity) * (1.0 - 1.5 * f + 0.5 * f.powi(3));
        if mean < speed { low = stress } else { high = stress }
    }
    let mut simulation = advanced(&case(&text), 0);
    while simulation.time() < 1.5 {
        advance(&mut *simulation, 100);
    }
    let snapshot = simulation.snapshot();
    let at = |z: f64| {
        let near = |face: &&WallFace| face.wall == Wall::Side(0) && (face.cell.z - z).abs() < 1e-6;
        let face = snapshot.walls.faces.iter().find(near).expect("there is wall");
        face.force / face.area
    };
    // Away from bottom and surface by more than the width.
    let growth = (at(0.1025) - at(0.2775)) / 0.175;
    let exact = density * WEIGHT - 2.0 * low / width;
    assert!((growth / exact - 1.0).abs() < 0.02, "{growth} Pa/m, {exact} Pa/m, wall stress {low} Pa");
    let (weight, borne) = (density * WEIGHT * width * 5e-3 * 0.4, total(&snapshot));
    assert!((borne.z + weight).abs() < 0.01 * weight, "{borne} N, {weight} N");
}

#[test]
fn a_sheet_over_a_void_keeps_its_momentum() {
    // It goes over a film at rest without weight, with a void in between: cells of the film's surface have no air around. They take the cells of the
    // sheet for air; if those did not take them for air, the sheet would stop within 0.1 s, and nothing would get its momentum.
    let text = "[material]\ndensity = \"1000 kg/m3\"\nnewtonian.viscosity = \"10 Pa s\"\n\
                [domain]\nmin = [\"0 mm\", \"0 mm\", \"0 mm\"]\nmax = [\"40 mm\", \"40 mm\", \"120 mm\"]\n\
                gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
                sides = { x_min = \"periodic\", x_max = \"periodic\", y_min = \"periodic\", y_max = \"periodic\" }\n\
                [[fluid]]\nbox = { min = [\"-1 m\", \"-1 m\", \"0 mm\"], max = [\"1 m\", \"1 m\", \"45 mm\"] }\n\
                [[fluid]]\nbox = { min = [\"-1 m\", \"-1 m\", \"50 mm\"], max = [\"1 m\", \"1 m\", \"56 mm\"] }\n\
                velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]\n\
                [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n";
    let mut simulation = advanced(&case(text), 0);
    let momentum = |snapshot: &Snapshot| -> DVec3 {
        let Fluid::Cells(cells) = &snapshot.fluid;
        cells.fill.iter().zip(&cells.velocity).map(|(fill, u)| *fill * *u).sum()
    };
    let before = momentum(&simulation.snapshot());
    let mut borne = DVec3::ZERO;
    while simulation.time() < 0.5 {
        advance(&mut *simulation, 1);
        borne += total(&simulation.snapshot());
    }
    let after = momentum(&simulation.snapshot());
    assert!(before.x > 0.0 && (after - before).length() < 1e-9 * before.x, "{after} of {before}");
    // The floor bears none of it.
    assert!(borne.x.abs() < 1e-9, "{borne}");
}

#[test]
fn a_plate_that_comes_down_presses_without_jumps() {
    // A block of Bingham fluid at a Reynolds number of 5 under a plate that starts at its full speed. It covers a row of cells every 50 ms, and meets more of
    // the fluid each time.
    let text = "[material]\ndensity = \"2000 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"2 Pa\"\nplastic_viscosity = \"4 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.3 m\", \"5 mm\", \"0.11 m\"]\n\
         gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
         sides = { x_min = \"symmetry\", y_min = \"periodic\", y_max = \"periodic\" }\n\
         [[fluid]]\nbox = { min = [\"-1 m\", \"-1 m\", \"0 m\"], max = [\"50 mm\", \"1 m\", \"0.1 m\"] }\n\
         [[solid]]\nbox = { min = [\"-1 m\", \"-1 m\", \"0.1 m\"], max = [\"1 m\", \"1 m\", \"2 m\"] }\n\
         motion.uniform.velocity = [\"0 m/s\", \"0 m/s\", \"-0.1 m/s\"]\n\
         [lbm]\ncell_size = \"5 mm\"\nprecision = \"f64\"\nlattice_speed = 0.01\nbulk_relaxation = 0.2\n";
    let mut simulation = advanced(&case(text), 0);
    let mut before: Option<f64> = None;
    while simulation.time() < 0.45 {
        advance(&mut *simulation, 1);
        // Until then it rings.
        if simulation.time() < 0.2 {
            continue;
        }
        let now = simulation.snapshot().solids[0].force.z;
        if let Some(before) = before {
            // By three quarters and more, up and down, if each step is told by itself, or the plate pushes whatever lies below a row that it covers.
            assert!((now / before).ln().abs() < 0.6, "{} s: {before} N, {now} N", simulation.time());
        }
        before = Some(now);
    }
}

#[test]
fn a_plate_under_a_load_bears_it_while_it_meets_more_and_more_fluid() {
    let load = 0.01;
    let text = format!(
        "[material]\ndensity = \"2000 kg/m3\"\n[material.newtonian]\nviscosity = \"20 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.3 m\", \"5 mm\", \"0.11 m\"]\n\
         gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
         sides = {{ x_min = \"symmetry\", y_min = \"periodic\", y_max = \"periodic\" }}\n\
         [[fluid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"0 m\"], max = [\"50 mm\", \"1 m\", \"0.1 m\"] }}\n\
         [[solid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"0.1 m\"], max = [\"1 m\", \"1 m\", \"2 m\"] }}\n\
         motion.load = {{ force = [\"0 N\", \"0 N\", \"-{load} N\"], mass = \"0 kg\" }}\n\
         [lbm]\ncell_size = \"5 mm\"\nprecision = \"f64\"\n"
    );
    let mut simulation = advanced(&case(&text), 2000);
    // It covers four rows in that time.
    let (mut borne, mut readings) = (0.0, 0.0);
    while simulation.time() < 4.0 {
        advance(&mut *simulation, 10);
        // The other half bears as much.
        borne += 2.0 * simulation.snapshot().solids[0].force.z;
        readings += 1.0;
    }
    assert!((borne / readings / load - 1.0).abs() < 0.01, "{} N", borne / readings);
}
