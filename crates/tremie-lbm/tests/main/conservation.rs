//! What goes in stays in.

use tremie_lbm::lattice_boltzmann;

use crate::{advanced, case, cells};

/// A column that collapses in a closed box and sloshes.
fn dam(precision: &str, material: &str) -> String {
    format!(
        "[material]\ndensity = \"1000 kg/m3\"\n{material}\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.2 m\", \"0.1 m\", \"0.16 m\"]\n\
         [[fluid]]\nbox = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.083 m\", \"0.064 m\", \"0.121 m\"] }}\n\
         [lbm]\ncell_size = \"10 mm\"\nprecision = \"{precision}\"\n"
    )
}

const THIN: &str = "[material.newtonian]\nviscosity = \"1 Pa s\"";
const BINGHAM: &str = "[material.bingham]\nyield_stress = \"20 Pa\"\nplastic_viscosity = \"2 Pa s\"";

#[test]
fn mass_is_kept_to_rounding() {
    for material in [THIN, BINGHAM] {
        let case = case(&dam("f64", material));
        let mut simulation = lattice_boltzmann(&case);
        // The mass that the case gives: density times volume, to the sampling of partly filled cells.
        let start = simulation.mass();
        assert!((start / (1000.0 * 0.083 * 0.064 * 0.121) - 1.0).abs() < 1e-9, "{start}");
        for n in 1..=3000 {
            simulation.advance().unwrap();
            if n % 500 == 499 {
                // Just before rounding is repaid, and half-way.
                assert!((simulation.mass() / start - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn rounding_in_single_precision_is_repaid() {
    let case = case(&dam("f32", THIN));
    let mut simulation = lattice_boltzmann(&case);
    let start = simulation.mass();
    let mut worst: f64 = 0.0;
    for _ in 0..5000 {
        simulation.advance().unwrap();
        worst = worst.max((simulation.mass() / start - 1.0).abs());
    }
    assert!(worst < 1e-6, "{worst}");
    assert!((simulation.mass() / start - 1.0).abs() < 1e-12);
}

#[test]
fn blocks_follow_the_fluid() {
    let case = case(&dam("f32", THIN));
    let mut simulation = lattice_boltzmann(&case);
    assert_eq!(simulation.load().allocated, 4 * 512);
    for _ in 0..5000 {
        simulation.advance().unwrap();
    }
    // Twelve cells high at first, the fluid now covers the floor of 20 x 10 cells three deep: one layer of blocks.
    let load = simulation.load();
    assert_eq!(load.allocated, 6 * 512, "{load:?}");
    assert!(load.wet >= 600, "{load:?}");
}

#[test]
fn a_cone_of_any_fluid_slumps() {
    for curve in [
        "bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"30 Pa s\" }",
        "casson = { yield_stress = \"50 Pa\", plastic_viscosity = \"10 Pa s\" }",
        "herschel_bulkley = { yield_stress = \"50 Pa\", consistency = \"30 Pa s^n\", index = 0.5 }",
        "power_law = { consistency = \"50 Pa s^n\", index = 0.8 }",
        "power_law = { consistency = \"50 Pa s^n\", index = 1.5 }",
        "cross = { zero_shear_viscosity = \"3000 Pa s\", infinite_shear_viscosity = \"30 Pa s\", time = \"10 s\", index = 1.0 }",
    ] {
        let simulation = advanced(
            &case(&format!(
                "[material]\ndensity = \"2300 kg/m3\"\n{curve}\n\
                 [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.2 m\", \"0.2 m\", \"0.31 m\"]\n\
                 sides = {{ x_min = \"symmetry\", y_min = \"symmetry\" }}\n\
                 [[fluid]]\ncone = {{ base = [\"0 m\", \"0 m\", \"0 m\"], base_diameter = \"200 mm\", \
                 top_diameter = \"100 mm\", height = \"300 mm\" }}\n\
                 [lbm]\ncell_size = \"5 mm\""
            )),
            150,
        );
        let cells = cells(&*simulation);
        let top = (0..cells.count[2]).filter(|k| cells.fill[cells.index(0, 0, *k)] > 0.5).count();
        assert!((30..=60).contains(&top), "{curve}: {top} cells high after {} s", simulation.time());
        let widest = (0..cells.count[0]).filter(|i| cells.fill[cells.index(*i, 0, 0)] > 0.1).count();
        assert!(widest >= 20, "{curve}: {widest}");
    }
}
