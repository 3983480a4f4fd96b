//! Nodes to begin with: a lattice of them in a body.
//!
//! Each stands for a square or a cube as wide as their spacing, and lies in its middle; it is there if that is in the body. The lattice begins at the lower corner
//! of the body's bounds, so that boxes of whole spacings are filled exactly.

use tremie_geometry::Body;
use tremie_numerics::DVec3;

use crate::Dimension;

/// Nodes in a body, `spacing` in m apart, x counting fastest; in a plane those of its section at `plane`, the y of all of them.
/// None in a body without bounds.
pub fn nodes(body: &Body, spacing: f64, dimension: Dimension, plane: f64) -> Vec<DVec3> {
    let (low, high) = body.bounds();
    let number = ((high - low) / spacing).ceil();
    if !number.is_finite() || number.min_element() < 0.0 {
        return Vec::new();
    }
    // Rounding must not make one more of a whole number.
    let [nx, ny, nz] = ((high - low) / spacing - 1e-9).ceil().max(DVec3::ZERO).to_array().map(|n| n as usize);
    let ny = if dimension == Dimension::Two { 1 } else { ny };
    let at = |n: usize| {
        let corner = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64);
        let place = low + spacing * (corner + 0.5);
        if dimension == Dimension::Two { place.with_y(plane) } else { place }
    };
    (0..nx * ny * nz).map(at).filter(|at| body.signed_distance(*at) < 0.0).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use tremie_geometry::Shape;

    use super::*;

    #[test]
    fn nodes_stand_for_the_volume() {
        let tank = Shape::Box { min: DVec3::new(-0.1, 0.2, 0.05), max: DVec3::new(0.2, 0.4, 0.15) };
        let tank = Body::Shape(tank);
        assert_eq!(nodes(&tank, 0.01, Dimension::Two, 0.3).len(), 30 * 10);
        assert!(nodes(&tank, 0.01, Dimension::Two, 0.3).iter().all(|at| at.y == 0.3));
        assert_eq!(nodes(&tank, 0.01, Dimension::Three, 0.0).len(), 30 * 20 * 10);
        let first = nodes(&tank, 0.01, Dimension::Three, 0.0)[0];
        assert!((first - DVec3::new(-0.095, 0.205, 0.055)).length() < 1e-12);
        // A sphere within what the squares at its surface may be wrong by at random.
        let ball = Body::Shape(Shape::Sphere { centre: DVec3::new(0.003, 0.0, 0.001), radius: 0.1 });
        let volume = nodes(&ball, 0.005, Dimension::Three, 0.0).len() as f64 * 0.005_f64.powi(3);
        assert!((volume / (4.0 / 3.0 * PI * 1e-3) - 1.0).abs() < 0.005, "{volume}");
        let plane = Shape::HalfSpace { point: DVec3::ZERO, normal: DVec3::Y };
        assert!(nodes(&Body::Shape(plane), 0.1, Dimension::Two, 0.0).is_empty());
    }
}
