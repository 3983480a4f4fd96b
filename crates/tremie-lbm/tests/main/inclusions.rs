//! Bodies in the fluid: drag, momentum, invariance.

use std::f64::consts::PI;

use tremie_numerics::{DQuat, DVec3};
use tremie_rheology::FlowCurve;
use tremie_simulation::{Fluid, Simulation};
use tremie_suspension::{
    ContactLaw, Coupling, Felt, Form, Freedom, Inclusions, Kind, Method, Periods, Scheme, Suspension,
};

use crate::{advance, case};

/// A Newtonian fluid of 1000 kg/m3 and 1 Pa s in cells of 1 mm, full, with so many cells, the lattice viscosity and the sides given.
fn full(
    cells: [usize; 3],
    viscosity: f64,
    gravity: DVec3,
    sides: &str,
    precision: &str,
) -> tremie_case::Case {
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

const HELD: Method = Method {
    coupling: Coupling::Slender,
    felt: Felt::Plastic,
    scheme: Scheme::Implicit,
    freedom: Freedom::Held,
};

/// The drag over that of Faxen (1946; Svec 2013, Eq. 3.12) on a cylinder that is held in the middle of a channel, in units of cells.
fn drag_between_plates(diameter: f64, viscosity: f64) -> f64 {
    let (length, height) = (96, 24);
    let cells = [length, height, 1];
    let sides = "[domain.sides]\nx_min = \"periodic\"\nx_max = \"periodic\"\n\
                 z_min = \"periodic\"\nz_max = \"periodic\"";
    let case = full(cells, viscosity, DVec3::new(1e-3, 0.0, 0.0), sides, "f64");
    // One cell long, with a point at each end: the other half of each is its image.
    let mut inclusions = of_kind(Form::Fibre { length: 1e-3, diameter: 1e-3 * diameter }, 1000.0);
    inclusions.add(0, 0, DVec3::new(48.3e-3, 12e-3, 0.5e-3), DQuat::IDENTITY);
    let suspension = Suspension::new(
        inclusions,
        HELD,
        ContactLaw::default(),
        DVec3::ZERO,
        periods(cells, [true, false, true]),
    );
    let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
    // What is left of the start has fallen to exp(-0.8 pi^2), 4e-4.
    advance(&mut *simulation, (0.8 * (height * height) as f64 / viscosity) as usize);
    let snapshot = simulation.snapshot();
    let Fluid::Cells(cells) = snapshot.fluid;
    // The largest speed from the flow rate, which is the same everywhere.
    let mean = cells.velocity.iter().map(|u| u.x).sum::<f64>() / (length * height) as f64;
    let k = diameter / height as f64;
    let f = -k.ln() - 0.915_689_273_2 + 0.054_648_66 * k.powi(4) - 0.264_629_67 * k.powi(6);
    let g = 1.266_539_75 * k.powi(2) - 0.918_043_3 * k.powi(4) + 1.877_101 * k.powi(6);
    let exact = 4.0 * PI / (f + 0.792_986 * k.powi(8) + g - 4.665_49 * k.powi(8)) * 1.5 * mean;
    snapshot.inclusions.drag[0].x / 1e-3 / exact
}

#[test]
fn a_cylinder_between_plates_is_dragged_as_faxen_has_it() {
    for (diameter, viscosity) in [(0.075, 0.1), (1.0, 0.01), (2.0, 0.2)] {
        let ratio = drag_between_plates(diameter, viscosity);
        assert!((ratio - 1.0).abs() < 0.03, "diameter {diameter}, viscosity {viscosity}: {ratio}");
    }
}

#[test]
fn a_crowd_of_fibres_held_in_an_edge_bears_what_drives_the_fluid() {
    // Between walls that bear nothing; each alone would take hold of a third of a cell's momentum in a step.
    let cells = [8, 6, 6];
    let sides = "[domain.sides]\nx_min = \"periodic\"\nx_max = \"periodic\"\ny_min = { surface = \"free_slip\" }\n\
                 y_max = { surface = \"free_slip\" }\nz_min = { surface = \"free_slip\" }\nz_max = { surface = \"free_slip\" }";
    let case = full(cells, 0.15, DVec3::new(1e-3, 0.0, 0.0), sides, "f64");
    let drags = [1, 3, 30].map(|number| {
        let mut inclusions = of_kind(Form::Fibre { length: 8e-3, diameter: 0.075e-3 }, 1000.0);
        for _ in 0..number {
            inclusions.add(0, 0, DVec3::new(4e-3, 0.2e-3, 0.3e-3), DQuat::from_rotation_y(0.5 * PI));
        }
        let law = ContactLaw::default();
        let periods = periods(cells, [true, false, false]);
        let suspension = Suspension::new(inclusions, HELD, law, DVec3::ZERO, periods);
        let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
        advance(&mut *simulation, 4000);
        let snapshot = simulation.snapshot();
        let Fluid::Cells(fluid) = snapshot.fluid;
        let mean = fluid.velocity.iter().map(|u| u.x).sum::<f64>() / fluid.velocity.len() as f64;
        (snapshot.inclusions.drag.iter().map(|drag| drag.x).sum::<f64>(), mean)
    });
    let weight = 1000.0 * 1e-3 * cells.iter().product::<usize>() as f64 * 1e-9;
    assert!(drags.iter().all(|(drag, _)| (drag / weight - 1.0).abs() < 1e-3), "{drags:?} {weight}");
    // The more there are the slower all of it.
    assert!(drags.is_sorted_by(|a, b| a.1 > b.1 && b.1 > 0.0), "{drags:?}");
}

/// The radius in cells of the sphere that would be dragged as much as one of this diameter is in a periodic box of so many cells (Hasimoto 1959).
fn hydrodynamic_radius(diameter: f64, viscosity: f64, edge: usize) -> f64 {
    let cells = [edge; 3];
    let case = full(cells, viscosity, DVec3::new(1e-3, 0.0, 0.0), PERIODIC, "f64");
    let mut inclusions = of_kind(Form::Sphere { diameter: 1e-3 * diameter }, 1000.0);
    let middle = 0.5e-3 * edge as f64;
    inclusions.add(0, 0, DVec3::new(middle + 0.2e-3, middle + 0.4e-3, middle + 0.1e-3), DQuat::IDENTITY);
    let suspension =
        Suspension::new(inclusions, HELD, ContactLaw::default(), DVec3::ZERO, periods(cells, [true; 3]));
    let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
    advance(&mut *simulation, (0.6 * (edge * edge) as f64 / viscosity) as usize);
    let snapshot = simulation.snapshot();
    let Fluid::Cells(cells) = snapshot.fluid;
    let mean = cells.velocity.iter().map(|u| u.x).sum::<f64>() / edge.pow(3) as f64;
    let drag = snapshot.inclusions.drag[0].x / (6.0 * PI * mean) / 1e-3;
    // 6 pi mu a U / F = 1 - 1.7601 c^(1/3) + c - 1.5593 c^2, by bisection.
    let off = |a: f64| {
        let c = 4.0 / 3.0 * PI * (a / edge as f64).powi(3);
        drag * (1.0 - 1.7601 * c.cbrt() + c - 1.5593 * c * c) - a
    };
    let (mut low, mut high) = (0.0, 0.4 * edge as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if off(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_sphere_is_as_large_as_it_is() {
    // Smaller ones are too large: benchmark `sphere-drag`.
    for (diameter, viscosity) in [(4.0, 0.05), (6.0, 0.1)] {
        let radius = hydrodynamic_radius(diameter, viscosity, (4.0 * diameter) as usize);
        assert!((2.0 * radius / diameter - 1.0).abs() < 0.05, "{diameter} cells, {viscosity}: {radius}");
    }
}

#[test]
fn fluid_that_has_not_yielded_holds_a_heavy_fibre_that_feels_its_apparent_viscosity() {
    let cells = [16, 16, 16];
    let sinks = |felt: Felt| {
        let mut case = full(cells, 0.05, DVec3::ZERO, PERIODIC, "f64");
        case.material.curve = FlowCurve::Bingham { yield_stress: 1e3, plastic_viscosity: 1.0 };
        let mut inclusions = of_kind(Form::Fibre { length: 6e-3, diameter: 0.1e-3 }, 7850.0);
        inclusions.add(0, 0, DVec3::splat(8.2e-3), DQuat::from_rotation_arc(DVec3::Z, DVec3::X));
        let method = Method { felt, ..Method::default() };
        let periods = periods(cells, [true; 3]);
        let suspension = Suspension::new(inclusions, method, ContactLaw::default(), DVec3::ZERO, periods);
        let suspension = suspension.under(-9.81 * DVec3::Z);
        let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
        advance(&mut *simulation, 200);
        let snapshot = simulation.snapshot();
        let Fluid::Cells(cells) = snapshot.fluid;
        // Against the fluid, which all moves down together: nothing holds a periodic box.
        let fluid = cells.velocity.iter().map(|u| u.z).sum::<f64>() / cells.velocity.len() as f64;
        fluid - snapshot.inclusions.velocity[0].z
    };
    let [plastic, apparent] = [Felt::Plastic, Felt::Apparent].map(sinks);
    // Of a fibre that falls across itself through the plastic viscosity alone.
    let weight = 6850.0 * 9.81 * PI / 4.0 * 1e-8;
    let slender = weight * (2.0f64 * 1.162 / 0.1).ln() / (4.0 * PI);
    assert!((plastic / slender - 1.0).abs() < 0.05, "{plastic} {slender}");
    assert!(apparent > 0.0 && apparent < 0.05 * plastic, "{apparent} {plastic}");
}

#[test]
fn fluid_that_has_not_yielded_is_calm_around_many_heavy_fibres_that_it_holds() {
    let cells = [24, 24, 16];
    let mut case = full(cells, 0.15, DVec3::ZERO, "", "f64");
    case.material.curve = FlowCurve::Bingham { yield_stress: 10.0, plastic_viscosity: 1.0 };
    let mut inclusions = of_kind(Form::Fibre { length: 6e-3, diameter: 0.2e-3 }, 7850.0);
    for n in 0..40 {
        // Spread evenly, as multiples of irrational numbers are.
        let share = |m: f64| (m * f64::from(n)).fract();
        let place = DVec3::new(4.0 + 16.0 * share(0.618), 4.0 + 16.0 * share(0.755), 4.0 + 8.0 * share(0.57));
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.7, -0.4) * f64::from(n));
        inclusions.add(0, 0, 1e-3 * place, turn);
    }
    // On the floor.
    for n in 0..8 {
        let place = DVec3::new(4.1 + 2.0 * f64::from(n), 5.0 + f64::from(n), 0.11);
        let turn = DQuat::from_rotation_z(0.3) * DQuat::from_rotation_arc(DVec3::Z, DVec3::Y);
        inclusions.add(0, 0, 1e-3 * place, turn);
    }
    let method = Method { felt: Felt::Apparent, ..Method::default() };
    let suspension =
        Suspension::new(inclusions, method, ContactLaw::default(), DVec3::ZERO, Periods::default());
    let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension.under(-9.81 * DVec3::Z)));
    advance(&mut *simulation, 1000);
    let snapshot = simulation.snapshot();
    let Fluid::Cells(cells) = snapshot.fluid;
    let fastest = |of: &[DVec3]| of.iter().map(|u| u.length()).fold(0.0, f64::max);
    // What a fibre would sink at across itself through the plastic viscosity alone.
    let slender = 6850.0 * 9.81 * PI / 4.0 * 4e-8 * (2.0f64 * 1.162 / 0.2).ln() / (4.0 * PI);
    let [fluid, fibres] = [fastest(&cells.velocity), fastest(&snapshot.inclusions.velocity)];
    assert!(fluid < 0.05 * slender && fibres < 0.2 * slender, "{fluid} {fibres} {slender}");
}

#[test]
fn momentum_goes_from_the_fluid_to_the_bodies_and_none_is_lost() {
    let cells = [24, 20, 16];
    let case = full(cells, 0.05, DVec3::ZERO, PERIODIC, "f64");
    let mut inclusions = of_kind(Form::Fibre { length: 6e-3, diameter: 0.1e-3 }, 7850.0);
    inclusions.kinds.push(Kind {
        name: "ball".into(),
        form: Form::Sphere { diameter: 4e-3 },
        density: 2600.0,
    });
    for n in 0..30 {
        let at = |m: f64| 1e-3 * (m * f64::from(n) + 0.5);
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.7, -0.4) * f64::from(n));
        let place = periods(cells, [true; 3]).inside(DVec3::ZERO, DVec3::new(at(7.1), at(3.3), at(5.7)));
        inclusions.add(u16::from(n % 10 == 0), 0, place, turn);
        inclusions.velocity[n as usize] = DVec3::new(0.05, -0.02, 0.03 * f64::from(n).sin());
    }
    let suspension = Suspension::new(
        inclusions,
        Method::default(),
        ContactLaw::default(),
        DVec3::ZERO,
        periods(cells, [true; 3]),
    );
    let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
    let momentum = |simulation: &dyn Simulation| {
        let snapshot = simulation.snapshot();
        let Fluid::Cells(cells) = &snapshot.fluid;
        let step = simulation.time_step();
        let unit = 1000.0 * (1e-3 / step).powi(2);
        let fluid: DVec3 = cells
            .velocity
            .iter()
            .zip(&cells.pressure)
            .map(|(u, p)| 1000.0 * (1.0 + 3.0 * p / unit) * 1e-9 * *u)
            .sum();
        let bodies = &snapshot.inclusions;
        let mass = |n: usize| bodies.kinds[usize::from(bodies.kind[n])].density * bodies.form(n).volume();
        let own: DVec3 = (0..bodies.len()).map(|n| mass(n) * bodies.velocity[n]).sum();
        // A snapshot shows the fluid with half of the forces that it got last once more.
        let drag: DVec3 = bodies.drag.iter().sum();
        [fluid + 0.5 * step * drag, own]
    };
    let before = momentum(&*simulation);
    advance(&mut *simulation, 400);
    let after = momentum(&*simulation);
    let all = before[1].length();
    assert!(
        (after[1] - before[1]).length() > 0.5 * all,
        "bodies have hardly been slowed: {before:?} {after:?}"
    );
    assert!((after[0] + after[1] - before[0] - before[1]).length() < 1e-11 * all, "{before:?} {after:?}");
}

/// A column of mortar with fibres and balls that collapses, seen from its corner between two planes of symmetry.
fn collapse() -> (tremie_case::Case, Suspension) {
    let case = case(
        "[material]\ndensity = \"2300 kg/m3\"\n\
         [material.bingham]\nyield_stress = \"20 Pa\"\nplastic_viscosity = \"10 Pa s\"\n\
         [domain]\nmin = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"0.3 m\", \"0.2 m\", \"0.2 m\"]\n\
         [domain.sides]\nx_min = \"symmetry\"\ny_min = \"symmetry\"\nz_max = \"open\"\n\
         [[fluid]]\nbox = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.1 m\", \"0.1 m\", \"0.15 m\"] }\n\
         [lbm]\ncell_size = \"10 mm\"\n",
    );
    let mut inclusions = of_kind(Form::Fibre { length: 0.06, diameter: 0.75e-3 }, 7850.0);
    inclusions.kinds.push(Kind {
        name: "stone".into(),
        form: Form::Sphere { diameter: 0.025 },
        density: 2600.0,
    });
    for n in 0..40 {
        let at = |m: f64| 0.03 + 0.04 * (m * f64::from(n)).fract();
        let turn = DQuat::from_scaled_axis(DVec3::new(1.3, 0.7, -0.4) * f64::from(n));
        inclusions.add(u16::from(n % 8 == 0), 1, DVec3::new(at(0.618), at(0.414), 1.7 * at(0.732)), turn);
    }
    (
        case,
        Suspension::new(
            inclusions,
            Method::default(),
            ContactLaw::default(),
            DVec3::ZERO,
            Periods::default(),
        ),
    )
}

#[test]
fn bodies_move_the_same_on_any_threads_and_after_a_restart() {
    let run = |threads: usize, stop: Option<usize>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (case, suspension) = collapse();
            let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
            if let Some(stop) = stop {
                advance(&mut *simulation, stop);
                let saved = simulation.save();
                simulation = tremie_lbm::simulation_with(&case, Some(collapse().1));
                simulation.restore(&saved).unwrap();
                advance(&mut *simulation, 300 - stop);
            } else {
                advance(&mut *simulation, 300);
            }
            simulation.snapshot()
        })
    };
    let one = run(1, None);
    assert!(one.inclusions.velocity.iter().all(|v| v.is_finite() && v.length() > 1e-4));
    assert_eq!(one.inclusions, run(2, None).inclusions);
    let resumed = run(2, Some(137));
    assert_eq!(one.inclusions, resumed.inclusions, "after a restart");
    assert!(one == resumed, "the fluid after a restart");
}

#[test]
fn bodies_stay_in_the_fluid_and_out_of_the_floor() {
    let (case, suspension) = collapse();
    let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
    let cell = 0.01;
    for _ in 0..8 {
        advance(&mut *simulation, 100);
        let snapshot = simulation.snapshot();
        let (bodies, Fluid::Cells(cells)) = (&snapshot.inclusions, &snapshot.fluid);
        // Of a cell that holds fluid.
        let outside = |p: DVec3| {
            let at = ((p - cells.origin) / cell - 0.5).round();
            let near =
                (0..27).map(|n| at + DVec3::new((n % 3) as f64, (n / 3 % 3) as f64, (n / 9) as f64) - 1.0);
            let count = DVec3::from(cells.count.map(|n| n as f64));
            let wet = near.filter(|at| at.cmpge(DVec3::ZERO).all() && at.cmplt(count).all()).any(|at| {
                let [i, j, k] = at.to_array().map(|n| n as usize);
                cells.fill[cells.index(i, j, k)] > 0.0
            });
            !wet
        };
        for n in 0..bodies.len() {
            let (points, radius) = match (bodies.ends(n), bodies.form(n)) {
                (Some(ends), _) => (ends.to_vec(), 0.375e-3),
                (None, form) => (vec![bodies.position[n]], form.reach()),
            };
            for p in points {
                // A tenth of a cell for fibres, 1 % of the diameter for others.
                let sunk = (radius - p.min_element()).max(0.0);
                assert!(sunk < 0.1 * cell, "body {n} is {sunk} m deep in a wall");
                assert!(!outside(p), "body {n} is out of the fluid at {p}");
            }
        }
    }
}

/// Held, half out of a pool at rest: what draws it in draws the fluid out, but not so that it flows.
#[test]
fn a_sphere_that_cannot_be_drawn_in_stirs_nothing() {
    let case = case(
        "[material]\ndensity = \"2300 kg/m3\"\nbingham = { yield_stress = \"45 Pa\", plastic_viscosity = \"27 Pa s\" }\n\
         [domain]\nmin = [\"0 mm\", \"0 mm\", \"0 mm\"]\nmax = [\"48 mm\", \"48 mm\", \"40 mm\"]\n\
         [[fluid]]\nbox = { min = [\"0 mm\", \"0 mm\", \"0 mm\"], max = [\"48 mm\", \"48 mm\", \"16 mm\"] }\n\
         [lbm]\ncell_size = \"4 mm\"\nstepping = \"fixed\"\ntime_step = \"0.3 ms\"\n",
    );
    let mut inclusions = of_kind(Form::Sphere { diameter: 0.01 }, 2392.0);
    inclusions.add(0, 0, DVec3::new(0.024, 0.023, 0.018), DQuat::IDENTITY);
    let law = ContactLaw::default();
    let suspension = Suspension::new(inclusions, HELD, law, DVec3::ZERO, Periods::default());
    let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
    advance(&mut *simulation, 1000);
    let Fluid::Cells(fluid) = simulation.snapshot().fluid;
    let fastest = fluid.velocity.iter().map(|u| u.length()).fold(0.0, f64::max);
    assert!(fastest < 5e-3, "{fastest} m/s");
}

#[test]
fn a_fibre_across_a_periodic_side_feels_what_it_would_in_the_middle() {
    let cells = [24, 8, 8];
    let case = full(cells, 0.1, DVec3::new(1e-3, 0.0, 0.0), PERIODIC, "f64");
    let drag = |x: f64| {
        // Its ends are six cells from its centre.
        let mut inclusions = of_kind(Form::Fibre { length: 12e-3, diameter: 0.1e-3 }, 1000.0);
        inclusions.add(0, 0, 1e-3 * DVec3::new(x, 4.2, 3.7), DQuat::from_rotation_arc(DVec3::Z, DVec3::X));
        let contact = ContactLaw::default();
        let suspension = Suspension::new(inclusions, HELD, contact, DVec3::ZERO, periods(cells, [true; 3]));
        let mut simulation = tremie_lbm::simulation_with(&case, Some(suspension));
        advance(&mut *simulation, 200);
        simulation.snapshot().inclusions.drag[0].x
    };
    let (middle, across) = (drag(12.3), drag(0.3));
    assert!((across / middle - 1.0).abs() < 1e-9, "{across} {middle}");
}
