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
use crate::real::{Number, larger, smaller};
use crate::relaxation::Relaxation;

/// Turns at most in which a sliding velocity is found.
const TURNS: usize = 60;
/// Error that it may have, over the traction at the wall, while what else the cell bears is not known.
const GUESSED: f64 = 1e-4;
/// Error that it may have in the end.
pub(crate) const FOUND: f64 = 1e-5;
/// How far aside, over the traction, tells how steep a function is.
const BESIDE: f64 = 1e-3;
/// The least slope: what is asked for grows by about 1.
const LEAST_SLOPE: f64 = 0.25;

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
    let still = [0, 1].map(
        #[inline(always)]
        |n: usize| taken[n] - T::from_f64(1.0 / 6.0) * force[n],
    );
    // The wall moves along what the wall at rest bears. (P alone is more than the stress of a cell that yields, so that the traction would be
    // next to nothing or point back at some speed, and turn with all that trembles.)
    let resists = T::ONE - half * law.omega(m.q);
    let traction = [0, 1].map(
        #[inline(always)]
        |n: usize| still[n] + half * (still[n] - resists * stress[n]),
    );
    let least = larger((traction[0] * traction[0] + traction[1] * traction[1]).sqrt(), T::TINY);
    let direction = [traction[0] / least, traction[1] / least];
    let along = direction[0] * stress[0] + direction[1] * stress[1];
    let still = direction[0] * still[0] + direction[1] * still[1];
    // As if the cell were rigid, so that P is its stress.
    let size = still + half * (still - along);
    // What of 2 P:P the wall velocity leaves alone.
    let all = m.q * m.density * T::from_f64(2.0 / 3.0);
    let rest = all * all - four * (stress[0] * stress[0] + stress[1] * stress[1]);
    // In a film the stress falls to nothing at its surface, not at the end of the cell.
    let fill = larger(m.fill, T::from_f64(LEAST_RESISTANCE));
    let v = law.wall_velocity(
        size,
        (size - along) / fill,
        // Or it might be a function of its own, which knows nothing of the processor at hand.
        #[inline(always)]
        |v| {
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
        },
    );
    // A film may slide, but is not pushed back: what its cell shears by is not that of fluid up to the cell's end.
    let v = T::where_greater(T::ONE, m.fill, larger(v, T::ZERO), v);
    [v * direction[0], v * direction[1]]
}

/// The same for a wall along which the fluid slides at the speed `slides` of the wall stress; the wall stress too. `left` is the stress P
/// that the last collision left.
///
/// Where the fluid speeds up by a, stress grows by `F = F_b + F_p - rho a`, and T lacks a sixth of what pressure drives, F_p, as in steady flow (module
/// comment): `T = tau_w + (F_b - rho a - F)/6`. `force` is `F_b - rho a`, which is what of its momentum the cell has lost since its last collision. `gains` is 1
/// where it is so told, as the wall's velocity adds to what the cell has, and 0 where it is F_b.
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
    gains: T,
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
        let still = still_along - (T::ONE - T::from_f64(1.0 / 6.0) * gains) * eased;
        let wall = still + half * (still - resisted);
        [fluidity(resisted), wall, (wall - resisted) / fill]
    };
    // Grows with v; beyond the upper end no stress drives it.
    let excess = |v: T| {
        let state = state(v);
        let sliding = slides(state[1].abs());
        // The other way, if so much has been taken off the stress that it points there.
        before + v - T::where_greater(T::ZERO, state[1], -sliding, sliding) - law.half_cell(size, state)
    };
    // A film is not pushed back, as above.
    let most = larger(T::from_f64(3.6) * larger(larger(still_along, mean_along), stress_along), size);
    let least = T::where_greater(T::ONE, m.fill, -before, -(size + before.abs()));
    let near = if so_far.is_some() { FOUND } else { GUESSED };
    let v = root(excess, [least, most], size, near);
    let wall = state(v)[1];
    [direction.map(|along| v * along), direction.map(|along| wall * along)]
}

/// Where a function that grows is zero, or the end nearer to that: from 0 on by Newton's method, with the slope over a thousandth of
/// `scale`, until a step would be less than `near` of it; and by halves where that leads astray.
///
/// Sliding has a kink where a wall or its cell yields, with slopes up to a hundred times apart on its sides. Methods that keep
/// an end on either side (regula falsi and its kin) take twenty turns and more there.
#[inline(always)]
pub(crate) fn root<T: Number>(f: impl Fn(T) -> T, [least, most]: [T; 2], scale: T, near: f64) -> T {
    let (zero, one, half) = (T::ZERO, T::ONE, T::from_f64(0.5));
    let (close, beside) = (T::from_f64(near) * scale, T::from_f64(BESIDE) * scale);
    let within = |v: T| smaller(larger(v, least), most);
    // It lies between these; the ends themselves have not been tried yet.
    let (mut low, mut high) = (least - close, most + close);
    let mut at = within(zero);
    let mut value = f(at);
    // 1 where the search goes on.
    let mut open = T::where_greater(value.abs(), zero, one, zero);
    for _ in 0..TURNS {
        if !T::any_greater(open, zero) {
            break;
        }
        let keep = |new: T, old: T| T::where_greater(open, zero, new, old);
        low = T::where_greater(zero, value, keep(at, low), low);
        high = T::where_greater(value, zero, keep(at, high), high);
        // On the side where it lies.
        let aside = T::where_greater(value, zero, -beside, beside);
        let slope = larger((f(at + aside) - value) / aside, T::from_f64(LEAST_SLOPE));
        let next = within(at - value / slope);
        let middle = within(half * (low + high));
        let next = T::where_greater(next, low, T::where_greater(high, next, next, middle), middle);
        let f_next = f(next);
        let moved = T::where_greater((next - at).abs(), zero, open, zero);
        let wide = T::where_greater(high - low, close, moved, zero);
        at = keep(next, at);
        value = keep(f_next, value);
        open = T::where_greater(value.abs(), close * slope, wide, zero);
    }
    at
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::relaxation::Bingham;

    /// The root of a function and how often it was asked for.
    fn found(f: impl Fn(f64) -> f64, ends: [f64; 2]) -> (f64, usize) {
        let asked = Cell::new(0);
        let count = |v: f64| {
            asked.set(asked.get() + 1);
            f(v)
        };
        let v = root(count, ends, 1.0, 1e-5);
        (v, asked.get())
    }

    #[test]
    fn kinks_cost_a_turn() {
        // A wall yields: slopes 26 and 1 on the two sides, in any place.
        for kink in [-0.7, -0.1, 0.02, 0.3, 1.9] {
            for shift in [-2.0, -0.1, 0.0, 1e-3, 0.5] {
                let f = |v: f64| shift + v + if v < kink { 25.0 * (v - kink) } else { 0.0 };
                let exact = if -shift < kink { (25.0 * kink - shift) / 26.0 } else { -shift };
                let (v, asked) = found(f, [-3.0, 3.0]);
                assert!((v - exact).abs() < 3e-4, "{kink} {shift}: {v}, not {exact}");
                assert!(asked <= 7, "{kink} {shift}: {asked} times");
            }
        }
    }

    #[test]
    fn roots_beyond_an_end_are_that_end() {
        assert_eq!(found(|v| v + 2.0, [-1.0, 1.0]).0, -1.0);
        assert_eq!(found(|v| v - 2.0, [-1.0, 1.0]).0, 1.0);
        assert_eq!(found(|v| v + 2.0, [0.5, 1.0]).0, 0.5);
    }

    #[test]
    fn jumps_are_found_by_halves() {
        let (v, asked) = found(|v| if v < 0.123 { v - 5.0 } else { v + 3.0 }, [-1.0, 1.0]);
        assert!((v - 0.123).abs() < 2e-5 && asked < 60, "{v} {asked}");
    }

    /// However fast the cell shears, and however it trembles across, the wall moves along its traction, by what its own equation says.
    #[test]
    fn walls_move_along_their_traction() {
        let (yield_stress, viscosity) = (1e-5, 0.02);
        let law = Bingham::<f64>::new(yield_stress, viscosity);
        for rate in [1e-4, 3e-4, 1e-3, 1e-2] {
            let tau = yield_stress + viscosity * rate;
            for tremble in [0.0, 1e-8] {
                let stress = [tau + rate / 6.0, tremble];
                let cell = Moments {
                    excess_density: 0.0,
                    density: 1.0,
                    momentum: [0.0; 3],
                    force: [0.0; 3],
                    velocity: [0.0; 3],
                    stress: [0.0, 0.0, 0.0, stress[0], stress[1], 0.0],
                    third_of_trace: 0.0,
                    q: 3.0 * stress[0].hypot(stress[1]),
                    fill: 1.0,
                    resistance: None,
                };
                let taken = 1.2 * tau;
                let [v, aside] = wall_velocity(&cell, stress, [taken, 0.0], [0.0; 2], &law);
                let left = stress[0] - v / 3.0;
                let omega = law.omega(3.0 * left);
                let wall = 1.5 * (taken - v / 3.0) - 0.5 * (1.0 - 0.5 * omega) * left;
                let lacks = law.rate(wall) - 6.0 * omega / (2.0 - omega) * wall;
                assert!(v > 0.0 && (4.0 * v - lacks).abs() < 0.01 * lacks, "{rate}: {v} {lacks}");
                assert!(aside.abs() < 1.01 * 0.5 * tremble / tau * v + 1e-20, "{rate}: {v} {aside}");
            }
        }
    }

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
