//! How fibres lie, region by region (Svec 2013, Figures 7.11 to 7.15).
//!
//! A region is a square seen from above, from which the lower or the upper half of the fluid is taken: so much of it by volume lies below the
//! height that parts them, which in a flat layer is half of its height. The orientation tensor is that of the pieces of fibres in a region,
//! weighted by their lengths (Svec 2013, Eq. 7.1); where fibres are a field, its mean. Only what is in the domain counts, and not its mirror images.

use tremie_numerics::{DMat3, DVec3};
use tremie_suspension::Inclusions;
use tremie_suspension::orientation::{Block, Share};

use crate::Cells;

/// A half of the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Half {
    /// The half at the floor.
    Lower,
    /// The half at the surface.
    Upper,
}

impl Half {
    const BOTH: [Self; 2] = [Self::Lower, Self::Upper];
}

/// What fibres have in a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Which half of the fluid it is.
    pub half: Half,
    /// Its middle in m: of the square, and by the volume of the fluid in it.
    pub centre: DVec3,
    /// Edge of the square in m.
    pub size: f64,
    /// Volume of the fluid in it, in m3, with what swims in it.
    pub fluid: f64,
    /// What fibres have in it.
    pub fibres: Share,
}

impl Region {
    /// Share of its volume that fibres take.
    pub fn share(&self) -> f64 {
        self.fibres.volume / self.fluid
    }

    /// Orientation tensor; none without fibres.
    pub fn tensor(&self) -> Option<DMat3> {
        self.fibres.tensor()
    }
}

/// Volumes of fluid in layers of cells, from the lowest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Column {
    /// Height in m of the lowest layer's lower side.
    low: f64,
    /// Height in m of a layer.
    size: f64,
    volumes: Vec<f64>,
}

impl Column {
    pub(crate) fn new(cells: &Cells) -> Self {
        Self { low: cells.origin.z, size: cells.size, volumes: vec![0.0; cells.count[2]] }
    }

    /// All of the fluid.
    pub(crate) fn of_all(cells: &Cells) -> Self {
        let mut column = Self::new(cells);
        let layer = cells.count[0] * cells.count[1];
        for (n, fill) in cells.fill.iter().enumerate() {
            column.volumes[n / layer] += fill * cells.size.powi(3);
        }
        column
    }

    /// Volume of all of it in m3.
    pub(crate) fn volume(&self) -> f64 {
        self.volumes.iter().sum()
    }

    /// Volume in m3 below a height in m; within a layer it grows evenly.
    pub(crate) fn below(&self, height: f64) -> f64 {
        let share = |n: usize| ((height - self.low) / self.size - n as f64).clamp(0.0, 1.0);
        self.volumes.iter().enumerate().map(|(n, volume)| share(n) * volume).sum()
    }

    /// Height in m below which a share of the volume lies.
    pub(crate) fn height(&self, share: f64) -> f64 {
        let mut left = share * self.volume();
        for (n, volume) in self.volumes.iter().enumerate() {
            if left <= *volume && *volume > 0.0 {
                return self.low + self.size * (n as f64 + left / volume);
            }
            left -= volume;
        }
        self.low + self.size * self.volumes.len() as f64
    }

    /// Where fluid begins and ends, in m: sides of layers that hold as much as one cell at least.
    pub(crate) fn span(&self) -> Option<[f64; 2]> {
        let least = 0.5 * self.size.powi(3);
        let wet = |n: &usize| self.volumes[*n] >= least;
        let (first, last) = ((0..self.volumes.len()).find(wet)?, (0..self.volumes.len()).rfind(wet)? + 1);
        Some([first, last].map(|n| self.low + self.size * n as f64))
    }
}

/// The regions that hold fluid, on squares of the edge `size` in m, rounded to whole cells, from the domain's lower corner on.
pub fn regions(cells: &Cells, bodies: &Inclusions, size: f64) -> Vec<Region> {
    if cells.fill.is_empty() {
        return Vec::new();
    }
    let edge = (size / cells.size).round().max(1.0) as usize;
    let size = edge as f64 * cells.size;
    let [low, high] = cells.domain;
    let first = [0, 1].map(|a| ((cells.origin[a] - low[a]) / cells.size).round().max(0.0) as usize);
    let squares = [0, 1].map(|a| (first[a] + cells.count[a]).div_ceil(edge));
    let mut columns = vec![Column::new(cells); squares[0] * squares[1]];
    let [nx, ny, _] = cells.count;
    for (n, fill) in cells.fill.iter().enumerate() {
        let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
        let square = (i + first[0]) / edge + squares[0] * ((j + first[1]) / edge);
        columns[square].volumes[k] += fill * cells.size.powi(3);
    }
    let corner = |square: usize| {
        let place = DVec3::new((square % squares[0]) as f64, (square / squares[0]) as f64, 0.0);
        DVec3::new(low.x, low.y, 0.0) + size * place
    };
    let mut shares = vec![[Share::NONE; 2]; columns.len()];
    let heights: Vec<f64> = columns.iter().map(|column| column.height(0.5)).collect();
    if let Some(field) = cells.field_beside(bodies) {
        for (n, fill) in cells.fill.iter().enumerate().filter(|(_, fill)| **fill > 0.0) {
            let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
            let square = (i + first[0]) / edge + squares[0] * ((j + first[1]) / edge);
            let bottom = cells.origin.z + k as f64 * cells.size;
            let below = ((heights[square] - bottom) / cells.size).clamp(0.0, 1.0);
            let (volume, tensor) = (field.share * fill * cells.size.powi(3), field.tensor(n));
            let [lower, upper] = &mut shares[square];
            lower.add_all(&field.form, below * volume, &tensor);
            upper.add_all(&field.form, (1.0 - below) * volume, &tensor);
        }
    }
    for (n, ends) in (0..bodies.len()).filter_map(|n| Some((n, bodies.ends(n)?))) {
        let (from, to) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let places = [0, 1].map(|a| {
            let place = |x: f64| ((x - low[a]) / size).floor().max(0.0) as usize;
            place(from[a])..(place(to[a]) + 1).min(squares[a])
        });
        for square in places[1].clone().flat_map(|y| places[0].clone().map(move |x| x + squares[0] * y)) {
            let least = corner(square);
            let most = (least + size).min(high);
            let block = |low: f64, high: f64| Block { low: least.with_z(low), high: most.with_z(high) };
            let [lower, upper] = &mut shares[square];
            lower.add(bodies, n, &block(f64::NEG_INFINITY, heights[square]));
            upper.add(bodies, n, &block(heights[square], f64::INFINITY));
        }
    }
    let region = |(square, half): (usize, Half)| {
        let (column, low) = (&columns[square], corner(square));
        let middle = 0.5 * (low + (low + size).min(high));
        let height = column.height(if half == Half::Lower { 0.25 } else { 0.75 });
        let fluid = 0.5 * column.volume();
        let fibres = shares[square][half as usize];
        Region { half, centre: middle.with_z(height), size, fluid, fibres }
    };
    let wet = (0..columns.len()).filter(|square| columns[*square].volume() > 0.0);
    wet.flat_map(|square| Half::BOTH.map(|half| (square, half))).map(region).collect()
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DQuat;
    use tremie_suspension::{Form, Kind};

    use super::*;

    /// A layer of 0.4 m x 0.2 m x 0.1 m in a domain with room above; the cells of the snapshot begin within the domain.
    pub(crate) fn layer() -> Cells {
        let count = [40, 20, 20];
        Cells {
            origin: DVec3::new(0.1, 0.0, 0.0),
            size: 0.01,
            count,
            fill: (0..16000).map(|n| if n / 800 < 10 { 1.0 } else { 0.0 }).collect(),
            domain: [DVec3::ZERO, DVec3::new(0.5, 0.2, 0.2)],
            ..Cells::default()
        }
    }

    fn fibres() -> Inclusions {
        let form = Form::Fibre { length: 0.06, diameter: 1e-3 };
        let kinds = vec![Kind { name: "f".into(), form, density: 7850.0 }];
        Inclusions { kinds, ..Inclusions::default() }
    }

    #[test]
    fn fibres_count_where_they_lie() {
        let (cells, mut bodies) = (layer(), fibres());
        let along = |axis: DVec3| DQuat::from_rotation_arc(DVec3::Z, axis);
        // Flat in the lower half, half of it in each of two squares; and upright, a sixth of it in the lower half.
        bodies.add(0, 0, DVec3::new(0.2, 0.05, 0.02), along(DVec3::X));
        bodies.add(0, 0, DVec3::new(0.15, 0.05, 0.07), along(DVec3::Z));
        let regions = regions(&cells, &bodies, 0.101);
        assert_eq!(regions.len(), 2 * 4 * 2);
        let at = |x: f64, half: Half| {
            let place = |r: &&Region| (r.centre.x - x).abs() < 1e-9 && r.centre.y < 0.1 && r.half == half;
            regions.iter().find(place).unwrap()
        };
        let each = bodies.form(0).volume();
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let first = at(0.15, Half::Lower);
        assert!(close(first.centre.z, 0.025) && close(first.fluid, 0.5e-3));
        assert!(close(first.share(), each * (0.5 + 1.0 / 6.0) / 0.5e-3));
        let a = first.tensor().unwrap();
        assert!(close(a.x_axis.x, 0.75) && close(a.z_axis.z, 0.25) && close(a.x_axis.z, 0.0), "{a:?}");
        assert_eq!((first.fibres.number, at(0.25, Half::Lower).fibres.number), (0, 1));
        let upper = at(0.15, Half::Upper);
        assert!(close(upper.fibres.volume, each * 5.0 / 6.0) && close(upper.centre.z, 0.075));
        assert_eq!((upper.fibres.number, upper.tensor().unwrap().z_axis.z), (1, 1.0));
        assert_eq!(at(0.25, Half::Upper).tensor(), None);
        let all: f64 = regions.iter().map(|region| region.fibres.volume).sum();
        assert!(close(all, 2.0 * each));
    }

    #[test]
    fn heights_part_the_volume() {
        let column = Column { low: 1.0, size: 0.5, volumes: vec![0.0, 2.0, 1.0, 0.0] };
        assert_eq!([0.0, 0.5, 1.0].map(|share| column.height(share)), [1.5, 1.875, 2.5]);
        assert_eq!([1.2, 1.75, 2.25, 9.0].map(|height| column.below(height)), [0.0, 1.0, 2.5, 3.0]);
        assert_eq!(column.span(), Some([1.5, 2.5]));
    }
}
