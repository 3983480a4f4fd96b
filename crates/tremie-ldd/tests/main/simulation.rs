//! Nodes as a simulation of a case.

use tremie_case::Case;
use tremie_numerics::DVec3;
use tremie_output::state::State;
use tremie_simulation::{Cells, Fluid, Simulation};

/// A cone of concrete in its mould, in a plane; the mould is lifted as `path` says.
fn case(path: &str, spacing: &str, settings: &str) -> Case {
    let text = format!(
        r#"title = "Planar slump"
method = "ldd"

[material]
density = "2000 kg/m3"
bingham = {{ yield_stress = "50 Pa", plastic_viscosity = "20 Pa s" }}

[domain]
min = ["-200 mm", "0 mm", "0 mm"]
max = ["200 mm", "{spacing}", "320 mm"]
sides = {{ y_min = "periodic", y_max = "periodic" }}

[[fluid]]
cone = {{ base = ["0 mm", "5 mm", "0 mm"], base_diameter = "200 mm", top_diameter = "100 mm", height = "300 mm" }}

[[solid]]
name = "mould"
cone_shell = {{ base = ["0 mm", "5 mm", "0 mm"], base_diameter = "200 mm", top_diameter = "100 mm", height = "310 mm", thickness = "12 mm" }}
motion.path.points = [{path}]

[ldd]
spacing = "{spacing}"
{settings}

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
const PAPER: &str = "coupling = \"pressure_first\"\nscheme = \"paper\"\nlaplacian = \"paper\"\nlargest_viscosity = \"100 Pa s\"";

fn cells(simulation: &dyn Simulation) -> Cells {
    let Fluid::Cells(cells) = simulation.snapshot().fluid;
    cells
}

#[test]
fn a_run_goes_on_from_a_saved_state_to_the_bit() {
    for settings in ["", "coupling = \"pressure_first\"\nscheme = \"implicit\""] {
        let case = case(LIFTED, "10 mm", settings);
        let mut one = tremie_ldd::simulation(&case);
        for _ in 0..10 {
            one.advance().unwrap();
        }
        let saved = one.save();
        let mut other = tremie_ldd::simulation(&case);
        other.restore(&saved).unwrap();
        for _ in 0..10 {
            one.advance().unwrap();
            other.advance().unwrap();
        }
        assert_eq!((one.time(), one.save()), (other.time(), other.save()));
        assert_eq!(one.snapshot(), other.snapshot());

        let mut finer = tremie_ldd::simulation(&self::case(LIFTED, "5 mm", settings));
        assert!(finer.restore(&saved).unwrap_err().to_string().contains("spacing 0.01 m"));
    }
}

#[test]
fn the_same_on_any_number_of_threads() {
    let case = case(LIFTED, "5 mm", "");
    let with = |threads: usize| -> State {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut slump = tremie_ldd::simulation(&case);
            for _ in 0..10 {
                slump.advance().unwrap();
            }
            slump.save()
        })
    };
    assert_eq!(with(1), with(2));
}

/// A mould that stands on the floor holds what is in it, although it is hardly thicker than the nodes are apart, and bears it with the floor.
#[test]
fn nothing_leaks_through_a_thin_mould() {
    let case = case(HELD, "10 mm", "");
    let mut held = tremie_ldd::simulation(&case);
    let before = cells(held.as_ref());
    let volume = |cells: &Cells| cells.fill.iter().sum::<f64>();
    while held.time() < 0.3 {
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
    let snapshot = held.snapshot();
    let weight = 2000.0 * 9.81 * volume(&after) * after.size.powi(3);
    let borne = -(snapshot.walls.sides[4].force + snapshot.solids[0].force).z;
    assert!((borne / weight - 1.0).abs() < 0.1, "{borne} of {weight}");
}

/// By each of the method's variants a lifted mould lets go of as much on both sides.
#[test]
fn slumps_are_symmetric() {
    for settings in ["", "scheme = \"implicit\"", PAPER] {
        let case = case(LIFTED, "10 mm", settings);
        let mut slump = tremie_ldd::simulation(&case);
        while slump.time() < 0.3 {
            slump.advance().unwrap();
        }
        let after = cells(slump.as_ref());
        let [nx, _, nz] = after.count;
        let column = |i: &usize| (0..nz).map(|k| after.fill[after.index(*i, 0, k)]).sum::<f64>();
        let right_of = |i: &usize| after.centre(*i, 0, 0).x;
        let left: f64 = (0..nx).filter(|i| right_of(i) < 0.0).map(|i| column(&i)).sum();
        let right: f64 = (0..nx).filter(|i| right_of(i) > 0.0).map(|i| column(&i)).sum();
        assert!((left / right - 1.0).abs() < 0.02, "{settings}: {left} {right}");
        assert!((0..nx).any(|i| right_of(&i) > 0.1 && column(&i) > 0.0), "{settings}");
    }
}
