//! A fibre across a crack: it debonds, and is pulled out against a uniform friction.
//!
//! Both sides debond at first, with equal slips: P = (pi/2) sqrt(E_f d^3 tau w), up to w_d = 4 tau l^2 / (E_f d), when the
//! shorter side l is loose and P_0 = pi d tau l. From there on it slides out, the longer side holds, and
//! P = P_0 (1 - s/l)(1 + beta s/d) with s = w - w_d (Li, Stang and Krenchel 1993; Lin, Kanda and Li 1999). A fibre that lies at an angle theta to the crack's
//! normal bears exp(f theta) cos(theta)^b as much: snubbing where it bends around the edge of the crack (Li, Wang and Backer 1990), and spalling of that edge
//! (in the form of Lee, Kang and Kim 2010). It breaks for good at f_u A_f exp(-k theta). Unloading goes straight to the origin.

use std::f64::consts::PI;

use tremie_numerics::root::turning_point;

/// What fibres are made of, and how they hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// Modulus of elasticity of the fibre in Pa.
    pub modulus: f64,
    /// Tensile strength of the fibre in Pa.
    pub strength: f64,
    /// Friction tau in Pa, with what hooks add to it.
    pub friction: f64,
    /// Slip hardening beta; weakening if negative.
    pub hardening: f64,
    /// Snubbing coefficient f.
    pub snubbing: f64,
    /// Exponent b of spalling.
    pub spalling: f64,
    /// How much weaker fibres are that lie at an angle: k.
    pub bending: f64,
}

/// The force of one fibre over the opening of the crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PullOut {
    modulus: f64,
    friction: f64,
    hardening: f64,
    diameter: f64,
    /// Length in m on the shorter side.
    length: f64,
    /// What the angle makes of the force.
    factor: f64,
    /// Opening in m at which the fibre breaks; infinite if it does not.
    rupture: f64,
}

impl PullOut {
    /// A fibre of a diameter in m, embedded by `length` in m on its shorter side, at an angle in rad to the crack's normal.
    pub fn new(bond: &Bond, diameter: f64, length: f64, angle: f64) -> Self {
        let factor = (bond.snubbing * angle).exp() * angle.cos().max(0.0).powf(bond.spalling);
        let Bond { modulus, friction, hardening, .. } = *bond;
        let mut law = Self { modulus, friction, hardening, diameter, length, factor, rupture: f64::INFINITY };
        let limit = bond.strength * PI / 4.0 * diameter * diameter * (-bond.bending * angle).exp();
        let peak = law.peak();
        if law.force(peak) > limit {
            law.rupture = turning_point(peak, |w| law.force(w) < limit);
        }
        law
    }

    /// Opening in m at which the shorter side is loose.
    pub fn loose(&self) -> f64 {
        4.0 * self.friction * self.length * self.length / (self.modulus * self.diameter)
    }

    /// Opening in m of the largest force, if the fibre does not break.
    fn peak(&self) -> f64 {
        // The maximum of (1 - s/l)(1 + beta s/d), or its start.
        let slip =
            if self.hardening > 0.0 { 0.5 * (self.length - self.diameter / self.hardening) } else { 0.0 };
        self.loose() + slip.max(0.0)
    }

    /// Whether it breaks before it is pulled out.
    pub fn breaks(&self) -> bool {
        self.rupture.is_finite()
    }

    /// Force in N when the shorter side has just come loose, unless it breaks before.
    pub fn loose_force(&self) -> f64 {
        self.factor * PI * self.diameter * self.friction * self.length
    }

    /// Force in N at an opening in m that grows for the first time.
    pub fn force(&self, opening: f64) -> f64 {
        let (loose, slip) = (self.loose(), opening - self.loose());
        if opening <= 0.0 || opening >= self.rupture || slip >= self.length {
            0.0
        } else if opening < loose {
            self.loose_force() * (opening / loose).sqrt()
        } else {
            let grown = 1.0 + self.hardening * slip / self.diameter;
            (self.loose_force() * (1.0 - slip / self.length) * grown).max(0.0)
        }
    }

    /// Work in J up to an opening in m.
    pub fn work(&self, opening: f64) -> f64 {
        let (loose, force) = (self.loose(), self.loose_force());
        let end = opening.min(self.rupture).max(0.0);
        let debonding = 2.0 / 3.0 * force * loose * (end / loose).min(1.0).powf(1.5);
        // With a weakening that is stronger than the loss of length the force ends earlier.
        let last =
            if self.hardening < 0.0 { self.length.min(-self.diameter / self.hardening) } else { self.length };
        let slip = (end - loose).clamp(0.0, last);
        let growth = self.hardening / self.diameter;
        let sliding = slip + 0.5 * (growth - 1.0 / self.length) * slip.powi(2)
            - growth / (3.0 * self.length) * slip.powi(3);
        debonding + force * sliding
    }
}

#[cfg(test)]
pub(crate) const THESIS: Bond = Bond {
    modulus: 200e9,
    strength: 1050e6,
    friction: 4e6,
    hardening: 0.0,
    snubbing: 0.5,
    spalling: 1.4,
    bending: 0.0,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fibre_across_the_crack_is_pulled_out_as_on_paper() {
        for (length, force, loose, work) in
            [(0.01, 94.2, 0.0107, 471.9), (0.02, 188.5, 0.0427, 1890.3), (0.03, 282.7, 0.096, 4259.2)]
        {
            let law = PullOut::new(&THESIS, 0.75e-3, length, 0.0);
            assert!((law.loose_force() - force).abs() < 0.06);
            assert!((1e3 * law.loose() - loose).abs() < 6e-5);
            assert!((1e3 * law.work(1.0) - work).abs() < 0.06, "{}", law.work(1.0));
            assert!(!law.breaks());
            // No jump where the side comes loose.
            let [before, after] = [1.0 - 1e-12, 1.0 + 1e-12].map(|x| law.force(x * law.loose()));
            assert!((before - after).abs() < 1e-6 * after);
        }
    }

    #[test]
    fn the_work_is_the_integral_of_the_force() {
        for hardening in [-0.05, 0.0, 0.05] {
            let bond = Bond { hardening, strength: 1e12, ..THESIS };
            let law = PullOut::new(&bond, 0.75e-3, 0.02, 0.6);
            for end in [0.03e-3, 1e-3, 0.025] {
                let steps = 100_000;
                let step = end / f64::from(steps);
                let area: f64 = (0..steps).map(|k| law.force((f64::from(k) + 0.5) * step) * step).sum();
                assert!((area / law.work(end) - 1.0).abs() < 1e-4, "{hardening} {end}");
            }
        }
    }

    #[test]
    fn angles_snub_and_spall_and_too_strong_a_grip_breaks() {
        let at = |angle: f64| PullOut::new(&THESIS, 0.75e-3, 0.02, angle).loose_force();
        let ratio = (0.5_f64 * 0.8).exp() * 0.8_f64.cos().powf(1.4);
        assert!((at(0.8) / at(0.0) - ratio).abs() < 1e-12);
        assert_eq!(at(std::f64::consts::FRAC_PI_2 + 1e-3), 0.0);
        let strong = PullOut::new(&Bond { friction: 12e6, ..THESIS }, 0.75e-3, 0.03, 0.0);
        assert!(strong.breaks());
        let limit = 1050e6 * PI / 4.0 * 0.75e-3 * 0.75e-3;
        assert!((strong.force(strong.rupture * (1.0 - 1e-9)) / limit - 1.0).abs() < 1e-6);
        assert_eq!(strong.force(strong.rupture), 0.0);
        assert!((strong.work(1.0) - strong.work(strong.rupture)).abs() < 1e-15);
    }
}
