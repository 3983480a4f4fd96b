//! Drag of a grid of parallel round bars on a fluid that creeps through it: what a cage of bars too thin to be resolved does.
//!
//! Bars of diameter d stand on a square grid of the spacing s; u is the superficial velocity, the flow rate over the whole area, bars included. The
//! force on a metre of bar is that by which the pressure falls over the grid, F = s^2 grad p. It is known at both ends of the range of
//! speeds, across the bars and along them:
//!
//! ```text
//!     Newtonian fluid            F = L mu u
//!     yield stress, u -> 0       F = N tau0 d                                  the limit load
//!     Bingham fluid, u large     F = L mu u + M tau0 d,    M d u = integral of the Newtonian flow's shear rate over the area of a bar
//! ```
//!
//! The last is the first order of a regular perturbation (the dissipation is stationary in the velocity), and M >= N by the upper-bound
//! theorem. In between
//!
//! ```text
//!     F = N d (stress(L u / (N d)) + (M/N - 1) tau0 B(c y)),       y = stress/tau0 - 1,
//!     B(y) = 1 - x^2,   1/x + x^2/2 = y + 3/2
//! ```
//!
//! where B is the way from the one to the other in a Bingham fluid's flow between plates, of which this is the exact law for M/N = 3/2 and c = 1
//! (Buckingham 1921). For other flow curves `stress` is that at the shear rate which gives the Newtonian force. So Vasilic et al. (Cement and Concrete
//! Research 2011; thesis, Dresden 2015) ask a flow curve at a rate in proportion to u in the flow through reinforcement; no number here is
//! fitted to any flow. With phi = pi d^2/(4 s^2) the bars' share of the volume and t = pi d/(2 s):
//!
//! - L across: `4 pi / (-1/2 ln phi - 0.738 + phi - 0.887 phi^2 + 2.038 phi^3)`, square array (Sangani and Acrivos 1982);
//!   along: `4 pi / (-ln phi - 3/2 + 2 phi - phi^2/2)`, cell model (Happel 1959);
//!   across a row by itself: `8 pi / (1 - 2 ln 2t + 2/3 t^2 - 1/9 t^4 + 8/135 t^6 - 53/1350 t^8)` (Miyagi 1958).
//! - N across: the lower of two upper bounds, `4 sqrt 2 + 2 pi` of a rough bar by itself (Randolph and Houlsby 1984) and `2 s^2/(d (s - d))`
//!   of plugs that slide between rows of bars; along: `pi/(1 - phi)`, slip on the bars; across a row by itself: that of a bar.
//! - M from the flow in the cell model, a circle of the same area: across of Kuwabara (1959), along of Happel. Across a row by itself M - N is that of many.
//! - c: 1 across; along so that B begins as the thin layer on a bar does in which the fluid yields first.
//!
//! Between rows one behind the other a plug goes through as it is. Before the first and behind the last the fluid has to draw together or spread, which
//! the law for a row by itself has twice: a row at the end of several bears the mean of the two forces.
//!
//! Across and along at once, both forces are those at the speed |u|, each in proportion to its share of u: the load at which the fluid yields is then an
//! ellipse. The law asks only for the angle between u and the bars; it takes no notice of how the grid is turned about them.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::FlowCurve;

/// Least spacing over diameter. (The series across ends there.)
pub const CLOSEST: f64 = 2.0;

/// Parallel bars on a square grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarGrid {
    /// Diameter in m.
    pub diameter: f64,
    /// Distance in m between axes, at least [`CLOSEST`] diameters.
    pub spacing: f64,
    across: Way,
    single: Way,
    along: Way,
}

/// Numbers of one direction of flow, in the notation of the module.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Way {
    viscous: f64,
    limit: f64,
    /// M/N - 1.
    excess: f64,
    onset: f64,
}

impl BarGrid {
    /// Bars of a diameter and a spacing in m.
    pub fn new(diameter: f64, spacing: f64) -> Self {
        let s = spacing / diameter;
        let across = Way::across(s);
        Self { diameter, spacing, across, single: across.of_single_row(s), along: Way::along(s) }
    }

    /// The bars' share of the volume.
    pub fn share(&self) -> f64 {
        share(self.spacing / self.diameter)
    }

    /// Forces in N/m3 on the bars in a volume: across them where there are rows before and behind, across those of a row by itself, and along them; in a fluid that goes in that direction
    /// alone at a superficial speed in m/s. At rest the limit from above: what they bear before the fluid yields.
    pub fn drag(&self, curve: &FlowCurve, speed: f64) -> [f64; 3] {
        let scale = self.diameter / (self.spacing * self.spacing);
        [self.across, self.single, self.along].map(|way| scale * way.force(curve, speed / self.diameter))
    }
}

/// The bars' share of the volume at a spacing in diameters.
fn share(s: f64) -> f64 {
    0.25 * PI / (s * s)
}

/// B(y): how far the flow of a Bingham fluid between plates is on its way from rest to that of a Newtonian fluid.
fn way_to_newtonian(y: f64) -> f64 {
    // Newton's method from below, where the function is convex: it ends where it no longer rises.
    let mut x = (1.0 / (y + 1.5)).max(1.0 - (2.0 / 3.0 * y).sqrt());
    for _ in 0..50 {
        let next = x + (1.0 / x + 0.5 * x * x - y - 1.5) / (1.0 / (x * x) - x);
        if next.is_nan() || next <= x {
            break;
        }
        x = next;
    }
    1.0 - x * x
}

impl Way {
    /// Across bars at a spacing in diameters.
    fn across(s: f64) -> Self {
        let phi = share(s);
        let series = -0.5 * phi.ln() - 0.738 + phi - 0.887 * phi * phi + 2.038 * phi.powi(3);
        let limit = limit_of_bar().min(2.0 * s * s / (s - 1.0));
        Self { viscous: 4.0 * PI / series, limit, excess: sheared_across(phi) / limit - 1.0, onset: 1.0 }
    }

    /// Across a row by itself, instead of many one behind the other, at a spacing in diameters.
    fn of_single_row(self, s: f64) -> Self {
        let t = 0.5 * PI / s;
        let terms = [2.0 / 3.0, -1.0 / 9.0, 8.0 / 135.0, -53.0 / 1350.0];
        let series = terms.into_iter().rev().fold(0.0, |sum, term| (sum + term) * t * t);
        let limit = limit_of_bar();
        let excess = self.excess * self.limit / limit;
        Self { viscous: 8.0 * PI / (1.0 - 2.0 * (2.0 * t).ln() + series), limit, excess, ..self }
    }

    /// Along bars at a spacing in diameters.
    fn along(s: f64) -> Self {
        let phi = share(s);
        let viscous = 4.0 * PI / (-phi.ln() - 1.5 + 2.0 * phi - 0.5 * phi * phi);
        let limit = PI / (1.0 - phi);
        // In bar radii: the shear rate is G/(2 mu) (b^2/r - r) to the cell's radius b, and G pi b^2 = L mu u.
        let b = 1.0 / phi.sqrt();
        let sheared = 0.5 * viscous / (b * b) * (b * b * (b - 1.0) - (b.powi(3) - 1.0) / 3.0);
        let excess = sheared / limit - 1.0;
        // Where the stress on the bar is 1 + e times the yield stress, a layer of e times `depth` flows; y = rise e^2.
        let depth = 0.5 * (b * b - 1.0) / (b * b + 1.0);
        let rise = 0.5 * viscous / limit * depth * (1.0 - phi);
        Self { viscous, limit, excess, onset: 0.375 / (excess * excess * rise) }
    }

    /// Force over the diameter, in Pa, on a metre of bar at a speed in diameters a second.
    fn force(&self, curve: &FlowCurve, speed: f64) -> f64 {
        let (stress, yield_stress) = (curve.stress(self.viscous / self.limit * speed), curve.yield_stress());
        let mut force = stress;
        if yield_stress > 0.0 && stress > yield_stress {
            let y = stress / yield_stress - 1.0;
            force += self.excess * yield_stress * way_to_newtonian(self.onset * y);
        }
        self.limit * force
    }
}

/// N of a rough bar by itself.
fn limit_of_bar() -> f64 {
    4.0 * 2f64.sqrt() + 2.0 * PI
}

/// M across: the integral of the shear rate over a cell of Kuwabara's, whose bar takes the share `phi` of it, at u = d = 1.
///
/// The stream function is `f(r) sin(t)` with `f = a r^3 + b r ln r + c r + e/r`, r in bar radii: no slip on the bar, and on the cell's edge the velocity
/// u and no vorticity.
fn sheared_across(phi: f64) -> f64 {
    const RADII: usize = 400;
    const ANGLES: usize = 100;
    let edge = 1.0 / phi.sqrt();
    let b = 1.0 / (edge.ln() - 0.75 + phi - 0.25 * phi * phi);
    let a = -0.25 * b * phi;
    let e = a + 0.5 * b;
    let step = edge.ln() / RADII as f64;
    let mut sum = 0.0;
    for i in 0..RADII {
        let r = ((i as f64 + 0.5) * step).exp();
        let stretch = 2.0 * a * r + b / r - 2.0 * e / r.powi(3);
        let shear = 4.0 * (a * r + e / r.powi(3));
        for j in 0..ANGLES {
            let t = (j as f64 + 0.5) / ANGLES as f64 * FRAC_PI_2;
            sum += ((2.0 * stretch * t.cos()).powi(2) + (shear * t.sin()).powi(2)).sqrt() * r * r;
        }
    }
    // Four quarters; radii are half diameters.
    sum * step * 4.0 * FRAC_PI_2 / ANGLES as f64 * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEWTONIAN: FlowCurve = FlowCurve::Newtonian { viscosity: 1.0 };

    fn bingham(yield_stress: f64) -> FlowCurve {
        FlowCurve::Bingham { yield_stress, plastic_viscosity: 1.0 }
    }

    /// Forces on a metre of bar of 1 m.
    fn on_bar(s: f64, curve: &FlowCurve, speed: f64) -> [f64; 3] {
        BarGrid::new(1.0, s).drag(curve, speed).map(|drag| drag * s * s)
    }

    #[test]
    fn newtonian_drag_is_that_of_sangani_and_acrivos() {
        // Their table 1: solid fraction, force over viscosity and speed.
        for (phi, force) in [(0.05, 15.56), (0.10, 24.83), (0.20, 51.53)] {
            let s = (0.25 * PI / phi).sqrt();
            let [across, ..] = on_bar(s, &NEWTONIAN, 1.0);
            // The last is where the series ends.
            assert!((across / force - 1.0).abs() < if phi < 0.15 { 2e-3 } else { 0.02 }, "{phi} {across}");
        }
    }

    #[test]
    fn a_row_by_itself_bears_more_than_one_of_many() {
        // Most where plugs slide between the rows; nothing but what a Newtonian fluid asks for where the rows do not feel each other.
        for (s, more) in [(2.0, 0.49), (3.0, 0.32), (5.0, 0.0), (8.0, 0.0)] {
            let [of_many, alone, _] = on_bar(s, &bingham(1.0), 0.0);
            assert!((alone / of_many - 1.0 - more).abs() < 0.01, "{s}: {alone} {of_many}");
            let [of_many, alone, _] = on_bar(s, &NEWTONIAN, 1.0);
            assert!((1.0..1.08).contains(&(alone / of_many)), "{s}: {alone} {of_many}");
        }
        // Far apart both are much the same bar.
        let [of_many, alone, _] = on_bar(1e4, &NEWTONIAN, 1.0);
        assert!((alone / of_many - 1.0).abs() < 0.03, "{alone} {of_many}");
    }

    #[test]
    fn thin_bars_bear_twice_as_much_across_as_along() {
        let [across, _, along] = on_bar(1e6, &NEWTONIAN, 1.0);
        assert!((across / along - 2.0).abs() < 0.01, "{across} {along}");
    }

    #[test]
    fn the_limit_load_is_exact_and_is_that_of_one_bar_or_of_rows() {
        for (s, limit) in [(3.0, 9.0), (8.0, 11.940039)] {
            let [across, _, along] = on_bar(s, &bingham(2.0), 0.0);
            assert!((across / (2.0 * limit) - 1.0).abs() < 1e-7, "{across}");
            assert!((along / (2.0 * PI / (1.0 - share(s))) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn forces_grow_with_the_speed_and_never_less_than_both_limits_together() {
        let curve = bingham(1.0);
        for s in [2.0, 3.0, 5.0, 8.0, 15.0] {
            let mut last = on_bar(s, &curve, 0.0);
            let rest = last;
            for k in 0..400 {
                let u = 10f64.powf(0.02 * f64::from(k) - 5.0);
                let (force, viscous) = (on_bar(s, &curve, u), on_bar(s, &NEWTONIAN, u));
                for n in 0..3 {
                    assert!(force[n] > last[n] && force[n] >= rest[n] + viscous[n], "{s} {u}");
                }
                last = force;
            }
        }
    }

    #[test]
    fn a_weak_yield_stress_adds_what_the_newtonian_flow_dissipates() {
        for s in [2.0, 3.0, 5.0, 8.0] {
            let (grid, u) = (BarGrid::new(1.0, s), 1e5);
            let (force, viscous) = (on_bar(s, &bingham(1.0), u), on_bar(s, &NEWTONIAN, u));
            for (n, way) in [grid.across, grid.single, grid.along].into_iter().enumerate() {
                let least = way.limit * (1.0 + way.excess);
                assert!(way.excess > 0.0 && ((force[n] - viscous[n]) / least - 1.0).abs() < 1e-4);
            }
            // The shear rate's mean is no more than its root mean square, which Kuwabara's drag tells (with that of the edge).
            let phi = share(s);
            let kuwabara = 4.0 * PI / (-0.5 * phi.ln() - 0.75 + phi - 0.25 * phi * phi);
            let cell = (1.0 - phi) * s * s;
            assert!(sheared_across(phi) < (kuwabara * cell).sqrt());
        }
    }

    /// Speed of the flow along bars in Happel's cell, of bars of 1 m, viscosity and yield stress 1, under the pressure gradient g: the integral of shear rates.
    fn cell_speed(s: f64, g: f64) -> f64 {
        const STEPS: usize = 20000;
        let (a, b) = (0.5, s / PI.sqrt());
        let step = (b - a) / STEPS as f64;
        let of = |i: usize| {
            let r = a + step * (i as f64 + 0.5);
            (0.5 * g * (b * b / r - r) - 1.0).max(0.0) * (b * b - r * r)
        };
        (0..STEPS).map(of).sum::<f64>() * step / (b * b)
    }

    #[test]
    fn along_bars_the_law_is_the_flow_in_the_cell() {
        for s in [2.0, 3.0, 5.0, 8.0, 12.0] {
            let limit = on_bar(s, &bingham(1.0), 0.0)[2] / (s * s);
            for over in [1.03, 1.1, 1.3, 1.6, 2.0, 3.0, 5.0, 10.0, 30.0] {
                let u = cell_speed(s, over * limit);
                let force = BarGrid::new(1.0, s).drag(&bingham(1.0), u)[2];
                // The transition is an interpolation.
                assert!((force / (over * limit) - 1.0).abs() < 0.02, "{s} {over} {}", force / limit);
            }
        }
    }

    #[test]
    fn between_plates_the_transition_is_exact() {
        for x in [0.05, 0.3, 0.5, 0.9, 0.99, 0.9999] {
            let y: f64 = 1.0 / x + 0.5 * x * x - 1.5;
            assert!((way_to_newtonian(y) - (1.0 - x * x)).abs() < 1e-7, "{x}");
        }
        assert_eq!(way_to_newtonian(0.0), 0.0);
        assert!(way_to_newtonian(1e300) == 1.0);
    }

    #[test]
    fn other_flow_curves_tend_to_the_same_limits() {
        let casson = FlowCurve::Casson { yield_stress: 3.0, plastic_viscosity: 1.0 };
        let herschel_bulkley = FlowCurve::HerschelBulkley { yield_stress: 3.0, consistency: 1.0, index: 1.0 };
        for u in [0.0, 0.01, 1.0, 30.0] {
            let (one, other) = (on_bar(5.0, &herschel_bulkley, u), on_bar(5.0, &bingham(3.0), u));
            assert!((one[0] / other[0] - 1.0).abs() < 1e-12);
        }
        assert!((on_bar(5.0, &casson, 0.0)[0] / on_bar(5.0, &bingham(3.0), 0.0)[0] - 1.0).abs() < 1e-7);
    }
}
