//! Points in the order of their windows, and their forces on the cells.
//!
//! Points in different windows may push the same cell. So that it always gets the same sum, windows are taken pencil by pencil, and pencils that
//! reach the same cells one after the other: layer by layer, and within a layer each pencil has a colour,
//! and only those of one colour are worked on at once. What a layer reads and writes stays in the caches from one colour to the next.

use std::ops::Range;

use rayon::prelude::*;
use tremie_numerics::DVec3;
use tremie_suspension::Push;

use crate::carrier::CHUNK;
use crate::delta::first;
use crate::grid::Grid;
use crate::immersed::Pushed;
use crate::processor::for_this_processor;
use crate::real::{Real, by_axis};
use crate::topology::{OUTSIDE, Topology};
use crate::window::{Asked, Placed, Span, Window};

/// The windows of a domain, in pencils: along the second longest axis, beside each other along the longest, in layers along the shortest.
#[derive(Debug, Clone)]
pub(crate) struct Windows {
    along: usize,
    across: usize,
    layers: usize,
    /// The windows along each axis.
    spans: [Vec<Span>; 3],
    /// For each pencil of a layer a colour, such that those of one colour reach into no block together.
    colour: Vec<usize>,
    /// Number of colours.
    colours: usize,
    /// All blocks along a pencil.
    line: Vec<usize>,
}

impl Windows {
    fn new(topology: &Topology) -> Self {
        let [layers, across, along] = order_of_axes(topology);
        let spans =
            [0, 1, 2].map(|a| (0..topology.blocks[a] + 2).map(|n| Span::new(topology, a, n)).collect());
        let mut windows = Self {
            along,
            across,
            layers,
            spans,
            colour: Vec::new(),
            colours: 0,
            line: (0..topology.blocks[along]).collect(),
        };
        let beside = &windows.spans[across];
        for (n, own) in beside.iter().enumerate() {
            let meets = |m: usize| beside[m].blocks.iter().any(|block| own.blocks.contains(block));
            let taken: Vec<usize> = (0..n).filter(|m| meets(*m)).map(|m| windows.colour[m]).collect();
            let colour = (0..=n).find(|colour| !taken.contains(colour)).unwrap_or(n);
            windows.colour.push(colour);
            windows.colours = windows.colours.max(colour + 1);
        }
        windows
    }

    /// Place of the window in the order of all that has these numbers along the axes.
    fn place(&self, window: [usize; 3]) -> usize {
        let [layer, across, along] = [self.layers, self.across, self.along].map(|a| window[a]);
        let pencil = (layer * self.colours + self.colour[across]) * self.colour.len() + across;
        pencil * self.spans[self.along].len() + along
    }

    /// Number of these places.
    fn places(&self) -> usize {
        self.spans.iter().map(Vec::len).product::<usize>() * self.colours
    }

    /// Where the cells of a window are.
    pub(crate) fn spans(&self, place: usize) -> [&Span; 3] {
        let pencil = self.pencil(place);
        let (layer, across) = (self.layer(pencil) / self.colours, pencil % self.colour.len());
        let number = |a: usize| match a {
            a if a == self.along => place % self.spans[a].len(),
            a if a == self.across => across,
            _ => layer,
        };
        [0, 1, 2].map(|a| &self.spans[a][number(a)])
    }

    /// The pencil of a window.
    pub(crate) fn pencil(&self, place: usize) -> usize {
        place / self.spans[self.along].len()
    }

    /// What pencils that are worked on at once have in common: the layer and the colour.
    fn layer(&self, pencil: usize) -> usize {
        pencil / self.colour.len()
    }

    /// The blocks that the points of a pencil reach into, along each axis, by one of its windows.
    fn near(&self, place: usize) -> [&[usize]; 3] {
        let mut near = self.spans(place).map(|span| span.blocks.as_slice());
        near[self.along] = &self.line;
        near
    }
}

/// The axes in the order in which windows are taken, the outermost first.
pub(crate) fn order_of_axes(topology: &Topology) -> [usize; 3] {
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|a| std::cmp::Reverse(topology.blocks[*a]));
    let [across, along, layers] = axes;
    [layers, across, along]
}

/// Points in the order of their windows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sorted<T> {
    /// The points.
    order: Vec<u32>,
    /// Where in this order each of them is.
    pub(crate) rank: Vec<u32>,
    /// The windows that have any, by their places, and which they are.
    pub(crate) windows: Vec<(usize, Range<usize>)>,
    /// In the order of the points themselves, the place of the window of each.
    places: Vec<u32>,
    /// Where each lies in its window: copied together first, since to wait for one after the other would take as long as all else.
    pub(crate) points: Vec<Placed<T>>,
    /// Force and friction of each over what is seen around it, in the same order and for the same reason.
    pushing: Vec<[T; 4]>,
}

impl<T: Real> Sorted<T> {
    fn sort(&mut self, windows: &Windows, topology: &Topology, points: &[DVec3]) {
        let Self { order, rank, windows: ranges, places, .. } = self;
        let place = |at: &DVec3| windows.place(by_axis(|a| Span::of(first(topology, a, at[a]).0))) as u32;
        points.par_iter().with_min_len(CHUNK).map(place).collect_into_vec(places);
        let mut ends = vec![0u32; windows.places() + 1];
        for &place in places.iter() {
            ends[place as usize + 1] += 1;
        }
        ranges.clear();
        for n in 1..ends.len() {
            let number = ends[n];
            ends[n] += ends[n - 1];
            if number > 0 {
                ranges.push((n - 1, ends[n - 1] as usize..ends[n] as usize));
            }
        }
        order.resize(points.len(), 0);
        rank.resize(points.len(), 0);
        for (n, (&place, rank)) in places.iter().zip(rank).enumerate() {
            let next = &mut ends[place as usize];
            *rank = *next;
            order[*next as usize] = n as u32;
            *next += 1;
        }
        let placed = |n: &u32| Placed::new(topology, points[*n as usize]);
        order.par_iter().with_min_len(CHUNK).map(placed).collect_into_vec(&mut self.points);
    }

    /// Takes forces and frictions from the points, in these units, `sums` saying what is seen around each in their order.
    fn take(&mut self, pushes: &[Push], force_unit: f64, friction_unit: f64, sums: &[[T; 4]]) {
        let pushing = |(n, sum): (&u32, &[T; 4])| {
            if sum[3] == T::ZERO {
                return [T::ZERO; 4];
            }
            let Push { force, friction } = pushes[*n as usize];
            let (force, seen) = (force / force_unit, sum[3].to_f64());
            [force.x, force.y, force.z, friction / friction_unit].map(|of| T::from_f64(of / seen))
        };
        let both = (self.order.par_iter(), sums.par_iter()).into_par_iter();
        both.with_min_len(CHUNK).map(pushing).collect_into_vec(&mut self.pushing);
    }
}

/// The windows of a pencil whose forces are spread, and the forces on the blocks they reach into.
struct Spread<'a, T> {
    /// The windows, and which points they have.
    windows: &'a [(usize, Range<usize>)],
    /// Coordinates of the blocks in reach along each axis.
    near: [&'a [usize]; 3],
    /// The slot of each of them and the forces on it, x fastest.
    pushed: Vec<Pushed<T>>,
}

impl<T: Real> Grid<T> {
    /// Sorts points, in cells from the domain's lower corner, by their windows.
    pub(crate) fn sort(&mut self, points: &[DVec3]) {
        let topology = &self.topology;
        let windows = self.immersed.windows.get_or_insert_with(|| Windows::new(topology));
        self.immersed.sorted.sort(windows, topology, points);
    }

    /// Spreads force and friction from each point that was asked for last, the lattice's units of both being so much.
    pub(crate) fn push_at(&mut self, pushes: &[Push], force_unit: f64, friction_unit: f64) {
        self.immersed.pushes.par_iter_mut().flatten().for_each(|push| **push = bytemuck::Zeroable::zeroed());
        let Some(windows) = self.immersed.windows.take() else { return };
        let mut sorted = std::mem::take(&mut self.immersed.sorted);
        sorted.take(pushes, force_unit, friction_unit, &self.immersed.sums);
        let pencils: Vec<_> =
            sorted.windows.chunk_by(|a, b| windows.pencil(a.0) == windows.pencil(b.0)).collect();
        let layer = |pencil: &[(usize, Range<usize>)]| windows.layer(windows.pencil(pencil[0].0));
        for at_once in pencils.chunk_by(|a, b| layer(a) == layer(b)) {
            let task = |pencil: &&'_ [(usize, Range<usize>)]| {
                let near = windows.near(pencil[0].0);
                (near, self.take(near))
            };
            let taken: Vec<_> = at_once.iter().map(task).collect();
            let tasks = at_once.iter().zip(taken);
            let mut tasks: Vec<Spread<'_, T>> =
                tasks.map(|(windows, (near, pushed))| Spread { windows, near, pushed }).collect();
            let grid = &*self;
            tasks.par_iter_mut().for_each_init(Window::new, |window, task| {
                spread_points(grid, &windows, &sorted, window, task);
            });
            for (slot, pushed) in tasks.into_iter().flat_map(|task| task.pushed) {
                if slot > OUTSIDE as usize {
                    self.immersed.pushes[slot] = pushed;
                }
            }
        }
        self.immersed.windows = Some(windows);
        self.immersed.sorted = sorted;
    }

    /// Takes the forces on all blocks in reach.
    fn take(&mut self, [x, y, z]: [&[usize]; 3]) -> Vec<Pushed<T>> {
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
}

for_this_processor! {
    /// Spreads the forces from the points of a pencil.
    spread_points = spread_points_here<T: Real>(
        grid: &Grid<T>,
        windows: &Windows,
        sorted: &Sorted<T>,
        window: &mut Window<T>,
        task: &mut Spread<'_, T>
    )
}

#[inline(always)]
fn spread_points_here<T: Real>(
    grid: &Grid<T>,
    windows: &Windows,
    sorted: &Sorted<T>,
    window: &mut Window<T>,
    task: &mut Spread<'_, T>,
) {
    let seen = &grid.immersed.seen;
    for (place, range) in task.windows {
        let (points, pushing) = (&sorted.points[range.clone()], &sorted.pushing[range.clone()]);
        let (spans, near) = (windows.spans(*place), task.near);
        // Where each block of the window is among those in reach.
        let place = |[x, y, z]: [usize; 3]| {
            let among = |a: usize, which: usize| {
                let block = spans[a].blocks[which];
                near[a].iter().position(|near| *near == block).unwrap_or(0)
            };
            among(0, x) + near[0].len() * (among(1, y) + near[1].len() * among(2, z))
        };
        window.clear();
        for (point, force) in points.iter().zip(pushing) {
            if *force != [T::ZERO; 4] {
                window.add(point, *force);
            }
        }
        window.give(spans, &Asked::by(points), seen, &mut task.pushed, place);
    }
}
