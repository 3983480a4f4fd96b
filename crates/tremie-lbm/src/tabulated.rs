//! Flow curves without a closed form for the lattice, as tables.
//!
//! Three functions of one variable are all that the kernels ask for; the model behind them is not known there. The solution s of
//! `3 sigma(s) + s/2 = q` is found once for each point of the table. Against it, the relative error of omega, which is
//! that of s, stays below 1e-4 (module `table`); a yield stress stays exact, because the curve bends there.

use tremie_numerics::root::turning_point;
use tremie_rheology::FlowCurve;

use crate::real::{Number, Real, larger};
use crate::relaxation::{Law, Relaxation};
use crate::scaling::Scaling;
use crate::table::Table;

/// Turns of the secant method for the velocity of a wall.
const TURNS: usize = 5;
/// Share of the traction over which the mean shear rate of a half-cell is taken at least.
const LEAST_GROWTH: f64 = 1e-3;

/// Any flow curve.
#[derive(Debug, Clone)]
pub struct Tabulated<T> {
    /// Relaxation rate as a function of q.
    omega: Table<T>,
    /// Shear rate as a function of the kinematic stress.
    rate: Table<T>,
    /// Its integral from no stress.
    integral: Table<T>,
}

/// A flow curve in lattice units.
#[derive(Clone, Copy)]
struct LatticeCurve<'a> {
    curve: &'a FlowCurve,
    scaling: &'a Scaling,
}

impl LatticeCurve<'_> {
    fn stress(&self, rate: f64) -> f64 {
        self.scaling.stress(self.curve.stress(rate / self.scaling.time_step))
    }

    fn rate(&self, stress: f64) -> f64 {
        self.curve.shear_rate(stress * self.scaling.stress_unit()) * self.scaling.time_step
    }

    /// Solves `3 sigma(s) + s/2 = q`.
    fn rate_of_measure(&self, q: f64) -> f64 {
        if 3.0 * self.stress(0.0) >= q {
            return 0.0;
        }
        turning_point(2.0 * q, |s| 3.0 * self.stress(s) + 0.5 * s < q)
    }

    /// The integral of the shear rate from one stress to another near by (three points of Gauss).
    fn integral(&self, from: f64, to: f64) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let offset = 0.6f64.sqrt() * half;
        let outer = self.rate(middle - offset) + self.rate(middle + offset);
        half * (5.0 * outer + 8.0 * self.rate(middle)) / 9.0
    }
}

impl<T: Real> Tabulated<T> {
    /// Tabulates a flow curve for a lattice.
    pub fn new(curve: &FlowCurve, scaling: &Scaling) -> Self {
        let curve = LatticeCurve { curve, scaling };
        let bend = scaling.stress(curve.curve.bend());
        let (mut stress, mut sum) = (0.0, 0.0);
        Self {
            omega: Table::new(3.0 * bend + 0.5 * curve.rate(bend), |q| curve.rate_of_measure(q) / q),
            rate: Table::new(bend, |stress| curve.rate(stress)),
            integral: Table::new(bend, |to| {
                sum += curve.integral(stress, to);
                stress = to;
                sum
            }),
        }
    }
}

/// A growth of the stress over which the difference of two integrals is not lost in rounding.
#[inline(always)]
fn told<N: Number>(growth: N, traction: N) -> N {
    let least = larger(N::from_f64(LEAST_GROWTH) * traction, N::TINY);
    N::where_greater(growth.abs(), least, growth, least)
}

impl<N: Number> Relaxation<N> for Tabulated<N::Scalar> {
    #[inline(always)]
    fn quotient(&self, q: N) -> [N; 2] {
        [self.omega.at(q), N::ONE]
    }

    #[inline(always)]
    fn is_newtonian(&self) -> bool {
        false
    }

    /// The equation of the trait as it stands, which holds whether the cell is rigid or not, by the secant method.
    ///
    /// Its left side less its right one grows with v at least as fast as `2 v` for all our curves (a test), which bounds the slope from
    /// below; the first slope is that for a cell that keeps its shear rate.
    #[inline(always)]
    fn wall_velocity(&self, _: N, _: N, cell: impl Fn(N) -> [N; 3]) -> N {
        let (two, four, third) = (N::from_f64(2.0), N::from_f64(4.0), N::from_f64(1.0 / 3.0));
        let at_rest = cell(N::ZERO);
        let traction = at_rest[1];
        let excess = |v: N| four * (v - self.half_cell(traction, cell(v)));
        let (mut v0, mut f0) = (N::ZERO, four * (N::ZERO - self.half_cell(traction, at_rest)));
        let growth = told(at_rest[2], traction);
        let curve = (self.rate.at(traction) - self.rate.at(larger(traction - growth, N::ZERO))) / growth;
        let mut v = -f0 / (four + two * third * curve);
        for _ in 0..TURNS {
            let f = excess(v);
            let step = v - v0;
            let step = N::where_greater(step.abs(), N::TINY, step, N::ONE);
            let slope = larger((f - f0) / step, two);
            (v0, f0) = (v, f);
            v -= f / slope;
        }
        v
    }

    #[inline(always)]
    fn rate(&self, stress: N) -> N {
        self.rate.at(stress)
    }

    #[inline(always)]
    fn half_cell(&self, traction: N, [fluidity, wall, growth]: [N; 3]) -> N {
        let growth = told(growth, traction);
        let wall = larger(wall, N::ZERO);
        let centre = larger(wall - growth, N::ZERO);
        let mean = (self.integral.at(wall) - self.integral.at(centre)) / growth;
        N::from_f64(0.25) * (N::from_f64(2.0) * mean - self.rate.at(centre) - fluidity * wall)
    }
}

impl<T: Real> Law<T> for Tabulated<T> {
    type Own = ();
    type Row<'a> = &'a Self;
    type Cell<'a> = &'a Self;

    const BY_ROW: bool = true;

    #[inline(always)]
    fn own(&self, _: &[f64], _: usize) {}

    #[inline(always)]
    fn row(&self, (): &()) -> &Self {
        self
    }

    #[inline(always)]
    fn cell(&self, (): &(), _: usize) -> &Self {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, Lanes};
    use crate::relaxation::Bingham;
    use tremie_rheology::Regularisation;

    const SCALING: Scaling = Scaling { cell_size: 0.005, time_step: 2e-4, density: 2300.0 };

    fn curves() -> Vec<FlowCurve> {
        let (yield_stress, consistency) = (50.0, 20.0);
        let rigid = [
            FlowCurve::Bingham { yield_stress, plastic_viscosity: 30.0 },
            FlowCurve::HerschelBulkley { yield_stress, consistency, index: 0.3 },
            FlowCurve::HerschelBulkley { yield_stress, consistency, index: 0.5 },
            FlowCurve::HerschelBulkley { yield_stress, consistency, index: 1.5 },
            FlowCurve::Casson { yield_stress, plastic_viscosity: 5.0 },
        ];
        let mut curves = vec![
            FlowCurve::PowerLaw { consistency, index: 0.5 },
            FlowCurve::PowerLaw { consistency, index: 1.5 },
            FlowCurve::Cross {
                zero_shear_viscosity: 3e4,
                infinite_shear_viscosity: 30.0,
                time: 600.0,
                index: 1.0,
            },
            FlowCurve::CarreauYasuda {
                zero_shear_viscosity: 300.0,
                infinite_shear_viscosity: 3.0,
                time: 2.0,
                index: 0.4,
                transition: 2.0,
            },
        ];
        for curve in rigid {
            curves.push(curve);
            for by in [
                Regularisation::Papanastasiou { exponent: 100.0 },
                Regularisation::BiViscosity { largest_viscosity: 3e4 },
            ] {
                curves.push(curve.regularised(by).unwrap());
            }
        }
        curves
    }

    /// 200 shear rates in lattice units, from 1e-4/s to 1e3/s.
    fn rates() -> impl Iterator<Item = f64> {
        (0..200).map(|k| SCALING.time_step * 10f64.powf(-4.0 + 7.0 * f64::from(k) / 199.0))
    }

    #[test]
    fn omega_is_that_of_the_curve() {
        for curve in curves() {
            let lattice = LatticeCurve { curve: &curve, scaling: &SCALING };
            let law = Tabulated::<f64>::new(&curve, &SCALING);
            for s in rates() {
                let q = 3.0 * lattice.stress(s) + 0.5 * s;
                let error = law.omega(q) / (s / q) - 1.0;
                assert!(error.abs() < 1e-4, "{curve:?} {s:e} {error:e}");
            }
        }
    }

    #[test]
    fn shear_rates_grow_with_the_measure_and_nothing_flows_up_to_the_yield_stress() {
        for curve in curves() {
            let law = Tabulated::<f64>::new(&curve, &SCALING);
            let threshold = 3.0 * SCALING.stress(curve.yield_stress());
            let mut last = 0.0;
            for k in 0..40_000 {
                let q = 1e-9 * 1.0005f64.powi(k);
                let s = law.omega(q) * q;
                assert_eq!(s > 0.0, q > threshold, "{curve:?} {q:e}");
                assert!(s > last || q <= threshold, "{curve:?} {q:e}");
                last = s;
            }
        }
    }

    #[test]
    fn the_cells_of_a_row_relax_each_by_itself() {
        for curve in curves() {
            let law = Tabulated::<f32>::new(&curve, &SCALING);
            let q = Lanes::<f32>(std::array::from_fn(|k| 1e-7 * 8f32.powi(k as i32)));
            let together = law.omega(q);
            for k in 0..LANES {
                assert_eq!(together.0[k], law.omega(q.0[k]));
                assert!((0.0..2.0).contains(&together.0[k]));
            }
        }
    }

    /// Solves the equation of the wall by bisection, with the flow curve itself.
    fn bisect(curve: LatticeCurve<'_>, traction: f64, cell: impl Fn(f64) -> [f64; 3]) -> f64 {
        let excess = |v: f64| {
            let [fluidity, wall, growth] = cell(v);
            let pieces = 100;
            let at = |k: i32| (wall - growth * f64::from(k) / f64::from(pieces)).max(0.0);
            let sum: f64 = (0..pieces).map(|k| curve.integral(at(k + 1), at(k))).sum();
            4.0 * v - (2.0 * sum / growth - curve.rate((wall - growth).max(0.0)) - fluidity * wall)
        };
        let (mut low, mut high) = (-3.0 * traction, 3.0 * traction);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Tractions and growths of the stress over the half-cell, from rigid cells to such as have yielded strongly.
    const WALLS: [(f64, f64); 6] =
        [(1.2e-5, 4e-6), (2.5e-5, 1e-5), (6e-5, 1e-5), (1e-4, 4e-5), (2e-4, 5e-5), (2e-4, 4e-6)];

    /// Holds the velocity of a wall by a law against that by bisection, at a cell in simple shear along the wall.
    fn hold_walls(curve: &FlowCurve, law: &impl Relaxation<f64>) {
        let lattice = LatticeCurve { curve, scaling: &SCALING };
        for (traction, growth) in WALLS {
            let stress = traction - growth;
            let measure = stress + lattice.rate(stress) / 6.0;
            // As module `wall` has it: half of what P exceeds the stress by is told apart.
            let rigid = traction - 0.5 * (measure - stress);
            let cell = |v: f64| {
                let measure = measure - v / 3.0;
                let rate = lattice.rate_of_measure(3.0 * measure.max(0.0));
                let stress = measure - rate / 6.0;
                let wall = rigid - v / 3.0 + 0.5 * (measure - stress);
                [if rate > 0.0 { rate / stress } else { 0.0 }, wall, wall - stress]
            };
            let v = law.wall_velocity(rigid, rigid - measure, cell);
            let exact = bisect(lattice, traction, cell);
            let scale = lattice.rate(traction) / 4.0;
            assert!(
                (v - exact).abs() < 5e-3 * exact.abs() + 1e-4 * scale + 1e-18,
                "{curve:?} {traction:e} {growth:e}: {v:e} {exact:e}"
            );
        }
    }

    #[test]
    fn wall_velocity_solves_its_equation() {
        for curve in curves() {
            hold_walls(&curve, &Tabulated::<f64>::new(&curve, &SCALING));
        }
    }

    #[test]
    fn so_does_the_closed_form_of_a_bingham_fluid() {
        let curve = FlowCurve::Bingham { yield_stress: 50.0, plastic_viscosity: 30.0 };
        let law = Bingham::<f64>::new(SCALING.stress(50.0), SCALING.viscosity(30.0));
        hold_walls(&curve, &law);
    }

    #[test]
    fn walls_at_rigid_cells_of_a_bingham_fluid_are_those_of_its_closed_form() {
        let curve = FlowCurve::Bingham { yield_stress: 50.0, plastic_viscosity: 30.0 };
        let tabulated = Tabulated::<f64>::new(&curve, &SCALING);
        let closed = Bingham::<f64>::new(SCALING.stress(50.0), SCALING.viscosity(30.0));
        for (traction, growth) in [(4e-5, 1e-5), (4.5e-5, 2e-5), (8e-5, 6e-5)] {
            let cell = |v: f64| [0.0, traction - v / 3.0, growth];
            let v = closed.wall_velocity(traction, growth, cell);
            assert!(
                (tabulated.wall_velocity(traction, growth, cell) / v - 1.0).abs() < 0.02,
                "{traction} {v}"
            );
        }
    }
}
