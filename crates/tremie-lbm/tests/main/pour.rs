//! Fluid that comes in and leaves.

use tremie_lbm::{LatticeBoltzmann, lattice_boltzmann};
use tremie_simulation::Cells;

use crate::{advance, advanced, case, cells};

const CONCRETE: &str = "[material]\ndensity = \"2300 kg/m3\"\n\
     bingham = { yield_stress = \"20 Pa\", plastic_viscosity = \"20 Pa s\" }\n";

/// A tank of 200 x 160 mm with what else stands in it.
fn tank(sides: &str, sections: &str, precision: &str) -> String {
    format!(
        "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"200 mm\", \"160 mm\", \"180 mm\"]\n\
         sides = {{ {sides} }}\n{sections}\n[lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\n"
    )
}

/// A hose over it, from which a litre a second comes.
const HOSE: &str = "[[inlet]]\n\
     disc = { centre = [\"83 mm\", \"80 mm\", \"153 mm\"], direction = [0, 0, -1], diameter = \"65 mm\" }\n\
     flow_rate = \"1 l/s\"\n";

/// Volume of the fluid in m3.
fn volume(cells: &Cells) -> f64 {
    cells.fill.iter().sum::<f64>() * cells.size.powi(3)
}

/// Mass that has got lost, as a share of what has come in.
fn lost(simulation: &dyn LatticeBoltzmann) -> f64 {
    let [poured, drained, pressed] = simulation.passed();
    (simulation.mass() - (poured - drained + pressed)) / poured
}

#[test]
fn a_tank_fills_by_what_comes_in() {
    // Straight down, and slanted from beside.
    let slanted = "[[inlet]]\nrectangle = { centre = [\"43 mm\", \"81 mm\", \"134 mm\"], direction = [2, 0.5, -1], \
         size = [\"52 mm\", \"41 mm\"] }\nflow_rate = \"1 l/s\"\n";
    for hose in [HOSE, slanted] {
        let case = case(&tank("", hose, "f64"));
        let mut simulation = lattice_boltzmann(&case);
        assert_eq!(simulation.mass(), 0.0);
        while simulation.time() < 2.0 {
            advance(&mut *simulation, 100);
            let snapshot = simulation.snapshot();
            let due = 1e-3 * simulation.time();
            assert!((snapshot.inflow[0] / due - 1.0).abs() < 1e-12, "{} {due}", snapshot.inflow[0]);
            assert!(lost(&*simulation).abs() < 1e-9, "{}", lost(&*simulation));
            let stored = volume(&cells(&*simulation));
            assert!((stored / due - 1.0).abs() < 5e-3, "{}: {stored} {due}", simulation.time());
        }
        // Most of it has got to the floor, and what has, lies level.
        let cells = cells(&*simulation);
        let column = |i: usize, j: usize| (0..8).map(|k| cells.fill[cells.index(i, j, k)]).sum::<f64>();
        assert!(column(19, 1) > 3.0 && column(1, 14) > 3.0, "{} {}", column(19, 1), column(1, 14));
    }
}

#[test]
fn single_precision_keeps_the_balance_too() {
    let case = case(&tank("", HOSE, "f32"));
    let mut simulation = lattice_boltzmann(&case);
    for _ in 0..30 {
        advance(&mut *simulation, 100);
        assert!(lost(&*simulation).abs() < 1e-6, "{}", lost(&*simulation));
    }
    let due = simulation.snapshot().inflow[0];
    assert!((volume(&cells(&*simulation)) / due - 1.0).abs() < 5e-3);
}

#[test]
fn what_comes_in_goes_out_again() {
    // Through an open side, and through a gap in the floor of a box above an outlet.
    let side = tank("x_max = \"open\"", HOSE, "f64");
    let gap = format!(
        "{HOSE}[[outlet]]\nbox = {{ min = [\"120 mm\", \"0 m\", \"0 m\"], max = [\"1 m\", \"1 m\", \"20 mm\"] }}\n\
         [[solid]]\nbox = {{ min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"120 mm\", \"1 m\", \"20 mm\"] }}\n"
    );
    for text in [side, tank("", &gap, "f64")] {
        let case = case(&text);
        let mut simulation = lattice_boltzmann(&case);
        let out =
            |simulation: &dyn LatticeBoltzmann| (simulation.time(), simulation.snapshot().outflow.unwrap());
        let mut before = (0.0, 0.0);
        while simulation.time() < 8.0 {
            if simulation.time() < 7.0 {
                before = out(&*simulation);
            }
            advance(&mut *simulation, 400);
            assert!(lost(&*simulation).abs() < 1e-9, "{}", lost(&*simulation));
            let snapshot = simulation.snapshot();
            let due = snapshot.inflow[0] - snapshot.outflow.unwrap();
            let stored = volume(&cells(&*simulation));
            assert!(
                (stored - due).abs() < 5e-3 * snapshot.inflow[0],
                "{}: {stored} {due}",
                simulation.time()
            );
        }
        // Steady after a while.
        let after = out(&*simulation);
        let rate = (after.1 - before.1) / (after.0 - before.0);
        assert!((rate / 1e-3 - 1.0).abs() < 0.1, "{rate} m3/s");
        let stored = volume(&cells(&*simulation));
        assert!(stored < 5e-3, "{stored} m3 pile up");
    }
}

#[test]
fn pouring_gives_the_same_bits_on_any_number_of_threads_and_after_a_restart() {
    let moving =
        HOSE.replace("83 mm", "60 mm") + "motion.uniform.velocity = [\"50 mm/s\", \"0 m/s\", \"0 m/s\"]\n";
    let open = tank("x_max = \"open\"", &moving, "f32");
    for text in [open, tank("", &drawn_up("50 mm/s"), "f32")] {
        let case = case(&(text + "stepping = \"adaptive\"\n"));
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
}

#[test]
fn steps_grow_once_a_jet_has_landed() {
    let with = |stepping: &str| {
        let case = case(&(tank("", HOSE, "f64") + &format!("stepping = \"{stepping}\"\n")));
        let mut simulation = lattice_boltzmann(&case);
        let step =
            |simulation: &dyn LatticeBoltzmann| simulation.save().header["time_step"].as_f64().unwrap();
        let first = step(&*simulation);
        // Concrete falls slower than freely, but that is only known once it has fallen.
        while simulation.time() < 0.1 {
            advance(&mut *simulation, 10);
            assert!(step(&*simulation) <= first);
        }
        while simulation.time() < 2.0 {
            advance(&mut *simulation, 1);
        }
        assert!(lost(&*simulation).abs() < 1e-9, "{}", lost(&*simulation));
        (step(&*simulation) / first, cells(&*simulation))
    };
    let ((_, fixed), (growth, adaptive)) = (with("fixed"), with("adaptive"));
    assert!(growth > 1.25, "{growth}");
    let apart: f64 = fixed.fill.iter().zip(&adaptive.fill).map(|(a, b)| (a - b).abs()).sum();
    assert!(apart < 0.02 * fixed.fill.iter().sum::<f64>(), "{apart}");
}

/// The hose from 60 mm above the floor, drawn up as the tank fills.
fn drawn_up(speed: &str) -> String {
    HOSE.replace("153 mm", "60 mm")
        + &format!("above_fill = {{ distance = \"40 mm\", speed = \"{speed}\" }}\n")
}

#[test]
fn a_hose_is_drawn_up_as_the_tank_fills() {
    for (fast, speed) in [(true, "100 mm/s"), (false, "10 mm/s")] {
        let case = case(&tank("", &drawn_up(speed), "f64"));
        let mut simulation = lattice_boltzmann(&case);
        let mut height = 0.06;
        while simulation.time() < 2.5 {
            advance(&mut *simulation, 100);
            let time = simulation.time();
            let rise: Option<[[f64; 2]; 2]> =
                serde_json::from_value(simulation.save().header["rises"][0].clone()).unwrap();
            let [[start, from], [end, to]] = rise.unwrap();
            let now = 0.06 + from + (to - from) * ((time - start) / (end - start)).min(1.0);
            assert!(now >= height, "{time}: from {height} to {now}");
            height = now;
            let cells = cells(&*simulation);
            let column = |i: usize, j: usize| -> f64 {
                (0..cells.count[2]).map(|k| cells.fill[cells.index(i, j, k)]).sum()
            };
            // Around the face, which covers the cells 5 to 11 along x and y.
            let around = |i: usize, j: usize| !(4..=12).contains(&i) || !(3..=12).contains(&j);
            let columns = (0..cells.count[1]).flat_map(|j| (0..cells.count[0]).map(move |i| (i, j)));
            let level = columns.filter(|(i, j)| around(*i, *j)).map(|(i, j)| 0.01 * column(i, j));
            let due = (level.fold(0.0, f64::max) + 0.04).max(0.06);
            // What falls at first spreads faster than the hose may rise.
            if fast && time > 0.5 {
                assert!((height - due).abs() < 0.01, "{time}: {height}, and {due} is due");
            } else if !fast {
                assert!(height <= 0.06 + 0.01 * time, "{time}: {height}");
            }
            assert!(lost(&*simulation).abs() < 1e-9, "{}", lost(&*simulation));
        }
        // Fluid comes from where the face is now.
        let cells = cells(&*simulation);
        let wet = |k: usize| (6..10).all(|i| cells.fill[cells.index(i, 7, k)] > 0.5);
        let top = 0.01 * (0..cells.count[2]).filter(|k| wet(*k)).count() as f64;
        assert!((top - height).abs() < 0.011, "{top} {height}");
        assert!(if fast { height > 0.11 } else { height < 0.09 }, "{height}");
    }
}

#[test]
fn a_hose_that_is_drawn_up_stays_in_the_domain() {
    // The concrete comes to stand 80 mm high; 120 mm above it is beyond the tank.
    let hose = drawn_up("1 m/s").replace("40 mm", "120 mm");
    let case = case(&tank("z_max = \"open\"", &hose, "f64"));
    let mut simulation = advanced(&case, 0);
    while simulation.time() < 2.5 {
        advance(&mut *simulation, 100);
    }
    let snapshot = simulation.snapshot();
    assert!((snapshot.inflow[0] / (1e-3 * simulation.time()) - 1.0).abs() < 1e-12, "{}", snapshot.inflow[0]);
    let end = &simulation.save().header["rises"][0][1][1];
    assert!((end.as_f64().unwrap() - 0.1).abs() < 1e-12, "{end}");
}

#[test]
fn an_inlet_ends_by_time_or_by_volume() {
    for (end, expected) in [("start = \"0.1 s\"\nstop = \"0.4 s\"", 0.3e-3), ("volume = \"0.25 l\"", 0.25e-3)]
    {
        let case = case(&tank("", &format!("{HOSE}{end}\n"), "f64"));
        let mut simulation = advanced(&case, 0);
        while simulation.time() < 0.5 {
            assert_eq!(
                case.pours(simulation.time()),
                simulation.snapshot().inflow[0] < expected * (1.0 - 1e-12)
            );
            advance(&mut *simulation, 1);
        }
        let volume = simulation.snapshot().inflow[0];
        assert!((volume / expected - 1.0).abs() < 1e-12, "{volume} {expected}");
    }
}

#[test]
fn an_inlet_whose_face_goes_through_the_centres_of_cells_pours() {
    let case = case(&tank("", &HOSE.replace("153 mm", "155 mm"), "f64"));
    let simulation = advanced(&case, 500);
    let inflow = simulation.snapshot().inflow[0] / simulation.time();
    assert!((inflow / 1e-3 - 1.0).abs() < 1e-12, "{inflow}");
}

#[test]
fn half_an_inlet_behind_a_symmetry_plane_gives_half() {
    let half = HOSE.replace("83 mm", "0 mm");
    let case = case(&tank("x_min = \"symmetry\"", &half, "f64"));
    let simulation = advanced(&case, 500);
    let inflow = simulation.snapshot().inflow[0] / simulation.time();
    assert!((inflow / 0.5e-3 - 1.0).abs() < 1e-12, "{inflow}");
}

#[test]
fn a_plug_from_a_face_as_wide_as_the_channel_goes_as_fast_as_it_comes() {
    // Between planes of symmetry nothing holds it back: a plug fills the channel from its end.
    let text = format!(
        "{CONCRETE}[domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"300 mm\", \"40 mm\", \"40 mm\"]\n\
         gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
         sides = {{ y_min = \"symmetry\", y_max = \"symmetry\", z_min = \"symmetry\", z_max = \"symmetry\", x_max = \"open\" }}\n\
         [[inlet]]\nrectangle = {{ centre = [\"30 mm\", \"20 mm\", \"20 mm\"], direction = [1, 0, 0], size = [\"60 mm\", \"60 mm\"] }}\n\
         speed = \"0.1 m/s\"\n[lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n"
    );
    let case = case(&text);
    let mut simulation = advanced(&case, 0);
    while simulation.time() < 1.0 {
        advance(&mut *simulation, 10);
    }
    let cells = cells(&*simulation);
    let front = cells.fill.iter().sum::<f64>() / 16.0 * 0.01;
    assert!((front - 0.1 * simulation.time()).abs() < 1e-3, "{front}");
    for (fill, u) in cells.fill.iter().zip(&cells.velocity) {
        assert!(*fill < 0.9 || (u.x / 0.1 - 1.0).abs() < 0.01, "{fill} {u}");
    }
    // Later as much leaves as comes.
    while simulation.time() < 4.0 {
        advance(&mut *simulation, 10);
    }
    let before = simulation.snapshot().outflow.unwrap();
    while simulation.time() < 5.0 {
        advance(&mut *simulation, 10);
    }
    let rate = (simulation.snapshot().outflow.unwrap() - before) / (0.1 * 0.04 * 0.04);
    assert!((rate - 1.0).abs() < 0.02, "{rate}");
}
