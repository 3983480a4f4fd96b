//! The cells around a point, and how much each of them counts: the smoothed delta function of the immersed boundary method.
//!
//! Along each axis the four cells nearest to the point weigh `1 + cos(pi r / 2)`, r being the distance in cells (Peskin 2002; Svec 2013, Eq. 2.29); a cell
//! weighs the product of its three weights times the share of it that is fluid, over the sum of these (Eq. 2.28). Symmetry planes and periodic sides
//! are looked through; what lies beyond other sides has no weight.

use crate::real::Real;
use crate::topology::{Boundary, EDGE, Topology};

/// The four cells around a point along one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<T> {
    pub(crate) weight: [T; 4],
    /// Coordinate of their block, and theirs within it.
    pub(crate) block: [u32; 4],
    pub(crate) index: [u8; 4],
    /// Whether they are seen in a mirror.
    pub(crate) flip: [bool; 4],
    /// Whether all of them lie side by side in one block as in most places.
    pub(crate) plain: bool,
}

/// Sine and cosine of `pi x / 2` for x from 0 to 1, to 2e-8 (Taylor about the middle, by the angle sum): the same on every processor.
fn quarter(x: f64) -> [f64; 2] {
    let t = std::f64::consts::FRAC_PI_2 * (x - 0.5);
    let s = t * t;
    let sine = t * (1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0))));
    let cosine = 1.0 - s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0)));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    [half * (sine + cosine), half * (cosine - sine)]
}

/// The cells around `at`, in cells from the lower side of the domain.
pub(crate) fn line<T: Real>(topology: &Topology, axis: usize, at: f64) -> Line<T> {
    let cells = topology.cells[axis] as i64;
    // Beyond its sides nothing is asked for but what lies within two cells.
    let at = at.clamp(-2.0, cells as f64 + 2.0);
    let below = (at - 0.5).floor();
    let [sine, cosine] = quarter(at - 0.5 - below);
    let weight = [1.0 - sine, 1.0 + cosine, 1.0 + sine, 1.0 - cosine].map(T::from_f64);
    let first = below as i64 - 1;
    if first >= 0 && first + 3 < cells {
        let at = [0, 1, 2, 3].map(|k| (first + k) as usize);
        let block = at.map(|at| (at / EDGE) as u32);
        let index = at.map(|at| (at % EDGE) as u8);
        return Line { weight, block, index, flip: [false; 4], plain: block[0] == block[3] };
    }
    let mut line = Line { weight, block: [0; 4], index: [0; 4], flip: [false; 4], plain: false };
    for k in 0..4 {
        match beyond(topology, axis, first + k as i64) {
            Some((at, flip)) => {
                line.block[k] = (at / EDGE) as u32;
                line.index[k] = (at % EDGE) as u8;
                line.flip[k] = flip;
            }
            None => line.weight[k] = T::ZERO,
        }
    }
    line
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

/// The four cells around a point along each axis.
pub(crate) type Around<T> = [Line<T>; 3];

/// Goes through the cells around a point: the place of each in `around`, its row and its place in the row, its weight, and the mirrors it is
/// seen in.
#[inline(always)]
pub(crate) fn each_cell<T: Real>(
    around: &Around<T>,
    mut find: impl FnMut([u32; 3]) -> usize,
    mut see: impl FnMut(usize, usize, usize, T, u8),
) {
    let [x, y, z] = around;
    for k in 0..4 {
        for j in 0..4 {
            let weight = y.weight[j] * z.weight[k];
            if weight == T::ZERO {
                continue;
            }
            let row = usize::from(y.index[j]) + EDGE * usize::from(z.index[k]);
            let block = |i: usize| [x.block[i], y.block[j], z.block[k]];
            let flip = |line: &Line<T>, n: usize, axis: u8| u8::from(line.flip[n]) << axis;
            let mirrors = flip(y, j, 1) | flip(z, k, 2);
            if x.plain {
                let found = find(block(0));
                for i in 0..4 {
                    see(found, row, usize::from(x.index[i]), weight * x.weight[i], mirrors);
                }
                continue;
            }
            for i in 0..4 {
                if x.weight[i] != T::ZERO {
                    let mirrors = mirrors | flip(x, i, 0);
                    see(find(block(i)), row, usize::from(x.index[i]), weight * x.weight[i], mirrors);
                }
            }
        }
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

    #[test]
    fn weights_are_those_of_the_cosine_and_sum_to_four() {
        let topology = Topology::new([64, 8, 8], [[Boundary::Open; 2]; 3]);
        for n in 0..200 {
            let at = 8.0 + 0.0931 * f64::from(n);
            let line = line::<f64>(&topology, 0, at);
            for k in 0..4 {
                let cell = EDGE as f64 * f64::from(line.block[k]) + f64::from(line.index[k]) + 0.5;
                let exact = 1.0 + (std::f64::consts::FRAC_PI_2 * (cell - at)).cos();
                assert!((line.weight[k] - exact).abs() < 1e-7 && (cell - at).abs() <= 2.0, "{at} {cell}");
            }
            assert!((line.weight.iter().sum::<f64>() - 4.0).abs() < 1e-14);
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
        let line = line::<f64>(&topology, 2, 0.5);
        assert_eq!(line.weight[0], 0.0);
    }
}
