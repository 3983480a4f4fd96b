//! Thixotropy: a yield stress that grows at rest and is broken down by shear.
//!
//! The model of Roussel (Cement and Concrete Research 36 (2006), 1797-1806, equations 5 and 6), with the structure lambda >= 0 that the cement
//! grains have built up:
//!
//! ```text
//!     stress = (1 + lambda) tau0 + mu s
//!     d lambda/dt = 1/T - alpha lambda s
//! ```
//!
//! At rest the yield stress grows by A_thix = tau0/T in a second; shear wears lambda down to 1/(T alpha s).

/// How structure comes and goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thixotropy {
    /// Time T in s in which the yield stress grows at rest by as much as it is without structure; positive.
    pub build_up_time: f64,
    /// Breakdown alpha, not negative: a shear of 1/alpha leaves 1/e of the structure.
    pub breakdown: f64,
}

impl Thixotropy {
    /// The structure a time `duration` in s after it was `structure`, at the shear rate `s` in 1/s: exactly, for a shear rate that
    /// stays as it is.
    ///
    /// ```text
    ///     lambda(t) = lambda e^-x + (t/T) (1 - e^-x)/x        x = alpha s t
    /// ```
    pub fn after(&self, structure: f64, s: f64, duration: f64) -> f64 {
        let x = self.breakdown * s * duration;
        let lost = -(-x).exp_m1();
        let share = if x > 0.0 { lost / x } else { 1.0 };
        structure - structure * lost + duration / self.build_up_time * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLUID: Thixotropy = Thixotropy { build_up_time: 250.0, breakdown: 0.005 };

    /// d lambda/dt by a thousand steps of Runge and Kutta, knowing nothing of exponentials.
    fn integrated(mut structure: f64, s: f64, duration: f64) -> f64 {
        let h = duration / 1000.0;
        let rate = |structure: f64| 1.0 / FLUID.build_up_time - FLUID.breakdown * structure * s;
        for _ in 0..1000 {
            let a = rate(structure);
            let b = rate(structure + 0.5 * h * a);
            let c = rate(structure + 0.5 * h * b);
            let d = rate(structure + h * c);
            structure += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
        structure
    }

    #[test]
    fn structure_solves_its_equation() {
        for structure in [0.0, 0.3, 5.0] {
            for s in [0.0, 1e-12, 1e-3, 1.0, 20.0] {
                for duration in [1e-4, 1.0, 600.0] {
                    let (exact, after) =
                        (integrated(structure, s, duration), FLUID.after(structure, s, duration));
                    assert!(
                        (after - exact).abs() <= 1e-10 * exact,
                        "{structure} {s} {duration}: {after} {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn it_grows_with_the_time_at_rest_and_ends_where_shear_holds_the_balance() {
        assert_eq!(FLUID.after(0.0, 0.0, 500.0), 2.0);
        let balance = 1.0 / (FLUID.build_up_time * FLUID.breakdown * 8.0);
        assert!((FLUID.after(3.0, 8.0, 1e6) / balance - 1.0).abs() < 1e-12);
        let unbroken = Thixotropy { breakdown: 0.0, ..FLUID };
        assert_eq!(unbroken.after(0.5, 10.0, 250.0), 1.5);
    }

    #[test]
    fn two_halves_are_the_whole() {
        let halves = FLUID.after(FLUID.after(1.0, 2.0, 30.0), 2.0, 30.0);
        assert!((FLUID.after(1.0, 2.0, 60.0) - halves).abs() < 1e-14);
    }
}
