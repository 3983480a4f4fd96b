//! Yielding between a wall and the first cell.
//!
//! Half-way bounce-back lets the half-cell between a no-slip wall and the centre of the first cell shear with the
//! viscosity *of that cell*. The stress is largest at the wall, though: where the wall has yielded and the centre not
//! yet, the cell is rigid and holds the fluid fast. A film of thickness h then stops as if its yield stress were larger by 1/(1 - dx/2h):
//! a slump at 5 mm comes to rest with a spread 5 % too small, and the error shrinks only with the first power of the cell size.
//!
//! Here the half-cell is given the shear that its own stress asks for. Let tau_w be the traction at the wall, tau_1 the
//! stress at the centre, phi(tau) = s(tau)/tau the fluidity of the flow curve. With tau linear in between, the velocity
//! across the half-cell is half the mean of s(tau); bounce-back gives phi(tau_1) (tau_w + tau_1)/4. The difference is
//! given to the wall as a velocity along the traction:
//!
//! ```text
//!     v = mean(s)/2 - (s(tau_1) + phi(tau_1) tau_w)/4        any flow curve
//!     v = tau_w (phi(tau_w) - phi(tau_1)) / 4                where s(tau) is straight: Bingham, and the cell has yielded
//!     v = (tau_w - tau_y)^2 / (4 nu_p (tau_w - tau_1))       Bingham, and the cell is rigid
//! ```
//!
//! The second is the first with the trapezoidal rule for the mean, which other curves may not take: where the cell is about to
//! yield, s(tau) is anything but straight, and v would jump. It vanishes for Newtonian fluids and where nothing has
//! yielded, and is continuous between all cases. A fluid that thins has v > 0 whether it has a yield stress or not, one that thickens
//! v < 0. phi(tau_1) is the fluidity of the cell, by all of its stress; the mean and s(tau_1) are those of shear along the wall.
//!
//! The stress `tau_1 = (1 - omega/2) P` is that of the coming collision. The traction follows from the momentum T that the wall takes in this
//! step. With a body force F_b alone the two are the same. A pressure gradient reaches a cell by its neighbours' populations,
//! of which those from the wall bring none, and T lacks a sixth of it: on the lattice, a flow that pressure drives is that
//! under a body force of the same size, the half-force counted as velocity, and what goes into the wall is ahead
//! by a half-force more in the one than in the other. What drives the fluid, whatever it is, balances the growth of the
//! stress over the half-cell, F = 2 (tau_w - tau_1); so
//!
//! ```text
//!     tau_w = T - F_b/6 + F/6 = 3/2 (T - F_b/6) - tau_1/2
//! ```
//!
//! (Taking T for the traction, a layer two cells thick that runs by its own slope yields 8 % too late.)
//!
//! T and P both fall by v/3 as v rises, for the four links that carry it, and v solves the equation with that.
//! All of this is local. Only cells at flat walls are treated; those in edges and corners keep plain bounce-back.

use crate::collision::{LEAST_RESISTANCE, Moments};
use crate::lattice::{C, Q};
use crate::real::{Number, larger};
use crate::relaxation::Relaxation;

/// Turns at most, and share of the interval, after which a sliding velocity counts as found.
const TURNS: usize = 60;
const NEAR: f64 = 3e-7;

/// The six faces of a cell as (axis, sign of the normal that points from the wall into the fluid).
pub(crate) const FACES: [(usize, i32); 6] = [(0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)];

/// For each face the two tangential axes.
pub(crate) const fn tangents(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// For each face and tangential axis, the velocities that come from the wall along and against that axis.
pub(crate) const SLANTED: [[[usize; 2]; 2]; 6] = {
    let mut table = [[[0; 2]; 2]; 6];
    let mut face = 0;
    while face < 6 {
        let (axis, normal) = FACES[face];
        let mut n = 0;
        while n < 2 {
            let along = tangents(axis)[n];
            let mut i = 0;
            while i < Q {
                if C[i][axis] == normal && C[i][along] != 0 {
                    table[face][n][if C[i][along] == 1 { 0 } else { 1 }] = i;
                }
                i += 1;
            }
            n += 1;
        }
        face += 1;
    }
    table
};

/// For each face the cells of a row at a flat wall there: all five velocities from that side come from solid and no
/// others do.
pub(crate) fn flat(solid: &[u8; Q]) -> [u8; 6] {
    FACES.map(|(axis, normal)| {
        (1..Q).fold(0xff, |cells, i| cells & if C[i][axis] == normal { solid[i] } else { !solid[i] })
    })
}

/// Velocity along the two tangents that the wall needs, given the cell's moments, its measure P of stress on the plane of the wall,
/// the momentum that the wall takes, both with the wall at rest, and the body force.
#[inline(always)]
pub(crate) fn wall_velocity<T: Number, R: Relaxation<T>>(
    m: &Moments<T>,
    stress: [T; 2],
    taken: [T; 2],
    force: [T; 2],
    law: &R,
) -> [T; 2] {
    let (third, four) = (T::from_f64(1.0 / 3.0), T::from_f64(4.0));
    let half = T::from_f64(0.5);
    // As if the cell were rigid, so that P is its stress.
    let traction: [T; 2] = std::array::from_fn(|n| {
        let still = taken[n] - T::from_f64(1.0 / 6.0) * force[n];
        still + half * (still - stress[n])
    });
    let size = (traction[0] * traction[0] + traction[1] * traction[1]).sqrt();
    let least = larger(size, T::TINY);
    let direction = [traction[0] / least, traction[1] / least];
    let along = direction[0] * stress[0] + direction[1] * stress[1];
    // What of 2 P:P the wall velocity leaves alone.
    let all = m.q * m.density * T::from_f64(2.0 / 3.0);
    let rest = all * all - four * (stress[0] * stress[0] + stress[1] * stress[1]);
    // In a film the stress falls to nothing at its surface, not at the end of the cell.
    let fill = larger(m.fill, T::from_f64(LEAST_RESISTANCE));
    let cell = |v: T| {
        let reduced = |n: usize| stress[n] - third * v * direction[n];
        let left = [reduced(0), reduced(1)];
        let square = rest + four * (left[0] * left[0] + left[1] * left[1]);
        let q = T::from_f64(1.5) / m.density * larger(square, T::ZERO).sqrt();
        let omega = law.omega(q);
        let two = T::from_f64(2.0);
        // P is the flow curve's stress and a sixth of the shear rate.
        let measure = along - third * v;
        let resisted = (T::ONE - omega / two) * measure;
        let wall = size - third * v + half * (measure - resisted);
        [T::from_f64(6.0) * omega / (two - omega), wall, (wall - resisted) / fill]
    };
    let v = law.wall_velocity(size, (size - along) / fill, cell);
    // A film may slide, but is not pushed back: what its cell shears by is not that of fluid up to the cell's end.
    let v = T::where_greater(T::ONE, m.fill, larger(v, T::ZERO), v);
    [v * direction[0], v * direction[1]]
}

/// The same for a wall along which the fluid slides at the speed `slides` of the wall stress; the wall stress too. `left` is the stress P
/// that the last collision left.
///
/// The wall may move already, by `so_far`; what comes on top is given. If it does not, the other parts of P are unknown, as the cell's
/// velocity is not yet near what it will be, and count as none.
///
/// In a rigid cell P alternates between steps for ever, as nothing but its mean is the cell's own, and a wall that went by it would
/// slide by jerks, which stop where there is no stress and so are too fast on average. The stress of such a cell is the mean of P
/// before this collision and after the last one, which is `(1 - omega/2) P` in a steady flow; where omega is 1 or more, P tells more.
#[inline(always)]
pub(crate) fn sliding_velocity<T: Number, R: Relaxation<T>>(
    m: &Moments<T>,
    stress: [T; 2],
    left: [T; 2],
    taken: [T; 2],
    force: [T; 2],
    law: &R,
    slides: impl Fn(T) -> T,
    so_far: Option<[T; 2]>,
) -> [[T; 2]; 2] {
    let (half, third, four) = (T::from_f64(0.5), T::from_f64(1.0 / 3.0), T::from_f64(4.0));
    let square = |v: [T; 2]| v[0] * v[0] + v[1] * v[1];
    let mean: [T; 2] = std::array::from_fn(|n| half * (stress[n] + left[n]));
    let still: [T; 2] = std::array::from_fn(|n| taken[n] - T::from_f64(1.0 / 6.0) * force[n]);
    let wall: [T; 2] = std::array::from_fn(|n| still[n] + half * (still[n] - mean[n]));
    let size = larger(square(wall).sqrt(), T::TINY);
    let direction = wall.map(|t| t / size);
    let along = |v: [T; 2]| v[0] * direction[0] + v[1] * direction[1];
    let (stress_along, mean_along, still_along) = (along(stress), along(mean), along(still));
    let all = m.q * m.density * T::from_f64(2.0 / 3.0);
    // What of 2 P:P the wall's velocity leaves alone, and what of it lies across the traction.
    let others = if so_far.is_some() { all * all - four * square(stress) } else { T::ZERO };
    let before = along(so_far.unwrap_or([T::ZERO; 2]));
    let aside = larger(square(mean) - mean_along * mean_along, T::ZERO);
    let fluidity = |stress: T| {
        let all = half * larger(others + four * (stress * stress + aside), T::ZERO).sqrt();
        law.rate(all) / larger(all, T::TINY)
    };
    let fill = larger(m.fill, T::from_f64(LEAST_RESISTANCE));
    // A velocity v of the wall takes v/3 off P and off the momentum.
    let state = |v: T| {
        let (eased, mean) = (third * v, mean_along - half * third * v);
        let by_mean = fluidity(mean);
        let omega = by_mean / (T::from_f64(3.0) + half * by_mean);
        let now = (T::ONE - half * omega) * (stress_along - eased);
        let resisted = now + larger(T::ONE - omega, T::ZERO) * (mean - now);
        let still = still_along - eased;
        let wall = still + half * (still - resisted);
        [fluidity(resisted), wall, (wall - resisted) / fill]
    };
    // Grows with v; at the upper end there is no stress left.
    let excess = |v: T| {
        let state = state(v);
        before + v - slides(larger(state[1], T::ZERO)) - law.half_cell(size, state)
    };
    // A film is not pushed back, as above.
    let most = T::from_f64(3.0) * larger(larger(still_along, mean_along), stress_along);
    let least = T::where_greater(T::ONE, m.fill, -before, -(size + before.abs()));
    let v = root(excess, least, larger(most, size));
    let wall = state(v)[1];
    [direction.map(|along| v * along), direction.map(|along| wall * along)]
}

/// Where a function that grows from `low` to `high` is zero (regula falsi, Anderson and Bjoerck 1973), or the end nearer to that.
#[inline(always)]
pub(crate) fn root<T: Number>(f: impl Fn(T) -> T, mut low: T, mut high: T) -> T {
    let (one, half) = (T::ONE, T::from_f64(0.5));
    let (mut f_low, mut f_high) = (f(low), f(high));
    let close = T::from_f64(NEAR) * (high - low);
    let mut middle = T::where_greater(T::ZERO, f_low, high, low);
    // 1 where the search goes on.
    let inside = T::where_greater(T::ZERO, f_low, one, T::ZERO);
    let mut open = T::where_greater(f_high, T::ZERO, inside, T::ZERO);
    for _ in 0..TURNS {
        if !T::any_greater(open, T::ZERO) {
            break;
        }
        let next = high - f_high * (high - low) / (f_high - f_low);
        let f_next = f(next);
        // The end that stays where it is counts for less.
        let eased = |f_end: T| {
            let share = one - f_next / f_end;
            T::where_greater(share, T::ZERO, share, half)
        };
        let (eased_low, eased_high) = (f_low * eased(f_high), f_high * eased(f_low));
        let above = |yes: T, no: T| T::where_greater(f_next, T::ZERO, yes, no);
        let new = [above(low, next), above(eased_low, f_next), above(next, high), above(f_next, eased_high)];
        let keep = |new: T, old: T| T::where_greater(open, T::ZERO, new, old);
        low = keep(new[0], low);
        f_low = keep(new[1], f_low);
        high = keep(new[2], high);
        f_high = keep(new[3], f_high);
        // One end often stays where it is.
        let narrow = T::where_greater(close, high - low, T::ZERO, open);
        let moved = T::where_greater(close, (next - middle).abs(), T::ZERO, narrow);
        middle = keep(next, middle);
        open = T::where_greater(f_next.abs(), T::ZERO, moved, T::ZERO);
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slanted_velocities_leave_the_wall() {
        for (face, (axis, normal)) in FACES.into_iter().enumerate() {
            for (n, along) in tangents(axis).into_iter().enumerate() {
                for (side, sign) in [(0, 1), (1, -1)] {
                    let mut c = [0; 3];
                    (c[axis], c[along]) = (normal, sign);
                    assert_eq!(C[SLANTED[face][n][side]], c);
                }
            }
        }
    }

    #[test]
    fn only_flat_walls_count() {
        let floor: [u8; Q] = std::array::from_fn(|i| if C[i][2] == 1 { 0b0110 } else { 0 });
        assert_eq!(flat(&floor), [0, 0, 0, 0, 0b0110, 0]);
        let edge: [u8; Q] = std::array::from_fn(|i| floor[i] | if C[i][0] == 1 { 0b0010 } else { 0 });
        assert_eq!(flat(&edge), [0, 0, 0, 0, 0b0100, 0]);
    }
}
