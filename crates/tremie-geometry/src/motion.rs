//! Motion: where a body is at a time. As a rule it is prescribed, whatever the fluid does; where forces decide, it is known a step at a time.

use tremie_numerics::DVec3;

/// How a body moves; without turning.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Always with the same velocity in m/s, from time zero on.
    Uniform(DVec3),
    /// Through a point, always with the same velocity in m/s, before it and after.
    Through(Waypoint, DVec3),
    /// From point to point, straight and evenly; at rest before the first and after the last. At least one point.
    Path(Vec<Waypoint>),
}

/// Where a body is at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Time in s.
    pub time: f64,
    /// Way in m from where the body is drawn.
    pub offset: DVec3,
}

impl Motion {
    /// No motion.
    pub const REST: Self = Self::Uniform(DVec3::ZERO);

    /// Way in m, at the time `time` in s, from where the body is drawn.
    pub fn offset(&self, time: f64) -> DVec3 {
        match self {
            Self::Uniform(velocity) => *velocity * time,
            Self::Through(point, velocity) => point.offset + (time - point.time) * *velocity,
            Self::Path(points) => {
                let next = points.partition_point(|point| point.time <= time);
                match (next.checked_sub(1).map(|n| points[n]), points.get(next)) {
                    (None, None) => DVec3::ZERO,
                    (None, Some(only)) => only.offset,
                    (Some(last), None) => last.offset,
                    (Some(from), Some(to)) => {
                        from.offset.lerp(to.offset, (time - from.time) / (to.time - from.time))
                    }
                }
            }
        }
    }

    /// Smallest axis-parallel box around all ways from the time `start` to the time `end` in s, as its two corners in m.
    pub fn range(&self, start: f64, end: f64) -> (DVec3, DVec3) {
        let (mut low, mut high) = (self.offset(start), self.offset(start));
        let mut visit = |offset: DVec3| (low, high) = (low.min(offset), high.max(offset));
        visit(self.offset(end));
        if let Self::Path(points) = self {
            points.iter().filter(|point| (start..=end).contains(&point.time)).for_each(|p| visit(p.offset));
        }
        (low, high)
    }

    /// Largest speed in m/s from the time `time` in s on.
    pub fn largest_speed(&self, time: f64) -> f64 {
        match self {
            Self::Uniform(velocity) | Self::Through(_, velocity) => velocity.length(),
            Self::Path(points) => points
                .windows(2)
                .filter(|ends| ends[1].time > time)
                .map(|ends| ends[0].offset.distance(ends[1].offset) / (ends[1].time - ends[0].time))
                .fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_followed() {
        let point = |time, x| Waypoint { time, offset: DVec3::new(x, 0.0, 0.0) };
        let path = Motion::Path(vec![point(1.0, 0.0), point(3.0, 0.4), point(4.0, 0.1)]);
        for (time, x) in [(0.0, 0.0), (1.0, 0.0), (2.0, 0.2), (3.0, 0.4), (3.5, 0.25), (4.0, 0.1), (9.0, 0.1)]
        {
            assert!((path.offset(time).x - x).abs() < 1e-12, "{time}");
        }
        assert!((path.largest_speed(0.0) - 0.3).abs() < 1e-12);
        assert_eq!(path.largest_speed(4.0), 0.0);
        let steady = Motion::Uniform(DVec3::new(0.0, 0.0, 0.15));
        assert_eq!((steady.offset(2.0).z, steady.largest_speed(7.0)), (0.3, 0.15));
        assert_eq!(Motion::REST.offset(5.0), DVec3::ZERO);
        let passing = Motion::Through(point(1.0, 0.5), DVec3::X);
        assert_eq!(
            (passing.offset(0.0).x, passing.offset(3.0).x, passing.largest_speed(9.0)),
            (-0.5, 2.5, 1.0)
        );
    }
}
