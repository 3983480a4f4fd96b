//! From the non-equilibrium stress of a cell to its relaxation rate, exactly and without iteration.
//!
//! With `q = 3/(2 rho) sqrt(2 P:P)`, P the deviatoric part of `sum c c (f - f_eq) + (u F + F u)/2`, the
//! Chapman-Enskog expansion gives `q = tau s`, where `s = sqrt(2 D:D)` is the shear rate and
//! `tau = 3 nu(s) + 1/2` (lattice units). With the kinematic stress `sigma(s) = nu(s) s` of the flow curve,
//!
//! ```text
//!     3 sigma(s) + s/2 = q
//! ```
//!
//! has exactly one solution s >= 0, because the left side increases; then `omega = 1/tau = s/q`. A cell below the
//! yield stress gets `omega = 0`: no regularisation, no largest viscosity. (Geier, Kutscher and Krafczyk 2021
//! reach the same form for the cumulant method.)
//!
//! For a Bingham fluid `s = max(0, (q - 3 tau_y)/(3 nu_p + 1/2))`; for all others the solution is tabulated (module
//! `tabulated`).

use crate::lanes::Lanes;
use crate::real::{Number, Real, larger, smaller};

/// A flow curve in lattice units, as the collision asks for it.
pub trait Relaxation<N> {
    /// Relaxation rate omega in [0, 2) for the stress measure `q >= 0`, as a numerator and a positive denominator. (What follows from
    /// omega by another quotient then need not wait for this one.)
    fn quotient(&self, q: N) -> [N; 2];

    /// Relaxation rate omega in [0, 2) for the stress measure `q >= 0`.
    #[inline(always)]
    fn omega(&self, q: N) -> N
    where
        N: Number,
    {
        let [numerator, denominator] = self.quotient(q);
        numerator / denominator
    }

    /// Whether the viscosity depends on the stress at all.
    fn is_newtonian(&self) -> bool;

    /// Velocity v that a wall needs so that the half-cell at it shears by its own stress (module `wall`):
    ///
    /// ```text
    ///     4 v = 2 mean(s) - s(t - growth) - fluidity t
    /// ```
    ///
    /// with the mean of the flow curve's s(tau) over the half-cell, in which tau grows from `t - growth` to `t` at the wall.
    /// Beyond no stress there is no fluid. `cell(v)` is the fluidity of the cell itself, t, and the growth, while
    /// the wall moves with v. If the cell is rigid, `t = traction - v/3`, and `growth` is the growth.
    fn wall_velocity(&self, traction: N, growth: N, cell: impl Fn(N) -> [N; 3]) -> N;

    /// Shear rate s(tau) under the stress `stress >= 0`.
    fn rate(&self, stress: N) -> N;

    /// What v is after the equation of [`Relaxation::wall_velocity`] for a cell of the given fluidity, t, and growth; `traction` tells
    /// which stresses are small.
    fn half_cell(&self, traction: N, cell: [N; 3]) -> N;
}

/// The flow curves of all cells, one by one and for the cells of a row at once.
pub(crate) trait Law<T: Real>: Send + Sync {
    /// What the flow curves of a row's cells have of their own; nothing where all are the same.
    type Own: Copy;
    /// The flow curves of a row's cells.
    type Row<'a>: Relaxation<Lanes<T>>
    where
        Self: 'a;
    /// That of one of them.
    type Cell<'a>: Relaxation<T>
    where
        Self: 'a;

    /// Whether all cells of a row had better be asked for together: tables are looked up in each cell by itself, and a loop over
    /// cells with that in it does not become vector code.
    const BY_ROW: bool;

    /// What the row whose first cell is `first` has of its own, in a block of which the cells have these structures (module `structure`).
    fn own(&self, structure: &[f64], first: usize) -> Self::Own;

    /// The flow curves of a row.
    fn row(&self, own: &Self::Own) -> Self::Row<'_>;

    /// The flow curve of a cell of a row.
    fn cell(&self, own: &Self::Own, lane: usize) -> Self::Cell<'_>;
}

impl<N, R: Relaxation<N>> Relaxation<N> for &R {
    #[inline(always)]
    fn quotient(&self, q: N) -> [N; 2] {
        R::quotient(self, q)
    }

    #[inline(always)]
    fn is_newtonian(&self) -> bool {
        R::is_newtonian(self)
    }

    #[inline(always)]
    fn wall_velocity(&self, traction: N, growth: N, cell: impl Fn(N) -> [N; 3]) -> N {
        R::wall_velocity(self, traction, growth, cell)
    }

    #[inline(always)]
    fn rate(&self, stress: N) -> N {
        R::rate(self, stress)
    }

    #[inline(always)]
    fn half_cell(&self, traction: N, cell: [N; 3]) -> N {
        R::half_cell(self, traction, cell)
    }
}

/// Newtonian and Bingham fluids: one, or one for each cell of a row.
#[derive(Debug, Clone, Copy)]
pub struct Bingham<N> {
    /// 3 tau_y with the kinematic yield stress in lattice units.
    pub(crate) threshold: N,
    /// 1/(3 nu_p + 1/2).
    pub(crate) fastest: N,
    /// Kinematic yield stress.
    yield_stress: N,
    /// Kinematic plastic viscosity.
    plastic_viscosity: N,
}

impl<T: Real> Bingham<T> {
    /// The same fluid in every cell of a row, with the yield stress `grown` times as large in each.
    #[inline(always)]
    pub(crate) fn grown<N: Number<Scalar = T>>(&self, grown: N) -> Bingham<N> {
        Bingham {
            threshold: N::splat(self.threshold) * grown,
            yield_stress: N::splat(self.yield_stress) * grown,
            ..self.everywhere()
        }
    }

    /// The same fluid in every cell of a row.
    #[inline(always)]
    fn everywhere<N: Number<Scalar = T>>(&self) -> Bingham<N> {
        Bingham {
            threshold: N::splat(self.threshold),
            fastest: N::splat(self.fastest),
            yield_stress: N::splat(self.yield_stress),
            plastic_viscosity: N::splat(self.plastic_viscosity),
        }
    }
}

impl<N: Number> Bingham<N> {
    /// From the kinematic yield stress and plastic viscosity in lattice units.
    pub fn new(yield_stress: f64, plastic_viscosity: f64) -> Self {
        Self {
            threshold: N::from_f64(3.0 * yield_stress),
            fastest: N::from_f64(1.0 / (3.0 * plastic_viscosity + 0.5)),
            yield_stress: N::from_f64(yield_stress),
            plastic_viscosity: N::from_f64(plastic_viscosity),
        }
    }

    /// The velocity of the wall where the cell is rigid: `2 v = mean(s)`.
    #[inline(always)]
    fn wall_velocity_rigid(&self, traction: N, growth: N) -> N {
        // With x = t - tau_y the yielded share of the half-cell is x/growth, so 4 nu growth v = x^2, and v = 3 (X - x).
        let excess = larger(traction - self.yield_stress, N::ZERO);
        let b = N::from_f64(6.0) * self.plastic_viscosity * larger(growth, N::ZERO);
        let x = (b * b + N::from_f64(2.0) * b * excess).sqrt() - b;
        // Where all of the half-cell has yielded, that is more than it shears by.
        smaller(N::from_f64(3.0) * (excess - x), self.wall_velocity_yielded(traction, N::ZERO))
    }

    /// The same where it has yielded and has the given fluidity: s(tau) is straight from the centre to the wall, so that
    /// `2 mean(s) = s(t - growth) + s(t)`.
    #[inline(always)]
    fn wall_velocity_yielded(&self, traction: N, fluidity: N) -> N {
        let (four, third) = (N::from_f64(4.0), N::from_f64(1.0 / 3.0));
        let viscosity = self.plastic_viscosity;
        let share = fluidity * viscosity;
        let excess = traction - self.yield_stress - share * traction;
        larger(excess, N::ZERO) / (four * viscosity + third - third * share)
    }
}

impl<N: Number> Relaxation<N> for Bingham<N> {
    #[inline(always)]
    fn quotient(&self, q: N) -> [N; 2] {
        // At q = 0 the rate is that for any q without a yield stress, and 0 with one.
        let q = larger(q, N::TINY);
        [larger(q - self.threshold, N::ZERO) * self.fastest, q]
    }

    #[inline(always)]
    fn is_newtonian(&self) -> bool {
        self.yield_stress == N::ZERO
    }

    #[inline(always)]
    fn wall_velocity(&self, traction: N, growth: N, cell: impl Fn(N) -> [N; 3]) -> N {
        let rigid = self.wall_velocity_rigid(traction, growth);
        // The cell's fluidity depends on v: v = next(v). Each turn comes nearer by much the same share of the way, so that two tell where it
        // ends (Aitken 1926).
        let (mut before, mut v) = (rigid, rigid);
        for turn in 0..3 {
            let [fluidity, wall, _] = cell(v);
            let traction = wall + N::from_f64(1.0 / 3.0) * v;
            let yielded = self.wall_velocity_yielded(traction, fluidity);
            let next = N::where_greater(fluidity, N::ZERO, yielded, rigid);
            v = match turn {
                1 => {
                    let (step, change) = (next - v, (v - before) - (next - v));
                    let share = N::where_greater(change.abs(), N::TINY, step / change, N::ZERO);
                    next + step * larger(smaller(share, N::from_f64(4.0)), -N::from_f64(0.5))
                }
                _ => {
                    before = v;
                    next
                }
            };
        }
        v
    }

    #[inline(always)]
    fn rate(&self, stress: N) -> N {
        larger(stress - self.yield_stress, N::ZERO) / self.plastic_viscosity
    }

    #[inline(always)]
    fn half_cell(&self, _: N, [fluidity, wall, growth]: [N; 3]) -> N {
        let wall = larger(wall, N::ZERO);
        let rate = self.rate(wall);
        let yielded = larger(rate - fluidity * wall, N::ZERO);
        // The yielded share of the half-cell; all of it where the stress does not grow by more than that.
        let excess = rate * self.plastic_viscosity;
        let rigid = rate * excess / larger(larger(growth, excess), N::TINY);
        N::from_f64(0.25) * N::where_greater(fluidity, N::ZERO, yielded, rigid)
    }
}

impl<T: Real> Law<T> for Bingham<T> {
    type Own = ();
    type Row<'a> = Bingham<Lanes<T>>;
    type Cell<'a> = Self;

    const BY_ROW: bool = false;

    #[inline(always)]
    fn own(&self, _: &[f64], _: usize) {}

    #[inline(always)]
    fn row(&self, (): &()) -> Bingham<Lanes<T>> {
        self.everywhere()
    }

    #[inline(always)]
    fn cell(&self, (): &(), _: usize) -> Self {
        *self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solves 3 sigma(s) + s/2 = q by bisection, knowing nothing of closed forms.
    fn bisect(yield_stress: f64, viscosity: f64, q: f64) -> f64 {
        let left = |s: f64| 3.0 * (yield_stress + viscosity * s) + 0.5 * s;
        if left(0.0) >= q {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, 2.0 * q + 1.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if left(middle) < q { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    #[test]
    fn closed_form_solves_the_scalar_equation() {
        for (yield_stress, viscosity) in
            [(0.0, 0.02), (0.0, 1.0 / 6.0), (1e-5, 0.1), (8.77e-5, 0.15), (1e-3, 1e-3)]
        {
            let law = Bingham::<f64>::new(yield_stress, viscosity);
            for k in 0..200 {
                let q = 10f64.powf(-8.0 + 0.04 * f64::from(k));
                let exact = bisect(yield_stress, viscosity, q);
                assert!((law.omega(q) * q - exact).abs() <= 1e-12 * q, "q {q}");
                assert!((0.0..2.0).contains(&law.omega(q)));
            }
        }
    }

    #[test]
    fn wall_velocity_solves_its_equation() {
        let (yield_stress, viscosity) = (2e-5, 0.08);
        let law = Bingham::<f64>::new(yield_stress, viscosity);
        for fluidity in [0.0, 0.3, 4.0] {
            for traction in [1e-5, 2.5e-5, 6e-5, 2e-4] {
                let v = law.wall_velocity_yielded(traction, fluidity);
                let t = traction - v / 3.0;
                let s = ((t - yield_stress) / viscosity).max(0.0);
                let left = (s - fluidity * t).max(0.0);
                assert!((4.0 * v - left).abs() < 1e-12, "{fluidity} {traction}: {v}");
            }
        }
        for growth in [-1e-5, 0.0, 1e-6, 1e-5, 5e-5] {
            for traction in [1e-5, 2.5e-5, 6e-5] {
                // Shear from the wall to where the half-cell ends, or the yielded part of it.
                let v = law.wall_velocity_rigid(traction, growth);
                let x = (traction - v / 3.0 - yield_stress).max(0.0);
                let share = if x >= growth { 1.0 } else { x / growth };
                assert!((4.0 * v - share * x / viscosity).abs() < 1e-12, "{growth} {traction}: {v}");
            }
        }
        // A Newtonian wall does not slip, whatever the traction.
        let newtonian = Bingham::<f64>::new(0.0, viscosity);
        assert!(newtonian.wall_velocity_yielded(1e-3, 1.0 / viscosity) < 1e-18);
    }

    #[test]
    fn no_stress_is_no_trouble() {
        assert_eq!(Bingham::<f32>::new(1e-5, 0.1).omega(0.0f32), 0.0);
        let newtonian = Bingham::<f32>::new(0.0, 0.5);
        assert_eq!(newtonian.omega(0.0f32), 0.5);
        assert_eq!(newtonian.omega(0.0f32), newtonian.omega(0.1));
    }
}
