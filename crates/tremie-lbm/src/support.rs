//! How much of an interface cell's weight what is around it bears.
//!
//! On the lattice an interface cell has the inertia of a full one, but weighs by its fill phi (module `collision`). In fluid that is held this is right: the fluid below bears
//! phi rho g, no more. But what nothing holds would fall by phi g there, as if the surface was weighed down by the empty parts of its cells, and would hold back
//! all beside it: a ball of ten cells across, let go, would fall by 0.75 g. So an interface cell weighs
//!
//! ```text
//!     rho g (1 - s (1 - phi))        s = b/phi
//! ```
//!
//! where b rho g is what it is borne by: the momentum that it gets from its neighbours and from walls, and what bodies and bars push, against gravity. In fluid at rest b = phi,
//! so that s = 1; in what falls freely s = 0. In between, where fluid of mass phi falls by the acceleration a, it is borne by phi (g - a), so that s = 1 - a/g, and the cell falls by a, too; and where it is slowed down s > 1, and
//! its empty part does not press on what slows it.
//!
//! What the flow carries along is no force: of the momentum that links bring, `rho (u . grad) u` is taken off. The rest rings, as sound and as the waves of fluid that does not yield, and to give a cell force by
//! what rings, late by however little, drives that on. (So do the eigenvalues of a layer on the lattice say; at once, without delay, they grow as well, from a quarter of the force on.) Three things keep it from that:
//!
//! - b is a mean over some tens of steps, and s has bounds.
//! - A cell whose speed is far below `sqrt(g h)`, h being its width, is held: what is not held is faster before it has fallen by a tenth of its width. What rings after a fall is slower. Without this a stiff slump never
//!   comes to rest.
//! - What is nearly empty is held.
//!
//! Velocities between steps (modules `plane` and `contact`) take half of the force by the fill, as if the cell was held: they are off by half of what gravity does in a step at most.
//!
//! With this the ball has 0.96 of the speed of free fall after 0.28 s; with cells half as wide 0.98.

use crate::grid::{Borne, Grid, Shape, VELOCITY};
use crate::lanes::{Lanes, bits};
use crate::lattice::{C, each_pair};
use crate::plane::velocities;
use crate::real::{Number, Real, by_axis, larger, smaller};
use crate::rows::{BulkRow, Rows, SurfaceRow};
use crate::source::{Shapes, Source};
use crate::surface::Cell;
use crate::together::{Driving, Populations, Pushes, Weight};

/// Share by which the mean follows what a step finds.
const RATE: f64 = 0.05;
/// Largest support: that of a cell that is slowed down by gravity.
const HARD: f64 = 2.0;
/// Fill below which the mean tells less and less by what share a cell is held: an empty one is.
const LEAST_FILL: f64 = 0.1;
/// Squares of speeds over the product of gravity and the width of a cell, below which a cell is held, and above which it need not be.
const SLOW: f64 = 0.03;
const FAST: f64 = 0.1;

/// What a cell of this fill and support weighs, over what a full one does.
#[inline(always)]
pub(crate) fn weighs<N: Number>(fill: N, support: N) -> N {
    N::ONE - support * (N::ONE - fill)
}

/// Squares of the speeds of the cells of a row, over the product of gravity and the width of a cell.
#[inline(always)]
fn froude<T: Real>(shape: &Shape<T>, first: usize, gravity: [T; 3]) -> Lanes<T> {
    let u = by_axis(|a| shape.lanes(VELOCITY + a, first));
    let square = gravity[0] * gravity[0] + gravity[1] * gravity[1] + gravity[2] * gravity[2];
    Lanes::splat(T::ONE / larger(square.sqrt(), T::TINY)) * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
}

/// Cells of a row so slow that they are held.
#[inline(always)]
fn slow<T: Real>(shape: &Shape<T>, first: usize, gravity: [T; 3]) -> u8 {
    let froude = froude(shape, first, gravity);
    bits(|k| froude.0[k] < T::from_f64(SLOW))
}

impl Rows {
    /// Whether any interface cell is too fast to be held for sure.
    pub(crate) fn any_fast<T: Real>(&self, shape: &Shape<T>, gravity: [T; 3]) -> bool {
        if gravity == [T::ZERO; 3] {
            return false;
        }
        let mut rows = self.surface.iter().filter(|row| row.kinds.interface != 0);
        rows.any(|row| row.kinds.interface & !slow(shape, row.first(), gravity) != 0)
    }
}

/// Finds how fast the liquid beside the interface goes.
#[inline(always)]
pub(crate) fn see_shores<T: Real>(
    source: &Source<'_, T>,
    rows: &Rows,
    gravity: [T; 3],
    shape: &mut Shape<T>,
) {
    let bulk = rows.bulk.iter().filter(|row| row.shore).map(BulkRow::first);
    let surface = rows.surface.iter().filter(|row| row.shore && row.kinds.interface == 0);
    for first in bulk.chain(surface.map(SurfaceRow::first)) {
        let f = std::array::from_fn(|i| source.own(i, first));
        let moves = velocities(&f, Lanes::ONE, Weight(gravity).row(0));
        for axis in 0..3 {
            shape.put(VELOCITY + axis, first, moves[axis]);
        }
    }
}

impl<T: Real> Source<'_, T> {
    /// Support of the interface cells of a row.
    #[inline(always)]
    pub(crate) fn support(
        &self,
        surface: &Shapes<'_, T>,
        first: usize,
        gravity: [T; 3],
        mass: Lanes<T>,
        borne: &Borne<T>,
    ) -> Lanes<T> {
        let within = |x: Lanes<T>, most: f64| larger(smaller(x, Lanes::from_f64(most)), Lanes::ZERO);
        let beyond = Lanes::from_f64(FAST) - froude(surface.own, first, gravity);
        let slow = within(beyond * Lanes::from_f64(1.0 / (FAST - SLOW)), 1.0);
        let least = Lanes::from_f64(LEAST_FILL);
        let borne = borne.lanes(0, first) + larger(least - mass, Lanes::ZERO);
        let support = within(borne / larger(mass, least), HARD);
        support + slow * (Lanes::ONE - support)
    }

    /// Sees by what the interface cells of a row are borne, where `f` has arrived and these forces push.
    #[inline(always)]
    pub(crate) fn see_borne(
        &self,
        surface: &Shapes<'_, T>,
        row: &SurfaceRow,
        gravity: [T; 3],
        f: &Populations<T>,
        push: Option<&Pushes<T>>,
        mass: Lanes<T>,
        borne: &mut Borne<T>,
    ) {
        let square = gravity[0] * gravity[0] + gravity[1] * gravity[1] + gravity[2] * gravity[2];
        let first = row.first();
        let slow = slow(surface.own, first, gravity);
        if square == T::ZERO || slow | !row.kinds.interface == 0xff {
            borne.put(0, first, Lanes::choose(row.kinds.interface, mass, Lanes::ONE));
            return;
        }
        let mut gained = by_axis(|a| match push {
            None => Lanes::ZERO,
            Some(push) => Lanes(std::array::from_fn(|k| push[k][a])),
        });
        let mut density = Lanes::ONE + f[0];
        each_pair!(P, {
            let (a, b) = (2 * P + 1, 2 * P + 2);
            density += f[a] + f[b];
            let net = f[a] + self.own(b, first) - f[b] - self.own(a, first);
            let c = const { C[2 * P + 1] };
            for axis in 0..3 {
                match c[axis] {
                    0 => {}
                    1 => gained[axis] += net,
                    _ => gained[axis] -= net,
                }
            }
        });
        let u = by_axis(|a| surface.own.lanes(VELOCITY + a, first));
        let half = Lanes::from_f64(0.5) * density;
        for axis in 0..3 {
            // By the first of the two comes what lies below. Where there is no fluid it goes as here.
            let there = |i: usize, a: usize| {
                let wet = row.liquid[i] | row.faces[i - 1] & !row.missing[i];
                Lanes::choose(wet, surface.pull(&row.beside, C[i], VELOCITY + a), u[a])
            };
            let (below, above) = (2 * axis + 1, 2 * axis + 2);
            for a in 0..3 {
                gained[a] += half * u[axis] * (there(above, a) - there(below, a));
            }
        }
        let against = by_axis(|a| Lanes::splat(-gravity[a] / square) * gained[a]);
        let now = (against[0] + against[1] + against[2]) / density;
        let rate = Lanes::from_f64(RATE);
        let mean = borne.lanes(0, first);
        let mean = Lanes::choose(slow, mass, mean + rate * (now - mean));
        borne.put(0, first, Lanes::choose(row.kinds.interface, mean, Lanes::ONE));
    }
}

impl<T: Real> Grid<T> {
    /// Lets cells that are to become interface begin as borne as the interface beside them is, or else held.
    pub(crate) fn begin_borne(&mut self, cells: &[Cell]) {
        let begin = |cell: &Cell| {
            let beside: Vec<Cell> = self
                .around(*cell)
                .map(|(beside, _)| beside)
                .filter(|beside| self.is_interface(*beside))
                .collect();
            let sum: f64 = beside.iter().map(|(slot, at)| self.borne[*slot][(0, *at)].to_f64()).sum();
            if beside.is_empty() { 1.0 } else { sum / beside.len() as f64 }
        };
        let begun: Vec<f64> = cells.iter().map(begin).collect();
        for ((slot, at), mean) in cells.iter().zip(begun) {
            self.borne[*slot][(0, *at)] = T::from_f64(mean);
        }
    }
}
