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
//! An interface cell gains over each link the mass `b (f_in - f_out)` (Eq. 2.14), b = 1 towards liquid, the mean fill of
//! the two towards interface, 0 towards air and solid: what one cell gains the other loses, to the bit.
//!
//! Bulk rows skip all of this. Rows are worked on a few at a time in a buffer that stays in the first cache, in loops
//! over lanes that the compiler turns into vector instructions; whatever differs between the lanes of a row is a choice
//! by a bit, not a branch.

use rayon::prelude::*;

use crate::collision::{COMPONENT, Moments, collide, moments};
use crate::grid::{FILL, Field, Grid, Kinds, STRIDE};
use crate::lattice::{C, MIRROR, Q, W, each_pair, opposite};
use crate::real::{Real, larger, smaller};
use crate::relaxation::Relaxation;
use crate::rows::{Beside, BulkRow, Rows, SurfaceRow, upstream};
use crate::topology::{CELLS, EDGE, Links, ROWS, Topology};
use crate::wall::{FACES, SLANTED, tangents, wall_velocity};

/// Lanes of a row.
const LANES: usize = EDGE;
/// Rows worked on at a time.
const BATCH_ROWS: usize = 4;
/// Cells worked on at a time.
const BATCH: usize = BATCH_ROWS * LANES;

/// Fill above which an interface cell becomes liquid, and below which it becomes air.
const FULL: f64 = 1.01;
const EMPTY: f64 = -0.01;
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

/// What a step of one block reads.
#[derive(Clone, Copy)]
struct Source<'a, T: Real> {
    topology: &'a Topology,
    links: &'a Links,
    /// The block's own values.
    own: &'a Field<T>,
    /// The values of the 27 blocks around and with it, in one array each; the last five are never asked for.
    near: [&'a [T; VALUES]; 32],
    /// Whether rows look into mirrors anywhere.
    mirrors: bool,
    /// Whether any wall moves.
    moving_walls: bool,
}

/// Values in a field.
const VALUES: usize = (Q + 1) * STRIDE;

/// A few rows on their way through a step.
struct Batch<T> {
    /// Populations, by velocity and lane.
    f: [[T; BATCH]; Q],
    /// For each velocity c the fill at -c; only for rows with interface.
    fill: [[T; BATCH]; Q],
    /// Mass of interface cells, infinite in all others.
    mass: [T; BATCH],
    density: [T; BATCH],
}

impl<T: Real> Batch<T> {
    fn new() -> Self {
        Self {
            f: [[T::ZERO; BATCH]; Q],
            fill: [[T::ZERO; BATCH]; Q],
            mass: [T::INFINITY; BATCH],
            density: [T::ONE; BATCH],
        }
    }
}

/// The array to read beyond the mirrors `flip`.
#[inline(always)]
fn mirrored(array: usize, flip: u8) -> usize {
    if array == FILL { FILL } else { usize::from(MIRROR[usize::from(flip & 7)][array]) }
}

/// `a` in lanes whose bit is set, `b` in the others.
#[inline(always)]
fn choose<T>(bits: u8, lane: usize, a: T, b: T) -> T {
    if bits & (1 << lane) != 0 { a } else { b }
}

impl<'a, T: Real> Source<'a, T> {
    fn new(topology: &'a Topology, links: &'a Links, front: &'a [Box<Field<T>>], slot: usize) -> Self {
        let near = std::array::from_fn(|n| {
            let slot = links.slots[n.min(26)] as usize;
            bytemuck::cast_ref::<Field<T>, [T; VALUES]>(&front[slot])
        });
        let mirrors = links.steps.iter().flatten().any(|step| step.flip != 0);
        Self { topology, links, own: &front[slot], near, mirrors, moving_walls: topology.moving_walls() }
    }

    #[inline(always)]
    fn block(&self, n: u8) -> &'a [T; VALUES] {
        self.near[usize::from(n) & 31]
    }

    /// The eight values of array `array` for a row, each taken from the cell at -c; populations come mirrored.
    #[inline(always)]
    fn pull(&self, beside: &Beside, c: [i32; 3], array: usize, mirrors: bool, to: &mut [T]) {
        let beside = beside[upstream(c)];
        let first = (usize::from(beside.row) & (ROWS - 1)) * LANES;
        let seen = |flip: u8| if mirrors { mirrored(array, flip) * STRIDE } else { array * STRIDE };
        let row = seen(beside.flip) + first;
        let values = self.block(beside.block);
        // A shifted row takes one lane from beyond its array; it is then put right.
        match c[0] {
            0 => to[..LANES].copy_from_slice(&values[row..row + LANES]),
            1 => {
                let step = self.links.before();
                to[..LANES].copy_from_slice(&values[row - 1..row + LANES - 1]);
                let lane = seen(beside.flip | step.flip) + first + (usize::from(step.index) & (LANES - 1));
                to[0] = self.block(beside.low)[lane];
            }
            _ => {
                let step = self.links.after();
                to[..LANES].copy_from_slice(&values[row + 1..row + LANES + 1]);
                let lane = seen(beside.flip | step.flip) + first + (usize::from(step.index) & (LANES - 1));
                to[usize::from(self.links.last) & (LANES - 1)] = self.block(beside.high)[lane];
            }
        }
    }

    /// Populations arriving in a row from the cells around it, whatever these are.
    #[inline(always)]
    fn pull_all(&self, beside: &Beside, mirrors: bool, f: &mut [[T; BATCH]; Q], at: usize) {
        self.pull(beside, C[0], 0, mirrors, &mut f[0][at..at + LANES]);
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            self.pull(beside, const { C[2 * P + 1] }, a, mirrors, &mut f[a][at..at + LANES]);
            self.pull(beside, const { C[2 * P + 2] }, b, mirrors, &mut f[b][at..at + LANES]);
        });
    }

    /// [`Source::pull_all`] with the choice about mirrors made once for the row.
    #[inline(always)]
    fn arrive(&self, beside: &Beside, f: &mut [[T; BATCH]; Q], at: usize) {
        if self.mirrors {
            self.pull_all(beside, true, f, at);
        } else {
            self.pull_all(beside, false, f, at);
        }
    }

    /// The fill around the interface cells of a row.
    #[inline(always)]
    fn pull_fill(&self, around: &SurfaceRow, fill: &mut [[T; BATCH]; Q], at: usize) {
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            if around.interface[a] != 0 {
                self.pull(&around.beside, const { C[2 * P + 1] }, FILL, true, &mut fill[a][at..at + LANES]);
            }
            if around.interface[b] != 0 {
                self.pull(&around.beside, const { C[2 * P + 2] }, FILL, true, &mut fill[b][at..at + LANES]);
            }
        });
    }

    /// Mass that the interface cells of a row gain from their neighbours, before `f` is mended at air and walls.
    #[inline(always)]
    fn exchange(&self, around: &SurfaceRow, batch: &Batch<T>, at: usize, mass: &mut [f64; CELLS]) {
        let (own, first) = (self.own, (usize::from(around.row) & (ROWS - 1)) * LANES);
        let mut gain = [0.0f64; LANES];
        let half = T::from_f64(0.5);
        for i in 1..Q {
            let (liquid, between) = (around.liquid[i], around.interface[i]);
            if liquid | between == 0 {
                continue;
            }
            for k in 0..LANES {
                let mean = half * (own[FILL][first + k] + batch.fill[i][at + k]);
                let open = choose(liquid, k, T::ONE, choose(between, k, mean, T::ZERO));
                gain[k] += (open * (batch.f[i][at + k] - own[opposite(i)][first + k])).to_f64();
            }
        }
        for k in 0..LANES {
            mass[first + k] += choose(around.kinds.interface, k, gain[k], 0.0);
        }
    }

    /// Makes up what should come from the air.
    #[inline(always)]
    fn meet_air(&self, around: &SurfaceRow, gravity: [T; 3], f: &mut [[T; BATCH]; Q], at: usize) {
        let (own, first) = (self.own, (usize::from(around.row) & (ROWS - 1)) * LANES);
        // Velocity before the populations moved; the gas has density 1 and moves with the fluid.
        let mut u = [[T::ZERO; LANES]; 3];
        let mut square = [T::ZERO; LANES];
        for k in 0..LANES {
            let mut excess = own[0][first + k];
            let mut j = [T::ZERO; 3];
            each_pair!(P, {
                let (a, b) = (own[2 * P + 1][first + k], own[2 * P + 2][first + k]);
                let c = const { C[2 * P + 1] };
                excess += a + b;
                for axis in 0..3 {
                    match c[axis] {
                        0 => {}
                        1 => j[axis] += a - b,
                        _ => j[axis] -= a - b,
                    }
                }
            });
            let inverse = T::ONE / (T::ONE + excess);
            let weight = larger(smaller(own[FILL][first + k], T::ONE), T::ZERO);
            let half = T::from_f64(0.5) * weight;
            for axis in 0..3 {
                u[axis][k] = j[axis] * inverse - half * gravity[axis];
            }
            square[k] = T::from_f64(1.5) * (u[0][k] * u[0][k] + u[1][k] * u[1][k] + u[2][k] * u[2][k]);
        }
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
            if self.moving_walls {
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
        rows: &[SurfaceRow],
        physics: &Physics<T, R>,
        batch: &mut Batch<T>,
        mass: &mut [f64; CELLS],
    ) {
        for (n, row) in rows.iter().enumerate() {
            self.arrive(&row.beside, &mut batch.f, n * LANES);
            self.pull_fill(row, &mut batch.fill, n * LANES);
        }
        for (n, row) in rows.iter().enumerate() {
            let at = n * LANES;
            if row.kinds.interface != 0 {
                self.exchange(row, batch, at, mass);
                if row.any_air | row.any_interface != 0 {
                    self.meet_air(row, physics.gravity, &mut batch.f, at);
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
    density: &[T],
    mass: &[f64; CELLS],
    back: &mut Field<T>,
    findings: &mut Findings,
) {
    let row = usize::from(around.row) & (ROWS - 1);
    let first = row * LANES;
    let mut fill = [0.0; LANES];
    for k in 0..LANES {
        fill[k] = mass[first + k] / density[k].to_f64();
        back[FILL][first + k] = T::from_f64(fill[k]);
    }
    let below = |limit: f64| (0..LANES).fold(0, |bits, k| bits | u8::from(fill[k] < limit) << k);
    let above = |limit: f64| (0..LANES).fold(0, |bits, k| bits | u8::from(fill[k] > limit) << k);
    let interface = around.kinds.interface;
    let closed = !(around.any_air | around.any_interface);
    let full = (above(FULL) | above(FULL_INSIDE) & !around.any_air | closed) & interface;
    let empty = (below(EMPTY) | below(EMPTY_OUTSIDE) & !around.any_liquid) & interface;
    findings.full[row] = full;
    findings.empty[row] = empty;
    findings.any |= full | empty != 0;
}

/// One step of one block.
#[inline(always)]
fn step_block<T: Real, R: Relaxation<T>>(
    source: &Source<'_, T>,
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
        source.load_surface(rows, physics, &mut batch, mass);
        collide_batch(physics, &mut batch);
        for (n, row) in rows.iter().enumerate() {
            store(&batch, n * LANES, row.row, back, findings);
            if row.kinds.interface != 0 {
                judge(row, &batch.density[n * LANES..(n + 1) * LANES], mass, back, findings);
            }
        }
    }
}

/// [`step_block`] compiled for processors with AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn step_block_avx2<T: Real, R: Relaxation<T>>(
    source: &Source<'_, T>,
    rows: &Rows,
    physics: &Physics<T, R>,
    back: &mut Field<T>,
    mass: &mut [f64; CELLS],
    findings: &mut Findings,
) {
    step_block(source, rows, physics, back, mass, findings);
}

/// [`step_block`] for the processor at hand. Both forms give the same bits: the same operations, only wider.
#[allow(unsafe_code)]
fn step_block_here<T: Real, R: Relaxation<T>>(
    source: &Source<'_, T>,
    rows: &Rows,
    physics: &Physics<T, R>,
    back: &mut Field<T>,
    mass: &mut [f64; CELLS],
    findings: &mut Findings,
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor was just asked whether it has AVX2.
        return unsafe { step_block_avx2(source, rows, physics, back, mass, findings) };
    }
    step_block(source, rows, physics, back, mass, findings);
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
        let Self { topology, links, front, back, mass, .. } = self;
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
                    step_block_here(&source, rows, physics, back, mass, findings);
                }
            });
        std::mem::swap(&mut self.front, &mut self.back);
    }

    /// The moments of every wet cell of a block, as the next collision will see them.
    pub(crate) fn moments<R: Relaxation<T>>(
        &self,
        slot: usize,
        rows: &Rows,
        physics: &Physics<T, R>,
        mut see: impl FnMut(usize, &Moments<T>),
    ) {
        let Self { topology, links, front, .. } = self;
        let source = Source::new(topology, &links[slot], front, slot);
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
            source.load_surface(rows, physics, &mut batch, &mut mass);
            for (n, row) in rows.iter().enumerate() {
                show(&batch, n, row.row, row.kinds);
            }
        }
    }
}
