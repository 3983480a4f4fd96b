//! What solids inside the domain do to the fluid beside them, and it to them.
//!
//! A population that would enter a solid returns (half-way bounce-back) from a wall with the velocity v, rho being the cell's own density
//! (Ladd 1994):
//!
//! ```text
//!     f_i = f_opposite + 6 w_i rho c_i . v
//! ```
//!
//! Where the fluid sticks, v is the solid's velocity u_s, and what the surface's place between the cells asks for comes on top (module `sticking`). Where it slides, v keeps the solid's velocity along the true normal n of the surface, and
//! takes that along it for which the wall bears no shear: each cell's links bear what a pressure p would, with the part of the populations left out
//! by which the flow carries itself along,
//!
//! ```text
//!     v.n = u_s.n      sum over links of (2 (f_opposite - f_carried) + 6 w rho c.v - 2 w p) c   has no part across n
//! ```
//!
//! p is the pressure along n that the same sum asks for; in a fluid at rest the density's, in one that stands by its yield stress not.
//! Where it slides with friction, the wall bears shear: on surfaces along the lattice that is left to module `friction`, on others to `slanted`.
//!
//! On a flat wall along the lattice the populations are mirrored instead: they come with the normal velocity turned from the cell beside that they left towards
//! the wall, so that the pressure along the wall drives the cells at it as all others. Elsewhere
//! the wall is a staircase, and mirroring would catch the flow at every step: here mass goes into the steps that face the flow and comes
//! back out of the others, and what a wall seen from afar has smooth, stays smooth. A sliding wall does not pull on an interface cell, nor, if it recedes and
//! there is air that can come in between, on liquid: where it would have to, v.n is not the solid's but that for which p is zero. What the liquid keeps back thereby is owed by its store, until the wall uncovers a cell: then
//! a gap is left there (`sweep`). (A mould that pulled would tear a slump cone apart: lifted at 1 m/s, by 15 kPa.)
//!
//! A wall that comes on presses on an interface cell by as much of its speed as the gap between it and the fluid has closed: a plate that comes down
//! meets the fluid beside its contact cell by cell, and not as soon as it is over them.
//!
//! The mass that goes into steps and what comes out of them agree over a stretch of the wall, but not in every cell. So each
//! liquid cell at a solid has a store, which gets what the solid takes from the cell by sliding or by its place, exchanges with the stores beside
//! it, and is slowly put back into the cell: no mass is lost. At the edges of a wall along the lattice, which is no staircase, nothing comes back out elsewhere: there it is
//! put back at once. What a wall takes by its own motion is another matter (`sweep`).
//!
//! In an edge or a corner, where a cell is in contact with several surfaces, all this is done for each of them with the links that come out of it.

use std::borrow::Cow;

use tremie_numerics::{DMat3, DVec3};

use crate::collision::{Held, moments};
use crate::friction::Friction;
use crate::grid::Fill;
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, MIRROR, Q, W, opposite, vector};
use crate::real::Real;
use crate::relaxation::{Law, Relaxation};
use crate::rows::SurfaceRow;
use crate::slanted::{self, Sheared};
use crate::solids::{Contact, Contacts};
use crate::source::Source;
use crate::sticking;
use crate::together::{Own, Physics};
use crate::topology::CELLS;

/// What keeps the velocity of a sliding wall from directions in which hardly a link points.
const BLIND: f64 = 0.02;
/// Least area across the normal, in twice the weights of links, that tells the pressure on a wall.
pub(crate) const LEAST_FACING: f64 = 0.05;
/// Share of a store that is put back in a step.
const RETURNED: f64 = 5e-5;

/// What the cells of a row away from solids are in contact with. (To write it anew for each row takes time.)
static NONE: Contacts = [[None; 3]; LANES];

/// The matrix a b.
pub(crate) fn dyad(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The matrix v v.
pub(crate) fn outer(v: DVec3) -> DMat3 {
    dyad(v, v)
}

impl<T: Real> Source<'_, T> {
    /// What the cells of a row are in contact with.
    #[inline(always)]
    pub(crate) fn contacts<'r>(&self, row: &'r SurfaceRow, first: usize) -> Cow<'r, Contacts> {
        match &row.contacts {
            _ if row.any_immersed == 0 => Cow::Borrowed(&NONE),
            Some(contacts) => Cow::Borrowed(contacts),
            None => Cow::Owned(self.solids.contacts(self.links, first, &row.immersed)),
        }
    }

    /// Lets the cells of a row meet the solids beside them, and adds the mass that these take from the liquid by their motion to `swept`. `held` is what
    /// the cells hold. Those that yield at the solids, and need not at flat walls any more.
    #[inline(never)]
    pub(crate) fn meet_solids<R: Law<T>>(
        &self,
        row: &SurfaceRow,
        first: usize,
        contacts: &Contacts,
        physics: &Physics<T, R>,
        own: &Own<'_, T, R>,
        fill: &Fill<T>,
        held: Held<Lanes<T>>,
        f: &mut [Lanes<T>; Q],
        mass: &mut [f64; CELLS],
        swept: &mut f64,
    ) -> u8 {
        let mut yields = 0;
        let gravity = DVec3::from(physics.gravity.map(T::to_f64));
        for (k, touching) in contacts.iter().enumerate() {
            if touching[0].is_none() {
                continue;
            }
            let cell = first + k;
            let interface = row.kinds.interface >> k & 1 == 1;
            let leaving: [f64; Q] = std::array::from_fn(|i| self.own[(i, cell)].to_f64());
            let density = 1.0 + leaving.iter().sum::<f64>();
            let (mut by_wall, mut slid, mut at_edges, mut slides) = (0.0, 0.0, 0.0, false);
            let momentum: DVec3 = (1..Q).map(|i| vector(i) * leaving[i]).sum();
            let fill = fill[(0, cell)].to_f64();
            let filled = if interface { fill.clamp(0.0, 1.0) } else { 1.0 };
            let push =
                own.push.map_or(DVec3::ZERO, |push| DVec3::from([0, 1, 2].map(|a| push[k][a].to_f64())));
            let velocity = momentum / density - 0.5 * (filled * gravity + push);
            for contact in touching.iter().flatten() {
                let (mut wall, mut sweeps) = (contact.velocity, contact.velocity);
                if contact.slides || self.rubs(contact).is_some() {
                    slides = true;
                    // A wall that goes along itself sweeps nothing, though not all links that would tell may come out of it.
                    sweeps = contact.normal * contact.velocity.dot(contact.normal);
                }
                if contact.slides {
                    let entering = contact.links().map(|i| (i, leaving[opposite(i)]));
                    // In an edge with another wall the fluid does not slide towards that.
                    let shut = |a: usize| (row.solid[2 * a + 1] | row.solid[2 * a + 2]) >> k & 1 == 1;
                    let open = DVec3::from(
                        [0, 1, 2].map(|a| f64::from(u8::from(!contact.along_lattice() || !shut(a)))),
                    );
                    wall =
                        sliding(contact, velocity, density, self.parts(contact, interface), open, entering);
                }
                if interface {
                    let ahead = (contact.velocity - velocity).dot(contact.normal).max(0.0);
                    wall -= contact.normal * (1.0 - reached(contact, fill)) * ahead;
                }
                for i in contact.links() {
                    let c = vector(i);
                    if let Some((j, from)) = self.mirrored(row, k, contact, i) {
                        let mirrored = self.left(cell, C[j], from).to_f64();
                        f[i].0[k] = T::from_f64(mirrored);
                        // What the wall hands on from cell to cell: all of it together comes to nothing.
                        let handed = mirrored - leaving[opposite(i)];
                        if !interface {
                            by_wall -= handed;
                        } else if row.liquid[j] >> k & 1 == 1 {
                            mass[cell] += handed;
                            *swept -= handed;
                        }
                        continue;
                    }
                    let gained = 6.0 * W[i] * density * c.dot(wall);
                    f[i].0[k] = T::from_f64(leaving[opposite(i)] + gained);
                    let by_motion = 6.0 * W[i] * density * c.dot(sweeps);
                    let n = contact.normal;
                    let along = match contact.slides && contact.along_lattice() {
                        true => 6.0 * W[i] * density * (c - n * c.dot(n)).dot(wall),
                        false => 0.0,
                    };
                    by_wall -= by_motion;
                    at_edges += along;
                    slid -= gained - by_motion - along;
                }
            }
            if touching.iter().flatten().any(|contact| contact.held || self.rubs(contact).is_some()) {
                slides = true;
                let law = physics.law.cell(&own.law, k);
                let drive = physics.drive(own, k);
                let moments = |f: &[f64; Q]| moments(&f.map(T::from_f64), held.of(k), drive);
                let mut arrived = std::array::from_fn(|i| f[i].0[k].to_f64());
                let fluid = Sheared { leaving: &leaving, density, velocity };
                for contact in touching.iter().flatten() {
                    let Some(friction) = self.rubs(contact) else { continue };
                    let parts = self.parts(contact, interface);
                    slid -= slanted::slide(contact, &fluid, moments, friction, parts, &law, &mut arrived);
                }
                let sticking: Vec<&Contact> =
                    touching.iter().flatten().filter(|contact| contact.held).collect();
                if let [first, ..] = sticking[..] {
                    let alone = touching[1].is_none() && solid_links(row, k) == first.links().count();
                    let shears = (alone && !law.is_newtonian()).then_some(&law);
                    yields |= u8::from(alone) << k;
                    slid -= sticking::stick(&sticking, &leaving, velocity, moments, shears, &mut arrived);
                }
                for i in 1..Q {
                    f[i].0[k] = T::from_f64(arrived[i]);
                }
            }
            if interface {
                continue;
            }
            *swept += by_wall;
            f[0].0[k] -= T::from_f64(at_edges);
            if slides {
                let returned = RETURNED * mass[cell];
                mass[cell] += slid - returned;
                for i in 0..Q {
                    f[i].0[k] += T::from_f64(W[i] * returned);
                }
            }
        }
        yields
    }

    /// Friction of a surface that is not along the lattice.
    fn rubs(&self, contact: &Contact) -> Option<Friction> {
        self.solids.friction(contact.solid).filter(|_| !contact.along_lattice())
    }

    /// Whether air comes in between a surface and a cell, rather than that it pulls on it: from the surface of the fluid, and behind a wall that recedes.
    fn parts(&self, contact: &Contact, interface: bool) -> bool {
        interface || (contact.velocity.dot(contact.normal) < 0.0 && self.solids.air)
    }

    /// Where a link along which a flat wall mirrors the flow has its population from: the velocity from the cell beside, and
    /// that with which it left it.
    fn mirrored(&self, row: &SurfaceRow, k: usize, contact: &Contact, i: usize) -> Option<(usize, usize)> {
        if !contact.mirrored(i) {
            return None;
        }
        let normal = (0..3).find(|a| contact.normal[*a].abs() > 0.5)?;
        let axis = (1..=6)
            .find(|j| (j - 1) / 2 != normal && (0..3).any(|a| C[*j][a] != 0 && C[*j][a] == C[i][a]))?;
        let out = (1..=6).find(|j| C[*j][normal] != 0 && C[*j][normal] == C[i][normal])?;
        let set = |bits: u8| bits >> k & 1 == 1;
        let flat = set(row.immersed[out]) && !set(row.solid[axis]) && !set(row.missing[axis]);
        flat.then_some((axis, usize::from(MIRROR[1 << normal][i])))
    }
}

/// How far a wall has reached a cell of the surface, from 0 to 1, which holds `fill` where there is room for 1 and [`Contact::room`]: by as much a wall that comes on drives it. One that does not is where
/// the fluid is.
pub(crate) fn reached(contact: &Contact, fill: f64) -> f64 {
    match contact.velocity.dot(contact.normal) > 0.0 {
        true => (fill - contact.room()).clamp(0.0, 1.0),
        false => 1.0,
    }
}

/// Velocities that come out of solids and sides into a cell of a row.
fn solid_links(row: &SurfaceRow, k: usize) -> usize {
    (1..Q).filter(|i| row.solid[*i] >> k & 1 == 1).count()
}

/// Velocity of a wall without friction beside fluid of the velocity `u`, which it slides along the axes for which `open` is 1 and, where it `parts`, does not pull;
/// `links` are velocities out of the wall with the populations that enter it.
fn sliding(
    contact: &Contact,
    u: DVec3,
    density: f64,
    parts: bool,
    open: DVec3,
    links: impl Iterator<Item = (usize, f64)>,
) -> DVec3 {
    let n = contact.normal;
    let across = |v: DVec3| (v - n * v.dot(n)) * open;
    let shut = contact.velocity * (DVec3::ONE - open - n.abs()).max(DVec3::ZERO);
    let mut wall = across(u) + n * contact.velocity.dot(n) + shut;
    let (mut traction, mut area) = (DVec3::ZERO, DVec3::ZERO);
    // What the traction grows by with the wall's velocity, and the part of it across the normal.
    let (mut response, mut aside) = (DMat3::ZERO, DMat3::from_diagonal(DVec3::splat(BLIND)));
    for (i, leaving) in links {
        let c = vector(i);
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
    if parts && pull > 0.0 && facing > LEAST_FACING {
        let free = n * (pull / n.dot(response * n));
        wall += free;
        traction += response * free;
    }
    let pressure = if facing > LEAST_FACING { traction.dot(n) / facing } else { density - 1.0 };
    // What is added to the matrix along the normal changes nothing across it.
    aside += outer(n);
    wall - across(aside.inverse() * across(traction - pressure * area))
}
