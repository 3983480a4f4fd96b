//! The lattices D3Q15, D3Q19 and D3Q27 (Qian, d'Humieres and Lallemand 1992), by one rule.
//!
//! A velocity has 0, 1, 2 or 3 components that are not zero; a lattice is told by the weight of each kind, and has the kinds
//! whose weight is not zero.

/// Velocities in cells a step with their weights; the velocity at rest first, then opposite ones in pairs.
#[derive(Debug, Clone)]
pub(super) struct Velocities<const Q: usize> {
    pub(super) c: [[i32; 3]; Q],
    pub(super) w: [f64; Q],
    /// `mirror[flip][i]`: velocity i mirrored along the axes whose bits (x = 1, y = 2, z = 4) are set in `flip`.
    pub(super) mirror: [[usize; Q]; 8],
}

/// Weights of velocities with 0, 1, 2 and 3 components.
pub(super) const D3Q15: [f64; 4] = [2.0 / 9.0, 1.0 / 9.0, 0.0, 1.0 / 72.0];
pub(super) const D3Q19: [f64; 4] = [1.0 / 3.0, 1.0 / 18.0, 1.0 / 36.0, 0.0];
pub(super) const D3Q27: [f64; 4] = [8.0 / 27.0, 2.0 / 27.0, 1.0 / 54.0, 1.0 / 216.0];

impl<const Q: usize> Velocities<Q> {
    /// The lattice of four weights, of which Q must be the number of velocities.
    pub(super) fn new(weights: [f64; 4]) -> Self {
        let components = |c: [i32; 3]| c.iter().filter(|c| **c != 0).count();
        let all = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
        // Of two opposite velocities the one whose last component that is not zero is positive comes first.
        let first = |c: &[i32; 3]| c.iter().rev().find(|c| **c != 0).is_some_and(|c| *c > 0);
        let mut pairs: Vec<[i32; 3]> = all.filter(|c| weights[components(*c)] > 0.0 && first(c)).collect();
        pairs.sort_by_key(|c| components(*c));
        assert_eq!(2 * pairs.len() + 1, Q, "the weights are those of another lattice");
        let mut c = [[0; 3]; Q];
        for (n, pair) in pairs.into_iter().enumerate() {
            (c[2 * n + 1], c[2 * n + 2]) = (pair, pair.map(|c| -c));
        }
        let mirrored = |i: usize, flip: usize| {
            let image: [i32; 3] =
                std::array::from_fn(|a| if flip >> a & 1 == 1 { -c[i][a] } else { c[i][a] });
            c.iter().position(|c| *c == image).unwrap_or(0)
        };
        let mirror = std::array::from_fn(|flip| std::array::from_fn(|i| mirrored(i, flip)));
        Self { c, w: c.map(|c| weights[components(c)]), mirror }
    }

    /// The velocity opposite to i.
    pub(super) fn opposite(&self, i: usize) -> usize {
        self.mirror[7][i]
    }

    /// `c . v`.
    pub(super) fn along(&self, i: usize, v: [f64; 3]) -> f64 {
        (0..3).map(|a| f64::from(self.c[i][a]) * v[a]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds<const Q: usize>(weights: [f64; 4]) {
        let lattice = Velocities::<Q>::new(weights);
        let delta = |a: usize, b: usize| f64::from(u8::from(a == b));
        let moment = |axes: &[usize]| -> f64 {
            (0..Q)
                .map(|i| lattice.w[i] * axes.iter().map(|a| f64::from(lattice.c[i][*a])).product::<f64>())
                .sum()
        };
        assert!((moment(&[]) - 1.0).abs() < 1e-15);
        for (a, b) in (0..9).map(|n| (n / 3, n % 3)) {
            assert!((moment(&[a, b]) - delta(a, b) / 3.0).abs() < 1e-15);
            assert!(moment(&[a]).abs() < 1e-15);
            for (c, d) in (0..9).map(|n| (n / 3, n % 3)) {
                assert!(moment(&[a, b, c]).abs() < 1e-15);
                let isotropic =
                    (delta(a, b) * delta(c, d) + delta(a, c) * delta(b, d) + delta(a, d) * delta(b, c)) / 9.0;
                assert!((moment(&[a, b, c, d]) - isotropic).abs() < 1e-15);
            }
        }
        for i in 1..Q {
            assert_eq!(lattice.c[lattice.opposite(i)], lattice.c[i].map(|c| -c));
            assert_eq!(lattice.opposite(i), ((i - 1) ^ 1) + 1);
        }
    }

    #[test]
    fn moments_are_isotropic_to_fourth_order() {
        holds::<15>(D3Q15);
        holds::<19>(D3Q19);
        holds::<27>(D3Q27);
    }
}
