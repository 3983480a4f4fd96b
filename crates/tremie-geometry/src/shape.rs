//! Primitive shapes.

use tremie_numerics::{DVec2, DVec3};

use crate::ROUNDING;

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
    /// Cylinder with round ends: all points within a radius of a line between two points.
    Capsule {
        /// Where the line begins.
        start: DVec3,
        /// Where it ends.
        end: DVec3,
        /// Radius.
        radius: f64,
    },
    /// Cylinder with flat ends, such as a reinforcing bar.
    Bar {
        /// Centre of one end.
        start: DVec3,
        /// Centre of the other.
        end: DVec3,
        /// Radius.
        radius: f64,
    },
    /// Half of space, behind a plane.
    HalfSpace {
        /// A point of the plane.
        point: DVec3,
        /// Normal of the plane out of the half-space, of unit length.
        normal: DVec3,
    },
    /// Wall of a conical mould with a vertical axis, open at both ends.
    ConeShell {
        /// Centre of the lower end.
        base: DVec3,
        /// Inner radius at the lower end.
        base_radius: f64,
        /// Inner radius at the upper end.
        top_radius: f64,
        /// Height.
        height: f64,
        /// Thickness of the wall, measured horizontally.
        thickness: f64,
    },
}

impl Shape {
    /// Signed distance in metres from `p` to the surface, negative inside.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        self.nearest(p).0
    }

    /// Signed distance in metres from `p` to the surface, negative inside, and its gradient: the unit normal of the surface at its
    /// nearest point, out of the shape.
    pub fn nearest(&self, p: DVec3) -> (f64, DVec3) {
        match *self {
            Self::Box { min, max } => {
                let q = (min - p).max(p - max);
                let outside = q.max(DVec3::ZERO);
                let distance = outside.length() + q.max_element().min(0.0);
                // Inside, the nearest face.
                let away = if outside == DVec3::ZERO { DVec3::AXES[q.max_position()] } else { outside };
                let side =
                    DVec3::from([0, 1, 2].map(|a| if p[a] < 0.5 * (min + max)[a] { -1.0 } else { 1.0 }));
                (distance, (away * side).normalize())
            }
            Self::Sphere { centre, radius } => {
                let d = p - centre;
                (d.length() - radius, d.normalize_or(DVec3::Z))
            }
            Self::Cone { base, base_radius, top_radius, height } => {
                let corners = [
                    DVec2::ZERO,
                    DVec2::new(base_radius, 0.0),
                    DVec2::new(top_radius, height),
                    DVec2::new(0.0, height),
                ];
                turned(p - base, &corners, 3)
            }
            Self::Cylinder { point, axis, radius } => {
                let d = p - point;
                let across = d - axis * d.dot(axis);
                (across.length() - radius, across.normalize_or(axis.any_orthonormal_vector()))
            }
            Self::Capsule { start, end, radius } => {
                let along = end - start;
                let share = (p - start).dot(along) / along.length_squared();
                let d = p - start - if along == DVec3::ZERO { along } else { along * share.clamp(0.0, 1.0) };
                (d.length() - radius, d.normalize_or(DVec3::Z))
            }
            Self::Bar { start, end, radius } => {
                let axis = (end - start).normalize_or(DVec3::Z);
                let d = p - 0.5 * (start + end);
                let along = d.dot(axis);
                let across = d - axis * along;
                let beyond = DVec2::new(across.length() - radius, along.abs() - 0.5 * start.distance(end));
                let distance = beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0);
                // Inside, the nearest of side and ends.
                let away = match beyond.max(DVec2::ZERO) {
                    DVec2::ZERO if beyond.x >= beyond.y => DVec2::X,
                    DVec2::ZERO => DVec2::Y,
                    outside => outside.normalize(),
                };
                let side = across.normalize_or(axis.any_orthonormal_vector());
                (distance, side * away.x + axis * (away.y * along.signum()))
            }
            Self::HalfSpace { point, normal } => ((p - point).dot(normal), normal),
            Self::ConeShell { base, base_radius, top_radius, height, thickness } => {
                let corners = [
                    DVec2::new(base_radius, 0.0),
                    DVec2::new(base_radius + thickness, 0.0),
                    DVec2::new(top_radius + thickness, height),
                    DVec2::new(top_radius, height),
                ];
                turned(p - base, &corners, 4)
            }
        }
    }

    /// Smallest axis-parallel box around the shape, as its two corners; infinite along an infinite axis.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let upright = |base: DVec3, r: f64, height: f64| {
            (base - DVec3::new(r, r, 0.0), base + DVec3::new(r, r, height))
        };
        match *self {
            Self::Box { min, max } => (min, max),
            Self::Sphere { centre, radius } => (centre - radius, centre + radius),
            Self::Cone { base, base_radius, top_radius, height } => {
                upright(base, base_radius.max(top_radius), height)
            }
            Self::ConeShell { base, base_radius, top_radius, height, thickness } => {
                upright(base, base_radius.max(top_radius) + thickness, height)
            }
            Self::Cylinder { point, axis, radius } => {
                let reach = axis.to_array().map(|a| if a == 0.0 { radius } else { f64::INFINITY });
                (point - DVec3::from(reach), point + DVec3::from(reach))
            }
            Self::Capsule { start, end, radius } => (start.min(end) - radius, start.max(end) + radius),
            Self::Bar { start, end, radius } => {
                // How far a disc across the axis reaches along each direction.
                let axis = (end - start).normalize_or(DVec3::Z);
                let reach = radius * (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt);
                (start.min(end) - reach, start.max(end) + reach)
            }
            Self::HalfSpace { point, normal } => {
                // Bounded along an axis only if the plane is across it.
                let end = |axis: usize, sign: f64| {
                    if normal[axis] * sign == 1.0 { point[axis] } else { f64::INFINITY * sign }
                };
                let corner = |sign: f64| DVec3::new(end(0, sign), end(1, sign), end(2, sign));
                (corner(-1.0), corner(1.0))
            }
        }
    }

    /// Thickness in m where the shape is thinnest; infinite if it has no opposite side.
    pub fn thickness(&self) -> f64 {
        match *self {
            Self::Box { min, max } => (max - min).min_element(),
            Self::Sphere { radius, .. } | Self::Cylinder { radius, .. } | Self::Capsule { radius, .. } => {
                2.0 * radius
            }
            Self::Cone { base_radius, top_radius, height, .. } => {
                height.min(2.0 * base_radius.max(top_radius))
            }
            Self::Bar { start, end, radius } => start.distance(end).min(2.0 * radius),
            Self::HalfSpace { .. } => f64::INFINITY,
            Self::ConeShell { base_radius, top_radius, height, thickness, .. } => {
                // The wall leans.
                thickness * height / height.hypot(top_radius - base_radius)
            }
        }
    }

    /// Share of the cube of edge `size` around `centre` that lies inside, from 0 to 1.
    ///
    /// Exact for boxes. For other shapes cubes well inside or outside are told by the distance, and the rest are sampled
    /// at 10 x 10 x 10 points.
    pub fn fill(&self, centre: DVec3, size: f64) -> f64 {
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
        share(centre, size, |p| self.signed_distance(p))
    }
}

/// Share of 10 x 10 x 10 points in the cube of edge `size` around `centre` whose signed `distance` from a surface is negative; it must not be
/// further from zero than the true one.
pub fn share(centre: DVec3, size: f64, distance: impl Fn(DVec3) -> f64) -> f64 {
    // By twos along each axis: where the surface is further away than each of eight, one answer is for all.
    const PAIRS: usize = 5;
    let pair = size / PAIRS as f64;
    let far = 0.25 * 3f64.sqrt() * pair * (1.0 + 1e-9);
    let at = |k: usize| (k as f64 + 0.5) * pair - 0.5 * size;
    let mut number = 0usize;
    for n in 0..PAIRS * PAIRS * PAIRS {
        let middle = centre + DVec3::new(at(n % PAIRS), at(n / PAIRS % PAIRS), at(n / (PAIRS * PAIRS)));
        let side = distance(middle);
        if side.abs() > far {
            number += if side < 0.0 { 8 } else { 0 };
            continue;
        }
        for corner in 0..8 {
            let way = |bit: usize| if corner >> bit & 1 == 1 { 0.25 * pair } else { -0.25 * pair };
            number += usize::from(distance(middle + DVec3::new(way(0), way(1), way(2))) < 0.0);
        }
    }
    number as f64 / (8 * PAIRS * PAIRS * PAIRS) as f64
}

/// Signed distance and normal of a convex polygon turned around the vertical axis through zero; its corners (distance from the axis,
/// height) go round it counterclockwise, and only its first `edges` edges bound it (the axis does not).
fn turned(p: DVec3, corners: &[DVec2; 4], edges: usize) -> (f64, DVec3) {
    let flat = p.truncate();
    let point = DVec2::new(flat.length(), p.z);
    let (mut inside, mut least, mut nearest) = (true, f64::INFINITY, DVec2::ZERO);
    let mut outward = DVec2::X;
    for n in 0..edges {
        let (from, to) = (corners[n], corners[(n + 1) % 4]);
        let (edge, d) = (to - from, point - from);
        if edge == DVec2::ZERO {
            continue;
        }
        inside &= edge.perp_dot(d) >= 0.0;
        let away = d - edge * (d.dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        let square = away.length_squared();
        if square < least {
            (least, nearest, outward) = (square, away, -edge.perp().normalize());
        }
    }
    let distance = least.sqrt();
    let signed = if inside { -distance } else { distance };
    // On the surface itself what points away from it is rounding.
    let extent = corners.iter().fold(point.abs(), |extent, corner| extent.max(corner.abs()));
    let normal = if distance > ROUNDING * extent.max_element() { nearest / signed } else { outward };
    let radial = flat.normalize_or(DVec2::X);
    (signed, (radial * normal.x).extend(normal.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const EN_CONE: Shape = Shape::Cone { base: DVec3::ZERO, base_radius: 0.1, top_radius: 0.05, height: 0.3 };

    /// The mould around it, 4 mm thick.
    const EN_MOULD: Shape = Shape::ConeShell {
        base: DVec3::ZERO,
        base_radius: 0.1,
        top_radius: 0.05,
        height: 0.3,
        thickness: 0.004,
    };

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
            Shape::Capsule { start: DVec3::ZERO, end: DVec3::new(0.1, 0.2, 0.05), radius: 0.05 },
            Shape::HalfSpace { point: DVec3::new(0.1, 0.0, 0.0), normal: DVec3::new(0.6, 0.0, 0.8) },
            Shape::Bar { start: DVec3::ZERO, end: DVec3::new(0.1, 0.2, 0.05), radius: 0.05 },
            EN_MOULD,
        ];
        for shape in shapes {
            for p in [
                DVec3::new(0.3, 0.02, 0.11),
                DVec3::new(0.08, 0.013, 0.1),
                DVec3::new(0.02, -0.4, 0.5),
                DVec3::new(0.0, 0.0935, 0.05),
            ] {
                let h = 1e-6;
                let d = |v: DVec3| {
                    (shape.signed_distance(p + v * h) - shape.signed_distance(p - v * h)) / (2.0 * h)
                };
                let gradient = DVec3::new(d(DVec3::X), d(DVec3::Y), d(DVec3::Z));
                assert!((gradient.length() - 1.0).abs() < 1e-6, "{shape:?} at {p}: {gradient}");
                let (distance, normal) = shape.nearest(p);
                assert_eq!(distance, shape.signed_distance(p));
                assert!((gradient - normal).length() < 1e-6, "{shape:?} at {p}: {gradient} {normal}");
                let (min, max) = shape.bounds();
                let box_distance = (min - p).max(p - max).max_element();
                assert!(box_distance <= distance.max(0.0) + 1e-12, "{shape:?} at {p}");
            }
        }
        assert!((EN_CONE.signed_distance(DVec3::new(0.0, 0.0, 0.01)) + 0.01).abs() < 1e-15);
        assert!((EN_CONE.signed_distance(DVec3::new(0.0, 0.0, 0.35)) - 0.05).abs() < 1e-15);
    }

    #[test]
    fn a_bar_ends_flat() {
        let bar = Shape::Bar { start: DVec3::ZERO, end: DVec3::new(0.0, 0.0, 0.2), radius: 0.01 };
        for (p, distance, normal) in [
            (DVec3::new(0.03, 0.0, 0.1), 0.02, DVec3::X),
            (DVec3::new(0.0, 0.005, 0.25), 0.05, DVec3::Z),
            (DVec3::new(0.008, 0.0, 0.1), -0.002, DVec3::X),
            (DVec3::new(0.002, 0.0, 0.001), -0.001, DVec3::NEG_Z),
            (DVec3::new(0.0, -0.04, -0.04), 0.05, DVec3::new(0.0, -0.6, -0.8)),
        ] {
            let (found, away) = bar.nearest(p);
            assert!(
                (found - distance).abs() < 1e-15 && (away - normal).length() < 1e-12,
                "{p}: {found} {away}"
            );
        }
        assert_eq!(bar.bounds(), (DVec3::new(-0.01, -0.01, 0.0), DVec3::new(0.01, 0.01, 0.2)));
        // Leaning: the rim of an end reaches beyond its centre by the radius times the cosine of the slope.
        let leaning = Shape::Bar { start: DVec3::ZERO, end: DVec3::new(0.3, 0.0, 0.4), radius: 0.01 };
        assert!((leaning.bounds().1 - DVec3::new(0.308, 0.01, 0.406)).length() < 1e-12);
    }

    #[test]
    fn on_its_surface_a_cone_has_the_normal_of_its_side() {
        // 50 mm wider at the foot than 300 mm above it.
        let slope = DVec2::new(0.3, 0.05).normalize();
        for n in 1..1000 {
            let part = |root: f64| (f64::from(n) * root).fract();
            let (height, angle) = (0.3 * (0.01 + 0.98 * part(0.819_172_5)), 2.0 * PI * part(0.671_043_6));
            let radial = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let on = radial * (0.1 - height / 6.0) + DVec3::Z * height;
            let outward = radial * slope.x + DVec3::Z * slope.y;
            for (shape, exact) in [(EN_CONE, outward), (EN_MOULD, -outward)] {
                let (distance, normal) = shape.nearest(on);
                assert!(distance.abs() < 1e-15 && (normal - exact).length() < 1e-9, "{on}: {normal}");
            }
        }
    }

    #[test]
    fn the_mould_encloses_the_cone() {
        // Inside, the mould's surface is that of the cone; beyond its wall there is air again.
        for p in [DVec3::new(0.02, 0.01, 0.1), DVec3::new(-0.05, 0.04, 0.02)] {
            let (cone, mould) = (EN_CONE.nearest(p), EN_MOULD.nearest(p));
            let r = p.truncate().length();
            let slant = (0.1 - p.z / 6.0 - r) / 1f64.hypot(1.0 / 6.0);
            assert!((mould.0 - slant).abs() < 1e-12 && cone.0 < 0.0);
            // Its normal points at the axis, and a little downwards.
            assert!(mould.1.dot(p) < 0.0 && (mould.1.z + mould.1.truncate().length() / 6.0).abs() < 1e-12);
        }
        assert!(EN_MOULD.signed_distance(DVec3::new(0.102, 0.0, 0.001)) < 0.0);
        assert!(EN_MOULD.signed_distance(DVec3::new(0.105, 0.0, 0.001)) > 0.0);
        assert!((EN_MOULD.thickness() - 0.004 / 1f64.hypot(1.0 / 6.0)).abs() < 1e-15);
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
