//! Particles as a simulation of a case.

use tremie_case::Case;
use tremie_geometry::{Body, Motion, Shape};
use tremie_numerics::DVec3;
use tremie_output::state::Array;
use tremie_simulation::{Cells, Fluid, Simulation};

/// A cone of concrete in its mould, in a plane; the mould stands as high above the floor as `base` says and is lifted as `path` says.
fn case(base: &str, path: &str, spacing: &str) -> Case {
    let text = format!(
        r#"title = "Planar slump"
method = "isph"

[material]
density = "2000 kg/m3"
bingham = {{ yield_stress = "50 Pa", plastic_viscosity = "20 Pa s" }}

[domain]
min = ["-200 mm", "0 mm", "0 mm"]
max = ["200 mm", "{spacing}", "320 mm"]
sides = {{ y_min = "periodic", y_max = "periodic" }}

[[fluid]]
cone = {{ base = ["0 mm", "5 mm", "{base}"], base_diameter = "200 mm", top_diameter = "100 mm", height = "300 mm" }}

[[solid]]
name = "mould"
cone_shell = {{ base = ["0 mm", "5 mm", "{base}"], base_diameter = "200 mm", top_diameter = "100 mm", height = "310 mm", thickness = "12 mm" }}
motion.path.points = [{path}]

[isph]
spacing = "{spacing}"

[gauges]
interval = "10 ms"

[stop]
time = "1 s"
"#
    );
    Case::parse("slump.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

const LIFTED: &str =
    r#"{ time = "0 s", offset = ["0 m", "0 m", "0 m"] }, { time = "1 s", offset = ["0 m", "0 m", "0.3 m"] }"#;
const HELD: &str = r#"{ time = "0 s", offset = ["0 m", "0 m", "0 m"] }"#;

fn cells(simulation: &dyn Simulation) -> Cells {
    let Fluid::Cells(cells) = simulation.snapshot().fluid;
    cells
}

#[test]
fn a_run_goes_on_from_a_saved_state_to_the_bit() {
    let case = case("0 mm", LIFTED, "10 mm");
    let mut one = tremie_sph::simulation(&case);
    for _ in 0..15 {
        one.advance().unwrap();
    }
    let saved = one.save();
    let mut other = tremie_sph::simulation(&case);
    other.restore(&saved).unwrap();
    for _ in 0..15 {
        one.advance().unwrap();
        other.advance().unwrap();
    }
    assert_eq!((one.time(), one.save()), (other.time(), other.save()));
    assert_eq!(one.snapshot(), other.snapshot());

    let mut finer = tremie_sph::simulation(&self::case("0 mm", LIFTED, "5 mm"));
    assert!(finer.restore(&saved).unwrap_err().to_string().contains("spacing 0.01 m"));
}

#[test]
fn what_is_seen_takes_the_place_of_what_was_seen_before() {
    let mut slump = tremie_sph::simulation(&case("0 mm", LIFTED, "10 mm"));
    let other = cone(r#"["0 mm", "0 mm", "0 mm"]"#, r#"x_min = "symmetry", y_min = "symmetry""#);
    let mut seen = tremie_sph::simulation(&other).snapshot();
    for _ in 0..2 {
        slump.see(&mut seen);
        assert_eq!(seen, slump.snapshot());
        for _ in 0..15 {
            slump.advance().unwrap();
        }
    }
    // In a box around the fluid and the mould, not in all of the domain, which is 400 mm wide.
    let Fluid::Cells(cells) = seen.fluid;
    assert!(cells.count[0] < 40 && cells.origin.x > -0.2, "{:?} {}", cells.count, cells.origin);
}

/// Particles that have been flung out of the domain are seen nowhere, and take nobody with them.
#[test]
fn what_is_beyond_the_domain_is_not_seen() {
    let case = cone(r#"["0 mm", "0 mm", "0 mm"]"#, r#"x_min = "symmetry", y_min = "symmetry""#);
    let mut slump = tremie_sph::simulation(&case);
    let whole = slump.save();
    let before = cells(slump.as_ref());
    let mut flung = |number: usize, at: DVec3| {
        let mut state = whole.clone();
        let positions = state.arrays.iter_mut().find(|(name, _)| name == "positions");
        let Some((_, Array::F64(positions))) = positions else { panic!("no positions") };
        for of in positions.as_chunks_mut::<3>().0.iter_mut().take(number) {
            *of = at.to_array();
        }
        slump.restore(&state).unwrap();
        cells(slump.as_ref())
    };
    for at in [DVec3::new(0.1, 0.1, 5.0), DVec3::new(-3.0, 0.1, 0.1), DVec3::new(0.1, 0.1, -2.0)] {
        let volume = |cells: &Cells| cells.fill.iter().sum::<f64>();
        let lost = volume(&before) - volume(&flung(1, at));
        assert!((0.0..3.0).contains(&lost), "{lost} cells by one particle at {at}");
        assert_eq!(volume(&flung(usize::MAX, at)), 0.0);
    }
}

/// A mould that stands on the floor holds what is in it, although it is hardly thicker than the particles are apart.
#[test]
fn nothing_leaks_through_a_thin_mould() {
    let case = case("0 mm", HELD, "10 mm");
    let mut held = tremie_sph::simulation(&case);
    let before = cells(held.as_ref());
    let volume = |cells: &Cells| cells.fill.iter().sum::<f64>();
    while held.time() < 0.5 {
        held.advance().unwrap();
    }
    let after = cells(held.as_ref());
    assert!((volume(&after) / volume(&before) - 1.0).abs() < 0.01, "{} {}", volume(&after), volume(&before));
    let [nx, _, _] = after.count;
    let half_width = |z: f64| 0.1 - 0.05 * z / 0.3;
    for n in (0..after.fill.len()).filter(|n| after.fill[*n] > 0.0) {
        let at: DVec3 = after.centre(n % nx, 0, n / nx);
        assert!(at.x.abs() < half_width(at.z) + 0.01, "{at}");
    }
    // What it weighs rests on the floor and on the mould.
    let snapshot = held.snapshot();
    let weight = 2000.0 * 9.81 * volume(&after) * after.size.powi(3);
    let borne = -(snapshot.walls.sides[4].force + snapshot.solids[0].force).z;
    assert!((borne / weight - 1.0).abs() < 0.1, "{borne} of {weight}");
}

/// A lifted mould lets go of it on both sides alike.
#[test]
fn a_slump_is_symmetric() {
    let case = case("0 mm", LIFTED, "10 mm");
    let mut slump = tremie_sph::simulation(&case);
    while slump.time() < 0.3 {
        slump.advance().unwrap();
    }
    let after = cells(slump.as_ref());
    let [nx, _, nz] = after.count;
    let column = |i: &usize| (0..nz).map(|k| after.fill[after.index(*i, 0, k)]).sum::<f64>();
    let right_of = |i: &usize| after.centre(*i, 0, 0).x;
    let left: f64 = (0..nx).filter(|i| right_of(i) < 0.0).map(|i| column(&i)).sum();
    let right: f64 = (0..nx).filter(|i| right_of(i) > 0.0).map(|i| column(&i)).sum();
    assert!((left / right - 1.0).abs() < 0.02, "{left} {right}");
    assert!((0..nx).any(|i| right_of(&i) > 0.1 && column(&i) > 0.0));
}

/// A cone of concrete in space that is let go, in a box with these lower corner and sides.
fn cone(min: &str, sides: &str) -> Case {
    let text = format!(
        r#"title = "Slump"
method = "isph"

[material]
density = "2000 kg/m3"
bingham = {{ yield_stress = "50 Pa", plastic_viscosity = "20 Pa s" }}

[domain]
min = {min}
max = ["240 mm", "240 mm", "320 mm"]
sides = {{ {sides} }}

[[fluid]]
cone = {{ base = ["0 mm", "0 mm", "0 mm"], base_diameter = "200 mm", top_diameter = "100 mm", height = "300 mm" }}

[isph]
spacing = "20 mm"

[gauges]
interval = "10 ms"

[stop]
time = "1 s"
"#
    );
    Case::parse("slump.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// A quarter of a slump between planes of symmetry is a quarter of it.
#[test]
fn a_quarter_of_a_slump_in_space_is_as_the_whole() {
    let quarter = cone(r#"["0 mm", "0 mm", "0 mm"]"#, r#"x_min = "symmetry", y_min = "symmetry""#);
    let whole = cone(r#"["-240 mm", "-240 mm", "0 mm"]"#, "");
    let [quarter, whole] = [quarter, whole].map(|case| {
        let mut slump = tremie_sph::simulation(&case);
        let volume = |cells: &Cells| cells.fill.iter().sum::<f64>() * cells.size.powi(3);
        let before = volume(&cells(slump.as_ref()));
        // Until it hardly moves: their steps do not end at the same times.
        while slump.time() < 0.5 {
            slump.advance().unwrap();
        }
        let after = cells(slump.as_ref());
        let [nx, ny, _] = after.count;
        let lifted: f64 = (0..after.fill.len())
            .map(|n| after.fill[n] * after.centre(0, 0, n / (nx * ny)).z * after.size.powi(3))
            .sum();
        (volume(&after) / before, lifted / volume(&after))
    });
    assert!((quarter.0 / whole.0 - 1.0).abs() < 0.02, "volume {quarter:?} {whole:?}");
    assert!((quarter.1 / whole.1 - 1.0).abs() < 0.03, "mean height {quarter:?} {whole:?}");
}

/// What leaves through an open side is gone, and counted.
#[test]
fn fluid_leaves_through_open_sides() {
    let open = r#"x_min = "open", x_max = "open", y_min = "open", y_max = "open""#;
    let case = cone(r#"["-120 mm", "-240 mm", "0 mm"]"#, open);
    let mut slump = tremie_sph::simulation(&case);
    let before = slump.load().wet;
    while slump.time() < 0.5 {
        slump.advance().unwrap();
    }
    let (after, left) = (slump.load().wet, slump.snapshot().outflow.unwrap());
    assert!(after < before, "{before} {after}");
    assert!((left / 0.02_f64.powi(3) - (before - after) as f64).abs() < 1e-6, "{left}");
}

/// Half of a film of 10 Pa s between plates without slip, in a plane, 10 mm high and 50 mm wide, eight particles over its height; a load without mass of 20 N per metre of depth, on both halves, moves the upper plate.
fn film(method: &str) -> Case {
    let text = format!(
        r#"title = "Film"
method = "{method}"

[material]
density = "2000 kg/m3"
newtonian = {{ viscosity = "10 Pa s" }}

[domain]
min = ["0 mm", "0 mm", "0 mm"]
max = ["75 mm", "1.25 mm", "12.5 mm"]
gravity = ["0 m/s2", "0 m/s2", "0 m/s2"]
sides = {{ x_min = "symmetry", y_min = "periodic", y_max = "periodic" }}

[[fluid]]
box = {{ min = ["-1 m", "-1 m", "0 m"], max = ["50 mm", "1 m", "10 mm"] }}

[[solid]]
name = "plate"
box = {{ min = ["-1 m", "-1 m", "10 mm"], max = ["1 m", "1 m", "1 m"] }}
motion.load.force = ["0 N", "0 N", "-0.025 N"]

[{method}]
spacing = "1.25 mm"

[gauges]
interval = "10 ms"

[stop]
time = "1 s"
"#
    );
    Case::parse("film.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// It sinks as lubrication has it, F h^3/(8 mu L^3), by both schemes, and goes on from a checkpoint as it would have.
#[test]
fn a_plate_without_mass_sinks_as_its_load_has_it() {
    for (method, off) in [("isph", 0.05), ("sph", 0.1)] {
        let case = film(method);
        let mut simulation = tremie_sph::simulation(&case);
        let go = |simulation: &mut Box<dyn Simulation>, end: f64| {
            while simulation.time() < end {
                simulation.advance().unwrap_or_else(|error| panic!("{error:?}"));
            }
        };
        go(&mut simulation, 0.01);
        let (first, start) = (simulation.snapshot(), simulation.time());
        let state = simulation.save();
        go(&mut simulation, 0.02);
        let last = simulation.snapshot();
        let speed = (first.moved[0].z - last.moved[0].z) / (simulation.time() - start);
        let exact = 20.0 * 1e-6 / (8.0 * 10.0 * 0.05f64.powi(3));
        assert!((speed / exact - 1.0).abs() < off, "{method}: {speed} for {exact}");
        // What it bears is the load, on half of its depth.
        assert!((last.solids[0].force.z / 0.0125 - 1.0).abs() < 0.05, "{method}: {:?}", last.solids[0]);
        let mut other = tremie_sph::simulation(&case);
        other.restore(&state).unwrap_or_else(|error| panic!("{error:?}"));
        go(&mut other, 0.02);
        assert_eq!(other.snapshot().moved, last.moved, "{method}");
    }
}

/// A block, sixteen particles high, that a plate squeezes at a given speed to three eighths of its height: the force is, but for the ends, that of lubrication, 8 mu V (L/h)^3 per depth.
#[test]
fn a_plate_closes_at_its_speed_on_a_thin_gap() {
    for method in ["isph", "sph"] {
        let mut case = film(method);
        let (high, low, speed) = (0.02, 0.0075, 0.1);
        case.domain.max.z = high + 2.0 * case.method.resolution();
        case.fluid[0].shape = Shape::Box { min: -DVec3::ONE.with_z(0.0), max: DVec3::new(high, 1.0, high) };
        let plate = Shape::Box { min: DVec3::new(-1.0, -1.0, high), max: DVec3::ONE };
        case.solids[0].body = Body::Shape(plate);
        case.solids[0].load = None;
        case.solids[0].motion = Motion::Uniform(-speed * DVec3::Z);
        let mut simulation = tremie_sph::simulation(&case);
        let mut shares = Vec::new();
        while simulation.time() < (high - low) / speed {
            simulation.advance().unwrap_or_else(|error| panic!("{method}: {error:?}"));
            let height = high - speed * simulation.time();
            if height < 1.1 * low {
                let force = simulation.snapshot().solids[0].force.z / case.method.resolution();
                // On half of it.
                shares.push(force / (4.0 * 10.0 * speed * (high * high / (height * height)).powi(3)));
            }
        }
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        assert!((mean - 1.0).abs() < 0.25, "{method}: {mean}");
    }
}
