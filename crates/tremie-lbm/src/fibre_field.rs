//! How fibres lie that are too many to follow: an orientation tensor in each cell, which the fluid carries along and turns.
//!
//! How the flow turns them is told by `tremie_suspension::FolgarTucker`, for the velocity gradient of the cell: central differences where there is fluid
//! on both sides, one-sided ones at walls and at the surface. They are carried along by looking back: a cell gets what was where its fluid came
//! from,
//!
//! ```text
//!     a(x, t + dt) = a(x - u dt, t)        u in the middle of the way
//! ```
//!
//! by cubic interpolation along each axis on which there is fluid enough, else linear, between the values of the cells around. A tensor is no amount that has to
//! be kept, and so what the fluid carries in `carried` by the mass that passes each link in each step is carried here with many steps at once, a small part of the work:
//! as many as the fluid takes to go a cell, and no more than [`STEPS`].
//!
//! Fibres stay in the fluid with both ends: near walls and the surface, and in layers thinner than they are long, they are laid flat (`tremie_suspension::confined`). How far
//! it is to either is measured from each cell along the three axes.
//!
//! A cell that has just become wet gets what was where its fluid came from as all others. Beside an inlet each step mixes in what comes there.

use rayon::prelude::*;
use tremie_case::{Case, Side};
use tremie_numerics::{DMat3, DVec3};
use tremie_suspension::orientation::{components, tensor_of};
use tremie_suspension::{FolgarTucker, admissible, confined};

use crate::delta::beyond;
use crate::fluid::Fluid;
use crate::grid::{AT_ONCE, Grid};
use crate::plan::settings;
use crate::real::Real;
use crate::rows::Rows;
use crate::surface::Cell;
use crate::topology::{CELLS, EDGE};

/// Steps between two looks at most. Odd, because what is left of an impulse in a rigid cell alternates between steps.
const STEPS: u64 = 27;
/// Cells that the fluid goes between two looks, by the speed that it had at the last one.
const WAY: f64 = 0.7;
/// Cells that are looked at around a block.
const AROUND: usize = 2;
/// Share of a cell that is as good as none.
const NEAR: f64 = 1e-9;
const SPAN: usize = EDGE + 2 * AROUND;

/// Components of a symmetric tensor: 11, 22, 33, 12, 13, 23. All zero where nothing is known.
type Tensor = [f64; 6];

/// The tensors of a block.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    /// Where the block lay when they were found.
    place: [u32; 3],
    tensors: Vec<Tensor>,
}

impl Default for Block {
    fn default() -> Self {
        Self { place: [u32::MAX; 3], tensors: Vec::new() }
    }
}

/// How the fibres lie.
#[derive(Debug, Clone)]
pub(crate) struct FibreField {
    law: FolgarTucker,
    /// Half of a fibre's length in cells.
    half: f64,
    /// Which sides of the domain are walls.
    walls: [bool; 6],
    /// At the start and where fluid comes in.
    start: Tensor,
    /// By slot.
    blocks: Vec<Block>,
    /// Simulated time in s of the last look, and the number of the step before which the next is due.
    looked: f64,
    due: u64,
}

/// What lies beside a cell: fluid that fills so much of a cell, or none; or nothing that ends it.
enum Beside {
    Fluid(f64),
    Air,
    Wall,
    Open,
}

fn known(tensor: &Tensor) -> bool {
    tensor[0] + tensor[1] + tensor[2] > 0.5
}

/// What lies in and around a block.
struct Window {
    /// Velocity in cells a step; none where there is no fluid.
    velocity: Vec<Option<DVec3>>,
    tensors: Vec<Tensor>,
}

impl Window {
    fn new() -> Self {
        let cells = SPAN * SPAN * SPAN;
        Self { velocity: vec![None; cells], tensors: vec![[0.0; 6]; cells] }
    }

    /// Number of a cell, from the first of the block on.
    fn number([x, y, z]: [i32; 3]) -> usize {
        let at = |x: i32| (x + AROUND as i32) as usize;
        at(x) + SPAN * (at(y) + SPAN * at(z))
    }

    /// Copies what lies in and around the block of a slot, with what mirrors show of it.
    fn look<T: Real>(
        &mut self,
        grid: &Grid<T>,
        slot: usize,
        velocity: &[Vec<Option<DVec3>>],
        blocks: &[Block],
    ) {
        let place = grid.links[slot].place.map(|n| n as usize * EDGE);
        let axis = |a: usize| -> [Option<(usize, bool)>; SPAN] {
            std::array::from_fn(|n| beyond(&grid.topology, a, (place[a] + n) as i64 - AROUND as i64))
        };
        let [xs, ys, zs] = [axis(0), axis(1), axis(2)];
        let mut number = 0;
        for z in zs {
            for y in ys {
                for x in xs {
                    let (velocity_here, tensor_here) =
                        (&mut self.velocity[number], &mut self.tensors[number]);
                    number += 1;
                    (*velocity_here, *tensor_here) = (None, [0.0; 6]);
                    let (Some(x), Some(y), Some(z)) = (x, y, z) else { continue };
                    let at = [x.0, y.0, z.0];
                    let slot = grid.slot_at(at) as usize;
                    let cell = grid.topology.cell_at(at);
                    let sign = [x.1, y.1, z.1].map(|flip| if flip { -1.0 } else { 1.0 });
                    if let Some(Some(u)) = velocity[slot].get(cell) {
                        *velocity_here = Some(*u * DVec3::from(sign));
                    }
                    if let Some(tensor) = blocks[slot].tensors.get(cell) {
                        let [xx, yy, zz, xy, xz, yz] = *tensor;
                        let turned = [xy * sign[0] * sign[1], xz * sign[0] * sign[2], yz * sign[1] * sign[2]];
                        *tensor_here = [xx, yy, zz, turned[0], turned[1], turned[2]];
                    }
                }
            }
        }
    }

    /// du_i/dx_j in a cell.
    fn gradient(&self, at: [i32; 3]) -> DMat3 {
        let u = |axis: usize, step: i32| {
            let mut at = at;
            at[axis] += step;
            self.velocity[Self::number(at)]
        };
        let own = u(0, 0).unwrap_or_default();
        let along = |a: usize| match (u(a, -1), u(a, 1)) {
            (Some(before), Some(after)) => 0.5 * (after - before),
            (Some(before), None) => own - before,
            (None, Some(after)) => after - own,
            (None, None) => DVec3::ZERO,
        };
        DMat3::from_cols(along(0), along(1), along(2))
    }

    /// The velocity at a way from a cell, linear between the cells around as far as they are wet.
    fn velocity(&self, at: [i32; 3], way: DVec3) -> DVec3 {
        let (base, t) = split(at, way);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for n in 0..8 {
            let step = [n & 1, n >> 1 & 1, n >> 2];
            let weight: f64 = (0..3).map(|a| if step[a] == 1 { t[a] } else { 1.0 - t[a] }).product();
            let cell = [0, 1, 2].map(|a| base[a] + step[a]);
            if let Some(u) = self.velocity[Self::number(cell)] {
                sum += weight * u;
                weights += weight;
            }
        }
        if weights > 0.0 { sum / weights } else { DVec3::ZERO }
    }

    /// The tensor at a way from a cell; none if nothing is known there.
    fn tensor(&self, at: [i32; 3], way: DVec3) -> Option<Tensor> {
        let (base, t) = split(at, way);
        let cell = |step: [i32; 3]| &self.tensors[Self::number([0, 1, 2].map(|a| base[a] + step[a]))];
        let corner = |n: usize| [n & 1, n >> 1 & 1, n >> 2].map(|n| n as i32);
        let weight = |n: usize| -> f64 {
            let step = corner(n);
            (0..3).map(|a| if step[a] == 1 { t[a] } else { 1.0 - t[a] }).product()
        };
        let (mut low, mut high) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
        let (mut linear, mut weights, mut all) = ([0.0; 6], 0.0, true);
        for n in 0..8 {
            let tensor = cell(corner(n));
            let weight = weight(n);
            // A place on the line between two cells has nothing to do with those beside it.
            if weight == 0.0 {
                continue;
            }
            if !known(tensor) {
                all = false;
                continue;
            }
            weights += weight;
            for c in 0..6 {
                linear[c] += weight * tensor[c];
                low[c] = low[c].min(tensor[c]);
                high[c] = high[c].max(tensor[c]);
            }
        }
        if weights == 0.0 {
            return None;
        }
        let linear = linear.map(|x| x / weights);
        // All alike, as at the start.
        if !all || low == high {
            return Some(linear);
        }
        // Four cells along an axis where all are known beside the corners.
        let beside = |a: usize, step: i32| {
            (0..8).filter(|n| corner(*n)[a] == i32::from(step > 0) && weight(*n) != 0.0).all(|n| {
                let mut at = corner(n);
                at[a] = step;
                known(cell(at))
            })
        };
        let weights = [0, 1, 2].map(|a| {
            let s = t[a];
            if s != 0.0 && beside(a, -1) && beside(a, 2) {
                [
                    -s * (s - 1.0) * (s - 2.0) / 6.0,
                    (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
                    -(s + 1.0) * s * (s - 2.0) / 2.0,
                    (s + 1.0) * s * (s - 1.0) / 6.0,
                ]
            } else {
                [0.0, 1.0 - s, s, 0.0]
            }
        });
        let mut cubic = [0.0; 6];
        for k in (0..4).filter(|k| weights[2][*k] != 0.0) {
            for j in (0..4).filter(|j| weights[1][*j] != 0.0) {
                let weight = weights[2][k] * weights[1][j];
                for i in (0..4).filter(|i| weights[0][*i] != 0.0) {
                    let tensor = cell([i, j, k].map(|n| n as i32 - 1));
                    if !known(tensor) {
                        return Some(linear);
                    }
                    for c in 0..6 {
                        cubic[c] += weight * weights[0][i] * tensor[c];
                    }
                }
            }
        }
        for c in 0..6 {
            cubic[c] = cubic[c].clamp(low[c], high[c]);
        }
        Some(cubic)
    }

    /// The mean of what is known around a cell.
    fn mean(&self, at: [i32; 3]) -> Option<Tensor> {
        let (mut sum, mut number) = ([0.0; 6], 0.0);
        for n in 0..27 {
            let step = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
            let tensor = &self.tensors[Self::number([0, 1, 2].map(|a| at[a] + step[a]))];
            if known(tensor) {
                number += 1.0;
                (0..6).for_each(|c| sum[c] += tensor[c]);
            }
        }
        (number > 0.0).then(|| sum.map(|x| x / number))
    }
}

/// The lower of the cells around a place, and how far it is beyond that; a way of less than a cell along each axis.
fn split(at: [i32; 3], way: DVec3) -> ([i32; 3], [f64; 3]) {
    // What differs from a cell's centre by rounding does not: else rounding would choose between the cells on either side.
    let near = |x: f64| if (x - x.round()).abs() < NEAR { x.round() } else { x };
    let way = way.clamp(DVec3::splat(-1.0), DVec3::splat(1.0)).to_array().map(near);
    let below = way.map(f64::floor);
    ([0, 1, 2].map(|a| at[a] + below[a] as i32), [0, 1, 2].map(|a| way[a] - below[a]))
}

impl FibreField {
    /// That of a case, for fluid that is yet to come; none if the case has none.
    pub(crate) fn new(case: &Case) -> Option<Self> {
        let field = case.fibre_field?;
        let start = components(&field.direction.tensor());
        let half = field.form.reach() / settings(case).cell_size;
        let walls = case.domain.sides.each_ref().map(|side| matches!(side, Side::Wall { .. }));
        Some(Self { law: field.law, half, walls, start, blocks: Vec::new(), looked: 0.0, due: 0 })
    }

    /// Gives the fluid of the first state its tensors.
    pub(crate) fn begin<T: Real>(&mut self, grid: &Grid<T>) {
        self.fit(grid);
        for slot in grid.slots() {
            self.blocks[slot].tensors.fill(self.start);
        }
    }

    /// Has a block for each slot, in which nothing is known if another lay there before.
    fn fit<T: Real>(&mut self, grid: &Grid<T>) {
        self.blocks.resize(grid.len(), Block::default());
        for slot in grid.slots() {
            let place = grid.links[slot].place;
            if self.blocks[slot].place != place {
                self.blocks[slot] = Block { place, tensors: vec![[0.0; 6]; CELLS] };
            }
        }
    }

    /// Mixes what an inlet brought in a step into a cell: a share of what is there now.
    pub(crate) fn pour(&mut self, (slot, cell): Cell, share: f64) {
        let Some(tensor) = self.blocks.get_mut(slot).and_then(|block| block.tensors.get_mut(cell)) else {
            return;
        };
        let share = if known(tensor) { share } else { 1.0 };
        for (own, start) in tensor.iter_mut().zip(self.start) {
            *own += share * (start - *own);
        }
    }

    /// Carries the tensors along and turns them, if that is due before the step `step`; `time` and `time_step` in s.
    pub(crate) fn follow<T: Real>(
        &mut self,
        grid: &Grid<T>,
        fluid: &Fluid<T>,
        rows: &[Rows],
        step: u64,
        time: f64,
        time_step: f64,
    ) {
        if step < self.due {
            return;
        }
        self.fit(grid);
        let velocity: Vec<Vec<Option<DVec3>>> = (0..grid.len())
            .into_par_iter()
            .with_max_len(AT_ONCE)
            .map(|slot| {
                let mut velocity = Vec::new();
                if grid.used[slot] {
                    velocity.resize(CELLS, None);
                    fluid.moments(grid, slot, &rows[slot], None, |cell, m, _| {
                        velocity[cell] = Some(DVec3::from(m.velocity.map(T::to_f64)));
                    });
                }
                velocity
            })
            .collect();
        let steps = (time - self.looked) / time_step;
        let (law, start, blocks, this) = (self.law, self.start, &self.blocks, &*self);
        let of_slot = |window: &mut Window, slot: usize| -> Block {
            let mut new = Block { place: blocks[slot].place, tensors: vec![[0.0; 6]; CELLS] };
            window.look(grid, slot, &velocity, blocks);
            for (cell, (tensor, u)) in new.tensors.iter_mut().zip(&velocity[slot]).enumerate() {
                let Some(u) = *u else { continue };
                let at = [cell % EDGE, cell / EDGE % EDGE, cell / (EDGE * EDGE)].map(|n| n as i32);
                let way = -steps * window.velocity(at, -0.5 * steps * u);
                let found = window.tensor(at, way).or_else(|| window.mean(at)).unwrap_or(start);
                let carried = admissible(&tensor_of(found));
                let turned = law.after(&carried, &window.gradient(at), steps);
                *tensor = components(&confined(&turned, this.room(grid, (slot, cell))));
            }
            new
        };
        let slots: Vec<usize> = grid.slots().collect();
        let new: Vec<Block> = slots
            .par_iter()
            .with_max_len(AT_ONCE)
            .map_init(Window::new, |window, slot| of_slot(window, *slot))
            .collect();
        for (slot, block) in slots.into_iter().zip(new) {
            self.blocks[slot] = block;
        }
        let speeds = velocity.iter().flatten().flatten().map(|u| u.abs().max_element());
        let fastest = speeds.fold(0.0, f64::max);
        self.looked = time;
        self.due = step + ((WAY / fastest) as u64).clamp(1, STEPS);
    }

    /// What lies `step` cells along an axis from a cell in the domain, and where that is.
    fn beside<T: Real>(
        &self,
        grid: &Grid<T>,
        at: [usize; 3],
        axis: usize,
        step: i64,
    ) -> (Beside, [usize; 3]) {
        let next = at[axis] as i64 + step;
        let outside = !(0..grid.topology.cells[axis] as i64).contains(&next);
        if outside && self.walls[2 * axis + usize::from(step > 0)] {
            return (Beside::Wall, at);
        }
        // Beyond what a mirror shows of a narrow domain there is more of the same.
        let Some((n, _)) = beyond(&grid.topology, axis, next) else { return (Beside::Open, at) };
        let mut there = at;
        there[axis] = n;
        let cell = (grid.slot_at(there) as usize, grid.topology.cell_at(there));
        let found = if grid.is_liquid(cell) || grid.is_interface(cell) {
            Beside::Fluid(grid.fills[cell.0][(0, cell.1)].to_f64().clamp(0.0, 1.0))
        } else if grid.is_solid(cell) {
            Beside::Wall
        } else {
            Beside::Air
        };
        (found, there)
    }

    /// Whether the surface in a cell is steepest along an axis: an end of the fluid there, and not the edge of one step of a surface that rises slowly.
    fn ends<T: Real>(&self, grid: &Grid<T>, at: [usize; 3], axis: usize) -> bool {
        let own = grid.fills[grid.slot_at(at) as usize][(0, grid.topology.cell_at(at))].to_f64();
        let rise = [0, 1, 2].map(|a| {
            // Beyond a wall the surface goes on as it is here.
            let [low, high] = [-1, 1].map(|step| match self.beside(grid, at, a, step).0 {
                Beside::Fluid(fill) => fill,
                Beside::Air | Beside::Open => 0.0,
                Beside::Wall => own,
            });
            (high - low).abs()
        });
        rise[axis] >= rise[0].max(rise[1]).max(rise[2]) - NEAR
    }

    /// How far it is along each axis from the places of a cell (root of the mean square) to the nearest wall or surface, over half of a fibre's length; 1 where it is further.
    ///
    /// A cell before air is filled along the axis as far as it is filled at all. What a cell itself holds counts as a whole one: films that cells do not resolve come and go
    /// with each cell that a surface rises by, and fibres would be laid flat in them for good.
    fn room<T: Real>(&self, grid: &Grid<T>, (slot, cell): Cell) -> DVec3 {
        let at = grid.links[slot].coordinates(cell);
        let room = |axis: usize| {
            let ways = [-1, 1].map(|side| {
                let (mut way, mut last) = (0.5, at);
                let mut step = side;
                while way < self.half {
                    let (found, there) = self.beside(grid, at, axis, step);
                    step += side;
                    match found {
                        Beside::Fluid(fill) => {
                            let air = matches!(self.beside(grid, at, axis, step).0, Beside::Air);
                            way += if air { fill } else { 1.0 };
                            last = there;
                        }
                        Beside::Wall => break,
                        Beside::Air if self.ends(grid, last, axis) => break,
                        Beside::Air | Beside::Open => way = self.half,
                    }
                }
                way
            });
            let way = ways[0].min(ways[1]);
            ((way * way + 1.0 / 12.0).sqrt() / self.half).min(1.0)
        };
        DVec3::from([0, 1, 2].map(room))
    }

    /// The tensor in a cell.
    pub(crate) fn tensor(&self, (slot, cell): Cell) -> Tensor {
        let found = self.blocks.get(slot).and_then(|block| block.tensors.get(cell)).filter(|a| known(a));
        found.copied().unwrap_or(self.start)
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.blocks.iter().map(|block| block.tensors.len() * size_of::<Tensor>()).sum()
    }

    /// All that is to be saved: the tensors in the order of the slots that hold blocks; and when they were looked at last and will be next.
    pub(crate) fn saved<T: Real>(&self, grid: &Grid<T>) -> (Vec<f64>, (f64, u64)) {
        let mut tensors = Vec::new();
        for slot in grid.slots() {
            match self.blocks.get(slot).filter(|block| block.place == grid.links[slot].place) {
                Some(block) => tensors.extend(block.tensors.as_flattened()),
                None => tensors.extend([0.0; 6 * CELLS]),
            }
        }
        (tensors, (self.looked, self.due))
    }

    /// Puts back what was saved of the blocks of a grid; none if it is of another size.
    pub(crate) fn load<T: Real>(&mut self, grid: &Grid<T>, tensors: &[f64], when: (f64, u64)) -> Option<()> {
        if tensors.len() != grid.slots().count() * 6 * CELLS {
            return None;
        }
        self.blocks.clear();
        self.fit(grid);
        for (slot, saved) in grid.slots().zip(tensors.chunks_exact(6 * CELLS)) {
            self.blocks[slot].tensors.as_flattened_mut().copy_from_slice(saved);
        }
        (self.looked, self.due) = when;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A window whose tensors are functions of the place, in cells from the first of the block.
    fn window(of: impl Fn(DVec3) -> f64, known_at: impl Fn([i32; 3]) -> bool) -> Window {
        let mut window = Window::new();
        let span = -(AROUND as i32)..(EDGE + AROUND) as i32;
        for z in span.clone() {
            for y in span.clone() {
                for x in span.clone().filter(|x| known_at([*x, y, z])) {
                    let value = of(DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
                    window.tensors[Window::number([x, y, z])] = [value, 0.6 - value, 0.4, 0.0, 0.0, value];
                }
            }
        }
        window
    }

    fn close(found: Option<Tensor>, value: f64) {
        let tensor = found.unwrap();
        assert!((tensor[0] - value).abs() < 1e-12 && (tensor[5] - value).abs() < 1e-12, "{tensor:?} {value}");
    }

    /// Cubic polynomials are carried as they are, where they rise or fall; at a wall linear ones across it, cubic ones along it.
    #[test]
    fn polynomials_are_carried_exactly() {
        let cubic = |p: DVec3| 0.1 + 1e-4 * (p.x + 4.0).powi(3) + 2e-5 * (p.y + 4.0).powi(3) + 0.005 * p.z;
        let everywhere = window(cubic, |_| true);
        let way = DVec3::new(-0.3, 0.45, 0.8);
        close(everywhere.tensor([3, 4, 2], way), cubic(DVec3::new(3.0, 4.0, 2.0) + way));
        close(everywhere.tensor([0, 7, 0], way), cubic(DVec3::new(0.0, 7.0, 0.0) + way));
        let floor = window(cubic, |at| at[2] >= 0);
        close(floor.tensor([3, 4, 0], way), cubic(DVec3::new(3.0, 4.0, 0.0) + way));
        // Into the wall there is nothing but the cell itself.
        close(floor.tensor([3, 4, 0], DVec3::new(0.0, 0.0, -0.2)), cubic(DVec3::new(3.0, 4.0, 0.0)));
        assert_eq!(window(cubic, |_| false).tensor([3, 4, 0], way), None);
    }

    /// Between two values nothing comes out that lies beyond them.
    #[test]
    fn jumps_stay_jumps() {
        let jump = window(|p| if p.x < 3.5 { 0.1 } else { 0.5 }, |_| true);
        for n in 0..20 {
            let found = jump.tensor([4, 3, 3], DVec3::new(-0.1 * f64::from(n), 0.2, 0.3)).unwrap();
            assert!((0.1 - 1e-15..=0.5 + 1e-15).contains(&found[0]), "{found:?}");
        }
    }

    /// du_i/dx_j of a linear flow, up to the walls.
    #[test]
    fn gradients_of_linear_flows_are_exact() {
        let l = DMat3::from_cols_array(&[0.01, 0.02, -0.03, 0.005, -0.02, 0.01, 0.04, 0.0, 0.01]);
        let mut window = Window::new();
        for z in 0..EDGE as i32 {
            for y in 0..EDGE as i32 {
                for x in 0..EDGE as i32 {
                    let at = DVec3::new(f64::from(x), f64::from(y), f64::from(z));
                    window.velocity[Window::number([x, y, z])] = Some(l * at);
                }
            }
        }
        for at in [[0, 0, 0], [3, 4, 5], [7, 0, 7]] {
            let difference = (window.gradient(at) - l).to_cols_array();
            assert!(difference.iter().all(|x| x.abs() < 1e-14), "{at:?} {difference:?}");
        }
        let way = DVec3::new(0.3, -0.4, 0.5);
        let found = window.velocity([3, 4, 5], way);
        assert!((found - l * (DVec3::new(3.0, 4.0, 5.0) + way)).length() < 1e-14);
    }
}
