//! What presses on a wall: the normal stress, band by band over the height, as a pressure cell in a form would read it.
//!
//! A band's pressure is the force on it over its area, both of the cells beside the wall that are at least half full; a cell on the edge
//! between two bands belongs to each by its share of the height. It is the whole normal stress, with what the flow adds to the pressure. The
//! hydrostatic pressure it is compared with is that of the depth below the surface beside the wall at the same time, which is where
//! a ruler finds it: in the columns of these cells or a few cells away from the wall, where it is lower, because what clings to a wall above
//! the surface is no depth.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use tremie_case::{Case, PressureGauge};
use tremie_numerics::DVec3;

use super::{HALF_FULL, level};
use crate::{Cells, Wall, WallFace};

/// Depth in cells from which on a ratio to the hydrostatic pressure tells more than the cells do.
const DEEP: f64 = 2.0;

/// How far from a wall, in cells, nothing clings to it any more.
const ASIDE: f64 = 3.0;

/// A gauge for what presses on a wall.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pressure {
    pub(super) name: String,
    wall: Option<Wall>,
    min: DVec3,
    max: DVec3,
    pub(super) bands: usize,
    /// Downward acceleration in m/s2.
    gravity: f64,
}

/// What presses on a wall.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WallPressure {
    /// Mean normal stress in Pa on each band, the lowest first; 0 where there is no fluid.
    pub bands: Vec<f64>,
    /// Normal force in N on all bands, within the domain.
    pub force: f64,
    /// Mean height in m of the surface beside the wall, as a coordinate; that of the lowest band's foot where there is no fluid.
    pub level: f64,
    /// The force over what it would be if the pressure were hydrostatic; 0 where there is no fluid.
    pub ratio: f64,
}

/// The largest pressure on a wall so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Peak {
    /// Normal stress in Pa.
    pub pressure: f64,
    /// Height in m of the middle of its band, as a coordinate.
    pub height: f64,
    /// When, in s.
    pub time: f64,
    /// The pressure over the hydrostatic one at that height and time; 0 where that is near nothing.
    pub ratio: f64,
}

impl Pressure {
    pub(super) fn new(gauge: &PressureGauge, case: &Case) -> Self {
        let solid = || case.solids.iter().position(|solid| solid.name == gauge.wall);
        Self {
            name: gauge.name.clone(),
            wall: gauge.side().map(Wall::Side).or_else(|| solid().map(Wall::Solid)),
            min: gauge.min.unwrap_or(case.domain.min),
            max: gauge.max.unwrap_or(case.domain.max),
            bands: gauge.bands,
            gravity: -case.domain.gravity.z,
        }
    }

    #[cfg(test)]
    pub(super) fn of(name: String, bands: usize) -> Self {
        Self { name, wall: None, min: DVec3::ZERO, max: DVec3::ONE, bands, gravity: 10.0 }
    }

    /// Height in m of a band.
    fn height(&self) -> f64 {
        (self.max.z - self.min.z) / self.bands as f64
    }

    /// Share of the height of a cell that lies in each band that it reaches into.
    fn shares(&self, cell: DVec3, size: f64) -> impl Iterator<Item = (usize, f64)> {
        let (height, low) = (self.height(), cell.z - 0.5 * size - self.min.z);
        let place = |z: f64| (z / height).floor().clamp(0.0, self.bands as f64 - 1.0) as usize;
        (place(low)..=place(low + size)).map(move |band| {
            let foot = band as f64 * height;
            (band, ((low + size).min(foot + height) - low.max(foot)) / size)
        })
    }

    /// Whether a piece of wall belongs to what is measured, whatever its height.
    fn counts(&self, face: &WallFace) -> bool {
        let [x, y] = [0, 1].map(|a| (self.min[a]..=self.max[a]).contains(&face.cell[a]));
        Some(face.wall) == self.wall && face.fill >= HALF_FULL && x && y
    }

    pub(super) fn measure(&self, cells: &Cells, faces: &[WallFace]) -> WallPressure {
        let faces: Vec<&WallFace> = faces.iter().filter(|face| self.counts(face)).collect();
        let column = |at: DVec3| {
            let at = (at - cells.origin) / cells.size;
            let inside = |a: usize| at[a] >= 0.0 && at[a] < cells.count[a] as f64;
            (inside(0) && inside(1)).then_some((at.x as usize, at.y as usize))
        };
        let aside = |face: &WallFace| face.cell + ASIDE * cells.size * face.normal;
        let columns: BTreeSet<_> =
            faces.iter().map(|face| [column(face.cell), column(aside(face))]).collect();
        let surface = |column: Option<(usize, usize)>| column.and_then(|(i, j)| level::surface(cells, i, j));
        let lowest = |pair: &[_; 2]| pair.iter().filter_map(|column| surface(*column)).reduce(f64::min);
        let levels: Vec<f64> = columns.iter().filter_map(lowest).collect();
        let level = levels.iter().sum::<f64>() / levels.len().max(1) as f64;
        let level = if levels.is_empty() { self.min.z } else { level };
        let (mut bands, mut hydrostatic) = (vec![[0.0; 2]; self.bands], 0.0);
        for face in faces {
            for (band, share) in self.shares(face.cell, cells.size).filter(|(_, share)| *share > 0.0) {
                bands[band][0] += share * face.force;
                bands[band][1] += share * face.area;
                hydrostatic +=
                    share * face.area * cells.density * self.gravity * (level - face.cell.z).max(0.0);
            }
        }
        let force = bands.iter().map(|band| band[0]).sum::<f64>();
        WallPressure {
            bands: bands.iter().map(|[force, area]| if *area > 0.0 { force / area } else { 0.0 }).collect(),
            force,
            level,
            ratio: if hydrostatic > 0.0 { force / hydrostatic } else { 0.0 },
        }
    }

    /// Keeps the largest pressure; fluid of this density on cells of this size.
    pub(super) fn watch(&self, peak: &mut Peak, time: f64, read: &WallPressure, density: f64, size: f64) {
        for (band, &pressure) in read.bands.iter().enumerate() {
            if pressure <= peak.pressure {
                continue;
            }
            let height = self.min.z + (band as f64 + 0.5) * self.height();
            let depth = read.level - height;
            let hydrostatic = density * self.gravity * depth;
            let ratio = if depth > DEEP * size && hydrostatic > 0.0 { pressure / hydrostatic } else { 0.0 };
            *peak = Peak { pressure, height, time, ratio };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall beside 8 cells of 0.1 m, the lowest at z = 1 m, under fluid of 1000 kg/m3 that presses with a share of the hydrostatic pressure.
    fn wall(share: f64) -> (Cells, Vec<WallFace>) {
        let cells = Cells {
            origin: DVec3::new(0.0, 0.0, 1.0),
            size: 0.1,
            count: [1, 1, 8],
            fill: vec![1.0; 8],
            solid: vec![0; 8],
            cage: None,
            density: 1000.0,
            domain: [DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.1, 0.1, 2.0)],
            ..Cells::default()
        };
        let face = |k: usize| {
            let cell = cells.centre(0, 0, k);
            WallFace {
                wall: Wall::Side(0),
                cell,
                normal: DVec3::X,
                fill: 1.0,
                area: 0.01,
                force: share * 1e4 * (1.8 - cell.z) * 0.01,
            }
        };
        let faces = (0..8).map(face).collect();
        (cells, faces)
    }

    fn gauge(bands: usize) -> Pressure {
        let max = DVec3::new(0.1, 0.1, 2.0);
        Pressure { wall: Some(Wall::Side(0)), min: DVec3::Z, max, ..Pressure::of("form".into(), bands) }
    }

    fn close(value: f64, expected: f64) -> bool {
        (value - expected).abs() < 1e-9 * expected.abs().max(1.0)
    }

    #[test]
    fn bands_read_the_mean_of_what_presses_on_them() {
        let (cells, faces) = wall(1.0);
        let read = gauge(5).measure(&cells, &faces);
        let expected = [7000.0, 5000.0, 3000.0, 1000.0, 0.0];
        assert!(read.bands.iter().zip(expected).all(|(p, e)| close(*p, e)), "{:?}", read.bands);
        assert!(
            close(read.force, 0.5 * 1e4 * 0.8 * 0.8 * 0.1)
                && close(read.level, 1.8)
                && close(read.ratio, 1.0)
        );
        // Bands half a cell high share cells, which are known no better; bands of a cell and a half share them too.
        assert!(close(gauge(20).measure(&cells, &faces).bands[1], 7500.0));
        let whole: f64 = gauge(7).measure(&cells, &faces).force;
        assert!(close(whole, read.force));
    }

    #[test]
    fn a_film_on_the_wall_is_no_depth() {
        // Three cells away the fluid stands four cells high.
        let (mut cells, faces) = wall(0.25);
        cells.count = [4, 1, 8];
        cells.fill = (0..32).map(|n| if n % 4 == 0 || n / 4 < 4 { 1.0 } else { 0.0 }).collect();
        cells.solid = vec![0; 32];
        let read = gauge(5).measure(&cells, &faces);
        assert!(close(read.level, 1.4) && close(read.ratio, 1.0), "{read:?}");
    }

    #[test]
    fn another_wall_and_what_lies_outside_the_box_do_not_count() {
        let (cells, faces) = wall(1.0);
        let other = Pressure { wall: Some(Wall::Solid(0)), ..gauge(5) };
        assert_eq!(
            other.measure(&cells, &faces),
            WallPressure { bands: vec![0.0; 5], level: 1.0, ..WallPressure::default() }
        );
        let upper = Pressure { min: DVec3::new(0.0, 0.0, 1.6), ..gauge(2) }.measure(&cells, &faces);
        assert!(close(upper.bands[0], 1000.0) && close(upper.bands[1], 0.0), "{upper:?}");
        let beside = Pressure { min: DVec3::new(0.06, 0.0, 1.0), ..gauge(2) }.measure(&cells, &faces);
        assert_eq!(beside.force, 0.0);
    }

    #[test]
    fn the_largest_pressure_is_kept_with_its_share_of_the_hydrostatic_one() {
        let mut peak = Peak::default();
        for (time, share) in [(1.0, 0.5), (2.0, 0.8), (3.0, 0.7)] {
            let (cells, faces) = wall(share);
            gauge(5).watch(&mut peak, time, &gauge(5).measure(&cells, &faces), 1000.0, 0.1);
        }
        assert!(
            close(peak.pressure, 5600.0) && close(peak.ratio, 0.8) && close(peak.height, 1.1),
            "{peak:?}"
        );
        assert_eq!(peak.time, 2.0);
    }
}
