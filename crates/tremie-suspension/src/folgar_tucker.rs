//! How fibres lie that are too many to follow: the orientation tensor as the flow turns it (Folgar and Tucker 1984; Advani and Tucker 1987).
//!
//! For a_ij = <p_i p_j>, the mean over the fibres at a place, which goes with the fluid,
//!
//! ```text
//!     Da/Dt = W a - a W + lambda (D a + a D - 2 A:D) + 2 C_I G (I - 3 a)
//! ```
//!
//! with the strain rate D and the spin W of the velocity gradient L_ij = du_i/dx_j, the shear rate G = sqrt(2 D:D), the shape factor
//! lambda = (r^2 - 1)/(r^2 + 1) of fibres that turn like spheroids of the aspect ratio r (Jeffery 1922), and the interaction coefficient C_I, by which
//! fibres that meet disturb each other. The mean of four directions A_ijkl is not known from a: a closure stands for it.
//!
//! - Hybrid (Advani and Tucker 1990): A = (1 - f) A_linear + f a a with f = 1 - 27 det a. Exact for fibres in all directions alike and for aligned
//!   ones; between, fibres align too fast.
//! - IBOF (Chung and Kwon 2002): A is the symmetric part of a polynomial in a, whose coefficients are polynomials in the invariants of a, fitted to flows
//!   whose distributions are known.
//!
//! Both are sums of S(X, Y), the part of X Y that is symmetric in all four indices, of the identity, a and a^2; and all that is needed of it is
//!
//! ```text
//!     S(X, Y):D = (X (Y:D) + Y (X:D) + 2 (X D Y + Y D X))/6
//! ```

use tremie_numerics::DMat3;

use crate::orientation::principal;

/// What stands for the mean of four directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Closure {
    /// Advani and Tucker (1990).
    Hybrid,
    /// Invariant-based optimal fitting, Chung and Kwon (2002).
    #[default]
    Ibof,
}

/// Strain in one step of the integration, at most. (The error of a step of fourth order is some 1e-5 then.)
const STRAIN: f64 = 0.25;

/// Coefficients of the polynomials for beta_3, beta_4 and beta_6 (Chung and Kwon 2002, Table I), in the order of [`powers`].
const IBOF: [[f64; 3]; 21] = [
    [0.249_409_081_657_86e2, -0.497_217_790_110_754, 0.234_146_291_570_999e2],
    [-0.435_101_153_160_329e3, 0.234_980_797_511_405e2, -0.412_048_043_372_534e3],
    [0.372_389_335_663_877e4, -0.391_044_251_397_838e3, 0.319_553_200_392_089e4],
    [0.703_443_657_916_476e4, 0.153_965_820_593_506e3, 0.573_259_594_331_015e4],
    [0.823_995_187_366_106e6, 0.152_772_950_743_819e6, -0.485_212_803_064_813e5],
    [-0.133_931_929_894_245e6, -0.213_755_248_785_646e4, -0.605_006_113_515_592e5],
    [0.880_683_515_327_916e6, -0.400_138_947_092_812e4, -0.477_173_740_017_567e5],
    [-0.991_630_690_741_981e7, -0.185_949_305_922_308e7, 0.599_066_486_689_836e7],
    [-0.159_392_396_237_307e5, 0.296_004_865_275_814e4, -0.110_656_935_176_569e5],
    [0.800_970_026_849_796e7, 0.247_717_810_054_366e7, -0.460_543_580_680_696e8],
    [-0.237_010_458_689_252e7, 0.101_013_983_339_062e6, 0.203_042_960_322_874e7],
    [0.379_010_599_355_267e8, 0.732_341_494_213_578e7, -0.556_606_156_734_835e8],
    [-0.337_010_820_273_821e8, -0.147_919_027_644_202e8, 0.567_424_911_007_837e9],
    [0.322_219_416_256_417e5, -0.104_092_072_189_767e5, 0.128_967_058_686_204e5],
    [-0.257_258_805_870_567e9, -0.635_149_929_624_336e8, -0.152_752_854_956_514e10],
    [0.214_419_090_344_474e7, -0.247_435_106_210_237e6, -0.499_321_746_092_534e7],
    [-0.449_275_591_851_49e8, -0.902_980_378_929_272e7, 0.132_124_828_143_333e9],
    [-0.213_133_920_223_355e8, 0.724_969_796_807_399e7, -0.162_359_994_620_983e10],
    [0.157_076_702_372_204e10, 0.487_093_452_892_595e9, 0.792_526_849_882_218e10],
    [-0.232_153_488_525_298e5, 0.138_088_690_964_946e5, 0.466_767_581_292_985e4],
    [-0.395_769_398_304_473e10, -0.160_162_178_614_234e10, -0.128_050_778_279_459e11],
];

/// The products of the second and the third invariant that coefficients belong to.
fn powers(two: f64, three: f64) -> [f64; 21] {
    let [two2, three2] = [two * two, three * three];
    let [two3, three3] = [two2 * two, three2 * three];
    let [two4, three4] = [two2 * two2, three2 * three2];
    [
        1.0,
        two,
        two2,
        three,
        three2,
        two * three,
        two2 * three,
        two * three2,
        two3,
        three3,
        two3 * three,
        two2 * three2,
        two * three3,
        two4,
        three4,
        two4 * three,
        two3 * three2,
        two2 * three3,
        two * three4,
        two4 * two,
        three4 * three,
    ]
}

/// X:Y of symmetric tensors.
fn double(x: &DMat3, y: &DMat3) -> f64 {
    x.x_axis.dot(y.x_axis) + x.y_axis.dot(y.y_axis) + x.z_axis.dot(y.z_axis)
}

/// X + X^T.
fn both(x: &DMat3) -> DMat3 {
    *x + x.transpose()
}

/// S(X, Y):D.
fn symmetric(x: &DMat3, y: &DMat3, d: &DMat3) -> DMat3 {
    (*x * double(y, d) + *y * double(x, d) + both(&(*x * *d * *y)) * 2.0) * 6.0_f64.recip()
}

impl Closure {
    /// A:D for an orientation tensor `a` and a symmetric D.
    pub fn contract(self, a: &DMat3, d: &DMat3) -> DMat3 {
        let one = DMat3::IDENTITY;
        match self {
            Self::Hybrid => {
                let isotropic = 27.0 * a.determinant();
                let linear = symmetric(&one, a, d) * (6.0 / 7.0) + symmetric(&one, &one, d) * (-3.0 / 35.0);
                linear * isotropic + *a * (double(a, d) * (1.0 - isotropic))
            }
            Self::Ibof => {
                let square = *a * *a;
                let trace = a.x_axis.x + a.y_axis.y + a.z_axis.z;
                let two = 0.5 * (trace * trace - (square.x_axis.x + square.y_axis.y + square.z_axis.z));
                let three = a.determinant();
                let [mut beta3, mut beta4, mut beta6] = [0.0; 3];
                for (power, [three, four, six]) in powers(two, three).into_iter().zip(IBOF) {
                    beta3 += three * power;
                    beta4 += four * power;
                    beta6 += six * power;
                }
                // The others follow from A_ijkk = a_ij.
                let beta1 = 0.6
                    * (-1.0 / 7.0 + beta3 / 5.0 * (1.0 / 7.0 + 4.0 / 7.0 * two + 8.0 / 3.0 * three)
                        - beta4 * (0.2 - 8.0 / 15.0 * two - 14.0 / 15.0 * three)
                        - beta6
                            * (1.0 / 35.0 - 8.0 / 35.0 * three - 4.0 / 35.0 * two
                                + 16.0 / 15.0 * two * three
                                + 8.0 / 35.0 * two * two));
                let beta2 = 6.0 / 7.0
                    * (1.0 - beta3 / 5.0 * (1.0 + 4.0 * two) + 1.4 * beta4 * (1.0 / 6.0 - two)
                        - beta6 * (-0.2 + 2.0 / 3.0 * three + 0.8 * two - 1.6 * two * two));
                let beta5 = -0.8 * beta3 - 1.4 * beta4 - 1.2 * beta6 * (1.0 - 4.0 / 3.0 * two);
                symmetric(&one, &one, d) * beta1
                    + symmetric(&one, a, d) * beta2
                    + symmetric(a, a, d) * beta3
                    + symmetric(&one, &square, d) * beta4
                    + symmetric(a, &square, d) * beta5
                    + symmetric(&square, &square, d) * beta6
            }
        }
    }
}

/// How the flow turns fibres that are too many to follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FolgarTucker {
    /// Shape factor lambda.
    pub shape: f64,
    /// Interaction coefficient C_I.
    pub interaction: f64,
    /// What stands for the mean of four directions.
    pub closure: Closure,
}

/// Shape factor of a cylinder: that of the spheroid which turns as fast, of the aspect ratio 1.24 r/sqrt(ln r) (Cox 1971).
pub fn shape_factor(length: f64, diameter: f64) -> f64 {
    let ratio = (length / diameter).max(1.0);
    // The formula is for slender bodies; others turn as spheroids of their own aspect ratio.
    let slender = 1.24 * ratio / ratio.ln().max(1.0).sqrt();
    let square = slender.min(ratio).powi(2);
    (square - 1.0) / (square + 1.0)
}

/// Interaction coefficient of fibres of a share of the volume and an aspect ratio: C_I = 0.03 (1 - exp(-0.224 share ratio)) (Phan-Thien et al. 2002).
pub fn interaction_coefficient(share: f64, ratio: f64) -> f64 {
    0.03 * (1.0 - (-0.224 * share * ratio).exp())
}

/// The nearest tensor that can be one of orientation: symmetric, of trace 1, with no negative principal value.
pub fn admissible(a: &DMat3) -> DMat3 {
    let trace = a.x_axis.x + a.y_axis.y + a.z_axis.z;
    let a = both(a) * (0.5 / trace);
    let [minor, next] = [
        a.x_axis.x * a.y_axis.y - a.x_axis.y * a.x_axis.y,
        a.y_axis.y * a.z_axis.z - a.y_axis.z * a.y_axis.z,
    ];
    let last = a.x_axis.x * a.z_axis.z - a.x_axis.z * a.x_axis.z;
    let diagonal = a.x_axis.x.min(a.y_axis.y).min(a.z_axis.z);
    if diagonal >= 0.0 && minor.min(next).min(last) >= 0.0 && a.determinant() >= 0.0 {
        return a;
    }
    let found = principal(&a);
    let values = found.values.map(|value| value.max(0.0));
    let sum: f64 = values.iter().sum();
    let axes = DMat3::from_cols(found.axes[0], found.axes[1], found.axes[2]);
    axes * DMat3::from_diagonal((values.map(|value| value / sum)).into()) * axes.transpose()
}

impl FolgarTucker {
    /// Da/Dt for a velocity gradient du_i/dx_j in 1/s.
    pub fn rate(&self, a: &DMat3, gradient: &DMat3) -> DMat3 {
        let (d, w) = ((*gradient + gradient.transpose()) * 0.5, (*gradient - gradient.transpose()) * 0.5);
        // D a + a D and W a - a W of symmetric D and a and antisymmetric W.
        let turned = both(&((w + d * self.shape) * *a));
        let shear_rate = (2.0 * double(&d, &d)).sqrt();
        turned - self.closure.contract(a, &d) * (2.0 * self.shape)
            + (DMat3::IDENTITY - *a * 3.0) * (2.0 * self.interaction * shear_rate)
    }

    /// The tensor after a time in s in a velocity gradient in 1/s.
    pub fn after(&self, a: &DMat3, gradient: &DMat3, duration: f64) -> DMat3 {
        // Interaction makes the equation stiff.
        let strain = double(gradient, gradient).sqrt() * duration * (1.0 + 6.0 * self.interaction);
        if strain == 0.0 {
            return *a;
        }
        let steps = (strain / STRAIN).ceil();
        let h = duration / steps;
        let mut a = *a;
        for _ in 0..steps as u64 {
            let one = self.rate(&a, gradient);
            let two = self.rate(&(a + one * (0.5 * h)), gradient);
            let three = self.rate(&(a + two * (0.5 * h)), gradient);
            let four = self.rate(&(a + three * h), gradient);
            a = admissible(&(a + (one + (two + three) * 2.0 + four) * (h / 6.0)));
        }
        a
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tremie_numerics::{DQuat, DVec3};

    use super::*;
    use crate::distribution::Distribution;

    const BOTH: [Closure; 2] = [Closure::Hybrid, Closure::Ibof];

    /// du_x/dz = 1.
    fn shear() -> DMat3 {
        DMat3::from_cols(DVec3::ZERO, DVec3::ZERO, DVec3::X)
    }

    fn distance(a: &DMat3, b: &DMat3) -> f64 {
        (*a - *b).to_cols_array().into_iter().fold(0.0, |most, x| most.max(x.abs()))
    }

    /// Any tensor of orientation.
    fn any(random: &mut Pcg64Mcg) -> DMat3 {
        let part = |random: &mut Pcg64Mcg| random.random::<f64>();
        let values = DVec3::new(part(random), part(random), part(random));
        let turn =
            DMat3::from_quat(DQuat::from_scaled_axis(3.0 * DVec3::new(part(random), part(random), 1.0)));
        turn * DMat3::from_diagonal(values / values.element_sum()) * turn.transpose()
    }

    /// A:I = a, whatever a is; and A is that of fibres in all directions alike, or aligned.
    #[test]
    fn closures_keep_what_is_known() {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        for closure in BOTH {
            for _ in 0..20 {
                let a = any(&mut random);
                let found = closure.contract(&a, &DMat3::IDENTITY);
                // The linear part of the hybrid closure is exact in this, the quadratic too.
                assert!(distance(&found, &a) < 1e-9, "{closure:?} {found:?} {a:?}");
            }
            let d = DMat3::from_cols_array(&[1.0, 0.3, -0.2, 0.3, -0.4, 0.5, -0.2, 0.5, -0.6]);
            // <p_i p_j p_k p_l> D_kl = 2 D/15 in all directions alike.
            let isotropic = closure.contract(&(DMat3::IDENTITY * 3.0_f64.recip()), &d);
            assert!(distance(&isotropic, &(d * (2.0 / 15.0))) < 2e-4, "{closure:?} {isotropic:?}");
            let aligned = DMat3::from_diagonal(DVec3::X);
            assert!(distance(&closure.contract(&aligned, &d), &aligned) < 5e-3, "{closure:?}");
        }
    }

    /// IBOF is near to the closure that is exact for fibres that were once in all directions alike (module `distribution`).
    #[test]
    fn ibof_is_near_the_natural_closure() {
        let mut random = Pcg64Mcg::seed_from_u64(2);
        let d = DMat3::from_cols_array(&[1.0, 0.3, -0.2, 0.3, -0.4, 0.5, -0.2, 0.5, -0.6]);
        let (mut ibof, mut hybrid) = (0.0_f64, 0.0_f64);
        for _ in 0..50 {
            let a = any(&mut random);
            let exact = Distribution::of(&a).contract(&d);
            ibof = ibof.max(distance(&Closure::Ibof.contract(&a, &d), &exact));
            hybrid = hybrid.max(distance(&Closure::Hybrid.contract(&a, &d), &exact));
        }
        assert!(ibof < 0.02 && ibof < 0.5 * hybrid, "{ibof} {hybrid}");
    }

    /// Without strain the tensor turns as a rigid body.
    #[test]
    fn rotation_turns_it() {
        let spin = DVec3::new(0.3, -0.7, 0.5);
        let gradient = DMat3::from_cols(spin.cross(DVec3::X), spin.cross(DVec3::Y), spin.cross(DVec3::Z));
        let a = DMat3::from_diagonal(DVec3::new(0.7, 0.2, 0.1));
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(2.0 * spin));
        for closure in BOTH {
            let law = FolgarTucker { shape: 0.9, interaction: 0.01, closure };
            let found = law.after(&a, &gradient, 2.0);
            assert!(distance(&found, &(turn * a * turn.transpose())) < 1e-4, "{found:?}");
        }
    }

    /// Slender fibres that do not meet go with lines of the fluid: those that were in all directions alike have the distribution of directions of
    /// F x, F being the deformation and x normal, whatever the flow. Tolerance: 0.05 in each component, as for the field against fibres.
    #[test]
    fn slender_fibres_go_with_the_fluid() {
        let stretch = DMat3::from_diagonal(DVec3::new(1.0, -0.2, -0.8));
        for gradient in [shear(), stretch, shear() * 0.7 + stretch.transpose() * 0.3] {
            let law = FolgarTucker { shape: 1.0, interaction: 0.0, closure: Closure::Ibof };
            let (steps, mut a, mut f) = (3000, DMat3::IDENTITY * 3.0_f64.recip(), DMat3::IDENTITY);
            for step in 0..steps {
                if step % 500 == 0 {
                    let exact = Distribution::deformed(&f).tensor();
                    assert!(distance(&a, &exact) < 0.05, "{step} {a:?} {exact:?}");
                }
                let h = 4.0 / f64::from(steps);
                a = law.after(&a, &gradient, h);
                let middle = f + gradient * f * (0.5 * h);
                f += gradient * middle * h;
            }
        }
    }

    /// Where fibres disturb each other much, they lie in nearly all directions alike, for which closures are exact: from `Da/Dt = 0` to first order
    /// in 1/C_I, a_xz = lambda/(30 C_I) in simple shear.
    #[test]
    fn interaction_is_a_diffusion_of_directions() {
        for closure in BOTH {
            for interaction in [2.0, 10.0] {
                let law = FolgarTucker { shape: 0.9, interaction, closure };
                let a = law.after(&DMat3::from_diagonal(DVec3::Y), &shear(), 5.0);
                assert_relative_eq!(a.z_axis.x, 0.03 / interaction, max_relative = 0.01);
                assert!(distance(&a, &(DMat3::IDENTITY * 3.0_f64.recip())) < 0.05 / interaction, "{a:?}");
            }
        }
    }

    /// The result does not depend on the axes.
    #[test]
    fn axes_do_not_matter() {
        let mut random = Pcg64Mcg::seed_from_u64(4);
        let (a, turn) =
            (any(&mut random), DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, 1.0, -0.8))));
        for closure in BOTH {
            let law = FolgarTucker { shape: 0.98, interaction: 0.005, closure };
            let one = law.after(&a, &shear(), 2.0);
            let other = law.after(&(turn * a * turn.transpose()), &(turn * shear() * turn.transpose()), 2.0);
            assert!(distance(&(turn * one * turn.transpose()), &other) < 1e-9);
        }
    }

    #[test]
    fn tensors_are_made_admissible() {
        let good = DMat3::from_diagonal(DVec3::new(0.5, 0.5, 0.0));
        assert_eq!(admissible(&good), good);
        let found = admissible(&DMat3::from_cols_array(&[0.9, 0.4, 0.0, 0.4, 0.1, 0.0, 0.0, 0.0, 0.0]));
        let values = principal(&found).values;
        assert!(values[2] >= -1e-15 && values[1].abs() < 1e-12);
        assert_relative_eq!(values.iter().sum::<f64>(), 1.0, max_relative = 1e-12);
    }

    /// Aspect ratio 10: Cox's formula gives 8.17; a sphere has none.
    #[test]
    fn shape_factors_and_coefficients_have_their_values() {
        let ratio = 1.24 * 10.0 / 10.0_f64.ln().sqrt();
        assert_relative_eq!(shape_factor(0.05, 0.005), (ratio * ratio - 1.0) / (ratio * ratio + 1.0));
        assert_eq!(shape_factor(0.01, 0.01), 0.0);
        // The slab of the thesis: 0.5 % of fibres 60 mm long and 0.75 mm thick.
        assert_relative_eq!(interaction_coefficient(0.005, 80.0), 2.570e-3, max_relative = 1e-3);
    }
}
