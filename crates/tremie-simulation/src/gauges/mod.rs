//! Gauges: what is read from a snapshot, whatever the method that made it.
//!
//! All readings are in SI units and belong to the whole body: what lies beyond symmetry planes counts. The vertical
//! is z and the floor is the domain's lower side.
//!
//! Speeds and the largest pressure are taken over cells that are at least half full: what a method knows about the
//! fringe of its surface is mostly interpolation, and the 99th percentile must not hang on it. These cells count
//! alike, since their fill differs by a factor of two at most.

mod beside;
mod crossing;
mod cut;
mod front;
mod level;
mod light;
pub(crate) mod lying;
mod pressure;
pub(crate) mod section;
pub(crate) mod segregation;
mod spread;

pub use crossing::{TargetTime, first_crossing};
pub use cut::{Held, cut, half_height, held};
pub use lying::{Half, Region, regions};
pub use pressure::{Peak, WallPressure};
pub use section::{Through, through};
pub use segregation::{Layer, layers};
pub use spread::{Spread, profile};

use rayon::prelude::*;
use tremie_case::{Case, FrontGauge, LevelGauge, LightGauge, SpreadGauge};
use tremie_geometry::Motion;
#[cfg(test)]
use tremie_numerics::DVec2;
use tremie_numerics::DVec3;

use crate::plan::Plan;
use crate::{Cells, Fluid, Snapshot, SolidLoad};
use beside::Moving;
use light::Light;
use pressure::Pressure;

/// Fill from which on a cell counts for speeds and pressure.
const HALF_FULL: f64 = 0.5;

/// How clear a view is when light is seen: cells less than half full hold none up.
const HALF_CLEAR: f64 = 0.5;

/// The gauges of a case.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gauges {
    gravity: DVec3,
    spread: Option<SpreadGauge>,
    levels: Vec<LevelGauge>,
    fronts: Vec<FrontGauge>,
    lights: Vec<Light>,
    pressures: Vec<Pressure>,
    /// Names of the solids and then of the cages.
    loaded: Vec<String>,
    /// Number and name of the solid that is moved by a load, and the direction of its way.
    carried: Option<(usize, String, DVec3)>,
    /// Names of the bodies, if any can come in or leave.
    bodies: Vec<String>,
    /// The solids that move.
    moving: Vec<Moving>,
}

/// How many bodies of a name there are, in the domain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyCount {
    /// Those that were there at the start or have come in since.
    pub came: f64,
    /// Those of them that have left.
    pub left: f64,
    /// Those that are there.
    pub present: f64,
}

impl BodyCount {
    /// Of the kinds of a name.
    fn of(name: &str, snapshot: &Snapshot) -> Self {
        let bodies = &snapshot.inclusions;
        let named = |kind: usize| bodies.kinds.get(kind).is_some_and(|kind| kind.name == name);
        let sum = |counts: &[u64]| {
            let of_name = counts.iter().enumerate().filter(|(kind, _)| named(*kind));
            of_name.map(|(_, count)| *count).sum::<u64>() as f64
        };
        let present = bodies.kind.iter().filter(|kind| named(usize::from(**kind))).count() as f64;
        Self { came: sum(&snapshot.bodies_in), left: sum(&snapshot.bodies_out), present }
    }
}

/// What the gauges read at one moment; one row of the time series.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Simulated time in s.
    pub time: f64,
    /// Spread and height around the spread axis, if the case has one.
    pub spread: Option<Spread>,
    /// Height in m of the largest column of fluid.
    pub top: f64,
    /// Volume of the fluid in m3.
    pub volume: f64,
    /// Median of the speed in m/s.
    pub speed_p50: f64,
    /// 99th percentile of the speed in m/s.
    pub speed_p99: f64,
    /// Largest speed in m/s.
    pub speed_max: f64,
    /// Kinetic energy in J.
    pub kinetic_energy: f64,
    /// Potential energy in J in the body force of the case, zero at the domain's lower corner.
    pub potential_energy: f64,
    /// Share of the fluid's volume that shears.
    pub yielded_share: f64,
    /// Largest pressure above that of the air in Pa.
    pub pressure_max: f64,
    /// Name of each level gauge, and median height in m of the surface.
    pub levels: Vec<(String, f64)>,
    /// Name of each front gauge, and how far in m the fluid has come beyond its plane.
    pub fronts: Vec<(String, f64)>,
    /// Name of each light gauge, and how clear the view is, from 0 to 1.
    pub lights: Vec<(String, f64)>,
    /// Name of each pressure gauge, and what it reads.
    pub pressures: Vec<(String, WallPressure)>,
    /// Name of each solid of the case, and then of each cage, and force and moment on it and its mirror images.
    pub solids: Vec<(String, SolidLoad)>,
    /// Name of the solid that is moved by a load, if there is one, and how far in m it has come along it.
    pub travel: Option<(String, f64)>,
    /// Volume in m3 that has come in since the start, by inlet.
    pub inflow: Vec<f64>,
    /// Volume in m3 that has left since the start; none where nothing can leave.
    pub outflow: Option<f64>,
    /// How much of that was of each batch that is followed.
    pub batches_out: Vec<f64>,
    /// Name of the bodies, where any can come in or leave, and how many there are.
    pub bodies: Vec<(String, BodyCount)>,
}

impl Readings {
    /// Names, each with its unit, and values in their order in the time series.
    ///
    /// Readings of the same gauges have the same names.
    pub fn columns(&self) -> Vec<(String, f64)> {
        let mut columns = vec![("time_s", self.time)];
        if let Some(spread) = &self.spread {
            columns.extend([
                ("spread_m", spread.mean),
                ("spread_x_m", spread.x),
                ("spread_y_m", spread.y),
                ("spread_diagonal_m", spread.diagonal),
                ("spread_max_m", spread.max),
                ("height_m", spread.height),
            ]);
        }
        columns.extend([
            ("top_m", self.top),
            ("volume_m3", self.volume),
            ("speed_p50_m_s", self.speed_p50),
            ("speed_p99_m_s", self.speed_p99),
            ("speed_max_m_s", self.speed_max),
            ("kinetic_energy_J", self.kinetic_energy),
            ("potential_energy_J", self.potential_energy),
            ("yielded_share", self.yielded_share),
            ("pressure_max_Pa", self.pressure_max),
        ]);
        let mut columns: Vec<(String, f64)> =
            columns.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        columns.extend(self.levels.iter().map(|(name, level)| (level_column(name), *level)));
        columns.extend(self.fronts.iter().map(|(name, way)| (front_column(name), *way)));
        columns.extend(self.lights.iter().map(|(name, clear)| (light_column(name), *clear)));
        for (name, read) in &self.pressures {
            let values = read.bands.iter().copied().chain([read.force, read.level, read.ratio]);
            columns.extend(pressure_columns(name, read.bands.len()).into_iter().zip(values));
        }
        for (name, load) in &self.solids {
            let values = [load.force, load.moment].map(|v| v.to_array()).concat();
            columns.extend(load_columns(name).into_iter().zip(values));
        }
        columns.extend(self.travel.iter().map(|(name, travel)| (travel_column(name), *travel)));
        for (n, inflow) in self.inflow.iter().enumerate() {
            columns.push((inflow_column(n), *inflow));
        }
        columns.extend(self.outflow.map(|outflow| (OUTFLOW.to_owned(), outflow)));
        columns.extend(self.batches_out.iter().enumerate().map(|(n, out)| (batch_column(n), *out)));
        for (name, count) in &self.bodies {
            columns.extend(body_columns(name).into_iter().zip([count.came, count.left, count.present]));
        }
        columns
    }

    /// The level at the gauge of this name, in m.
    pub fn level(&self, name: &str) -> Option<f64> {
        Some(self.levels.iter().find(|(level, _)| level == name)?.1)
    }

    /// How far in m the fluid has come beyond the plane of the front gauge of this name.
    pub fn front(&self, name: &str) -> Option<f64> {
        Some(self.fronts.iter().find(|(front, _)| front == name)?.1)
    }

    /// What is read of that for which front and light gauges wait.
    pub(crate) fn awaited(&self) -> impl Iterator<Item = f64> {
        self.fronts.iter().chain(&self.lights).map(|(_, value)| *value)
    }

    /// Readings of gauges from the values of their columns; none if one is missing that all these readings have.
    pub(crate) fn from_columns(value: impl Fn(&str) -> Option<f64>, gauges: &Gauges) -> Option<Self> {
        let spread = || {
            Some(Spread {
                mean: value("spread_m")?,
                x: value("spread_x_m")?,
                y: value("spread_y_m")?,
                diagonal: value("spread_diagonal_m")?,
                max: value("spread_max_m")?,
                height: value("height_m")?,
            })
        };
        let load = |name: &String| {
            let [x, y, z, mx, my, mz] = load_columns(name).map(|name| value(&name));
            let load = SolidLoad { force: DVec3::new(x?, y?, z?), moment: DVec3::new(mx?, my?, mz?) };
            Some((name.clone(), load))
        };
        let pressure = |gauge: &Pressure| {
            let columns = pressure_columns(&gauge.name, gauge.bands);
            let mut values = columns.iter().map(|name| value(name)).collect::<Option<Vec<f64>>>()?;
            let (ratio, level, force) = (values.pop()?, values.pop()?, values.pop()?);
            Some((gauge.name.clone(), WallPressure { bands: values, force, level, ratio }))
        };
        let count = |name: &String| {
            let [came, left, present] = body_columns(name).map(|name| value(&name));
            Some((name.clone(), BodyCount { came: came?, left: left?, present: present? }))
        };
        let one = |name: &String, column: fn(&str) -> String| Some((name.clone(), value(&column(name))?));
        Some(Self {
            time: value("time_s")?,
            spread: spread(),
            top: value("top_m")?,
            volume: value("volume_m3")?,
            speed_p50: value("speed_p50_m_s")?,
            speed_p99: value("speed_p99_m_s")?,
            speed_max: value("speed_max_m_s")?,
            kinetic_energy: value("kinetic_energy_J")?,
            potential_energy: value("potential_energy_J")?,
            yielded_share: value("yielded_share")?,
            pressure_max: value("pressure_max_Pa")?,
            levels: gauges.levels.iter().map(|g| one(&g.name, level_column)).collect::<Option<_>>()?,
            fronts: gauges.fronts.iter().map(|g| one(&g.name, front_column)).collect::<Option<_>>()?,
            lights: gauges.lights.iter().map(|g| one(&g.name, light_column)).collect::<Option<_>>()?,
            pressures: gauges.pressures.iter().map(pressure).collect::<Option<_>>()?,
            solids: gauges.loaded.iter().map(load).collect::<Option<_>>()?,
            travel: match &gauges.carried {
                Some((_, name, _)) => Some(one(name, travel_column)?),
                None => None,
            },
            inflow: (0..).map_while(|n| value(&inflow_column(n))).collect(),
            outflow: value(OUTFLOW),
            batches_out: (0..).map_while(|n| value(&batch_column(n))).collect(),
            bodies: gauges.bodies.iter().map(count).collect::<Option<_>>()?,
        })
    }
}

/// Name of the reading of a level gauge.
fn level_column(name: &str) -> String {
    format!("level_{name}_m")
}

/// Name of the reading of a front gauge.
fn front_column(name: &str) -> String {
    format!("front_{name}_m")
}

/// Name of the reading of a light gauge.
fn light_column(name: &str) -> String {
    format!("light_{name}")
}

/// Names of the readings of a pressure gauge: its bands, the force, the level and the ratio.
fn pressure_columns(name: &str, bands: usize) -> Vec<String> {
    let bands = (1..=bands).map(|band| format!("pressure_{name}_{band}_Pa"));
    bands.chain(["force_N", "level_m", "ratio"].map(|what| format!("pressure_{name}_{what}"))).collect()
}

/// Names of the readings of a solid.
fn load_columns(name: &str) -> [String; 6] {
    ["force_x_N", "force_y_N", "force_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm"]
        .map(|what| format!("{name}_{what}"))
}

/// Name of the way of a solid that is moved by a load.
fn travel_column(name: &str) -> String {
    format!("{name}_travel_m")
}

/// Name of the volume that has come in by the inlet number `n`; in the case file the first is number 1.
fn inflow_column(n: usize) -> String {
    format!("inlet{}_inflow_m3", n + 1)
}

/// Name of the volume that has left.
const OUTFLOW: &str = "outflow_m3";

/// Name of the volume of the batch number `n` that has left; the first that the case file names is number 1.
fn batch_column(n: usize) -> String {
    format!("batch{}_outflow_m3", n + 1)
}

/// Names of the numbers of bodies: what was there or came in, what left, and what is there.
fn body_columns(name: &str) -> [String; 3] {
    ["in", "out", "present"].map(|what| format!("bodies_{name}_{what}"))
}

/// The load on a solid and its mirror images beyond symmetry planes.
fn whole_load(load: SolidLoad, cells: &Cells) -> SolidLoad {
    let mut whole = load;
    for axis in 0..3 {
        for side in (0..2).filter(|side| cells.symmetry[axis][*side]) {
            let mut force = whole.force;
            force[axis] = -force[axis];
            let mut moment = -whole.moment;
            moment[axis] = -moment[axis];
            // The image acts as far beyond the plane.
            moment += 2.0 * cells.domain[side][axis] * DVec3::AXES[axis].cross(force);
            whole = SolidLoad { force: whole.force + force, moment: whole.moment + moment };
        }
    }
    whole
}

/// Names of the bodies of a case, each once, if any can come in or leave.
fn passing(case: &Case) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    if case.has_outlets() || case.incoming().next().is_some() {
        let groups = case.groups.iter().map(|group| &group.name);
        for name in groups.chain(case.incoming().map(|(_, incoming)| &incoming.name)) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
    }
    names
}

impl Gauges {
    /// The gauges that a case asks for.
    pub fn new(case: &Case) -> Self {
        let motion = |name: &String| case.solids.iter().find(|solid| solid.name == *name);
        let light = |gauge: &LightGauge| Light {
            name: gauge.name.clone(),
            min: gauge.min,
            max: gauge.max,
            motion: gauge.with.as_ref().and_then(motion).map_or(Motion::REST, |solid| solid.motion.clone()),
        };
        Self {
            gravity: case.domain.gravity,
            spread: case.gauges.spread,
            levels: case.gauges.level.clone(),
            fronts: case.gauges.front.clone(),
            lights: case.gauges.light.iter().map(light).collect(),
            pressures: case.gauges.pressure.iter().map(|gauge| Pressure::new(gauge, case)).collect(),
            loaded: (case.solids.iter().map(|solid| &solid.name))
                .chain(case.cages.iter().map(|cage| &cage.name))
                .cloned()
                .collect(),
            carried: case
                .loaded()
                .map(|loaded| (loaded.solid, case.solids[loaded.solid].name.clone(), loaded.direction)),
            bodies: passing(case),
            moving: Moving::all(case),
        }
    }

    /// Names of the times at which that comes for which front and light gauges wait.
    pub(crate) fn events(&self) -> Vec<String> {
        let fronts = self.fronts.iter().map(|gauge| format!("front_{}_s", gauge.name));
        fronts.chain(self.lights.iter().map(|gauge| format!("light_{}_s", gauge.name))).collect()
    }

    /// The place among these of that for which the gauge of this name waits.
    pub(crate) fn event(&self, name: &str) -> Option<usize> {
        let fronts = self.fronts.iter().map(|gauge| &gauge.name);
        fronts.chain(self.lights.iter().map(|gauge| &gauge.name)).position(|gauge| gauge == name)
    }

    /// Keeps the largest pressure on each wall that is gauged; there are as many peaks, in the same order.
    pub(crate) fn watch_pressures(&self, peaks: &mut [Peak], readings: &Readings, snapshot: &Snapshot) {
        let Fluid::Cells(cells) = &snapshot.fluid;
        for ((gauge, peak), (_, read)) in self.pressures.iter().zip(peaks).zip(&readings.pressures) {
            gauge.watch(peak, readings.time, read, cells.density, cells.size);
        }
    }

    /// No pressure on any of these walls yet.
    pub(crate) fn no_peaks(&self) -> Vec<Peak> {
        vec![Peak::default(); self.pressures.len()]
    }

    /// Names of the pressure gauges.
    pub(crate) fn pressure_names(&self) -> impl Iterator<Item = &String> {
        self.pressures.iter().map(|gauge| &gauge.name)
    }

    /// Watches for them.
    pub(crate) fn targets(&self) -> Vec<TargetTime> {
        let fronts = self.fronts.iter().map(|_| TargetTime::new(0.0));
        fronts.chain(self.lights.iter().map(|_| TargetTime::from_below(HALF_CLEAR))).collect()
    }

    /// Reads all gauges; the same snapshot gives the same bits on any number of threads.
    pub fn measure(&self, snapshot: &Snapshot) -> Readings {
        let Fluid::Cells(cells) = &snapshot.fluid;
        let height = Plan::height(cells);
        let mut sums = Sums::over(cells, self.gravity);
        let body = cells.size.powi(3) * cells.copies();
        let loads = snapshot.solids.iter().chain(&snapshot.cages);
        Readings {
            time: snapshot.time,
            spread: self.spread.as_ref().map(|gauge| Spread::measure(cells, &height, gauge.centre)),
            top: height.max(),
            volume: (sums.fill + beside::left(&self.moving, &snapshot.moved, cells)) * body,
            speed_p50: percentile(&mut sums.speeds, 0.5),
            speed_p99: percentile(&mut sums.speeds, 0.99),
            speed_max: percentile(&mut sums.speeds, 1.0),
            kinetic_energy: sums.kinetic * cells.density * body,
            potential_energy: sums.potential * cells.density * body,
            yielded_share: if sums.fill > 0.0 { sums.yielded / sums.fill } else { 0.0 },
            pressure_max: sums.pressure.max(0.0),
            levels: self.levels.iter().map(|g| (g.name.clone(), level::measure(cells, g))).collect(),
            fronts: self.fronts.iter().map(|g| (g.name.clone(), front::measure(cells, g))).collect(),
            lights: self.lights.iter().map(|g| (g.name.clone(), g.measure(cells, snapshot.time))).collect(),
            pressures: (self.pressures.iter())
                .map(|g| (g.name.clone(), g.measure(cells, &snapshot.walls.faces)))
                .collect(),
            solids: (self.loaded.iter().cloned()).zip(loads.map(|load| whole_load(*load, cells))).collect(),
            travel: self.carried.as_ref().map(|(solid, name, direction)| {
                (name.clone(), snapshot.moved.get(*solid).map_or(0.0, |way| way.dot(*direction)))
            }),
            inflow: snapshot.inflow.iter().map(|volume| volume * cells.copies()).collect(),
            outflow: snapshot.outflow.map(|volume| volume * cells.copies()),
            batches_out: snapshot.batches_out.iter().map(|volume| volume * cells.copies()).collect(),
            bodies: self.bodies.iter().map(|name| (name.clone(), BodyCount::of(name, snapshot))).collect(),
        }
    }
}

#[cfg(test)]
impl Gauges {
    /// Gauges that read what has these names.
    pub(crate) fn of(readings: &Readings) -> Self {
        let (min, max) = (DVec2::ZERO, DVec2::ONE);
        let names = |named: &[(String, f64)]| named.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        let level = |name| LevelGauge { name, min, max };
        let front = |name| FrontGauge { name, axis: 0, forwards: true, at: 0.0 };
        let light = |name| Light { name, min: DVec3::ZERO, max: DVec3::ONE, motion: Motion::REST };
        Self {
            levels: names(&readings.levels).into_iter().map(level).collect(),
            fronts: names(&readings.fronts).into_iter().map(front).collect(),
            lights: names(&readings.lights).into_iter().map(light).collect(),
            pressures: (readings.pressures.iter())
                .map(|(name, read)| Pressure::of(name.clone(), read.bands.len()))
                .collect(),
            loaded: readings.solids.iter().map(|(name, _)| name.clone()).collect(),
            carried: readings.travel.as_ref().map(|(name, _)| (0, name.clone(), DVec3::NEG_Z)),
            bodies: readings.bodies.iter().map(|(name, _)| name.clone()).collect(),
            ..Self::default()
        }
    }
}

/// Smallest value that is not exceeded by the share `share` of all values; 0 if there are none. Reorders them.
fn percentile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((share * values.len() as f64).ceil() as usize).clamp(1, values.len());
    *values.select_nth_unstable_by(rank - 1, f64::total_cmp).1
}

/// Sums over all cells, each weighted by the fill.
#[derive(Debug, Clone, Default)]
struct Sums {
    fill: f64,
    /// Half the square of the speed, in m2/s2.
    kinetic: f64,
    /// Potential of the body force, in m2/s2.
    potential: f64,
    yielded: f64,
    /// Not a sum: the largest pressure, in Pa.
    pressure: f64,
    /// Nor these: speeds in m/s of the cells that count for them.
    speeds: Vec<f64>,
}

impl Sums {
    fn over(cells: &Cells, gravity: DVec3) -> Self {
        let [nx, ny, nz] = cells.count;
        // One layer of cells is one task, and the layers are added in their order.
        let layers: Vec<Self> = (0..nz)
            .into_par_iter()
            .map(|k| {
                let mut sums = Self::default();
                for j in 0..ny {
                    for i in 0..nx {
                        let n = cells.index(i, j, k);
                        let fill = cells.fill[n];
                        if fill <= 0.0 {
                            continue;
                        }
                        let squared = cells.velocity[n].length_squared();
                        sums.fill += fill;
                        sums.kinetic += fill * 0.5 * squared;
                        sums.potential -= fill * gravity.dot(cells.centre(i, j, k) - cells.domain[0]);
                        if cells.shear_rate[n] > 0.0 {
                            sums.yielded += fill;
                        }
                        if fill >= HALF_FULL {
                            sums.pressure = sums.pressure.max(cells.pressure[n]);
                            sums.speeds.push(squared.sqrt());
                        }
                    }
                }
                sums
            })
            .collect();
        layers.into_iter().fold(Self::default(), |mut sum, mut layer| {
            sum.fill += layer.fill;
            sum.kinetic += layer.kinetic;
            sum.potential += layer.potential;
            sum.yielded += layer.yielded;
            sum.pressure = sum.pressure.max(layer.pressure);
            sum.speeds.append(&mut layer.speeds);
            sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a block 0.4 m x 0.2 m x 0.25 m of fluid that turns about the z axis at 1/s; its upper cells are half
    /// full, and one of them is nearly empty and very fast.
    fn block() -> Cells {
        let count = [20, 10, 30];
        let number = count.iter().product();
        let mut cells = Cells {
            size: 0.01,
            count,
            fill: vec![0.0; number],
            pressure: vec![0.0; number],
            velocity: vec![DVec3::ZERO; number],
            shear_rate: vec![0.0; number],
            stress: vec![0.0; number],
            solid: vec![0; number],
            cage: None,
            density: 2000.0,
            domain: [DVec3::ZERO, DVec3::new(0.5, 0.5, 0.3)],
            symmetry: [[true, false], [true, false], [false; 2]],
            ..Cells::default()
        };
        for k in 0..26 {
            for j in 0..10 {
                for i in 0..20 {
                    let (n, p) = (cells.index(i, j, k), cells.centre(i, j, k));
                    cells.fill[n] = if k < 25 { 1.0 } else { 0.5 };
                    cells.velocity[n] = DVec3::Z.cross(p);
                    cells.pressure[n] = 2000.0 * 10.0 * (0.255 - p.z);
                    cells.shear_rate[n] = if i < 5 { 1.0 } else { 0.0 };
                }
            }
        }
        let stray = cells.index(0, 0, 26);
        cells.fill[stray] = 0.01;
        cells.velocity[stray] = DVec3::splat(1e3);
        cells.pressure[stray] = 1e9;
        cells
    }

    fn close(value: f64, expected: f64, tolerance: f64) -> bool {
        (value / expected - 1.0).abs() < tolerance
    }

    #[test]
    fn a_turning_block_is_read_rightly() {
        let cells = block();
        let gauges = Gauges {
            gravity: DVec3::new(0.0, 0.0, -10.0),
            spread: Some(SpreadGauge { centre: DVec2::ZERO }),
            ..Gauges::default()
        };
        let mut snapshot = Snapshot { time: 0.5, fluid: Fluid::Cells(cells), ..Snapshot::default() };
        let readings = gauges.measure(&snapshot);
        let volume = 0.4 * 0.2 * 0.255;
        assert!(close(readings.volume, volume + 4.0 * 0.01e-6, 1e-12));
        assert!(close(readings.top, 0.2551, 1e-12));
        assert!(close(readings.speed_max, 0.195f64.hypot(0.095), 1e-12));
        assert!(readings.speed_p99 < readings.speed_max && readings.speed_p99 > 0.9 * readings.speed_max);
        // Half of all points of the block are nearer to the axis than this.
        assert!(close(readings.speed_p50, 0.115, 0.05), "{}", readings.speed_p50);
        assert!(close(readings.potential_energy, 2000.0 * 10.0 * volume * 0.1275, 1e-3));
        assert!(close(readings.yielded_share, 0.25, 1e-4));
        assert!(close(readings.pressure_max, 2000.0 * 10.0 * 0.25, 1e-12));
        let spread = readings.spread.unwrap();
        assert!(close(spread.x, 0.4, 1e-9) && close(spread.y, 0.2, 1e-9), "{spread:?}");
        assert!(close(spread.height, 0.2551, 1e-12));
        assert_eq!(readings.columns()[0], ("time_s".to_owned(), 0.5));

        // Without the stray cell: I w^2 / 2 of the block.
        let Fluid::Cells(cells) = &mut snapshot.fluid;
        let stray = cells.index(0, 0, 26);
        cells.velocity[stray] = DVec3::ZERO;
        let inertia = 2000.0 * volume * (0.4f64.powi(2) + 0.2f64.powi(2)) / 12.0;
        assert!(close(gauges.measure(&snapshot).kinetic_energy, 0.5 * inertia, 0.01));
    }

    #[test]
    fn a_quarter_of_a_solid_bears_a_quarter_of_the_load() {
        let corner = DVec3::new(0.2, -0.3, 0.0);
        let cells = Cells {
            domain: [corner, DVec3::ONE],
            symmetry: [[true, false], [true, false], [false; 2]],
            ..Cells::default()
        };
        let (at, force) = (DVec3::new(0.5, 0.1, 0.4), DVec3::new(1.0, 2.0, 5.0));
        let whole = whole_load(SolidLoad { force, moment: at.cross(force) }, &cells);
        // What acts on the whole acts upwards, along the line in which the planes meet.
        assert!((whole.force - DVec3::new(0.0, 0.0, 20.0)).length() < 1e-12);
        assert!((whole.moment - corner.cross(whole.force)).length() < 1e-12);
    }

    #[test]
    fn no_fluid_reads_zero() {
        let gauges = Gauges::default();
        let cells = Cells { size: 0.1, domain: [DVec3::ZERO, DVec3::ONE], ..Cells::default() };
        let readings =
            gauges.measure(&Snapshot { time: 0.0, fluid: Fluid::Cells(cells), ..Snapshot::default() });
        assert!(readings.columns().iter().all(|(_, value)| *value == 0.0), "{readings:?}");
    }

    #[test]
    fn percentiles_are_ranks() {
        let mut values: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        assert_eq!(percentile(&mut values, 0.5), 100.0);
        assert_eq!(percentile(&mut values, 0.99), 198.0);
        assert_eq!(percentile(&mut values, 1.0), 200.0);
        assert_eq!(percentile(&mut [3.0], 0.5), 3.0);
    }
}
