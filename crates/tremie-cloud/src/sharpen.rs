//! Velocity gradients without what neighbours smear.
//!
//! A gradient by neighbours of the weights g is that of a mean around, `L + c lap L` with `c = (sum g r^4)/(sum g r^2)/(2 (d + 2))` in d dimensions. Beside a plug that makes it flow: by what a particle sees of the shear next to it, it has
//! yielded, and so drives the one behind it. The mean of such gradients by the weights g r^2 is off by `c (d + 2)/d` more, so that
//!
//! ```text
//!     L + d/(d + 2) (L - mean L)
//! ```
//!
//! is right up to the fourth derivatives of L. Near the surface, where the mean would be one-sided, gradients stay as they are.

use tremie_numerics::DMat3;

use crate::Surroundings;

/// The gradients `found` sharpened, of particles of which some are at the `surface`: by numbers and weights g r^2 of neighbours of each, images among them, and the gradient that a particle sees at one of them.
pub fn sharpened<I: Iterator<Item = (usize, f64)>>(
    around: &Surroundings,
    surface: &[bool],
    found: &[DMat3],
    neighbours: impl Fn(usize) -> I + Sync + Send,
    seen: impl Fn(usize, usize) -> DMat3 + Sync + Send,
) -> Vec<DMat3> {
    let d = around.dimension.number() as f64;
    around.each(|a| {
        let (mut sum, mut whole) = (DMat3::ZERO, 0.0);
        for (n, weight) in neighbours(a) {
            if surface[around.of(n)] {
                return found[a];
            }
            sum += weight * seen(a, n);
            whole += weight;
        }
        match whole > 0.0 && !surface[a] {
            true => found[a] + d / (d + 2.0) * (found[a] - sum * (1.0 / whole)),
            false => found[a],
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dimension, Space, nodes};
    use tremie_geometry::{Body, Shape};
    use tremie_numerics::DVec3;

    /// The gradient of sin(k z) along x in the midst of a lattice, 12 nodes to a wave: less than a fifth of what is missing is left.
    #[test]
    fn waves_are_told_sharply() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let spacing = 1.0 / 18.0;
            let body = Body::Shape(Shape::Box { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) });
            let positions = nodes(&body, spacing, dimension, 0.0);
            let around = Surroundings::new(&positions, &Space::free(dimension, spacing), 0.0, 1.0);
            let gradients = around.gradients();
            let wave = std::f64::consts::TAU / (12.0 * spacing);
            let velocities: Vec<DVec3> = positions.iter().map(|at| (wave * at.z).sin() * DVec3::X).collect();
            let found = around.each(|a| gradients.velocity_gradient(a, &velocities));
            let sharp = sharpened(
                &around,
                &around.surface(&gradients),
                &found,
                |a| gradients.extents(a),
                |_, n| found[n],
            );
            let missing = |of: &[DMat3]| {
                let inner = (0..of.len()).filter(|n| positions[*n].abs().max_element() < 0.2);
                inner
                    .map(|n| (of[n].z_axis.x - wave * (wave * positions[n].z).cos()).abs())
                    .fold(0.0, f64::max)
            };
            assert!(missing(&found) > 0.05 * wave, "{dimension:?}: {}", missing(&found) / wave);
            assert!(
                missing(&sharp) < 0.2 * missing(&found),
                "{dimension:?}: {}",
                missing(&sharp) / missing(&found)
            );
        }
    }
}
