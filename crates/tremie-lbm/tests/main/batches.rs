//! Batches that are followed through the flow.

use tremie_lbm::lattice_boltzmann;
use tremie_simulation::Cells;

use crate::{advance, advanced, case, cells};

/// A column that collapses in a closed box and sloshes, its left half of one batch and its right of another.
fn dam(precision: &str, second: &str) -> String {
    format!(
        "[material]\ndensity = \"1000 kg/m3\"\nbingham = {{ yield_stress = \"20 Pa\", plastic_viscosity = \"2 Pa s\" }}\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.2 m\", \"0.1 m\", \"0.16 m\"]\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.04 m\", \"0.064 m\", \"0.121 m\"] }}\nbatch = \"left\"\n\
         [[fluid]]\nbox = {{ min = [\"0.04 m\", \"0 m\", \"0 m\"], max = [\"0.083 m\", \"0.064 m\", \"0.121 m\"] }}\nbatch = \"{second}\"\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\n"
    )
}

/// Largest difference from one of the sum of all shares in cells that hold some fluid.
fn unaccounted(cells: &Cells) -> f64 {
    let sum = |n: usize| cells.batches.iter().map(|(_, shares)| shares[n]).sum::<f64>();
    let filled = (0..cells.fill.len()).filter(|n| cells.fill[*n] > 0.01);
    filled.map(|n| (sum(n) - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn each_batch_keeps_its_mass_and_its_bounds() {
    let case = case(&dam("f64", "right"));
    let mut simulation = lattice_boltzmann(&case);
    let start = simulation.batches();
    assert!((start[0] / start[1] - 40.0 / 43.0).abs() < 0.01, "{start:?}");
    for _ in 0..10 {
        advance(&mut *simulation, 300);
        for (now, then) in simulation.batches().iter().zip(&start) {
            assert!((now / then - 1.0).abs() < 1e-9, "{now} {then}");
        }
        let cells = cells(&*simulation);
        for (_, shares) in &cells.batches {
            assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)));
        }
        // Cells of the surface through which more goes than they hold would let the sum go astray.
        assert!(unaccounted(&cells) < 1e-12, "{}", unaccounted(&cells));
    }
    // The right half has gone on before the left.
    let cells = cells(&*simulation);
    let right = |i: usize| cells.batches[1].1[cells.index(i, 3, 0)];
    assert!(right(19) > 0.9 && right(0) < 0.1, "{} {}", right(19), right(0));
}

#[test]
fn a_uniform_batch_stays_uniform() {
    for (precision, error) in [("f64", 1e-12), ("f32", 1e-12)] {
        let simulation = advanced(&case(&dam(precision, "left")), 2000);
        let cells = cells(&*simulation);
        assert_eq!(cells.batches.len(), 1);
        assert!(unaccounted(&cells) < error, "{}", unaccounted(&cells));
    }
}

#[test]
fn a_slug_goes_with_the_flow_and_spreads_little() {
    // Once round a periodic channel without friction; upwind differences would widen it by a variance of 40 cells squared.
    let text = "[material]\ndensity = \"1000 kg/m3\"\nnewtonian.viscosity = \"1 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"400 mm\", \"80 mm\", \"10 mm\"]\n\
         gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n\
         sides = { x_min = \"periodic\", x_max = \"periodic\", y_min = \"symmetry\", y_max = \"symmetry\", \
         z_min = \"periodic\", z_max = \"periodic\" }\n\
         [[fluid]]\nbox = { min = [\"-1 m\", \"-1 m\", \"-1 m\"], max = [\"150 mm\", \"1 m\", \"1 m\"] }\nvelocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]\n\
         [[fluid]]\nbox = { min = [\"150 mm\", \"-1 m\", \"-1 m\"], max = [\"250 mm\", \"1 m\", \"1 m\"] }\nvelocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]\nbatch = \"slug\"\n\
         [[fluid]]\nbox = { min = [\"250 mm\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }\nvelocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"]\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\ntime_step = \"5 ms\"\n";
    let moments = |cells: &Cells| {
        let share = |i: usize| cells.batches[0].1[cells.index(i, 3, 0)];
        let mass: f64 = (0..40).map(share).sum();
        let middle = (0..40).map(|i| share(i) * i as f64).sum::<f64>() / mass;
        let variance = (0..40).map(|i| share(i) * (i as f64 - middle).powi(2)).sum::<f64>() / mass;
        (mass, middle, variance, (0..40).map(share).fold(0.0, f64::max))
    };
    let case = case(text);
    let start = moments(&cells(&*advanced(&case, 0)));
    // 4 s at 0.1 m/s: 400 mm.
    let end = moments(&cells(&*advanced(&case, 800)));
    assert!((end.0 - start.0).abs() < 1e-9, "{start:?} {end:?}");
    assert!((end.1 - start.1).abs() < 0.2, "{start:?} {end:?}");
    assert!(end.2 - start.2 < 4.0, "{start:?} {end:?}");
    assert!(end.3 > 0.95, "{start:?} {end:?}");
}

#[test]
fn batches_are_the_same_bits_on_any_number_of_threads_and_after_a_restart() {
    let case = case(&dam("f32", "right"));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| advanced(&case, 900).save())
    };
    let alone = with(1);
    assert!(alone == with(3));
    let saved = advanced(&case, 400).save();
    let mut other = tremie_lbm::simulation(&case);
    other.restore(&saved).unwrap();
    assert!(other.save() == saved);
    advance(&mut *other, 500);
    assert!(other.save() == alone);
}

#[test]
fn following_a_batch_changes_nothing_else() {
    let text = dam("f32", "right");
    let (followed, plain) = (case(&text), case(&text.replace("batch =", "#")));
    let series = |case| {
        let cells = cells(&*advanced(case, 600));
        (cells.fill, cells.velocity)
    };
    assert!(series(&followed) == series(&plain));
}

#[test]
fn one_batch_after_the_other_through_the_same_hose() {
    let hose = |time: &str, batch: &str| {
        format!(
            "[[inlet]]\ndisc = {{ centre = [\"40 mm\", \"40 mm\", \"130 mm\"], direction = [0, 0, -1], diameter = \"50 mm\" }}\n\
             flow_rate = \"0.5 l/s\"\n{time}\nbatch = \"{batch}\"\n"
        )
    };
    let text = format!(
        "[material]\ndensity = \"2300 kg/m3\"\nnewtonian.viscosity = \"20 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"80 mm\", \"80 mm\", \"160 mm\"]\n{}{}\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n",
        hose("stop = \"0.4 s\"", "first"),
        hose("start = \"0.4 s\"\nvolume = \"0.1 l\"", "second"),
    );
    let case = case(&text);
    let mut simulation = lattice_boltzmann(&case);
    while simulation.time() < 0.9 {
        advance(&mut *simulation, 10);
    }
    let mass = simulation.batches();
    for (mass, litres) in mass.iter().zip([0.2, 0.1]) {
        assert!((mass / (2.3 * litres) - 1.0).abs() < 0.01, "{mass} {litres}");
    }
    assert!(unaccounted(&cells(&*simulation)) < 1e-6, "{}", unaccounted(&cells(&*simulation)));
}

#[test]
fn what_leaves_is_told_by_batch() {
    // Two batches through one hose into a tank with an open side.
    let hose = |batch: &str, times: &str| {
        format!(
            "[[inlet]]\ndisc = {{ centre = [\"83 mm\", \"80 mm\", \"153 mm\"], direction = [0, 0, -1], diameter = \"65 mm\" }}\n\
             flow_rate = \"1 l/s\"\nbatch = \"{batch}\"\n{times}\n"
        )
    };
    let case = case(&format!(
        "[material]\ndensity = \"2300 kg/m3\"\nbingham = {{ yield_stress = \"20 Pa\", plastic_viscosity = \"20 Pa s\" }}\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"200 mm\", \"160 mm\", \"180 mm\"]\nsides = {{ x_max = \"open\" }}\n\
         {}{}[lbm]\ncell_size = \"10 mm\"\nprecision = \"f64\"\n",
        hose("first", "stop = \"0.9 s\""),
        hose("second", "start = \"0.9 s\"")
    ));
    let mut simulation = lattice_boltzmann(&case);
    let mut out = [0.0; 2];
    while simulation.time() < 4.0 {
        advance(&mut *simulation, 200);
        let snapshot = simulation.snapshot();
        let [first, second] = snapshot.batches_out[..] else { panic!("{:?}", snapshot.batches_out) };
        let all = snapshot.outflow.unwrap();
        assert!(first >= out[0] && second >= out[1], "{first} {second}");
        // Shares are held within their bounds each by itself.
        assert!((first + second - all).abs() <= 1e-4 * all, "{first} {second} {all}");
        out = [first, second];
        // Of each batch there is what came in, less what left.
        for (n, (there, left)) in simulation.batches().iter().zip(simulation.batches_out()).enumerate() {
            let poured = 2300.0 * snapshot.inflow[n];
            assert!((there + left - poured).abs() <= 0.01 * poured, "{there} {left} {poured}");
        }
        if simulation.time() < 0.9 {
            assert_eq!(second, 0.0);
        }
    }
    assert!(out[0] > 1e-4 && out[1] > 1e-4, "{out:?}");
}
