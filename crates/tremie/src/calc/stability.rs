//! Which particles a yield stress holds at rest: aggregates, and fibres that lie flat.

use std::f64::consts::PI;

use clap::Args;

use super::answer::{Answer, KG_PER_M3, MM, PA, quantity};
use crate::failure::WrongInput;
use crate::lab::GRAVITY;
use crate::quantities::{density, stress_or_none};

/// Yield number `2 pi tau0 R^2 / F` at which a sphere stops (A. N. Beris, J. A. Tsamopoulos, R. C. Armstrong, R. A.
/// Brown, Journal of Fluid Mechanics 158, 1985, 219-244).
const SPHERE: f64 = 0.143;

/// Force per length on a long cylinder across the flow, over yield stress and diameter (M. F. Randolph, G. T. Houlsby,
/// Geotechnique 34, 1984, 613-623; rough).
const CYLINDER: f64 = 11.94;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc stability --yield-stress 20Pa
  tremie calc stability --yield-stress 20Pa --particle-density 7850kg/m3")]
pub(super) struct Arguments {
    /// Yield stress of what surrounds the particles: the mortar, not the concrete
    #[arg(long, value_name = "STRESS", value_parser = stress_or_none)]
    yield_stress: f64,
    /// Density of the particles
    #[arg(long, value_name = "DENSITY", default_value = "2650kg/m3", value_parser = density)]
    particle_density: f64,
    /// Density of what surrounds them
    #[arg(long, value_name = "DENSITY", default_value = "2100kg/m3", value_parser = density)]
    matrix_density: f64,
}

/// Largest diameter in m of a sphere that rests in a yield stress in Pa, for a difference of densities in kg/m3.
fn sphere(yield_stress: f64, difference: f64) -> f64 {
    3.0 * yield_stress / (SPHERE * difference * GRAVITY)
}

/// The same by N. Roussel, Materials and Structures 39 (2006), 81-91.
fn sphere_of_roussel(yield_stress: f64, difference: f64) -> f64 {
    18.0 * yield_stress / (difference * GRAVITY)
}

/// The same of a long cylinder that lies flat.
fn cylinder(yield_stress: f64, difference: f64) -> f64 {
    4.0 / PI * CYLINDER * yield_stress / (difference * GRAVITY)
}

/// Works it out.
pub(super) fn answer(arguments: &Arguments) -> Result<Answer, WrongInput> {
    let &Arguments { yield_stress, particle_density, matrix_density } = arguments;
    let difference = (particle_density - matrix_density).abs();
    if difference == 0.0 {
        return Err(WrongInput(
            "particles as dense as what surrounds them neither sink nor rise; give another --particle-density".to_owned(),
        ));
    }
    Ok(Answer {
        title: "Largest particle that rests",
        inputs: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("density of the particles", "particle_density_kg_m3", particle_density, KG_PER_M3),
            quantity("density around them", "matrix_density_kg_m3", matrix_density, KG_PER_M3),
        ],
        results: vec![
            quantity("sphere, Beris", "sphere_m", sphere(yield_stress, difference), MM),
            quantity("sphere, Roussel", "sphere_roussel_m", sphere_of_roussel(yield_stress, difference), MM),
            quantity("long cylinder lying flat", "cylinder_m", cylinder(yield_stress, difference), MM),
        ],
        equation: &[
            "sphere: d = 3 tau0 / (0.143 drho g) = 21 tau0 / (drho g) (Beris), 18 tau0 / (drho g) (Roussel)",
            "cylinder: d = (4 / pi) 11.94 tau0 / (drho g);  drho difference of densities, g = 9.81 m/s2",
        ],
        source: "Beris and others, J. Fluid Mech. 158 (1985), 219; Roussel, Mater. Struct. 39 (2006), 81; Randolph and Houlsby 1984",
        validity: &[
            "one particle alone, at rest, and a fluid that is not sheared: in flowing concrete none is held",
        ],
        warnings: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diameters_are_those_that_others_have_worked_out() {
        // Yield stress in Pa, difference of densities in kg/m3; diameters in m.
        for (tau0, difference, of_sphere, of_cylinder) in
            [(5.0, 550.0, 0.0194412, 0.0140881), (25.0, 5550.0, 0.00963304, 0.0069806)]
        {
            assert!((sphere(tau0, difference) / of_sphere - 1.0).abs() < 1e-5);
            assert!((cylinder(tau0, difference) / of_cylinder - 1.0).abs() < 1e-5);
        }
        // 16 mm at 450 kg/m3 need 3.9 Pa by Roussel, 3.4 Pa by Beris.
        assert!((sphere_of_roussel(3.924, 450.0) - 0.016).abs() < 1e-5);
        assert!((sphere(3.367, 450.0) - 0.016).abs() < 1e-5);
    }

    #[test]
    fn equal_densities_are_refused_and_light_particles_are_held_as_heavy_ones() {
        let largest = |particle_density: f64| {
            let arguments = Arguments { yield_stress: 10.0, particle_density, matrix_density: 2000.0 };
            answer(&arguments).map(|answer| answer.json()["results"]["sphere_m"].as_f64().unwrap())
        };
        assert!(largest(2000.0).is_err());
        assert_eq!(largest(1900.0).ok(), largest(2100.0).ok());
    }
}
