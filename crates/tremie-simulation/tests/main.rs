//! The run loop, with a simulation whose course is known in closed form.

// Helpers of tests are tests too.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tremie_case::{
    Case, Collision, Domain, FillingGauge, FluidRegion, FrontGauge, Gauges, Lattice, Lbm, LevelGauge,
    Material, Method, Output, Precision, Rest, Side, SpreadGauge, Stepping, Stop,
};
use tremie_geometry::Shape;
use tremie_numerics::{DVec2, DVec3};
use tremie_output::state::{Array, State};
use tremie_rheology::FlowCurve;
use tremie_simulation::{
    Breakdown, Cells, Checkpoint, EndReason, Fluid, Load, Outcome, Progress, RestoreError, RunError,
    RunFolder, RunRecord, Simulation, Snapshot, run,
};

/// Edge of a cell in m.
const CELL: f64 = 0.02;
/// Height of the cake in m.
const HEIGHT: f64 = 0.05;
/// Radius of the cake in m at the start and when all time has passed, and the time in s in which it relaxes.
const RADII: [f64; 2] = [0.1, 0.3];
const RELAXATION: f64 = 0.4;

/// A quarter of a cake whose radius relaxes exponentially, in steps that no interval is a multiple of.
struct Cake {
    time: f64,
    steps: u64,
    /// Raises `interrupt` after this step.
    interrupt_after: Option<u64>,
    interrupt: Arc<AtomicBool>,
    breaks_at: Option<u64>,
    /// Whether it has no fluid at all.
    eaten: bool,
}

impl Cake {
    fn new() -> Self {
        Self {
            time: 0.0,
            steps: 0,
            interrupt_after: None,
            interrupt: Arc::default(),
            breaks_at: None,
            eaten: false,
        }
    }

    fn radius(time: f64) -> f64 {
        RADII[1] - (RADII[1] - RADII[0]) * (-time / RELAXATION).exp()
    }

    /// Speed of the front in m/s.
    fn speed(time: f64) -> f64 {
        (RADII[1] - Self::radius(time)) / RELAXATION
    }

    /// Puts the cake into cells.
    fn fill(&self, cells: &mut Cells) {
        let radius = Self::radius(self.time);
        for k in 0..cells.count[2] {
            for j in 0..cells.count[1] {
                for i in 0..cells.count[0] {
                    let (n, p) = (cells.index(i, j, k), cells.centre(i, j, k));
                    let r = p.truncate().length();
                    let layer = (HEIGHT / CELL - k as f64).clamp(0.0, 1.0);
                    cells.fill[n] = layer * (0.5 + (radius - r) / CELL).clamp(0.0, 1.0);
                    if cells.fill[n] > 0.0 {
                        cells.velocity[n] = Self::speed(self.time) / radius * p.with_z(0.0);
                        cells.shear_rate[n] = if r > 0.05 { 2.0 } else { 0.0 };
                        cells.stress[n] = 60.0;
                        cells.pressure[n] = 2300.0 * 9.81 * (HEIGHT - p.z).max(0.0);
                    }
                }
            }
        }
    }
}

impl Simulation for Cake {
    fn time(&self) -> f64 {
        self.time
    }

    fn time_step(&self) -> f64 {
        0.013 + 0.001 * (self.steps as f64).sin()
    }

    fn advance(&mut self) -> Result<(), Breakdown> {
        if self.breaks_at == Some(self.steps) {
            return Err(Breakdown {
                time: self.time,
                position: DVec3::ZERO,
                what: "the cake is burnt".into(),
                advice: "bake it at a lower temperature".into(),
            });
        }
        self.time += self.time_step();
        self.steps += 1;
        if self.interrupt_after == Some(self.steps) {
            self.interrupt.store(true, Ordering::Relaxed);
        }
        Ok(())
    }

    fn see(&self, snapshot: &mut Snapshot) {
        let mut cells = Cells {
            size: CELL,
            density: 2300.0,
            domain: [DVec3::ZERO, DVec3::new(0.4, 0.4, 0.08)],
            symmetry: [[true, false], [true, false], [false; 2]],
            ..Cells::default()
        };
        if !self.eaten {
            cells = cells.blank([20, 20, 4]);
            self.fill(&mut cells);
        }
        *snapshot = Snapshot { time: self.time, fluid: Fluid::Cells(cells), ..Snapshot::default() };
    }

    fn load(&self) -> Load {
        Load { updates: 400 * self.steps, ..Load::default() }
    }

    fn save(&self) -> State {
        State {
            header: serde_json::json!({ "method": "cake", "steps": self.steps }),
            arrays: vec![("time".into(), Array::F64(vec![self.time]))],
        }
    }

    fn restore(&mut self, state: &State) -> Result<(), RestoreError> {
        if state.header["method"] != "cake" {
            let found = state.header["method"].to_string();
            return Err(RestoreError::Mismatch { expected: "cake".into(), found });
        }
        let [(_, Array::F64(time))] = state.arrays.as_slice() else {
            return Err(RestoreError::Array("time".into()));
        };
        self.time = time[0];
        self.steps = state.header["steps"].as_u64().unwrap();
        Ok(())
    }
}

fn case() -> Case {
    let wall = Side::REST;
    Case {
        cages: Vec::new(),
        groups: Vec::new(),
        inclusions: Default::default(),
        fibre_field: None,
        following: Default::default(),
        title: "Cake".into(),
        material: Material {
            density: 2300.0,
            curve: FlowCurve::Newtonian { viscosity: 1.0 },
            thixotropy: None,
            structure: 0.0,
            surface_tension: 0.0,
        },
        domain: Domain {
            min: DVec3::ZERO,
            max: DVec3::new(0.4, 0.4, 0.08),
            gravity: DVec3::new(0.0, 0.0, -9.81),
            sides: [Side::Symmetry, wall, Side::Symmetry, wall, wall, wall],
        },
        solids: Vec::new(),
        inlets: Vec::new(),
        outlets: Vec::new(),
        meshes: Vec::new(),
        files: Vec::new(),
        fluid: vec![FluidRegion {
            shape: Shape::Sphere { centre: DVec3::ZERO, radius: 0.1 },
            velocity: DVec3::ZERO,
            batch: None,
            structure: None,
        }],
        method: Method::Lbm(Lbm {
            cell_size: CELL,
            precision: Precision::F64,
            time_step: None,
            stepping: Stepping::Fixed,
            hydrostatic_error: 0.02,
            lattice_speed: 0.1,
            lattice_viscosity: 1.0 / 6.0,
            bulk_relaxation: 1.0,
            lattice: Lattice::D3q19,
            collision: Collision::Mtrt,
            preset: None,
        }),
        stop: Stop { time: 1.1, rest: None, event: None },
        gauges: Gauges {
            pressure: Vec::new(),
            interval: 0.05,
            spread: Some(SpreadGauge { centre: DVec2::ZERO }),
            level: vec![LevelGauge { name: "middle".into(), min: DVec2::ZERO, max: DVec2::splat(0.05) }],
            front: vec![FrontGauge { name: "x".into(), axis: 0, forwards: true, at: 0.15 }],
            light: Vec::new(),
            filling: Some(FillingGauge { dead_shear_rate: 0.0 }),
        },
        output: Output {
            snapshot_interval: Some(0.2),
            picture_interval: Some(0.5),
            checkpoint_interval: 1e9,
        },
        name: "cake.toml".into(),
        text: "title = \"Cake\"\n".into(),
    }
}

fn new_folder(path: &Path, case: &Case) -> RunFolder {
    let folder = RunFolder::create(path, false).unwrap();
    let scaling = serde_json::json!({ "cell_size_m": CELL });
    folder.begin(&case.text, &case.files, &RunRecord::new("tremie 0.1.0", "cake", None, scaling)).unwrap();
    folder
}

fn go(
    cake: &mut Cake,
    case: &Case,
    folder: &RunFolder,
    resume: Option<Checkpoint>,
) -> Result<Outcome, RunError> {
    let interrupt = Arc::clone(&cake.interrupt);
    run(cake, case, folder, resume, &mut (), &interrupt)
}

/// Contents of all files of a folder that must not depend on how fast or in how many parts the run went.
fn results(folder: &RunFolder) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder.path()).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if name != "run.json" && name != "summary.json" {
            files.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    let mut summary = json(&folder.summary());
    for changing in ["wall_s", "updates_per_second"] {
        assert!(summary.as_object_mut().unwrap().remove(changing).unwrap().as_f64().unwrap() > 0.0);
    }
    files.insert("summary.json".into(), summary.to_string().into_bytes());
    files
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn assert_same(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) {
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(a), names(b));
    for (name, content) in a {
        assert!(content == &b[name], "{name} differs");
    }
}

#[test]
fn a_run_to_the_end_time_leaves_all_results() {
    let place = tempfile::tempdir().unwrap();
    let case = case();
    let folder = new_folder(place.path(), &case);
    let outcome = go(&mut Cake::new(), &case, &folder, None).unwrap();
    assert_eq!(outcome.reason, EndReason::Time);
    assert!((1.1..1.115).contains(&outcome.summary.readings.time));

    let names: Vec<String> = results(&folder).into_keys().collect();
    let numbered = |prefix: &str, count: usize, ending: &str| {
        (0..count).map(|n| format!("{prefix}_{n:06}.{ending}")).collect::<Vec<_>>()
    };
    let mut expected = [
        // Every 0.2 s from 0 to 1.0 s, and at the end; pictures at 0, 0.5 and 1.0 s, and at the end.
        numbered("fluid", 7, "vti"),
        numbered("surface", 7, "vtp"),
        numbered("above", 4, "png"),
        numbered("cut", 4, "png"),
        numbered("pressure", 4, "png"),
        numbered("shear_rate", 4, "png"),
        ["case.toml", "checkpoint.tremie", "fluid.pvd", "series.csv", "summary.json", "surface.pvd"]
            .map(str::to_owned)
            .to_vec(),
        ["dead_cut", "dead_level", "fronts_cut", "fronts_level", "time_cut", "time_level"]
            .map(|what| format!("filling_{what}.png"))
            .to_vec(),
        vec!["filling.vti".to_owned()],
    ]
    .concat();
    expected.sort();
    assert_eq!(names, expected);
    assert_eq!(fs::read_to_string(folder.case()).unwrap(), case.text);

    let series = tremie_output::series::read(&folder.series()).unwrap();
    assert_eq!(
        series.columns.join(","),
        "time_s,spread_m,spread_x_m,spread_y_m,spread_diagonal_m,spread_max_m,height_m,top_m,volume_m3,\
         speed_p50_m_s,speed_p99_m_s,speed_max_m_s,kinetic_energy_J,potential_energy_J,yielded_share,\
         pressure_max_Pa,level_middle_m,front_x_m"
    );
    // 0, 0.05, ... 1.1 s: the end is a multiple of the interval and is read once.
    assert_eq!(series.rows.len(), 23);
    for row in &series.rows {
        assert!((row[1] - 2.0 * Cake::radius(row[0])).abs() < 0.1 * CELL, "{row:?}");
    }

    let summary = json(&folder.summary());
    assert_eq!(summary["end_reason"], "time");
    // The largest radius along any ray is a little more than the mean one.
    let t500 = RELAXATION * ((RADII[1] - RADII[0]) / (RADII[1] - 0.25)).ln();
    assert!((summary["t500_s"].as_f64().unwrap() - t500).abs() < 0.02, "{summary}");
    // So does the front along x, which has 0.15 m to go; it counts from where cells are half full.
    let arrival = RELAXATION * ((RADII[1] - RADII[0]) / (RADII[1] - 0.15)).ln();
    assert!((summary["front_x_s"].as_f64().unwrap() - arrival).abs() < 0.05, "{summary} {arrival}");
    // The cake grows outwards: its rim was filled last, and fluid goes on being sheared beyond 50 mm only.
    let filling = outcome.summary.filling.as_ref().unwrap();
    let (time, rim) = filling.last[0];
    assert!(time > 1.0 && (rim.truncate().length() - Cake::radius(time)).abs() < CELL, "{time} {rim}");
    let middle = std::f64::consts::PI * 0.05f64.powi(2) * HEIGHT;
    assert!((filling.dead_volume / middle - 1.0).abs() < 0.3, "{} {middle}", filling.dead_volume);
    assert!(filling.pockets.is_empty());
    let last = series.rows.last().unwrap();
    for (name, value) in series.columns.iter().zip(last) {
        assert_eq!(summary[name].as_f64(), Some(*value), "{name}");
    }

    let record = folder.record().unwrap();
    assert_eq!((record.end_reason.as_deref(), record.method.as_str()), (Some("time"), "cake"));
    assert_eq!((record.steps, record.updates), (outcome.summary.steps, 400 * outcome.summary.steps));
}

#[test]
fn a_run_stops_when_the_fluid_rests() {
    let place = tempfile::tempdir().unwrap();
    let mut case = case();
    case.stop = Stop {
        time: 20.0,
        rest: Some(Rest { spread_rate: 5e-5, growth: 5e-3, speed: 1e-3, level_rate: None, duration: 1.0 }),
        event: None,
    };
    case.output.snapshot_interval = None;
    case.output.picture_interval = None;
    let folder = new_folder(place.path(), &case);
    let outcome = go(&mut Cake::new(), &case, &folder, None).unwrap();
    assert_eq!(outcome.reason, EndReason::Rest);
    // Rest begins when the spread has slowed down, and is certain a window later.
    let slow = (0..).map(|n| 0.01 * f64::from(n)).find(|t| 2.0 * Cake::speed(*t) < 5e-5).unwrap();
    let end = outcome.summary.readings.time;
    assert!(end > slow && end < slow + 1.1, "{slow} {end}");
    assert!(!folder.fluid().exists());

    // Without a spread gauge only the speed counts, throughout the window.
    let place = tempfile::tempdir().unwrap();
    case.gauges.spread = None;
    let folder = new_folder(place.path(), &case);
    let outcome = go(&mut Cake::new(), &case, &folder, None).unwrap();
    let slow = (0..).map(|n| 0.01 * f64::from(n)).find(|t| Cake::speed(*t) < 1e-3).unwrap();
    let end = outcome.summary.readings.time;
    assert!(end > slow + 0.9 && end < slow + 1.1, "{slow} {end}");
    assert!(outcome.summary.readings.spread.is_none());
}

#[test]
fn a_run_stops_when_that_comes_for_which_it_waits() {
    let place = tempfile::tempdir().unwrap();
    let mut case = case();
    case.stop.event = Some("x".into());
    let folder = new_folder(place.path(), &case);
    let outcome = go(&mut Cake::new(), &case, &folder, None).unwrap();
    assert_eq!(outcome.reason, EndReason::Event);
    let (arrival, end) = (outcome.summary.event("front_x_s").unwrap(), outcome.summary.readings.time);
    assert!(arrival <= end && end < arrival + 0.06, "{arrival} {end}");
    assert_eq!(folder.read_summary(&case).unwrap(), outcome.summary);
}

#[test]
fn an_interrupted_and_resumed_run_is_the_same_to_the_bit() {
    let mut case = case();
    case.stop = Stop {
        time: 8.0,
        rest: Some(Rest { spread_rate: 5e-5, growth: 5e-3, speed: 1e-3, level_rate: None, duration: 1.0 }),
        event: None,
    };
    case.output.snapshot_interval = Some(0.7);
    // Drawing takes longer than all the rest.
    case.output.picture_interval = Some(3.0);
    let place = tempfile::tempdir().unwrap();
    let whole = new_folder(place.path(), &case);
    let steps = go(&mut Cake::new(), &case, &whole, None).unwrap().summary.steps;
    let whole = results(&whole);

    for interrupts in [vec![1], vec![37], vec![54, 55, 300], vec![steps - 3]] {
        let place = tempfile::tempdir().unwrap();
        let folder = new_folder(place.path(), &case);
        for (n, after) in interrupts.iter().enumerate() {
            let mut cake = Cake { interrupt_after: Some(*after), ..Cake::new() };
            let resume = (n > 0).then(|| Checkpoint::read(&folder).unwrap());
            let outcome = go(&mut cake, &case, &folder, resume).unwrap();
            assert_eq!((outcome.reason, outcome.summary.steps), (EndReason::Interrupted, *after));
            assert_eq!(json(&folder.summary())["end_reason"], "interrupted");
        }
        let early = fs::read(folder.checkpoint()).unwrap();
        let resume = || Some(Checkpoint::read(&folder).unwrap());
        assert_eq!(go(&mut Cake::new(), &case, &folder, resume()).unwrap().reason, EndReason::Rest);
        assert_same(&results(&folder), &whole);
        assert_eq!(folder.record().unwrap().updates, 400 * steps);

        // As after a crash: the folder knows more than its last checkpoint.
        fs::write(folder.checkpoint(), early).unwrap();
        go(&mut Cake::new(), &case, &folder, resume()).unwrap();
        assert_same(&results(&folder), &whole);

        // A run that has ended has nothing left to do.
        assert_eq!(go(&mut Cake::new(), &case, &folder, resume()).unwrap().reason, EndReason::Rest);
        assert_same(&results(&folder), &whole);
    }
}

#[test]
fn a_breakdown_says_where_the_last_good_state_is() {
    let place = tempfile::tempdir().unwrap();
    let mut case = case();
    case.output.picture_interval = None;
    let folder = new_folder(place.path(), &case);
    let error = go(&mut Cake { breaks_at: Some(30), ..Cake::new() }, &case, &folder, None).unwrap_err();
    assert!(matches!(error, RunError::Breakdown { checkpoint: None, .. }));

    let place = tempfile::tempdir().unwrap();
    case.output.checkpoint_interval = 1e-9;
    let folder = new_folder(place.path(), &case);
    let error = go(&mut Cake { breaks_at: Some(30), ..Cake::new() }, &case, &folder, None).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("burnt") && message.contains(&folder.checkpoint().display().to_string()));
    assert_eq!(folder.record().unwrap().end_reason.as_deref(), Some("breakdown"));

    // And it is good indeed.
    let checkpoint = Checkpoint::read(&folder).unwrap();
    assert!((checkpoint.time() - 30.0 * 0.013).abs() < 0.01);
    assert_eq!(go(&mut Cake::new(), &case, &folder, Some(checkpoint)).unwrap().reason, EndReason::Time);
}

#[test]
fn the_observer_sees_the_end() {
    #[derive(Default)]
    struct Last(Option<Progress>);
    impl tremie_simulation::Observer for Last {
        fn progress(&mut self, progress: &Progress) {
            self.0 = Some(progress.clone());
        }
    }
    let place = tempfile::tempdir().unwrap();
    let case = case();
    let folder = new_folder(place.path(), &case);
    let mut last = Last::default();
    let outcome = run(&mut Cake::new(), &case, &folder, None, &mut last, &AtomicBool::new(false)).unwrap();
    let progress = last.0.unwrap();
    assert_eq!((progress.steps, progress.readings), (outcome.summary.steps, outcome.summary.readings));
    assert!(progress.time >= progress.end_time && progress.updates_per_second > 0.0);
}

#[test]
fn what_is_no_checkpoint_of_this_run_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let case = case();
    let folder = new_folder(place.path(), &case);
    assert!(matches!(Checkpoint::read(&folder), Err(RunError::Output(_))));
    Cake::new().save().write(&folder.checkpoint()).unwrap();
    assert!(matches!(Checkpoint::read(&folder), Err(RunError::Checkpoint { .. })));
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let place = tempfile::tempdir().unwrap();
    let case = case();
    let folder = new_folder(place.path(), &case);
    let path = place.path().join("surface_000000.vtp");
    fs::create_dir(&path).unwrap();
    let error = go(&mut Cake::new(), &case, &folder, None).unwrap_err();
    assert!(error.to_string().contains(&path.display().to_string()), "{error}");
}

#[test]
fn a_run_without_fluid_comes_to_its_end() {
    let place = tempfile::tempdir().unwrap();
    let case = case();
    let folder = new_folder(place.path(), &case);
    let outcome = go(&mut Cake { eaten: true, ..Cake::new() }, &case, &folder, None).unwrap();
    assert_eq!(outcome.summary.readings.spread.unwrap().max, 0.0);
    assert_eq!((outcome.summary.volume_error, outcome.summary.t500), (0.0, None));
    assert!(json(&folder.summary())["t500_s"].is_null());
}
