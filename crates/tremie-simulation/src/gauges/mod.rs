//! Gauges: what is read from a snapshot, whatever the method that made it.
//!
//! All readings are in SI units and belong to the whole body: what lies beyond symmetry planes counts. The vertical
//! is z and the floor is the domain's lower side.
//!
//! Speeds and the largest pressure are taken over cells that are at least half full: what a method knows about the
//! fringe of its surface is mostly interpolation, and the 99th percentile must not hang on it. These cells count
//! alike, since their fill differs by a factor of two at most.

mod crossing;
mod spread;

pub use crossing::{TargetTime, first_crossing};
pub use spread::{Spread, profile};

use rayon::prelude::*;
use tremie_case::{Case, SpreadGauge};
use tremie_numerics::DVec3;

use crate::plan::Plan;
use crate::{Cells, Fluid, Snapshot, SolidLoad};

/// Fill from which on a cell counts for speeds and pressure.
const HALF_FULL: f64 = 0.5;

/// The gauges of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauges {
    gravity: DVec3,
    spread: Option<SpreadGauge>,
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
    /// Force and moment on each solid of the case, with its mirror images.
    pub solids: Vec<SolidLoad>,
    /// Volume in m3 that has come in since the start, by inlet.
    pub inflow: Vec<f64>,
    /// Volume in m3 that has left since the start; none where nothing can leave.
    pub outflow: Option<f64>,
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
        for (n, load) in self.solids.iter().enumerate() {
            let values = [load.force, load.moment].map(|v| v.to_array()).concat();
            columns.extend(load_columns(n).into_iter().zip(values));
        }
        for (n, inflow) in self.inflow.iter().enumerate() {
            columns.push((inflow_column(n), *inflow));
        }
        columns.extend(self.outflow.map(|outflow| (OUTFLOW.to_owned(), outflow)));
        columns
    }

    /// Readings from the values of their columns; none if one is missing that all readings have.
    pub(crate) fn from_columns(value: impl Fn(&str) -> Option<f64>) -> Option<Self> {
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
        let load = |n: usize| {
            let [x, y, z, mx, my, mz] = load_columns(n).map(|name| value(&name));
            Some(SolidLoad { force: DVec3::new(x?, y?, z?), moment: DVec3::new(mx?, my?, mz?) })
        };
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
            solids: (0..).map_while(load).collect(),
            inflow: (0..).map_while(|n| value(&inflow_column(n))).collect(),
            outflow: value(OUTFLOW),
        })
    }
}

/// Names of the readings of the solid number `n`; in the case file the first is number 1.
fn load_columns(n: usize) -> [String; 6] {
    let name = |what: &str| format!("solid{}_{what}", n + 1);
    ["force_x_N", "force_y_N", "force_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm"].map(name)
}

/// Name of the volume that has come in by the inlet number `n`; in the case file the first is number 1.
fn inflow_column(n: usize) -> String {
    format!("inlet{}_inflow_m3", n + 1)
}

/// Name of the volume that has left.
const OUTFLOW: &str = "outflow_m3";

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

impl Gauges {
    /// The gauges that a case asks for.
    pub fn new(case: &Case) -> Self {
        Self { gravity: case.domain.gravity, spread: case.gauges.spread }
    }

    /// Reads all gauges; the same snapshot gives the same bits on any number of threads.
    pub fn measure(&self, snapshot: &Snapshot) -> Readings {
        let Fluid::Cells(cells) = &snapshot.fluid;
        let height = Plan::height(cells);
        let sums = Sums::over(cells, self.gravity);
        let mut speeds: Vec<f64> = cells
            .fill
            .par_iter()
            .zip(&cells.velocity)
            .filter(|(fill, _)| **fill >= HALF_FULL)
            .map(|(_, velocity)| velocity.length())
            .collect();
        let body = cells.size.powi(3) * cells.copies();
        Readings {
            time: snapshot.time,
            spread: self.spread.as_ref().map(|gauge| Spread::measure(cells, &height, gauge.centre)),
            top: height.max(),
            volume: sums.fill * body,
            speed_p50: percentile(&mut speeds, 0.5),
            speed_p99: percentile(&mut speeds, 0.99),
            speed_max: percentile(&mut speeds, 1.0),
            kinetic_energy: sums.kinetic * cells.density * body,
            potential_energy: sums.potential * cells.density * body,
            yielded_share: if sums.fill > 0.0 { sums.yielded / sums.fill } else { 0.0 },
            pressure_max: sums.pressure.max(0.0),
            solids: snapshot.solids.iter().map(|load| whole_load(*load, cells)).collect(),
            inflow: snapshot.inflow.iter().map(|volume| volume * cells.copies()).collect(),
            outflow: snapshot.outflow.map(|volume| volume * cells.copies()),
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
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    fill: f64,
    /// Half the square of the speed, in m2/s2.
    kinetic: f64,
    /// Potential of the body force, in m2/s2.
    potential: f64,
    yielded: f64,
    /// Not a sum: the largest pressure, in Pa.
    pressure: f64,
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
                        sums.fill += fill;
                        sums.kinetic += fill * 0.5 * cells.velocity[n].length_squared();
                        sums.potential -= fill * gravity.dot(cells.centre(i, j, k) - cells.domain[0]);
                        if cells.shear_rate[n] > 0.0 {
                            sums.yielded += fill;
                        }
                        if fill >= HALF_FULL {
                            sums.pressure = sums.pressure.max(cells.pressure[n]);
                        }
                    }
                }
                sums
            })
            .collect();
        layers.iter().fold(Self::default(), |sum, layer| Self {
            fill: sum.fill + layer.fill,
            kinetic: sum.kinetic + layer.kinetic,
            potential: sum.potential + layer.potential,
            yielded: sum.yielded + layer.yielded,
            pressure: sum.pressure.max(layer.pressure),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec2;

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
        };
        let mut snapshot = Snapshot {
            time: 0.5,
            fluid: Fluid::Cells(cells),
            solids: Vec::new(),
            inflow: Vec::new(),
            outflow: None,
        };
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
        let gauges = Gauges { gravity: DVec3::ZERO, spread: None };
        let cells = Cells { size: 0.1, domain: [DVec3::ZERO, DVec3::ONE], ..Cells::default() };
        let readings = gauges.measure(&Snapshot {
            time: 0.0,
            fluid: Fluid::Cells(cells),
            solids: Vec::new(),
            inflow: Vec::new(),
            outflow: None,
        });
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
