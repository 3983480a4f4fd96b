//! Inlets that stay above the fill, as a hose that is drawn up while the form fills.
//!
//! The level around a face is looked at every few steps, and the face then rises straight and evenly, no faster than it may, so that its lowest
//! point comes to be where it should. It never goes down, nor out of the domain. The way to there is all that has to be kept.

use tremie_geometry::{Face, Motion, Waypoint};
use tremie_numerics::DVec3;

use crate::grid::Grid;
use crate::real::Real;
use crate::topology::AIR;

/// Fill up to which a cell is the last of a column of fluid.
const HALF_FULL: f64 = 0.5;

/// Cells between a face and the upper side of the domain, of which the last may be open.
const CLEAR: f64 = 2.0;

/// The way of a face: time in s and height in m above where it is drawn, from and to; none if it has not risen yet.
pub(crate) type Rise = Option<[[f64; 2]; 2]>;

impl<T: Real> Grid<T> {
    /// Lets the inlets that stay above the fill rise, from a time in s on, to where they should be after `interval` s, or as soon as they may.
    pub(crate) fn raise_inlets(&mut self, time: f64, interval: f64) {
        let top = self.solids.corner().z + (self.topology.cells[2] as f64 - CLEAR) * self.solids.size();
        for n in 0..self.inlets.all.len() {
            let inlet = &self.inlets.all[n];
            let Some(above) = inlet.inlet.above_fill else { continue };
            let now = inlet.inlet.motion.offset(time);
            let face = inlet.face(now);
            let lowest = face.bounds(0.0).0.z;
            let due = self.level_around(&face).map_or(lowest, |level| (level + above.distance).min(top));
            let way = (due - lowest).max(0.0);
            let end = time + (way / above.speed).max(interval);
            self.redirect(n, Some([[time, now.z], [end, now.z + way]]));
        }
    }

    /// Height z in m of the highest of the columns of fluid around a face: beyond a cell from its edge, where what falls from it does not count,
    /// up to half its size further. None where there is no fluid.
    fn level_around(&self, face: &Face) -> Option<f64> {
        let (size, corner, cells) = (self.solids.size(), self.solids.corner(), self.topology.cells);
        let (min, max) = face.bounds(0.0);
        let (near, far) = (size, size + 0.5 * face.least_extent());
        let range = |axis: usize| {
            let place = |x: f64| ((x - corner[axis]) / size).floor();
            let from = place(min[axis] - far).max(0.0) as usize;
            from..(place(max[axis] + far) + 1.0).clamp(0.0, cells[axis] as f64) as usize
        };
        let around = |[x, y]: [usize; 2]| {
            let p = self.solids.centre([x, y, 0]);
            let beyond = |axis: usize| (min[axis] - p[axis]).max(p[axis] - max[axis]);
            beyond(0).max(beyond(1)) > near
        };
        let columns = range(1).flat_map(|y| range(0).map(move |x| [x, y]));
        let levels = columns.filter(|column| around(*column)).filter_map(|column| self.level_of(column));
        levels.reduce(f64::max)
    }

    /// Height z in m to which a column of cells is full from below, whatever solids lie in it; none if it is dry.
    fn level_of(&self, [x, y]: [usize; 2]) -> Option<f64> {
        let (size, bottom) = (self.solids.size(), self.solids.corner().z);
        let mut level = None;
        for z in 0..self.topology.cells[2] {
            let at = [x, y, z];
            let slot = self.slot_at(at);
            let cell = (slot as usize, self.topology.cell_at(at));
            if slot == AIR && !self.solids.cover(at) || slot != AIR && self.is_air(cell) {
                break;
            }
            if slot == AIR || self.is_solid(cell) {
                continue;
            }
            let fill = self.fills[cell.0][(0, cell.1)].to_f64();
            level = Some(bottom + size * (z as f64 + fill.clamp(0.0, 1.0)));
            if fill < HALF_FULL {
                break;
            }
        }
        level
    }

    /// The ways of the inlets that stay above the fill.
    pub(crate) fn rises(&self) -> Vec<Rise> {
        let following = self.inlets.all.iter().filter(|inlet| inlet.inlet.above_fill.is_some());
        let rise = |motion: &Motion| match motion {
            Motion::Path(points) => match points[..] {
                [from, to] => Some([[from.time, from.offset.z], [to.time, to.offset.z]]),
                _ => None,
            },
            Motion::Uniform(_) | Motion::Through(..) => None,
        };
        following.map(|inlet| rise(&inlet.inlet.motion)).collect()
    }

    /// Puts these ways back; none if they are not those of these inlets.
    pub(crate) fn restore_rises(&mut self, rises: Vec<Rise>) -> Option<()> {
        let following = |n: &usize| self.inlets.all[*n].inlet.above_fill.is_some();
        let numbers: Vec<usize> = (0..self.inlets.all.len()).filter(following).collect();
        if numbers.len() != rises.len() {
            return None;
        }
        for (n, rise) in numbers.into_iter().zip(rises) {
            self.redirect(n, rise);
        }
        Some(())
    }

    /// Sends an inlet and its plate on a way.
    fn redirect(&mut self, n: usize, rise: Rise) {
        let point = |[time, z]: [f64; 2]| Waypoint { time, offset: DVec3::Z * z };
        let motion = rise.map_or(Motion::REST, |ends| Motion::Path(ends.map(point).into()));
        self.solids.redirect(n, motion.clone());
        self.inlets.all[n].inlet.motion = motion;
    }
}
