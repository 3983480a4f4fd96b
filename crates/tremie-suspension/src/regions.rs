//! How bodies move against those around them.
//!
//! In a flow that carries all bodies along, each moves far but hardly past its neighbours. Space is cut into regions, so wide that bodies that may
//! meet before the regions are made anew are in the same or in neighbouring ones. What moves bodies of a region against those around
//! it is then at most the diagonal of the box that holds all of their motions, and twice the fastest turn among them. That is known region by region:
//! what falls out of a hose does not make bodies watch out that lie at the other end of the form.

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::Periods;
use crate::distance::Outline;
use crate::neighbours::CHUNK;

/// Bodies by where they are.
#[derive(Debug, Clone, Default)]
pub(crate) struct Regions {
    /// Lower corner of the first region, and size of all, in m.
    low: DVec3,
    width: DVec3,
    /// Number of regions along each axis.
    number: [usize; 3],
    around: [bool; 3],
    /// The region of each body.
    pub(crate) homes: Vec<u32>,
    /// Where the bodies of each region start.
    starts: Vec<u32>,
    bodies: Vec<u32>,
    /// How far in m bodies may move until regions must be made anew.
    pub(crate) allowed: f64,
}

/// A box of vectors, and the largest of the numbers that come with them.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    most: f64,
}

impl Bounds {
    const NONE: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY, most: 0.0 };

    fn and(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            most: self.most.max(other.most),
        }
    }

    fn against_each_other(self) -> f64 {
        if self.low.x > self.high.x { 0.0 } else { (self.high - self.low).length() + 2.0 * self.most }
    }
}

impl Regions {
    /// For bodies that meet when their surfaces are nearer than `skin`, and that may move by `allowed` at least until regions must be made anew, both in m.
    pub(crate) fn new(outlines: &[Outline], periods: &Periods, skin: f64, allowed: f64) -> Self {
        let reach = outlines.iter().map(Outline::reach).fold(0.0, f64::max);
        let low = outlines.iter().fold(DVec3::INFINITY, |low, outline| low.min(outline.centre));
        let high = outlines.iter().fold(DVec3::NEG_INFINITY, |high, outline| high.max(outline.centre));
        let extent = [0, 1, 2].map(|a| periods.0[a].unwrap_or(high[a] - low[a]).max(0.0));
        // Both move as far as is allowed.
        let mut allowed = allowed;
        let count = |size: f64, a: usize| match periods.0[a] {
            Some(period) => (period / size).floor().max(1.0),
            // Bodies of a run that breaks down may be anywhere.
            None => (extent[a] / size).floor().max(0.0) + 1.0,
        };
        let size = |allowed: f64| 2.0 * reach + skin + 2.0 * allowed;
        let all = |size: f64| (0..3).map(|a| count(size, a)).product::<f64>();
        // No more regions than bodies.
        while all(size(allowed)) > outlines.len().max(1) as f64 {
            allowed = 1.25 * allowed + 0.1 * size(allowed);
        }
        let number = [0, 1, 2].map(|a| count(size(allowed), a) as usize);
        let width = [0, 1, 2].map(|a| match periods.0[a] {
            Some(period) => period / number[a] as f64,
            None => size(allowed),
        });
        let around = periods.0.map(|period| period.is_some());
        let width = DVec3::from(width);
        let mut regions = Self { low, width, number, around, allowed, ..Self::default() };
        regions.add(outlines);
        regions
    }

    /// Adds bodies after those that are there. One that lies beyond all regions is in the nearest, which is right for whom it may meet.
    pub(crate) fn add(&mut self, outlines: &[Outline]) {
        let (low, width, number, around) = (self.low, self.width, self.number, self.around);
        let home = |outline: &Outline| {
            let place = |a: usize| {
                let place = (outline.centre[a] - low[a]) / width[a];
                let place = if around[a] { place.rem_euclid(number[a] as f64) } else { place };
                (place as usize).min(number[a] - 1)
            };
            (place(0) + number[0] * (place(1) + number[1] * place(2))) as u32
        };
        self.homes.par_extend(outlines.par_iter().with_min_len(CHUNK).map(home));
        let mut starts = vec![0; number.iter().product::<usize>() + 1];
        for &home in &self.homes {
            starts[home as usize + 1] += 1;
        }
        for n in 1..starts.len() {
            starts[n] += starts[n - 1];
        }
        let (mut next, mut bodies) = (starts.clone(), vec![0; self.homes.len()]);
        for (n, &home) in self.homes.iter().enumerate() {
            let next = &mut next[home as usize];
            bodies[*next as usize] = n as u32;
            *next += 1;
        }
        (self.starts, self.bodies) = (starts, bodies);
    }

    /// How much, at most, the bodies of each region move against those that they may meet, by a vector of each and the length of what comes to it by turning.
    pub(crate) fn against_each_other(&self, of: impl Fn(usize) -> (DVec3, f64) + Sync) -> Vec<f64> {
        let bounds = |region: usize| {
            let bodies = &self.bodies[self.starts[region] as usize..self.starts[region + 1] as usize];
            bodies.iter().fold(Bounds::NONE, |bounds, &n| {
                let (way, turn) = of(n as usize);
                bounds.and(Bounds { low: way, high: way, most: turn })
            })
        };
        let regions: usize = self.number.iter().product();
        let mut all: Vec<Bounds> = (0..regions).into_par_iter().with_min_len(16).map(bounds).collect();
        for axis in 0..3 {
            let stride: usize = self.number[..axis].iter().product();
            let count = self.number[axis];
            let beside = |n: usize| {
                let at = n / stride % count;
                let below = if at > 0 { Some(n - stride) } else { None };
                let above = if at + 1 < count { Some(n + stride) } else { None };
                let wrapped = if self.around[axis] { (count - 1) * stride } else { 0 };
                let below = below.or((wrapped > 0).then_some(n + wrapped));
                let above = above.or_else(|| n.checked_sub(wrapped).filter(|_| wrapped > 0));
                [below, above].into_iter().flatten().fold(all[n], |bounds, other| bounds.and(all[other]))
            };
            all = (0..regions).into_par_iter().with_min_len(CHUNK).map(beside).collect();
        }
        all.into_iter().map(Bounds::against_each_other).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Form;
    use tremie_numerics::DQuat;

    /// Balls at places all over a box, by a rule without pattern.
    fn balls(number: usize, edge: f64) -> Vec<Outline> {
        let form = Form::Sphere { diameter: 0.01 };
        let share = |n: usize, root: f64| (n as f64 * root).fract() * edge;
        (0..number)
            .map(|n| DVec3::new(share(n, 2f64.sqrt()), share(n, 3f64.sqrt()), share(n, 5f64.sqrt())))
            .map(|at| Outline::new(&form, at, DQuat::IDENTITY))
            .collect()
    }

    #[test]
    fn bodies_that_are_nowhere_are_borne() {
        for lost in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            let mut outlines = balls(10, 1.0);
            outlines[3].centre = DVec3::new(0.1, lost, 0.2);
            let regions = Regions::new(&outlines, &Periods::default(), 0.004, 0.005);
            assert_eq!(regions.bodies.len(), 10);
        }
    }

    #[test]
    fn no_two_bodies_that_may_meet_move_faster_against_each_other_than_said() {
        for periods in [Periods::default(), Periods([Some(1.0), None, Some(1.0)])] {
            let mut outlines = balls(3000, 1.0);
            // Those that come later lie below all others.
            outlines.sort_by(|a, b| b.centre.x.total_cmp(&a.centre.x));
            let mut regions = Regions::new(&outlines[..2000], &periods, 0.004, 0.005);
            regions.add(&outlines[2000..]);
            let flow = |n: usize| {
                let at = outlines[n].centre;
                (DVec3::new(0.1 * (9.0 * at.z).sin(), f64::from(at.x > 0.5), 5.0), 0.02 * at.y)
            };
            let said = regions.against_each_other(flow);
            let mut most = 0.0_f64;
            for a in 0..outlines.len() {
                for b in 0..a {
                    let way = periods.shortest(outlines[b].centre - outlines[a].centre).length();
                    if way < 0.01 + 0.004 + 2.0 * regions.allowed {
                        let pass = (flow(a).0 - flow(b).0).length() + flow(a).1 + flow(b).1;
                        let said = [a, b].map(|n| said[regions.homes[n] as usize]);
                        assert!(pass <= said[0] && pass <= said[1], "{said:?} {pass}");
                        most = most.max(pass);
                    }
                }
            }
            // All are carried along by 5.
            assert!(most > 0.0 && said.iter().all(|said| *said < 4.0), "{said:?}");
        }
    }
}
