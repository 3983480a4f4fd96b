//! The fluid as inclusions see it.
//!
//! The velocity around a point is that of the step before: inclusions move with a fluid that is a step old, which changes nothing once the flow is
//! steady, and saves to read all populations twice.

use std::ops::Range;

use rayon::prelude::*;
use tremie_numerics::DVec3;
use tremie_rheology::FlowCurve;
use tremie_suspension::{Carrier, Flat, Periods, Push, Seen, Wall, Walls, hold};

use crate::collision::{MAGIC, magic};
use crate::delta::{Around, beyond, mirrored};
use crate::grid::Grid;
use crate::immersed::{Immersed, TAKES};
use crate::lanes::LANES;
use crate::lattice::{C, Q};
use crate::processor::for_this_processor;
use crate::real::Real;
use crate::scaling::Scaling;
use crate::solids::Solids;
use crate::spread::Windows;
use crate::topology::{Boundary, EDGE, ROWS, Topology};
use crate::window::{Asked, Window};

/// Share of fluid below which a point counts as being in air.
const LEAST: f64 = 1e-3;

/// Points in one pass over the lattice.
pub(crate) const CHUNK: usize = 256;

/// Radius in cells of the cylinder as which a line of points a cell apart moves through the fluid: measured on square arrays of cylinders
/// (Hasimoto 1959), 32 cells apart, at viscosities from 0.02 to 0.2, within 1.5 % wherever the line lies between the cells.
const LINE_RADIUS: f64 = 1.162;

/// By how much it grows, over what the root of the magic parameter falls short, in a nearly inviscid fluid, whose odd moments are held down: measured in the same way
/// at viscosities from 0.0035 to 0.0155, against what the same arrays showed at 0.02 and 0.05, within 0.6 %.
const LINE_GROWS: f64 = 0.29;

/// The fluid on the lattice in SI units.
pub(crate) struct Lattice<'a, T: Real> {
    pub(crate) grid: &'a mut Grid<T>,
    pub(crate) scaling: &'a Scaling,
    /// Lower corner of the domain in m.
    pub(crate) corner: DVec3,
    /// In m/s2.
    pub(crate) gravity: DVec3,
    pub(crate) curve: &'a FlowCurve,
}

impl<T: Real> Lattice<'_, T> {
    /// Points in cells from the domain's lower corner; those of a body that lies across a periodic side are within the domain, too.
    fn on_lattice(&self, points: &[DVec3]) -> Vec<DVec3> {
        let (corner, scale, topology) = (self.corner, 1.0 / self.scaling.cell_size, &self.grid.topology);
        let periods = [0, 1, 2].map(|axis| {
            let periodic = topology.sides[axis][0] == Boundary::Periodic;
            periodic.then_some(topology.cells[axis] as f64)
        });
        points.par_iter().map(|at| Periods(periods).inside(DVec3::ZERO, (*at - corner) * scale)).collect()
    }
}

impl<T: Real> Carrier for Lattice<'_, T> {
    fn grain(&self) -> f64 {
        self.scaling.cell_size
    }

    fn line_radius(&self) -> f64 {
        let magic = magic(self.scaling.viscosity(self.viscosity()));
        (LINE_RADIUS + LINE_GROWS * (MAGIC.sqrt() - magic.sqrt())) * self.scaling.cell_size
    }

    fn density(&self) -> f64 {
        self.scaling.density
    }

    fn viscosity(&self) -> f64 {
        self.curve.plastic_viscosity()
    }

    fn gravity(&self) -> DVec3 {
        self.gravity
    }

    fn time_step(&self) -> f64 {
        self.scaling.time_step
    }

    fn see(&mut self, points: &[DVec3], part: f64, seen: &mut [Seen]) {
        let points = self.on_lattice(points);
        let takes = [hold(self.scaling.viscosity(self.viscosity())), TAKES].map(|takes| part * takes);
        self.grid.see_at(&points, self.scaling.velocity_unit(), takes, seen);
    }

    fn thicken(&mut self, points: &[DVec3], seen: &mut [Seen]) {
        let points = self.on_lattice(points);
        let (grid, curve, unit) = (&*self.grid, self.curve, self.scaling.time_step.recip());
        let plastic = curve.plastic_viscosity();
        (points.par_iter(), seen.par_iter_mut()).into_par_iter().with_min_len(CHUNK).for_each(
            |(at, seen)| {
                let apparent = curve.viscosity(unit * grid.shear_rate_at(*at));
                seen.thickening = (apparent / plastic - 1.0).max(0.0);
            },
        );
    }

    fn push(&mut self, pushes: &[Push]) {
        let force = self.scaling.stress_unit() * self.scaling.cell_size.powi(2);
        self.grid.push_at(pushes, force, force / self.scaling.velocity_unit());
    }
}

/// What bodies can touch: solids, walls of the domain, and planes of symmetry, beyond which their mirror images are.
pub(crate) struct Sides<'a> {
    solids: &'a Solids,
    flat: Vec<Flat>,
    /// Velocity in m/s of what moves a cell in a step.
    unit: f64,
}

impl<'a> Sides<'a> {
    pub(crate) fn new(topology: &Topology, solids: &'a Solids, unit: f64) -> Self {
        let mut flat = Vec::new();
        for (axis, sides) in topology.sides.iter().enumerate() {
            let low = solids.corner()[axis];
            let high = low + topology.cells[axis] as f64 * solids.size();
            let along = DVec3::AXES[axis];
            for (side, normal, place) in [(sides[0], along, low), (sides[1], -along, -high)] {
                let velocity = match side {
                    Boundary::Wall(velocity) => unit * DVec3::from(velocity),
                    Boundary::Symmetry => DVec3::ZERO,
                    Boundary::Periodic | Boundary::Open => continue,
                };
                flat.push(Flat { normal, place, velocity });
            }
        }
        Self { solids, flat, unit }
    }
}

impl Walls for Sides<'_> {
    fn flat(&self) -> &[Flat] {
        &self.flat
    }

    fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
        let (distance, normal, velocity) = self.solids.nearest_to(at, within)?;
        Some(Wall { distance, normal, velocity: self.unit * velocity })
    }
}

impl<T: Real> Grid<T> {
    /// Makes what is seen fit the cells as they are now: after a step, cells may have become fluid or air.
    pub(crate) fn look(&mut self) {
        let Self { immersed, kinds, fills, front, .. } = self;
        let Immersed { seen, last, pushes, .. } = immersed;
        let all = (seen.par_iter_mut(), last.par_iter_mut(), pushes.par_iter_mut());
        all.into_par_iter().enumerate().skip(2).for_each(|(slot, all)| {
            let (Some(seen), Some(last), Some(pushes)) = all else { return };
            for (row, kinds) in kinds[slot].iter().enumerate().filter(|(_, kinds)| kinds.liquid != 0xff) {
                // What is air now has no last velocity when it is fluid again, and nothing is asked of it.
                let both = last.row_mut(row).iter_mut().zip(pushes.row_mut(row));
                for (k, (last, push)) in both.enumerate() {
                    if kinds.wet() >> k & 1 == 0 {
                        (*last, *push) = ([T::ZERO; 4], [T::ZERO; 4]);
                    }
                }
                for (k, cell) in seen.row_mut(row).iter_mut().enumerate() {
                    let at = row * EDGE + k;
                    let fill = match (kinds.liquid >> k & 1, kinds.interface >> k & 1) {
                        (1, _) => T::ONE,
                        (_, 1) => T::from_f64(fills[slot][(0, at)].to_f64().clamp(0.0, 1.0)),
                        _ => T::ZERO,
                    };
                    if cell[3] == fill {
                        continue;
                    }
                    let velocity = if cell[3] > T::ZERO {
                        [cell[0] / cell[3], cell[1] / cell[3], cell[2] / cell[3]]
                    } else {
                        let f: [T; Q] = std::array::from_fn(|i| front[slot][(i, at)]);
                        let sum = |a: usize| (1..Q).map(|i| f64::from(C[i][a]) * f[i].to_f64()).sum::<f64>();
                        [0, 1, 2].map(|a| T::from_f64(sum(a)))
                    };
                    *cell = [fill * velocity[0], fill * velocity[1], fill * velocity[2], fill];
                }
            }
        });
    }

    /// Velocity around each point, in cells from the domain's lower corner, by the size of the lattice's unit, and the share of what lies there that is fluid;
    /// `takes` is the part of its momentum in a step of which the fluid takes hold in its midst, and beside what bounds it.
    pub(crate) fn see_at(&mut self, points: &[DVec3], unit: f64, takes: [f64; 2], seen: &mut [Seen]) {
        self.sort(points);
        let (mut sums, mut crowding) =
            (std::mem::take(&mut self.immersed.sums), std::mem::take(&mut self.immersed.crowding));
        sums.resize(points.len(), [T::ZERO; 4]);
        crowding.resize(points.len(), T::ZERO);
        self.immersed.find_crowded(takes[1]);
        let grid = &*self;
        let (sorted, windows) = (&grid.immersed.sorted, &grid.immersed.windows);
        let mut rest = (sums.as_mut_slice(), crowding.as_mut_slice());
        let mut own = |points: usize| {
            let (sums, crowding) = std::mem::take(&mut rest);
            let (sums, crowding) = (sums.split_at_mut(points), crowding.split_at_mut(points));
            rest = (sums.1, crowding.1);
            (sums.0, crowding.0)
        };
        if let Some(windows) = windows {
            let pencils = sorted.windows.chunk_by(|a, b| windows.pencil(a.0) == windows.pencil(b.0));
            let number = |pencil: &[(usize, Range<usize>)]| pencil.iter().map(|window| window.1.len()).sum();
            let tasks: Vec<_> = pencils.map(|pencil| (pencil, own(number(pencil)))).collect();
            let scratch = || (Window::new(), Vec::new());
            tasks.into_par_iter().for_each_init(scratch, |scratch, (pencil, (sums, crowding))| {
                see_points(grid, windows, pencil, scratch, sums, crowding);
            });
        }
        (points.par_iter(), seen.par_iter_mut(), sorted.rank.par_iter())
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(at, seen, rank)| {
                let rank = *rank as usize;
                *seen = grid.seen_at(*at, unit, takes, &sums[rank], crowding[rank]);
            });
        (self.immersed.sums, self.immersed.crowding) = (sums, crowding);
    }

    /// What the sum of what is seen around a point says.
    #[inline(always)]
    fn seen_at(&self, at: DVec3, unit: f64, takes: [f64; 2], sum: &[T; 4], friction: T) -> Seen {
        if sum[3] == T::ZERO {
            return Seen::default();
        }
        let share = sum[3].to_f64() / 64.0;
        let velocity = unit / sum[3].to_f64() * DVec3::from([0, 1, 2].map(|a| sum[a].to_f64()));
        let inward = if share < 0.5 { self.inward(at) } else { DVec3::ZERO };
        // All cells are full in the midst of fluid.
        let takes = if share > 0.999 { takes[0] } else { takes[1] };
        let crowding = (friction.to_f64() / sum[3].to_f64() / takes - 1.0).max(0.0);
        Seen { velocity, share, inward, crowding, ..Seen::default() }
    }

    /// Shear rate sqrt(2 D:D) in lattice units in the cell of a point, by the velocities beside it as far as there is fluid.
    fn shear_rate_at(&self, at: DVec3) -> f64 {
        let cell = at.floor().to_array().map(|n| n as i64);
        let velocity = |axis: usize, step: i64| {
            let mut cell = cell;
            cell[axis] += step;
            let mut mirrors = 0;
            for a in 0..3 {
                let (within, flip) = beyond(&self.topology, a, cell[a])?;
                (cell[a], mirrors) = (within as i64, mirrors | u8::from(flip) << a);
            }
            let cell = cell.map(|n| n as usize);
            let seen = self.immersed.seen[self.slot_at(cell) as usize].as_ref()?;
            let [x, y, z] = cell.map(|n| n % EDGE);
            let found = mirrored(seen.row(y + EDGE * z)[x], mirrors).map(T::to_f64);
            (found[3] > LEAST).then(|| DVec3::new(found[0], found[1], found[2]) / found[3])
        };
        let own = velocity(0, 0).unwrap_or_default();
        let gradient = [0, 1, 2].map(|a| match (velocity(a, -1), velocity(a, 1)) {
            (Some(before), Some(after)) => 0.5 * (after - before),
            (Some(before), None) => own - before,
            (None, Some(after)) => after - own,
            (None, None) => DVec3::ZERO,
        });
        let twice = |a: usize, b: usize| gradient[a][b] + gradient[b][a];
        let squares = (0..9).map(|n| twice(n / 3, n % 3).powi(2)).sum::<f64>();
        (0.5 * squares).sqrt()
    }

    /// The way from a point outside of the surface into the fluid, as [`Seen`] has it.
    fn inward(&self, at: DVec3) -> DVec3 {
        let wetness = self.wetness(at);
        if wetness >= 0.5 {
            return DVec3::ZERO;
        }
        let slope = DVec3::AXES.map(|axis| self.wetness(at + axis) - self.wetness(at - axis));
        (1.0 - 2.0 * wetness) * DVec3::from(slope).normalize_or_zero()
    }

    /// Share of fluid in what is not solid around a point.
    fn wetness(&self, at: DVec3) -> f64 {
        let (mut wet, mut open) = (T::ZERO, T::ZERO);
        Around::new(&self.topology, at).each_cell(
            &self.topology,
            |block| self.slot_of_block(block) as usize,
            |slot, row, k, weight, _| {
                if self.kinds[slot][row & (ROWS - 1)].solid >> (k & (LANES - 1)) & 1 == 0 {
                    open += weight;
                    wet += weight
                        * self.immersed.seen[slot].as_ref().map_or(T::ZERO, |seen| seen.row(row)[k][3]);
                }
            },
        );
        if open > T::ZERO { wet.to_f64() / open.to_f64() } else { 1.0 }
    }

    /// Slot of the block with these coordinates.
    #[inline(always)]
    pub(crate) fn slot_of_block(&self, block: [usize; 3]) -> u32 {
        self.slot_at(block.map(|n| n * EDGE))
    }
}

for_this_processor! {
    /// Sums of what is seen around the points of a pencil, and how crowded it is there, in its order.
    see_points = see_points_here<T: Real>(
        grid: &Grid<T>,
        windows: &Windows,
        pencil: &[(usize, Range<usize>)],
        scratch: &mut (Window<T>, Vec<[T; 4]>),
        sums: &mut [[T; 4]],
        crowding: &mut [T]
    )
}

#[inline(always)]
fn see_points_here<T: Real>(
    grid: &Grid<T>,
    windows: &Windows,
    pencil: &[(usize, Range<usize>)],
    (window, frictions): &mut (Window<T>, Vec<[T; 4]>),
    sums: &mut [[T; 4]],
    crowding: &mut [T],
) {
    let least = T::from_f64(64.0 * LEAST);
    let mut rest = (sums, crowding);
    for (place, range) in pencil {
        let points = &grid.immersed.sorted.points[range.clone()];
        let (spans, asked) = (windows.spans(*place), Asked::by(points));
        window.look(grid, spans, &asked, &grid.immersed.seen);
        let (sums, others) = rest.0.split_at_mut(points.len());
        let (crowding, other) = rest.1.split_at_mut(points.len());
        window.sums(points, sums);
        if window.touches(grid, spans, &grid.immersed.crowded) {
            window.look(grid, spans, &asked, &grid.immersed.pushes);
            frictions.resize(points.len(), [T::ZERO; 4]);
            window.sums(points, frictions);
            crowding.iter_mut().zip(frictions.iter()).for_each(|(sum, [.., friction])| *sum = *friction);
        } else {
            crowding.fill(T::ZERO);
        }
        for sum in sums.iter_mut().filter(|sum| sum[3] < least) {
            *sum = [T::ZERO; 4];
        }
        rest = (others, other);
    }
}
