//! The D3Q19 lattice: velocities, weights, opposites and mirror images (Qian et al. 1992).
//!
//! Velocities come in opposite pairs, (1, 2), (3, 4), ..., after the one at rest.

use tremie_numerics::DVec3;

/// Number of velocities.
pub(crate) const Q: usize = 19;

/// Number of pairs of opposite velocities.
pub(crate) const PAIRS: usize = (Q - 1) / 2;

/// Velocities in cells per step.
pub(crate) const C: [[i32; 3]; Q] = [
    [0, 0, 0],
    [1, 0, 0],
    [-1, 0, 0],
    [0, 1, 0],
    [0, -1, 0],
    [0, 0, 1],
    [0, 0, -1],
    [1, 1, 0],
    [-1, -1, 0],
    [1, -1, 0],
    [-1, 1, 0],
    [1, 0, 1],
    [-1, 0, -1],
    [1, 0, -1],
    [-1, 0, 1],
    [0, 1, 1],
    [0, -1, -1],
    [0, 1, -1],
    [0, -1, 1],
];

/// Weights: 1/3 at rest, 1/18 along the axes, 1/36 along the diagonals.
pub(crate) const W: [f64; Q] = {
    let mut w = [1.0 / 36.0; Q];
    w[0] = 1.0 / 3.0;
    let mut i = 1;
    while i < 7 {
        w[i] = 1.0 / 18.0;
        i += 1;
    }
    w
};

/// The velocity opposite to `i`.
pub(crate) const fn opposite(i: usize) -> usize {
    if i == 0 { 0 } else { ((i - 1) ^ 1) + 1 }
}

/// `MIRROR[flip][i]`: velocity `i` reflected along the axes whose bits (x = 1, y = 2, z = 4) are set in `flip`.
pub(crate) const MIRROR: [[u8; Q]; 8] = {
    let mut table = [[0; Q]; 8];
    let mut flip = 0;
    while flip < 8 {
        let mut i = 0;
        while i < Q {
            let x = if flip & 1 != 0 { -C[i][0] } else { C[i][0] };
            let y = if flip & 2 != 0 { -C[i][1] } else { C[i][1] };
            let z = if flip & 4 != 0 { -C[i][2] } else { C[i][2] };
            let mut j = 0;
            while j < Q {
                if C[j][0] == x && C[j][1] == y && C[j][2] == z {
                    table[flip][i] = j as u8;
                }
                j += 1;
            }
            i += 1;
        }
        flip += 1;
    }
    table
};

/// Runs a block once for each pair of opposite velocities, with the pair's number as a constant: the compiler sees
/// every velocity component and drops the terms with zero.
macro_rules! each_pair {
    ($p:ident, $body:block) => {
        each_pair!(@ $p, $body, 0 1 2 3 4 5 6 7 8)
    };
    (@ $p:ident, $body:block, $($number:literal)*) => {
        $({ const $p: usize = $number; $body })*
    };
}
pub(crate) use each_pair;

/// Runs a block once for each velocity along an axis, 1 to 6, with its number as a constant.
macro_rules! each_face {
    ($i:ident, $body:block) => {
        each_face!(@ $i, $body, 1 2 3 4 5 6)
    };
    (@ $i:ident, $body:block, $($number:literal)*) => {
        $({ const $i: usize = $number; $body })*
    };
}
pub(crate) use each_face;

/// The velocity number `i`.
pub(crate) fn vector(i: usize) -> DVec3 {
    DVec3::from(C[i].map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_isotropic_to_fourth_order() {
        let delta = |a: usize, b: usize| f64::from(u8::from(a == b));
        let moment = |axes: &[usize]| -> f64 {
            (0..Q).map(|i| W[i] * axes.iter().map(|&a| f64::from(C[i][a])).product::<f64>()).sum()
        };
        assert!((moment(&[]) - 1.0).abs() < 1e-15);
        for a in 0..3 {
            assert!(moment(&[a]).abs() < 1e-15);
            for b in 0..3 {
                assert!((moment(&[a, b]) - delta(a, b) / 3.0).abs() < 1e-15);
                for c in 0..3 {
                    assert!(moment(&[a, b, c]).abs() < 1e-15);
                    for d in 0..3 {
                        let isotropic = (delta(a, b) * delta(c, d)
                            + delta(a, c) * delta(b, d)
                            + delta(a, d) * delta(b, c))
                            / 9.0;
                        assert!((moment(&[a, b, c, d]) - isotropic).abs() < 1e-15);
                    }
                }
            }
        }
    }

    #[test]
    fn opposites_and_mirror_images() {
        for i in 0..Q {
            assert_eq!(C[opposite(i)], C[i].map(|c| -c));
            assert_eq!(usize::from(MIRROR[7][i]), opposite(i));
            assert_eq!(C[usize::from(MIRROR[1][i])], [-C[i][0], C[i][1], C[i][2]]);
        }
    }
}
