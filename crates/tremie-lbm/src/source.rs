//! What the work on one block reads: its own values and those of the blocks around it, row by row.

use tremie_numerics::DVec3;

use crate::cage::{Arrived, Block, Cages};
use crate::collision::{Drive, Held, density_and_momentum, moments};
use crate::grid::{Field, Fill};
use crate::immersed::{TAKES, Vectors};
use crate::inlet::Inlets;
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, MIRROR, Q, each_pair};
use crate::loads::Loads;
use crate::real::{Number, Real};
use crate::rows::{Beside, upstream};
use crate::solids::Solids;
use crate::tension::Tension;
use crate::together::{HOLDS, Pushes};
use crate::topology::{Links, Topology};
use crate::values::Values;

/// The 27 blocks around and with a block; the last five are never asked for.
type Near<'a, T, const N: usize> = [&'a Values<T, N>; 32];

/// Values of one sort in a block and those around it.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a, T, const N: usize> {
    links: &'a Links,
    /// In the block itself.
    pub(crate) own: &'a Values<T, N>,
    near: Near<'a, T, N>,
    /// Whether rows go on in the blocks before and after as they do in most blocks.
    regular: bool,
    /// Bits of the first and of the last cell of a row. (Looked up, not written out: of lanes that it knows the compiler makes pieces.)
    ends: [u8; 2],
}

impl<'a, T: Real, const N: usize> Surroundings<'a, T, N> {
    pub(crate) fn new(links: &'a Links, all: &'a [Box<Values<T, N>>], slot: usize) -> Self {
        let near = std::array::from_fn(|n| &*all[links.slots[n.min(26)] as usize]);
        let ends = [1, 1 << (usize::from(links.last) & (LANES - 1))];
        Self { links, own: &all[slot], near, regular: links.regular(), ends }
    }

    /// One number of the cells of a row, each taken from the cell at -c, but for the one at the end, if c has a part along rows: that cell
    /// and its number. `seen` tells which number that is beyond mirrors.
    #[inline(always)]
    fn parts<const REGULAR: bool>(
        &self,
        beside: &Beside,
        c: [i32; 3],
        seen: impl Fn(u8) -> usize,
    ) -> (Lanes<T>, Option<(usize, T)>) {
        let beside = &beside[upstream(c)];
        let row = usize::from(beside.row);
        let block = |block: u8| self.near[usize::from(block) & 31];
        let (here, number) = (block(beside.block), seen(beside.flip));
        if c[0] == 0 {
            return (Lanes(here.row(row)[number]), None);
        }
        // What comes into a row at its end is one cell of another row.
        let up = c[0] == 1;
        let (block, step, end) = match up {
            true => (block(beside.low), self.links.before(), 0),
            false => (block(beside.high), self.links.after(), usize::from(self.links.last) & (LANES - 1)),
        };
        let moved = here.moved(number, row, up);
        if REGULAR {
            let (end, from) = if up { (0, LANES - 1) } else { (LANES - 1, 0) };
            return (moved, Some((end, block.row(row)[number][from])));
        }
        let number = seen(beside.flip | step.flip);
        (moved, Some((end, block.row(row)[number][usize::from(step.index) & (LANES - 1)])))
    }

    /// Puts one number of the cells of a row, each taken from the cell at -c, where it is wanted.
    #[inline(always)]
    fn pull_into<const REGULAR: bool>(
        &self,
        beside: &Beside,
        c: [i32; 3],
        seen: impl Fn(u8) -> usize,
        to: &mut [T; LANES],
    ) {
        let (moved, end) = self.parts::<REGULAR>(beside, c, seen);
        *to = moved.0;
        if let Some((at, number)) = end {
            to[at] = number;
        }
    }

    /// The eight values of array `number` for a row, each taken from the cell at -c. Mirrors do not change them.
    ///
    /// What is read again at once has to be put right as a vector: in memory it would wait for both parts.
    #[inline(always)]
    pub(crate) fn pull(&self, beside: &Beside, c: [i32; 3], number: usize) -> Lanes<T> {
        match self.regular {
            true => self.pull_regular(beside, c, number),
            false => self.pull_seen(beside, c, |_| number),
        }
    }

    /// The same of the array that `seen` tells for the mirrors between.
    #[inline(always)]
    pub(crate) fn pull_seen(&self, beside: &Beside, c: [i32; 3], seen: impl Fn(u8) -> usize) -> Lanes<T> {
        self.put_together(c, self.parts::<false>(beside, c, seen))
    }

    /// The same where rows go on as in most blocks.
    #[inline(always)]
    fn pull_regular(&self, beside: &Beside, c: [i32; 3], number: usize) -> Lanes<T> {
        self.put_together(c, self.parts::<true>(beside, c, |_| number))
    }

    /// Puts the end of a row where it belongs.
    #[inline(always)]
    fn put_together(&self, c: [i32; 3], (moved, end): (Lanes<T>, Option<(usize, T)>)) -> Lanes<T> {
        match end {
            Some((_, number)) => Lanes::choose(self.ends[usize::from(c[0] < 0)], Lanes::splat(number), moved),
            None => moved,
        }
    }
}

/// The shape of the surface, and the fill, in a block and those around it.
pub(crate) type Shapes<'a, T> = Surroundings<'a, T, 9>;
pub(crate) type Fills<'a, T> = Surroundings<'a, T, 1>;

/// What the work on one block reads.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a, T: Real> {
    pub(crate) topology: &'a Topology,
    pub(crate) solids: &'a Solids,
    pub(crate) inlets: &'a Inlets,
    pub(crate) links: &'a Links,
    /// Slot of the block.
    pub(crate) slot: usize,
    /// The populations of all blocks, and the block's own.
    all: &'a [Box<Field<T>>],
    pub(crate) own: &'a Field<T>,
    populations: Surroundings<'a, T, Q>,
    /// Whether the fluid slides with friction along anything.
    pub(crate) rubs: bool,
    /// The structure in the block's cells; of no length where the fluid has none.
    pub(crate) structure: &'a [f64],
    /// Forces on the block's cells, where any push.
    pushes: Option<&'a Vectors<T>>,
    /// The cages in the block, where there are any.
    cages: Option<Block<'a>>,
    /// By how much the density of the air is more than 1 in the block's interface cells, where surface tension presses.
    pressed: Option<&'a Fill<T>>,
}

impl<'a, T: Real> Source<'a, T> {
    pub(crate) fn new(
        topology: &'a Topology,
        solids: &'a Solids,
        inlets: &'a Inlets,
        links: &'a Links,
        front: &'a [Box<Field<T>>],
        slot: usize,
    ) -> Self {
        let populations = Surroundings::new(links, front, slot);
        let rubs = topology.rubs() || solids.rub();
        let own = populations.own;
        Self {
            topology,
            solids,
            inlets,
            links,
            slot,
            all: front,
            own,
            populations,
            rubs,
            structure: &[],
            pushes: None,
            cages: None,
            pressed: None,
        }
    }

    /// The same with the structure in the block's cells, and the forces on them.
    pub(crate) fn with(self, structure: &'a [f64], pushes: Option<&'a Vectors<T>>) -> Self {
        Self { structure, pushes, ..self }
    }

    /// The same with the cages in the block.
    pub(crate) fn caged(self, cages: &'a Cages) -> Self {
        Self { cages: Some(cages.block(self.slot)), ..self }
    }

    /// The same with what the surface presses by its tension.
    pub(crate) fn pressed(self, tension: Option<&'a Tension<T>>) -> Self {
        Self { pressed: tension.and_then(|tension| tension.excess(self.slot)), ..self }
    }

    /// By how much the density of the air before a row whose first cell is `first` is more than 1.
    #[inline(always)]
    pub(crate) fn air(&self, first: usize) -> Lanes<T> {
        self.pressed.map_or(Lanes::ZERO, |pressed| pressed.lanes(0, first))
    }

    /// Forces on the cells of a row whose first cell is `first`, with those of cages, and the friction there; none where there is no cage.
    pub(crate) fn braked(
        &self,
        first: usize,
        held: [Lanes<T>; HOLDS],
        gravity: [T; 3],
        f: &[Lanes<T>; Q],
    ) -> Option<Pushes<T>> {
        let cages = self.cages?;
        let mut pushes = self.push(first).copied().unwrap_or([[T::ZERO; 4]; LANES]);
        for (k, push) in pushes.iter_mut().enumerate().filter(|(k, _)| cages.share(first + k) > 0.0) {
            let f: [T; Q] = std::array::from_fn(|i| f[i].0[k]);
            let (excess, momentum) = density_and_momentum(&f);
            let density = 1.0 + excess;
            let [mass, least, support] = held.map(|held| held.0[k].to_f64());
            let (fill, weighs, _) = Held::Partly { mass, least, support }.shares(density);
            let half = |a: usize| 0.5 * (density * weighs * gravity[a].to_f64() + push[a].to_f64());
            let momentum = DVec3::from([0, 1, 2].map(|a| momentum[a] + half(a)));
            let growth = 1.0 + self.structure.get(first + k).copied().unwrap_or(0.0);
            let force = cages.force(self.links, first + k, &Arrived { density, fill, momentum, growth });
            for a in 0..3 {
                push[a] += T::from_f64(force[a]);
            }
            // Bars drive waves as bodies do (module `collision`); those that hold the fluid rub without bounds.
            let velocity = (momentum + 0.5 * force).length() / density;
            push[3] += T::from_f64((force.length() / velocity.max(f64::MIN_POSITIVE)).min(TAKES));
        }
        Some(pushes)
    }

    /// Adds what cages bear of the forces `pushes` on the cells of a row that hold fluid (`wet`), in all of which `drive` acts.
    pub(crate) fn bear_cages(
        &self,
        first: usize,
        wet: u8,
        held: [Lanes<T>; HOLDS],
        f: &[Lanes<T>; Q],
        drive: Drive<Lanes<T>>,
        pushes: &Pushes<T>,
        loads: &mut Loads,
    ) {
        let Some(cages) = self.cages else { return };
        let others = self.push(first);
        let velocity = moments(f, held.into(), drive).velocity;
        for k in (0..LANES).filter(|k| wet >> k & 1 == 1) {
            let speed = DVec3::from(velocity.map(|u| u.0[k].to_f64())).length();
            let other = |a: usize| others.map_or(0.0, |others| others[k][a].to_f64());
            let force = DVec3::from([0, 1, 2].map(|a| pushes[k][a].to_f64() - other(a)));
            let growth = 1.0 + self.structure.get(first + k).copied().unwrap_or(0.0);
            let at = DVec3::from(self.links.coordinates(first + k).map(|n| n as f64)) + 0.5;
            cages.parts(self.links, first + k, growth, speed, force, |cage, force| {
                loads.bear_cage(cage, -force, at);
            });
        }
    }

    /// Forces on the cells of a row, where any push.
    #[inline(always)]
    pub(crate) fn push(&self, first: usize) -> Option<&'a Pushes<T>> {
        self.pushes.map(|pushes| pushes.row(first / LANES))
    }

    /// Whether a row looks into a mirror, or ends elsewhere than in most blocks.
    #[inline(always)]
    fn is_special(&self, beside: &Beside) -> bool {
        beside.mirrored | !self.populations.regular
    }

    /// Populations arriving in a row from the cells around it, whatever these are.
    #[inline(always)]
    pub(crate) fn arriving(&self, beside: &Beside) -> [Lanes<T>; Q] {
        let mut f = [Lanes::ZERO; Q];
        if self.is_special(beside) {
            let mut all = [[[T::ZERO; LANES]]; Q];
            self.arrive_specially(beside, &mut all, 0);
            for i in 0..Q {
                f[i] = Lanes(all[i][0]);
            }
            return f;
        }
        f[0] = self.populations.pull_regular(beside, C[0], 0);
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            let (c, d) = const { (C[2 * P + 1], C[2 * P + 2]) };
            f[a] = self.populations.pull_regular(beside, c, a);
            f[b] = self.populations.pull_regular(beside, d, b);
        });
        f
    }

    /// The same for one of several rows that lie side by side.
    #[inline(always)]
    pub(crate) fn arrive<const ROWS: usize>(
        &self,
        beside: &Beside,
        f: &mut [[[T; LANES]; ROWS]; Q],
        row: usize,
    ) {
        if self.is_special(beside) {
            return self.arrive_specially(beside, f, row);
        }
        self.populations.pull_into::<true>(beside, C[0], |_| 0, &mut f[0][row]);
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            let (c, d) = const { (C[2 * P + 1], C[2 * P + 2]) };
            self.populations.pull_into::<true>(beside, c, |_| a, &mut f[a][row]);
            self.populations.pull_into::<true>(beside, d, |_| b, &mut f[b][row]);
        });
    }

    /// [`Source::arrive`] where rows look into mirrors or end early: few blocks, and not worth a copy in every kernel.
    #[inline(never)]
    fn arrive_specially<const ROWS: usize>(
        &self,
        beside: &Beside,
        f: &mut [[[T; LANES]; ROWS]; Q],
        row: usize,
    ) {
        for i in 0..Q {
            let seen = |flip: u8| usize::from(MIRROR[usize::from(flip & 7)][i]);
            self.populations.pull_into::<false>(beside, C[i], seen, &mut f[i][row]);
        }
    }

    /// Population `i` that left the cell at `-c` of a cell.
    pub(crate) fn left(&self, cell: usize, c: [i32; 3], i: usize) -> T {
        let (slot, there, flip) = self.links.cell(cell, c.map(|c| -c));
        self.all[slot as usize][(usize::from(MIRROR[usize::from(flip & 7)][i]), there)]
    }

    /// The block's own values of a row in the array `i`.
    #[inline(always)]
    pub(crate) fn own(&self, i: usize, first: usize) -> Lanes<T> {
        self.own.lanes(i, first)
    }
}
