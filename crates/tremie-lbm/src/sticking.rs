//! Sticking to surfaces that lie anywhere between cells.
//!
//! Half-way bounce-back holds the fluid in the middle of each link, be the surface where it may: a round pipe is a staircase, and a plate that
//! moves closes its gap a cell at a time. With the distance d_f of the cell from the surface, of unit normal n, the link along c ends at
//! `d = d_f - c.n/2`. In a flow sheared along the surface, which goes at u_s, the fluid there goes, across n, at
//!
//! ```text
//!     v_c = u_s + r (u - u_s)        r = d/d_f
//! ```
//!
//! where u is the velocity of the cell. With that as the wall's velocity, a linear flow over a plane of any slope is kept as it is: the staircase is
//! not seen. Links that end short of the surface (0 < r < 1/2) are drawn along, links that end behind it (r < 0) hold back the more, the nearer the cell.
//!
//! What is drawn along goes by the velocity with which the populations left the cell, so that no more comes back than left: by the
//! coming one, what alternates between steps would grow. What is held back goes by the velocity of the coming collision, which it is part of:
//!
//! ```text
//!     (1 - sum over links of 6 w r c (c - c.n n)) (u - u_s) = (sum c f + F/2)/rho - u_s        r < 0
//! ```
//!
//! with the populations f that arrive without it. So a cell however near to the surface goes with it, and no step is too long.
//!
//! Between the surface and the cell the fluid shears by its own stress, not by that of the cell, as at walls along the lattice (module `wall`), and is given the
//! same velocity v there: with what the links of the cell take of momentum along the surface, and bear in a sheared flow,
//!
//! ```text
//!     T = (1/a) (sum over links of -(f + f_opposite - f_at_rest) c.t - 3 w c.t c.F)        a = sum over links of 18 w (c.t)^2 c.n
//! ```
//!
//! in place of the traction less a sixth of the body force there. The wall of the link along c then moves with `c.n v` more. On planes the stress of the cell grows by `3/2 (T - tau_1)` on
//! the way to where the links end, at the distance `sum over links of 9 w (c.t)^2 (c.n)^2/a`, and goes on to the surface like that; where it turns along a curved surface, its growth is off by a factor of one to two. f_at_rest has the density, what
//! the flow carries along, and all stresses but the shear along the surface. Cells that touch more than one surface do without.

use tremie_numerics::{DMat3, DVec3};

use crate::collision::{COMPONENT, LEAST_RESISTANCE, Moments};
use crate::contact::{dyad, outer};
use crate::lattice::{Q, W, opposite, vector};
use crate::real::Real;
use crate::relaxation::Relaxation;
use crate::solids::Contact;
use crate::wall::{FOUND, root};

/// Largest r: a link is as long as it is.
const SHORT: f64 = 0.5;
/// Least r that is of account.
const HALF_WAY: f64 = 1e-9;
/// Least area of the links of a cell that tells the stress, in faces of a cell.
const LEAST_AREA: f64 = 0.1;
/// Share of the stresses by which both fall, at least, as v rises by as much.
const LEAST_RESPONSE: f64 = 0.01;

/// r of the link along `c`.
pub(crate) fn share(contact: &Contact, c: DVec3) -> f64 {
    // The plane of a surface that is met in an edge may lie behind the cell.
    if contact.distance < 0.0 {
        return 0.0;
    }
    contact.place(c).min(SHORT)
}

/// Whether the links of a surface end anywhere but half-way.
pub(crate) fn off_half_way(contact: &Contact) -> bool {
    contact.links().any(|i| share(contact, vector(i)).abs() > HALF_WAY)
}

/// Part of a vector along a surface.
pub(crate) fn along(contact: &Contact, v: DVec3) -> DVec3 {
    v - contact.normal * v.dot(contact.normal)
}

/// Holds a cell to what it sticks to: its populations left it at the velocity `left_at`, and `f` arrive by half-way bounce-back. `moments` are those of the
/// coming collision; `shears` tells the flow curve where the fluid is to shear by its own stress. The mass that the cell gains.
pub(crate) fn stick<T: Real, R: Relaxation<T>>(
    contacts: &[&Contact],
    leaving: &[f64; Q],
    left_at: DVec3,
    moments: impl Fn(&[f64; Q]) -> Moments<T>,
    shears: Option<&R>,
    f: &mut [f64; Q],
) -> f64 {
    let before: f64 = f.iter().sum();
    let density = 1.0 + leaving.iter().sum::<f64>();
    for contact in contacts {
        drag(contact, density, left_at - contact.velocity, |share| share > 0.0, f);
    }
    let m = moments(f);
    let (density, velocity) = (m.density.to_f64(), DVec3::from(m.velocity.map(T::to_f64)));
    let hold = Hold::new(contacts);
    hold.hold_back(density, hold.coming(velocity), f);
    if let ([contact], Some(law)) = (contacts, shears) {
        shear(contact, leaving, &moments(f), law, &hold, f);
    }
    f.iter().sum::<f64>() - before
}

/// Adds what the links of a contact of which r is such bring, if they are drawn along, or held back, by the velocity `beyond` that of the surface.
pub(crate) fn drag(contact: &Contact, density: f64, beyond: DVec3, which: fn(f64) -> bool, f: &mut [f64; Q]) {
    let beyond = along(contact, beyond);
    for i in contact.links() {
        let (c, share) = (vector(i), share(contact, vector(i)));
        if which(share) {
            f[i] += 6.0 * W[i] * density * share * c.dot(beyond);
        }
    }
}

/// What holds a cell back.
pub(crate) struct Hold<'a> {
    contacts: &'a [&'a Contact],
    /// The matrix of the velocity of the coming collision.
    inverse: DMat3,
    /// What the surfaces' own velocities add to it.
    drawn: DVec3,
}

impl<'a> Hold<'a> {
    pub(crate) fn new(contacts: &'a [&'a Contact]) -> Self {
        let (mut matrix, mut drawn) = (DMat3::IDENTITY, DVec3::ZERO);
        for contact in contacts {
            for i in contact.links() {
                let c = vector(i);
                let (t, back) = (along(contact, c), -6.0 * W[i] * share(contact, c).min(0.0));
                matrix += dyad(c, t) * back;
                drawn += c * (back * t.dot(contact.velocity));
            }
        }
        Self { contacts, inverse: matrix.inverse(), drawn }
    }

    /// Velocity in the coming collision, of a cell that would go at `velocity` if nothing held it back.
    pub(crate) fn coming(&self, velocity: DVec3) -> DVec3 {
        self.inverse * (velocity + self.drawn)
    }

    /// What that velocity gains with another on which what comes in depends as `driven` says.
    pub(crate) fn carried(&self, driven: DMat3) -> DMat3 {
        self.inverse * driven
    }

    /// Holds a cell back that goes at `velocity` in the coming collision.
    pub(crate) fn hold_back(&self, density: f64, velocity: DVec3, f: &mut [f64; Q]) {
        for contact in self.contacts {
            drag(contact, density, velocity - contact.velocity, |share| share < 0.0, f);
        }
    }
}

/// Lets the fluid between a cell and a surface shear by its own stress.
fn shear<T: Real, R: Relaxation<T>>(
    contact: &Contact,
    leaving: &[f64; Q],
    m: &Moments<T>,
    law: &R,
    hold: &Hold<'_>,
    f: &mut [f64; Q],
) {
    let n = contact.normal;
    let density = m.density.to_f64();
    let [u, force] = [m.velocity, m.force].map(|v| DVec3::from(v.map(T::to_f64)));
    let stress = |a: usize, b: usize| m.stress[COMPONENT[a][b]].to_f64();
    let stress = DMat3::from_cols_array_2d(&[0, 1, 2].map(|b| [0, 1, 2].map(|a| stress(a, b))));
    // P on the surface, along it, and what else of P the cell passes on.
    let on = -along(contact, stress * n);
    let all = m.q.to_f64() * density * 2.0 / 3.0;
    let others = all * all - 4.0 * on.length_squared();
    let kept = 1.0 - law.omega(m.q).to_f64();
    let aside = (stress + outer(on + n) - outer(on) - outer(n)) * kept;
    let (mut taken, mut area, mut reach) = (DVec3::ZERO, outer(n), DMat3::ZERO);
    for i in contact.links() {
        let (c, w) = (vector(i), W[i]);
        let t = along(contact, c);
        let carried = density * (4.5 * c.dot(u).powi(2) - 1.5 * u.length_squared());
        let at_rest = 2.0 * w * (density - 1.0 + carried + 4.5 * c.dot(aside * c));
        taken -= t * (f[i] + leaving[opposite(i)] - at_rest + 3.0 * w * c.dot(force));
        area += 18.0 * w * c.dot(n) * outer(t);
        reach += 9.0 * w * c.dot(n).powi(2) * outer(t);
    }
    if area.determinant() < LEAST_AREA {
        return;
    }
    let (whole, area) = (area, area.inverse());
    let still = area * taken;
    let wall = 1.5 * still - 0.5 * kept * on;
    let size = wall.length();
    if size == 0.0 {
        return;
    }
    let t = wall / size;
    // How far the surface is, over how far the links reach.
    let stretch = contact.distance * t.dot(whole * t) / t.dot(reach * t);
    // What comes in with a velocity of 1, what holds that back, and by how much both stresses fall.
    let mut brought = [0.0; Q];
    for i in contact.links() {
        brought[i] = 6.0 * W[i] * density * vector(i).dot(n) * vector(i).dot(t);
    }
    let push: DVec3 = contact.links().map(|i| vector(i) * brought[i]).sum();
    drag(contact, density, hold.inverse * (push / density), |share| share < 0.0, &mut brought);
    let lost: DVec3 = contact.links().map(|i| vector(i) * brought[i]).sum();
    let eased = (area * along(contact, lost)).dot(t).max(LEAST_RESPONSE);
    let relieved = |i: usize| brought[i] * vector(i).dot(n) * vector(i).dot(t);
    let relieved = contact.links().map(relieved).sum::<f64>().max(LEAST_RESPONSE);
    let (still, on_wall) = (still.dot(t), on.dot(t));
    let fill = m.fill.to_f64().max(LEAST_RESISTANCE);
    let state = |v: f64| {
        let measure = on_wall - relieved * v;
        let square = others + 4.0 * (on - t * (relieved * v)).length_squared();
        let omega = law.omega(T::from_f64(1.5 / density * square.max(0.0).sqrt())).to_f64();
        let resisted = (1.0 - 0.5 * omega) * measure;
        let growth = stretch * 1.5 * (still - eased * v - resisted);
        [6.0 * omega / (2.0 - omega), resisted + growth, growth / fill].map(T::from_f64)
    };
    let half_cell = |v: f64| law.half_cell(T::from_f64(size), state(v)).to_f64();
    if half_cell(0.0) == 0.0 {
        return;
    }
    // A film may slide, but is not pushed back.
    let least = if m.fill.to_f64() < 1.0 { 0.0 } else { -size };
    let most = size / eased.min(relieved);
    let v = root(|v| v - half_cell(v), [least, most], size, FOUND);
    for i in contact.links() {
        f[i] += v * brought[i];
    }
}
