//! Forces of inclusions on the cells around their points.
//!
//! Points in different blocks may push the same cell. So that it always gets the same sum, points are taken block by block, in their
//! order, and blocks whose points reach the same cells one after the other: each has a colour, and only those of one colour are worked on at once.

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::delta::{beyond, each_cell, mirrored};
use crate::grid::Grid;
use crate::immersed::Vectors;
use crate::lanes::LANES;
use crate::real::Real;
use crate::topology::{EDGE, OUTSIDE, Topology};

/// Which blocks points reach into, along one axis, by the block of their first cell.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reach {
    /// The blocks.
    blocks: Vec<Vec<u32>>,
    /// A colour such that blocks of one colour reach into none together.
    colour: Vec<usize>,
    /// Number of colours.
    colours: usize,
}

impl Reach {
    fn new(topology: &Topology, axis: usize) -> Self {
        let cells = topology.cells[axis] as i64;
        let mut reach = Self { blocks: vec![Vec::new(); topology.blocks[axis]], ..Self::default() };
        for first in -4..=cells + 1 {
            let own = &mut reach.blocks[home(topology, axis, first)];
            let seen = (first..first + 4).filter_map(|at| beyond(topology, axis, at));
            own.extend(seen.map(|(at, _)| (at / EDGE) as u32));
            own.sort_unstable();
            own.dedup();
        }
        for (n, blocks) in reach.blocks.iter().enumerate() {
            let meets = |m: usize| reach.blocks[m].iter().any(|block| blocks.contains(block));
            let taken: Vec<usize> = (0..n).filter(|m| meets(*m)).map(|m| reach.colour[m]).collect();
            let colour = (0..=n).find(|colour| !taken.contains(colour)).unwrap_or(n);
            reach.colour.push(colour);
            reach.colours = reach.colours.max(colour + 1);
        }
        reach
    }
}

/// The block to which the points belong whose first cell this is.
fn home(topology: &Topology, axis: usize, first: i64) -> usize {
    let last = topology.cells[axis] as i64 - 1;
    beyond(topology, axis, first).map_or(first.clamp(0, last) as usize, |(at, _)| at) / EDGE
}

/// The points of a block whose forces are spread, and the forces on the blocks they reach into.
struct Spread<T> {
    /// Coordinates of the block.
    block: [usize; 3],
    /// First and end of its points among all in order.
    points: [usize; 2],
    /// The slot of each block in reach, and its forces.
    pushed: Vec<(usize, Option<Box<Vectors<T>>>)>,
}

impl<T: Real> Grid<T> {
    /// Spreads a force in lattice units from each point that was asked for last.
    pub(crate) fn push_at(&mut self, points: &[DVec3], forces: &[DVec3]) {
        self.immersed.pushes.par_iter_mut().flatten().for_each(|push| **push = bytemuck::Zeroable::zeroed());
        if self.immersed.reach[0].blocks.is_empty() {
            self.immersed.reach = [0, 1, 2].map(|axis| Reach::new(&self.topology, axis));
        }
        let shares = std::mem::take(&mut self.immersed.shares);
        let pushing = |n: usize| shares[n] > T::ZERO && forces[n] != DVec3::ZERO;
        let (homes, order, ends) = self.sorted(points, pushing);
        let reach = std::mem::take(&mut self.immersed.reach);
        let colour = |block: [usize; 3]| [0, 1, 2].map(|a| reach[a].colour[block[a]]);
        for n in 0..reach.iter().map(|reach| reach.colours).product() {
            let now = [0, 1, 2].map(|a| {
                let before: usize = reach[..a].iter().map(|reach| reach.colours).product();
                n / before % reach[a].colours
            });
            let blocks = homes.iter().zip(&ends).filter(|(block, _)| colour(**block) == now);
            let mut tasks: Vec<Spread<T>> = blocks
                .map(|(block, points)| Spread {
                    block: *block,
                    points: *points,
                    pushed: self.take(*block, &reach),
                })
                .collect();
            tasks.par_iter_mut().for_each(|task| {
                for &n in &order[task.points[0]..task.points[1]] {
                    let n = n as usize;
                    self.spread(points[n], forces[n], shares[n], &reach, task);
                }
            });
            for (slot, pushed) in tasks.into_iter().flat_map(|task| task.pushed) {
                if slot > OUTSIDE as usize {
                    self.immersed.pushes[slot] = pushed;
                }
            }
        }
        self.immersed.reach = reach;
        self.immersed.shares = shares;
    }

    /// The blocks that points belong to, the points in the order of their blocks, and the first and end of those of each block.
    fn sorted(
        &self,
        points: &[DVec3],
        asks: impl Fn(usize) -> bool + Sync,
    ) -> (Vec<[usize; 3]>, Vec<u32>, Vec<[usize; 2]>) {
        let topology = &self.topology;
        let none = u32::MAX;
        let home = |n: usize| match asks(n) {
            false => none,
            true => topology.number([0, 1, 2].map(|a| {
                let cells = topology.cells[a] as f64;
                home(topology, a, (points[n][a].clamp(-2.0, cells + 2.0) - 0.5).floor() as i64 - 1)
            })) as u32,
        };
        let homes: Vec<u32> = (0..points.len()).into_par_iter().map(home).collect();
        let mut ends = vec![0u32; topology.blocks.iter().product::<usize>() + 1];
        for &home in homes.iter().filter(|home| **home != none) {
            ends[home as usize + 1] += 1;
        }
        let (mut blocks, mut ranges) = (Vec::new(), Vec::new());
        for n in 1..ends.len() {
            let (first, number) = (ends[n - 1], ends[n]);
            ends[n] += first;
            if number > 0 {
                let [nx, ny, _] = topology.blocks;
                blocks.push([(n - 1) % nx, (n - 1) / nx % ny, (n - 1) / nx / ny]);
                ranges.push([first as usize, (first + number) as usize]);
            }
        }
        let mut order = vec![0u32; ends[ends.len() - 1] as usize];
        for (n, &home) in homes.iter().enumerate().filter(|(_, home)| **home != none) {
            order[ends[home as usize] as usize] = n as u32;
            ends[home as usize] += 1;
        }
        (blocks, order, ranges)
    }

    /// Takes the forces on all blocks that points of this one reach into, x fastest.
    fn take(&mut self, block: [usize; 3], reach: &[Reach; 3]) -> Vec<(usize, Option<Box<Vectors<T>>>)> {
        let [x, y, z] = [0, 1, 2].map(|a| &reach[a].blocks[block[a]]);
        let mut taken = Vec::with_capacity(x.len() * y.len() * z.len());
        for (&k, &j) in z.iter().flat_map(|k| y.iter().map(move |j| (k, j))) {
            for &i in x {
                let slot = self.slot_of_block([i, j, k]) as usize;
                let pushed = if slot > OUTSIDE as usize { self.immersed.pushes[slot].take() } else { None };
                taken.push((slot, pushed));
            }
        }
        taken
    }

    #[inline(always)]
    fn spread(&self, at: DVec3, force: DVec3, share: T, reach: &[Reach; 3], task: &mut Spread<T>) {
        let force = [force.x, force.y, force.z, 0.0].map(|f| T::from_f64(f / share.to_f64()));
        let near = [0, 1, 2].map(|a| &reach[a].blocks[task.block[a]]);
        let place = |a: usize, block: u32| near[a].iter().position(|near| *near == block).unwrap_or(0);
        let count = [near[0].len(), near[1].len()];
        let pushed = &mut task.pushed;
        each_cell(
            &self.near(at),
            |block| place(0, block[0]) + count[0] * (place(1, block[1]) + count[1] * place(2, block[2])),
            |found, row, k, weight, mirrors| {
                let (slot, push) = &mut pushed[found];
                if let (Some(push), Some(seen)) = (push, &self.immersed.seen[*slot]) {
                    let k = k & (LANES - 1);
                    let weight = weight * seen.row(row)[k][3];
                    let cell = &mut push.row_mut(row)[k];
                    let force = mirrored(force, mirrors);
                    for a in 0..4 {
                        cell[a] += weight * force[a];
                    }
                }
            },
        );
    }
}
