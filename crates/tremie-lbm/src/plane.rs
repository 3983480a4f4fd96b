//! Where the surface lies within an interface cell: a plane that cuts off the fluid the cell holds (PLIC).
//!
//! The plane's normal is found from the fills around (mixed Youngs-centred, Aulisa, Manservisi, Scardovelli and Zaleski
//! 2007): for each axis the sums of the fill over columns of three cells give the slopes of the surface as if it were a
//! height over that axis, and the axis over which it is least steep is taken; where the gradient of the fill smoothed over the 27
//! cells (Youngs 1982) is further from all axes, that is taken.
//!
//! With `m >= 0` the parts of the normal (sum 1) and the cube's coordinates measured from its wettest corner, the fluid is
//! `m . x < a`, and its volume is (Scardovelli and Zaleski 2000, with `p(x) = max(0, x)^3`)
//!
//! ```text
//!     6 m1 m2 m3 V = p(a) - sum p(a - mi) + sum p(a - mi - mj)       for a <= 1/2; V(1 - a) = 1 - V(a)
//! ```
//!
//! V is convex there, so Newton's method from above falls onto the root without stepping over it.
//!
//! What leaves the cell through a face in a step comes from a slab behind the face, one step's way thick, and the fluid moves
//! sideways meanwhile. Both are met to second order by the wet share of the slab's middle, the plane moved on by half a
//! step along the face: a share of an area, with squares in place of cubes.

use crate::collision::Drive;
use crate::grid::{SHARE, Shape, VELOCITY};
use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, Q, each_pair};
use crate::processor::for_this_processor;
use crate::real::{Number, Real, by_axis, larger, smaller};
use crate::rows::{Rows, SurfaceRow};
use crate::source::{Fills, Source};
use crate::together::{Driving, Pair, Populations, Pushed, Weight};

/// The 27 cells around (and with) a cell, x fastest.
type Around<N> = [N; AROUND];
/// How many these are.
const AROUND: usize = 27;

/// Number in [`Around`] of the cell at `u` along `axis`, `v` and `w` along the two axes after it (0, 1, 2 for -1, 0, 1).
const fn place(axis: usize, u: usize, v: usize, w: usize) -> usize {
    const STEP: [usize; 3] = [1, 3, 9];
    STEP[axis] * u + STEP[(axis + 1) % 3] * v + STEP[(axis + 2) % 3] * w
}

/// Least part of the normal along any axis: keeps the quotients far from rounding.
const LEAST: f64 = 0.01;
/// Turns of Newton's method: with three the volume is right within 0.004 (a test); and as many as make it right to some digits.
const TURNS: usize = 3;
const MORE_TURNS: usize = 6;
/// A slope that means that there is none.
const STEEP: f64 = 1e6;
/// A fill that means nothing.
const NONE: f64 = 1e-6;

/// 1, 0 or -1.
#[inline(always)]
fn sign<N: Number>(x: N) -> N {
    let below = N::where_greater(N::ZERO, x, -N::ONE, N::ZERO);
    N::where_greater(x, N::ZERO, N::ONE, below)
}

/// Normal out of the fluid, its parts' sizes adding up to 1; zero where nothing tells it.
#[inline(always)]
pub(crate) fn normal<N: Number>(fill: &Around<N>) -> [N; 3] {
    let all = N::from_f64;
    let (zero, half, one, two, none, steep) = (all(0.0), all(0.5), all(1.0), all(2.0), all(NONE), all(STEEP));
    let mut rise = [zero; 3];
    let mut smooth = [zero; 3];
    // slope[h][n]: along axis h + n of the surface as a height over axis h.
    let mut slope = [[zero; 3]; 3];
    for o in 0..3 {
        let difference = |v: usize, w: usize| fill[place(o, 2, v, w)] - fill[place(o, 0, v, w)];
        let middle = difference(1, 1);
        let (v, w) = (difference(0, 1) + difference(2, 1), difference(1, 0) + difference(1, 2));
        let corners = (difference(0, 0) + difference(2, 2)) + (difference(0, 2) + difference(2, 0));
        rise[o] = corners + (v + w) + middle;
        smooth[o] = corners + two * (v + w) + two * two * middle;
        slope[(o + 1) % 3][2] = half * (v + middle);
        slope[(o + 2) % 3][1] = half * (w + middle);
    }
    let mut steepness = [zero; 3];
    for h in 0..3 {
        let sum = slope[h][1].abs() + slope[h][2].abs();
        steepness[h] = N::where_greater(rise[h].abs(), none, sum, steep);
    }
    let least = smaller(smaller(steepness[0], steepness[1]), steepness[2]);
    // Equally good heights count equally, or the order of the axes would show.
    let limit = least + least * N::from_f64(1e-5) + none;
    let mut height = [zero; 3];
    for h in 0..3 {
        let weight = N::where_greater(steepness[h], limit, zero, one / (one + steepness[h]));
        height[h] += weight * sign(rise[h]);
        for n in 1..3 {
            height[(h + n) % 3] += weight * slope[h][n];
        }
    }
    let total = smooth[0].abs() + smooth[1].abs() + smooth[2].abs();
    let largest = larger(larger(smooth[0].abs(), smooth[1].abs()), smooth[2].abs());
    // In doubt the height, or rounding would decide: in the corner of a wall and a symmetry plane the two tie.
    let further = (one + least) * N::from_f64(1.0 + 1e-4) * largest;
    let mut chosen = [zero; 3];
    for a in 0..3 {
        chosen[a] = N::where_greater(total, further, smooth[a], height[a]);
        chosen[a] = N::where_greater(steep, least, chosen[a], smooth[a]);
    }
    let size = chosen[0].abs() + chosen[1].abs() + chosen[2].abs();
    let scale = N::where_greater(size, none, -one / larger(size, none), zero);
    [chosen[0] * scale, chosen[1] * scale, chosen[2] * scale]
}

/// The positive part.
#[inline(always)]
fn over<N: Number>(x: N) -> N {
    larger(x, N::ZERO)
}

/// Where the plane lies: `a` such that `m . x < a` has the volume `fill` in the unit cube.
#[inline(always)]
fn offset<N: Number>(m: [N; 3], fill: N, turns: usize) -> N {
    let all = N::from_f64;
    let (half, one, three) = (all(0.5), all(1.0), all(3.0));
    let least = smaller(fill, one - fill);
    let volume = N::from_f64(6.0) * m[0] * m[1] * m[2] * least;
    // Never below the root, for any normal.
    let mut a = smaller(N::from_f64(0.63) * over(least).sqrt().sqrt(), half);
    let pairs = [m[0] + m[1], m[0] + m[2], m[1] + m[2]];
    for _ in 0..turns {
        let mut growth = a * a;
        let mut value = growth * a;
        for n in 0..3 {
            let (less, more) = (over(a - m[n]), over(a - pairs[n]));
            let (less2, more2) = (less * less, more * more);
            growth += more2 - less2;
            value += more2 * more - less2 * less;
        }
        let step = (value - volume) / larger(three * growth, N::TINY);
        a = smaller(over(a - step), half);
    }
    N::where_greater(fill, half, one - a, a)
}

/// How far in cells the plane of a normal, which cuts off `fill`, lies from the middle of its cell, out of the fluid.
#[inline(always)]
pub(crate) fn depth<N: Number>(normal: [N; 3], fill: N) -> N {
    let m = normal.map(|n| larger(n.abs(), N::from_f64(LEAST)));
    let (sum, square) = (m[0] + m[1] + m[2], m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    let scale = N::ONE / sum;
    let within = smaller(over(fill), N::ONE);
    let middle = N::from_f64(0.5);
    (offset(m.map(|m| m * scale), within, MORE_TURNS) - middle) * sum / square.sqrt()
}

/// Wet share of the square that the plane `p x + q y < a` cuts, with `scale = 1 / (2 p q)`.
#[inline(always)]
fn area<N: Number>(p: N, q: N, scale: N, a: N) -> N {
    let square = |x: N| over(x) * over(x);
    let wet = square(a) - square(a - p) - square(a - q) + square(a - p - q);
    smaller(over(wet * scale), N::ONE)
}

/// Wet shares of the six faces, in the order of the velocities 1 to 6.
#[inline(always)]
fn shares<N: Number>(normal: [N; 3], fill: N, velocity: [N; 3]) -> [N; 6] {
    let all = N::from_f64;
    let (zero, half, one, least) = (all(0.0), all(0.5), all(1.0), all(LEAST));
    let mut m = [zero; 3];
    for a in 0..3 {
        m[a] = larger(normal[a].abs(), least);
    }
    let scale = one / (m[0] + m[1] + m[2]);
    let mut ahead = [zero; 3];
    for a in 0..3 {
        m[a] = m[a] * scale;
        ahead[a] = half * scale * normal[a] * velocity[a];
    }
    let within = smaller(over(fill), one);
    let a = offset(m, within, TURNS);
    let known = normal[0].abs() + normal[1].abs() + normal[2].abs();
    let mut shares = [zero; 6];
    for axis in 0..3 {
        let (v, w) = ((axis + 1) % 3, (axis + 2) % 3);
        let twice = one / ((m[v] + m[v]) * m[w]);
        // How far the slab's middle lies from that of the cell, towards the dry side.
        let aside = half * scale * normal[axis] * (one - smaller(velocity[axis].abs(), one));
        let moved = a + (ahead[v] + ahead[w]) - half * m[axis];
        for side in 0..2 {
            let aside = if side == 0 { aside } else { -aside };
            let share = area(m[v], m[w], twice, moved - aside);
            let share = N::where_greater(known, half, share, within);
            let share = N::where_greater(one, fill, share, one);
            shares[2 * axis + side] = N::where_greater(fill, zero, share, zero);
        }
    }
    shares
}

/// Velocity of the cells of a row in the middle of the step that left these populations, so driven.
#[inline(always)]
pub(crate) fn velocities<T: Real>(
    f: &Populations<T>,
    fill: Lanes<T>,
    drive: Drive<Lanes<T>>,
) -> [Lanes<T>; 3] {
    let load = |i: usize| f[i];
    let all = Lanes::<T>::from_f64;
    let (zero, one) = (all(0.0), all(1.0));
    let mut excess = load(0);
    let mut j = [zero; 3];
    each_pair!(P, {
        let (a, b) = (load(2 * P + 1), load(2 * P + 2));
        let c = const { C[2 * P + 1] };
        excess += a + b;
        for axis in 0..3 {
            match c[axis] {
                0 => {}
                1 => j[axis] += a - b,
                _ => j[axis] -= a - b,
            }
        }
    });
    let inverse = one / (one + excess);
    // Half of the force that the collision gave, weighed by the fill as there.
    let half = Lanes::from_f64(0.5);
    let fill = smaller(over(fill), one);
    by_axis(|a| j[a] * inverse - half * (fill * drive.gravity[a] + drive.push[a] * inverse))
}

/// The fills around the cells of a row; beyond a wall the surface goes on mirrored.
#[inline(always)]
pub(crate) fn around<T: Real>(fills: &Fills<'_, T>, row: &SurfaceRow) -> Around<Lanes<T>> {
    let mut fill = [Lanes::ZERO; AROUND];
    for (n, fill) in fill.chunks_exact_mut(3).enumerate() {
        let [y, z] = [n % 3, n / 3].map(|at| 1 - at as i32);
        for x in 0..3 {
            fill[x] = fills.pull(&row.beside, [1 - x as i32, y, z], 0);
        }
    }
    if row.any_solid == 0 {
        return fill;
    }
    for i in 1..=6 {
        let wall = row.solid[i];
        if wall == 0 {
            continue;
        }
        // Velocity i comes from the wall.
        let axis = (i - 1) / 2;
        let beyond = if C[i][axis] == 1 { 0 } else { 2 };
        for v in 0..3 {
            for w in 0..3 {
                let (there, here) = (place(axis, beyond, v, w), place(axis, 1, v, w));
                fill[there] = Lanes::choose(wall, fill[here], fill[there]);
            }
        }
    }
    fill
}

/// Wet shares of the faces of the cells of two rows, from the fills around them and their velocities.
#[inline(always)]
fn cut<T: Real>(fill: &Pair<T, AROUND>, velocity: &Pair<T, 3>, to: &mut Pair<T, 6>) {
    // One by one, of which the compiler makes one run over all sixteen.
    for k in 0..2 * LANES {
        let fill = fill.cell(k);
        to.put_cell(k, &shares(normal(&fill), fill[AROUND / 2], velocity.cell(k)));
    }
}

for_this_processor! {
    /// [`cut`] for the processor at hand.
    cut_here = cut<T: Real>(fill: &Pair<T, AROUND>, velocity: &Pair<T, 3>, to: &mut Pair<T, 6>)
}

/// Finds the surface in the interface cells of a block, and how fast it moves.
#[inline(always)]
pub(crate) fn reconstruct<T: Real>(
    source: &Source<'_, T>,
    fills: &Fills<'_, T>,
    rows: &Rows,
    gravity: [T; 3],
    shape: &mut Shape<T>,
) {
    let mut fill: Pair<T, AROUND> = bytemuck::Zeroable::zeroed();
    let mut velocity: Pair<T, 3> = bytemuck::Zeroable::zeroed();
    let mut shares: Pair<T, 6> = bytemuck::Zeroable::zeroed();
    let mut rows = rows.surface.iter().filter(|row| row.kinds.interface != 0);
    while let Some(row) = rows.next() {
        let both = [Some(row), rows.next()];
        let both = || both.iter().flatten().enumerate();
        for (n, row) in both() {
            let first = row.first();
            let f = std::array::from_fn(|i| source.own(i, first));
            let drive = match source.push(first) {
                None => Weight(gravity).row(0),
                Some(push) => Pushed::new(gravity, [push; 2]).row(0),
            };
            let moves = velocities(&f, fills.own.lanes(0, first), drive);
            for axis in 0..3 {
                shape.put(VELOCITY + axis, first, moves[axis]);
            }
            velocity.put(n, &moves);
            fill.put(n, &around(fills, row));
        }
        cut_here(&fill, &velocity, &mut shares);
        for (n, row) in both() {
            for face in 0..6 {
                shape.put(SHARE + face, row.first(), Lanes(shares.0[face][n]));
            }
        }
    }
}

const _: () = assert!(Q == 19, "the faces are those of the velocities 1 to 6");

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the unit cube (or of its slice at `x[axis] = at`) in `m . x < a`, by counting.
    fn count(m: [f64; 3], a: f64, slice: Option<(usize, f64)>) -> f64 {
        const N: usize = 60;
        let mut inside = 0usize;
        for n in 0..N.pow(3) {
            let mut x = [n % N, n / N % N, n / N / N].map(|i| (i as f64 + 0.5) / N as f64);
            if let Some((axis, at)) = slice {
                x[axis] = at;
            }
            inside += usize::from((0..3).map(|i| m[i] * x[i]).sum::<f64>() < a);
        }
        inside as f64 / N.pow(3) as f64
    }

    fn normals() -> impl Iterator<Item = [f64; 3]> {
        [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.03, 0.98], [0.1, 0.3, 1.0], [3.0, 1.0, 2.0]]
            .into_iter()
            .map(|n| {
                let sum: f64 = n.iter().sum();
                n.map(|x| x / sum)
            })
    }

    #[test]
    fn the_plane_cuts_off_the_fill() {
        for n in normals() {
            for fill in [0.002, 0.03, 0.2, 0.5, 0.7, 0.95] {
                let m = n.map(|x| x.max(LEAST));
                let m = m.map(|x| x / m.iter().sum::<f64>());
                let volume = count(m, offset(m, fill, TURNS), None);
                assert!((volume - fill).abs() < 4e-3, "{n:?}: {volume} for {fill}");
            }
        }
    }

    #[test]
    fn faces_are_wet_where_the_plane_cuts_them() {
        for n in normals() {
            for fill in [0.1, 0.4, 0.8] {
                let m = n.map(|x| x.max(LEAST));
                let m = m.map(|x| x / m.iter().sum::<f64>());
                let a = offset(m, fill, TURNS);
                let at_rest = shares(n, fill, [0.0; 3]);
                for axis in (0..3).filter(|axis| n[*axis] > 0.0) {
                    for (side, at) in [(0, 1.0), (1, 0.0)] {
                        let exact = count(m, a, Some((axis, at)));
                        let share = at_rest[2 * axis + side];
                        assert!(
                            (share - exact).abs() < 0.02,
                            "{n:?} {fill} {axis} {side}: {share}, not {exact}"
                        );
                    }
                }
            }
        }
    }

    /// Fills of the 27 cells that the plane `n . (x - middle) < d` cuts.
    fn cut(n: [f64; 3], d: f64) -> Around<f64> {
        let mut fill = [0.0; AROUND];
        for (cell, fill) in fill.iter_mut().enumerate() {
            let at = [cell % 3, cell / 3 % 3, cell / 9].map(|x| x as f64 - 1.0);
            let mut inside = 0;
            for s in 0..20usize.pow(3) {
                let x = [s % 20, s / 20 % 20, s / 400].map(|i| (i as f64 + 0.5) / 20.0 - 0.5);
                inside += usize::from((0..3).map(|i| n[i] * (at[i] + x[i])).sum::<f64>() < d);
            }
            *fill = inside as f64 / 8000.0;
        }
        fill
    }

    #[test]
    fn normals_of_planes() {
        for n in [[1.0, 0.0, 0.0], [0.2, 0.1, 0.7], [0.4, 0.2, 0.4], [0.5, 0.5, 0.0], [0.35, 0.3, 0.35]] {
            for signs in [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, -1.0]] {
                let n = [0, 1, 2].map(|a| n[a] * signs[a]);
                for d in [-0.1, 0.0, 0.2] {
                    let found = normal(&cut(n, d));
                    let off = (0..3).map(|a| (found[a] - n[a]).abs()).fold(0.0, f64::max);
                    assert!(off < 0.07, "{n:?} {d}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn no_order_of_axes() {
        let n = [0.45, 0.45, 0.1];
        let fill = cut(n, 0.1);
        let found = normal(&fill);
        assert!((found[0] - found[1]).abs() < 1e-12);
    }
}
