//! How bodies and fluid take hold of each other: at points in the body, each with a friction.
//!
//! The force of the fluid on a body is the sum over its points of `zeta (u - v - w x r)`, u being the velocity that the fluid has around the point
//! ([`crate::Seen`], with the force of the body in it), v and w those of the body. The fluid gets the same forces, turned round.
//!
//! **Fibres** are far thinner than a grain of the fluid's method (a cell). A line of points drags the grains around it along as a cylinder would that has
//! the radius R of the carrier ([`crate::Carrier::line_radius`]); what is missing between that and the real fibre of diameter d is a friction per unit
//! length (slender bodies: Batchelor 1970; Cox 1970)
//!
//! ```text
//!     zeta_across = 4 pi mu / ln(2 R / d),   zeta_along = 2 pi mu / ln(2 R / d)
//! ```
//!
//! (of thick ones no more than a step can bear, [`most`]; and of many in one place no more than the fluid there takes from all of them, [`Seen::crowding`]: they slip a little
//! more than in shorter steps). Points are a grain apart or less, both ends among them with half the length. The thesis (Svec 2013, Eq. 3.13, 3.14) instead forces the fluid
//! onto the fibre's velocity, `F = C rho/dt (u* - v) dV` in the fluid's velocity before the force, `C = 5.5 / tf^0.89 + 1`, `tf = d^2/nu` in units of the
//! lattice: the same in all directions, and for one range of viscosities. It can be chosen, to be compared with.
//!
//! About its axis a fibre turns with a friction of `pi mu d^2` per unit length (a cylinder that turns in a fluid at rest: Lamb 1932, 333), or one touch after the other
//! would set it spinning. The moment that this gives the fluid is too small to be handed on.
//!
//! **Other bodies** are forced onto their velocity throughout their volume (direct forcing, Eq. 2.30), at points a grain apart: `zeta = rho dV/dt`. With the
//! weights that spread a point, such a body drags the fluid along as one that is larger, the more so the less viscous the fluid is: the points fill a body
//! whose half-axes are shorter by [`overhang`].
//!
//! That friction is finite; so a body under a steady force would slip through the fluid in its place, at `F dt/(rho V)`: in a fluid at rest below its yield
//! stress a heavy sphere would sink; and fluid in it would turn and be strained, though less than around it. Therefore these points hand the fluid the means of the drag and of its first moment over the
//! steps before, whatever the velocities are, and the friction only what differs from them ([`FORGETS`]): in steady flow the fluid within a body neither
//! slips nor turns against it nor is strained, in the mean.

use std::f64::consts::PI;

use tremie_numerics::DVec3;

use crate::{Carrier, Form, Method, Seen};

/// How fibres are coupled to the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Coupling {
    /// By the friction of slender bodies.
    #[default]
    Slender,
    /// By the correction of the thesis (Svec 2013, Eq. 3.14).
    Svec,
}

/// The viscosity by which a yield-stress fluid rubs against what is small against its grain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Felt {
    /// The plastic viscosity everywhere, as in Svec (2013).
    #[default]
    Plastic,
    /// The apparent viscosity at the shear rate around each point: fluid that does not yield holds fast.
    Apparent,
}

/// Part of what points may take hold of in flowing fluid that they may in fluid that has not yielded: forces go through it as waves, which ring, where viscosity would spread them.
/// On the lattice, fibres begin to tremble between 0.53 and 0.55 in its midst, and between 0.45 and 0.67 along a wall (measured, with a lattice viscosity of 0.15).
const RIGID: f64 = 0.45;

impl Felt {
    /// The part of what flowing fluid lets points take hold of that they may.
    pub(crate) fn part(self) -> f64 {
        match self {
            Self::Plastic => 1.0,
            Self::Apparent => RIGID,
        }
    }
}

/// What couplings depend on, of a carrier at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Medium {
    pub(crate) grain: f64,
    pub(crate) line_radius: f64,
    pub(crate) density: f64,
    pub(crate) viscosity: f64,
    pub(crate) time_step: f64,
}

impl Medium {
    pub(crate) fn of(carrier: &impl Carrier) -> Self {
        Self {
            grain: carrier.grain(),
            line_radius: carrier.line_radius(),
            density: carrier.density(),
            viscosity: carrier.viscosity(),
            time_step: carrier.time_step(),
        }
    }

    /// Viscosity in units of grains and steps.
    fn lattice_viscosity(&self) -> f64 {
        self.viscosity / self.density * self.time_step / (self.grain * self.grain)
    }
}

/// A point at which a body and the fluid take hold of each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grip {
    /// Its place in the body's axes, in m from the centre.
    pub(crate) at: DVec3,
    /// Friction across the body's z and along it, in N s/m.
    pub(crate) across: f64,
    pub(crate) along: f64,
    /// Friction about the body's z, in N m s: points in a line do not feel how they turn about it.
    pub(crate) spin: f64,
    /// Share of the body's mean drag that it hands to the fluid, whatever the velocities are.
    pub(crate) steady: f64,
    /// The same for the mean first moment `sum r F`, in the body's axes and 1/m: the inverse of `sum r r`, times r.
    pub(crate) lever: DVec3,
    /// Largest friction across and along, however viscous the fluid is around.
    pub(crate) most: [f64; 2],
}

impl Grip {
    /// Friction across and along that the point asks of the fluid there.
    pub(crate) fn asked(&self, seen: &Seen) -> [f64; 2] {
        let grown = 1.0 + seen.thickening;
        [(grown * self.across).min(self.most[0]), (grown * self.along).min(self.most[1])]
    }

    /// The same that it gets.
    pub(crate) fn felt(&self, seen: &Seen) -> [f64; 2] {
        self.asked(seen).map(|friction| friction / (1.0 + seen.crowding))
    }
}

/// Share of the mean drag that each step renews.
///
/// With u the slip, h the mean drag over the friction and x the share of the slip that friction takes off in a step, the slip of a body that is held follows
/// `u' = (q - x) u - x h`, `h' = h + FORGETS u` (q: what viscosity leaves of u): as stable as without h for any share below 1.
pub(crate) const FORGETS: f64 = 0.1;

/// Part of the friction's inverse that a line of points owes to itself, per length, between the fluid's velocity with half of the
/// forces on it and without, in `dt / (rho grain^2)`: half of `(sum w^2)^2`, w being the weights along one axis, whose squares sum to 0.375 wherever the point lies (Peskin 2002).
const SELF: f64 = 0.0703;

/// Diameter in grains up to which a line of points stands for a cylinder.
const THICKEST: f64 = 2.05;

/// The correction of the thesis (Svec 2013, Eq. 3.14) for a diameter and a viscosity in units of the lattice.
pub fn svec_correction(diameter: f64, viscosity: f64) -> f64 {
    5.5 / (diameter * diameter / viscosity).powf(0.89) + 1.0
}

/// By how many grains the body as which the fluid feels points that fill a volume is larger than that volume, in a fluid of a viscosity in grains and
/// steps, for a body with the volume of a sphere of a radius in grains. Measured on spheres 5 and 8 grains wide in a periodic box (Hasimoto 1959) for viscosities from 0.02 to 0.3,
/// within 0.02: a force on the fluid's velocity lets it through by some `sqrt(nu)`, the more so the smaller the body is, and its weights reach out by more.
fn overhang(viscosity: f64, radius: f64) -> f64 {
    let of_eight = 0.696 - 2.266 * viscosity.sqrt() + 1.636 * viscosity;
    of_eight + (0.03 + 2.4 * viscosity) * (radius.recip() - 0.25)
}

/// Variance in `grain^2` of the weights with which a point is spread and seen again.
const SMEARED: f64 = 1.045;

/// The part of its momentum in a step that the fluid around a line lets it take hold of without being thrown to and fro, in a fluid of a viscosity in grains and steps.
///
/// A force takes effect half at once and half a step later, when viscosity has spread it: of its effect on the line's own place a share q is left then.
/// So with x, half of the part taken hold of, the fluid's velocity follows u' = (q - x) u - q x u'', which decays for q x < 1. In the plane across the
/// line q is the variance before over the variance after, 1 / (1 + 2 nu / variance). Less a fiftieth.
pub fn hold(viscosity: f64) -> f64 {
    2.0 * 0.98 * (1.0 + 2.0 * viscosity / SMEARED)
}

/// Largest friction of a line per length, in `rho grain^2 / dt`: that with the [`hold`] that the fluid allows, of which it has twice [`SELF`].
fn most(felt: Felt, medium: &Medium) -> f64 {
    0.5 / SELF * felt.part() * hold(medium.lattice_viscosity())
}

/// The points of a form.
pub(crate) fn grips(form: &Form, method: &Method, medium: &Medium) -> Vec<Grip> {
    match *form {
        Form::Fibre { length, diameter } if diameter < THICKEST * medium.grain => {
            let (friction, most) = per_length(diameter, method, medium);
            let pieces = (length / medium.grain).round().max(1.0) as usize;
            let piece = length / pieces as f64;
            let grip = |n: usize| {
                let held = if n == 0 || n == pieces { 0.5 * piece } else { piece };
                let at = DVec3::Z * (n as f64 * piece - 0.5 * length);
                Grip {
                    at,
                    across: held * friction[0],
                    along: held * friction[1],
                    spin: held * PI * medium.viscosity * diameter * diameter,
                    steady: 0.0,
                    lever: DVec3::ZERO,
                    most: most.map(|most| held * most),
                }
            };
            (0..=pieces).map(grip).collect()
        }
        Form::Fibre { length, diameter } => {
            let inside = |p: DVec3| p.truncate().length() <= 1.0;
            let half = DVec3::new(0.5 * diameter, 0.5 * diameter, 0.5 * length);
            throughout(half, inside, 2.0 * PI, DVec3::new(0.25, 0.25, 1.0 / 3.0), medium)
        }
        Form::Sphere { diameter } => ellipsoid(DVec3::splat(0.5 * diameter), medium),
        Form::Ellipsoid { half_axes } => ellipsoid(half_axes, medium),
    }
}

/// Friction of a fibre across and along it, and the largest in thicker fluid, per length, in N s/m2.
fn per_length(diameter: f64, method: &Method, medium: &Medium) -> ([f64; 2], [f64; 2]) {
    match method.coupling {
        Coupling::Slender => {
            let missing = (2.0 * medium.line_radius / diameter).ln();
            let across = 4.0 * PI * medium.viscosity / missing;
            let most =
                most(method.felt, medium) * medium.density * medium.grain * medium.grain / medium.time_step;
            ([across.min(most), (0.5 * across).min(most)], [most, most])
        }
        Coupling::Svec => {
            let rate = medium.density / medium.time_step;
            let correction = svec_correction(diameter / medium.grain, medium.lattice_viscosity());
            let before = correction * rate * PI / 4.0 * diameter * diameter;
            let friction = 1.0 / (1.0 / before - SELF / (rate * medium.grain * medium.grain));
            ([friction, friction], [friction, friction])
        }
    }
}

fn ellipsoid(half_axes: DVec3, medium: &Medium) -> Vec<Grip> {
    let inside = |p: DVec3| p.length() <= 1.0;
    throughout(half_axes, inside, 4.0 / 3.0 * PI, DVec3::splat(0.2), medium)
}

/// Points throughout the volume of a form that lies within `half`; `inside`, `volume` and `seconds`, the mean square of the place along each axis, are those of the form within 1.
fn throughout(
    half: DVec3,
    inside: impl Fn(DVec3) -> bool,
    volume: f64,
    seconds: DVec3,
    medium: &Medium,
) -> Vec<Grip> {
    let radius = half.element_product().cbrt() / medium.grain;
    let short = overhang(medium.lattice_viscosity(), radius) * medium.grain;
    // A body smaller than that is a point.
    let half = (half - short).max(half * 0.1);
    let number = [0, 1, 2].map(|a| (2.0 * half[a] / medium.grain).ceil().max(1.0));
    let number = DVec3::from(number);
    let spacing = 2.0 * half / number;
    let mut grips = Vec::new();
    for n in 0..number.element_product() as usize {
        let (nx, ny) = (number.x as usize, number.y as usize);
        let at = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / nx / ny) as f64);
        let at = (at + 0.5) * spacing - half;
        if inside(at / half) {
            grips.push(at);
        }
    }
    // As many points as they are, they stand for the whole volume, and are as much longer than thick as the form is (points of a spheroid five times as long as
    // thick, 6 cells, would stand for one of 4.8).
    let share = volume * half.element_product() / grips.len() as f64;
    let squares = grips.iter().map(|at| *at * *at).sum::<DVec3>();
    let longer = half * (seconds * grips.len() as f64).map(f64::sqrt) / squares.map(f64::sqrt);
    let longer = longer.map(|of| if of.is_finite() { of } else { 1.0 });
    let scale = longer * (share / spacing.element_product() / longer.element_product()).cbrt();
    let zeta = medium.density / medium.time_step * share;
    let steady = 1.0 / grips.len() as f64;
    // Points lie alike on both sides of all three planes. Along an axis along which all are in the middle there is no moment.
    let second = scale * scale * squares;
    let inverse = second.map(|of| if of > 0.0 { of.recip() } else { 0.0 });
    let grip = |at: DVec3| {
        let at = scale * at;
        Grip { at, across: zeta, along: zeta, spin: 0.0, steady, lever: inverse * at, most: [zeta, zeta] }
    };
    grips.into_iter().map(grip).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correction_of_the_thesis() {
        // Svec 2013, below Eq. 3.14.
        assert!((svec_correction(0.075, 0.074) - 55.5).abs() < 0.3, "{}", svec_correction(0.075, 0.074));
    }

    #[test]
    fn a_fibre_is_held_along_all_of_its_length() {
        let medium = Medium { grain: 1.0, line_radius: 1.15, density: 1.0, viscosity: 0.1, time_step: 1.0 };
        for length in [6.0, 6.3, 12.0, 0.4] {
            let grips = grips(&Form::Fibre { length, diameter: 0.075 }, &Method::default(), &medium);
            let sum: f64 = grips.iter().map(|grip| grip.across).sum();
            let first: f64 = grips.iter().map(|grip| grip.across * grip.at.z).sum();
            approx::assert_relative_eq!(sum, length * 0.4 * PI / (2.3f64 / 0.075).ln(), max_relative = 1e-12);
            assert!(first.abs() < 1e-12);
        }
        assert_eq!(
            grips(&Form::Fibre { length: 6.0, diameter: 0.075 }, &Method::default(), &medium).len(),
            7
        );
    }

    #[test]
    fn points_of_a_spheroid_are_as_slender_as_it_is() {
        let medium = Medium { grain: 1.0, line_radius: 1.15, density: 1.0, viscosity: 0.3, time_step: 1.0 };
        for half in [DVec3::new(3.0, 3.0, 15.0), DVec3::new(2.5, 4.2, 3.0)] {
            let squares: DVec3 = ellipsoid(half, &medium).iter().map(|grip| grip.at * grip.at).sum();
            let filled = half - overhang(0.3, half.element_product().cbrt());
            let slender = |of: DVec3| of / of.x;
            assert!((slender(squares.map(f64::sqrt)) - slender(filled)).length() < 1e-12, "{squares}");
        }
    }
}
