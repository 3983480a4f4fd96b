//! Quantities that the fluid carries along: the share of a batch in it, the structure that it has built up.
//!
//! Each cell holds an amount A of each quantity beside the mass M that carries it; the value is A/M. In a step the mass F that passes each link, the
//! same that `transport` moves (positive into the cell), takes with it the value at the middle of the link,
//!
//! ```text
//!     A += sum over links of F v        v = v_donor + 1/2 c . slope_donor, and between the values of donor and taker
//! ```
//!
//! with slopes limited along each axis (monotonised central differences, van Leer 1977), so that nothing is spread by more than
//! a second-order error. What one cell gains the other loses, to the bit. Mass that cells hand to each
//! other when they convert takes its value with it. All other mass, what rounding took or a wall gave back, has the value of the
//! cell that it comes to.
//!
//! No value leaves its range: that of shares is 0 to 1, that of the structure is what there was in the cell and around it. (More mass may pass through
//! a cell of the surface than it holds, and its amount be out of all proportion for a while.) Where batches are all of the fluid, their shares make up 1: such a cell would
//! else send away a multiple of what rounding has made of their sum, and step by step more of it.

use rayon::prelude::*;

use crate::grid::{AT_ONCE, Fill, Grid, Kinds};
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, Q, opposite};
use crate::processor::for_this_processor;
use crate::real::{Number, Real, larger, smaller};
use crate::rows::{Beside, Rows, first_of};
use crate::source::{Shapes, Source, Surroundings};
use crate::surface::Cell;
use crate::topology::{CELLS, EDGE, Links, OUTSIDE, ROWS};
use crate::transport::fluxes;
use crate::values::Values;

/// Mass in cells below which a cell keeps its values: amounts so small tell none.
const LEAST: f64 = 1e-6;
/// The range of shares, and of structure.
const SHARE: [f64; 2] = [0.0, 1.0];
const ANY: [f64; 2] = [0.0, f64::INFINITY];

/// A quantity as it is before a step moves it, by slot.
#[derive(Debug, Clone, Default)]
struct Told {
    values: Vec<Box<Fill<f64>>>,
    /// Along x, y and z, and these as a mirror turns them round.
    slopes: Vec<Box<Values<f64, 6>>>,
}

/// Where slopes begin that a mirror has turned round.
const TURNED: usize = 3;

/// The same around a block.
#[derive(Clone, Copy)]
struct Around<'a> {
    values: Surroundings<'a, f64, 1>,
    slopes: Surroundings<'a, f64, 6>,
}

impl Told {
    fn around<'a>(&'a self, links: &'a Links, slot: usize) -> Around<'a> {
        Around {
            values: Surroundings::new(links, &self.values, slot),
            slopes: Surroundings::new(links, &self.slopes, slot),
        }
    }
}

/// What a block carries; quantity q of a cell is at `q CELLS + cell`.
#[derive(Debug, Clone, Default, PartialEq)]
struct Block {
    /// The mass, then each quantity.
    amounts: Vec<f64>,
    values: Vec<f64>,
    /// The values of all its fluid, if they are the same everywhere.
    same: Option<Vec<f64>>,
    /// Between which the structure lies in and around each cell; of no length where the fluid has none.
    bounds: Vec<[f64; 2]>,
}

/// What all blocks carry.
#[derive(Debug, Clone, Default)]
pub(crate) struct Carried {
    /// Number of quantities.
    count: usize,
    /// Which of them is the structure of the fluid (module `structure`), if any.
    structure: Option<usize>,
    /// Whether the batches are all of the fluid.
    whole: bool,
    /// By slot.
    blocks: Vec<Block>,
    /// Each quantity as the next step finds it.
    told: Vec<Told>,
    /// Values of what each inlet brings.
    inflow: Vec<Vec<f64>>,
}

/// The slopes between two differences: their mean, but no more than twice either, and none if they point apart.
#[inline(always)]
fn limited(a: Lanes<f64>, b: Lanes<f64>) -> Lanes<f64> {
    let (half, two) = (Lanes::splat(0.5), Lanes::splat(2.0));
    let size = smaller(half * (a + b).abs(), two * smaller(a.abs(), b.abs()));
    let slope = Lanes::where_greater(a, Lanes::ZERO, size, -size);
    Lanes::where_greater(a * b, Lanes::ZERO, slope, Lanes::ZERO)
}

impl Carried {
    /// Shares of so many batches, which are the `whole` fluid or a part of it, and the structure of the fluid if it is `structured`; `inflow` are the values in what each inlet brings.
    pub(crate) fn new(batches: usize, whole: bool, structured: bool, inflow: Vec<Vec<f64>>) -> Self {
        let structure = structured.then_some(batches);
        let count = batches + usize::from(structured);
        Self { count, structure, whole, blocks: Vec::new(), told: vec![Told::default(); count], inflow }
    }

    /// Without any fluid.
    pub(crate) fn emptied(&self) -> Self {
        Self { blocks: Vec::new(), told: vec![Told::default(); self.count], ..self.clone() }
    }

    /// Whether anything is carried.
    pub(crate) fn any(&self) -> bool {
        self.count > 0
    }

    /// Appends a slot.
    pub(crate) fn push(&mut self) {
        let zeros = |n: usize| if self.count == 0 { Vec::new() } else { vec![0.0; n * CELLS] };
        let block = Block {
            amounts: zeros(self.count + 1),
            values: zeros(self.count),
            same: None,
            bounds: Vec::new(),
        };
        self.blocks.push(block);
        for told in &mut self.told {
            told.values.push(bytemuck::allocation::zeroed_box());
            told.slopes.push(bytemuck::allocation::zeroed_box());
        }
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.blocks.len() * if self.any() { (9 * self.count + 1) * CELLS * size_of::<f64>() } else { 0 }
    }

    /// Value of a quantity in a cell.
    pub(crate) fn value(&self, (slot, cell): Cell, quantity: usize) -> f64 {
        self.blocks[slot].values[quantity * CELLS + cell]
    }

    /// The structure in the cells of a block; of no length where the fluid has none.
    pub(crate) fn structure(&self, slot: usize) -> &[f64] {
        let of = |q: usize| &self.blocks[slot].values[q * CELLS..][..CELLS];
        self.structure.map_or(&[], of)
    }

    /// Puts another structure into the cells of a block.
    pub(crate) fn restructure(&mut self, slot: usize, structure: &[f64]) {
        let Some(q) = self.structure else { return };
        let Block { amounts, values, .. } = &mut self.blocks[slot];
        let (masses, amounts) = amounts.split_at_mut(CELLS);
        for (cell, value) in structure.iter().enumerate() {
            let n = q * CELLS + cell;
            amounts[n] += masses[cell] * (value - values[n]);
            values[n] = *value;
        }
    }

    /// Share of a batch in all that a cell holds by now, before [`Grid::find_values`] has told.
    pub(crate) fn mixed(&self, (slot, cell): Cell, batch: usize) -> f64 {
        let Block { amounts, values, .. } = &self.blocks[slot];
        let mass = amounts[cell];
        let share = if mass > LEAST {
            amounts[(batch + 1) * CELLS + cell] / mass
        } else {
            values[batch * CELLS + cell]
        };
        share.clamp(SHARE[0], SHARE[1])
    }

    fn mass(&self, (slot, cell): Cell) -> f64 {
        self.blocks[slot].amounts[cell]
    }

    /// Gives a cell that holds nothing its values.
    fn begin(&mut self, (slot, cell): Cell, values: &[f64]) {
        let block = &mut self.blocks[slot];
        block.amounts[cell] = 0.0;
        for (q, value) in values.iter().enumerate() {
            block.amounts[(q + 1) * CELLS + cell] = 0.0;
            block.values[q * CELLS + cell] = *value;
        }
    }

    /// Takes along what belongs to the mass that a cell gives to each of others, or gets from them if it is negative; all that there is if the
    /// giver is no longer `alive`.
    pub(crate) fn hand_out(&mut self, from: Cell, takers: &[Cell], share: f64, alive: bool) {
        for q in 0..=self.count {
            for &to in takers {
                let donor = if share > 0.0 { from } else { to };
                let amount = match (alive, q) {
                    (false, _) => self.blocks[from.0].amounts[q * CELLS + from.1] / takers.len() as f64,
                    (true, 0) => share,
                    (true, _) => share * self.value(donor, q - 1),
                };
                self.blocks[to.0].amounts[q * CELLS + to.1] += amount;
                if alive {
                    self.blocks[from.0].amounts[q * CELLS + from.1] -= amount;
                }
            }
        }
    }

    /// Amounts and values of the cells of a block for which `wet` holds; zero elsewhere.
    pub(crate) fn saved(&self, slot: usize, wet: impl Fn(usize) -> bool) -> Vec<f64> {
        let Block { amounts, values, .. } = &self.blocks[slot];
        let all = amounts.iter().chain(values).enumerate();
        all.map(|(n, value)| if wet(n % CELLS) { *value } else { 0.0 }).collect()
    }

    /// Numbers that [`Carried::saved`] gives for a block.
    pub(crate) fn per_block(&self) -> usize {
        if self.any() { (2 * self.count + 1) * CELLS } else { 0 }
    }

    /// Puts back what was saved of a block.
    pub(crate) fn load(&mut self, slot: usize, saved: &[f64]) {
        let block = &mut self.blocks[slot];
        let (amounts, values) = saved.split_at(block.amounts.len());
        block.amounts.copy_from_slice(amounts);
        block.values.copy_from_slice(values);
    }
}

/// Values that go over the links along the velocity `i` into the cells of a row, from where mass comes from.
#[inline(always)]
fn between(told: &Around<'_>, beside: &Beside, first: usize, i: usize, flux: Lanes<f64>) -> Lanes<f64> {
    let (here, there) = (told.values.own.lanes(0, first), told.values.pull(beside, C[i], 0));
    let (mut from_here, mut from_there) = (here, there);
    for a in (0..3).filter(|a| C[i][*a] != 0) {
        let half = Lanes::splat(0.5 * f64::from(C[i][a]));
        from_here -= half * told.slopes.own.lanes(a, first);
        let seen = |flip: u8| a + if flip >> a & 1 == 1 { TURNED } else { 0 };
        from_there += half * told.slopes.pull_seen(beside, C[i], seen);
    }
    let middle = Lanes::where_greater(flux, Lanes::ZERO, from_there, from_here);
    smaller(larger(middle, smaller(here, there)), larger(here, there))
}

/// Adds something to the amounts that lie from one on in the cells of a row.
#[inline(always)]
fn add(amounts: &mut [f64], first: usize, more: Lanes<f64>) {
    for (amount, more) in amounts[first..first + LANES].iter_mut().zip(more.0) {
        *amount += more;
    }
}

/// Moves what goes with the mass that comes into the cells of a row along the velocity `i`.
#[inline(always)]
fn pass<T: Real>(
    told: &[Around<'_>],
    same: Option<&[f64]>,
    beside: &Beside,
    first: usize,
    i: usize,
    flux: Lanes<T>,
    amounts: &mut [f64],
) {
    let flux = Lanes([0, 1, 2, 3, 4, 5, 6, 7].map(
        #[inline(always)]
        |k: usize| flux.0[k].to_f64(),
    ));
    add(amounts, first, flux);
    for q in 0..told.len() {
        let value = match same {
            Some(same) => Lanes::splat(same[q]),
            None => between(&told[q], beside, first, i, flux),
        };
        add(amounts, (q + 1) * CELLS + first, flux * value);
    }
}

for_this_processor! {
    /// Moves what a block carries along with the mass that moves; `same` are the values of all of it and of what is around, if they are the same everywhere.
    carry_block = carry_block_here<T: Real>(
        source: &Source<'_, T>,
        surface: &Shapes<'_, T>,
        told: &[Around<'_>],
        same: Option<&[f64]>,
        rows: &Rows,
        amounts: &mut [f64]
    )
}

#[inline(always)]
fn carry_block_here<T: Real>(
    source: &Source<'_, T>,
    surface: &Shapes<'_, T>,
    told: &[Around<'_>],
    same: Option<&[f64]>,
    rows: &Rows,
    amounts: &mut [f64],
) {
    for row in &rows.bulk {
        let first = row.first();
        let f = source.arriving(&row.beside);
        for i in 1..Q {
            let flux = f[i] - source.own(opposite(i), first);
            pass(told, same, &row.beside, first, i, flux, amounts);
        }
    }
    for row in &rows.surface {
        let first = row.first();
        let f = source.arriving(&row.beside);
        for i in 1..Q {
            // Beside liquid there is liquid, interface or solid.
            let lanes = row.kinds.liquid & !row.solid[i];
            if lanes != 0 {
                let flux = (f[i] - source.own(opposite(i), first)).only(lanes);
                pass(told, same, &row.beside, first, i, flux, amounts);
            }
        }
        if row.kinds.interface != 0 {
            fluxes(
                source,
                surface,
                row,
                &f,
                #[inline(always)]
                |i, flux| pass(told, same, &row.beside, first, i, flux.only(row.kinds.interface), amounts),
            );
        }
    }
}

/// The values of all the fluid in a block, if they are the same everywhere.
fn same_values(values: &[f64], kinds: &[Kinds; ROWS]) -> Option<Vec<f64>> {
    let wet = |cell: &usize| kinds[cell / EDGE].wet() >> (cell % EDGE) & 1 == 1;
    let of = |cell: usize| values.iter().skip(cell).step_by(CELLS);
    let first = (0..CELLS).find(wet)?;
    (first..CELLS).filter(wet).all(|cell| of(cell).eq(of(first))).then(|| of(first).copied().collect())
}

for_this_processor! {
    /// Finds the slopes of a quantity in a block; none where there is no fluid on either side.
    find_slopes = find_slopes_here<>(values: &Surroundings<'_, f64, 1>, rows: &Rows, slopes: &mut Values<f64, 6>)
}

#[inline(always)]
fn find_slopes_here(values: &Surroundings<'_, f64, 1>, rows: &Rows, slopes: &mut Values<f64, 6>) {
    for row in &rows.bulk {
        slopes_of_row(values, &row.beside, row.row, [0xff; 3], slopes);
    }
    for row in &rows.surface {
        // Beside liquid there is liquid, interface or solid.
        let wet = |i: usize| row.kinds.liquid & !row.solid[i] | row.liquid[i] | row.interface[i];
        let between = [wet(1) & wet(2), wet(3) & wet(4), wet(5) & wet(6)];
        slopes_of_row(values, &row.beside, row.row, between, slopes);
    }
}

/// The same in a row, along each axis in those cells that lie `between` fluid.
#[inline(always)]
fn slopes_of_row(
    values: &Surroundings<'_, f64, 1>,
    beside: &Beside,
    row: u8,
    between: [u8; 3],
    slopes: &mut Values<f64, 6>,
) {
    let here = values.own.lanes(0, first_of(row));
    let slopes = slopes.row_mut(usize::from(row));
    for a in 0..3 {
        let [low, high] = [values.pull(beside, C[2 * a + 1], 0), values.pull(beside, C[2 * a + 2], 0)];
        let slope = limited(here - low, high - here).only(between[a]);
        (slopes[a], slopes[TURNED + a]) = (slope.0, (-slope).0);
    }
}

/// Least and largest of the values of a quantity in the cells around each cell of a block, and in itself.
fn find_bounds(
    blocks: &[Block],
    kinds: &[[Kinds; ROWS]],
    links: &Links,
    slot: usize,
    q: usize,
) -> Vec<[f64; 2]> {
    let around = |cell: usize| {
        let near = C.iter().filter_map(|c| {
            let (slot, cell, _) = links.cell(cell, *c);
            let wet = kinds[slot as usize][cell / EDGE].wet() >> (cell % EDGE) & 1 == 1;
            wet.then(|| blocks[slot as usize].values[q * CELLS + cell])
        });
        let bounds = near.fold(None, |bounds, value| {
            let [least, most] = bounds.unwrap_or([value; 2]);
            Some([least.min(value), most.max(value)])
        });
        bounds.unwrap_or(ANY)
    };
    let wet = kinds[slot].iter().any(|kinds| kinds.wet() != 0);
    if wet { (0..CELLS).map(around).collect() } else { Vec::new() }
}

impl<T: Real> Grid<T> {
    /// Carries everything along with the mass that the last step moved, and with what came in; that step has left the populations that it
    /// read in `back`, and cells have not been converted yet.
    pub(crate) fn carry(&mut self, rows: &[Rows], poured: &[(Cell, usize, f64)]) {
        if !self.carried.any() {
            return;
        }
        let Self { topology, solids, inlets, links, kinds, back, shape, carried, .. } = self;
        let Carried { blocks, told, .. } = carried;
        blocks.par_iter_mut().zip(&*kinds).skip(2).for_each(|(block, kinds)| {
            block.same = same_values(&block.values, kinds);
        });
        let holds = |slot: usize| rows.get(slot).is_some_and(|rows| !rows.is_empty());
        // Most blocks hold one batch only, and so do those around: all that moves has its values.
        let uniform: Vec<bool> = (0..blocks.len())
            .map(|slot| {
                let same = &blocks[slot].same;
                let mut beside = links[slot].slots.iter().map(|slot| *slot as usize);
                same.is_some() && beside.all(|slot| !holds(slot) || blocks[slot].same == *same)
            })
            .collect();
        for (q, Told { values, slopes }) in told.iter_mut().enumerate() {
            values.par_iter_mut().zip(&*blocks).with_min_len(AT_ONCE).for_each(|(values, block)| {
                let of_block = block.values[q * CELLS..][..CELLS].as_chunks().0;
                (0..ROWS).for_each(|row| values.row_mut(row)[0] = of_block[row]);
            });
            slopes.par_iter_mut().zip(rows).enumerate().skip(2).with_max_len(AT_ONCE).for_each(
                |(slot, (slopes, rows))| {
                    if !uniform[slot] && !rows.is_empty() {
                        find_slopes(&Surroundings::new(&links[slot], values, slot), rows, slopes);
                    }
                },
            );
        }
        if let Some(q) = carried.structure {
            let of = |slot: usize| find_bounds(&carried.blocks, kinds, &links[slot], slot, q);
            let bounds: Vec<_> =
                (0..carried.blocks.len()).into_par_iter().with_max_len(AT_ONCE).map(of).collect();
            for (block, bounds) in carried.blocks.iter_mut().zip(bounds) {
                block.bounds = bounds;
            }
        }
        let mut amounts: Vec<Vec<f64>> =
            carried.blocks.iter_mut().map(|block| std::mem::take(&mut block.amounts)).collect();
        let Carried { blocks, told, .. } = &*carried;
        amounts.par_iter_mut().zip(rows).enumerate().skip(2).with_max_len(AT_ONCE).for_each(
            |(slot, (amounts, rows))| {
                if rows.is_empty() {
                    return;
                }
                let links = &links[slot];
                let source = Source::new(topology, solids, inlets, links, back, slot);
                let surface = Shapes::new(links, shape, slot);
                let told: Vec<Around<'_>> = told.iter().map(|told| told.around(links, slot)).collect();
                let same = blocks[slot].same.as_deref().filter(|_| uniform[slot]);
                carry_block(&source, &surface, &told, same, rows, amounts);
            },
        );
        for (block, amounts) in carried.blocks.iter_mut().zip(amounts) {
            block.amounts = amounts;
        }
        for &((slot, cell), inlet, mass) in poured {
            let block = &mut carried.blocks[slot];
            block.amounts[cell] += mass;
            for (q, value) in carried.inflow[inlet].iter().enumerate() {
                block.amounts[(q + 1) * CELLS + cell] += mass * value;
            }
            if let (Some(q), Some([least, most])) = (carried.structure, block.bounds.get_mut(cell)) {
                let value = carried.inflow[inlet][q];
                (*least, *most) = (least.min(value), most.max(value));
            }
        }
    }

    /// Finds the values from the amounts, for the masses that the cells have by now.
    pub(crate) fn find_values(&mut self) {
        if !self.carried.any() {
            return;
        }
        let batches = self.carried.structure.unwrap_or(self.carried.count);
        let mut blocks = std::mem::take(&mut self.carried.blocks);
        blocks.par_iter_mut().enumerate().skip(2).with_max_len(AT_ONCE).for_each(|(slot, block)| {
            let Block { amounts, values, bounds, .. } = block;
            for cell in 0..CELLS {
                let liquid = self.is_liquid((slot, cell));
                if !self.used[slot] || !(liquid || self.is_interface((slot, cell))) {
                    continue;
                }
                let mass = if liquid { self.liquid_mass((slot, cell)) } else { self.mass[slot][cell] };
                let carried = amounts[cell];
                if carried > LEAST {
                    for q in 0..self.carried.count {
                        let [least, most] = match self.carried.structure {
                            Some(structure) if structure == q => *bounds.get(cell).unwrap_or(&ANY),
                            _ => SHARE,
                        };
                        let amount = amounts[(q + 1) * CELLS + cell];
                        values[q * CELLS + cell] = (amount / carried).clamp(least, most);
                    }
                    let shares = || (0..batches).map(|q| q * CELLS + cell);
                    let all: f64 = shares().map(|n| values[n]).sum();
                    if self.carried.whole && all > 0.0 {
                        shares().for_each(|n| values[n] /= all);
                    }
                }
                for q in 0..self.carried.count {
                    amounts[(q + 1) * CELLS + cell] += (mass - carried) * values[q * CELLS + cell];
                }
                amounts[cell] = mass;
            }
        });
        self.carried.blocks = blocks;
    }

    /// Gives the fluid of the first state its values.
    pub(crate) fn begin_carried(&mut self, values: impl Fn([usize; 3]) -> Vec<f64>) {
        if !self.carried.any() {
            return;
        }
        for slot in self.slots().collect::<Vec<_>>() {
            for cell in 0..CELLS {
                let values = values(self.links[slot].coordinates(cell));
                self.carried.begin((slot, cell), &values);
            }
        }
        self.find_values();
    }

    /// Gives a cell that has just become wet the mean values of the fluid beside it.
    pub(crate) fn begin_values(&mut self, cell: Cell) {
        let mut sums = vec![0.0; self.carried.count];
        let mut all = 0.0;
        for (beside, _) in self.around(cell) {
            if beside.0 > OUTSIDE as usize && (self.is_liquid(beside) || self.is_interface(beside)) {
                let mass = self.carried.mass(beside).max(0.0);
                all += mass;
                for (q, sum) in sums.iter_mut().enumerate() {
                    *sum += mass * self.carried.value(beside, q);
                }
            }
        }
        let values: Vec<f64> = sums.iter().map(|sum| if all > 0.0 { sum / all } else { 0.0 }).collect();
        self.carried.begin(cell, &values);
    }

    /// Amount of a quantity in all fluid.
    pub(crate) fn carried_amount(&self, quantity: usize) -> f64 {
        let blocks = self.slots().flat_map(|slot| (0..CELLS).map(move |cell| (slot, cell)));
        let wet = blocks.filter(|cell| self.is_liquid(*cell) || self.is_interface(*cell));
        wet.map(|(slot, cell)| self.carried.blocks[slot].amounts[(quantity + 1) * CELLS + cell]).sum()
    }
}
