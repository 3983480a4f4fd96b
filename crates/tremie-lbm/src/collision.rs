//! What happens inside one cell: moments, stress, and relaxation (the collision called MTRT here).
//!
//! Populations are kept as `g_i = f_i - w_i`, so that single precision is spent on the deviation from rest. With the
//! body force density F = rho a (Guo, Zheng and Shi 2002: half of it belongs to the velocity)
//!
//! ```text
//!     rho = 1 + sum g_i,   rho u = sum c_i g_i + F/2
//!     P   = dev( sum c c (f - f_eq) + (u F + F u)/2 ),   q = 3/(2 rho) sqrt(2 P:P),   omega = omega(q)
//! ```
//!
//! only the deviatoric stress is relaxed with `omega`; the trace relaxes with `omega_trace`, 1 if not told otherwise, and all higher even moments go to equilibrium at
//! once, the odd moments relax with `omega_odd` from `(1/omega - 1/2)(1/omega_odd - 1/2) = 3/16`, which keeps a
//! half-way wall in its place for every viscosity (Ginzburg, Verhaeghe and d'Humieres 2008). In a nearly inviscid fluid (lattice viscosity below 1/64)
//! the rule would hardly relax them at all, and where such a flow is stretched they would grow without bounds (the foot
//! of a dam break): there they relax at rates from 1/2 to 1, the thinner the faster, and at walls the velocity is off by up to an eighth of its second derivative. After the collision
//!
//! ```text
//!     even part:  w (rho - 1) + 9/2 w (c c - I/3) : (rho u u + (1 - omega) P + (1 - omega_trace) t I + (u F + F u)/2)
//!     odd part:   (1 - omega_odd) odd + 3 w c . (omega_odd sum c g + F)
//! ```
//!
//! The trace, `3 t = tr(sum c c (f - f_eq) + (u F + F u)/2)`, is what the fluid resists with when it is pressed together: its bulk viscosity is
//! `2/9 (1/omega_trace - 1/2)` (Dellar 2001), by which sound dies away. In a flow that keeps its volume it does nothing but for errors of the order of the speed squared.
//!
//! An interface cell weighs what it holds, if it is held (module `support`), and resists by as much: its force, viscosity and yield stress are scaled by its fill,
//! the mixture rule of volume-of-fluid methods (Hirt and Nichols 1981). Without the second half of this, interface cells
//! are a crust that is half a cell too thick on average, and a sheet of yield-stress fluid a few cells thick comes to rest
//! too early: by 1 % of a slump's spread at 5 mm, 5 % at 10 mm. With it the two agree within 0.2 %. A cell at a wall resists by
//! no less than the share of the wall that it wets: a film holds on to all of the wall under it, be it ever so thin.
//!
//! The flow carries the shear stress along: the odd moments `sum c_a c_a c_b f` relax towards `2 u_a (1 - omega/2) P_ab` more than
//! in equilibrium (a collision of cumulants has this by itself; Geier, Schoenherr, Pasquali and Krafczyk 2015). Otherwise
//! the work of a force that shear stress balances collects in P_aa, and a plug that moves at u yields everywhere, at
//! the rate 3 u F. The normal stresses are left out, which only add the work of a gas to a channel's exact parabola.
//!
//! A cell below the yield stress has omega = 0 and omega_odd = 2; what rings then under the two-relaxation-time
//! scheme is damped here, because everything but the stress itself relaxes at rate 1. What is left are the waves of an elastic
//! solid, since stress that does not relax is what all strain adds up to, and nothing damps them. Bodies answer a wave a step late, those at walls
//! a step and a half (module `immersed`): more than a quarter of the period of the shortest, so that they can drive it, at a rate in proportion to their
//! friction; so do the bars of cages (module `cage`). So odd moments that are thrown back with omega_odd = 2 are held to `2 - k/10` where bodies or bars rub by k for each unit of velocity (of which they get 4/3 at most beside walls). Stress then spreads by
//! `D = (1/omega_odd - 1/2)/3`, which is k/120 cells squared a step, and with it the shortest waves die down. What does not yield and has a stress that varies over n cells creeps as
//! if its viscosity was `n^2/(3 D)` = 40 n^2/k in lattice units, where the fluid has less than 1.

use crate::immersed::TAKES;
use crate::lanes::Lanes;
use crate::lattice::{C, PAIRS, Q, W};
use crate::real::{Number, Real, by_axis, larger, smaller};
use crate::relaxation::Relaxation;
use crate::support::weighs;

/// The magic parameter of the two relaxation rates.
pub(crate) const MAGIC: f64 = 3.0 / 16.0;

/// Lattice viscosity below which a fluid counts as nearly inviscid.
const NEARLY_INVISCID: f64 = 1.0 / 64.0;

/// Whether a fluid of a lattice viscosity counts as nearly inviscid.
pub(crate) fn nearly_inviscid(viscosity: f64) -> bool {
    viscosity < NEARLY_INVISCID
}

/// Relaxation rates of the odd moments at least, in the thickest and the thinnest nearly inviscid fluids.
const LEAST_ODD: [f64; 2] = [0.5, 1.0];
/// Lattice viscosity from which on downwards it is the latter. (With 1/4 a dam break at a few thousandths is torn apart; with 1/2 splashes at 0.001 and 0.002
/// break down that do not with 1, of thirty from 0.004 on none.)
const INVISCID: f64 = 1.0 / 256.0;

/// Least relaxation rate of the odd moments in a fluid of a lattice viscosity.
pub(crate) fn least_odd(viscosity: f64) -> f64 {
    let [thick, thin] = LEAST_ODD;
    if nearly_inviscid(viscosity) { (thin * INVISCID / viscosity).clamp(thick, thin) } else { 0.0 }
}

/// The magic parameter that a Newtonian fluid of a lattice viscosity has.
pub(crate) fn magic(viscosity: f64) -> f64 {
    match least_odd(viscosity) {
        0.0 => MAGIC,
        rate => MAGIC.min(3.0 * viscosity * (rate.recip() - 0.5)),
    }
}

/// Relaxation rates that do not depend on the stress.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rates<T> {
    /// Least one of the odd moments.
    pub(crate) least_odd: T,
    /// That of the trace of the stress.
    pub(crate) trace: T,
}

impl<T: Real> Rates<T> {
    /// The same for the cells of a row.
    #[inline(always)]
    pub(crate) fn of_row(self) -> Rates<Lanes<T>> {
        Rates { least_odd: Lanes::splat(self.least_odd), trace: Lanes::splat(self.trace) }
    }
}

/// By how much of the friction with bodies the odd moments relax less than twice over.
const DAMPING: f64 = 0.1;

/// Moments of one cell, or of the cells of a row, before the collision, in lattice units.
#[derive(Clone, Copy)]
pub(crate) struct Moments<T> {
    /// Density less one.
    pub(crate) excess_density: T,
    /// Density.
    pub(crate) density: T,
    /// Momentum without the force's half.
    pub(crate) momentum: [T; 3],
    /// Force density.
    pub(crate) force: [T; 3],
    /// Velocity.
    pub(crate) velocity: [T; 3],
    /// Deviatoric non-equilibrium stress P: xx, yy, zz, xy, xz, yz.
    pub(crate) stress: [T; 6],
    /// A third of the trace of the non-equilibrium stress, t.
    pub(crate) third_of_trace: T,
    /// The measure q of that stress.
    pub(crate) q: T,
    /// Share of the cell that holds fluid, 0 to 1.
    pub(crate) fill: T,
    /// Share of the flow curve's stress that the cell resists with, 0 to 1; nothing if all of it.
    pub(crate) resistance: Option<T>,
}

/// Least resistance of an interface cell.
pub(crate) const LEAST_RESISTANCE: f64 = 0.1;

impl<T: Number> Moments<T> {
    /// Shear component (a, b) of P that a collision left in the populations `f`, of this velocity and force.
    pub(crate) fn stress_left(&self, f: &[T; Q], a: usize, b: usize) -> T {
        let (ab, u) = ((1..Q).filter(|i| C[*i][a] * C[*i][b] != 0), self.velocity);
        let second = ab.fold(T::ZERO, |sum, i| if C[i][a] == C[i][b] { sum + f[i] } else { sum - f[i] });
        let half = |n: usize| T::from_f64(0.5) * self.force[n];
        second - u[a] * (self.density * u[b] + half(b)) - half(a) * u[b]
    }

    /// Relaxation rate, as a quotient: `1/omega - 1/2 = r (1/omega(q/r) - 1/2)`, which is the flow curve with stress and viscosity
    /// scaled by the resistance r.
    #[inline(always)]
    fn quotient<R: Relaxation<T>>(&self, law: &R) -> [T; 2] {
        let Some(r) = self.resistance else { return law.quotient(self.q) };
        let [numerator, denominator] = law.quotient(self.q / r);
        [numerator, r * denominator + T::from_f64(0.5) * numerator * (T::ONE - r)]
    }

    /// Relaxation rate.
    #[inline(always)]
    pub(crate) fn omega<R: Relaxation<T>>(&self, law: &R) -> T {
        let [numerator, denominator] = self.quotient(law);
        numerator / denominator
    }

    /// Relaxation rate of the odd moments.
    #[inline(always)]
    pub(crate) fn omega_odd<R: Relaxation<T>>(&self, law: &R, drive: Drive<T>, rates: Rates<T>) -> T {
        odd_rate(self.quotient(law), drive, rates)
    }
}

/// What drives a cell.
#[derive(Clone, Copy)]
pub(crate) struct Drive<T> {
    /// Acceleration, which the mass that the cell holds weighs by.
    pub(crate) gravity: [T; 3],
    /// Force of its own.
    pub(crate) push: [T; 3],
    /// What bodies in it ask to take of its momentum for each unit of velocity and step, where there may be any.
    pub(crate) friction: Option<T>,
}

impl<T: Number> Drive<T> {
    /// Nothing but the weight. (What -0 is added to stays what it is, so that the compiler leaves that out; 0 would make 0 of -0.)
    #[inline(always)]
    pub(crate) fn by_weight(gravity: [T; 3]) -> Self {
        Self { gravity, push: by_axis(|_| T::from_f64(-0.0)), friction: None }
    }
}

/// How much of a cell holds fluid.
#[derive(Clone, Copy)]
pub(crate) enum Held<T> {
    /// All of it.
    Whole,
    /// What makes up a mass; the resistance is at least `least`, whatever the fill.
    Partly {
        /// Mass, infinite in liquid cells.
        mass: T,
        /// Least share of the flow curve's stress that the cell resists with.
        least: T,
        /// How it is held (module `support`).
        support: T,
    },
}

impl<T: Number> Held<T> {
    /// Fill (mass over density, between 0 and 1), weight over that of a full cell, and resistance, if not whole, of a cell of this density.
    #[inline(always)]
    pub(crate) fn shares(self, density: T) -> (T, T, Option<T>) {
        match self {
            Self::Whole => (T::ONE, T::ONE, None),
            Self::Partly { mass, least, support } => {
                let fill = larger(smaller(mass / density, T::ONE), T::ZERO);
                (fill, weighs(fill, support), Some(larger(fill, least)))
            }
        }
    }
}

/// Where the component (a, b) of a symmetric tensor stands in the order xx, yy, zz, xy, xz, yz.
pub(crate) const COMPONENT: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];

/// Runs a block once for each plane of slanted velocities, with its axes a and b and the first of its two pairs p as constants: the
/// pair `c_a = c_b`, after which comes the pair `c_a = -c_b`. (A loop over a table of these would go through memory.)
macro_rules! each_plane {
    ($a:ident, $b:ident, $p:ident, $body:block) => {
        each_plane!(@ $a, $b, $p, $body, (0 1 3) (0 2 5) (1 2 7))
    };
    (@ $a:ident, $b:ident, $p:ident, $body:block, $(($x:literal $y:literal $z:literal))*) => {
        $({
            const $a: usize = $x;
            const $b: usize = $y;
            const $p: usize = $z;
            $body
        })*
    };
}

const _: () = {
    assert!(PAIRS == 9 && C[1][0] == 1 && C[3][1] == 1 && C[5][2] == 1);
    each_plane!(A, B, P, {
        assert!(C[2 * P + 1][A] == 1 && C[2 * P + 1][B] == 1);
        assert!(C[2 * P + 3][A] == 1 && C[2 * P + 3][B] == -1);
    });
};

/// One number for each component of a symmetric tensor.
#[inline(always)]
fn by_component<T>(of: impl Fn(usize) -> T) -> [T; 6] {
    [of(0), of(1), of(2), of(3), of(4), of(5)]
}

/// Half of the symmetric product of two vectors, `(u v + v u)/2`.
#[inline(always)]
fn product<T: Number>(u: [T; 3], v: [T; 3]) -> [T; 6] {
    let half = by_axis(|a| T::from_f64(0.5) * v[a]);
    let mut product = [u[0] * v[0], u[1] * v[1], u[2] * v[2], T::ZERO, T::ZERO, T::ZERO];
    each_plane!(A, B, _P, {
        product[COMPONENT[A][B]] = u[A] * half[B] + u[B] * half[A];
    });
    product
}

/// Moments of the populations `f` of a cell that is driven.
#[inline(always)]
pub(crate) fn moments<T: Number>(f: &[T; Q], held: Held<T>, drive: Drive<T>) -> Moments<T> {
    let sum = |p: usize| f[2 * p + 1] + f[2 * p + 2];
    let difference = |p: usize| f[2 * p + 1] - f[2 * p + 2];
    let mut second = [sum(0), sum(1), sum(2), T::ZERO, T::ZERO, T::ZERO];
    let mut momentum = by_axis(difference);
    let mut excess_density = f[0] + (second[0] + second[1] + second[2]);
    each_plane!(A, B, P, {
        let both = sum(P) + sum(P + 1);
        excess_density += both;
        second[A] += both;
        second[B] += both;
        second[COMPONENT[A][B]] = sum(P) - sum(P + 1);
        momentum[A] += difference(P) + difference(P + 1);
        momentum[B] += difference(P) - difference(P + 1);
    });
    let density = T::ONE + excess_density;
    let inverse = T::ONE / density;
    let (fill, weighs, resistance) = held.shares(density);
    let force = by_axis(|a| drive.gravity[a] * density * weighs + drive.push[a]);
    let half = by_axis(|a| T::from_f64(0.5) * force[a]);
    let velocity = by_axis(|a| (momentum[a] + half[a]) * inverse);
    // rho u u - (u F + F u)/2, as rho u - F is the momentum less half the force.
    let carried = product(velocity, by_axis(|a| momentum[a] - half[a]));
    let mut stress = by_component(|n| second[n] - carried[n]);
    let mean = T::from_f64(1.0 / 3.0) * (stress[0] + stress[1] + stress[2]);
    stress[0] -= mean;
    stress[1] -= mean;
    stress[2] -= mean;
    let normal = stress[0] * stress[0] + stress[1] * stress[1] + stress[2] * stress[2];
    let shear = stress[3] * stress[3] + stress[4] * stress[4] + stress[5] * stress[5];
    let q = inverse * (T::from_f64(4.5) * (normal + (shear + shear))).sqrt();
    let third_of_trace = mean - T::from_f64(1.0 / 3.0) * excess_density;
    Moments {
        excess_density,
        density,
        momentum,
        force,
        velocity,
        stress,
        third_of_trace,
        q,
        fill,
        resistance,
    }
}

/// Relaxation rate of the odd moments, where that of the stress is a quotient.
#[inline(always)]
fn odd_rate<T: Number>([numerator, denominator]: [T; 2], drive: Drive<T>, rates: Rates<T>) -> T {
    let two = T::from_f64(2.0);
    // 1/omega_odd = 1/2 + magic/(1/omega - 1/2), multiplied out so that omega = 0 is no special case.
    let rest = two * denominator - numerator;
    let omega_odd = two * rest / (rest + T::from_f64(4.0 * MAGIC) * numerator);
    let omega_odd = match drive.friction {
        None => omega_odd,
        Some(asked) => {
            let friction = smaller(asked, T::from_f64(TAKES));
            smaller(omega_odd, two - T::from_f64(DAMPING) * friction)
        }
    };
    larger(omega_odd, rates.least_odd)
}

/// Populations after the collision, and the density.
#[inline(always)]
pub(crate) fn collide<T: Number, R: Relaxation<T>>(
    f: &[T; Q],
    held: Held<T>,
    drive: Drive<T>,
    law: &R,
    rates: Rates<T>,
) -> ([T; Q], T) {
    let m = moments(f, held, drive);
    let quotient = m.quotient(law);
    let omega = quotient[0] / quotient[1];
    let omega_odd = odd_rate(quotient, drive, rates);
    let two = T::from_f64(2.0);
    let keep_odd = T::from_f64(0.5) * (T::ONE - omega_odd);
    let push = by_axis(|a| omega_odd * m.momentum[a] + m.force[a]);
    let third = (T::ONE - rates.trace) * m.third_of_trace;
    let carry = omega_odd * (two - omega);
    let post = compose(&m, omega, third, push, carry, |p| keep_odd * (f[2 * p + 1] - f[2 * p + 2]));
    (post, m.density)
}

/// Populations after a collision that ends one time step and begins `factor` times as long ones, and the density before.
///
/// Velocity, shear rate and stress go on in the new units (primes; L is the factor), and with them q = 3 sigma + s/2:
///
/// ```text
///     drho' = L^2 drho,   u' = L u,   F' = L^2 F rho'/rho
///     q' = L^2 (q - s/2) + L s/2,   P' = P (q'/q) (rho'/rho),   omega' = L s / q',   t' = L t rho'/rho
/// ```
///
/// The odd moments are those of a steady flow.
#[inline(always)]
pub(crate) fn rescale<T: Number, R: Relaxation<T>>(
    f: &[T; Q],
    held: Held<T>,
    drive: Drive<T>,
    law: &R,
    trace: T,
    factor: T,
) -> ([T; Q], T) {
    let m = moments(f, held, drive);
    let half = T::from_f64(0.5);
    let rate = m.omega(law) * m.q;
    let square = factor * factor;
    let q = square * (m.q - half * rate) + half * factor * rate;
    let omega = factor * rate / larger(q, T::TINY);
    let excess_density = square * m.excess_density;
    let density = T::ONE + excess_density;
    let share = density / m.density;
    let grown = q / larger(m.q, T::TINY) * share;
    let force = by_axis(|a| square * share * m.force[a]);
    let velocity = by_axis(|a| factor * m.velocity[a]);
    let n = Moments { excess_density, density, force, velocity, q, stress: m.stress.map(|p| grown * p), ..m };
    let push = by_axis(|a| density * velocity[a] + half * force[a]);
    let third = (T::ONE - trace) * factor * share * m.third_of_trace;
    (compose(&n, omega, third, push, T::from_f64(2.0) - omega, |_| T::ZERO), m.density)
}

/// Populations with the even moments of a collision, of whose trace three times `third` are left, and the odd ones made up of `3 w c . push`, what the flow carries of the
/// stress times `carry`, and `odd` for each pair of velocities.
#[inline(always)]
fn compose<T: Number>(
    m: &Moments<T>,
    omega: T,
    third: T,
    push: [T; 3],
    carry: T,
    odd: impl Fn(usize) -> T,
) -> [T; Q] {
    let number = T::from_f64;
    let (two, quarter, eighth) = (number(2.0), number(0.25), number(0.125));
    let keep = T::ONE - omega;
    let carried = product(m.velocity, by_axis(|a| m.density * m.velocity[a] + m.force[a]));
    let mut tensor = by_component(|n| carried[n] + keep * m.stress[n]);
    tensor[0] += third;
    tensor[1] += third;
    tensor[2] += third;
    let trace = tensor[0] + tensor[1] + tensor[2];
    // Weights are 12, 2 and 1 times 1/36; 9/2 of that is 1/8.
    let base = number(1.0 / 36.0) * (m.excess_density - number(1.5) * trace);
    let normal = by_axis(|a| eighth * tensor[a]);
    let drive = by_axis(|a| number(1.0 / 12.0) * push[a]);
    // carried[a][b]: what the flow carries of the stress, a quarter of sum c_a c_a c_b f. That much on each velocity in the
    // plane (a, b), and its opposite on the axis b, so that no momentum comes of it.
    let speed = by_axis(|a| quarter * carry * m.velocity[a]);
    let carried =
        by_axis(|a| by_axis(|b| if a == b { T::ZERO } else { speed[a] * m.stress[COMPONENT[a][b]] }));
    let mut post = [T::ZERO; Q];
    let mut put = |p: usize, even: T, odd: T| {
        post[2 * p + 1] = even + odd;
        post[2 * p + 2] = even - odd;
    };
    let across =
        [carried[1][0] + carried[2][0], carried[0][1] + carried[2][1], carried[0][2] + carried[1][2]];
    put(0, two * (base + normal[0]), odd(0) + two * (drive[0] - across[0]));
    put(1, two * (base + normal[1]), odd(1) + two * (drive[1] - across[1]));
    put(2, two * (base + normal[2]), odd(2) + two * (drive[2] - across[2]));
    each_plane!(A, B, P, {
        let even = base + (normal[A] + normal[B]);
        let shear = quarter * tensor[COMPONENT[A][B]];
        let along = [drive[A] + carried[B][A], drive[B] + carried[A][B]];
        put(P, even + shear, odd(P) + (along[0] + along[1]));
        put(P + 1, even - shear, odd(P + 1) + (along[0] - along[1]));
    });
    post[0] = number(12.0) * base;
    post
}

/// Equilibrium populations at a density less one and a velocity.
pub(crate) fn equilibrium<T: Real>(excess_density: f64, u: [f64; 3]) -> [T; Q] {
    let density = 1.0 + excess_density;
    let square = u.iter().map(|u| u * u).sum::<f64>();
    std::array::from_fn(|i| {
        let along: f64 = (0..3).map(|a| f64::from(C[i][a]) * u[a]).sum();
        T::from_f64(W[i] * (excess_density + density * (3.0 * along + 4.5 * along * along - 1.5 * square)))
    })
}

/// Density less one and momentum of one cell's populations, in double precision.
pub(crate) fn density_and_momentum<T: Real>(f: &[T; Q]) -> (f64, [f64; 3]) {
    let mut excess_density = f[0].to_f64();
    let mut momentum = [0.0; 3];
    for i in 1..Q {
        let g = f[i].to_f64();
        excess_density += g;
        for a in 0..3 {
            momentum[a] += f64::from(C[i][a]) * g;
        }
    }
    (excess_density, momentum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relaxation::Bingham;

    const DRIVE: Drive<f64> =
        Drive { gravity: [2e-5, -1e-5, -3e-5], push: [-1e-5, 3e-5, 2e-5], friction: Some(0.5) };

    const RATES: Rates<f64> = Rates { least_odd: 0.0, trace: 1.0 };

    /// Some populations near equilibrium.
    fn populations() -> [f64; Q] {
        let base = equilibrium::<f64>(0.004, [0.02, -0.03, 0.01]);
        std::array::from_fn(|i| base[i] + 1e-3 * (1.7 * i as f64 + 0.3).sin())
    }

    #[test]
    fn mass_is_kept_and_momentum_gains_the_force() {
        let before = populations();
        let (after, density) = collide(&before, Held::Whole, DRIVE, &Bingham::new(1e-4, 0.1), RATES);
        let (r0, j0) = density_and_momentum(&before);
        let (r1, j1) = density_and_momentum(&after);
        assert!((r0 - r1).abs() < 1e-15 && (density - 1.0 - r0).abs() < 1e-15);
        for a in 0..3 {
            assert!((j1[a] - j0[a] - density * DRIVE.gravity[a] - DRIVE.push[a]).abs() < 1e-15);
        }
    }

    #[test]
    fn stress_relaxes_with_omega_and_the_trace_by_its_own_rate() {
        let before = populations();
        let law = Bingham::new(1e-4, 0.1);
        let m0 = moments(&before, Held::Whole, Drive::by_weight([0.0; 3]));
        let rates = Rates { trace: 0.3, ..RATES };
        let (after, _) = collide(&before, Held::Whole, Drive::by_weight([0.0; 3]), &law, rates);
        let m1 = moments(&after, Held::Whole, Drive::by_weight([0.0; 3]));
        let omega = law.omega(m0.q);
        assert!(omega > 0.1 && omega < 1.9);
        for n in 0..6 {
            assert!((m1.stress[n] - (1.0 - omega) * m0.stress[n]).abs() < 1e-15);
        }
        let trace = |f: &[f64; Q]| {
            (1..Q).map(|i| f64::from(C[i].iter().map(|c| c * c).sum::<i32>()) * f[i]).sum::<f64>()
        };
        let speed2 = m0.velocity.iter().map(|u| u * u).sum::<f64>();
        let equilibrium = m0.excess_density + m0.density * speed2;
        let left = |rates| {
            let (after, _) = collide(&before, Held::Whole, Drive::by_weight([0.0; 3]), &law, rates);
            trace(&after) - equilibrium
        };
        assert!((left(rates) - 0.7 * (trace(&before) - equilibrium)).abs() < 1e-15);
        assert!(left(RATES).abs() < 1e-15);
    }

    #[test]
    fn equilibrium_stays() {
        let before = equilibrium::<f64>(0.004, [0.02, -0.03, 0.01]);
        for law in [Bingham::new(0.0, 0.1), Bingham::new(1e-4, 0.1)] {
            let (after, _) = collide(&before, Held::Whole, Drive::by_weight([0.0; 3]), &law, RATES);
            for i in 0..Q {
                assert!((after[i] - before[i]).abs() < 1e-16);
            }
        }
    }

    /// What is left of the speed of a shear wave across z, a few cells long, in fluid far below its yield stress, in which bodies rub.
    fn left_of_a_wave(cells: usize, friction: f64) -> f64 {
        let law = Bingham::new(1.0, 0.1);
        let drive = Drive { friction: Some(friction), ..Drive::by_weight([0.0; 3]) };
        let speed = |n: usize| 1e-4 * (2.0 * std::f64::consts::PI * (n as f64 + 0.3) / cells as f64).sin();
        let mut now: Vec<[f64; Q]> = (0..cells).map(|n| equilibrium(0.0, [speed(n), 0.0, 0.0])).collect();
        let mut largest = |steps: usize| {
            let mut largest = 0.0f64;
            for _ in 0..steps {
                let post: Vec<_> =
                    now.iter().map(|f| collide(f, Held::Whole, drive, &law, RATES).0).collect();
                for n in 0..cells {
                    now[n] = std::array::from_fn(|i| {
                        post[(n as i32 - C[i][2]).rem_euclid(cells as i32) as usize][i]
                    });
                    largest = largest.max(density_and_momentum(&now[n]).1[0].abs());
                }
            }
            largest
        };
        let first = largest(20);
        largest(400);
        largest(20) / first
    }

    /// By how much a sound wave, `cells` long, dies away in a step.
    fn damping(cells: usize, viscosity: f64, trace: f64) -> f64 {
        let (law, rates) = (Bingham::new(0.0, viscosity), Rates { least_odd: 0.0, trace });
        let wave = |n: usize| (2.0 * std::f64::consts::PI * (n as f64 + 0.3) / cells as f64).sin();
        let mut now: Vec<[f64; Q]> =
            (0..cells).map(|n| equilibrium(0.0, [0.0, 0.0, 1e-5 * wave(n)])).collect();
        // The energy of the wave, which goes to and fro between speed and pressure.
        let energy = |now: &[[f64; Q]]| {
            let parts = now.iter().map(density_and_momentum);
            parts.map(|(excess, momentum)| momentum[2].powi(2) + excess * excess / 3.0).sum::<f64>()
        };
        // Over whole periods, within which what is lost comes and goes, from the second on.
        let period = (3.0f64.sqrt() * cells as f64).round() as usize;
        let mut after = |steps: usize| {
            for _ in 0..steps {
                let rest = Drive::by_weight([0.0; 3]);
                let post: Vec<_> = now.iter().map(|f| collide(f, Held::Whole, rest, &law, rates).0).collect();
                for n in 0..cells {
                    let from = |i: usize| (n as i32 - C[i][2]).rem_euclid(cells as i32) as usize;
                    now[n] = std::array::from_fn(|i| post[from(i)][i]);
                }
            }
            energy(&now)
        };
        let start = after(period);
        -0.5 * (after(3 * period) / start).ln() / (3 * period) as f64
    }

    #[test]
    fn sound_dies_away_by_bulk_and_shear_viscosity() {
        // Stokes (1845): k^2 (4/3 nu + nu_bulk)/2, of second order in the cells.
        for (viscosity, trace) in [(0.1, 1.0), (0.02, 0.5), (0.1, 0.2), (0.02, 0.2)] {
            let bulk = 2.0 / 9.0 * (1.0 / trace - 0.5);
            for (cells, tolerance) in [(120, 0.02), (240, 0.005)] {
                let k = 2.0 * std::f64::consts::PI / cells as f64;
                let exact = 0.5 * k * k * (4.0 / 3.0 * viscosity + bulk);
                let found = damping(cells, viscosity, trace);
                assert!(
                    (found / exact - 1.0).abs() < tolerance,
                    "{viscosity}, {trace}: {found}, not {exact}"
                );
            }
        }
    }

    #[test]
    fn where_bodies_rub_what_does_not_yield_stops_ringing() {
        for cells in [2, 3, 4, 6] {
            let [without, with, crowded] = [0.0, 1.0, 100.0].map(|friction| left_of_a_wave(cells, friction));
            assert!(without > 0.5 && with < 0.2, "{cells} cells: {without} and {with}");
            assert!(crowded < with, "{cells} cells, where much more is asked than taken: {crowded}");
        }
    }

    #[test]
    fn a_mirrored_cell_collides_mirrored() {
        use crate::lattice::MIRROR;
        let before = populations();
        let law = Bingham::new(1e-4, 0.1);
        let held = Held::Partly { mass: 0.4, least: 0.1, support: 1.0 };
        let (after, _) = collide(&before, held, DRIVE, &law, RATES);
        for flip in 0..8usize {
            let mirrored: [f64; Q] = std::array::from_fn(|i| before[usize::from(MIRROR[flip][i])]);
            let sign = |a: usize| if flip >> a & 1 == 1 { -1.0 } else { 1.0 };
            let of = |v: [f64; 3]| [0, 1, 2].map(|a| sign(a) * v[a]);
            let drive = Drive { gravity: of(DRIVE.gravity), push: of(DRIVE.push), ..DRIVE };
            let (other, _) = collide(&mirrored, held, drive, &law, RATES);
            for i in 0..Q {
                assert!((other[i] - after[usize::from(MIRROR[flip][i])]).abs() < 1e-16);
            }
        }
    }
}
