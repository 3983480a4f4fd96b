//! Bodies in the fluid: drag, momentum, invariance.

use std::f64::consts::PI;

use tremie_lbm::LatticeBoltzmann;
use tremie_numerics::{DQuat, DVec3};
use tremie_simulation::Simulation;
use tremie_suspension::{Form, Inclusions, Kind, Method, Periods, Suspension};

use crate::case;

/// A Newtonian fluid of 1000 kg/m3 and 1 Pa s in cells of 1 mm, full, with so many cells, the lattice viscosity and the sides given.
fn full(cells: [usize; 3], viscosity: f64, gravity: DVec3, sides: &str, precision: &str) -> tremie_case::Case {
    let [nx, ny, nz] = cells;
    let step = viscosity * 1e-3;
    case(&format!(
        "[material]\ndensity = \"1000 kg/m3\"\n[material.newtonian]\nviscosity = \"1 Pa s\"\n\
         [domain]\nmin = [\"0 mm\", \"0 mm\", \"0 mm\"]\nmax = [\"{nx} mm\", \"{ny} mm\", \"{nz} mm\"]\n\
         gravity = [\"{} m/s2\", \"{} m/s2\", \"{} m/s2\"]\n{sides}\n\
         [[fluid]]\nbox = {{ min = [\"0 mm\", \"0 mm\", \"0 mm\"], max = [\"{nx} mm\", \"{ny} mm\", \"{nz} mm\"] }}\n\
         [lbm]\ncell_size = \"1 mm\"\nprecision = \"{precision}\"\nstepping = \"fixed\"\ntime_step = \"{step} s\"\n",
        gravity.x, gravity.y, gravity.z
    ))
}

const PERIODIC: &str = "[domain.sides]\nx_min = \"periodic\"\nx_max = \"periodic\"\ny_min = \"periodic\"\ny_max = \"periodic\"\nz_min = \"periodic\"\nz_max = \"periodic\"";

fn periods(cells: [usize; 3], periodic: [bool; 3]) -> Periods {
    Periods([0, 1, 2].map(|a| periodic[a].then_some(1e-3 * cells[a] as f64)))
}

/// One kind of bodies.
fn of_kind(form: Form, density: f64) -> Inclusions {
    Inclusions { kinds: vec![Kind { name: "body".into(), form, density }], ..Inclusions::default() }
}

#[test]
fn a_cylinder_between_plates_is_dragged_as_faxen_has_it() {
    // Fixed on the mid-plane of a channel; u_max from the flow rate, which is the same everywhere. (Faxen 1946; Svec 2013, Eq. 3.12.)
    let (length, height) = (96, 24);
    for (diameter, viscosity) in [(0.075, 0.1), (0.3, 0.1), (1.0, 0.1), (2.0, 0.1), (0.3, 0.01), (0.3, 0.2), (1.0, 0.2), (1.9, 0.2)] {
        let cells = [length, height, 1];
        let sides = "[domain.sides]\nx_min = \"periodic\"\nx_max = \"periodic\"\nz_min = \"periodic\"\nz_max = \"periodic\"";
        let case = full(cells, viscosity, DVec3::new(1e-3, 0.0, 0.0), sides, "f64");
        let (d, h) = (1e-3 * diameter, 1e-3 * height as f64);
        // One cell long, with a point at each end of it: the other half of each is its image.
        let mut inclusions = of_kind(Form::Fibre { length: 1e-3, diameter: d }, 1000.0);
        inclusions.add(0, 0, DVec3::new(48.3e-3, 12e-3, 0.5e-3), DQuat::IDENTITY);
        let method = Method { held: true, ..Method::default() };
        let suspension = Suspension::new(inclusions, method, DVec3::ZERO, periods(cells, [true, false, true]));
        let mut simulation = LatticeBoltzmann::<f64>::with(&case, Some(suspension));
        let steps = (1.2 * (height * height) as f64 / viscosity) as usize;
        for _ in 0..steps {
            simulation.advance().unwrap();
        }
        let drag = simulation.suspension().unwrap().drag(0).0.x / 1e-3;
        let cells = crate::cells(&simulation);
        let flow: f64 = cells.velocity.iter().map(|u| u.x).sum::<f64>() / (length * height) as f64;
        let k = d / h;
        let (f, g) = (
            -0.9156892732 - k.ln(),
            1.26653975 * k.powi(2) - 0.9180433 * k.powi(4) + 1.877101 * k.powi(6) - 4.66549 * k.powi(8),
        );
        let f = f + 0.05464866 * k.powi(4) - 0.26462967 * k.powi(6) + 0.792986 * k.powi(8);
        let exact = 4.0 * PI / (f + g) * 1.0 * 1.5 * flow;
        println!("d {diameter} nu {viscosity}: {:.4}", drag / exact);
    }
}
