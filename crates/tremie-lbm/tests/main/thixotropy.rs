//! Thixotropic fluid: what it has been through goes with it.

use crate::{advance, advanced, case, cells};

/// A column that collapses in a closed box and sloshes, its right half with a structure of its own.
fn dam(precision: &str, stepping: &str, thixotropy: &str, right: &str) -> String {
    format!(
        "[material]\ndensity = \"1000 kg/m3\"\nbingham = {{ yield_stress = \"20 Pa\", plastic_viscosity = \"2 Pa s\" }}\n{thixotropy}\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.2 m\", \"0.1 m\", \"0.16 m\"]\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.04 m\", \"0.064 m\", \"0.121 m\"] }}\n\
         [[fluid]]\nbox = {{ min = [\"0.04 m\", \"0 m\", \"0 m\"], max = [\"0.083 m\", \"0.064 m\", \"0.121 m\"] }}\n{right}\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\nstepping = \"{stepping}\"\n"
    )
}

/// A build-up in 4 s of as much as the fluid has without structure.
const GROWS: &str = "thixotropy = { build_up = \"5 Pa/s\", breakdown = 0, structure = 0.1 }";

#[test]
fn a_fluid_without_structure_is_a_bingham_fluid_to_the_bit() {
    // In a second it builds up what rounding does not see.
    let none = "thixotropy = { build_up = \"1e-30 Pa/s\" }";
    for (precision, stepping) in [("f32", "adaptive"), ("f64", "fixed")] {
        let flow = |thixotropy: &str| {
            let cells = cells(&*advanced(&case(&dam(precision, stepping, thixotropy, "")), 600));
            (cells.fill, cells.velocity, cells.stress, cells.shear_rate)
        };
        assert!(flow(none) == flow(""));
    }
}

#[test]
fn structure_that_is_not_broken_grows_with_time_wherever_it_goes() {
    let simulation = advanced(&case(&dam("f32", "adaptive", GROWS, "structure = 0.6")), 2000);
    let cells = cells(&*simulation);
    let structure = cells.structure.as_ref().unwrap();
    let wet = |n: &usize| cells.fill[*n] > 0.01;
    let grown = simulation.time() / 4.0;
    let (mut least, mut most, mut mean) = (f64::INFINITY, 0.0f64, [0.0; 2]);
    for n in (0..structure.len()).filter(wet) {
        (least, most) = (least.min(structure[n]), most.max(structure[n]));
        mean = [mean[0] + cells.fill[n] * structure[n], mean[1] + cells.fill[n]];
    }
    // Between those of the two halves, which have not mixed, and on average theirs.
    assert!((least - 0.1 - grown).abs() < 1e-3 && (most - 0.6 - grown).abs() < 1e-3, "{least} {most}");
    let mean = mean[0] / mean[1] - grown;
    let halves = (0.1 * 40.0 + 0.6 * 43.0) / 83.0;
    assert!((mean - halves).abs() < 5e-3, "{mean} {halves}");
}

#[test]
fn a_body_that_has_rested_stands_where_a_fresh_one_slumps() {
    // The bank of 121 mm needs a yield stress of about 1190 Pa / 4.
    let fall = |structure: &str| {
        let thixotropy = "thixotropy = { build_up = \"0.001 Pa/s\" }";
        let both = dam("f64", "fixed", thixotropy, structure)
            .replace("121 m\"] }\n[[", &format!("121 m\"] }}\n{structure}\n[["));
        let moved = cells(&*advanced(&case(&both), 500)).velocity;
        moved.iter().map(|u| u.length()).fold(0.0, f64::max)
    };
    let (fresh, rested) = (fall(""), fall("structure = 29"));
    assert!(fresh > 0.1 && rested < 1e-3, "{fresh} {rested}");
}

#[test]
fn structure_is_the_same_bits_on_any_number_of_threads_and_after_a_restart() {
    let case = case(&dam(
        "f32",
        "adaptive",
        "thixotropy = { build_up = \"5 Pa/s\", breakdown = 0.01 }",
        "structure = 3",
    ));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| advanced(&case, 900).save())
    };
    let alone = with(1);
    assert!(alone == with(3));
    // In the middle between two looks at the structure.
    let saved = advanced(&case, 403).save();
    let mut other = tremie_lbm::simulation(&case);
    other.restore(&saved).unwrap();
    assert!(other.save() == saved);
    advance(&mut *other, 497);
    assert!(other.save() == alone);
}
