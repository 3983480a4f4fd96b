//! How fibres lie, and where bodies are.
//!
//! - The orientation tensor of second order, weighted by length: a_ij = sum L p_i p_j / sum L (Svec 2013, Eq. 7.1; Advani and Tucker 1987), of
//!   the fibres or pieces of fibres in a block. Its principal values and axes are those of the ellipses that show it.
//! - The orientation factor of a plane, alpha = N A_f / (Phi A_c) with N fibres of cross-section A_f through the area A_c and the share Phi of
//!   the volume (Svec 2013, Eq. 1.1; Krenchel 1975): 1/2 for isotropic fibres, 2/pi in a plane, 1 if aligned.
//! - The volume of bodies in the cells of a net and between heights: how they have segregated.
//!
//! Fibres are cut as lines here, so that their volume goes with their length. Bodies are taken where they are, not at their images in periodic
//! space.

use tremie_numerics::{DMat3, DVec3};

use crate::distance::outer;
use crate::{Distribution, Form, Inclusions};

/// A box along the axes of space, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Lower corner.
    pub low: DVec3,
    /// Upper corner.
    pub high: DVec3,
}

impl Block {
    /// All of space.
    pub const SPACE: Self = Self { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };

    /// The part of the line from `start` to `start` + `way` that lies inside, as shares of the way.
    pub fn part(&self, start: DVec3, way: DVec3) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - start[axis], self.high[axis] - start[axis]);
            if way[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (one, two) = (low / way[axis], high / way[axis]);
            (from, to) = (from.max(one.min(two)), to.min(one.max(two)));
        }
        (from < to).then_some((from, to))
    }
}

/// Fibres as lines: number, start, and way to the end, in m.
fn lines(bodies: &Inclusions) -> impl Iterator<Item = (usize, DVec3, DVec3)> {
    (0..bodies.len()).filter_map(|n| {
        let Form::Fibre { length, .. } = *bodies.form(n) else { return None };
        let way = length * bodies.axis(n);
        Some((n, bodies.position[n] - 0.5 * way, way))
    })
}

/// What fibres have in a block, gathered fibre by fibre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// How many fibres have their centres there.
    pub number: usize,
    /// How many have any part there.
    pub parts: usize,
    /// Length in m of what lies there.
    pub length: f64,
    /// Its volume in m3.
    pub volume: f64,
    /// Sum of L p_i p_j in m.
    sum: DMat3,
}

impl Share {
    /// Nothing yet.
    pub const NONE: Self = Self { number: 0, parts: 0, length: 0.0, volume: 0.0, sum: DMat3::ZERO };

    /// All that fibres have in a block.
    pub fn within(bodies: &Inclusions, block: &Block) -> Self {
        let mut share = Self::NONE;
        (0..bodies.len()).for_each(|n| share.add(bodies, n, block));
        share
    }

    /// Adds the part of body `n` that lies in a block, if it is a fibre.
    pub fn add(&mut self, bodies: &Inclusions, n: usize, block: &Block) {
        let Some([start, end]) = bodies.ends(n) else { return };
        let centre = bodies.position[n];
        if centre.cmpge(block.low).all() && centre.cmplt(block.high).all() {
            self.number += 1;
        }
        let Some((from, to)) = block.part(start, end - start) else { return };
        let (length, axis) = ((to - from) * (end - start).length(), bodies.axis(n));
        self.sum += length * outer(axis, axis);
        self.parts += 1;
        self.length += length;
        self.volume += (to - from) * bodies.form(n).volume();
    }

    /// Adds fibres of a form that take so much volume in m3, of which only the orientation tensor is known. Their number is the nearest whole one.
    pub fn add_all(&mut self, form: &Form, volume: f64, tensor: &DMat3) {
        let Form::Fibre { length, .. } = *form else { return };
        let each = form.volume();
        self.volume += volume;
        self.length += volume * length / each;
        self.sum += *tensor * (volume * length / each);
        self.number = (self.volume / each).round() as usize;
        self.parts = self.number;
    }

    /// Their orientation tensor a_ij; none without fibres there.
    pub fn tensor(&self) -> Option<DMat3> {
        (self.length > 0.0).then(|| self.sum * self.length.recip())
    }
}

/// The orientation tensor a_ij of what fibres have in a block; none without fibres there.
pub fn tensor(bodies: &Inclusions, block: &Block) -> Option<DMat3> {
    Share::within(bodies, block).tensor()
}

/// A piece of a fibre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Place of the fibre among the bodies.
    pub body: usize,
    /// Both ends of the piece in m.
    pub ends: [DVec3; 2],
}

/// The pieces of fibres that lie in a block, in the order of the bodies.
pub fn pieces(bodies: &Inclusions, block: &Block) -> Vec<Piece> {
    let piece = |(body, start, way): (usize, DVec3, DVec3)| {
        let (from, to) = block.part(start, way)?;
        Some(Piece { body, ends: [start + from * way, start + to * way] })
    };
    lines(bodies).filter_map(piece).collect()
}

/// The six components of a symmetric tensor: 11, 22, 33, 12, 13, 23.
pub fn components(a: &DMat3) -> [f64; 6] {
    [a.x_axis.x, a.y_axis.y, a.z_axis.z, a.x_axis.y, a.x_axis.z, a.y_axis.z]
}

/// The symmetric tensor with six components, in the order of [`components`].
pub fn tensor_of([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
}

/// Principal values of a symmetric tensor, the largest first, and their axes: of an ellipsoid, its half-axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// Values.
    pub values: [f64; 3],
    /// Unit axes, in their order.
    pub axes: [DVec3; 3],
}

/// Principal values and axes of a symmetric tensor, by Jacobi's rotations.
pub fn principal(tensor: &DMat3) -> Principal {
    let (mut a, mut axes) = (tensor.to_cols_array_2d(), DMat3::IDENTITY.to_cols_array_2d());
    for _ in 0..30 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let half = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
            let t = half.signum() / (half.abs() + half.hypot(1.0));
            let c = t.hypot(1.0).recip();
            let s = t * c;
            for k in 0..3 {
                (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                (axes[p][k], axes[q][k]) = (c * axes[p][k] - s * axes[q][k], s * axes[p][k] + c * axes[q][k]);
            }
            (a[p][q], a[q][p]) = (0.0, 0.0);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &k| a[k][k].total_cmp(&a[i][i]));
    Principal { values: order.map(|i| a[i][i]), axes: order.map(|i| DVec3::from_array(axes[i])) }
}

/// A flat piece of a section: a parallelogram, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// A corner.
    pub corner: DVec3,
    /// Sides from there.
    pub sides: [DVec3; 2],
}

impl Section {
    /// A rectangle around `centre`, across the unit vector `normal`, with edges of `size` in m. The second edge goes along the cross product of
    /// z and the normal, so that it is horizontal, or along y if the normal is upright; the first is square to it, and the normal is that of
    /// the first and the second edge.
    pub fn around(centre: DVec3, normal: DVec3, size: [f64; 2]) -> Self {
        let second = DVec3::Z.cross(normal).try_normalize().unwrap_or(DVec3::Y);
        let sides = [size[0] * second.cross(normal), size[1] * second];
        Self { corner: centre - 0.5 * (sides[0] + sides[1]), sides }
    }

    /// The section of a block across an axis, at a coordinate in m along it.
    pub fn of_block(block: &Block, axis: usize, at: f64) -> Self {
        let side = |n: usize| {
            let a = (axis + n) % 3;
            DVec3::AXES[a] * (block.high[a] - block.low[a])
        };
        let mut corner = block.low;
        corner[axis] = at;
        Self { corner, sides: [side(1), side(2)] }
    }
}

/// Fibres through a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// How many.
    pub count: usize,
    /// Area in m2 of their cross-sections, each square to its own fibre: N A_f.
    pub fibres: f64,
    /// Area in m2 of the section: A_c.
    pub section: f64,
}

impl Crossing {
    /// Fibres for each m2; not a number where there is no area.
    pub fn density(&self) -> f64 {
        self.count as f64 / self.section
    }

    /// The orientation factor alpha, where fibres have a share of the volume.
    pub fn orientation_factor(&self, share: f64) -> f64 {
        self.fibres / (share * self.section)
    }
}

/// The fibres of a form that go through a section of which so much is wet, in m2, where they take a share of the volume and only their orientation
/// tensor is known: alpha by the distribution that stands for it ([`Distribution`]), and the nearest whole number.
pub fn crossing_of(form: &Form, share: f64, tensor: &DMat3, normal: DVec3, wet: f64) -> Crossing {
    let Form::Fibre { length, .. } = *form else { return Crossing { count: 0, fibres: 0.0, section: wet } };
    let fibres = share * wet * Distribution::of(tensor).orientation_factor(normal);
    Crossing { count: (fibres * length / form.volume()).round() as usize, fibres, section: wet }
}

/// The fibres whose axes go through a section; one that ends in it counts on the side of the section's normal.
pub fn crossing(bodies: &Inclusions, section: &Section) -> Crossing {
    crossing_within(bodies, section, &Block::SPACE)
}

/// The same, of those that do so in a block; the area is that of all of the section.
pub fn crossing_within(bodies: &Inclusions, section: &Section, block: &Block) -> Crossing {
    let [one, two] = section.sides;
    let normal = one.cross(two);
    let area = normal.length();
    let (mut count, mut fibres) = (0, 0.0);
    for (n, start, way) in lines(bodies) {
        let (from, to) = (normal.dot(start - section.corner), normal.dot(start + way - section.corner));
        if (from < 0.0) == (to < 0.0) {
            continue;
        }
        let at = start + way * (from / (from - to)) - section.corner;
        let places =
            [at.cross(two).dot(normal), one.cross(at).dot(normal)].map(|place| place / (area * area));
        let point = at + section.corner;
        let in_block = point.cmpge(block.low).all() && point.cmple(block.high).all();
        if in_block && places.iter().all(|place| (0.0..1.0).contains(place)) {
            count += 1;
            fibres += bodies.form(n).volume() / way.length();
        }
    }
    Crossing { count, fibres, section: area }
}

/// Cells of equal size, in m; the first axis counts fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Net {
    /// Lower corner.
    pub low: DVec3,
    /// Size of a cell.
    pub size: DVec3,
    /// Number of cells along each axis.
    pub cells: [usize; 3],
}

impl Net {
    /// Number of the cell with a point.
    fn cell(&self, at: DVec3) -> Option<usize> {
        let place = ((at - self.low) / self.size).floor().to_array();
        let inside = (0..3).all(|axis| place[axis] >= 0.0 && place[axis] < self.cells[axis] as f64);
        let [x, y, z] = place.map(|x| x as usize);
        inside.then(|| x + self.cells[0] * (y + self.cells[1] * z))
    }
}

/// Volume in m3 of bodies in each cell of a net, of the kinds that are asked for. Fibres are cut exactly; other bodies are some five hundred
/// points, of equal shares.
pub fn volumes(bodies: &Inclusions, net: &Net, kinds: impl Fn(u16) -> bool) -> Vec<f64> {
    let mut volumes = vec![0.0; net.cells.iter().product()];
    let mut add = |at: DVec3, volume: f64| {
        if let Some(cell) = net.cell(at) {
            volumes[cell] += volume;
        }
    };
    // Even, but along no axis: multiples of powers of the number g with g^4 = g + 1 (Roberts 2018).
    let step = DVec3::new(0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_2);
    let ball: Vec<DVec3> = (0..1000)
        .map(|n| 2.0 * (0.5 + f64::from(n) * step).fract() - 1.0)
        .filter(|at| at.length() < 1.0)
        .collect();
    let mut cuts = Vec::new();
    for n in (0..bodies.len()).filter(|&n| kinds(bodies.kind[n])) {
        let (centre, volume) = (bodies.position[n], bodies.form(n).volume());
        let half_axes = match *bodies.form(n) {
            Form::Sphere { diameter } => DVec3::splat(0.5 * diameter),
            Form::Ellipsoid { half_axes } => half_axes,
            Form::Fibre { length, .. } => {
                let way = length * bodies.axis(n);
                let start = centre - 0.5 * way;
                cuts.clear();
                cuts.extend([0.0, 1.0]);
                for axis in 0..3 {
                    let place = |s: f64| (start[axis] + s * way[axis] - net.low[axis]) / net.size[axis];
                    let (low, high) = (place(0.0).min(place(1.0)), place(0.0).max(place(1.0)));
                    let first = low.ceil().max(0.0);
                    let planes = (high.floor().min(net.cells[axis] as f64) - first + 1.0).max(0.0) as usize;
                    let cut = |k: usize| {
                        (net.low[axis] + (first + k as f64) * net.size[axis] - start[axis]) / way[axis]
                    };
                    cuts.extend((0..planes).map(cut).filter(|s| (0.0..1.0).contains(s)));
                }
                cuts.sort_by(f64::total_cmp);
                for piece in cuts.windows(2) {
                    add(start + 0.5 * (piece[0] + piece[1]) * way, (piece[1] - piece[0]) * volume);
                }
                continue;
            }
        };
        let share = volume / ball.len() as f64;
        ball.iter().for_each(|at| add(centre + bodies.orientation[n] * (half_axes * *at), share));
    }
    volumes
}

/// Volume in m3 of bodies between heights in m along an axis (z, or against gravity), of the kinds that are asked for: exact, but for
/// the ends of fibres. The heights rise.
pub fn volumes_by_height(
    bodies: &Inclusions,
    up: DVec3,
    heights: &[f64],
    kinds: impl Fn(u16) -> bool,
) -> Vec<f64> {
    let mut volumes = vec![0.0; heights.len().saturating_sub(1)];
    for n in (0..bodies.len()).filter(|&n| kinds(bodies.kind[n])) {
        let (height, volume) = (up.dot(bodies.position[n]), bodies.form(n).volume());
        // A cap of a sphere, or of what is a sphere by stretching: (2 + 3 s - s^3)/4 of it lie below s half-heights over the centre.
        let cap = |s: f64| 0.25 * (2.0 + 3.0 * s - s * s * s);
        let line = |s: f64| 0.5 * (1.0 + s);
        let own = bodies.orientation[n].conjugate() * up;
        let (half, below): (f64, &dyn Fn(f64) -> f64) = match *bodies.form(n) {
            Form::Sphere { diameter } => (0.5 * diameter, &cap),
            Form::Ellipsoid { half_axes } => ((half_axes * own).length(), &cap),
            Form::Fibre { length, diameter } => ((0.5 * length * own.z).abs().max(0.5 * diameter), &line),
        };
        let share = |at: f64| below(((at - height) / half).clamp(-1.0, 1.0));
        for (volume_between, between) in volumes.iter_mut().zip(heights.windows(2)) {
            *volume_between += volume * (share(between[1]) - share(between[0]));
        }
    }
    volumes
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use approx::assert_relative_eq;
    use tremie_numerics::DQuat;

    use super::*;
    use crate::{Amount, AtWalls, Direction, Kind, Order, Periods, Region, place};

    const SIZE: f64 = 0.3;

    fn space(_: DVec3) -> f64 {
        -1.0
    }

    fn fibres(direction: Direction, number: usize) -> Inclusions {
        let mut bodies = Inclusions {
            kinds: vec![
                Kind {
                    name: "f".into(),
                    form: Form::Fibre { length: 0.03, diameter: 3e-4 },
                    density: 7850.0,
                },
                Kind { name: "s".into(), form: Form::Sphere { diameter: 0.02 }, density: 2600.0 },
                Kind {
                    name: "e".into(),
                    form: Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.02, 0.005) },
                    density: 2600.0,
                },
            ],
            ..Inclusions::default()
        };
        let amount = Amount::Number(number);
        let order = Order { kind: 0, batch: 0, amount, direction, at_walls: AtWalls::Turned, seed: 3 };
        let region = Region { low: DVec3::ZERO, high: DVec3::splat(SIZE), distance: &space };
        place(&mut bodies, &order, &region, &Periods([Some(SIZE); 3])).unwrap();
        bodies
    }

    /// Isotropic 1/2, in a plane 2/pi, aligned 1: within three standard errors of the count; the tensors, of their values.
    #[test]
    fn orientation_factors_have_their_closed_forms() {
        let isotropic = (Direction::Isotropic, 0.5, [1.0 / 3.0; 3]);
        let planar = (Direction::Planar(DVec3::Z), 2.0 / PI, [0.5, 0.5, 0.0]);
        let aligned = (Direction::Aligned(DVec3::X), 1.0, [1.0, 0.0, 0.0]);
        for (direction, factor, diagonal) in [isotropic, planar, aligned] {
            let number = 8000;
            let bodies = fibres(direction, number);
            let (mut alpha, mut count) = (0.0, 0.0);
            let share = number as f64 * bodies.form(0).volume() / SIZE.powi(3);
            // Away from the ends of the periodic box, across which fibres are not followed; far enough apart for counts to be independent.
            for x in [0.05, 0.1, 0.15, 0.2, 0.25] {
                let sides = [SIZE * DVec3::Y + 0.2 * DVec3::Y, SIZE * DVec3::Z + 0.2 * DVec3::Z];
                let section = Section { corner: DVec3::new(x, -0.1, -0.1), sides };
                let found = crossing(&bodies, &section);
                // Fibres that reach out of the periodic box are counted there: the section is larger, its area is the box's.
                let found = Crossing { section: SIZE * SIZE, ..found };
                alpha += 0.2 * found.orientation_factor(share);
                count += found.count as f64;
            }
            assert!((alpha - factor).abs() < 3.0 * factor / f64::sqrt(count), "{alpha} {factor}");
            let a = tensor(&bodies, &Block::SPACE).unwrap();
            let error = 3.0 / (number as f64).sqrt();
            for i in 0..3 {
                assert!((a.col(i)[i] - diagonal[i]).abs() < error * 0.36 + 1e-12);
                assert!(a.col(i)[(i + 1) % 3].abs() < error * 0.36 + 1e-12);
            }
            assert_relative_eq!((0..3).map(|i| a.col(i)[i]).sum::<f64>(), 1.0, max_relative = 1e-12);
        }
    }

    /// Two fibres, one half outside the block: lengths weigh.
    #[test]
    fn blocks_cut_fibres() {
        let mut bodies = fibres(Direction::Isotropic, 0);
        bodies.add(0, 0, DVec3::ZERO, DQuat::from_rotation_arc(DVec3::Z, DVec3::X));
        bodies.add(0, 0, DVec3::splat(0.02), DQuat::IDENTITY);
        let block = Block { low: DVec3::splat(-0.005), high: DVec3::splat(0.05) };
        // Of the first 5 + 15 of 30 mm, of the second all.
        let a = tensor(&bodies, &block).unwrap();
        assert_relative_eq!(a.x_axis.x, 0.4, max_relative = 1e-12);
        assert_relative_eq!(a.z_axis.z, 0.6, max_relative = 1e-12);
        assert_eq!(tensor(&bodies, &Block { low: DVec3::splat(1.0), high: DVec3::splat(2.0) }), None);
        let net = Net { low: DVec3::splat(-0.005), size: DVec3::splat(0.01), cells: [6; 3] };
        let each = bodies.form(0).volume();
        assert_relative_eq!(
            volumes(&bodies, &net, |_| true).iter().sum::<f64>(),
            each * 5.0 / 3.0,
            max_relative = 1e-12
        );
        assert_relative_eq!(volumes(&bodies, &net, |_| true)[1], each / 3.0, max_relative = 1e-12);
    }

    /// Pieces have the length, the volume and the number that a block has of fibres.
    #[test]
    fn pieces_are_what_a_block_has_of_fibres() {
        let bodies = fibres(Direction::Isotropic, 3000);
        let block = Block { low: DVec3::new(0.1, 0.05, 0.12), high: DVec3::new(0.22, 0.25, 0.2) };
        let (pieces, share) = (pieces(&bodies, &block), Share::within(&bodies, &block));
        assert!(pieces.len() == share.parts && share.parts > share.number && share.number > 100);
        let length = |piece: &Piece| (piece.ends[1] - piece.ends[0]).length();
        let total: f64 = pieces.iter().map(length).sum();
        assert_relative_eq!(total, share.length, max_relative = 1e-12);
        let area = bodies.form(0).volume() / 0.03;
        assert_relative_eq!(total * area, share.volume, max_relative = 1e-12);
        for piece in &pieces {
            let inside =
                |end: DVec3| end.cmpge(block.low - 1e-12).all() && end.cmple(block.high + 1e-12).all();
            assert!(piece.ends.into_iter().all(inside) && length(piece) <= 0.03 + 1e-12);
            let [start, end] = bodies.ends(piece.body).unwrap();
            let along = (piece.ends[1] - piece.ends[0]).dot(end - start);
            assert_relative_eq!(along, length(piece) * 0.03, max_relative = 1e-9);
        }
        // A fibre that is half in a block has half of its length there.
        let mut bodies = fibres(Direction::Isotropic, 0);
        bodies.add(0, 0, DVec3::new(0.1, 0.1, 0.15), DQuat::from_rotation_arc(DVec3::Z, DVec3::X));
        let half = Share::within(&bodies, &block);
        assert_relative_eq!(half.length, 0.015, max_relative = 1e-12);
        assert_eq!((half.parts, half.number), (1, 1));
    }

    #[test]
    fn rectangles_lie_across_their_normals() {
        let size = [0.2, 0.3];
        for (normal, first, second) in [
            (DVec3::X, -DVec3::Z, DVec3::Y),
            (DVec3::Y, -DVec3::Z, -DVec3::X),
            (DVec3::Z, DVec3::X, DVec3::Y),
            (-DVec3::Z, -DVec3::X, DVec3::Y),
            (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.8, 0.0, -0.6), DVec3::Y),
        ] {
            let found = Section::around(DVec3::splat(0.5), normal, size);
            assert!((found.sides[0] - 0.2 * first).length() < 1e-12, "{found:?}");
            assert!((found.sides[1] - 0.3 * second).length() < 1e-12, "{found:?}");
            assert!((found.sides[0].cross(found.sides[1]) - 0.06 * normal).length() < 1e-12);
            let middle = found.corner + 0.5 * (found.sides[0] + found.sides[1]);
            assert!((middle - DVec3::splat(0.5)).length() < 1e-12);
        }
    }

    /// Through a plane at 45 degrees to aligned fibres go cos 45 as many for the same area.
    #[test]
    fn slanted_planes_meet_fewer_fibres() {
        let bodies = fibres(Direction::Aligned(DVec3::X), 8000);
        let count = |normal: DVec3| {
            let places = [0.1, 0.14, 0.18].map(|x| DVec3::new(x, 0.15, 0.15));
            places.map(|at| crossing(&bodies, &Section::around(at, normal, [0.14, 0.14])).count).iter().sum()
        };
        let straight: usize = count(DVec3::X);
        let slanted: usize = count(DVec3::new(1.0, 0.0, 1.0).normalize());
        let (expected, error) = (straight as f64 * 0.5_f64.sqrt(), (2.0 * straight as f64).sqrt());
        assert!((slanted as f64 - expected).abs() < 3.0 * error && straight > 400, "{slanted} {straight}");
    }

    #[test]
    fn principal_axes_are_those_that_were_given() {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, -1.2, 0.8)));
        for values in [DVec3::new(0.7, 0.2, 0.1), DVec3::new(0.5, 0.5, 0.0), DVec3::splat(1.0 / 3.0)] {
            let a = turn * DMat3::from_diagonal(values) * turn.transpose();
            let found = principal(&a);
            for i in 0..3 {
                assert!((found.values[i] - values[i]).abs() < 1e-14);
                assert!((a * found.axes[i] - values[i] * found.axes[i]).length() < 1e-14);
                assert_relative_eq!(found.axes[i].length(), 1.0, max_relative = 1e-14);
            }
        }
    }

    #[test]
    fn volumes_lie_where_bodies_are() {
        let mut bodies = fibres(Direction::Isotropic, 0);
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.2, 0.8));
        bodies.add(1, 0, DVec3::new(0.05, 0.05, 0.045), DQuat::IDENTITY);
        bodies.add(2, 0, DVec3::new(0.05, 0.05, 0.05), turn);
        bodies.add(0, 0, DVec3::new(0.05, 0.05, 0.055), turn);
        let total: f64 = (0..3).map(|n| bodies.form(n).volume()).sum();
        let sphere = volumes_by_height(&bodies, DVec3::Z, &[0.0, 0.05, 0.1], |kind| kind == 1);
        // A cap of height h = 5 mm of a sphere of R = 10 mm: pi h^2 (R - h/3).
        assert_relative_eq!(sphere[1], PI * 25e-6 * (0.01 - 0.005 / 3.0), max_relative = 1e-12);
        let all = volumes_by_height(&bodies, DVec3::Z, &[0.0, 0.04, 0.05, 0.1], |_| true);
        assert_relative_eq!(all.iter().sum::<f64>(), total, max_relative = 1e-12);
        let halves = volumes_by_height(&bodies, DVec3::Z, &[0.0, 0.05, 0.1], |kind| kind == 2);
        assert_relative_eq!(halves[0], halves[1], max_relative = 1e-12);
        let net = Net { low: DVec3::ZERO, size: DVec3::splat(0.01), cells: [10; 3] };
        let cells = volumes(&bodies, &net, |_| true);
        assert_relative_eq!(cells.iter().sum::<f64>(), total, max_relative = 1e-12);
        let low: f64 = cells[..400].iter().sum();
        assert!((low - all[0]).abs() < 0.02 * total, "{low} {}", all[0]);
    }
}
