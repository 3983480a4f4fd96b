//! A distribution of directions from its orientation tensor.
//!
//! Slender fibres that were once in all directions alike, and went with the fluid ever since, have the directions of F x with the deformation F and x
//! normal: the angular central Gaussian distribution, with the density of directions (p . B p)^(-3/2)/(4 pi), B^-1 = F F^T over a number (Verleye and
//! Dupret 1993; Montgomery-Smith et al. 2011). Its orientation tensor tells all of it; so it stands here for all distributions of which only the
//! tensor is known. With the principal values l_i of B^-1, along the axes of the tensor,
//!
//! ```text
//!     <p_i p_i>         = integral over u of l_i/v_i product_j v_j^(-1/2)                       v_i = 1 + 2 u l_i, u from 0
//!     <p_i p_i p_k p_k> = integral over u of u (1 + 2 [i = k]) l_i l_k/(v_i v_k) product_j v_j^(-1/2)
//!     <|n . p|>         = 2 sqrt(2)/pi integral over s of sqrt(sum n_i^2 l_i/v_i) product_j v_j^(-1/2)           u = s^2
//! ```
//!
//! from 1/|x|^2 = integral of exp(-u |x|^2), 1/|x|^4 = integral of u exp(-u |x|^2) and 1/|x| = 2/sqrt(pi) integral of exp(-s^2 |x|^2).
//! By the trapezoidal rule in the logarithms of u and s these converge exponentially.

use std::f64::consts::{PI, SQRT_2};

use tremie_numerics::{DMat3, DVec3};

use crate::orientation::principal;

/// The logarithms between which integrals are taken, and the step: what is left out is below 1e-8 for the values that are told apart.
const FROM: f64 = -40.0;
const TO: f64 = 60.0;
const STEP: f64 = 0.25;
/// Principal values of the orientation tensor that are as good as none.
const NONE: f64 = 1e-6;
/// Iterations, and the relative error that ends them.
const TURNS: usize = 200;
const NEAR: f64 = 1e-9;
/// Power of the ratio of the principal value that is wanted to the one that is there. (Each goes with a power of its l_i between 0.4 and 1.)
const POWER: f64 = 1.4;

/// Directions of fibres, as an angular central Gaussian distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distribution {
    /// Its principal axes.
    axes: [DVec3; 3],
    /// The values l_i, up to a common factor.
    values: [f64; 3],
}

/// The integral over u from 0 of a function of u, the v_i and their product.
fn integral(values: &[f64; 3], of: impl Fn(f64, [f64; 3]) -> f64) -> f64 {
    let points = ((TO - FROM) / STEP) as u32;
    let term = |n: u32| {
        let u = (FROM + STEP * f64::from(n)).exp();
        let v = values.map(|l| 1.0 + 2.0 * u * l);
        u * of(u, v) / (v[0] * v[1] * v[2]).sqrt()
    };
    STEP * (0..=points).map(term).sum::<f64>()
}

impl Distribution {
    /// The one with an orientation tensor.
    pub fn of(tensor: &DMat3) -> Self {
        let found = principal(tensor);
        let sum: f64 = found.values.iter().map(|a| a.max(0.0)).sum();
        let wanted = found.values.map(|a| if a < NONE * sum { 0.0 } else { a / sum });
        let mut this = Self { axes: found.axes, values: wanted };
        for _ in 0..TURNS {
            let there = this.squares();
            let mut error = 0.0_f64;
            for i in (0..3).filter(|i| wanted[*i] > 0.0) {
                error = error.max((there[i] / wanted[i] - 1.0).abs());
                this.values[i] *= (wanted[i] / there[i]).powf(POWER);
            }
            let most = this.values.iter().fold(0.0_f64, |most, l| most.max(*l));
            this.values = this.values.map(|l| l / most);
            if error < NEAR {
                break;
            }
        }
        this
    }

    /// That of fibres which were in all directions alike before the deformation `f`, F_ij = dx_i/dX_j.
    pub fn deformed(f: &DMat3) -> Self {
        let found = principal(&(*f * f.transpose()));
        Self { axes: found.axes, values: found.values.map(|l| l.max(0.0) / found.values[0]) }
    }

    /// <p_i p_i> along the principal axes.
    fn squares(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| integral(&self.values, |_, v| self.values[i] / v[i]))
    }

    /// Its orientation tensor.
    pub fn tensor(&self) -> DMat3 {
        let axes = DMat3::from_cols(self.axes[0], self.axes[1], self.axes[2]);
        axes * DMat3::from_diagonal(self.squares().into()) * axes.transpose()
    }

    /// <|n . p|> for a unit vector n: the orientation factor of a plane across it (Krenchel 1975).
    pub fn orientation_factor(&self, normal: DVec3) -> f64 {
        let n = self.axes.map(|axis| axis.dot(normal).powi(2));
        let along = |v: [f64; 3]| (0..3).map(|i| n[i] * self.values[i] / v[i]).sum::<f64>().max(0.0).sqrt();
        // ds = du/(2 s).
        2.0 * SQRT_2 / PI * integral(&self.values, |u, v| along(v) / (2.0 * u.sqrt()))
    }

    /// <p_i p_j p_k p_l> D_kl for a symmetric D.
    pub fn contract(&self, d: &DMat3) -> DMat3 {
        let axes = DMat3::from_cols(self.axes[0], self.axes[1], self.axes[2]);
        let own = axes.transpose() * *d * axes;
        let four = |i: usize, k: usize| {
            let number = if i == k { 3.0 } else { 1.0 };
            let both = self.values[i] * self.values[k];
            number * integral(&self.values, |u, v| u * both / (v[i] * v[k]))
        };
        let mut found = DMat3::ZERO;
        for i in 0..3 {
            for k in 0..3 {
                let mean = four(i, k);
                if i == k {
                    found.col_mut(i)[i] += mean * own.col(i)[i];
                } else {
                    found.col_mut(i)[i] += mean * own.col(k)[k];
                    found.col_mut(k)[i] += 2.0 * mean * own.col(k)[i];
                }
            }
        }
        axes * found * axes.transpose()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_numerics::DQuat;

    use super::*;

    /// Three normal numbers (Box and Muller 1958).
    pub(crate) fn normal(random: &mut Pcg64Mcg) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| {
            let [radius, angle] = [1.0 - random.random::<f64>(), random.random::<f64>()];
            (-2.0 * radius.ln()).sqrt() * (2.0 * PI * angle).cos()
        }))
    }

    fn close(a: f64, b: f64, error: f64) {
        assert!((a - b).abs() < error, "{a} {b}");
    }

    /// 1/2 in all directions alike, 2/pi |sin| in a plane, |cos| of aligned fibres.
    #[test]
    fn orientation_factors_have_their_closed_forms() {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.2, 0.8));
        let rotated = |values: [f64; 3]| {
            let turn = DMat3::from_quat(turn);
            Distribution::of(&(turn * DMat3::from_diagonal(values.into()) * turn.transpose()))
        };
        for angle in [0.0, 0.4, 1.1, 1.5] {
            let normal = turn * DVec3::new(f64::cos(angle), 0.0, f64::sin(angle));
            close(rotated([1.0 / 3.0; 3]).orientation_factor(normal), 0.5, 1e-8);
            close(rotated([0.5, 0.5, 0.0]).orientation_factor(normal), 2.0 / PI * f64::cos(angle), 1e-6);
            close(rotated([1.0, 0.0, 0.0]).orientation_factor(normal), f64::cos(angle), 1e-6);
        }
    }

    /// The distribution that belongs to a tensor has it, and the moments of directions that are drawn from it: within four standard errors.
    #[test]
    fn moments_are_those_of_directions() {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        for wanted in [[0.6, 0.3, 0.1], [0.9, 0.06, 0.04], [0.49, 0.49, 0.02], [0.98, 0.0199, 0.0001]] {
            let distribution = Distribution::of(&DMat3::from_diagonal(wanted.into()));
            let tensor = distribution.tensor();
            for i in 0..3 {
                close(tensor.col(i)[i], wanted[i], 1e-7);
            }
            let n = DVec3::new(0.6, 0.48, 0.64);
            let count = 20_000;
            let (mut factor, mut square, mut four) = (0.0, 0.0, 0.0);
            for _ in 0..count {
                let of = normal(&mut random).to_array();
                let x: DVec3 =
                    (0..3).map(|i| distribution.axes[i] * distribution.values[i].sqrt() * of[i]).sum();
                let cosine = x.normalize().dot(n).abs();
                factor += cosine;
                square += cosine.powi(2);
                four += cosine.powi(4);
            }
            let [factor, square, four] = [factor, square, four].map(|sum| sum / f64::from(count));
            let error = 4.0 * 0.35 / f64::from(count).sqrt();
            close(distribution.orientation_factor(n), factor, error);
            close(n.dot(tensor * n), square, error);
            let outer = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            close(n.dot(distribution.contract(&outer) * n), four, error);
        }
    }

    #[test]
    fn deformed_fibres_lie_along_the_stretch() {
        let stretch = Distribution::deformed(&DMat3::from_diagonal(DVec3::new(4.0, 0.5, 0.5)));
        let tensor = stretch.tensor();
        assert!(tensor.x_axis.x > 0.8 && (tensor.y_axis.y - tensor.z_axis.z).abs() < 1e-12);
        let other = Distribution::of(&tensor);
        for i in 0..3 {
            close(other.values[i], stretch.values[i], 1e-6);
        }
    }
}
