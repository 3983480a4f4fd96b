//! Forces of inclusions on the cells around their points.
//!
//! Points in different blocks may push the same cell. So that it always gets the same sum, points are taken in the order of their blocks, pencil by
//! pencil of these, and pencils whose points reach the same cells one after the other: layer by layer, and within a layer each pencil has a colour,
//! and only those of one colour are worked on at once. What a layer reads and writes stays in the caches from one colour to the next.

use std::ops::Range;

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::carrier::CHUNK;
use crate::delta::{Around, beyond, first, mirrored};
use crate::grid::Grid;
use crate::immersed::Vectors;
use crate::lanes::LANES;
use crate::processor::for_this_processor;
use crate::real::{Four, Real, by_axis};
use crate::topology::{EDGE, OUTSIDE, Topology};

/// The pencils of blocks: along the second longest axis, beside each other along the longest, in layers along the shortest.
#[derive(Debug, Clone)]
pub(crate) struct Pencils {
    along: usize,
    across: usize,
    layers: usize,
    /// Number of blocks along each axis.
    number: [usize; 3],
    reach: [Reach; 3],
}

impl Pencils {
    fn new(topology: &Topology) -> Self {
        let mut axes = [0, 1, 2];
        axes.sort_by_key(|a| std::cmp::Reverse(topology.blocks[*a]));
        let [across, along, layers] = axes;
        let mut reach = axes.map(|_| Reach::default());
        reach[along].blocks = vec![(0..topology.blocks[along] as u32).collect()];
        reach[across] = Reach::new(topology, across);
        reach[layers] = Reach::new(topology, layers);
        Self { along, across, layers, number: topology.blocks, reach }
    }

    /// Place of a block in the order of all.
    fn place(&self, block: [usize; 3]) -> usize {
        let Self { along, across, layers, number, reach } = self;
        let colours = reach[*across].colours;
        let colour = reach[*across].colour[block[*across]];
        ((block[*layers] * colours + colour) * number[*across] + block[*across]) * number[*along]
            + block[*along]
    }

    /// Number of these places.
    fn places(&self) -> usize {
        self.number.iter().product::<usize>() * self.reach[self.across].colours
    }

    /// The blocks that points of a pencil reach into, by the places of its own blocks over their number.
    fn near(&self, pencil: usize) -> [&[u32]; 3] {
        let (across, layer) = (pencil % self.number[self.across], self.layer(pencil));
        let home = |a: usize| match a {
            a if a == self.along => 0,
            a if a == self.across => across,
            _ => layer / self.reach[self.across].colours,
        };
        [0, 1, 2].map(|a| self.reach[a].blocks[home(a)].as_slice())
    }

    /// What pencils that are worked on at once have in common: the layer and the colour.
    fn layer(&self, pencil: usize) -> usize {
        pencil / self.number[self.across]
    }
}

/// Which blocks points reach into, along one axis, by the block of their first cell.
#[derive(Debug, Clone, Default)]
struct Reach {
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

/// The points of a pencil whose forces are spread, and the forces on the blocks they reach into.
struct Spread<'a, T> {
    /// Its points.
    points: &'a [u32],
    /// Coordinates of the blocks in reach along each axis.
    near: [&'a [u32]; 3],
    /// The slot of each of them and the forces on it, x fastest.
    pushed: Vec<(usize, Option<Box<Vectors<T>>>)>,
}

/// Place of a block among those in reach along an axis.
#[inline(always)]
fn place(near: &[u32], block: usize) -> usize {
    // Along a pencil all blocks are in reach.
    if near.get(block).is_some_and(|near| *near as usize == block) {
        return block;
    }
    near.iter().position(|near| *near as usize == block).unwrap_or(0)
}

impl<T: Real> Grid<T> {
    /// Spreads a force in lattice units from each point that was asked for last.
    pub(crate) fn push_at(&mut self, points: &[DVec3], forces: &[DVec3]) {
        self.immersed.pushes.par_iter_mut().flatten().for_each(|push| **push = bytemuck::Zeroable::zeroed());
        let pencils = self.immersed.pencils.take().unwrap_or_else(|| Pencils::new(&self.topology));
        let shares = std::mem::take(&mut self.immersed.shares);
        let pushing = |n: usize| shares[n] > T::ZERO && forces[n] != DVec3::ZERO;
        let (order, ends) = self.sorted(&pencils, points, pushing);
        for at_once in ends.chunk_by(|a, b| pencils.layer(a.0) == pencils.layer(b.0)) {
            let mut tasks: Vec<Spread<'_, T>> = at_once
                .iter()
                .map(|(pencil, points)| {
                    let near = pencils.near(*pencil);
                    Spread { points: &order[points.clone()], near, pushed: self.take(near) }
                })
                .collect();
            let grid = &*self;
            tasks.par_iter_mut().for_each(|task| spread_points(grid, points, forces, &shares, task));
            for (slot, pushed) in tasks.into_iter().flat_map(|task| task.pushed) {
                if slot > OUTSIDE as usize {
                    self.immersed.pushes[slot] = pushed;
                }
            }
        }
        self.immersed.pencils = Some(pencils);
        self.immersed.shares = shares;
    }

    /// The points in the order of their blocks, and for each pencil those of its own among them.
    fn sorted(
        &self,
        pencils: &Pencils,
        points: &[DVec3],
        asks: impl Fn(usize) -> bool + Sync,
    ) -> (Vec<u32>, Vec<(usize, Range<usize>)>) {
        let topology = &self.topology;
        let none = u32::MAX;
        let place = |n: usize| {
            let block = |a: usize| home(topology, a, first(topology, a, points[n][a]).0);
            if asks(n) { pencils.place(by_axis(block)) as u32 } else { none }
        };
        let places: Vec<u32> = (0..points.len()).into_par_iter().with_min_len(CHUNK).map(place).collect();
        let mut ends = vec![0u32; pencils.places() + 1];
        for &place in places.iter().filter(|place| **place != none) {
            ends[place as usize + 1] += 1;
        }
        for n in 1..ends.len() {
            ends[n] += ends[n - 1];
        }
        let length = pencils.number[pencils.along];
        let ranges = (0..pencils.places() / length)
            .map(|n| (n, ends[n * length] as usize..ends[(n + 1) * length] as usize))
            .filter(|(_, points)| !points.is_empty())
            .collect();
        let mut order = vec![0u32; ends[ends.len() - 1] as usize];
        for (n, &place) in places.iter().enumerate().filter(|(_, place)| **place != none) {
            order[ends[place as usize] as usize] = n as u32;
            ends[place as usize] += 1;
        }
        (order, ranges)
    }

    /// Takes the forces on all blocks in reach.
    fn take(&mut self, [x, y, z]: [&[u32]; 3]) -> Vec<(usize, Option<Box<Vectors<T>>>)> {
        let mut taken = Vec::with_capacity(x.len() * y.len() * z.len());
        for (&k, &j) in z.iter().flat_map(|k| y.iter().map(move |j| (k, j))) {
            for &i in x {
                let slot = self.slot_of_block([i, j, k].map(|n| n as usize)) as usize;
                let pushed = if slot > OUTSIDE as usize { self.immersed.pushes[slot].take() } else { None };
                taken.push((slot, pushed));
            }
        }
        taken
    }
}

for_this_processor! {
    /// Spreads the forces from the points of a pencil.
    spread_points = spread_points_here<T: Real>(
        grid: &Grid<T>, points: &[DVec3], forces: &[DVec3], shares: &[T], task: &mut Spread<'_, T>
    )
}

#[inline(always)]
fn spread_points_here<T: Real>(
    grid: &Grid<T>,
    points: &[DVec3],
    forces: &[DVec3],
    shares: &[T],
    task: &mut Spread<'_, T>,
) {
    for n in task.points.iter().map(|n| *n as usize) {
        let force = forces[n] / shares[n].to_f64();
        let force = [force.x, force.y, force.z, 0.0].map(T::from_f64);
        let around = Around::<T>::new(&grid.topology, points[n]);
        let (seen, near, pushed) = (&grid.immersed.seen, task.near, &mut task.pushed);
        let counts = [near[0].len(), near[1].len()];
        let among = |[x, y, z]: [usize; 3]| x + counts[0] * (y + counts[1] * z);
        if let Some((first, _)) = around.corner() {
            let places = [0, 1, 2].map(|a| [0, 1].map(|next| place(near[a], first[a] + next)));
            let places: [usize; 8] =
                std::array::from_fn(|n| among([places[0][n & 1], places[1][n >> 1 & 1], places[2][n >> 2]]));
            let seen: [Option<&Vectors<T>>; 8] =
                places.map(|place| pushed.get(place).and_then(|(slot, _)| seen[*slot].as_deref()));
            let force = T::Four::read(&force);
            around.each_four(|block, row, first, weights, of_row| {
                let found = pushed.get_mut(places[block & 7]);
                let (Some(seen), Some((_, Some(push)))) = (seen[block & 7], found) else { return };
                let (seen, push) = (seen.row(row), push.row_mut(row));
                let force = force * T::Four::splat(of_row);
                for (k, weight) in weights.iter().enumerate() {
                    let k = (first + k) & (LANES - 1);
                    let more = force * (*weight * T::Four::splat(seen[k][3]));
                    (T::Four::read(&push[k]) + more).write(&mut push[k]);
                }
            });
        } else {
            around.each_cell(
                &grid.topology,
                |block| among(by_axis(|a| place(near[a], block[a]))),
                |found, row, k, weight, mirrors| {
                    if let Some((slot, Some(push))) = pushed.get_mut(found)
                        && let Some(seen) = &seen[*slot]
                    {
                        let k = k & (LANES - 1);
                        let weight = weight * seen.row(row)[k][3];
                        let cell = &mut push.row_mut(row)[k];
                        let more = T::Four::read(&mirrored(force, mirrors)) * T::Four::splat(weight);
                        (T::Four::read(cell) + more).write(cell);
                    }
                },
            );
        }
    }
}
