//! What a cast holds in a block that is cut out of it, and what goes through a piece of any plane.
//!
//! Fibres are clipped at the faces of the block, as a saw does. Shares are those of the concrete there: what the fluid fills of the block, with what swims
//! in it. Only what is in the domain counts, and not its mirror images.

use tremie_numerics::{DMat3, DVec3};
use tremie_suspension::Inclusions;
use tremie_suspension::orientation::{Block, Crossing, Section, Share, crossing_of, crossing_within};

use super::lying::Column;
use super::section::wet;
use crate::{Cells, Lying};

/// What a block holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// What fibres have in it.
    pub fibres: Share,
    /// Volume in m3 of the fluid in it, with what swims in it.
    pub fluid: f64,
}

impl Held {
    /// Share of its volume that fibres take; not a number where it is dry.
    pub fn share(&self) -> f64 {
        self.fibres.volume / self.fluid
    }

    /// Orientation tensor of the clipped fibres, weighted by length; none without fibres.
    pub fn tensor(&self) -> Option<DMat3> {
        self.fibres.tensor()
    }
}

/// What a block holds.
pub fn held(cells: &Cells, bodies: &Inclusions, block: &Block) -> Held {
    let weight = |a: usize, i: usize| {
        let from = cells.origin[a] + i as f64 * cells.size;
        ((from + cells.size).min(block.high[a]) - from.max(block.low[a])).max(0.0) / cells.size
    };
    let weights = [0, 1, 2].map(|a| (0..cells.count[a]).map(|i| weight(a, i)).collect::<Vec<f64>>());
    let [nx, ny, _] = cells.count;
    let share = |n: usize| weights[0][n % nx] * weights[1][n / nx % ny] * weights[2][n / (nx * ny)];
    let filled: f64 = cells.fill.iter().enumerate().map(|(n, fill)| share(n) * fill).sum();
    let mut fibres = Share::within(bodies, block);
    if let Some(field) = cells.field_beside(bodies) {
        for (n, fill) in cells.fill.iter().enumerate() {
            let volume = field.share * share(n) * fill * cells.size.powi(3);
            if volume > 0.0 {
                fibres.add_all(&field.form, volume, &field.tensor(n));
            }
        }
    }
    Held { fibres, fluid: filled * cells.size.powi(3) }
}

/// Height in m below which half of the fluid's volume lies.
pub fn half_height(cells: &Cells) -> f64 {
    Column::of_all(cells).height(0.5)
}

/// What goes through a section in any direction; the area is that of what is wet of it, within the domain.
pub fn cut(cells: &Cells, bodies: &Inclusions, section: &Section) -> Crossing {
    let [low, high] = cells.domain;
    let wet = wet_area(cells, section);
    match cells.field_beside(bodies) {
        Some(field) => cut_field(cells, field, section, wet),
        None => Crossing { section: wet, ..crossing_within(bodies, section, &Block { low, high }) },
    }
}

/// What goes through a section of which so much is wet, in m2, of fibres that are a field: by the mean of the tensors there.
pub(super) fn cut_field(cells: &Cells, field: &Lying, section: &Section, wet: f64) -> Crossing {
    let (mut sum, mut weights) = (DMat3::ZERO, 0.0);
    each_point(cells, section, 2.0, |at| {
        let place = ((at - cells.origin) / cells.size).floor();
        let inside = (0..3).all(|a| place[a] >= 0.0 && place[a] < cells.count[a] as f64);
        if inside {
            let [i, j, k] = place.to_array().map(|x| x as usize);
            let n = cells.index(i, j, k);
            sum += field.tensor(n) * cells.fill[n];
            weights += cells.fill[n];
        }
    });
    if weights == 0.0 {
        return Crossing { count: 0, fibres: 0.0, section: wet };
    }
    let [one, two] = section.sides;
    let normal = one.cross(two).normalize_or_zero();
    crossing_of(&field.form, field.share, &(sum * weights.recip()), normal, wet)
}

/// Goes through points of a section within the domain, at so many to a cell, and at most so many along an edge; says how many there are with those without.
fn each_point(cells: &Cells, section: &Section, to_a_cell: f64, mut see: impl FnMut(DVec3)) -> usize {
    const MOST: f64 = 2000.0;
    let [low, high] = cells.domain;
    let [one, two] = section.sides;
    let counts =
        [one, two].map(|side| (to_a_cell * side.length() / cells.size).ceil().clamp(1.0, MOST) as usize);
    for j in 0..counts[1] {
        for i in 0..counts[0] {
            let place = |n: usize, count: usize| (n as f64 + 0.5) / count as f64;
            let at = section.corner + place(i, counts[0]) * one + place(j, counts[1]) * two;
            if at.cmpge(low).all() && at.cmple(high).all() {
                see(at);
            }
        }
    }
    counts[0] * counts[1]
}

/// Area in m2 of a section that is wet.
fn wet_area(cells: &Cells, section: &Section) -> f64 {
    let [low, high] = cells.domain;
    if let Some((axis, block)) = upright(section) {
        let at = section.corner[axis];
        if at < low[axis] || at > high[axis] {
            return 0.0;
        }
        return wet(cells, axis, at, [block.low.max(low), block.high.min(high)]);
    }
    const POINTS: f64 = 10.0;
    let [one, two] = section.sides;
    let normal = one.cross(two);
    let across = normal.abs().to_array();
    let axis = (0..3).fold(0, |most, a| if across[a] > across[most] { a } else { most });
    let mut sum = 0.0;
    let points = each_point(cells, section, POINTS, |at| sum += fill(cells, axis, at));
    normal.length() * sum / points as f64
}

/// The axis that a section lies across and the box that it is, if its sides are along axes.
fn upright(section: &Section) -> Option<(usize, Block)> {
    let along = |side: DVec3| {
        let others = |a: usize| side[(a + 1) % 3] == 0.0 && side[(a + 2) % 3] == 0.0;
        (0..3).find(|a| others(*a))
    };
    let [one, two] = section.sides;
    let (a, b) = (along(one)?, along(two)?);
    let end = section.corner + one + two;
    let block = Block { low: section.corner.min(end), high: section.corner.max(end) };
    (a != b).then_some((3 - a - b, block))
}

/// Fill at a point: linear between the centres of cells along an axis, and that of the cell along the others, as in sections across an axis.
fn fill(cells: &Cells, axis: usize, at: DVec3) -> f64 {
    // Beyond the last centre before a side of the domain nothing is known but the last cell.
    let half = 0.5 * cells.size;
    let mut place = (at - cells.origin) / cells.size;
    let between =
        at[axis].clamp(cells.domain[0][axis] + half, cells.domain[1][axis] - half) - cells.origin[axis];
    place[axis] = between / cells.size - 0.5;
    let cell = |step: f64| {
        let mut place = place.floor();
        place[axis] += step;
        let inside = (0..3).all(|a| place[a] >= 0.0 && place[a] < cells.count[a] as f64);
        let [i, j, k] = place.to_array().map(|x| x as usize);
        if inside { cells.fill[cells.index(i, j, k)] } else { 0.0 }
    };
    let t = place[axis] - place[axis].floor();
    (1.0 - t) * cell(0.0) + t * cell(1.0)
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DQuat;
    use tremie_suspension::orientation::pieces;
    use tremie_suspension::{Amount, AtWalls, Direction, Form, Kind, Order, Periods, Region, place};

    use super::*;

    const SIZE: f64 = 0.4;
    /// Height of the fluid in m.
    const LEVEL: f64 = 0.3;

    /// A box of 0.4 m, filled up to 0.3 m, whose cells lie within a larger domain.
    fn layer() -> Cells {
        let fill = (0..8000).map(|n| if n / 400 < 15 { 1.0 } else { 0.0 }).collect();
        let domain = [DVec3::splat(-0.2), DVec3::splat(0.6)];
        Cells { size: 0.02, count: [20; 3], fill, domain, ..Cells::default() }
    }

    fn fibres(direction: Direction, number: usize) -> Inclusions {
        let form = Form::Fibre { length: 0.03, diameter: 3e-4 };
        let kinds = vec![Kind { name: "f".into(), form, density: 7850.0 }];
        let mut bodies = Inclusions { kinds, ..Inclusions::default() };
        let order = Order {
            kind: 0,
            batch: 0,
            amount: Amount::Number(number),
            direction,
            at_walls: AtWalls::Turned,
            seed: 5,
        };
        let high = DVec3::new(SIZE, SIZE, LEVEL);
        let region = Region { low: DVec3::ZERO, high, distance: &|_| -1.0 };
        place(&mut bodies, &order, &region, &Periods([Some(SIZE), Some(SIZE), Some(LEVEL)])).unwrap();
        bodies
    }

    /// A beam of isotropic fibres: alpha 1/2 and a tensor of 1/3; of aligned ones 1 along them. Within three standard errors of the counts.
    #[test]
    fn beams_have_the_factors_of_how_their_fibres_lie() {
        let cells = layer();
        let block = Block { low: DVec3::new(0.05, 0.1, 0.05), high: DVec3::new(0.35, 0.25, 0.2) };
        for (direction, factor, diagonal) in
            [(Direction::Isotropic, 0.5, 1.0 / 3.0), (Direction::Aligned(DVec3::X), 1.0, 1.0)]
        {
            let number = 12_000;
            let bodies = fibres(direction, number);
            let held = held(&cells, &bodies, &block);
            assert!((held.fluid - 0.3 * 0.15 * 0.15).abs() < 1e-12);
            let share = number as f64 * bodies.form(0).volume() / (SIZE * SIZE * LEVEL);
            let inside = (held.fibres.number as f64).sqrt().recip();
            assert!((held.share() / share - 1.0).abs() < 3.0 * inside, "{} {share}", held.share());
            let a = held.tensor().unwrap();
            assert!((a.x_axis.x - diagonal).abs() < 3.0 * 0.3 * inside, "{a:?}");
            let found = cut(&cells, &bodies, &Section::of_block(&block, 0, 0.2));
            assert!((found.section - 0.15 * 0.15).abs() < 1e-12);
            let alpha = found.orientation_factor(held.share());
            let error = factor * ((found.count as f64).recip() + inside * inside).sqrt();
            assert!((alpha - factor).abs() < 3.0 * error, "{alpha} {factor} {error}");
            // What is cut out has the volume that the share tells.
            let area = bodies.form(0).volume() / 0.03;
            let cut_out =
                pieces(&bodies, &block).into_iter().map(|p| (p.ends[1] - p.ends[0]).length() * area);
            let volume: f64 = cut_out.sum();
            assert!((volume / (held.share() * held.fluid) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn only_concrete_counts_of_what_is_cut_out() {
        let (cells, bodies) = (layer(), fibres(Direction::Isotropic, 0));
        let block = |low: [f64; 3], high: [f64; 3]| Block { low: low.into(), high: high.into() };
        let fluid = |block: &Block| held(&cells, &bodies, block).fluid;
        assert!((fluid(&Block::SPACE) - 0.4 * 0.4 * 0.3).abs() < 1e-12);
        assert!((fluid(&block([-1.0, 0.1, 0.21], [0.105, 0.2, 0.5])) - 0.105 * 0.1 * 0.09).abs() < 1e-12);
        assert_eq!(fluid(&block([-0.1; 3], [0.0; 3])), 0.0);
        assert!((half_height(&cells) - 0.15).abs() < 1e-12);
    }

    /// The wet area of a plane that leans by 45 degrees and leaves the fluid at its top.
    #[test]
    fn slanted_planes_are_wet_up_to_the_surface() {
        let (cells, bodies) = (layer(), fibres(Direction::Isotropic, 0));
        let normal = DVec3::new(1.0, 0.0, 1.0).normalize();
        let at = DVec3::new(0.2, 0.2, LEVEL);
        let area =
            |at: DVec3, normal: DVec3| cut(&cells, &bodies, &Section::around(at, normal, [0.2, 0.1])).section;
        let found = area(at, normal);
        assert!((found - 0.5 * 0.02).abs() < 0.01 * 0.02, "{found}");
        assert!((area(DVec3::new(0.2, 0.2, 0.15), normal) - 0.02).abs() < 1e-12);
        // Hardly slanted, or not at all: the same.
        let straight = area(at, DVec3::X);
        let hardly = area(at, DVec3::new(1.0, 1e-9, 0.0).normalize());
        assert!((straight - 0.01).abs() < 1e-12 && (hardly - straight).abs() < 0.01 * 0.02, "{hardly}");
        assert_eq!(area(DVec3::splat(5.0), DVec3::X), 0.0);
    }

    /// What reaches beyond the domain, as over a plane of symmetry, does not count.
    #[test]
    fn fibres_count_within_the_domain() {
        let mut bodies = fibres(Direction::Isotropic, 0);
        let along = DQuat::from_rotation_arc(DVec3::Z, DVec3::X);
        bodies.add(0, 0, DVec3::new(0.2, 0.2, 0.1), along);
        bodies.add(0, 0, DVec3::new(0.2, -0.3, 0.1), along);
        let section = Section::around(DVec3::new(0.2, 0.0, 0.1), DVec3::X, [0.2, 1.0]);
        assert_eq!(cut(&layer(), &bodies, &section).count, 1);
    }
}
