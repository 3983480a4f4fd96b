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

/// Speed and way of a body that is let go, over those of free fall, after 0.28 s in cells of this width in mm.
fn fall(shape: &str, material: &str, cell: u32) -> [f64; 2] {
    let mut simulation = tremie_lbm::simulation(&case(&format!(
        "[material]\ndensity = \"2318 kg/m3\"\n{material}\n\
         [domain]\nmin = [\"-80 mm\", \"-80 mm\", \"0.2 m\"]\nmax = [\"80 mm\", \"80 mm\", \"1 m\"]\n\
         sides = {{ y_min = \"periodic\", y_max = \"periodic\", z_max = \"open\" }}\n\
         [[fluid]]\n{shape}\n[lbm]\ncell_size = \"{cell} mm\"\n"
    )));
    let [start, _] = mean(&*simulation);
    while simulation.time() < 0.28 {
        advance(&mut *simulation, 1);
    }
    let ([z, speed], time) = (mean(&*simulation), simulation.time());
    [-speed / (9.81 * time), (start - z) / (0.5 * 9.81 * time.powi(2))]
}

#[test]
fn what_nothing_holds_falls_freely() {
    // 10 cells across, and 20; most cells that hold less than all of theirs are at its sides.
    let ball = "sphere = { centre = [\"0 m\", \"0 m\", \"0.8 m\"], diameter = \"100 mm\" }";
    let rod = "cylinder = { point = [\"0 m\", \"0 m\", \"0.8 m\"], axis = [0, 1, 0], diameter = \"100 mm\" }";
    let newtonian = "newtonian.viscosity = \"75 Pa s\"";
    let bingham = "bingham = { yield_stress = \"50 Pa\", plastic_viscosity = \"20 Pa s\" }";
    for (shape, material) in [(ball, newtonian), (ball, bingham), (rod, newtonian), (rod, bingham)] {
        let [speed, way] = fall(shape, material, 10);
        assert!((speed - 1.0).abs() < 0.05, "{shape} {material}: {speed}");
        assert!((way - 1.0).abs() < 0.06, "{shape} {material}: {way}");
    }
    let [coarse, fine] = [10, 5].map(|cell| fall(ball, newtonian, cell)[0]);
    assert!((fine - 1.0).abs() < 0.7 * (coarse - 1.0).abs(), "{coarse} {fine}");
}
