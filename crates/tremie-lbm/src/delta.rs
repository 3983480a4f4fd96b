//! The cells around a point, and how much each of them counts: the smoothed delta function of the immersed boundary method.
//!
//! Along each axis the four cells nearest to the point weigh four times the function of Peskin (2002, section 6), r being the distance in cells:
//!
//! ```text
//!     (3 - 2 r + sqrt(1 + 4 r - 4 r^2)) / 8        r < 1
//!     (5 - 2 r - sqrt(-7 + 12 r - 4 r^2)) / 8      r < 2
//! ```
//!
//! It differs from the cosine that stands for it in the thesis (Svec 2013, Eq. 2.29) by no more than 0.004, and has no moment about the point: the fluid
//! gets the moments of forces as bodies feel them. A cell weighs the product of its three weights times the share of it that is fluid, over the sum of
//! these (Eq. 2.28). Symmetry planes and periodic sides are looked through; what lies beyond other sides has no weight.

use tremie_numerics::DVec3;

use crate::real::{Real, by_axis};
use crate::topology::{Boundary, EDGE, Topology};

/// The cells around a point: along each axis the first of the four, beyond the domain's sides too, and their weights.
pub(crate) struct Around<T> {
    pub(crate) first: [i64; 3],
    pub(crate) weight: [[T; 4]; 3],
}

/// The first of the four cells around a coordinate, and how far that is beyond the middle of the second.
#[inline(always)]
pub(crate) fn first(topology: &Topology, axis: usize, at: f64) -> (i64, f64) {
    // Beyond the sides nothing is asked for but what lies within two cells. What is positive is cut off to the whole number below.
    let at = at.clamp(-2.0, topology.cells[axis] as f64 + 2.0) + 2.5;
    let below = at as i32;
    (i64::from(below) - 4, at - f64::from(below))
}

/// Weights of the four cells around a coordinate that is so far beyond the middle of the second.
#[inline(always)]
pub(crate) fn weights<T: Real>(beyond: T) -> [T; 4] {
    let half = T::from_f64(0.5);
    let (below, above) = (T::ONE + half - beyond, half + beyond);
    let root = (half * half + beyond * (T::ONE - beyond)).sqrt();
    [below - root, below + root, above + root, above - root]
}

impl<T: Real> Around<T> {
    /// Around `at`, in cells from the lower corner of the domain.
    #[inline(always)]
    pub(crate) fn new(topology: &Topology, at: DVec3) -> Self {
        let by_axis = by_axis(|a| first(topology, a, at[a]));
        Self {
            first: by_axis.map(|(first, _)| first),
            weight: by_axis.map(|(_, beyond)| weights(T::from_f64(beyond))),
        }
    }

    /// Goes through the cells wherever they lie: the place of each by the coordinates of its block, its row and its place in the row, its
    /// weight, and the mirrors it is seen in.
    #[inline(always)]
    pub(crate) fn each_cell(
        &self,
        topology: &Topology,
        mut find: impl FnMut([usize; 3]) -> usize,
        mut see: impl FnMut(usize, usize, usize, T, u8),
    ) {
        // Cells beyond the sides have no weight.
        let cell = |axis: usize, n: usize| {
            let found = beyond(topology, axis, self.first[axis] + n as i64);
            let (at, flip) = found.unwrap_or((0, false));
            let weight = if found.is_some() { self.weight[axis][n] } else { T::ZERO };
            (at / EDGE, at % EDGE, weight, u8::from(flip) << axis)
        };
        let cells = by_axis(|axis| [cell(axis, 0), cell(axis, 1), cell(axis, 2), cell(axis, 3)]);
        for (bz, z, weight, flip) in cells[2] {
            for (by, y, along, turned) in cells[1] {
                let (row, weight, flip) = (y + EDGE * z, weight * along, flip | turned);
                for (bx, x, along, turned) in cells[0] {
                    if weight * along != T::ZERO {
                        see(find([bx, by, bz]), row, x, weight * along, flip | turned);
                    }
                }
            }
        }
    }
}

/// The coordinate that a coordinate means, and whether it does so in a mirror; none beyond other sides.
pub(crate) fn beyond(topology: &Topology, axis: usize, at: i64) -> Option<(usize, bool)> {
    let cells = topology.cells[axis] as i64;
    if (0..cells).contains(&at) {
        return Some((at as usize, false));
    }
    match topology.sides[axis][usize::from(at >= cells)] {
        Boundary::Periodic => Some((at.rem_euclid(cells) as usize, false)),
        Boundary::Symmetry => {
            let mirrored = if at < 0 { -1 - at } else { 2 * cells - 1 - at };
            (0..cells).contains(&mirrored).then_some((mirrored as usize, true))
        }
        Boundary::Wall(_) | Boundary::Open => None,
    }
}

/// A vector as it is beyond mirrors.
#[inline(always)]
pub(crate) fn mirrored<T: Real>(mut vector: [T; 4], mirrors: u8) -> [T; 4] {
    if mirrors != 0 {
        for a in 0..3 {
            if mirrors >> a & 1 == 1 {
                vector[a] = -vector[a];
            }
        }
    }
    vector
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 3] = [64, 11, 24];

    #[test]
    fn weights_are_those_of_peskin_sum_to_sixty_four_and_have_no_moment() {
        let peskin = |r: f64| match r.abs() {
            r if r < 1.0 => (3.0 - 2.0 * r + (1.0 + 4.0 * r - 4.0 * r * r).sqrt()) / 2.0,
            r => (5.0 - 2.0 * r - (-7.0 + 12.0 * r - 4.0 * r * r).max(0.0).sqrt()) / 2.0,
        };
        let topology = Topology::new(SIZE, [[Boundary::Open; 2]; 3]);
        for n in 0..200 {
            let at = DVec3::new(3.1 + 0.0931 * f64::from(n), 4.5 + 0.007 * f64::from(n), 7.93);
            let around = Around::<f64>::new(&topology, at);
            let (mut sum, mut moment) = (0.0, DVec3::ZERO);
            around.each_cell(
                &topology,
                |block| topology.number(block),
                |number, row, k, weight, _| {
                    let block = [0, 1, 2].map(|a| {
                        let [x, y, _] = topology.blocks;
                        [number % x, number / x % y, number / x / y][a]
                    });
                    let cell = [k, row % EDGE, row / EDGE];
                    let centre: DVec3 = [0, 1, 2].map(|a| (EDGE * block[a] + cell[a]) as f64 + 0.5).into();
                    let off = centre - at;
                    let exact: f64 = off.to_array().map(peskin).iter().product();
                    assert!(
                        (weight - exact).abs() < 1e-12 && off.abs().max_element() <= 2.0,
                        "{at} {centre}"
                    );
                    sum += weight;
                    moment += weight * off;
                },
            );
            assert!((sum - 64.0).abs() < 1e-12 && moment.length() < 1e-12, "{sum} {moment}");
        }
    }

    #[test]
    fn sides_are_looked_through_or_not() {
        let sides = [[Boundary::Symmetry; 2], [Boundary::Periodic; 2], [Boundary::Wall([0.0; 3]); 2]];
        let topology = Topology::new([11, 11, 11], sides);
        let see = |axis: usize, at: i64| beyond(&topology, axis, at);
        assert_eq!([see(0, -1), see(0, -2), see(0, 12)], [Some((0, true)), Some((1, true)), Some((9, true))]);
        assert_eq!([see(1, -1), see(1, 12)], [Some((10, false)), Some((1, false))]);
        assert_eq!([see(2, -1), see(2, 11), see(2, 3)], [None, None, Some((3, false))]);
        let around = Around::<f64>::new(&topology, DVec3::new(0.7, 5.7, 0.7));
        let (mut cells, mut flipped) = (0, 0);
        around.each_cell(
            &topology,
            |_| 0,
            |_, _, _, _, flip| {
                cells += 1;
                flipped += usize::from(flip == 1);
            },
        );
        // Along z the cell beyond the wall is none; along x that beyond the mirror is seen in it.
        assert_eq!((cells, flipped), (4 * 4 * 3, 4 * 3));
    }
}
