//! How far bodies are from each other, and where.
//!
//! Spheres and fibres are capsules: the points nearest to a segment (or a point). Segments are nearest in closed form (Ericson 2005,
//! *Real-Time Collision Detection*, 5.1.9). Between ellipsoids the distance is the largest gap that any direction n sees,
//!
//! s(n) = n . (c_q - c_p) - h_p(n) - h_q(-n), with the support function h(n) = sqrt(n . S n) + r,
//!
//! found by Newton's method on the sphere of directions. It is right for bodies that overlap, too: then it is minus the least way to
//! part them. Distance from an ellipsoid is convex along a fibre, so the nearest point there is the root of a monotone function.

use tremie_numerics::{DMat3, DQuat, DVec3};

use crate::{Form, Inclusions};

/// A body's surface.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outline {
    /// Centre in m.
    pub(crate) centre: DVec3,
    /// From the centre to the end of a fibre's segment in m; zero for other bodies.
    pub(crate) half: DVec3,
    /// Distance in m of the surface from the segment, or from the centre.
    pub(crate) radius: f64,
    /// Least diameter in m: what overlaps are measured by.
    pub(crate) thickness: f64,
    /// Of an ellipsoid, the matrix with its axes and its squared half-axes; then the radius is 0.
    pub(crate) ellipsoid: Option<Box<DMat3>>,
}

impl Outline {
    /// Of a body.
    pub(crate) fn of(bodies: &Inclusions, n: usize) -> Self {
        Self::new(bodies.form(n), bodies.position[n], bodies.orientation[n])
    }

    /// Of a form at a place.
    pub(crate) fn new(form: &Form, centre: DVec3, orientation: DQuat) -> Self {
        let ball = DVec3::ZERO;
        match *form {
            Form::Sphere { diameter } => {
                Self { centre, half: ball, radius: 0.5 * diameter, thickness: diameter, ellipsoid: None }
            }
            Form::Fibre { length, diameter } => {
                let half = 0.5 * length * (orientation * DVec3::Z);
                Self { centre, half, radius: 0.5 * diameter, thickness: diameter, ellipsoid: None }
            }
            Form::Ellipsoid { half_axes } => {
                let turn = DMat3::from_quat(orientation);
                let square = turn * DMat3::from_diagonal(half_axes * half_axes) * turn.transpose();
                let thickness = 2.0 * half_axes.min_element();
                Self { centre, half: ball, radius: 0.0, thickness, ellipsoid: Some(Box::new(square)) }
            }
        }
    }

    /// Whether it is a sphere.
    pub(crate) fn is_sphere(&self) -> bool {
        self.half == DVec3::ZERO && self.ellipsoid.is_none()
    }

    /// Radius in m of a sphere about the centre that holds the body.
    pub(crate) fn reach(&self) -> f64 {
        // The trace bounds the largest eigenvalue.
        let ellipsoid =
            self.ellipsoid.as_ref().map_or(0.0, |s| (s.x_axis.x + s.y_axis.y + s.z_axis.z).max(0.0).sqrt());
        self.half.length() + self.radius + ellipsoid
    }

    /// How fast in m/s the body may come nearer to others by turning: neither a ball nor a fibre that turns about its axis does.
    pub(crate) fn turns(&self, angular_velocity: DVec3) -> f64 {
        let ellipsoid = if self.ellipsoid.is_some() { self.reach() } else { 0.0 };
        angular_velocity.cross(self.half).length() + ellipsoid * angular_velocity.length()
    }

    /// Point of the surface furthest along n, from the centre; for bodies that are not fibres.
    pub(crate) fn furthest(&self, n: DVec3) -> DVec3 {
        let ball = self.radius * n;
        self.ellipsoid.as_ref().map_or(ball, |s| {
            let way = **s * n;
            ball + way / n.dot(way).max(f64::MIN_POSITIVE).sqrt()
        })
    }

    /// How far in m it reaches from its centre along the unit vector n: the support function.
    pub(crate) fn extent(&self, n: DVec3) -> f64 {
        let ellipsoid = self.ellipsoid.as_ref().map_or(0.0, |s| n.dot(**s * n).max(0.0).sqrt());
        self.half.dot(n).abs() + self.radius + ellipsoid
    }

    /// Second derivative of the support function: the radii of curvature where the normal is n.
    fn curvature_radii(&self, n: DVec3) -> DMat3 {
        let ball = self.radius * (DMat3::IDENTITY - outer(n, n));
        self.ellipsoid.as_ref().map_or(ball, |s| {
            let way = **s * n;
            let square = n.dot(way).max(f64::MIN_POSITIVE);
            ball + (**s - outer(way, way) * square.recip()) * square.sqrt().recip()
        })
    }
}

/// The matrix a bᵀ.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Where two bodies are nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gap {
    /// Distance in m, negative where they overlap.
    pub(crate) distance: f64,
    /// Unit normal from the first to the second.
    pub(crate) normal: DVec3,
    /// Point halfway between the two surfaces, from the first body's centre.
    pub(crate) at: DVec3,
}

/// Between two bodies whose centres are `way` apart.
pub(crate) fn gap(p: &Outline, q: &Outline, way: DVec3) -> Gap {
    match (&p.ellipsoid, &q.ellipsoid) {
        (None, None) => {
            let (s, t) = nearest_of_segments(p.half, q.half, way);
            between_balls(p, q, s * p.half, way + t * q.half)
        }
        _ if q.half != DVec3::ZERO => beside_ellipsoid(p, q, way),
        _ if p.half != DVec3::ZERO => {
            let found = beside_ellipsoid(q, p, -way);
            Gap { distance: found.distance, normal: -found.normal, at: found.at + way }
        }
        _ => smooth(p, q, way, way.try_normalize().unwrap_or(DVec3::Z)),
    }
}

/// Between balls on the bodies' segments, at places from the first body's centre.
fn between_balls(p: &Outline, q: &Outline, at_p: DVec3, at_q: DVec3) -> Gap {
    let way = at_q - at_p;
    let length = way.length();
    let normal = if length > 0.0 {
        way / length
    } else {
        // Axes that cross, or centres that coincide: any way out is as good as another.
        let beside = p.half.try_normalize().map_or(DVec3::Z, |axis| axis.any_orthonormal_vector());
        p.half.cross(q.half).try_normalize().unwrap_or(beside)
    };
    let distance = length - p.radius - q.radius;
    Gap { distance, normal, at: at_p + (p.radius + 0.5 * distance) * normal }
}

/// The nearest points s a and way + t b of two segments, s and t from -1 to 1.
pub(crate) fn nearest_of_segments(a: DVec3, b: DVec3, way: DVec3) -> (f64, f64) {
    let (aa, bb, ab) = (a.dot(a), b.dot(b), a.dot(b));
    let (wa, wb) = (way.dot(a), way.dot(b));
    if bb == 0.0 {
        return (if aa == 0.0 { 0.0 } else { (wa / aa).clamp(-1.0, 1.0) }, 0.0);
    }
    if aa == 0.0 {
        return (0.0, (-wb / bb).clamp(-1.0, 1.0));
    }
    // aa bb - ab^2 as it does not cancel where the segments are nearly parallel.
    let sine = a.cross(b).length_squared();
    let s = if sine > 1e-20 * aa * bb {
        ((wa * bb - ab * wb) / sine).clamp(-1.0, 1.0)
    } else {
        // Parallel: the middle of where they lie side by side.
        let (low, high) = ((wa - ab.abs()) / aa, (wa + ab.abs()) / aa);
        0.5 * (low.clamp(-1.0, 1.0) + high.clamp(-1.0, 1.0))
    };
    let t = ((ab * s - wb) / bb).clamp(-1.0, 1.0);
    (((wa + t * ab) / aa).clamp(-1.0, 1.0), t)
}

/// Between an ellipsoid p and a fibre q.
fn beside_ellipsoid(p: &Outline, q: &Outline, way: DVec3) -> Gap {
    let ball = |t: f64, start: DVec3| {
        let point = Outline { half: DVec3::ZERO, ..q.clone() };
        smooth(p, &point, way + t * q.half, start)
    };
    // The slope of the distance along the fibre at t; the false position's root (Illinois' variant) is where it changes its sign.
    let slope = |found: &Gap| found.normal.dot(q.half);
    let start = way.try_normalize().unwrap_or(DVec3::Z);
    let (mut low, mut high) = (-1.0, 1.0);
    let mut best = ball(low, start);
    let mut at_low = slope(&best);
    if at_low >= 0.0 {
        return best;
    }
    best = ball(high, start);
    let mut at_high = slope(&best);
    if at_high <= 0.0 {
        return best;
    }
    for _ in 0..60 {
        let middle = (low * at_high - high * at_low) / (at_high - at_low);
        best = ball(middle, best.normal);
        let here = slope(&best);
        if here.abs() <= 1e-12 * q.half.length() || high - low < 1e-10 {
            break;
        }
        if here < 0.0 {
            (low, at_low, at_high) = (middle, here, 0.5 * at_high);
        } else {
            (high, at_high, at_low) = (middle, here, 0.5 * at_low);
        }
    }
    best
}

/// Between ellipsoids or spheres: Newton's method for the direction that sees the largest gap.
fn smooth(p: &Outline, q: &Outline, way: DVec3, start: DVec3) -> Gap {
    let seen = |n: DVec3| {
        let (on_p, on_q) = (p.furthest(n), way + q.furthest(-n));
        (n.dot(on_q - on_p), on_p, on_q)
    };
    let mut normal = start;
    let (mut distance, mut on_p, mut on_q) = seen(normal);
    let size = way.length() + distance.abs() + f64::MIN_POSITIVE;
    for _ in 0..60 {
        let gradient = on_q - on_p - distance * normal;
        if gradient.length() <= 1e-13 * size {
            break;
        }
        let (t1, t2) = normal.any_orthonormal_pair();
        let radii = p.curvature_radii(normal) + q.curvature_radii(normal);
        let (r1, r2) = (radii * t1, radii * t2);
        let (a, b, d) = (t1.dot(r1) + distance, t1.dot(r2), t2.dot(r2) + distance);
        let (g1, g2) = (gradient.dot(t1), gradient.dot(t2));
        let determinant = a * d - b * b;
        let turn = if a > 0.0 && determinant > 0.0 {
            ((d * g1 - b * g2) * t1 + (a * g2 - b * g1) * t2) / determinant
        } else {
            gradient / size
        };
        // No further than half a right angle at once, and never to where the gap is smaller, as far as rounding lets it be seen.
        let mut step = turn.clamp_length_max(1.0);
        if gradient.dot(step) < 1e-14 * size {
            normal = (normal + step).normalize();
            (distance, on_p, on_q) = seen(normal);
            break;
        }
        let mut better = false;
        for _ in 0..40 {
            let next = (normal + step).normalize();
            let there = seen(next);
            if there.0 > distance {
                (normal, (distance, on_p, on_q), better) = (next, there, true);
                break;
            }
            step *= 0.5;
        }
        if !better {
            break;
        }
    }
    Gap { distance, normal, at: 0.5 * (on_p + on_q) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn vector(random: &mut Pcg64Mcg) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)))
    }

    fn segment(centre: DVec3, half: DVec3) -> Outline {
        Outline { centre, half, radius: 0.0, thickness: 0.0, ellipsoid: None }
    }

    fn ellipsoid(half_axes: DVec3, turn: DQuat) -> Outline {
        let turn = DMat3::from_quat(turn);
        let square = turn * DMat3::from_diagonal(half_axes * half_axes) * turn.transpose();
        Outline { ellipsoid: Some(Box::new(square)), ..segment(DVec3::ZERO, DVec3::ZERO) }
    }

    /// Nothing on a fine net of both segments is nearer, and the normal is the way between the nearest points.
    #[test]
    fn segments_are_nearest_where_a_search_finds_them() {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        for round in 0..2000 {
            let (a, mut b, way) = (vector(&mut random), vector(&mut random), vector(&mut random));
            if round % 3 == 0 {
                // Parallel, or nearly.
                b = a * random.random_range(-1.0..1.0) + 1e-9 * f64::from(round % 2) * b;
            }
            let (p, q) = (segment(DVec3::ZERO, a), segment(way, b));
            let found = gap(&p, &q, way);
            let mut least = f64::INFINITY;
            for i in 0..=40 {
                for k in 0..=40 {
                    let (s, t) = (f64::from(i) / 20.0 - 1.0, f64::from(k) / 20.0 - 1.0);
                    least = least.min((way + t * b - s * a).length());
                }
            }
            assert!(found.distance <= least + 1e-12, "{round}: {} {least}", found.distance);
            assert!(found.distance >= least - 0.1, "{round}: {} {least}", found.distance);
            let back = gap(&q, &p, -way);
            assert!((back.distance - found.distance).abs() < 1e-12);
        }
    }

    #[test]
    fn ellipsoids_of_equal_axes_are_spheres() {
        let mut random = Pcg64Mcg::seed_from_u64(2);
        for _ in 0..200 {
            let way = vector(&mut random);
            let ball = |radius| Outline { radius, ..segment(DVec3::ZERO, DVec3::ZERO) };
            let p = ellipsoid(DVec3::splat(0.3), DQuat::IDENTITY);
            let q = ellipsoid(DVec3::splat(0.4), DQuat::IDENTITY);
            let (one, two) = (gap(&p, &q, way), gap(&ball(0.3), &ball(0.4), way));
            assert!((one.distance - two.distance).abs() < 1e-12);
            assert!((one.normal - two.normal).length() < 1e-7);
            assert!((one.at - two.at).length() < 1e-7);
        }
    }

    /// Two ellipsoids that touch where they were put to: the second hangs at a point of the first by the point with the opposite
    /// normal, moved off by a known gap, or in.
    #[test]
    fn ellipsoids_find_the_gap_that_they_were_given() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        for _ in 0..500 {
            let half_axes = |random: &mut Pcg64Mcg| DVec3::splat(0.6) + 0.4 * vector(random);
            let turn = |random: &mut Pcg64Mcg| DQuat::from_scaled_axis(3.0 * vector(random));
            let (p, q) = (
                ellipsoid(half_axes(&mut random), turn(&mut random)),
                ellipsoid(half_axes(&mut random), turn(&mut random)),
            );
            let normal = vector(&mut random).normalize();
            let given = random.random_range(-0.02..0.5);
            let way = p.furthest(normal) - q.furthest(-normal) + given * normal;
            let found = gap(&p, &q, way);
            assert!((found.distance - given).abs() < 1e-10, "{} {given}", found.distance);
            assert!((found.normal - normal).length() < 1e-5);
            // A fibre that touches with its end, along the normal, and one that touches with its side.
            let fibre = |half| Outline { radius: 0.1, ..segment(DVec3::ZERO, half) };
            let touch = p.furthest(normal) + (0.1 + given) * normal;
            let end = gap(&p, &fibre(0.7 * normal), touch + 0.7 * normal);
            assert!((end.distance - given).abs() < 1e-10);
            let side = 0.7 * normal.any_orthonormal_vector();
            let found = gap(&p, &fibre(side), touch + 0.4 * side);
            assert!((found.distance - given).abs() < 1e-10);
            let back = gap(&fibre(side), &p, -(touch + 0.4 * side));
            assert!((back.normal + found.normal).length() < 1e-9 && (back.distance - given).abs() < 1e-10);
        }
    }
}
