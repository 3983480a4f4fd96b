//! Walls along which the fluid slides.
//!
//! How fast it slides is told by the wall stress tau_w (kinematic, lattice units): by the slip length l and the shear rate s of the
//! flow curve after Navier (1823), or by a film with a yield stress and a viscosity over its thickness, as concrete slides
//! in pipes (Kaplan 2001):
//!
//! ```text
//!     v = l s(tau_w)        v = (tau_w - tau_i)/k, not negative
//! ```
//!
//! At a flat wall along the lattice, populations return from a wall that moves with v ([`sliding_velocity`]); the wall stress falls as v
//! rises, by the momentum that the wall then takes less, and v is found for which the two agree. Both are local, and no
//! velocity gradient is taken. (Blending bounce-back with specular reflection by l/(3 nu + l), Svec 2013, Eq. 4.14, takes the
//! stress from the cell's centre, half a cell from the wall: an error of the order of a cell over the width, and nothing slides whose
//! centre has not yielded, as a plug does on a film.)
//!
//! The stress is that of a flow across which one wall shears (module `wall`). Of what drives the fluid, pressure is what is left of the force without
//! what speeds the cell up, as its momentum tells. In an edge, two walls share what drives it, and how is not known: there the stress is that of a
//! steady flow, wrong by up to a quarter of the driving force of a cell, which is of the first order in the cell's size.
//! In an edge between two walls the fluid slides along the edge only.
//!
//! Bounce-back would send back what the flow carries along of the stress (module `collision`). At the wall of a sheared flow,
//! which goes at v there with the shear rate s, that is the odd moment `sum c_t c_t c_n f` = -2 v (tau_w + (1/omega_odd - 1/2) s/3): the second part is what the
//! odd moments lag behind by, as they relax, where `rho u u` changes from cell to cell. (Without it a plug that slides far has normal stresses at the wall that let it yield, and
//! shears 14 % too little, where omega_odd is 1/2.)
//!
//! Surfaces that are not along the lattice are left to module `contact`.

use tremie_case::Surface;

use crate::collision::{COMPONENT, Drive, Held, Rates, moments};
use crate::lanes::{Lanes, bits};
use crate::lattice::{C, opposite};
use crate::processor::for_this_processor;
use crate::real::{Number, Real, larger};
use crate::relaxation::{Law, Relaxation};
use crate::rows::SurfaceRow;
use crate::scaling::Scaling;
use crate::solids::{Contact, Contacts, Touching};
use crate::source::Source;
use crate::together::{Own, Physics, Populations};
use crate::wall::{FACES, SLANTED, sliding_velocity, tangents};

/// Turns in which the sliding velocity is found: once for the shear, once more for what else the cell bears.
const TURNS: usize = 2;

/// What a wall resists sliding with, in lattice units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Friction {
    /// As the fluid itself would beyond the wall, over this length.
    Navier(f64),
    /// A film.
    Film {
        /// Kinematic yield stress.
        yield_stress: f64,
        /// Kinematic viscosity over its thickness.
        viscosity: f64,
    },
}

/// The cells of a row that rub along a flat wall.
#[derive(Debug, Clone, Copy, Default)]
struct Rubbing {
    /// Those that slide along each of the two tangents.
    along: [u8; 2],
    /// Those of them at which no other wall is along the tangent.
    alone: [u8; 2],
    /// Friction of the side of the domain there.
    side: Option<Friction>,
}

impl Friction {
    /// That of a surface; none where the fluid sticks or slides freely.
    pub(crate) fn new(surface: Surface, scaling: &Scaling) -> Option<Self> {
        match surface {
            Surface::NoSlip | Surface::FreeSlip => None,
            Surface::Navier { slip_length } => Some(Self::Navier(slip_length / scaling.cell_size)),
            Surface::Film { yield_stress, viscosity } => Some(Self::Film {
                yield_stress: scaling.stress(yield_stress),
                viscosity: scaling.stress(viscosity) * scaling.velocity_unit(),
            }),
        }
    }

    /// Speed of fluid that a wall stress drives along the wall.
    #[inline(always)]
    pub(crate) fn speed<T: Number, R: Relaxation<T>>(self, stress: T, law: &R) -> T {
        match self {
            Self::Navier(length) => T::from_f64(length) * law.rate(stress),
            Self::Film { yield_stress, viscosity } => {
                let driving = stress - T::from_f64(yield_stress);
                larger(driving, T::ZERO) / T::from_f64(viscosity)
            }
        }
    }
}

/// The surface along the lattice that faces the way `normal` along an axis.
fn facing(touching: &Touching, axis: usize, normal: i32) -> Option<&Contact> {
    let towards = |c: &&Contact| c.along_lattice() && f64::from(normal) * c.normal[axis] > 0.5;
    touching.iter().flatten().find(towards)
}

impl<T: Real> Source<'_, T> {
    /// Cells of a row at flat walls along which they slide with friction, for each face; none in most rows.
    fn rubbing(&self, row: &SurfaceRow, contacts: &Contacts) -> [Rubbing; 6] {
        let mut rubbing = [Rubbing::default(); 6];
        for (face, (axis, normal)) in FACES.into_iter().enumerate() {
            // The velocity from the wall, and whose wall it is.
            let i = 2 * axis + if normal == 1 { 1 } else { 2 };
            let side = self.topology.frictions[axis][usize::from(normal != 1)];
            let of_side = if side.is_some() { !row.immersed[i] } else { 0 };
            let rough = |k: usize| self.friction(facing(&contacts[k], axis, normal)).is_some();
            let wall = row.solid[i] & (of_side | row.immersed[i] & bits(rough));
            if wall == 0 {
                continue;
            }
            for (n, t) in tangents(axis).into_iter().enumerate() {
                let [a, b] = SLANTED[face][n];
                // Fluid goes on both ways.
                let open = !(row.solid[2 * t + 1] | row.solid[2 * t + 2]);
                let aside = tangents(axis)[1 - n];
                let edge = row.solid[2 * aside + 1] | row.solid[2 * aside + 2];
                rubbing[face].along[n] = wall & row.solid[a] & row.solid[b] & open;
                rubbing[face].alone[n] = rubbing[face].along[n] & !edge;
            }
            rubbing[face].side = side;
        }
        rubbing
    }

    /// Friction of the solid that a cell is in contact with.
    fn friction(&self, contact: Option<&Contact>) -> Option<Friction> {
        contact.and_then(|contact| self.solids.friction(contact.solid))
    }
}

for_this_processor! {
    /// Lets the cells of a row at flat walls with friction slide; adds them to `slides`, for each face.
    pub(crate) slide_at_walls = slide_at_walls_here<T: Real, R: Law<T>>(
        source: &Source<'_, T>,
        row: &SurfaceRow,
        contacts: &Contacts,
        physics: &Physics<T, R>,
        own: &Own<'_, T, R>,
        held: Held<Lanes<T>>,
        f: &mut Populations<T>,
        slides: &mut [u8; 6]
    )
}

#[inline(always)]
fn slide_at_walls_here<T: Real, R: Law<T>>(
    source: &Source<'_, T>,
    row: &SurfaceRow,
    contacts: &Contacts,
    physics: &Physics<T, R>,
    own: &Own<'_, T, R>,
    held: Held<Lanes<T>>,
    f: &mut Populations<T>,
    slides: &mut [u8; 6],
) {
    let first = row.first();
    let law = physics.law.row(&own.law);
    for (face, Rubbing { along, alone, side }) in source.rubbing(row, contacts).into_iter().enumerate() {
        let (axis, normal) = FACES[face];
        let friction = |k: usize| source.friction(facing(&contacts[k], axis, normal)).or(side);
        let mut left = along[0] | along[1];
        slides[face] |= left;
        // The cells along walls of one friction at once.
        while left != 0 {
            let of_first = friction(left.trailing_zeros() as usize);
            let cells = left & bits(|k| friction(k) == of_first);
            left &= !cells;
            if let Some(friction) = of_first {
                let leaving = std::array::from_fn(|i| source.own.lanes(i, first));
                let drive = physics.drive_row(own);
                let speed = |stress: Lanes<T>| friction.speed(stress, &law);
                slide(
                    f,
                    &leaving,
                    face,
                    cells,
                    along.map(|along| along & cells),
                    alone,
                    held,
                    drive,
                    &law,
                    physics.rates.of_row(),
                    speed,
                );
            }
        }
    }
}

/// Lets some cells of a row slide along a face at the speed `slides` of the wall stress; those that do so `along` each of the two tangents.
#[inline(always)]
fn slide<T: Real, R: Relaxation<Lanes<T>>>(
    f: &mut Populations<T>,
    leaving: &Populations<T>,
    face: usize,
    cells: u8,
    along: [u8; 2],
    alone: [u8; 2],
    held: Held<Lanes<T>>,
    drive: Drive<Lanes<T>>,
    law: &R,
    rates: Rates<Lanes<T>>,
    slides: impl Fn(Lanes<T>) -> Lanes<T>,
) {
    let (axis, normal) = FACES[face];
    let away = 2 * axis + if normal == 1 { 1 } else { 2 };
    let sign = Lanes::from_f64(-f64::from(normal));
    let none = [Lanes::ZERO; 2];
    // The wall's velocity adds to the momentum that speeds the fluid up.
    let gains = Lanes::ONE.only(alone[0] | alone[1]);
    let mut sliding = None;
    for _ in 0..TURNS {
        let m = moments(f, held, drive);
        let (mut stress, mut left, mut taken, mut force) = (none, none, none, none);
        for (n, t) in tangents(axis).into_iter().enumerate() {
            let [a, b] = SLANTED[face][n];
            stress[n] = (sign * m.stress[COMPONENT[axis][t]]).only(along[n]);
            left[n] = (sign * m.stress_left(leaving, axis, t)).only(along[n]);
            taken[n] = (f[b] + leaving[opposite(b)] - f[a] - leaving[opposite(a)]).only(along[n]);
            // What of it does not speed the fluid up; in an edge another wall takes part.
            let steady = momentum(leaving, t) - m.momentum[t];
            force[n] = Lanes::choose(alone[n], steady, m.force[t]).only(along[n]);
        }
        let [more, traction] = sliding_velocity(&m, stress, left, taken, force, gains, law, &slides, sliding);
        let before = sliding.unwrap_or(none);
        let size = larger((traction[0] * traction[0] + traction[1] * traction[1]).sqrt(), Lanes::TINY);
        let fluidity = law.rate(size) / size;
        let lags = Lanes::ONE / m.omega_odd(law, drive, rates) - Lanes::from_f64(0.5);
        let carries = Lanes::ONE + Lanes::from_f64(1.0 / 3.0) * lags * fluidity;
        for (n, [a, b]) in SLANTED[face].into_iter().enumerate() {
            let push = Lanes::from_f64(1.0 / 6.0) * more[n];
            let carried = carries * traction[n] * more[n];
            f[a] = Lanes::choose(cells, f[a] + (push - carried), f[a]);
            f[b] = Lanes::choose(cells, f[b] - (push + carried), f[b]);
            f[away] = Lanes::choose(cells, f[away] + (carried + carried), f[away]);
        }
        sliding = Some([before[0] + more[0], before[1] + more[1]]);
    }
}

/// Momentum of populations along an axis.
#[inline(always)]
fn momentum<T: Real>(f: &Populations<T>, axis: usize) -> Lanes<T> {
    (1..f.len()).fold(Lanes::ZERO, |sum, i| match C[i][axis] {
        0 => sum,
        1 => sum + f[i],
        _ => sum - f[i],
    })
}
