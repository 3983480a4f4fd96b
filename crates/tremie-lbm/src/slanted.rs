//! Sliding with friction along surfaces that are not along the lattice.
//!
//! There the wall of the links is a staircase, whose steps lie before or behind the surface, and bear different shares of what
//! drives the fluid. With the distance d_f of the cell from the surface, of unit normal n, the link along c ends at `d = d_f - c.n/2`. In a flow
//! sheared along the surface, where the fluid slides at v and the cell goes at u, the wall of that link moves with
//!
//! ```text
//!     v_c = v (1 - r) + u r        r = d/d_f, at least -v/(u - v), at most 1
//! ```
//!
//! and under the wall stress tau_w the links of the cell bear along the surface
//!
//! ```text
//!     sum over links of (2 (f_opposite - f_at_rest) + 6 w rho c.v_c) c.t = -tau_w a        a = sum over links of 18 w (c.t)^2 c.n
//! ```
//!
//! which is linear in v: with the law v(tau_w) of the surface (module `friction`) it gives v. f_at_rest is what the density, the momentum that the
//! flow carries along, and the stresses in which rigid fluid stands have in the links. A linear flow over a plane of any slope is so
//! kept as it is: the staircase is not seen. The limits of r keep a wall from going backwards, and ahead of the fluid, which would be unstable; where the fluid
//! sticks, the lower leaves the links that end behind the surface half-way. (Beside a plane no link ends farther off it than the cell; on curved surfaces, and at the ends of solids, one may.)

use tremie_numerics::{DMat3, DVec3};

use crate::contact::outer;
use crate::friction::Friction;
use crate::lattice::{Q, W, opposite, vector};
use crate::real::Real;
use crate::relaxation::Relaxation;
use crate::solids::Contact;
use crate::wall::{FOUND, root};

/// Turns in which the limit of r is found.
const TURNS: usize = 3;
/// What keeps the velocity near the fluid's in directions in which hardly a link points.
const BLIND: f64 = 0.01;
/// Least area that tells the stress, in a face of a cell.
const LEAST_AREA: f64 = 1e-3;

/// The fluid of a cell at a surface.
pub(crate) struct Sheared<'a> {
    /// Populations that left it in the last step.
    pub(crate) leaving: &'a [f64; Q],
    pub(crate) density: f64,
    pub(crate) velocity: DVec3,
}

/// How the walls of a cell's links move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sliding {
    /// Velocity at the surface.
    wall: DVec3,
    /// What the cell's velocity has more, along the surface.
    beyond: DVec3,
    /// Least r.
    least: f64,
}

impl Sheared<'_> {
    /// The stresses in which rigid fluid stands at the surface: what the last collision left, but for the shear along the surface.
    fn standing<T: Real, R: Relaxation<T>>(&self, normal: DVec3, law: &R) -> DMat3 {
        if law.is_newtonian() {
            return DMat3::ZERO;
        }
        let mut stress = -self.density * outer(self.velocity);
        for i in 1..Q {
            stress += self.leaving[i] * outer(vector(i));
        }
        let mean = (stress.x_axis.x + stress.y_axis.y + stress.z_axis.z) / 3.0;
        stress -= DMat3::from_diagonal(DVec3::splat(mean));
        let squares: f64 = stress.to_cols_array().iter().map(|s| s * s).sum();
        let rigid = 1.0 - law.omega(T::from_f64((4.5 * squares).sqrt() / self.density)).to_f64();
        let on = stress * normal;
        let shear = on - normal * on.dot(normal);
        let both = outer(shear + normal) - outer(shear) - outer(normal);
        (stress - both) * rigid.max(0.0)
    }
}

/// How the walls of the links of a contact move; `base` is the velocity of the solid, or across it
/// that which lets the fluid go.
pub(crate) fn sliding<T: Real, R: Relaxation<T>>(
    contact: &Contact,
    fluid: &Sheared<'_>,
    base: DVec3,
    friction: Friction,
    law: &R,
) -> Sliding {
    let n = contact.normal;
    let across = |v: DVec3| v - n * v.dot(n);
    let u = fluid.velocity;
    let speed = |stress: f64| friction.speed(T::from_f64(stress), law).to_f64();
    let ahead = across(u - base);
    let stands = fluid.standing(n, law);
    let mut found = Sliding { wall: base, beyond: ahead, least: 0.0 };
    for _ in 0..TURNS {
        let (mut traction, mut response) =
            (-BLIND * ahead, DMat3::from_diagonal(DVec3::splat(BLIND)) + outer(n));
        for i in contact.links() {
            let c = vector(i);
            let weight = 6.0 * W[i] * fluid.density;
            let r = found.place(contact, c);
            let at_rest = W[i] * (fluid.density - 1.0 + 4.5 * c.dot(stands * c))
                + W[i] * fluid.density * (4.5 * c.dot(u).powi(2) - 1.5 * u.length_squared());
            let borne = 2.0 * (fluid.leaving[opposite(i)] - at_rest);
            traction += (borne + weight * c.dot(base + ahead * r)) * across(c);
            response += weight * (1.0 - r) * outer(across(c));
        }
        // The velocity for which nothing is borne, and what is borne on the way there.
        let free = across(response.inverse() * -traction);
        let most = free.length();
        if most == 0.0 {
            break;
        }
        let t = free / most;
        let area: f64 =
            contact.links().map(|i| 18.0 * W[i] * vector(i).dot(t).powi(2) * vector(i).dot(n)).sum();
        // What keeps the velocity bears nothing.
        let [alone, taken] = [t.dot(-traction - BLIND * ahead), t.dot(response * t) - BLIND];
        let stress = |v: f64| (alone - v * taken).max(0.0) / (fluid.density * area.max(LEAST_AREA));
        let slid = root(|v| v - speed(stress(v)), [0.0, most], most, FOUND);
        let left = ahead.dot(t) - slid;
        let least = if slid == 0.0 {
            0.0
        } else if left > slid {
            -slid / left
        } else {
            -1.0
        };
        let settled = least == found.least;
        found = Sliding { wall: base + t * slid, beyond: ahead - t * slid, least };
        if settled {
            break;
        }
    }
    found
}

impl Sliding {
    /// r of the link along `c`.
    fn place(&self, contact: &Contact, c: DVec3) -> f64 {
        contact.place(c).clamp(self.least, 1.0)
    }

    /// Velocity of the wall of the link along `c`.
    pub(crate) fn of_link(&self, contact: &Contact, c: DVec3) -> DVec3 {
        self.wall + self.beyond * self.place(contact, c)
    }
}
