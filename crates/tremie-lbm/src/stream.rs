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
//! Bulk rows skip all of this. The eight cells of a row are worked on at once (`lanes`); whatever differs between them
//! is a choice by a bit, not a branch.

use rayon::prelude::*;

use crate::ahead::Ahead;
use crate::cage::Cages;
use crate::collision::{Held, LEAST_RESISTANCE, Moments, collide, moments};
use crate::friction::slide_at_walls;
use crate::grid::{ALL_ROWS, AT_ONCE, Borne, Field, Fill, Grid, Kinds, SHARE, Shape, VELOCITY};
use crate::immersed::Sight;
use crate::lanes::{LANES, Lanes, bits};
use crate::lattice::{C, Q, W, each_pair, opposite};
use crate::loads::Loads;
use crate::plane::{reconstruct, velocities};
use crate::processor::for_this_processor;
use crate::real::{Number, Real, by_axis, larger, smaller};
use crate::relaxation::{Law, Relaxation};
use crate::rows::{BulkRow, Rows, Sorting, SurfaceRow, first_of};
use crate::solids::Contact;
use crate::source::{Fills, Shapes, Source};
use crate::support::see_shores;
use crate::together::{
    HOLDS, Own, PAIRS, Pair, Physics, Populations, Pushes, Whole, collide_pairs_here, pair_up, rescale_row,
};
use crate::topology::{CELLS, ROWS};
use crate::transport::gains;
use crate::values::written;
use crate::yielding::yield_at_walls;

/// Fill above which an interface cell becomes liquid, and below which it becomes air.
const FULL: f64 = 1.01;
const EMPTY: f64 = -0.01;
/// The same for cells that are this near to full or empty and on their way there, fast enough to arrive within so many
/// steps. (What leaves a cell by its plane never takes it beyond full or empty, so that it might come to neither limit.) Filling must be
/// sooner: liquid beside a cell that empties becomes interface as full as it was. If any tremble made it liquid again, the empty cell came back with it, and
/// both came and went by turns for ever; each time is a blow that what does not yield around them carries on.
const NEAR: f64 = 0.005;
const FILLS_WITHIN: f64 = 10.0;
const EMPTIES_WITHIN: f64 = 100.0;
/// The same for cells that have no air, or no liquid, beside them. (One with neither air nor interface, a bubble of one
/// cell, closes at any fill.)
const FULL_INSIDE: f64 = 0.9;
const EMPTY_OUTSIDE: f64 = 0.1;
/// Wet share of a face from which on a film on a wall flows on through it into air.
const REACHES: f64 = 0.1;
/// Fill up to which it does so. (A cell nearly full fills up.)
const THIN: f64 = 0.9;

/// Densities between which a cell counts as sound.
const SOUND: [f64; 2] = [0.5, 2.0];

/// Bytes of populations from which on they are more than a processor's caches hold from one step to the next.
const CACHES: usize = 64 << 20;

/// What a step found in a block.
#[derive(Debug, Clone)]
pub(crate) struct Findings {
    /// Interface cells that want to become liquid, by row.
    pub(crate) full: [u8; ROWS],
    /// Interface cells that want to become air, by row.
    pub(crate) empty: [u8; ROWS],
    /// Air that a film on a wall flows into: the film's cell, and the velocity that comes from there.
    pub(crate) reached: Vec<(usize, usize)>,
    /// Full cells under a wall that comes on, which holds what they hold beside 1.
    pub(crate) pressed: Vec<usize>,
    /// Whether there are any of these.
    pub(crate) any: bool,
    /// A cell whose density is out of all bounds or not a number.
    pub(crate) broken: Option<usize>,
    /// Mass that solids took from the liquid by their motion.
    pub(crate) swept: f64,
}

impl Default for Findings {
    fn default() -> Self {
        Self {
            full: [0; ROWS],
            empty: [0; ROWS],
            reached: Vec::new(),
            pressed: Vec::new(),
            any: false,
            broken: None,
            swept: 0.0,
        }
    }
}

/// The values of a block that a step writes.
struct Block<'a, T> {
    back: &'a mut Field<T>,
    fill: &'a mut Fill<T>,
    mass: &'a mut [f64; CELLS],
    borne: &'a mut Borne<T>,
    /// What inclusions will see, where there are any.
    seen: Option<Sight<'a, T>>,
}

/// A surface row of which the populations are ready to collide.
struct Ready<T> {
    /// What the cells hold ([`Held::Partly`]).
    held: [Lanes<T>; HOLDS],
    /// What mass they gain in this step.
    gain: [f64; LANES],
    /// What room walls that come on leave ([`Contact::room`]).
    room: [f64; LANES],
    /// For each face the cells that slide there, or have yielded already.
    slides: [u8; 6],
    /// Forces of cages on the row, where walls ask for them.
    asked: Option<Pushes<T>>,
}

impl<T: Real> Held<Lanes<T>> {
    /// That of one cell.
    pub(crate) fn of(self, lane: usize) -> Held<T> {
        match self {
            Self::Whole => Held::Whole,
            Self::Partly { mass, least, support } => {
                Held::Partly { mass: mass.0[lane], least: least.0[lane], support: support.0[lane] }
            }
        }
    }
}

impl<'a, T: Real> Source<'a, T> {
    /// Makes up what should come from the air.
    #[inline(always)]
    fn meet_air(&self, around: &SurfaceRow, surface: &Shapes<'_, T>, f: &mut [Lanes<T>; Q]) {
        let first = around.first();
        // The gas has density 1, and more where surface tension presses, and moves with the fluid.
        let u = by_axis(|axis| surface.own.lanes(VELOCITY + axis, first));
        let square = Lanes::from_f64(1.5) * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) - self.air(first);
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            let (from_a, from_b) = (around.missing[a], around.missing[b]);
            if from_a | from_b != 0 {
                let c = const { C[2 * P + 1] };
                let mut along = Lanes::ZERO;
                for axis in 0..3 {
                    match c[axis] {
                        0 => {}
                        1 => along += u[axis],
                        _ => along -= u[axis],
                    }
                }
                let both = Lanes::from_f64(2.0 * W[a]) * (Lanes::from_f64(4.5) * along * along - square);
                f[a] = Lanes::choose(from_a, both - self.own(b, first), f[a]);
                f[b] = Lanes::choose(from_b, both - self.own(a, first), f[b]);
            }
        });
    }

    /// Sends back what would go into walls.
    #[inline(always)]
    fn meet_walls(&self, around: &SurfaceRow, f: &mut [Lanes<T>; Q]) {
        let first = around.first();
        let moving = self.topology.moving_walls();
        for i in 1..Q {
            let solid = around.solid[i];
            if solid == 0 {
                continue;
            }
            f[i] = Lanes::choose(solid, self.own(opposite(i), first), f[i]);
            if moving {
                self.drag(first, i, solid, &mut f[i].0);
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

    /// Makes the populations that arrived in a surface row ready to collide, but for yielding at walls (module `yielding`); `fill`, `mass` and `borne`
    /// are those of the block's cells, `swept` is what solids take, `own` what its flow curves have of their own.
    #[inline(always)]
    fn surface<R: Law<T>>(
        &self,
        surface: &Shapes<'_, T>,
        row: &SurfaceRow,
        physics: &Physics<T, R>,
        own: &Own<'_, T, R>,
        f: &mut Populations<T>,
        fill: &Fill<T>,
        mass: &mut [f64; CELLS],
        borne: &Borne<T>,
        swept: &mut f64,
    ) -> Ready<T> {
        let first = row.first();
        let contacts = self.contacts(row, first);
        let mut room = [0.0; LANES];
        let slides = match row.any_immersed {
            0 => 0,
            _ => bits(|k| contacts[k].iter().flatten().any(|contact| contact.slides)),
        };
        let mut gain = [0.0; LANES];
        let (mut held, mut least) = (Lanes::INFINITY, Lanes::from_f64(LEAST_RESISTANCE));
        if row.kinds.interface != 0 {
            gain = gains(self, surface, row, f);
            for k in 0..LANES {
                mass[first + k] += gain[k];
                held.0[k] = T::from_f64(mass[first + k]);
            }
            held = Lanes::choose(row.kinds.interface, held, Lanes::INFINITY);
            // What lies on a wall is held by all of the wall that it wets, be it ever so thin.
            for i in 1..=6 {
                let wall = row.solid[i] & row.kinds.interface & !slides;
                if wall != 0 {
                    let wets = surface.own.lanes(SHARE + opposite(i) - 1, first);
                    least = Lanes::choose(wall, larger(least, wets), least);
                }
            }
            if row.any_air | row.any_interface != 0 {
                self.meet_air(row, surface, f);
            }
        }
        if row.any_solid != 0 {
            self.meet_walls(row, f);
        }
        let support = match row.kinds.interface {
            0 => Lanes::ONE,
            _ => self.support(surface, first, physics.gravity, held, borne),
        };
        let held = [held, least, support];
        let mut yielded = 0;
        if row.any_immersed != 0 {
            room = contacts.map(|touching| touching.iter().flatten().map(Contact::room).sum());
            yielded =
                self.meet_solids(row, first, &contacts, physics, own, fill, held.into(), f, mass, swept);
            self.pour(row, first, f, mass, &mut gain);
        }
        let wet = row.kinds.wet();
        if wet != 0xff {
            for f in &mut *f {
                *f = f.only(wet);
            }
        }
        // Walls ask for the forces on the cells beside them, and take part of what moves there.
        let asks = row.caged && row.any_solid != 0;
        let asked = asks.then(|| self.braked(first, held, physics.gravity, f)).flatten();
        let mut slides = [slides | yielded; 6];
        if self.rubs {
            let own = &own.or(&asked);
            slide_at_walls(self, row, &contacts, physics, own, held.into(), f, &mut slides);
        }
        Ready { held, gain, room, slides, asked }
    }
}

/// Whether a cell of this density is sound.
#[inline(always)]
fn is_sound<T: Real>(density: T) -> bool {
    (density > T::from_f64(SOUND[0])) & (density < T::from_f64(SOUND[1]))
}

/// Whether all cells of some rows are.
#[inline(always)]
fn all_sound<T: Real>(rows: &[[T; LANES]]) -> bool {
    let mut sound = [1u32; LANES];
    for row in rows {
        for k in 0..LANES {
            sound[k] &= u32::from(is_sound(row[k]));
        }
    }
    sound == [1; LANES]
}

/// Notes a cell of a row that is no longer sound.
#[inline(always)]
fn look_over<T: Real>(row: u8, density: Lanes<T>, findings: &mut Findings) {
    if !all_sound(&[density.0]) {
        let unsound = (0..LANES).find(|k| !is_sound(density.0[*k]));
        findings.broken = findings.broken.or(unsound.map(|k| first_of(row) + k));
    }
}

/// Streams and collides the bulk rows of a block.
#[inline(always)]
fn step_bulk<T: Real, R: Law<T>>(
    source: &Source<'_, T>,
    rows: &[BulkRow],
    ahead: &Ahead<'_, T>,
    physics: &Physics<T, R>,
    past_caches: bool,
    block: &mut Block<'_, T>,
    findings: &mut Findings,
) {
    if rows.is_empty() {
        return;
    }
    let (mut f, mut to): ([Pair<T>; PAIRS], [Pair<T>; PAIRS]) = bytemuck::Zeroable::zeroed();
    let mut density = [[[T::ONE; LANES]; 2]; PAIRS];
    for (n, batch) in rows.chunks(2 * PAIRS).enumerate() {
        for (m, row) in batch.iter().enumerate() {
            source.arrive(&row.beside, &mut f[m / 2].0, m % 2);
        }
        let own = |m: usize| physics.own(source, batch[m.min(batch.len() - 1)].first());
        let own: [[Own<'_, T, R>; 2]; PAIRS] = std::array::from_fn(|n| [own(2 * n), own(2 * n + 1)]);
        let pairs = batch.len().div_ceil(2);
        let ahead = (ahead, 2 * PAIRS * n);
        collide_pairs_here(
            &f[..pairs],
            &[Whole; PAIRS],
            &own[..pairs],
            physics,
            ahead,
            &mut to[..pairs],
            &mut density[..pairs],
        );
        for (m, row) in batch.iter().enumerate() {
            let post = |i: usize| to[m / 2].0[i][m % 2];
            block.back.put_row(usize::from(row.row), post, past_caches);
            if let Some(seen) = &mut block.seen {
                let post = std::array::from_fn(|i| Lanes(post(i)));
                let velocity = velocities(&post, Lanes::ONE, physics.drive_row(&own[m / 2][m % 2]));
                seen.put(usize::from(row.row), velocity);
            }
        }
        let densities = &density.as_flattened()[..batch.len()];
        if !all_sound(densities) {
            for (row, density) in batch.iter().zip(densities) {
                look_over(row.row, Lanes(*density), findings);
            }
        }
    }
}

/// New fill of the interface cells of a row, and which of them want to become liquid or air; `room` is what walls that come on leave or take.
#[inline(always)]
fn judge<T: Real>(
    around: &SurfaceRow,
    gain: &[f64; LANES],
    room: &[f64; LANES],
    density: Lanes<T>,
    mass: &[f64; CELLS],
    to: &mut Fill<T>,
    findings: &mut Findings,
) {
    let row = usize::from(around.row) & (ROWS - 1);
    let first = row * LANES;
    let interface = around.kinds.interface;
    let (mut fill, mut stored) = ([0.0; LANES], Lanes::ZERO);
    for k in 0..LANES {
        fill[k] = mass[first + k] / density.0[k].to_f64();
        stored.0[k] = T::from_f64(fill[k]);
    }
    let other = Lanes::ONE.only(around.kinds.liquid);
    to.put(0, first, Lanes::choose(interface, stored, other));
    let below = |limit: f64| bits(|k| fill[k] < limit);
    let above = |limit: f64| bits(|k| fill[k] - room[k] > limit);
    let closed = !(around.any_air | around.any_interface | around.any_immersed);
    // The widest limits: most rows keep within.
    (findings.full[row], findings.empty[row]) = (0, 0);
    let (nearly_full, nearly_empty) = (above(FULL_INSIDE), below(EMPTY_OUTSIDE));
    if (nearly_full | nearly_empty | closed) & interface == 0 {
        return;
    }
    let rising = above(1.0 - NEAR) & bits(|k| gain[k] > NEAR / FILLS_WITHIN);
    let falling = below(NEAR) & bits(|k| gain[k] < -NEAR / EMPTIES_WITHIN);
    let full = (above(FULL) | rising | nearly_full & !around.any_air | closed) & interface;
    // On a wall a film goes on by cells that hold little at first. (They would come and go with each tremble if they went with each loss.)
    let staying = bits(|k| gain[k] > -larger(fill[k], NEAR) / EMPTIES_WITHIN);
    let astray = !around.any_liquid & !(around.any_solid & staying);
    let empty = (below(EMPTY) | falling | nearly_empty & astray) & interface & !full;
    findings.full[row] = full;
    findings.empty[row] = empty;
    findings.pressed.extend((0..LANES).filter(|k| full >> k & 1 == 1 && room[*k] != 0.0).map(|k| first + k));
    findings.any |= full | empty != 0;
}

/// Finds the air that films on walls flow into.
///
/// Air becomes interface when a cell beside it has filled. A film thinner than a cell never fills one: without this
/// the front of a sheet stays where it is as soon as it is lower than a cell.
fn reach<T: Real>(around: &SurfaceRow, fill: Lanes<T>, shape: &Shape<T>, findings: &mut Findings) {
    let first = around.first();
    let row = usize::from(around.row) & (ROWS - 1);
    let thin = bits(|k| fill.0[k].to_f64() < THIN);
    let lasting = around.any_air & thin & !(findings.full[row] | findings.empty[row]);
    for i in 1..=6 {
        let beside = (1..=6).filter(|j| (j - 1) / 2 != (i - 1) / 2);
        let films = beside.fold(0, |bits, j| bits | around.solid[j]) & around.air(i) & lasting;
        for k in (0..LANES).filter(|k| films >> k & 1 == 1) {
            let share = shape[(SHARE + opposite(i) - 1, first + k)].to_f64();
            let speed = shape[(VELOCITY + (i - 1) / 2, first + k)].to_f64();
            let onward = if i % 2 == 1 { -speed } else { speed };
            if share > REACHES && onward > 0.0 {
                findings.reached.push((first + k, i));
                findings.any = true;
            }
        }
    }
}

/// Streams and collides the surface rows of a block, before which it had `first` others.
#[inline(always)]
fn step_surface<T: Real, R: Law<T>>(
    source: &Source<'_, T>,
    surface: &Shapes<'_, T>,
    rows: &[SurfaceRow],
    (ahead, first): (&Ahead<'_, T>, usize),
    physics: &Physics<T, R>,
    change: Option<T>,
    block: &mut Block<'_, T>,
    findings: &mut Findings,
) {
    if rows.is_empty() {
        return;
    }
    let (mut f, mut to): ([Pair<T>; PAIRS], [Pair<T>; PAIRS]) = bytemuck::Zeroable::zeroed();
    let mut held: [Pair<T, HOLDS>; PAIRS] = bytemuck::Zeroable::zeroed();
    let mut density = [[[T::ONE; LANES]; 2]; PAIRS];
    // Gains, and the room that walls leave.
    let mut told = [[[0.0; LANES]; 2]; 2 * PAIRS];
    let mut slides = [[0; 6]; 2 * PAIRS];
    let mut done = first;
    // Forces push on both rows of a pair or on neither.
    for batch in rows.chunk_by(|a, b| a.caged == b.caged).flat_map(|rows| rows.chunks(2 * PAIRS)) {
        let last = batch.len() - 1;
        let own: [Own<'_, T, R>; 2 * PAIRS] =
            std::array::from_fn(|m| physics.own(source, batch[m.min(last)].first()));
        let mut asked: [Option<Pushes<T>>; 2 * PAIRS] = [const { None }; 2 * PAIRS];
        for (m, row) in batch.iter().enumerate() {
            let mut arrived = source.arriving(&row.beside);
            let Block { fill, mass, borne, .. } = &mut *block;
            let swept = &mut findings.swept;
            let ready =
                source.surface(surface, row, physics, &own[m], &mut arrived, fill, mass, borne, swept);
            f[m / 2].put(m % 2, &arrived);
            held[m / 2].put(m % 2, &ready.held);
            told[m] = [ready.gain, ready.room];
            (slides[m], asked[m]) = (ready.slides, ready.asked);
        }
        let pairs = batch.len().div_ceil(2);
        if !physics.law.row(&own[0].law).is_newtonian() {
            let own = pair_up(&own, &asked, last);
            yield_at_walls(source, batch, &slides, &held, &own, physics, &mut f);
        }
        let mut braked = [const { None }; 2 * PAIRS];
        if batch[0].caged {
            for (m, row) in batch.iter().enumerate() {
                let (held, f) = (held[m / 2].row(m % 2), f[m / 2].row(m % 2));
                braked[m] = source.braked(row.first(), held, physics.gravity, &f);
            }
        }
        let own = pair_up(&own, &braked, last);
        for (m, row) in batch.iter().enumerate().filter(|(_, row)| row.kinds.interface != 0) {
            let ([mass, ..], f) = (held[m / 2].row(m % 2), f[m / 2].row(m % 2));
            source.see_borne(surface, row, physics.gravity, &f, own[m / 2][m % 2].push, mass, block.borne);
        }
        match change {
            None => {
                collide_pairs_here(
                    &f[..pairs],
                    &held[..pairs],
                    &own[..pairs],
                    physics,
                    (ahead, done),
                    &mut to[..pairs],
                    &mut density[..pairs],
                );
            }
            Some(factor) => {
                for m in 0..batch.len() {
                    let [n, half] = [m / 2, m % 2];
                    let (f, held) = (f[n].row(half), held[n].row(half).into());
                    let (post, dense) = rescale_row(&f, held, &own[n][half], physics, factor);
                    to[n].put(half, &post);
                    density[n][half] = dense.0;
                }
            }
        }
        done += batch.len();
        for (m, row) in batch.iter().enumerate() {
            let [n, half] = [m / 2, m % 2];
            let density = Lanes(density[n][half]);
            block.back.put_row(usize::from(row.row), |i| to[n].0[i][half], false);
            look_over(row.row, density, findings);
            if let Some(seen) = &mut block.seen {
                let fill = smaller(held[n].row(half)[0] / density, Lanes::ONE).only(row.kinds.wet());
                let velocity = velocities(&to[n].row(half), fill, physics.drive_row(&own[n][half]));
                // Velocities before are in other units where the step changes.
                let beside = row.any_solid | row.any_air | row.any_interface | row.kinds.interface;
                let ring = if change.is_none() { beside } else { 0 };
                seen.put_mean(usize::from(row.row), velocity, fill, ring);
            }
            if row.kinds.interface == 0 {
                continue;
            }
            let [gain, room] = &told[m];
            judge(row, gain, room, density, block.mass, block.fill, findings);
            if row.any_solid & row.any_air != 0 {
                reach(row, block.fill.lanes(0, row.first()), surface.own, findings);
            }
        }
    }
}

/// One step of one block.
#[inline(always)]
fn step_block<T: Real, R: Law<T>>(
    source: &Source<'_, T>,
    surface: &Shapes<'_, T>,
    rows: &Rows,
    ahead: &Ahead<'_, T>,
    physics: &Physics<T, R>,
    change: Option<T>,
    past_caches: bool,
    block: &mut Block<'_, T>,
    findings: &mut Findings,
) {
    match change {
        None => step_bulk(source, &rows.bulk, ahead, physics, past_caches, block, findings),
        Some(factor) => {
            for row in &rows.bulk {
                let f = source.arriving(&row.beside);
                let own = physics.own(source, row.first());
                let (post, density) = rescale_row(&f, Held::Whole, &own, physics, factor);
                block.back.put_row(usize::from(row.row), |i| post[i].0, past_caches);
                look_over(row.row, density, findings);
            }
        }
    }
    step_surface(source, surface, &rows.surface, (ahead, rows.bulk.len()), physics, change, block, findings);
    ahead.ask_rest(rows.bulk.len() + rows.surface.len());
    if past_caches {
        written();
    }
}

for_this_processor! {
    /// [`step_block`] for the processor at hand.
    step_block_here = step_block<T: Real, R: Law<T>>(
        source: &Source<'_, T>,
        surface: &Shapes<'_, T>,
        rows: &Rows,
        ahead: &Ahead<'_, T>,
        physics: &Physics<T, R>,
        change: Option<T>,
        past_caches: bool,
        block: &mut Block<'_, T>,
        findings: &mut Findings
    )
}

for_this_processor! {
    /// [`reconstruct`] for the processor at hand.
    reconstruct_here = reconstruct<T: Real>(
        source: &Source<'_, T>,
        fills: &Fills<'_, T>,
        rows: &Rows,
        gravity: [T; 3],
        shape: &mut Shape<T>
    )
}

for_this_processor! {
    /// [`see_shores`] for the processor at hand.
    see_shores_here = see_shores<T: Real>(
        source: &Source<'_, T>,
        rows: &Rows,
        gravity: [T; 3],
        shape: &mut Shape<T>
    )
}

impl<T: Real> Grid<T> {
    /// Streams and collides all blocks once; time steps are `change` times as long from then on, if they change. The new populations are in `front` afterwards.
    pub(crate) fn step<R: Law<T>>(
        &mut self,
        rows: &[Rows],
        physics: &Physics<T, R>,
        change: Option<T>,
        findings: &mut Vec<Findings>,
    ) {
        findings.resize(self.len(), Findings::default());
        let past_caches = self.slots().count() * 2 * size_of::<Field<T>>() > CACHES;
        let Self {
            topology,
            solids,
            inlets,
            links,
            front,
            back,
            fills,
            shape,
            mass,
            borne,
            carried,
            cages,
            tension,
            ..
        } = self;
        let (cages, tension): (&Cages, _) = (cages, tension.as_ref());
        let (seen, last, pushes) = self.immersed.split();
        (
            back.par_iter_mut(),
            fills.par_iter_mut(),
            (mass.par_iter_mut(), borne.par_iter_mut()),
            (seen.par_iter_mut(), last.par_iter_mut()),
            findings.par_iter_mut(),
        )
            .into_par_iter()
            .enumerate()
            .skip(2)
            .with_max_len(AT_ONCE)
            .for_each(|(slot, (back, fill, (mass, borne), (seen, last), findings))| {
                if findings.any {
                    *findings = Findings::default();
                }
                findings.swept = 0.0;
                if !rows[slot].is_empty() {
                    let source = Source::new(topology, solids, inlets, &links[slot], front, slot)
                        .with(carried.structure(slot), pushes[slot].as_deref())
                        .caged(cages)
                        .pressed(tension);
                    let surface = Shapes::new(&links[slot], shape, slot);
                    let ahead = Ahead::of(slot, rows, links, front, shape);
                    let seen = seen.as_deref_mut().zip(last.as_deref_mut());
                    let seen = seen.map(|(seen, last)| Sight { seen, last });
                    let mut block = Block { back, fill, mass, borne, seen };
                    step_block_here(
                        &source,
                        &surface,
                        &rows[slot],
                        &ahead,
                        physics,
                        change,
                        past_caches,
                        &mut block,
                        findings,
                    );
                }
            });
        std::mem::swap(&mut self.front, &mut self.back);
    }

    /// Sorts the rows whose surroundings have changed, and finds the shape of the surface: after cells have changed and before the next step.
    pub(crate) fn arrange(&mut self, rows: &mut Vec<Rows>, gravity: [T; 3]) {
        rows.resize(self.len(), Rows::default());
        if self.solids.still && !self.sorted_still {
            self.stale.fill(ALL_ROWS);
        }
        self.sorted_still = self.solids.still;
        let Self { topology, solids, inlets, links, front, fills, shape, kinds, used, stale, cages, .. } =
            self;
        let sorting = Sorting { kinds, links, solids, cages, used };
        (shape.par_iter_mut(), rows.par_iter_mut(), stale.par_iter_mut())
            .into_par_iter()
            .enumerate()
            .skip(2)
            .with_max_len(AT_ONCE)
            .for_each(|(slot, (shape, rows, stale))| {
                sorting.sort(slot, std::mem::take(stale), rows);
                if rows.surface.iter().any(|row| row.kinds.interface != 0) {
                    let source = Source::new(topology, solids, inlets, &links[slot], front, slot);
                    let fills = Fills::new(&links[slot], fills, slot);
                    reconstruct_here(&source, &fills, rows, gravity, shape);
                }
                rows.fast = rows.any_fast(shape, gravity);
            });
        Rows::see_voids(rows, links);
        let fast: Vec<bool> = rows.iter().map(|rows| rows.fast).collect();
        if !fast.contains(&true) {
            return;
        }
        (shape.par_iter_mut(), rows.par_iter())
            .into_par_iter()
            .enumerate()
            .skip(2)
            .with_max_len(AT_ONCE)
            .filter(|(slot, _)| links[*slot].slots.iter().any(|beside| fast[*beside as usize]))
            .for_each(|(slot, (shape, rows))| {
                let source = Source::new(topology, solids, inlets, &links[slot], front, slot);
                see_shores_here(&source, rows, gravity, shape);
            });
    }

    /// The moments and the relaxation rate of every wet cell of a block, as the next collision will see them; adds what walls bear to `loads`, if that is asked for.
    pub(crate) fn moments<R: Law<T>>(
        &self,
        slot: usize,
        rows: &Rows,
        physics: &Physics<T, R>,
        mut loads: Option<&mut Loads>,
        mut see: impl FnMut(usize, &Moments<T>, T),
    ) {
        let fill = &self.fills[slot];
        let (links, front) = (&self.links[slot], &self.front);
        let source = Source::new(&self.topology, &self.solids, &self.inlets, links, front, slot)
            .with(self.carried.structure(slot), self.immersed.pushes(slot))
            .caged(&self.cages)
            .pressed(self.tension.as_ref());
        let surface = Shapes::new(links, &self.shape, slot);
        let (mut mass, borne) = (self.mass[slot].clone(), &self.borne[slot]);
        let mut swept = 0.0;
        let mut show =
            |f: &Populations<T>, held: Held<Lanes<T>>, own: &Own<'_, T, R>, row: u8, kinds: Kinds| {
                for k in (0..LANES).filter(|k| kinds.wet() >> k & 1 == 1) {
                    let f: [T; Q] = std::array::from_fn(|i| f[i].0[k]);
                    let m = moments(&f, held.of(k), physics.drive(own, k));
                    see(first_of(row) + k, &m, m.omega(&physics.law.cell(&own.law, k)));
                }
            };
        let leave = |f: &Populations<T>, held: Held<Lanes<T>>, own: &Own<'_, T, R>, k: usize| {
            let f: [T; Q] = std::array::from_fn(|i| f[i].0[k]);
            let law = physics.law.cell(&own.law, k);
            collide(&f, held.of(k), physics.drive(own, k), &law, physics.rates).0
        };
        for row in &rows.bulk {
            let (f, kinds) = (source.arriving(&row.beside), self.kinds[slot][usize::from(row.row)]);
            let own = physics.own(&source, row.first());
            show(&f, Held::Whole, &own, row.row, kinds);
            if let Some(loads) = &mut loads {
                let leaving = |k| leave(&f, Held::Whole, &own, k);
                source.bear(row.first(), kinds.wet(), None, &f, leaving, loads);
            }
        }
        for row in &rows.surface {
            let mut f = source.arriving(&row.beside);
            let own = physics.own(&source, row.first());
            let ready =
                source.surface(&surface, row, physics, &own, &mut f, fill, &mut mass, borne, &mut swept);
            let held = ready.held;
            if !physics.law.row(&own.law).is_newtonian() {
                let (mut pair, mut holds): ([Pair<T>; 1], [Pair<T, HOLDS>; 1]) = bytemuck::Zeroable::zeroed();
                pair[0].put(0, &f);
                holds[0].put(0, &held);
                let (own, row) = ([[own.or(&ready.asked), own.or(&ready.asked)]], std::slice::from_ref(row));
                yield_at_walls(&source, row, &[ready.slides], &holds, &own, physics, &mut pair);
                f = pair[0].row(0);
            }
            let braked = row.caged.then(|| source.braked(row.first(), held, physics.gravity, &f)).flatten();
            let own = own.or(&braked);
            show(&f, held.into(), &own, row.row, row.kinds);
            if let Some(loads) = &mut loads {
                if let Some(braked) = &braked {
                    source.bear_cages(
                        row.first(),
                        row.kinds.wet(),
                        held,
                        &f,
                        physics.drive_row(&own),
                        braked,
                        loads,
                    );
                }
                let contacts = source.contacts(row, row.first());
                let leaving = |k| leave(&f, held.into(), &own, k);
                source.bear(row.first(), row.kinds.wet(), Some((row, &contacts)), &f, leaving, loads);
            }
        }
    }
}
