//! The structure that a thixotropic fluid builds up at rest and loses by shear.
//!
//! Each cell has its own structure lambda, which the fluid carries along (module `carried`), and by it its own yield stress
//! (1 + lambda) tau0: in the collision, at walls, and in what is shown. How it comes and goes is told by
//! `tremie_rheology::Thixotropy`, for the shear rate that the next collision will use. That is worth its own look at all cells, but not in each
//! step: structure takes seconds, a step a fraction of a millisecond.

use rayon::prelude::*;

use crate::fluid::Fluid;
use crate::grid::Grid;
use crate::lanes::{LANES, Lanes};
use crate::real::{Number, Real};
use crate::relaxation::{Bingham, Law};
use crate::rows::Rows;
use crate::topology::CELLS;

/// Steps between two looks. Odd, because what is left of an impulse in a rigid cell alternates between steps.
pub(crate) const STRUCTURE: u64 = 5;

/// A Bingham fluid whose yield stress each cell's structure raises.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Structured<T>(pub(crate) Bingham<T>);

impl<T: Real> Law<T> for Structured<T> {
    /// 1 + lambda.
    type Own = Lanes<T>;
    type Row<'a> = Bingham<Lanes<T>>;
    type Cell<'a> = Bingham<T>;

    const BY_ROW: bool = false;

    #[inline(always)]
    fn own(&self, structure: &[f64], first: usize) -> Lanes<T> {
        let mut own = Lanes::ONE;
        for (own, structure) in own.0.iter_mut().zip(&structure[first..][..LANES]) {
            *own = T::from_f64(1.0 + structure);
        }
        own
    }

    #[inline(always)]
    fn row(&self, own: &Lanes<T>) -> Bingham<Lanes<T>> {
        self.0.grown(*own)
    }

    #[inline(always)]
    fn cell(&self, own: &Lanes<T>, lane: usize) -> Bingham<T> {
        self.0.grown(own.0[lane])
    }
}

impl<T: Real> Fluid<T> {
    /// Gives each cell its next structure, from its own and its shear rate in lattice units.
    pub(crate) fn restructure(
        &self,
        grid: &mut Grid<T>,
        rows: &[Rows],
        next: impl Fn(f64, f64) -> f64 + Sync,
    ) {
        let slots: Vec<usize> = grid.slots().collect();
        let of_block = |slot: usize| -> Vec<f64> {
            let mut structure = grid.carried.structure(slot).to_vec();
            self.moments(grid, slot, &rows[slot], None, |cell, m, omega| {
                structure[cell] = next(structure[cell], omega.to_f64() * m.q.to_f64());
            });
            structure
        };
        let structures: Vec<Vec<f64>> = slots.par_iter().map(|slot| of_block(*slot)).collect();
        for (slot, structure) in slots.into_iter().zip(structures) {
            debug_assert_eq!(structure.len(), CELLS);
            grid.carried.restructure(slot, &structure);
        }
    }
}
