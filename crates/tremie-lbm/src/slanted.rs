//! Sliding with friction along surfaces that are not along the lattice.
//!
//! There the wall of the links is a staircase, whose steps lie before or behind the surface, and bear different shares of what
//! drives the fluid. With r of the link along c as for surfaces that the fluid sticks to (module `sticking`), in a flow sheared along the surface, of unit normal n, where the fluid slides at v
//! and the cell goes at u, the wall of that link moves, across n, with
//!
//! ```text
//!     v_c = v (1 - r) + u r
//! ```
//!
//! and under the wall stress tau_w the links of the cell bear along the surface, t being the direction in which the cell goes,
//!
//! ```text
//!     sum over links of (2 (f_opposite - f_carried) + 6 w rho c.v_c - 2 w p) c.t = -tau_w a        a = sum over links of 18 w (c.t)^2 c.n
//! ```
//!
//! As in `sticking`, u is the velocity with which the populations left the cell where r > 0, and that of the coming collision where r < 0, which is linear in v. So all that
//! is borne is linear in v: with the law v(tau_w) of the surface (module `friction`) it gives v. f_carried is the momentum that the flow carries along the surface. p is the
//! density's pressure; but rigid fluid stands in stresses of any kind, and p is what the links bear along n there, where the shear has a part in it too:
//!
//! ```text
//!     p sum over links of 2 w c.n = (sum over links of (2 (f_opposite - f_carried) + 6 w rho c.v_c) c.n) + tau_w sum over links of 18 w c.t (c.n)^2
//! ```
//!
//! A linear flow over a plane of any slope is so kept as it is: the staircase is not seen, however far the fluid slides.
//!
//! A surface that would pull on a cell from which air may part it (module `contact`) lets it go: across n its links move with the velocity for which the sum along n is zero, and the pressure
//! is none.

use tremie_numerics::{DMat3, DVec3};

use crate::collision::Moments;
use crate::contact::{LEAST_FACING, dyad, outer};
use crate::friction::Friction;
use crate::lattice::{Q, W, opposite, vector};
use crate::real::Real;
use crate::relaxation::Relaxation;
use crate::solids::Contact;
use crate::sticking::{Hold, along, drag, share};
use crate::wall::{FOUND, root};

/// How fast, over the cell's velocity, the fluid may slide: it goes no faster than the cell, but what alternates around that must not slow it on average. (At the surface of the fluid it may not, where
/// the flow may be anything but sheared along the wall: what is flung against a bar would be driven ever faster.)
const AHEAD: f64 = 2.0;
/// Least area that tells the stress, in a face of a cell.
const LEAST_AREA: f64 = 1e-3;

/// The fluid of a cell at a surface.
pub(crate) struct Sheared<'a> {
    /// Populations that left it in the last step.
    pub(crate) leaving: &'a [f64; Q],
    pub(crate) density: f64,
    pub(crate) velocity: DVec3,
}

impl Sheared<'_> {
    /// Half of what the flow carries through the link along a velocity in a step and back, as it goes along the surface: what it goes across is the wall's matter.
    fn carried(&self, contact: &Contact, i: usize) -> f64 {
        let u = contact.velocity + along(contact, self.velocity - contact.velocity);
        W[i] * self.density * (4.5 * vector(i).dot(u).powi(2) - 1.5 * u.length_squared())
    }

    /// Speed at which a cell goes from a surface that would pull on it by the populations `f` that arrive.
    fn parting(&self, contact: &Contact, f: &[f64; Q]) -> f64 {
        let n = contact.normal;
        let (mut pull, mut facing, mut response) = (0.0, 0.0, 0.0);
        for i in contact.links() {
            let c = vector(i);
            pull -= (f[i] + self.leaving[opposite(i)] - 2.0 * self.carried(contact, i)) * c.dot(n);
            facing += 2.0 * W[i] * c.dot(n);
            response += 6.0 * W[i] * self.density * c.dot(n).powi(2);
        }
        if facing > LEAST_FACING { (pull / response).max(0.0) } else { 0.0 }
    }

    /// What share of the stress that rigid fluid would keep the fluid kept in the last collision.
    fn rigid<T: Real, R: Relaxation<T>>(&self, law: &R) -> f64 {
        if law.is_newtonian() {
            return 0.0;
        }
        let mut stress = -self.density * outer(self.velocity);
        for i in 1..Q {
            stress += self.leaving[i] * outer(vector(i));
        }
        let mean = (stress.x_axis.x + stress.y_axis.y + stress.z_axis.z) / 3.0;
        stress -= DMat3::from_diagonal(DVec3::splat(mean));
        let squares: f64 = stress.to_cols_array().iter().map(|s| s * s).sum();
        (1.0 - law.omega(T::from_f64((4.5 * squares).sqrt() / self.density)).to_f64()).max(0.0)
    }
}

/// Lets a cell slide along a surface with friction: its populations `f` arrive by half-way bounce-back from the surface as it moves, and where
/// it `parts`, the surface does not pull on it. `moments` are those of the coming collision. The mass that the cell gains.
pub(crate) fn slide<T: Real, R: Relaxation<T>>(
    contact: &Contact,
    fluid: &Sheared<'_>,
    moments: impl Fn(&[f64; Q]) -> Moments<T> + Copy,
    friction: Friction,
    parts: bool,
    law: &R,
    f: &mut [f64; Q],
) -> f64 {
    let before: f64 = f.iter().sum();
    let arrived = *f;
    let most = if parts { 1.0 } else { AHEAD };
    let rub = |pressure, f: &mut [f64; Q]| rub(contact, fluid, moments, pressure, most, friction, law, f);
    rub(fluid.density - 1.0, f);
    let away = if parts { fluid.parting(contact, f) } else { 0.0 };
    if away > 0.0 {
        *f = arrived;
        for i in contact.links() {
            f[i] += 6.0 * W[i] * fluid.density * vector(i).dot(contact.normal) * away;
        }
        rub(0.0, f);
    }
    f.iter().sum::<f64>() - before
}

/// Lets a cell slide along a surface that holds it otherwise, under a pressure (the density less 1), at `most` so many times as fast as the cell goes.
fn rub<T: Real, R: Relaxation<T>>(
    contact: &Contact,
    fluid: &Sheared<'_>,
    moments: impl Fn(&[f64; Q]) -> Moments<T>,
    pressure: f64,
    most: f64,
    friction: Friction,
    law: &R,
    f: &mut [f64; Q],
) {
    let (n, base, left_at) = (contact.normal, contact.velocity, fluid.velocity);
    let across = |v: DVec3| along(contact, v);
    drag(contact, fluid.density, left_at - base, |share| share > 0.0, f);
    let m = moments(f);
    // What slides brings the density back to what it was: the momentum is that of so much.
    let density = fluid.density;
    let velocity = DVec3::from(m.velocity.map(T::to_f64)) * (m.density.to_f64() / density);
    let rigid = fluid.rigid(law);
    let alone = [contact];
    let hold = Hold::new(&alone);
    // What the links bear if nothing slides, and by how much less where it does.
    let still = across(hold.coming(velocity) - base);
    let (mut traction, mut response) = (DVec3::ZERO, DMat3::ZERO);
    let (mut held, mut driven, mut area) = (DMat3::ZERO, DMat3::ZERO, DVec3::ZERO);
    for i in contact.links() {
        let (c, weight, r) = (vector(i), 6.0 * W[i] * density, share(contact, vector(i)));
        let t = across(c);
        let held_back = weight * r.min(0.0);
        let borne = f[i] + fluid.leaving[opposite(i)] - 2.0 * fluid.carried(contact, i);
        traction += (borne + held_back * c.dot(still)) * c;
        area += 2.0 * W[i] * c;
        response += dyad(c, t) * (weight * (1.0 - r));
        held += dyad(c, t) * held_back;
        driven += dyad(c, t) * (6.0 * W[i] * (1.0 - r));
    }
    response += held * hold.carried(driven);
    let ahead = across(left_at - base);
    let speed = ahead.length();
    let mut slid = DVec3::ZERO;
    if speed > 0.0 {
        let t = ahead / speed;
        let most = most * speed;
        // The pressure is that of the density, and in rigid fluid what the links bear along n.
        let facing = area.dot(n);
        let by_links = if facing > LEAST_FACING { rigid } else { 0.0 };
        let aside = t - n * (by_links * area.dot(t) / facing.max(LEAST_FACING));
        let borne = (1.0 - by_links) * pressure * area.dot(t) - aside.dot(traction);
        let eased = aside.dot(response * t);
        let links = contact.links().map(|i| (vector(i), 18.0 * W[i]));
        let sheared: f64 = links.map(|(c, w)| w * c.dot(t) * c.dot(n) * c.dot(aside)).sum();
        // Rigid fluid goes all as fast, where the links tell no more.
        let v = if sheared < LEAST_AREA {
            by_links * speed
        } else {
            let stress = |v: f64| (borne - v * eased).max(0.0) / (density * sheared);
            let slides = |stress: f64| friction.speed(T::from_f64(stress), law).to_f64();
            root(|v| v - slides(stress(v)), [0.0, most], speed, FOUND)
        };
        slid = t * v;
    }
    for i in contact.links() {
        let c = vector(i);
        f[i] += 6.0 * W[i] * density * (1.0 - share(contact, c)) * c.dot(slid);
    }
    hold.hold_back(density, hold.coming(velocity + driven * slid), f);
}
