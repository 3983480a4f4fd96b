//! The viscous part of a step, implicit: for the new velocities u
//!
//! ```text
//!     rho/dt (u_a - u_a^n) = F_a + sum_b V 2 (d + 2) mu_ab (u_a - u_b) . x_ab / (r^2 + eta^2) grad W_ab
//! ```
//!
//! with `mu_ab` the harmonic mean and F what else pushes, in N/m3. The radial form (Monaghan 2005; Espanol and Revenga 2003) stands for div(2 mu E), with what varies of mu, and conserves both momenta.

use rayon::prelude::*;
use tremie_cloud::{Failure, Matrix, Method, Settings, solve};
use tremie_numerics::{DMat3, DVec3};

use crate::Fluid;
use crate::surroundings::Surroundings;

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-8, iterations: 2000 };

/// A particle's row: the blocks of particles, and the right-hand side.
struct Row {
    own: DMat3,
    others: Vec<(usize, DMat3)>,
    right: DVec3,
}

/// Brings the velocities to the end of a step of `step` in s under a `force` in N/m3; gives the iterations that it took.
pub(crate) fn diffuse(
    around: &Surroundings,
    fluid: &Fluid,
    viscosity: &[f64],
    force: impl Fn(usize) -> DVec3 + Sync,
    velocities: &mut [DVec3],
    step: f64,
) -> Result<usize, Failure> {
    let d = around.dimension.number();
    let rate = fluid.density / step;
    let row = |a: usize| {
        let mut own = DMat3::from_diagonal(DVec3::splat(rate));
        let mut right = rate * velocities[a] + force(a);
        let mut others: Vec<(usize, DMat3)> = Vec::new();
        for (_, x, source) in around.around(a) {
            let (r, other) = (x.length(), viscosity[source.of]);
            let mean = 2.0 * viscosity[a] * other / (viscosity[a] + other);
            let slope = -around.kernel.slope(r);
            let factor = around.volume * 2.0 * (d + 2) as f64 * mean * slope / (r * (r * r + around.soft));
            let block = DMat3::from_cols(factor * x.x * x, factor * x.y * x, factor * x.z * x);
            own += block;
            right += block * source.carried;
            others.push((source.of, block * source.turn));
        }
        // What comes from images belongs to their particles; in the order of these, and then of the images.
        others.sort_by_key(|(of, _)| *of);
        let mut merged: Vec<(usize, DMat3)> = Vec::with_capacity(others.len());
        for (of, block) in others {
            match merged.last_mut() {
                _ if of == a => own -= block,
                Some((last, sum)) if *last == of => *sum -= block,
                _ => merged.push((of, -block)),
            }
        }
        Row { own, others: merged, right }
    };
    let rows: Vec<Row> = (0..around.number).into_par_iter().with_min_len(64).map(row).collect();
    let scalar = |n: usize| {
        let (row, i) = (&rows[n / d], n % d);
        let beside = (0..d).filter(move |j| *j != i).map(move |j| ((n - i + j) as u32, row.own.col(j)[i]));
        let others = row.others.iter();
        let others =
            others.flat_map(move |(of, block)| (0..d).map(move |j| ((of * d + j) as u32, block.col(j)[i])));
        (row.own.col(i)[i], beside.chain(others).collect::<Vec<_>>())
    };
    let matrix = Matrix::from_rows((0..around.number * d).map(scalar));
    let flat = |vectors: &mut dyn Iterator<Item = DVec3>| -> Vec<f64> {
        vectors.flat_map(|v| v.to_array().into_iter().take(d)).collect()
    };
    let right = flat(&mut rows.iter().map(|row| row.right));
    let mut u = flat(&mut velocities.iter().copied());
    let solved = solve(&matrix, None, &right, &mut u, &SETTINGS)?;
    for (velocity, u) in velocities.iter_mut().zip(u.chunks_exact(d)) {
        *velocity = DVec3::new(u[0], u[1], u.get(2).copied().unwrap_or(0.0));
    }
    Ok(solved.iterations)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use tremie_cloud::{Dimension, nodes};
    use tremie_geometry::{Body, Shape};
    use tremie_numerics::DQuat;
    use tremie_rheology::FlowCurve;

    use super::*;

    /// div(2 mu E) in the midst of a lattice, by which the velocity changes in a step. Sums over neighbours stand for integrals: shear along the axes of a lattice meets too little of the
    /// viscosity (0.96 in a plane, 0.87 in space), shear at 45 degrees to them as much too much. Their mean is the viscosity.
    #[test]
    fn viscous_forces_are_those_of_the_stress() {
        for (dimension, spacing) in [(Dimension::Two, 0.025), (Dimension::Three, 0.05)] {
            let of = |angle: f64| share(dimension, spacing, DQuat::from_rotation_z(angle));
            let mean = 0.5 * (of(0.0) + of(0.25 * PI));
            assert!((mean - 1.0).abs() < 0.03, "{dimension:?}: {mean}");
        }
    }

    /// Share of the viscous force in the midst of a lattice that is turned.
    fn share(dimension: Dimension, spacing: f64, turn: DQuat) -> f64 {
        let body = Body::Shape(Shape::Box { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) });
        let positions: Vec<DVec3> = nodes(&body, spacing, dimension).iter().map(|at| turn * *at).collect();
        let around = Surroundings::new(&positions, spacing, dimension, &[]);
        let fluid = Fluid {
            density: 1000.0,
            curve: FlowCurve::Newtonian { viscosity: 3.0 },
            largest_viscosity: f64::INFINITY,
            gravity: DVec3::ZERO,
        };
        // Free of divergence: (y^2, x^2, 0).
        let viscosity: Vec<f64> = positions.iter().map(|at| 3.0 * (1.0 + 0.5 * at.x)).collect();
        let before: Vec<DVec3> =
            positions.iter().map(|at| DVec3::new(at.y * at.y, at.x * at.x, 0.0)).collect();
        let (mut after, step) = (before.clone(), 0.02);
        let solved = diffuse(&around, &fluid, &viscosity, |_| DVec3::ZERO, &mut after, step);
        assert!(solved.is_ok(), "{solved:?}");
        let (mut sum, mut whole) = (0.0, 0.0);
        for n in (0..positions.len()).filter(|n| positions[*n].abs().max_element() < 0.2) {
            let at = positions[n];
            // mu lap u + 2 E grad mu
            let exact = 6.0 * (1.0 + 0.5 * at.x) * DVec3::new(1.0, 1.0, 0.0)
                + DVec3::new(0.0, 3.0 * (at.x + at.y), 0.0);
            sum += exact.dot((after[n] - before[n]) * fluid.density / step);
            whole += exact.length_squared();
        }
        sum / whole
    }
}
