//! The matrix in tension: elastic to its strength, then bilinear softening (Hillerborg, Modeer and Petersson 1976; Wittmann et al. 1988).
//!
//! sigma(w) falls from the strength to the kink and on to nothing. A spring of length h holds the crack and the material of the
//! two half cells: its jump is D = w + sigma h / E (Bazant and Oh 1983), so that stress over jump is four points joined by straight lines.
//! Unloading goes straight to the origin.

/// Share of its stiffness that a spring keeps when nothing else holds it, so that halves of a beam do not float.
const REMAINDER: f64 = 1e-8;

/// Tensile strength and softening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    /// Tensile strength in Pa.
    pub strength: f64,
    /// Stress at the kink in Pa.
    pub kink_stress: f64,
    /// Crack opening at the kink in m.
    pub kink_opening: f64,
    /// Opening in m from which on the crack bears nothing.
    pub last_opening: f64,
}

impl Softening {
    /// Work in J/m2 to open a crack.
    pub fn energy(&self) -> f64 {
        0.5 * (self.strength * self.kink_opening + self.kink_stress * self.last_opening)
    }

    /// Longest spring in m whose jump grows all the time while its stress falls; longer ones would snap back.
    pub fn longest(&self, modulus: f64) -> f64 {
        let steepest = f64::max(
            (self.strength - self.kink_stress) / self.kink_opening,
            self.kink_stress / (self.last_opening - self.kink_opening),
        );
        modulus / steepest
    }

    /// The law of a spring of the given length in m, for a modulus of elasticity in Pa.
    pub fn spring(&self, length: f64, modulus: f64) -> Law {
        let give = length / modulus;
        Law {
            points: [
                [0.0, 0.0],
                [self.strength * give, self.strength],
                [self.kink_opening + self.kink_stress * give, self.kink_stress],
                [self.last_opening, 0.0],
            ],
        }
    }
}

/// Stress over jump: points joined by straight lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    points: [[f64; 2]; 4],
}

impl Law {
    /// Stress in Pa at a jump in m that grows for the first time.
    pub fn stress(&self, jump: f64) -> f64 {
        let part = self.points.windows(2).find(|part| jump < part[1][0]);
        part.map_or(0.0, |part| between(part[0], part[1], jump))
    }

    /// Jump in m at which the crack begins.
    pub fn first_jump(&self) -> f64 {
        self.points[1][0]
    }

    /// Stress over jump in Pa/m, intact.
    pub fn elastic(&self) -> f64 {
        self.points[1][1] / self.points[1][0]
    }

    /// Stress over jump in Pa/m where the largest jump so far is `most`; in compression the crack closes.
    pub fn secant(&self, jump: f64, most: f64) -> f64 {
        if jump <= 0.0 || most <= self.first_jump() {
            self.elastic()
        } else {
            (self.stress(most) / most).max(REMAINDER * self.elastic())
        }
    }

    /// Work in J/m2 that is lost for good when the largest jump was `most`.
    pub fn lost(&self, most: f64) -> f64 {
        let mut work = 0.0;
        for part in self.points.windows(2) {
            let end = most.min(part[1][0]);
            if end > part[0][0] {
                work += 0.5 * (part[0][1] + between(part[0], part[1], end)) * (end - part[0][0]);
            }
        }
        work - 0.5 * self.stress(most) * most
    }
}

fn between([x0, y0]: [f64; 2], [x1, y1]: [f64; 2], x: f64) -> f64 {
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

#[cfg(test)]
pub(crate) const THESIS: Softening =
    Softening { strength: 2e6, kink_stress: 0.5e6, kink_opening: 0.05e-3, last_opening: 0.3e-3 };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_is_the_fracture_energy() {
        assert!((THESIS.energy() - 125.0).abs() < 1e-9);
        for length in [0.005, 0.02, 0.1] {
            let law = THESIS.spring(length, 30e9);
            assert!((law.lost(1e-3) - 125.0).abs() < 1e-9);
            let (steps, end) = (200_000, 0.35e-3);
            let step = end / f64::from(steps);
            let area: f64 = (0..steps).map(|k| law.stress((f64::from(k) + 0.5) * step) * step).sum();
            assert!((area - 125.0).abs() < 1e-3, "{length}: {area}");
        }
    }

    #[test]
    fn the_stress_belongs_to_the_opening_within_the_jump() {
        let law = THESIS.spring(0.01, 30e9);
        for (jump, slope) in [(0.02e-3, 30e9), (0.1e-3, 2e9)] {
            let stress = law.stress(jump);
            let opening = jump - stress * 0.01 / 30e9;
            let exact = if slope > 10e9 { 2e6 - slope * opening } else { slope * (0.3e-3 - opening) };
            assert!((stress - exact).abs() < 1e-3, "{jump}: {stress} {exact}");
        }
        assert!((THESIS.longest(30e9) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn unloading_goes_to_the_origin_and_cracks_close() {
        let law = THESIS.spring(0.01, 30e9);
        let most = 0.04e-3;
        let secant = law.secant(0.01e-3, most);
        assert!((secant * most - law.stress(most)).abs() < 1e-6);
        assert_eq!(law.secant(-1e-6, most), law.elastic());
        assert_eq!(law.secant(0.5e-6, 0.5e-6), law.elastic());
        assert!(law.secant(1e-3, 1e-3) * 1e-3 < 1e-4 * 2e6);
    }
}
