//! Fibres in a beam: straight pieces, where they cross planes and facets, and how they lie there.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_numerics::DVec3;

/// A straight piece of a fibre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fibre {
    /// Both ends in m.
    pub ends: [DVec3; 2],
    /// Diameter in m.
    pub diameter: f64,
}

impl Fibre {
    /// Length in m.
    pub fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    /// Area of the cross-section in m2.
    pub fn section(&self) -> f64 {
        PI / 4.0 * self.diameter * self.diameter
    }

    /// What of it lies in a box.
    pub fn within(&self, low: DVec3, high: DVec3) -> Option<Self> {
        let [start, end] = self.ends;
        let way = end - start;
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for axis in 0..3 {
            let bounds = [(low[axis] - start[axis]) / way[axis], (high[axis] - start[axis]) / way[axis]];
            if way[axis] == 0.0 {
                if start[axis] < low[axis] || start[axis] > high[axis] {
                    return None;
                }
                continue;
            }
            from = from.max(bounds[0].min(bounds[1]));
            to = to.min(bounds[0].max(bounds[1]));
        }
        (from < to).then(|| Self { ends: [start + from * way, start + to * way], ..*self })
    }

    /// Where it crosses the plane x = `at` in m, if it does.
    pub fn crossing(&self, at: f64) -> Option<Crossing> {
        let [a, b] = self.ends;
        let part = (at - a.x) / (b.x - a.x);
        if !(part > 0.0 && part < 1.0) {
            return None;
        }
        let length = self.length();
        let angle = ((b.x - a.x).abs() / length).min(1.0).acos();
        Some(Crossing { point: a + part * (b - a), lengths: [part * length, (1.0 - part) * length], angle })
    }
}

/// Where and how a fibre crosses a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Where, in m.
    pub point: DVec3,
    /// Lengths in m on both sides.
    pub lengths: [f64; 2],
    /// Angle in rad between the fibre and the plane's normal.
    pub angle: f64,
}

/// Fibres through a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// Where it is along the beam, in m.
    pub at: f64,
    /// How many.
    pub fibres: usize,
    /// How many for each m2.
    pub density: f64,
    /// Mean angle to the beam's axis in rad; not a number if there are none.
    pub angle: f64,
}

/// Counts the fibres through the section x = `at`, from the height `above` on (both in m), of a beam of the given size in m.
pub fn count(fibres: &[Fibre], at: f64, above: f64, size: DVec3) -> Count {
    let angles: Vec<f64> = fibres
        .iter()
        .filter_map(|fibre| fibre.crossing(at))
        .filter(|crossing| crossing.point.z >= above)
        .map(|crossing| crossing.angle)
        .collect();
    let number = angles.len();
    let density = number as f64 / (size.y * (size.z - above));
    Count { at, fibres: number, density, angle: angles.iter().sum::<f64>() / number as f64 }
}

/// How fibres lie that are placed at random.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Orientation {
    /// In all directions alike.
    Random,
    /// Along the beam.
    Aligned,
    /// In all directions of planes along the beam and its width.
    Planar,
    /// With a density of exp(k c^2), c being the cosine of the angle to the beam's axis: k above zero turns them along it, below zero across.
    Concentrated(f64),
}

/// Fibres to be placed at random.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Length in m.
    pub length: f64,
    /// Diameter in m.
    pub diameter: f64,
    /// Share of the volume.
    pub share: f64,
    /// How they lie.
    pub orientation: Orientation,
}

impl Placement {
    /// Fibres of a beam of the given size in m that was sawn from something larger: what of each lies in it.
    pub fn sow(&self, size: DVec3, seed: u64) -> Vec<Fibre> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let around = DVec3::splat(0.5 * self.length);
        let box_of_centres = size + 2.0 * around;
        let section = PI / 4.0 * self.diameter * self.diameter;
        let number = (self.share * box_of_centres.element_product() / (section * self.length)).round();
        let mut fibres = Vec::new();
        for _ in 0..number as usize {
            let mut uniform = || random.random::<f64>();
            let centre = box_of_centres * DVec3::new(uniform(), uniform(), uniform()) - around;
            let half = 0.5 * self.length * self.orientation.draw(uniform);
            let fibre = Fibre { ends: [centre - half, centre + half], diameter: self.diameter };
            fibres.extend(fibre.within(DVec3::ZERO, size));
        }
        fibres
    }
}

impl Orientation {
    /// A unit vector.
    pub fn draw(self, mut uniform: impl FnMut() -> f64) -> DVec3 {
        let about = |cosine: f64, turn: f64| {
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            DVec3::new(cosine, sine * (2.0 * PI * turn).cos(), sine * (2.0 * PI * turn).sin())
        };
        match self {
            Self::Random => about(2.0 * uniform() - 1.0, uniform()),
            Self::Aligned => DVec3::X,
            Self::Planar => {
                let turn = 2.0 * PI * uniform();
                DVec3::new(turn.cos(), turn.sin(), 0.0)
            }
            Self::Concentrated(k) => {
                // Drawn and refused against the largest density.
                let most = k.max(0.0);
                loop {
                    let cosine = 2.0 * uniform() - 1.0;
                    if uniform() < (k * cosine * cosine - most).exp() {
                        return about(cosine, uniform());
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: DVec3 = DVec3::new(0.6, 0.15, 0.15);

    /// N = alpha V_f / A_f, alpha being the mean cosine: 1/2, 2/pi, 1.
    #[test]
    fn sections_are_crossed_as_often_as_orientation_says() {
        for (orientation, alpha) in
            [(Orientation::Random, 0.5), (Orientation::Planar, 2.0 / PI), (Orientation::Aligned, 1.0)]
        {
            let placement = Placement { length: 0.06, diameter: 0.75e-3, share: 0.005, orientation };
            let fibres = placement.sow(SIZE, 11);
            let sections = [0.05, 0.12, 0.2, 0.3, 0.41, 0.48, 0.55];
            let found: usize = sections.iter().map(|at| count(&fibres, *at, 0.0, SIZE).fibres).sum();
            let exact = 7.0 * alpha * 0.005 / fibres[0].section() * 0.0225;
            // The sections are a fibre apart and more, so that each counts for itself.
            let error = (found as f64 - exact) / exact.sqrt();
            assert!(error.abs() < 3.0, "{orientation:?}: {found}, {exact}");
        }
    }

    #[test]
    fn fibres_are_cut_at_the_faces_of_the_beam() {
        let fibre = Fibre { ends: [DVec3::new(-0.01, 0.1, 0.1), DVec3::new(0.03, 0.1, 0.1)], diameter: 1e-3 };
        let piece = fibre.within(DVec3::ZERO, SIZE).unwrap();
        assert!((piece.length() - 0.03).abs() < 1e-12 && piece.ends[0].x == 0.0);
        assert!(fibre.within(DVec3::new(0.0, 0.11, 0.0), SIZE).is_none());
        let crossing = piece.crossing(0.01).unwrap();
        assert!((crossing.lengths[0] - 0.01).abs() < 1e-12 && (crossing.lengths[1] - 0.02).abs() < 1e-12);
        assert_eq!(crossing.angle, 0.0);
        assert!(piece.crossing(0.04).is_none());
    }
}
