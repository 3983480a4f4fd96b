//! Fluid that nothing holds falls freely, whatever its surface.

use crate::{advance, case, cells};

/// Centre of mass and mean velocity along z.
fn mean(simulation: &dyn tremie_simulation::Simulation) -> [f64; 2] {
    let cells = cells(simulation);
    let (mut mass, mut sums) = (0.0, [0.0; 2]);
    for k in 0..cells.count[2] {
        for j in 0..cells.count[1] {
            for i in 0..cells.count[0] {
                let n = cells.index(i, j, k);
                mass += cells.fill[n];
                sums[0] += cells.fill[n] * cells.centre(i, j, k).z;
                sums[1] += cells.fill[n] * cells.velocity[n].z;
            }
        }
    }
    sums.map(|sum| sum / mass)
}

#[test]
fn what_nothing_holds_falls_freely() {
    // 10 cells across; most cells that hold less than all of theirs are at its sides.
    let shapes = [
        "sphere = { centre = [\"0 m\", \"0 m\", \"0.8 m\"], diameter = \"100 mm\" }",
        "cylinder = { point = [\"0 m\", \"0 m\", \"0.8 m\"], axis = [0, 1, 0], diameter = \"100 mm\" }",
    ];
    for shape in shapes {
        for material in [
            "newtonian.viscosity = \"75 Pa s\"",
            "bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"20 Pa s\" }",
        ] {
            let mut simulation = tremie_lbm::simulation(&case(&format!(
                "[material]\ndensity = \"2318 kg/m3\"\n{material}\n\
                 [domain]\nmin = [\"-80 mm\", \"-80 mm\", \"0.2 m\"]\nmax = [\"80 mm\", \"80 mm\", \"1 m\"]\n\
                 sides = {{ y_min = \"periodic\", y_max = \"periodic\", z_max = \"open\" }}\n\
                 [[fluid]]\n{shape}\n[lbm]\ncell_size = \"10 mm\"\n"
            )));
            let [start, _] = mean(&*simulation);
            while simulation.time() < 0.28 {
                advance(&mut *simulation, 1);
            }
            let ([z, speed], time) = (mean(&*simulation), simulation.time());
            let (fallen, falls) = (start - z, -speed);
            let free = [0.5 * 9.81 * time.powi(2), 9.81 * time];
            assert!((falls / free[1] - 1.0).abs() < 0.05, "{shape} {material}: {falls} m/s of {}", free[1]);
            assert!((fallen / free[0] - 1.0).abs() < 0.06, "{shape} {material}: {fallen} m of {}", free[0]);
        }
    }
}
