//! One step of the blocks: populations move along their velocities, meet walls and air, and collide.
//!
//! A step reads the populations that the last one left (`front`) and writes new ones (`back`). For every cell, the
//! population moving along c comes from the cell at -c:
//!
//! - from fluid, as it is;
//! - from solid, the cell's own opposite population returns (half-way bounce-back, no slip), with `6 w rho c.u` added
//!   from a moving wall;
//! - from air, what the gas pressure and the surface's velocity ask for (Svec 2013, Eq. 2.16, after Koerner et al. 2005):
//!   `f_eq(rho_gas, u) + f_eq_opposite(rho_gas, u) - f_opposite`. Only these missing populations are made up.
//!
//! What an interface cell gains is told by `transport`.
//!
//! Bulk rows skip all of this. Rows are worked on a few at a time in a buffer that stays in the first cache, in loops
//! over lanes that the compiler turns into vector instructions; whatever differs between the lanes of a row is a choice
//! by a bit, not a branch.

use rayon::prelude::*;

use crate::collision::{COMPONENT, Moments, collide, moments};
use crate::grid::{FILL, Field, Grid, Kinds, Shape, VELOCITY};
use crate::lanes::LANES;
use crate::lattice::{C, Q, W, each_pair, opposite};
use crate::plane::reconstruct;
use crate::real::Real;
use crate::relaxation::Relaxation;
use crate::rows::{BulkRow, Rows, SurfaceRow};
use crate::source::{Source, Surroundings};
use crate::topology::{CELLS, ROWS};
use crate::transport::gains;
use crate::wall::{FACES, SLANTED, tangents, wall_velocity};

/// Rows worked on at a time.
const BATCH_ROWS: usize = 4;
/// Cells worked on at a time.
const BATCH: usize = BATCH_ROWS * LANES;

/// Fill above which an interface cell becomes liquid, and below which it becomes air.
const FULL: f64 = 1.01;
const EMPTY: f64 = -0.01;
/// The same for cells that are this near to full or empty and on their way there, fast enough to arrive within so many
/// steps. (What leaves a cell by its plane never takes it beyond full or empty, so that it might come to neither limit.)
const NEAR: f64 = 0.005;
const SOON: f64 = 100.0;
/// The same for cells that have no air, or no liquid, beside them. (One with neither air nor interface, a bubble of one
/// cell, closes at any fill.)
const FULL_INSIDE: f64 = 0.9;
const EMPTY_OUTSIDE: f64 = 0.1;

/// Densities between which a cell counts as sound.
const SOUND: [f64; 2] = [0.5, 2.0];

/// What drives the fluid and resists, in lattice units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Physics<T, R> {
    /// Acceleration.
    pub(crate) gravity: [T; 3],
    /// Flow curve.
    pub(crate) law: R,
}

/// What a step found in a block.
#[derive(Debug, Clone)]
pub(crate) struct Findings {
    /// Interface cells that want to become liquid, by row.
    pub(crate) full: [u8; ROWS],
    /// Interface cells that want to become air, by row.
    pub(crate) empty: [u8; ROWS],
    /// Whether there are any of these.
    pub(crate) any: bool,
    /// A cell whose density is out of all bounds or not a number.
    pub(crate) broken: Option<usize>,
}

impl Default for Findings {
    fn default() -> Self {
        Self { full: [0; ROWS], empty: [0; ROWS], any: false, broken: None }
    }
}

/// A few rows on their way through a step.
struct Batch<T> {
    /// Populations, by velocity and lane.
    f: [[T; BATCH]; Q],
    /// Mass of interface cells, infinite in all others.
    mass: [T; BATCH],
    /// Mass that interface cells gain in this step.
    gain: [f64; BATCH],
    density: [T; BATCH],
}

impl<T: Real> Batch<T> {
    fn new() -> Self {
        Self {
            f: [[T::ZERO; BATCH]; Q],
            mass: [T::INFINITY; BATCH],
            gain: [0.0; BATCH],
            density: [T::ONE; BATCH],
        }
    }
}

/// `a` in lanes whose bit is set, `b` in the others.
#[inline(always)]
fn choose<T>(bits: u8, lane: usize, a: T, b: T) -> T {
    if bits & (1 << lane) != 0 { a } else { b }
}

impl<'a, T: Real> Source<'a, T> {
    /// Makes up what should come from the air.
    #[inline(always)]
    fn meet_air(
        &self,
        around: &SurfaceRow,
        surface: &Surroundings<'_, T>,
        f: &mut [[T; BATCH]; Q],
        at: usize,
    ) {
        let (own, first) = (self.own, (usize::from(around.row) & (ROWS - 1)) * LANES);
        // The gas has density 1 and moves with the fluid.
        let u: [[T; LANES]; 3] =
            std::array::from_fn(|axis| std::array::from_fn(|k| surface.own[VELOCITY + axis][first + k]));
        let square: [T; LANES] = std::array::from_fn(|k| {
            T::from_f64(1.5) * (u[0][k] * u[0][k] + u[1][k] * u[1][k] + u[2][k] * u[2][k])
        });
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            let (from_a, from_b) = (around.missing[a], around.missing[b]);
            if from_a | from_b != 0 {
                let c = const { C[2 * P + 1] };
                for k in 0..LANES {
                    let mut along = T::ZERO;
                    for axis in 0..3 {
                        match c[axis] {
                            0 => {}
                            1 => along += u[axis][k],
                            _ => along -= u[axis][k],
                        }
                    }
                    let both = T::from_f64(2.0 * W[a]) * (T::from_f64(4.5) * along * along - square[k]);
                    f[a][at + k] = choose(from_a, k, both - own[b][first + k], f[a][at + k]);
                    f[b][at + k] = choose(from_b, k, both - own[a][first + k], f[b][at + k]);
                }
            }
        });
    }

    /// Sends back what would go into walls.
    #[inline(always)]
    fn meet_walls(&self, around: &SurfaceRow, f: &mut [[T; BATCH]; Q], at: usize) {
        let (own, first) = (self.own, (usize::from(around.row) & (ROWS - 1)) * LANES);
        for i in 1..Q {
            let solid = around.solid[i];
            if solid == 0 {
                continue;
            }
            for k in 0..LANES {
                f[i][at + k] = choose(solid, k, own[opposite(i)][first + k], f[i][at + k]);
            }
            if self.topology.moving_walls() {
                self.drag(first, i, solid, &mut f[i][at..at + LANES]);
            }
        }
    }

    /// Lets the half-cells at flat walls yield by their own stress (module `wall`).
    ///
    /// All lanes of the batch are worked on, whether they are at the wall or not: that is one vector loop.
    #[inline(always)]
    fn yield_at_walls<R: Relaxation<T>>(
        &self,
        rows: &[SurfaceRow],
        physics: &Physics<T, R>,
        batch: &mut Batch<T>,
    ) {
        for face in 0..FACES.len() {
            if rows.iter().all(|row| row.flat[face] == 0) {
                continue;
            }
            let (axis, normal) = FACES[face];
            let [[a, b], [c, d]] = SLANTED[face];
            let mut sent = [[T::ZERO; BATCH]; 4];
            let mut weight = [T::ZERO; BATCH];
            for (n, row) in rows.iter().enumerate() {
                let (at, first) = (n * LANES, (usize::from(row.row) & (ROWS - 1)) * LANES);
                for (sent, i) in sent.iter_mut().zip([a, b, c, d]) {
                    sent[at..at + LANES].copy_from_slice(&self.own[opposite(i)][first..first + LANES]);
                }
                for k in 0..LANES {
                    weight[at + k] = choose(row.flat[face], k, T::from_f64(1.0 / 6.0), T::ZERO);
                }
            }
            let shear = tangents(axis).map(|t| COMPONENT[axis][t]);
            let normal = T::from_f64(f64::from(normal));
            for k in 0..BATCH {
                let f: [T; Q] = std::array::from_fn(|i| batch.f[i][k]);
                let m = moments(&f, batch.mass[k], physics.gravity);
                let stress = shear.map(|n| -normal * m.stress[n]);
                // Momentum that the wall takes along the two tangents.
                let traction = [
                    batch.f[b][k] + sent[1][k] - batch.f[a][k] - sent[0][k],
                    batch.f[d][k] + sent[3][k] - batch.f[c][k] - sent[2][k],
                ];
                let push = wall_velocity(&m, stress, traction, &physics.law).map(|v| weight[k] * v);
                batch.f[a][k] += push[0];
                batch.f[b][k] -= push[0];
                batch.f[c][k] += push[1];
                batch.f[d][k] -= push[1];
            }
        }
    }

    /// Momentum from moving walls: `6 w rho c.u` with rho = 1 (Ladd 1994).
    #[inline(never)]
    fn drag(&self, first: usize, i: usize, solid: u8, f: &mut [T]) {
        for k in (0..LANES).filter(|k| solid >> k & 1 == 1) {
            let u = self.topology.wall_velocity(self.links.coordinates(first + k), C[i].map(|c| -c));
            let along: f64 = (0..3).map(|a| f64::from(C[i][a]) * u[a]).sum();
            f[k] += T::from_f64(6.0 * W[i] * along);
        }
    }

    /// Fills a batch with bulk rows, ready to collide.
    #[inline(always)]
    fn load_bulk(&self, rows: &[BulkRow], batch: &mut Batch<T>) {
        for (n, row) in rows.iter().enumerate() {
            self.arrive(&row.beside, &mut batch.f, n * LANES);
        }
        batch.mass = [T::INFINITY; BATCH];
    }

    /// Fills a batch with surface rows, ready to collide.
    #[inline(always)]
    fn load_surface<R: Relaxation<T>>(
        &self,
        surface: &Surroundings<'_, T>,
        rows: &[SurfaceRow],
        physics: &Physics<T, R>,
        batch: &mut Batch<T>,
        mass: &mut [f64; CELLS],
    ) {
        for (n, row) in rows.iter().enumerate() {
            self.arrive(&row.beside, &mut batch.f, n * LANES);
        }
        for (n, row) in rows.iter().enumerate() {
            let at = n * LANES;
            if row.kinds.interface != 0 {
                let first = (usize::from(row.row) & (ROWS - 1)) * LANES;
                let gains = gains(self, surface, row, &batch.f, at);
                for k in 0..LANES {
                    mass[first + k] += gains[k];
                }
                batch.gain[at..at + LANES].copy_from_slice(&gains);
                if row.any_air | row.any_interface != 0 {
                    self.meet_air(row, surface, &mut batch.f, at);
                }
            }
            if row.any_solid != 0 {
                self.meet_walls(row, &mut batch.f, at);
            }
            let wet = row.kinds.wet();
            if wet != 0xff {
                for i in 0..Q {
                    for k in 0..LANES {
                        batch.f[i][at + k] = choose(wet, k, batch.f[i][at + k], T::ZERO);
                    }
                }
            }
            let first = (usize::from(row.row) & (ROWS - 1)) * LANES;
            for k in 0..LANES {
                let held = T::from_f64(mass[first + k]);
                batch.mass[at + k] = choose(row.kinds.interface, k, held, T::INFINITY);
            }
        }
        if !physics.law.is_newtonian() {
            self.yield_at_walls(rows, physics, batch);
        }
    }
}

/// Collides all lanes of a batch.
#[inline(always)]
fn collide_batch<T: Real, R: Relaxation<T>>(physics: &Physics<T, R>, batch: &mut Batch<T>) {
    for k in 0..BATCH {
        let f: [T; Q] = std::array::from_fn(|i| batch.f[i][k]);
        let (post, density) = collide(&f, batch.mass[k], physics.gravity, &physics.law);
        for i in 0..Q {
            batch.f[i][k] = post[i];
        }
        batch.density[k] = density;
    }
}

/// Writes a row of a batch back, and notes a cell that is no longer sound.
#[inline(always)]
fn store<T: Real>(batch: &Batch<T>, at: usize, row: u8, back: &mut Field<T>, findings: &mut Findings) {
    let first = (usize::from(row) & (ROWS - 1)) * LANES;
    for i in 0..Q {
        back[i][first..first + LANES].copy_from_slice(&batch.f[i][at..at + LANES]);
    }
    let [low, high] = SOUND.map(T::from_f64);
    let mut unsound = 0u8;
    for k in 0..LANES {
        let density = batch.density[at + k];
        unsound |= u8::from(!(density > low && density < high)) << k;
    }
    if unsound != 0 {
        findings.broken.get_or_insert(first + unsound.trailing_zeros() as usize);
    }
}

/// New fill of the interface cells of a row, and which of them want to become liquid or air.
#[inline(always)]
fn judge<T: Real>(
    around: &SurfaceRow,
    batch: &Batch<T>,
    at: usize,
    mass: &[f64; CELLS],
    back: &mut Field<T>,
    findings: &mut Findings,
) {
    let row = usize::from(around.row) & (ROWS - 1);
    let first = row * LANES;
    let interface = around.kinds.interface;
    let (mut fill, mut rising, mut falling) = ([0.0; LANES], 0u8, 0u8);
    for k in 0..LANES {
        fill[k] = mass[first + k] / batch.density[at + k].to_f64();
        let other = choose(around.kinds.liquid, k, T::ONE, T::ZERO);
        back[FILL][first + k] = choose(interface, k, T::from_f64(fill[k]), other);
        let gain = batch.gain[at + k];
        rising |= u8::from(fill[k] > 1.0 - NEAR && gain > NEAR / SOON) << k;
        falling |= u8::from(fill[k] < NEAR && gain < -NEAR / SOON) << k;
    }
    let below = |limit: f64| (0..LANES).fold(0, |bits, k| bits | u8::from(fill[k] < limit) << k);
    let above = |limit: f64| (0..LANES).fold(0, |bits, k| bits | u8::from(fill[k] > limit) << k);
    let closed = !(around.any_air | around.any_interface);
    let full = (above(FULL) | rising | above(FULL_INSIDE) & !around.any_air | closed) & interface;
    let empty = (below(EMPTY) | falling | below(EMPTY_OUTSIDE) & !around.any_liquid) & interface & !full;
    findings.full[row] = full;
    findings.empty[row] = empty;
    findings.any |= full | empty != 0;
}

/// One step of one block.
#[inline(always)]
fn step_block<T: Real, R: Relaxation<T>>(
    source: &Source<'_, T>,
    surface: &Surroundings<'_, T>,
    rows: &Rows,
    physics: &Physics<T, R>,
    back: &mut Field<T>,
    mass: &mut [f64; CELLS],
    findings: &mut Findings,
) {
    let mut batch = Batch::new();
    for rows in rows.bulk.chunks(BATCH_ROWS) {
        source.load_bulk(rows, &mut batch);
        collide_batch(physics, &mut batch);
        for (n, row) in rows.iter().enumerate() {
            store(&batch, n * LANES, row.row, back, findings);
        }
    }
    for rows in rows.surface.chunks(BATCH_ROWS) {
        source.load_surface(surface, rows, physics, &mut batch, mass);
        collide_batch(physics, &mut batch);
        for (n, row) in rows.iter().enumerate() {
            store(&batch, n * LANES, row.row, back, findings);
            if row.kinds.interface != 0 {
                judge(row, &batch, n * LANES, mass, back, findings);
            }
        }
    }
}

/// [`step_block`] compiled for processors with AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn step_block_avx2<T: Real, R: Relaxation<T>>(
    source: &Source<'_, T>,
    surface: &Surroundings<'_, T>,
    rows: &Rows,
    physics: &Physics<T, R>,
    back: &mut Field<T>,
    mass: &mut [f64; CELLS],
    findings: &mut Findings,
) {
    step_block(source, surface, rows, physics, back, mass, findings);
}

/// [`step_block`] for the processor at hand. Both forms give the same bits: the same operations, only wider.
#[allow(unsafe_code)]
fn step_block_here<T: Real, R: Relaxation<T>>(
    source: &Source<'_, T>,
    surface: &Surroundings<'_, T>,
    rows: &Rows,
    physics: &Physics<T, R>,
    back: &mut Field<T>,
    mass: &mut [f64; CELLS],
    findings: &mut Findings,
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor was just asked whether it has AVX2.
        return unsafe { step_block_avx2(source, surface, rows, physics, back, mass, findings) };
    }
    step_block(source, surface, rows, physics, back, mass, findings);
}

/// Finds the surface in all interface cells of a block.
#[inline(always)]
fn reconstruct_block<T: Real>(source: &Source<'_, T>, rows: &Rows, gravity: [T; 3], shape: &mut Shape<T>) {
    for row in rows.surface.iter().filter(|row| row.kinds.interface != 0) {
        reconstruct(source, row, gravity, shape);
    }
}

/// [`reconstruct_block`] compiled for processors with AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn reconstruct_avx2<T: Real>(source: &Source<'_, T>, rows: &Rows, gravity: [T; 3], shape: &mut Shape<T>) {
    reconstruct_block(source, rows, gravity, shape);
}

/// [`reconstruct_block`] for the processor at hand, with the same bits.
#[allow(unsafe_code)]
fn reconstruct_here<T: Real>(source: &Source<'_, T>, rows: &Rows, gravity: [T; 3], shape: &mut Shape<T>) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor was just asked whether it has AVX2.
        return unsafe { reconstruct_avx2(source, rows, gravity, shape) };
    }
    reconstruct_block(source, rows, gravity, shape);
}

impl<T: Real> Grid<T> {
    /// Streams and collides all blocks once. The new populations are in `front` afterwards.
    pub(crate) fn step<R: Relaxation<T>>(
        &mut self,
        rows: &[Rows],
        physics: &Physics<T, R>,
        findings: &mut Vec<Findings>,
    ) {
        findings.resize(self.len(), Findings::default());
        let Self { topology, links, front, back, shape, mass, .. } = self;
        (back.par_iter_mut(), mass.par_iter_mut(), findings.par_iter_mut(), rows.par_iter())
            .into_par_iter()
            .enumerate()
            .skip(2)
            .for_each(|(slot, (back, mass, findings, rows))| {
                if findings.any {
                    *findings = Findings::default();
                }
                if !rows.is_empty() {
                    let source = Source::new(topology, &links[slot], front, slot);
                    let surface = Surroundings::new(&links[slot], shape, slot);
                    step_block_here(&source, &surface, rows, physics, back, mass, findings);
                }
            });
        std::mem::swap(&mut self.front, &mut self.back);
    }

    /// Finds the shape of the surface, after cells have changed and before the next step.
    pub(crate) fn reconstruct(&mut self, rows: &[Rows], gravity: [T; 3]) {
        let Self { topology, links, front, shape, .. } = self;
        (shape.par_iter_mut(), rows.par_iter()).into_par_iter().enumerate().skip(2).for_each(
            |(slot, (shape, rows))| {
                if rows.surface.iter().any(|row| row.kinds.interface != 0) {
                    let source = Source::new(topology, &links[slot], front, slot);
                    reconstruct_here(&source, rows, gravity, shape);
                }
            },
        );
    }

    /// The moments of every wet cell of a block, as the next collision will see them.
    pub(crate) fn moments<R: Relaxation<T>>(
        &self,
        slot: usize,
        rows: &Rows,
        physics: &Physics<T, R>,
        mut see: impl FnMut(usize, &Moments<T>),
    ) {
        let Self { topology, links, front, shape, .. } = self;
        let source = Source::new(topology, &links[slot], front, slot);
        let surface = Surroundings::new(&links[slot], shape, slot);
        let mut mass = self.mass[slot].clone();
        let mut batch = Batch::new();
        let mut show = |batch: &Batch<T>, n: usize, row: u8, kinds: Kinds| {
            for k in (0..LANES).filter(|k| kinds.wet() >> k & 1 == 1) {
                let f: [T; Q] = std::array::from_fn(|i| batch.f[i][n * LANES + k]);
                see(usize::from(row) * LANES + k, &moments(&f, batch.mass[n * LANES + k], physics.gravity));
            }
        };
        for rows in rows.bulk.chunks(BATCH_ROWS) {
            source.load_bulk(rows, &mut batch);
            for (n, row) in rows.iter().enumerate() {
                show(&batch, n, row.row, self.kinds[slot][usize::from(row.row)]);
            }
        }
        for rows in rows.surface.chunks(BATCH_ROWS) {
            source.load_surface(&surface, rows, physics, &mut batch, &mut mass);
            for (n, row) in rows.iter().enumerate() {
                show(&batch, n, row.row, row.kinds);
            }
        }
    }
}
