//! `tremie bench`: how fast this machine is, and which share of what its memory allows.
//!
//! A cell update must read and write the populations of the cell, if nothing is kept twice and nothing else is moved:
//! that many bytes, at the bandwidth of the memory, are the limit that updates are held against (`bandwidth_share`).
//! The bandwidth is measured in the same run. Of particles a step is two linear systems, which take iterations: these are told instead.

mod bandwidth;

use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, ValueEnum};
use indicatif::HumanCount;
use serde::Serialize;
use tremie_case::{BeamCase, Case, FluidRegion, Method, Precision, Side};
use tremie_fracture::Trial;
use tremie_fracture::standard::openings;
use tremie_geometry::Shape;
use tremie_simulation::Load;
use tremie_simulation::gauges::Gauges;
use tremie_simulation::rest::RestWatch;
use tremie_suspension::Inclusions;

use crate::numbers::significant;
use crate::{fracture, plan, terminal};

/// Repeats of a box, of which the median counts.
const REPEATS: usize = 7;
/// Wall-clock seconds of a repeat.
const REPEAT: f64 = 1.0;
/// Steps before the first repeat, in which memory and caches warm up.
const WARM_UP: usize = 3;
/// Simulated seconds of a slump with `--quick`.
const QUICK: f64 = 2.0;
/// The paper's cases of 50,000 nodes.
const DAM_BREAK: &str = include_str!("../../../../cases/bingham-dam-break/case.toml");
const SLUMP: &str = include_str!("../../../../cases/abrams-slump/case.toml");
/// Populations of a cell.
const POPULATIONS: f64 = 19.0;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie bench
  tremie bench lbm-box-f32 --threads 1
  tremie bench --quick --json

Updates are those of cells that hold fluid. Bytes an update: what must be read and written of each cell in place;
the share of the bandwidth is that of reading, changing and writing a large array in the same run.")]
pub(crate) struct Arguments {
    /// What to measure [default: all]
    #[arg(value_enum, value_name = "ID")]
    ids: Vec<Id>,
    /// Compute only the first seconds of the slump, and the first half millimetre of the beam
    #[arg(long)]
    quick: bool,
    /// Print a JSON list instead of a table, in SI units
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Id {
    /// Read, change and write a large array: the limit
    Bandwidth,
    /// 128^3 cells full of Bingham fluid, in 32 bits
    LbmBoxF32,
    /// The same in 64 bits
    LbmBoxF64,
    /// Slump flow to rest in 5 mm cells, whole domain, in 32 bits
    LbmSlumpF32,
    /// 1,000 fibres of six cells in a sheared box: what a fibre costs in a step
    #[value(name = "fibres-1k")]
    Fibres1k,
    /// 50,000 fibres as many to the volume, in 128^3 cells
    #[value(name = "fibres-50k")]
    Fibres50k,
    /// 100,000
    #[value(name = "fibres-100k")]
    Fibres100k,
    /// 50,000 eight times as close together, in 64^3 cells: 0.5 % of the volume, as concrete has them
    #[value(name = "fibres-50k-dense")]
    Fibres50kDense,
    /// A planar collapse by 10,000 particles
    #[value(name = "isph-10k")]
    Isph10k,
    /// By 100,000
    #[value(name = "isph-100k")]
    Isph100k,
    /// By 300,000
    #[value(name = "isph-300k")]
    Isph300k,
    /// A hardened beam with fibres, 10 mm at the crack, tested to an opening of 3.5 mm
    FractureBeam,
    /// A dam break of mud by 50,000 nodes of Lagrangian differencing
    #[value(name = "ldd-dam-break-50k")]
    LddDamBreak50k,
    /// A slump of viscous concrete in space by 50,000 nodes
    #[value(name = "ldd-slump-50k")]
    LddSlump50k,
}

/// A row of the table, an entry of the list.
#[derive(Debug, Default, Serialize)]
struct Entry {
    id: String,
    precision: Option<&'static str>,
    threads: usize,
    /// Cells of the domain.
    cells: Option<usize>,
    /// Cells that hold fluid; on average if they become more or fewer.
    wet_cells: Option<f64>,
    /// Cells that memory is kept for, over those that hold fluid.
    allocated_over_wet: Option<f64>,
    /// Bytes of memory for each of them.
    bytes_per_allocated_cell: Option<f64>,
    steps: Option<u64>,
    /// Wall-clock time of the steps in s.
    seconds: Option<f64>,
    updates_per_second: Option<f64>,
    bytes_per_update: Option<f64>,
    /// Bytes moved per second: what the memory can do, or what the updates need of it.
    bytes_per_second: Option<f64>,
    bandwidth_share: Option<f64>,
    milliseconds_per_step: Option<f64>,
    /// Iterations a step, of methods that solve linear systems for viscous forces and the pressure.
    viscous_iterations: Option<f64>,
    pressure_iterations: Option<f64>,
    /// What the step is longer by for each body in it, in microseconds.
    microseconds_per_body_step: Option<f64>,
    /// Wall-clock time of the test of a beam, from its lattice to its last opening.
    seconds_per_beam: Option<f64>,
}

/// Measures.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let all = arguments.ids.is_empty();
    let asked = Id::value_variants().iter().filter(|id| all || arguments.ids.contains(id));
    // The limit is needed for the share of all others.
    let others = asked.filter(|id| **id != Id::Bandwidth);
    if !arguments.json {
        terminal::say(&line(&HEADER.map(str::to_owned)));
    }
    let show = |entry: &Entry| {
        if !arguments.json {
            terminal::say(&line(&entry.columns()));
        }
    };
    let limit = Entry {
        id: name(Id::Bandwidth),
        threads: rayon::current_num_threads(),
        bytes_per_second: Some(bandwidth::measure()),
        bandwidth_share: Some(1.0),
        ..Entry::default()
    };
    show(&limit);
    let bandwidth = limit.bytes_per_second.unwrap_or(f64::NAN);
    let mut entries = vec![limit];
    for id in others {
        if *id == Id::FractureBeam {
            let entry = tested_beam(arguments.quick)?;
            show(&entry);
            entries.push(entry);
            continue;
        }
        let work = match id {
            Id::LbmBoxF32 => full_box(Precision::F32)?,
            Id::LbmBoxF64 => full_box(Precision::F64)?,
            Id::LbmSlumpF32 => slump(arguments.quick)?,
            Id::Fibres1k => fibres(1_000, 1.0)?,
            Id::Fibres50k => fibres(50_000, 1.0)?,
            Id::Fibres100k => fibres(100_000, 1.0)?,
            Id::Fibres50kDense => fibres(50_000, 8.0)?,
            Id::Isph10k => pace(&particles_case(10_000)?)?,
            Id::Isph100k => pace(&particles_case(100_000)?)?,
            Id::Isph300k => pace(&particles_case(300_000)?)?,
            Id::LddDamBreak50k => pace(&Case::parse("case.toml", DAM_BREAK)?)?,
            Id::LddSlump50k => pace(&Case::parse("case.toml", SLUMP)?)?,
            Id::Bandwidth | Id::FractureBeam => continue,
        };
        let entry = Entry::new(name(*id), &work, bandwidth);
        show(&entry);
        entries.push(entry);
    }
    if arguments.json {
        terminal::say(&serde_json::to_string_pretty(&entries)?);
    }
    Ok(ExitCode::SUCCESS)
}

fn name(id: Id) -> String {
    id.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// The test of a beam, or of its first half millimetre.
fn tested_beam(quick: bool) -> anyhow::Result<Entry> {
    let case = BeamCase::parse("beam.toml", include_str!("beam.toml"))?;
    let end = if quick { 0.5e-3 } else { case.opening };
    let start = Instant::now();
    let mut trial = Trial::new(fracture::beam::setup(&case, case.lattice.seed))?;
    let mut steps = 0;
    for opening in openings(end) {
        steps += trial.advance(opening)?.len() as u64;
    }
    let seconds = start.elapsed().as_secs_f64();
    Ok(Entry {
        id: name(Id::FractureBeam),
        precision: Some("f64"),
        threads: rayon::current_num_threads(),
        cells: Some(trial.mesh().nodes.len()),
        steps: Some(steps),
        seconds: Some(seconds),
        seconds_per_beam: Some(seconds),
        ..Entry::default()
    })
}

/// What a simulation did.
struct Work {
    /// Whether cells are updated by their populations; else they are particles.
    lattice: bool,
    precision: Precision,
    cells: usize,
    /// Mean cells that held fluid, and that memory was kept for.
    wet: f64,
    allocated: f64,
    bytes_per_cell: f64,
    steps: u64,
    seconds: f64,
    updates_per_second: f64,
    /// Iterations a step of viscous forces and of the pressure.
    iterations: [f64; 2],
    microseconds_per_body_step: Option<f64>,
}

/// A box full of fluid.
fn full_box(precision: Precision) -> anyhow::Result<Work> {
    pace(&full_box_case(precision)?)
}

/// The same with so many fibres, so many times as close together as in the case, and what they cost.
fn fibres(number: usize, closer: f64) -> anyhow::Result<Work> {
    let case = fibres_case(number, closer)?;
    let without = pace(&without_bodies(&case))?;
    let with = pace(&case)?;
    let step = |work: &Work| work.wet / work.updates_per_second;
    let bodies = case.inclusions.len() as f64;
    let cost = 1e6 * (step(&with) - step(&without)) / bodies;
    Ok(Work { microseconds_per_body_step: Some(cost), ..with })
}

/// The same box with fluid alone.
fn without_bodies(case: &Case) -> Case {
    Case { groups: Vec::new(), inclusions: Inclusions::default(), ..case.clone() }
}

/// A box that stays full: the median pace of some seconds.
fn pace(case: &Case) -> anyhow::Result<Work> {
    let precision = match &case.method {
        Method::Lbm(lbm) => lbm.precision,
        Method::Isph(_) | Method::Ldd(_) => Precision::F64,
    };
    let mut simulation = plan::simulation(case);
    for _ in 0..WARM_UP {
        simulation.advance()?;
    }
    let iterated = simulation.load().iterations;
    let (mut steps, mut seconds, mut paces) = (0, 0.0, Vec::new());
    for _ in 0..REPEATS {
        let (start, before) = (Instant::now(), simulation.load().updates);
        while start.elapsed().as_secs_f64() < REPEAT {
            simulation.advance()?;
            steps += 1;
        }
        let took = start.elapsed().as_secs_f64();
        paces.push((simulation.load().updates - before) as f64 / took);
        seconds += took;
    }
    paces.sort_by(f64::total_cmp);
    let Load { wet, allocated, bytes, iterations, .. } = simulation.load();
    let each = |k: usize| (iterations[k] - iterated[k]) as f64 / steps as f64;
    Ok(Work {
        lattice: matches!(case.method, Method::Lbm(_)),
        precision,
        cells: cells(case),
        wet: wet as f64,
        allocated: allocated as f64,
        bytes_per_cell: bytes as f64 / allocated as f64,
        steps,
        seconds,
        updates_per_second: paces[REPEATS / 2],
        iterations: [each(0), each(1)],
        microseconds_per_body_step: None,
    })
}

/// The slump flow of the laboratory, to rest or for a while. Gauges do not count.
fn slump(quick: bool) -> anyhow::Result<Work> {
    let case = slump_case(quick)?;
    let mut simulation = tremie_lbm::simulation(&case);
    let (gauges, mut watch) = (Gauges::new(&case), RestWatch::default());
    let (mut steps, mut seconds, mut readings) = (0u64, 0.0, 0u32);
    let (mut allocated, mut bytes) = (0.0, 0.0);
    loop {
        let now = gauges.measure(&simulation.snapshot());
        let rests = case.stop.rest.is_some_and(|rest| {
            watch.update(&rest, &now);
            watch.reached(&rest)
        });
        if rests || now.time >= case.stop.time {
            break;
        }
        readings += 1;
        let load = simulation.load();
        allocated += load.allocated as f64;
        bytes += load.bytes as f64;
        let start = Instant::now();
        while simulation.time() < f64::from(readings) * case.gauges.interval {
            simulation.advance()?;
            steps += 1;
        }
        seconds += start.elapsed().as_secs_f64();
    }
    let updates = simulation.load().updates as f64;
    Ok(Work {
        lattice: matches!(case.method, Method::Lbm(_)),
        precision: Precision::F32,
        cells: cells(&case),
        wet: updates / steps as f64,
        allocated: allocated / f64::from(readings),
        bytes_per_cell: bytes / allocated,
        steps,
        seconds,
        updates_per_second: updates / seconds,
        iterations: [0.0; 2],
        microseconds_per_body_step: None,
    })
}

fn full_box_case(precision: Precision) -> anyhow::Result<Case> {
    let mut case = Case::parse("box.toml", include_str!("box.toml"))?;
    if let Method::Lbm(lbm) = &mut case.method {
        lbm.precision = precision;
    }
    Ok(case)
}

/// So many fibres in a box that gives each as much room as in the case, or so many times less, sheared as fast as the case has it; each layer of cells starts with the velocity that the shear gives it.
fn fibres_case(number: usize, closer: f64) -> anyhow::Result<Case> {
    let text = include_str!("fibres.toml");
    let whole = Case::parse("fibres.toml", text)?;
    let cell = whole.method.resolution();
    let edge = whole.domain.max.x - whole.domain.min.x;
    let cells = edge / cell * (number as f64 / closer / whole.inclusions.len() as f64).cbrt();
    let shorter = (cells / 2.0).round() * 2.0 * cell / edge;
    let text = text
        .replace("1.28 m", &format!("{} m", 1.28 * shorter))
        .replace("1 m/s", &format!("{shorter} m/s"))
        .replace("number = 50000", &format!("number = {number}"));
    let mut case = Case::parse("fibres.toml", &text)?;
    let (low, high) = (case.domain.min, case.domain.max);
    let layers = case.domain.cells(cell)[2];
    let (Side::Wall { velocity: slow, .. }, Side::Wall { velocity: fast, .. }) =
        (case.domain.sides[4], case.domain.sides[5])
    else {
        anyhow::bail!("the box must have plates");
    };
    let layer = |n: usize| FluidRegion {
        shape: Shape::Box {
            min: low.with_z(low.z + n as f64 * cell),
            max: high.with_z(low.z + (n + 1) as f64 * cell),
        },
        velocity: slow.lerp(fast, (n as f64 + 0.5) / layers as f64),
        ..case.fluid[0].clone()
    };
    case.fluid = (0..layers).map(layer).collect();
    Ok(case)
}

/// So many particles, to some parts in a thousand.
fn particles_case(number: usize) -> anyhow::Result<Case> {
    let high = (0.5 * number as f64).sqrt().round();
    let text = include_str!("particles.toml").replace("SPACING", &(0.3 / high).to_string());
    Ok(Case::parse("particles.toml", &text)?)
}

fn slump_case(quick: bool) -> anyhow::Result<Case> {
    let mut case = Case::parse("slump.toml", include_str!("slump.toml"))?;
    if quick {
        case.stop.time = QUICK;
    }
    Ok(case)
}

fn cells(case: &Case) -> usize {
    case.domain.cells(case.method.resolution()).iter().product()
}

const HEADER: [&str; 13] = [
    "id",
    "cells",
    "wet",
    "allocated/wet",
    "bytes/cell",
    "M updates/s",
    "bytes/update",
    "GB/s",
    "of bandwidth",
    "us/body",
    "ms/step",
    "iterations",
    "s/beam",
];

fn line(columns: &[String; 13]) -> String {
    let [id, rest @ ..] = columns;
    rest.iter().fold(format!("{id:<14}"), |line, column| format!("{line} {column:>13}"))
}

impl Entry {
    fn new(id: String, work: &Work, bandwidth: f64) -> Self {
        let (precision, size) = match work.precision {
            Precision::F32 => ("f32", 4.0),
            Precision::F64 => ("f64", 8.0),
        };
        let bytes_per_update = work.lattice.then_some(2.0 * POPULATIONS * size);
        let bytes_per_second = bytes_per_update.map(|bytes| bytes * work.updates_per_second);
        let [viscous, pressure] = work.iterations.map(|each| (!work.lattice).then_some(each));
        Self {
            id,
            precision: Some(precision),
            threads: rayon::current_num_threads(),
            cells: Some(work.cells),
            wet_cells: Some(work.wet.round()),
            allocated_over_wet: Some(work.allocated / work.wet),
            bytes_per_allocated_cell: Some(work.bytes_per_cell),
            steps: Some(work.steps),
            seconds: Some(work.seconds),
            updates_per_second: Some(work.updates_per_second),
            bytes_per_update,
            bytes_per_second,
            bandwidth_share: bytes_per_second.map(|bytes| bytes / bandwidth),
            milliseconds_per_step: Some(1e3 * work.seconds / work.steps as f64),
            viscous_iterations: viscous,
            pressure_iterations: pressure,
            microseconds_per_body_step: work.microseconds_per_body_step,
            seconds_per_beam: None,
        }
    }

    fn columns(&self) -> [String; 13] {
        let show = |value: Option<f64>, text: fn(f64) -> String| value.map_or_else(|| "-".to_owned(), text);
        let count = |number: f64| HumanCount(number as u64).to_string();
        let iterations = match (self.viscous_iterations, self.pressure_iterations) {
            (Some(viscous), Some(pressure)) => format!("{viscous:.1} + {pressure:.1}"),
            _ => "-".to_owned(),
        };
        [
            self.id.clone(),
            show(self.cells.map(|n| n as f64), count),
            show(self.wet_cells, count),
            show(self.allocated_over_wet, |ratio| format!("{ratio:.2}")),
            show(self.bytes_per_allocated_cell, |bytes| format!("{bytes:.0}")),
            show(self.updates_per_second.map(|pace| 1e-6 * pace), |pace| format!("{pace:.1}")),
            show(self.bytes_per_update, significant),
            show(self.bytes_per_second, |bytes| format!("{:.1}", 1e-9 * bytes)),
            show(self.bandwidth_share, |share| format!("{:.1} %", 100.0 * share)),
            show(self.microseconds_per_body_step, |cost| format!("{cost:.2}")),
            show(self.milliseconds_per_step, significant),
            iterations,
            show(self.seconds_per_beam, significant),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cases_are_what_their_names_say() {
        let full = full_box_case(Precision::F64).unwrap();
        assert_eq!(cells(&full), 128 * 128 * 128);
        assert!((tremie_lbm::Plan::new(&full).wet_cells / 128f64.powi(3) - 1.0).abs() < 1e-9);
        for number in [10_000, 100_000, 300_000] {
            let particles = tremie_sph::plan(&particles_case(number).unwrap());
            assert!(particles.plane && (particles.particles as f64 / number as f64 - 1.0).abs() < 0.02);
        }
        for text in [DAM_BREAK, SLUMP] {
            let nodes = tremie_ldd::plan(&Case::parse("case.toml", text).unwrap()).particles as f64;
            assert!((nodes / 50_000.0 - 1.0).abs() < 0.02, "{nodes}");
        }
        let slump = slump_case(false).unwrap();
        assert_eq!(tremie_lbm::Plan::new(&slump).cells, [150, 150, 61]);
        assert!(slump.stop.rest.is_some() && slump_case(true).unwrap().stop.time == QUICK);
    }

    #[test]
    fn dense_fibres_are_as_many_as_in_concrete() {
        let case = fibres_case(5_000, 8.0).unwrap();
        assert!(case.has_bodies() && !without_bodies(&case).has_bodies());
        let volume: f64 = (0..case.inclusions.len()).map(|n| case.inclusions.form(n).volume()).sum();
        let size = case.domain.max - case.domain.min;
        assert!((volume / size.element_product() - 0.005).abs() < 2e-4);
    }

    #[test]
    fn an_entry_has_the_keys_that_scripts_ask_for() {
        let work = Work {
            lattice: true,
            precision: Precision::F32,
            cells: 1000,
            wet: 500.0,
            allocated: 1000.0,
            bytes_per_cell: 200.0,
            steps: 10,
            seconds: 1.0,
            updates_per_second: 1e8,
            iterations: [0.0; 2],
            microseconds_per_body_step: Some(1.5),
        };
        let entry = Entry::new(name(Id::LbmBoxF32), &work, 38e9);
        let json = serde_json::to_value(&entry).unwrap();
        assert_eq!((&json["id"], &json["precision"]), (&"lbm-box-f32".into(), &"f32".into()));
        for key in ["threads", "cells", "wet_cells", "updates_per_second", "microseconds_per_body_step"] {
            assert!(json[key].is_number(), "{key}");
        }
        // 19 populations of 4 bytes, read and written.
        assert_eq!(json["bytes_per_update"], 152.0);
        assert_eq!(json["bandwidth_share"], 0.4);
        let work = Work { lattice: false, iterations: [8.0, 6.0], ..work };
        let json = serde_json::to_value(Entry::new(name(Id::Isph10k), &work, 38e9)).unwrap();
        assert_eq!((&json["viscous_iterations"], &json["pressure_iterations"]), (&8.0.into(), &6.0.into()));
        assert!(json["bytes_per_update"].is_null());
    }
}
