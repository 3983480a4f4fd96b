//! What solids inside the domain do to the fluid beside them, and it to them.
//!
//! A population that would enter a solid returns (half-way bounce-back) from a wall with the velocity v, rho being the cell's own density
//! (Ladd 1994):
//!
//! ```text
//!     f_i = f_opposite + 6 w_i rho c_i . v
//! ```
//!
//! Where the fluid sticks, v is the solid's velocity u_s. Where it slides, v keeps the solid's velocity along the true normal n of the surface, and
//! takes that along it for which the wall bears no shear: each cell's links bear what a pressure p would, with the part of the populations left out
//! by which the flow carries itself along,
//!
//! ```text
//!     v.n = u_s.n      sum over links of (2 (f_opposite - f_carried) + 6 w rho c.v - 2 w p) c   has no part across n
//! ```
//!
//! p is the pressure along n that the same sum asks for; in a fluid at rest the density's, in one that stands by its yield stress not.
//! Where it slides with friction (module `friction`), the sum has a part across n: the wall stress, over the area A that the links stand
//! for, that goes with the sliding speed. Surfaces along the lattice are left to that module.
//!
//! On a flat wall along the lattice that keeps the tangential momentum to rounding, as specular reflection does. On others
//! the wall is a staircase, and specular reflection would catch the flow at every step: here mass goes into the steps that face the flow and comes
//! back out of the others, and what a wall seen from afar has smooth, stays smooth. An interface cell may leave a sliding wall freely: it is not drawn after one
//! that recedes. Nor is liquid, if there is air that can come in between: where such a wall would have to pull, v.n is not
//! the solid's but that for which p is zero. What the liquid keeps back thereby is owed by its store, until the wall uncovers a cell: then
//! a gap is left there (`sweep`). (A mould that pulled would tear a slump cone apart: lifted at 1 m/s, by 15 kPa.)
//!
//! The mass that goes into steps and what comes out of them agree over a stretch of the wall, but not in every cell. So each
//! liquid cell at a sliding wall has a store, which gets what the wall takes from the cell by sliding, exchanges with the stores beside
//! it, and is slowly put back into the cell: no mass is lost. What a wall takes by its own motion is another matter (`sweep`).
//!
//! The force on a solid is the momentum that its links exchange (Galilean invariant: Wen, Zhang, Tu, Wang and Fang 2014):
//!
//! ```text
//!     F = sum over links of (c_out - u_s) f_out - (c_in - u_s) f_in
//! ```
//!
//! With f less the weights, pressure counts from that of the air.

use tremie_numerics::{DMat3, DVec3};

use crate::grid::Fill;
use crate::lanes::Lanes;
use crate::lattice::{C, Q, W, opposite};
use crate::real::Real;
use crate::relaxation::Law;
use crate::rows::SurfaceRow;
use crate::solids::{Contact, Contacts};
use crate::source::Source;
use crate::together::Physics;
use crate::topology::CELLS;
use crate::wall::root;

/// What keeps the velocity of a sliding wall from directions in which hardly a link points.
const BLIND: f64 = 0.02;
/// Least area across the normal, in twice the weights of links, that tells the pressure on a wall.
const LEAST_FACING: f64 = 0.05;
/// What [`LEAST_FACING`] is measured by, for a wall along the lattice: the area of a face of a cell.
const AREA: f64 = 1.0 / 3.0;
/// Share of a store that is put back in a step.
const RETURNED: f64 = 5e-5;

/// What solids and fluid exchange in a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Exchange {
    /// Mass that solids take from the liquid by their motion.
    pub(crate) swept: f64,
    /// Force and moment about the origin of coordinates on each solid, in lattice units; not kept if empty.
    pub(crate) loads: Vec<[DVec3; 2]>,
}

fn vector(c: [i32; 3]) -> DVec3 {
    DVec3::from(c.map(f64::from))
}

impl<T: Real> Source<'_, T> {
    /// What the cells of a row beside solids are in contact with.
    #[inline(never)]
    pub(crate) fn contacts(&self, row: &SurfaceRow, first: usize) -> Contacts {
        match &row.contacts {
            Some(contacts) => **contacts,
            None => self.solids.contacts(self.links, first, row.any_immersed),
        }
    }

    /// Lets the cells of a row meet the solids beside them.
    #[inline(never)]
    pub(crate) fn meet_solids<R: Law<T>>(
        &self,
        row: &SurfaceRow,
        first: usize,
        contacts: &Contacts,
        physics: &Physics<T, R>,
        own: &R::Own,
        fill: &Fill<T>,
        f: &mut [Lanes<T>; Q],
        mass: &mut [f64; CELLS],
        exchange: &mut Exchange,
    ) {
        let gravity = DVec3::from(physics.gravity.map(T::to_f64));
        for (k, contact) in contacts.iter().enumerate() {
            let Some(contact) = contact else { continue };
            let cell = first + k;
            let interface = row.kinds.interface >> k & 1 == 1;
            let leaving: [f64; Q] = std::array::from_fn(|i| self.own[(i, cell)].to_f64());
            let links = || (1..Q).filter(|i| row.immersed[*i] >> k & 1 == 1);
            let density = 1.0 + leaving.iter().sum::<f64>();
            let mut wall = contact.velocity;
            let friction = self.solids.friction(contact.solid).filter(|_| !contact.along_lattice());
            let slides = contact.slides || friction.is_some();
            if slides {
                let momentum: DVec3 = (1..Q).map(|i| vector(C[i]) * leaving[i]).sum();
                let fill = if interface { fill[(0, cell)].to_f64().clamp(0.0, 1.0) } else { 1.0 };
                let u = momentum / density - 0.5 * fill * gravity;
                wall = sliding(
                    contact,
                    u,
                    density,
                    interface,
                    self.solids.air,
                    friction.map(|f| {
                        let law = physics.law.cell(own, k);
                        move |stress| f.speed(T::from_f64(stress), &law).to_f64()
                    }),
                    links().map(|i| (i, leaving[opposite(i)])),
                );
            }
            let (mut swept, mut slid) = (0.0, 0.0);
            for i in links() {
                let c = vector(C[i]);
                let gained = 6.0 * W[i] * density * c.dot(wall);
                f[i].0[k] = T::from_f64(leaving[opposite(i)] + gained);
                let by_motion = 6.0 * W[i] * density * c.dot(contact.velocity);
                swept -= by_motion;
                slid -= gained - by_motion;
            }
            if interface {
                continue;
            }
            exchange.swept += swept;
            if slides {
                let returned = RETURNED * mass[cell];
                mass[cell] += slid - returned;
                for i in 0..Q {
                    f[i].0[k] += T::from_f64(W[i] * returned);
                }
            }
        }
    }

    /// Adds up forces and moments on the solids; `f` arrive.
    #[inline(never)]
    pub(crate) fn load_solids(
        &self,
        row: &SurfaceRow,
        first: usize,
        contacts: &Contacts,
        f: &[Lanes<T>; Q],
        loads: &mut [[DVec3; 2]],
    ) {
        for (k, contact) in contacts.iter().enumerate() {
            let Some(contact) = contact else { continue };
            let at = vector(self.links.coordinates(first + k).map(|n| n as i32)) + 0.5;
            for i in (1..Q).filter(|i| row.solid[*i] >> k & 1 == 1) {
                let (arriving, leaving) = (f[i].0[k].to_f64(), self.own[(opposite(i), first + k)].to_f64());
                let c = vector(C[i]);
                let force = if row.immersed[i] >> k & 1 == 1 {
                    (-c - contact.velocity) * leaving - (c - contact.velocity) * arriving
                } else {
                    // Into the edge between a solid and a side of the domain: each bears what is across it.
                    let borne = |a: usize| {
                        let axis = (1..=6).find(|j| C[*j][a] != 0 && C[*j][a] == C[i][a]);
                        f64::from(u8::from(axis.is_some_and(|j| row.immersed[j] >> k & 1 == 1)))
                    };
                    -c * DVec3::new(borne(0), borne(1), borne(2)) * (leaving + arriving)
                };
                let [total, moment] = &mut loads[contact.solid];
                *total += force;
                *moment += (at - 0.5 * c).cross(force);
            }
        }
    }
}

/// Velocity of a sliding wall beside fluid of the velocity `u`, which lets go of the fluid if there is air; `friction` tells the speed at which
/// the fluid slides under a wall stress, if there is any, and `links` are velocities out of the
/// wall with the populations that enter it.
fn sliding(
    contact: &Contact,
    u: DVec3,
    density: f64,
    interface: bool,
    air: bool,
    friction: Option<impl Fn(f64) -> f64>,
    links: impl Iterator<Item = (usize, f64)>,
) -> DVec3 {
    let n = contact.normal;
    let across = |v: DVec3| v - n * v.dot(n);
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let leaves = interface && (u - contact.velocity).dot(n) > 0.0;
    let mut wall = if leaves { u } else { across(u) + n * contact.velocity.dot(n) };
    let (mut traction, mut area) = (DVec3::ZERO, DVec3::ZERO);
    // What the traction grows by with the wall's velocity, and the part of it across the normal.
    let (mut response, mut aside) = (DMat3::ZERO, DMat3::from_diagonal(DVec3::splat(BLIND)));
    for (i, leaving) in links {
        let c = vector(C[i]);
        let weight = 6.0 * W[i] * density;
        // Momentum that the flow carries along is no stress.
        let carried = W[i] * density * (4.5 * c.dot(u).powi(2) - 1.5 * u.length_squared());
        traction += (2.0 * (leaving - carried) + weight * c.dot(wall)) * c;
        area += 2.0 * W[i] * c;
        response += weight * outer(c);
        aside += weight * outer(across(c));
    }
    let facing = area.dot(n);
    let pull = -traction.dot(n);
    if air && contact.velocity.dot(n) < 0.0 && pull > 0.0 && facing > LEAST_FACING {
        let free = n * (pull / n.dot(response * n));
        wall += free;
        traction += response * free;
    }
    let pressure = if facing > LEAST_FACING { traction.dot(n) / facing } else { density - 1.0 };
    // What is added to the matrix along the normal changes nothing across it.
    aside += outer(n);
    let free = wall - across(aside.inverse() * across(traction - pressure * area));
    // Over the way from sticking to sliding freely the wall stress falls to nothing.
    let way = across(free - contact.velocity);
    let most = way.length();
    let Some(speed) = friction.filter(|_| most > 0.0) else { return free };
    let borne = (way / most).dot(aside * way) * AREA / facing.max(LEAST_FACING);
    let slid = root(|v| v - speed(borne * (1.0 - v / most)), 0.0, most);
    free - way * (1.0 - slid / most)
}
