//! Solids in the domain: what they do to the fluid, and it to them.

use std::f64::consts::PI;

use tremie_lbm::lattice_boltzmann;
use tremie_numerics::DVec3;
use tremie_simulation::{Cells, Fluid, Simulation};

use crate::{advance, advanced, case, cells};

const THIN: &str = "[material]\ndensity = \"1000 kg/m3\"\nnewtonian.viscosity = \"1 Pa s\"\n";
const CONCRETE: &str = "[material]\ndensity = \"2300 kg/m3\"\n\
     bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"20 Pa s\" }\n";

/// Mean velocity over the fluid in m/s.
fn mean_velocity(cells: &Cells) -> DVec3 {
    let weighed = cells.velocity.iter().zip(&cells.fill).map(|(u, fill)| *u * *fill);
    weighed.sum::<DVec3>() / cells.fill.iter().sum::<f64>()
}

#[test]
fn a_plate_under_a_fluid_bears_its_weight() {
    let text = format!(
        "{THIN}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.1 m\", \"0.08 m\", \"0.2 m\"]\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"0.1 m\", \"0.1537 m\"] }}\n\
         [[solid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"0.03 m\"] }}\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\nhydrostatic_error = \"0.1 %\"\n"
    );
    let load = advanced(&case(&text), 3000).snapshot().solids[0];
    let weight = 1000.0 * 9.81 * 0.1 * 0.08 * 0.1237;
    assert!((load.force.z / -weight - 1.0).abs() < 5e-3, "{load:?} {weight}");
    assert!(load.force.x.abs() < 1e-3 * weight && load.force.y.abs() < 1e-3 * weight, "{load:?}");
    // The weight acts in the middle.
    let moment = DVec3::new(0.05, 0.04, 0.0).cross(load.force);
    assert!((load.moment - moment).length() < 1e-3 * weight * 0.1, "{load:?} {moment}");
}

#[test]
fn a_plate_that_moves_drags_as_a_side_that_moves() {
    let channel = |height: &str, sides: &str, solid: &str| {
        format!(
            "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"80 mm\", \"10 mm\", \"{height}\"]\n\
             gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
             sides = {{ x_min = \"periodic\", x_max = \"periodic\", y_min = \"periodic\", y_max = \"periodic\"{sides} }}\n\
             [[fluid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }}\n{solid}\n\
             [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\ntime_step = \"1 ms\"\n"
        )
    };
    let side = channel("120 mm", ", z_max = { velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] }", "");
    let solid = "[[solid]]\nbox = { min = [\"-9 m\", \"-9 m\", \"0.12 m\"], max = [\"9 m\", \"9 m\", \"9 m\"] }\n\
                 motion.uniform.velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]";
    let (by_side, by_solid) =
        (advanced(&case(&side), 2000), advanced(&case(&channel("150 mm", "", solid)), 2000));
    let (a, b) = (cells(&*by_side), cells(&*by_solid));
    for k in 0..12 {
        let (u, v) = (a.velocity[a.index(3, 0, k)].x, b.velocity[b.index(3, 0, k)].x);
        // A solid drags with the density at hand, a side with the mean density.
        assert!((u / v - 1.0).abs() < 1e-5, "{k}: {u} {v}");
        assert!(u > 0.0);
    }
    // The plate drags with the stress that the fluid has everywhere; friction holds it back.
    let drag = by_solid.snapshot().solids[0].force.x;
    let stress = b.stress[b.index(3, 0, 6)];
    assert!((-drag / (0.08 * 0.01) / stress - 1.0).abs() < 0.02, "{drag} {stress}");
}

#[test]
fn fluid_sticks_to_plates_that_lie_anywhere_between_cells() {
    // Flow under a body force between plates at z0 and z1; of Bingham fluid, too, which yields up to the distance y_p from them.
    let (density, gravity, viscosity) = (1000.0, 1e-3, 1.0);
    for (z0, z1) in [(0.0205, 0.1297), (0.0233, 0.1216), (0.0241, 0.1249), (0.0281, 0.1301)] {
        for yield_stress in [0.0, 0.02] {
            let text = format!(
                "[material]\ndensity = \"{density} kg/m3\"\n\
                 bingham = {{ yield_stress = \"{yield_stress} Pa\", plastic_viscosity = \"{viscosity} Pa s\" }}\n\
                 [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"10 mm\", \"10 mm\", \"150 mm\"]\n\
                 gravity = [\"{gravity} m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
                 sides = {{ x_min = \"periodic\", x_max = \"periodic\", y_min = \"periodic\", y_max = \"periodic\" }}\n\
                 [[fluid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }}\n\
                 [[solid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"{z0} m\"] }}\n\
                 [[solid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"{z1} m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }}\n\
                 [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\ntime_step = \"16 ms\"\n"
            );
            let flow = cells(&*advanced(&case(&text), 4000));
            let driving = density * gravity;
            let yielded = 0.5 * (z1 - z0) - yield_stress / driving;
            let speed = |y: f64| driving / viscosity * (yielded * y - 0.5 * y * y);
            for k in (0..15).filter(|k| flow.fill[flow.index(0, 0, *k)] > 0.0) {
                let z = 0.01 * (k as f64 + 0.5);
                let exact = speed((z - z0).min(z1 - z).min(yielded));
                let found = flow.velocity[flow.index(0, 0, k)].x;
                // Between a wall and a cell the flow counts as linear: at the distance d the cell lacks d (2 d - 1)/4, in cells, of the parabola.
                let parabola = 0.26 * driving / viscosity * 1e-4;
                assert!(
                    (found - exact).abs() < parabola,
                    "{z0} to {z1}, {yield_stress} Pa, {z}: {found} {exact}"
                );
            }
        }
    }
}

#[test]
fn drag_on_a_sphere_in_a_cubic_array() {
    // Sangani and Acrivos 1982, Eq. 46 and Table 1 (after Hasimoto 1959): F = 6 pi mu a U K with the mean velocity U.
    let (edge, diameter, gravity, viscosity) = (0.24, 0.12, 1e-3, 1.0);
    let share: f64 = PI / 6.0 * f64::powi(diameter / edge, 3);
    let c = share.cbrt();
    let resistance =
        1.0 / (1.0 - 1.7601 * c + share - 1.5593 * share.powi(2) + 3.9799 * c.powi(8) - 3.0734 * c.powi(10));
    // The pressure gradient that drives the flow in the reference also acts on the sphere's volume.
    let whole = 1000.0 * gravity * f64::powi(edge, 3);
    let off = |n: f64, shift: f64| {
        let size = edge / n;
        let (at, step) = (0.5 * edge + shift * size, 160.0 * size * size);
        let text = format!(
            "{THIN}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"{edge} m\", \"{edge} m\", \"{edge} m\"]\n\
             gravity = [\"{gravity} m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
             sides = {{ x_min = \"periodic\", x_max = \"periodic\", y_min = \"periodic\", y_max = \"periodic\", \
             z_min = \"periodic\", z_max = \"periodic\" }}\n\
             [[fluid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }}\n\
             [[solid]]\nsphere = {{ centre = [\"{at} m\", \"{at} m\", \"{at} m\"], diameter = \"{diameter} m\" }}\n\
             [lbm]\ncell_size = \"{size} m\"\nprecision = \"f64\"\ntime_step = \"{step} s\"\n"
        );
        let simulation = advanced(&case(&text), (48.0 / step).ceil() as usize);
        let snapshot = cells(&*simulation);
        let fluid = snapshot.fill.iter().sum::<f64>();
        let flux = mean_velocity(&snapshot).x * fluid / n.powi(3);
        // Steady: the sphere holds all that gravity drives, and nothing across it where it lies evenly.
        let force = simulation.snapshot().solids[0].force;
        let driven = 1000.0 * gravity * size.powi(3) * fluid;
        assert!((force.x / driven - 1.0).abs() < 1e-3, "{n} {shift}: {force} {driven}");
        let aside = if shift == 0.0 { 1e-9 } else { 2e-3 };
        assert!(force.y.abs() < aside * driven && force.z.abs() < aside * driven, "{n} {shift}: {force}");
        6.0 * PI * viscosity * (0.5 * diameter) * flux * resistance / whole - 1.0
    };
    // Second order, wherever the sphere lies between the cells.
    let (coarse, fine) = (off(12.0, 0.0), [0.0, 0.3].map(|shift| off(24.0, shift)));
    assert!(fine.iter().all(|off| off.abs() < 0.02), "{fine:?}");
    assert!(coarse.abs() > 3.0 * fine[0].abs(), "{coarse} {fine:?}");
}

/// A stick that is plunged into a tank, drawn through it and out again, at up to 0.3 m/s.
fn stirred(precision: &str, surface: &str) -> String {
    format!(
        "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.24 m\", \"0.12 m\", \"0.2 m\"]\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.24 m\", \"0.12 m\", \"0.104 m\"] }}\n\
         [[solid]]\ncapsule = {{ start = [\"0.07 m\", \"0.05 m\", \"0.16 m\"], end = [\"0.06 m\", \"0.05 m\", \"0.3 m\"], \
         diameter = \"43 mm\" }}\nsurface = \"{surface}\"\n\
         motion.path.points = [{{ time = \"0 s\", offset = [\"0 m\", \"0 m\", \"0 m\"] }}, \
         {{ time = \"0.4 s\", offset = [\"0 m\", \"0 m\", \"-0.1 m\"] }}, \
         {{ time = \"0.7 s\", offset = [\"0.09 m\", \"0.01 m\", \"-0.1 m\"] }}, \
         {{ time = \"1 s\", offset = [\"0.09 m\", \"0.01 m\", \"0.02 m\"] }}]\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\n"
    )
}

#[test]
fn mass_is_kept_where_solids_cover_and_uncover() {
    for surface in ["no_slip", "free_slip"] {
        let case = case(&stirred("f64", surface));
        let mut simulation = lattice_boltzmann(&case);
        let start = simulation.mass();
        let mut steps = 0;
        while simulation.time() < 1.2 {
            advance(&mut *simulation, 1);
            steps += 1;
            if steps % 100 == 99 {
                // What is given back of the volume that pressures take is told.
                let [.., pressed] = simulation.passed();
                let mass = simulation.mass() - pressed;
                assert!((mass / start - 1.0).abs() < 1e-9, "{surface} at {}: {mass}", simulation.time());
            }
        }
        let volume = cells(&*simulation).fill.iter().sum::<f64>() * 1e-6;
        assert!((volume * 2300.0 / start - 1.0).abs() < 0.01, "{surface}: {volume}");
    }
}

#[test]
fn solids_give_the_same_bits_on_any_number_of_threads_and_after_a_restart() {
    let case = case(&stirred("f32", "free_slip"));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| advanced(&case, 1500).save())
    };
    let alone = with(1);
    assert!(alone == with(3));
    let saved = advanced(&case, 700).save();
    let mut other = tremie_lbm::simulation(&case);
    other.restore(&saved).unwrap();
    assert!(other.save() == saved);
    advance(&mut *other, 800);
    assert!(other.save() == alone);
}

#[test]
fn free_slip_walls_let_a_plug_go_on() {
    // Walls along the lattice, and a round pipe, whose wall is a staircase across the flow.
    let walls = "[[solid]]\nbox = { min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"0.03 m\", \"1 m\"] }\nsurface = \"free_slip\"\n\
                 [[solid]]\nbox = { min = [\"-1 m\", \"0.13 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }\nsurface = \"free_slip\"\n";
    let pipe = "[[solid]]\nsurface = \"free_slip\"\n\
                difference.from.box = { min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }\n\
                difference.without = [{ cylinder = { point = [\"0 m\", \"0.083 m\", \"0.08 m\"], axis = [1, 0, 0], diameter = \"0.13 m\" } }]\n";
    for (solids, sides) in [(walls, "z_min = \"periodic\", z_max = \"periodic\""), (pipe, "y_min = \"wall\"")]
    {
        for material in [THIN, CONCRETE] {
            let text = format!(
                "{material}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"80 mm\", \"160 mm\", \"160 mm\"]\n\
                 gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
                 sides = {{ x_min = \"periodic\", x_max = \"periodic\", {sides} }}\n\
                 [[fluid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }}\n\
                 velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]\n{solids}\n\
                 [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\ntime_step = \"2 ms\"\n"
            );
            let velocity = mean_velocity(&cells(&*advanced(&case(&text), 1000)));
            assert!((velocity - DVec3::new(0.1, 0.0, 0.0)).length() < 1e-10, "{velocity}");
        }
    }
}

#[test]
fn concrete_stands_between_free_slip_walls() {
    // In the corner of two of them: their edge takes nothing in, and the pressure along them carries the cells beside them.
    let wall = |min: &str| {
        format!(
            "[[solid]]\nbox = {{ min = [{min}, \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }}\nsurface = \"free_slip\"\n"
        )
    };
    let text = format!(
        "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"80 mm\", \"80 mm\", \"240 mm\"]\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"1 m\", \"1 m\", \"203 mm\"] }}\n{}{}\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n",
        wall("\"-1 m\", \"50 mm\""),
        wall("\"50 mm\", \"-1 m\"")
    );
    let cells = cells(&*advanced(&case(&text), 1500));
    let full = cells.velocity.iter().zip(&cells.fill).filter(|(_, fill)| **fill > 0.999);
    let fastest = full.map(|(u, _)| u.length()).fold(0.0, f64::max);
    assert!(fastest > 0.0 && fastest < 2e-4, "{fastest}");
}

#[test]
fn a_gate_that_goes_up_along_itself_takes_nothing_from_a_tank() {
    // Into a wall above: there not all links of a cell meet the gate.
    let text = format!(
        "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"80 mm\", \"40 mm\", \"160 mm\"]\n\
         sides = {{ y_min = \"periodic\", y_max = \"periodic\" }}\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"-1 m\", \"0 m\"], max = [\"40 mm\", \"1 m\", \"120 mm\"] }}\n\
         [[solid]]\nbox = {{ min = [\"40 mm\", \"-1 m\", \"80 mm\"], max = [\"60 mm\", \"1 m\", \"1 m\"] }}\n\
         [[solid]]\nbox = {{ min = [\"40 mm\", \"-1 m\", \"-1 m\"], max = [\"60 mm\", \"1 m\", \"90 mm\"] }}\n\
         surface = \"free_slip\"\nmotion.uniform.velocity = [\"0 m/s\", \"0 m/s\", \"0.2 m/s\"]\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n"
    );
    let mut simulation = lattice_boltzmann(&case(&text));
    let volume = |fluid: &dyn Simulation| cells(fluid).fill.iter().sum::<f64>();
    let before = volume(&*simulation);
    while simulation.time() < 0.3 {
        advance(&mut *simulation, 1);
    }
    let after = volume(&*simulation);
    assert!((after / before - 1.0).abs() < 1e-3, "{before} {after}");
}

#[test]
fn a_sliding_wall_that_recedes_lets_go() {
    // A block that stands by itself, and a plate against its side that is drawn away: air comes in between.
    let text = "[material]\ndensity = \"2300 kg/m3\"\n\
         bingham = { yield_stress = \"1000 Pa\", plastic_viscosity = \"50 Pa s\" }\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"200 mm\", \"5 mm\", \"80 mm\"]\n\
         sides = { x_min = \"symmetry\", y_min = \"periodic\", y_max = \"periodic\" }\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"60 mm\", \"1 m\", \"40 mm\"] }\n\
         [[solid]]\nbox = { min = [\"60 mm\", \"-1 m\", \"0 m\"], max = [\"80 mm\", \"1 m\", \"1 m\"] }\n\
         surface = \"free_slip\"\nmotion.uniform.velocity = [\"0.3 m/s\", \"0 m/s\", \"0 m/s\"]\n\
         [lbm]\ncell_size = \"5 mm\"\nprecision = \"f64\"\n";
    let mut simulation = advanced(&case(text), 0);
    let volume = |simulation: &dyn Simulation, width: f64| -> f64 {
        let cells = cells(simulation);
        let inside = (0..cells.fill.len()).filter(|n| cells.centre(n % cells.count[0], 0, 0).x < width);
        inside.map(|n| cells.fill[n]).sum()
    };
    let all = volume(&*simulation, 1.0);
    while simulation.time() < 0.2 {
        advance(&mut *simulation, 10);
    }
    let cells = cells(&*simulation);
    assert!((volume(&*simulation, 1.0) / all - 1.0).abs() < 0.01);
    assert!(volume(&*simulation, 0.06) > 0.98 * all, "the block has followed the plate");
    let speed = cells.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
    assert!(speed < 0.01, "{speed} m/s");
}

#[test]
fn a_cone_upside_down_runs_empty_along_its_wall() {
    // The wall narrows as it rises, and what stays behind on it as the surface sinks falls no faster than freely.
    for surface in ["\"free_slip\"", "{ navier = { slip_length = \"100 mm\" } }"] {
        let text = format!(
            "[material]\ndensity = \"2300 kg/m3\"\nbingham = {{ yield_stress = \"50 Pa\", plastic_viscosity = \"30 Pa s\" }}\n\
             [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"200 mm\", \"200 mm\", \"400 mm\"]\n\
             sides = {{ x_min = \"symmetry\", y_min = \"symmetry\", x_max = \"open\", y_max = \"open\" }}\n\
             [[fluid]]\ncone = {{ base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"100 mm\", top_diameter = \"200 mm\", \
             height = \"300 mm\" }}\n\
             [[solid]]\ncone_shell = {{ base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"100 mm\", \
             top_diameter = \"200 mm\", height = \"300 mm\", thickness = \"20 mm\" }}\nsurface = {surface}\n\
             motion.uniform.velocity = [\"0 m/s\", \"0 m/s\", \"0.1 m/s\"]\n\
             [lbm]\ncell_size = \"10 mm\"\n"
        );
        let mut simulation = lattice_boltzmann(&case(&text));
        while simulation.time() < 0.9 {
            advance(&mut *simulation, 20);
            let speed = cells(&*simulation).velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
            assert!(
                speed < (2.0 * 9.81 * 0.3f64).sqrt(),
                "{surface}: {speed} m/s at {} s",
                simulation.time()
            );
        }
    }
}

/// A small cone that is lifted from concrete; `min` is the domain's lower end in x and y.
fn lifted(min: &str, sides: &str) -> String {
    format!(
        "{CONCRETE}[domain]\nmin = [\"{min}\", \"{min}\", \"0 m\"]\nmax = [\"0.21 m\", \"0.21 m\", \"0.2 m\"]\n{sides}\n\
         [[fluid]]\ncone = {{ base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", \
         top_diameter = \"100 mm\", height = \"150 mm\" }}\n\
         [[solid]]\ncone_shell = {{ base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", \
         top_diameter = \"100 mm\", height = \"150 mm\", thickness = \"20 mm\" }}\n\
         motion.uniform.velocity = [\"0 m/s\", \"0 m/s\", \"0.3 m/s\"]\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n"
    )
}

#[test]
fn a_quarter_of_a_lifted_cone_is_the_whole() {
    let symmetric = "sides = { x_min = \"symmetry\", y_min = \"symmetry\" }\n";
    let whole = advanced(&case(&lifted("-0.21 m", "")), 300);
    let quarter = advanced(&case(&lifted("0 m", symmetric)), 300);
    let (a, b) = (cells(&*quarter), cells(&*whole));
    let shift = ((a.origin - b.origin) / a.size).round();
    let (mut fill, mut speed): (f64, f64) = (0.0, 0.0);
    for k in 0..a.count[2] {
        for j in 0..a.count[1] {
            for i in 0..a.count[0] {
                let n = a.index(i, j, k);
                let m = b.index(i + shift.x as usize, j + shift.y as usize, k + shift.z as usize);
                assert_eq!(a.solid[n], b.solid[m]);
                fill = fill.max((a.fill[n] - b.fill[m]).abs());
                speed = speed.max((a.velocity[n] - b.velocity[m]).length());
            }
        }
    }
    assert!(fill < 1e-10 && speed < 1e-9, "{fill} {speed}");
    let (part, all) = (quarter.snapshot().solids[0].force, whole.snapshot().solids[0].force);
    assert!((4.0 * part.z / all.z - 1.0).abs() < 1e-9, "{part} {all}");
    assert!(all.truncate().length() < 1e-6 * all.z.abs(), "{all}");
}

#[test]
fn bars_as_one_body_are_as_bars_one_by_one() {
    let collapse = |bars: &str| {
        format!(
            "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.3 m\", \"0.16 m\", \"0.16 m\"]\n\
             [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"1 m\", \"0.15 m\"] }}\n{bars}\n\
             [lbm]\ncell_size = \"10 mm\"\n"
        )
    };
    let ends = |y: u32| {
        format!(
            "start = [\"0.13 m\", \"{y} mm\", \"-1 m\"], end = [\"0.13 m\", \"{y} mm\", \"1 m\"], diameter = \"25 mm\""
        )
    };
    let grid = format!(
        "[[bars]]\ngrid = {{ {}, spacing = [\"0 m\", \"80 mm\", \"0 m\"], count = [1, 2, 1] }}\n",
        ends(40)
    );
    let alone = [40, 120].map(|y| format!("[[solid]]\nbar = {{ {} }}\n", ends(y))).concat();
    let [one, two] = [grid, alone].map(|bars| advanced(&case(&collapse(&bars)), 1500).snapshot());
    let (Fluid::Cells(a), Fluid::Cells(b)) = (&one.fluid, &two.fluid);
    assert!(a == b, "the flow differs");
    // The flow has reached the bars and passed them, and no fluid is in them.
    let (beside, beyond) = (a.index(13, 7, 0), a.index(17, 7, 0));
    assert!(a.fill[beside] > 0.9 && a.fill[beyond] > 0.1, "{} {}", a.fill[beside], a.fill[beyond]);
    assert!(a.fill.iter().zip(&a.solid).all(|(fill, solid)| *solid == 0 || *fill == 0.0));
    let (whole, parts) = (one.solids[0].force, two.solids[0].force + two.solids[1].force);
    assert!(whole.x > 0.0 && (whole - parts).length() < 1e-9 * whole.length(), "{whole} {parts}");
}

/// Half of a film of 10 Pa s between plates without slip, in a plane, 10 mm high and 50 mm wide, eight cells over its height; a load without mass of 20 N per metre of depth, on both halves, moves the upper plate.
fn film() -> tremie_case::Case {
    let text = r#"title = "Film"
method = "lbm"

[material]
density = "2000 kg/m3"
newtonian = { viscosity = "10 Pa s" }

[domain]
min = ["0 mm", "0 mm", "0 mm"]
max = ["75 mm", "1.25 mm", "12.5 mm"]
gravity = ["0 m/s2", "0 m/s2", "0 m/s2"]
sides = { x_min = "symmetry", y_min = "periodic", y_max = "periodic" }

[[fluid]]
box = { min = ["-1 m", "-1 m", "0 m"], max = ["50 mm", "1 m", "10 mm"] }

[[solid]]
name = "plate"
box = { min = ["-1 m", "-1 m", "10 mm"], max = ["1 m", "1 m", "1 m"] }
motion.load.force = ["0 N", "0 N", "-0.025 N"]

[lbm]
cell_size = "1.25 mm"
precision = "f64"
time_step = "40 us"

[gauges]
interval = "10 ms"

[stop]
time = "1 s"
"#;
    tremie_case::Case::parse("film.toml", text).unwrap_or_else(|error| panic!("{error}"))
}

/// It sinks as lubrication has it, F h^3/(8 mu L^3) with L h as at first, bears its load at once, and goes on from a checkpoint as it would have.
#[test]
fn a_plate_without_mass_sinks_as_its_load_has_it() {
    let mut simulation = advanced(&film(), 1000);
    let (first, start) = (simulation.snapshot(), simulation.time());
    let state = simulation.save();
    advance(&mut *simulation, 1000);
    let last = simulation.snapshot();
    let speed = (first.moved[0].z - last.moved[0].z) / (simulation.time() - start);
    let height = 0.01 + 0.5 * (first.moved[0].z + last.moved[0].z);
    let half_width = 0.05 * 0.01 / height;
    let exact = 20.0 * height.powi(3) / (8.0 * 10.0 * half_width.powi(3));
    assert!((speed / exact - 1.0).abs() < 0.05, "{speed} for {exact} at a height of {height} m");
    assert!((last.solids[0].force.z / 0.0125 - 1.0).abs() < 0.01, "{:?}", last.solids[0]);
    let mut other = lattice_boltzmann(&film());
    other.restore(&state).unwrap();
    advance(&mut *other, 1000);
    assert_eq!(other.snapshot().moved, last.moved);
}
