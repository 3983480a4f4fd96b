//! Cages: regions in which bars too thin for the cells hold the fluid up by their drag (`tremie_rheology::bars`).
//!
//! The cells of a cage are full of fluid; the volume of its bars is left out. The force F on the mass that a cell holds is that of the same step's
//! velocity u, which is the superficial velocity of the law:
//!
//! ```text
//!     rho u = m + F/2,    F = -D(|u|) u/|u|,    D = phi sum over layers of s ((1 - a a) X (1 - a a) + along a a)
//! ```
//!
//! with m the momentum that arrives and half of all other forces, phi the share of the cell that is filled and s that which lies in the cage, a the
//! direction of a layer's bars and X, `along` their drag at the speed |u|. X is diagonal: along an axis of the lattice it is the drag across bars of many rows where the cage goes on
//! by a spacing of its bars on both sides of the cell, of a row by itself where it does on neither, and the mean where it ends on one. So `|(rho w + D(w)/2)^-1 m| = 1` for w = |u|. The left side falls as w
//! grows, and there is one root; or none, where m is within half of the limit load D(0) and the bars hold it: then F = -2 m, and the fluid is at rest without any
//! creep.
//!
//! Drags are kept as tables, linear between speeds of which there are so many to each factor of two. A thixotropic fluid is a Bingham fluid with another yield
//! stress in each cell, and the drag is homogeneous in stresses: `D(w; (1 + lambda) tau0) = (1 + lambda) D(w/(1 + lambda); tau0)`.

use tremie_case::{Cage, Case, Domain, Layer};
use tremie_geometry::{Body, share};
use tremie_numerics::{DMat3, DVec3};
use tremie_rheology::FlowCurve;

use crate::scaling::Scaling;
use crate::topology::{CELLS, EDGE, Links, ROWS};

/// Turns at most in which a speed is looked for, and how near it must come, as a share.
const TURNS: usize = 60;
const NEAR: f64 = 1e-10;

/// Powers of two from which and up to which there are drags, and steps in each.
const POWERS: [i32; 2] = [-50, 2];
const STEPS: usize = 1 << STEP_BITS;
const STEP_BITS: u32 = 5;
/// Bits of a number behind those that tell its step.
const REST: u32 = 52 - STEP_BITS;

/// Drags of a layer by the speed ([`BarGrid::drag`](tremie_rheology::bars::BarGrid::drag)), in lattice units.
#[derive(Debug, Clone)]
struct Drag(Vec<[f64; 3]>);

impl Drag {
    fn new(layer: &Layer, curve: &FlowCurve, scaling: &Scaling) -> Self {
        let unit = scaling.acceleration(1.0) / scaling.density;
        let at = |speed: f64| layer.grid.drag(curve, speed * scaling.velocity_unit()).map(|drag| drag * unit);
        let steps = (POWERS[1] - POWERS[0]) as usize * STEPS;
        let speed =
            |n: usize| 2f64.powi(POWERS[0] + (n / STEPS) as i32) * (1.0 + (n % STEPS) as f64 / STEPS as f64);
        Self([0.0].into_iter().chain((0..=steps).map(speed)).map(at).collect())
    }

    /// Drags at a speed, and their slopes there.
    #[inline]
    fn at(&self, speed: f64) -> [[f64; 3]; 2] {
        let first = 2f64.powi(POWERS[0]);
        let place = |n: usize| f64::from_bits(((first.to_bits() >> REST) + n as u64) << REST);
        let (n, from, to) = if speed < first {
            (0, 0.0, first)
        } else {
            let n = ((speed.to_bits() >> REST) - (first.to_bits() >> REST)) as usize;
            let n = n.min(self.0.len() - 3);
            (n + 1, place(n), place(n + 1))
        };
        let (low, high) = (self.0[n], self.0[n + 1]);
        let slopes = [0, 1, 2].map(|a| (high[a] - low[a]) / (to - from));
        [[0, 1, 2].map(|a| low[a] + (speed - from) * slopes[a]), slopes]
    }
}

/// The part of a cage that lies in a block.
#[derive(Debug, Clone)]
struct Part {
    /// Number of the cage in the case.
    cage: usize,
    /// Share of each cell that lies in it.
    share: Box<[f64; CELLS]>,
    /// For each layer how far its rows are by themselves in each cell, from 0 to 1, along the axes.
    single: Vec<Box<[DVec3; CELLS]>>,
}

/// The cages of a case.
#[derive(Debug, Clone)]
pub(crate) struct Cages {
    cages: Vec<Cage>,
    curve: FlowCurve,
    /// Of each cage, of each layer.
    drags: Vec<Vec<Drag>>,
    domain: Domain,
    /// Size of a cell in m.
    size: f64,
    /// By slot.
    blocks: Vec<Vec<Part>>,
}

/// What arrives in a cell before the bars act on it, in lattice units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrived {
    /// Density.
    pub(crate) density: f64,
    /// Share of the cell that is filled.
    pub(crate) fill: f64,
    /// Momentum, with half of all other forces.
    pub(crate) momentum: DVec3,
    /// How many times the yield stress of the flow curve its own is.
    pub(crate) growth: f64,
}

impl Cages {
    /// Those of a case, without any blocks.
    pub(crate) fn new(case: &Case, scaling: &Scaling) -> Self {
        let mut new = Self {
            cages: case.cages.clone(),
            curve: case.material.curve,
            drags: Vec::new(),
            domain: case.domain,
            size: scaling.cell_size,
            blocks: Vec::new(),
        };
        new.rescale(scaling);
        new
    }

    /// Without any blocks.
    pub(crate) fn emptied(&self) -> Self {
        Self { blocks: Vec::new(), ..self.clone() }
    }

    /// Goes on with another time step.
    pub(crate) fn rescale(&mut self, scaling: &Scaling) {
        let drag = |layer: &Layer| Drag::new(layer, &self.curve, scaling);
        self.drags = self.cages.iter().map(|cage| cage.layers.iter().map(drag).collect()).collect();
    }

    /// Appends a slot.
    pub(crate) fn push(&mut self) {
        self.blocks.push(Vec::new());
    }

    /// Centre of a cell in m.
    fn centre(&self, links: &Links, cell: usize) -> DVec3 {
        self.domain.min + self.size * (DVec3::from(links.coordinates(cell).map(|n| n as f64)) + 0.5)
    }

    /// Share of a cell, by its centre, that lies in a body.
    fn within(&self, body: &Body, centre: DVec3) -> f64 {
        let distance = body.signed_distance(centre);
        // Half the diagonal of a cell.
        if distance.abs() < 0.867 * self.size {
            share(centre, self.size, |p| body.signed_distance(p))
        } else {
            f64::from(u8::from(distance < 0.0))
        }
    }

    /// How far the rows of a layer are by themselves in the cells of a part, along the axes. (What is divided into several cages with the same bars goes on from one to the next.)
    fn single(&self, layer: &Layer, links: &Links, part: &Part) -> Box<[DVec3; CELLS]> {
        let bodies: Vec<_> =
            self.cages.iter().filter(|cage| cage.layers.contains(layer)).map(|cage| &cage.body).collect();
        let mut single = Box::new([DVec3::ZERO; CELLS]);
        for (cell, value) in single.iter_mut().enumerate().filter(|(cell, _)| part.share[*cell] > 0.0) {
            let goes_on = |way: DVec3| {
                let at = self.domain.image(self.centre(links, cell) + layer.grid.spacing * way);
                bodies.iter().map(|body| self.within(body, at)).sum::<f64>().min(1.0)
            };
            *value = DVec3::from(DVec3::AXES.map(|axis| 1.0 - 0.5 * (goes_on(axis) + goes_on(-axis))));
        }
        single
    }

    /// Finds what lies in a block that has taken a slot.
    pub(crate) fn enter(&mut self, slot: usize, links: &Links) {
        let mut parts = Vec::new();
        let corner = self.centre(links, 0) - 0.5 * self.size;
        for (cage, Cage { body, layers, .. }) in self.cages.iter().enumerate() {
            let (min, max) = body.bounds();
            if max.cmple(corner).any() || min.cmpge(corner + EDGE as f64 * self.size).any() {
                continue;
            }
            let mut part = Part { cage, share: Box::new([0.0; CELLS]), single: Vec::new() };
            for (cell, value) in part.share.iter_mut().enumerate() {
                *value = self.within(body, self.centre(links, cell));
            }
            if part.share.iter().all(|share| *share == 0.0) {
                continue;
            }
            part.single = layers.iter().map(|layer| self.single(layer, links, &part)).collect();
            parts.push(part);
        }
        self.blocks[slot] = parts;
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let of = |part: &Part| size_of::<[f64; CELLS]>() + part.single.len() * size_of::<[DVec3; CELLS]>();
        self.blocks.iter().flatten().map(of).sum()
    }

    /// The cages in a block.
    pub(crate) fn block(&self, slot: usize) -> Block<'_> {
        Block { all: self, parts: &self.blocks[slot] }
    }
}

/// The cages in a block.
#[derive(Clone, Copy)]
pub(crate) struct Block<'a> {
    all: &'a Cages,
    parts: &'a [Part],
}

/// The bars in a cell.
struct Bars<'a> {
    block: &'a Block<'a>,
    cell: usize,
    /// Centre of the cell in m.
    centre: DVec3,
    fill: f64,
    growth: f64,
}

impl Block<'_> {
    /// Largest share of a cell that lies in one of them.
    pub(crate) fn share(&self, cell: usize) -> f64 {
        self.parts.iter().map(|part| part.share[cell]).fold(0.0, f64::max)
    }

    /// Rows of the block that lie in them, a bit each.
    pub(crate) fn rows(&self) -> u64 {
        let caged = |row: &usize| {
            self.parts.iter().any(|part| part.share[row * EDGE..][..EDGE].iter().any(|share| *share > 0.0))
        };
        (0..ROWS).filter(caged).fold(0, |bits, row| bits | 1 << row)
    }

    fn bars(&self, links: &Links, cell: usize, fill: f64, growth: f64) -> Bars<'_> {
        Bars { block: self, cell, centre: self.all.centre(links, cell), fill, growth }
    }

    /// Force of the bars on a cell.
    pub(crate) fn force(&self, links: &Links, cell: usize, arrived: &Arrived) -> DVec3 {
        if arrived.fill == 0.0 {
            return DVec3::ZERO;
        }
        self.bars(links, cell, arrived.fill, arrived.growth).force(arrived)
    }

    /// The parts of a force on a cell, whose fluid has the speed `speed`, that come from each cage, by its number.
    pub(crate) fn parts(
        &self,
        links: &Links,
        cell: usize,
        growth: f64,
        speed: f64,
        force: DVec3,
        mut part: impl FnMut(usize, DVec3),
    ) {
        let within = || self.parts.iter().filter(|part| part.share[cell] > 0.0).map(|part| part.cage);
        if within().count() < 2 {
            return within().for_each(|cage| part(cage, force));
        }
        let bars = self.bars(links, cell, 1.0, growth);
        let of_all = bars.drag(None, speed)[0].inverse() * force;
        for cage in within() {
            part(cage, bars.drag(Some(cage), speed)[0] * of_all);
        }
    }
}

impl Bars<'_> {
    /// D at a speed, and its slope there: of one cage, or of all.
    fn drag(&self, of: Option<usize>, speed: f64) -> [DMat3; 2] {
        let mut sums = [DMat3::ZERO; 2];
        for part in self.block.parts.iter().filter(|part| of.is_none_or(|of| of == part.cage)) {
            let scale = part.share[self.cell] * self.fill;
            if scale == 0.0 {
                continue;
            }
            let layers = &self.block.all.cages[part.cage].layers;
            let drags = &self.block.all.drags[part.cage];
            for ((layer, drag), single) in layers.iter().zip(drags).zip(&part.single) {
                // On the axis of hoops there are none.
                let Some(a) = layer.course.at(self.centre) else { continue };
                let outer = DMat3::from_cols(a * a.x, a * a.y, a * a.z);
                let aside = DMat3::IDENTITY - outer;
                let by_themselves = aside * DMat3::from_diagonal(single[self.cell]) * aside;
                let found = drag.at(speed / self.growth);
                for ((sum, [of_many, alone, along]), scale) in
                    sums.iter_mut().zip(found).zip([scale * self.growth, scale])
                {
                    *sum += (aside * of_many + by_themselves * (alone - of_many) + outer * along) * scale;
                }
            }
        }
        sums
    }

    /// The velocity over the speed, for momentum `arrived` that the bars leave at that speed; one if it is the right one. And its derivative.
    fn velocity(&self, arrived: &Arrived, speed: f64) -> [DVec3; 2] {
        let [drag, slope] = self.drag(None, speed);
        let diagonal = |value: f64| DMat3::from_diagonal(DVec3::splat(value));
        let inverse = (diagonal(arrived.density * speed) + 0.5 * drag).inverse();
        let velocity = inverse * arrived.momentum;
        [velocity, -inverse * ((diagonal(arrived.density) + 0.5 * slope) * velocity)]
    }

    fn force(&self, arrived: &Arrived) -> DVec3 {
        let Arrived { density, momentum, .. } = *arrived;
        let velocity =
            self.speed(arrived).map_or(DVec3::ZERO, |speed| speed * self.velocity(arrived, speed)[0]);
        2.0 * (density * velocity - momentum)
    }

    /// Speed at which the bars leave what has arrived; none if they hold it.
    fn speed(&self, arrived: &Arrived) -> Option<f64> {
        let (mut low, mut high) = (0.0, arrived.momentum.length() / arrived.density);
        let limit = self.drag(None, low)[0];
        let held = limit != DMat3::ZERO && (limit.inverse() * arrived.momentum).length() <= 0.5;
        if high == 0.0 || held {
            return None;
        }
        // Newton's method for 1/length = 1, which is nearly linear; from the end where the slope is sure to be finite.
        let mut speed = high;
        for _ in 0..TURNS {
            let [velocity, slope] = self.velocity(arrived, speed);
            let length = velocity.length();
            let over = 1.0 / length - 1.0;
            if over.abs() < NEAR {
                break;
            }
            (low, high) = if over > 0.0 { (low, speed) } else { (speed, high) };
            let next = speed + over * length.powi(3) / velocity.dot(slope);
            speed = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        Some(speed)
    }
}
