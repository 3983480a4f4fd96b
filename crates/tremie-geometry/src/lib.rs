//! Shapes by signed distance: where fluid starts, and later where solids stand and how they move.
//!
//! A [`Shape`] answers one question, [`Shape::signed_distance`] (metres, negative inside); everything else about
//! it follows from that. [`isosurface`] goes the other way: from values on a grid to the surface they describe.

pub mod isosurface;

use tremie_numerics::DVec3;

/// A closed region of space, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Axis-parallel box between two corners.
    Box {
        /// Corner with the smallest coordinates.
        min: DVec3,
        /// Corner with the largest coordinates.
        max: DVec3,
    },
    /// Sphere.
    Sphere {
        /// Centre.
        centre: DVec3,
        /// Radius.
        radius: f64,
    },
    /// Frustum of a cone with a vertical axis (the mould of the slump test is one); a cylinder if both radii agree.
    Cone {
        /// Centre of the lower face.
        base: DVec3,
        /// Radius of the lower face.
        base_radius: f64,
        /// Radius of the upper face.
        top_radius: f64,
        /// Height.
        height: f64,
    },
    /// Infinitely long cylinder.
    Cylinder {
        /// A point on the axis.
        point: DVec3,
        /// Direction of the axis, of unit length.
        axis: DVec3,
        /// Radius.
        radius: f64,
    },
}

impl Shape {
    /// Signed distance in metres from `p` to the surface, negative inside.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        match *self {
            Self::Box { min, max } => {
                let q = (min - p).max(p - max);
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Self::Sphere { centre, radius } => p.distance(centre) - radius,
            Self::Cone { base, base_radius, top_radius, height } => {
                let d = p - base;
                frustum_distance(d.truncate().length(), d.z, base_radius, top_radius, height)
            }
            Self::Cylinder { point, axis, radius } => {
                let d = p - point;
                (d - axis * d.dot(axis)).length() - radius
            }
        }
    }

    /// Smallest axis-parallel box around the shape, as its two corners; infinite along an infinite axis.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        match *self {
            Self::Box { min, max } => (min, max),
            Self::Sphere { centre, radius } => (centre - radius, centre + radius),
            Self::Cone { base, base_radius, top_radius, height } => {
                let r = base_radius.max(top_radius);
                (base - DVec3::new(r, r, 0.0), base + DVec3::new(r, r, height))
            }
            Self::Cylinder { point, axis, radius } => {
                let reach = axis.to_array().map(|a| if a == 0.0 { radius } else { f64::INFINITY });
                (point - DVec3::from(reach), point + DVec3::from(reach))
            }
        }
    }

    /// Share of the cube of edge `size` around `centre` that lies inside, from 0 to 1.
    ///
    /// Exact for boxes. For other shapes cubes well inside or outside are told by the distance, and the rest are sampled
    /// at 10 x 10 x 10 points.
    pub fn fill(&self, centre: DVec3, size: f64) -> f64 {
        const SAMPLES: usize = 10;
        if let Self::Box { min, max } = *self {
            let overlap = (centre + 0.5 * size).min(max) - (centre - 0.5 * size).max(min);
            // Faces between cells are meant to be there: rounding must not leave a sliver.
            let share = (overlap / size).clamp(DVec3::ZERO, DVec3::ONE).to_array();
            let share = share.map(|s| (s * 1e9).round() / 1e9);
            return share[0] * share[1] * share[2];
        }
        let distance = self.signed_distance(centre);
        let half_diagonal = 0.5 * 3f64.sqrt() * size;
        if distance <= -half_diagonal {
            return 1.0;
        }
        if distance >= half_diagonal {
            return 0.0;
        }
        let at = |k: usize| ((k as f64 + 0.5) / SAMPLES as f64 - 0.5) * size;
        let mut inside = 0usize;
        for k in 0..SAMPLES {
            for j in 0..SAMPLES {
                for i in 0..SAMPLES {
                    let p = centre + DVec3::new(at(i), at(j), at(k));
                    inside += usize::from(self.signed_distance(p) < 0.0);
                }
            }
        }
        inside as f64 / (SAMPLES * SAMPLES * SAMPLES) as f64
    }
}

/// Signed distance in the meridian plane of a frustum: `r` from the axis, `z` above the lower face.
fn frustum_distance(r: f64, z: f64, base_radius: f64, top_radius: f64, height: f64) -> f64 {
    // Nearest point on each of the three edges of the (half) trapezium.
    let lower = (r - r.min(base_radius)).hypot(z);
    let upper = (r - r.min(top_radius)).hypot(z - height);
    let (dr, dz) = (top_radius - base_radius, height);
    let t = (((r - base_radius) * dr + z * dz) / (dr * dr + dz * dz)).clamp(0.0, 1.0);
    let side = (r - base_radius - t * dr).hypot(z - t * dz);
    let distance = lower.min(upper).min(side);
    let inside = z > 0.0 && z < height && r < base_radius + dr * z / height;
    if inside { -distance } else { distance }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const EN_CONE: Shape = Shape::Cone { base: DVec3::ZERO, base_radius: 0.1, top_radius: 0.05, height: 0.3 };

    fn volume_by_cells(shape: Shape, min: DVec3, n: [usize; 3], size: f64) -> f64 {
        let mut sum = 0.0;
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let centre = min + size * (DVec3::new(i as f64, j as f64, k as f64) + 0.5);
                    sum += shape.fill(centre, size);
                }
            }
        }
        sum * size.powi(3)
    }

    #[test]
    fn slump_cone_holds_five_and_a_half_litres() {
        // V = pi h / 3 (R^2 + R r + r^2) = 5.498 L, EN 12350-2.
        let volume = volume_by_cells(EN_CONE, DVec3::new(-0.11, -0.11, -0.01), [22, 22, 32], 0.01);
        let exact = PI * 0.3 / 3.0 * (0.01 + 0.005 + 0.0025);
        assert!((volume / exact - 1.0).abs() < 1e-3, "{volume} against {exact}");
    }

    #[test]
    fn distances_are_distances() {
        // The gradient of a signed distance has unit length away from its ridges.
        let shapes = [
            EN_CONE,
            Shape::Box { min: DVec3::new(-0.1, -0.2, 0.0), max: DVec3::new(0.1, 0.1, 0.3) },
            Shape::Sphere { centre: DVec3::new(0.01, 0.0, 0.1), radius: 0.07 },
            Shape::Cylinder { point: DVec3::ZERO, axis: DVec3::Y, radius: 0.05 },
        ];
        for shape in shapes {
            for p in [DVec3::new(0.3, 0.02, 0.11), DVec3::new(0.08, 0.013, 0.1), DVec3::new(0.02, -0.4, 0.5)]
            {
                let h = 1e-6;
                let d = |v: DVec3| {
                    (shape.signed_distance(p + v * h) - shape.signed_distance(p - v * h)) / (2.0 * h)
                };
                let gradient = DVec3::new(d(DVec3::X), d(DVec3::Y), d(DVec3::Z)).length();
                assert!((gradient - 1.0).abs() < 1e-6, "{shape:?} at {p}: {gradient}");
            }
        }
        assert!((EN_CONE.signed_distance(DVec3::new(0.0, 0.0, 0.01)) + 0.01).abs() < 1e-15);
        assert!((EN_CONE.signed_distance(DVec3::new(0.0, 0.0, 0.35)) - 0.05).abs() < 1e-15);
    }

    #[test]
    fn a_box_fills_cells_exactly() {
        let shape = Shape::Box { min: DVec3::splat(-1.0), max: DVec3::new(1.0, 0.25, 0.037) };
        assert!((shape.fill(DVec3::new(0.0, 0.25, 0.05), 0.1) - 0.5 * 0.37).abs() < 1e-9);
        assert_eq!(shape.fill(DVec3::new(0.0, 0.25 + 0.05, 0.0), 0.1), 0.0);
        assert_eq!(shape.fill(DVec3::new(0.0, 0.2, 0.0) - 0.05, 0.1), 1.0);
    }

    #[test]
    fn half_a_cell_is_half_full() {
        let shape = Shape::Box { min: DVec3::splat(-1.0), max: DVec3::new(1.0, 1.0, 0.0) };
        assert!((shape.fill(DVec3::ZERO, 0.1) - 0.5).abs() < 1e-12);
        assert_eq!(shape.fill(DVec3::new(0.0, 0.0, -0.2), 0.1), 1.0);
        assert_eq!(shape.fill(DVec3::new(0.0, 0.0, 0.2), 0.1), 0.0);
    }
}
