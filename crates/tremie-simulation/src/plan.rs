//! The body seen from above: quantities over the plan (x, y).
//!
//! A quantity is known at the centres of the columns of cells and interpolated bilinearly between them. The vertical is
//! z. Beyond a symmetry plane the body goes on mirrored; beyond any other side of the domain the last column is
//! repeated, so that fluid that stands against a wall is not thinned there; elsewhere beyond the cells of the
//! snapshot there is no fluid.

use std::ops::Range;

use tremie_numerics::DVec2;

use crate::Cells;

/// A quantity over the columns of one snapshot and their mirror images.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plan {
    axes: [Axis; 2],
    /// Edge of a column in m.
    size: f64,
    values: Vec<f64>,
}

/// The cells of a snapshot along one axis, and how the body goes on beyond them; counted from the first cell's lower
/// side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis {
    /// Coordinate in m of the first cell's lower side.
    origin: f64,
    /// Edge of a cell in m.
    size: f64,
    count: isize,
    /// Sides of the domain.
    domain: [isize; 2],
    symmetry: [bool; 2],
}

impl Axis {
    /// The axis number `a` (x, y, z) of cells.
    pub(crate) fn new(cells: &Cells, a: usize) -> Self {
        let side = |s: usize| ((cells.domain[s][a] - cells.origin[a]) / cells.size).round() as isize;
        Self {
            origin: cells.origin[a],
            size: cells.size,
            count: cells.count[a] as isize,
            domain: [side(0), side(1)],
            symmetry: cells.symmetry[a],
        }
    }

    /// Coordinate in m of the lower side of the cell at place `i`.
    pub(crate) fn coordinate(&self, i: isize) -> f64 {
        self.origin + i as f64 * self.size
    }

    /// The place in which a coordinate in m lies.
    pub(crate) fn place(&self, coordinate: f64) -> isize {
        ((coordinate - self.origin) / self.size).floor() as isize
    }

    /// Number of the cell whose value holds at the place `i`, or none where there is no fluid.
    pub(crate) fn cell(&self, mut i: isize) -> Option<usize> {
        let [low, high] = self.domain;
        if i < low {
            i = if self.symmetry[0] { 2 * low - 1 - i } else { low };
        } else if i >= high {
            i = if self.symmetry[1] { 2 * high - 1 - i } else { high - 1 };
        }
        (0..self.count).contains(&i).then_some(i as usize)
    }

    /// The places that the whole body, with its mirror images, may cover.
    pub(crate) fn extent(&self) -> Range<isize> {
        let [low, high] = self.domain;
        let from = if self.symmetry[0] { 2 * low - high } else { low };
        from..if self.symmetry[1] { 2 * high - low } else { high }
    }

    /// Those of them from the first to the last with a cell of the snapshot.
    fn seen(&self) -> Range<isize> {
        let ([low, high], whole) = (self.domain, self.extent());
        let from = if self.symmetry[0] { 2 * low - self.count } else { 0 };
        let end = if self.symmetry[1] { 2 * high } else { self.count };
        from.max(whole.start)..end.min(whole.end)
    }

    /// Where places begin and end, in m.
    pub(crate) fn span(&self, places: Range<isize>) -> [f64; 2] {
        [self.coordinate(places.start), self.coordinate(places.end)]
    }
}

impl Plan {
    /// Column height in m: the sum of the fill over z times the edge of a cell.
    pub(crate) fn height(cells: &Cells) -> Self {
        Self::new(cells, |sum, fill| sum + fill * cells.size)
    }

    /// Share of each column's base, 0 to 1, that fluid stands on or hangs over: the largest fill over z.
    ///
    /// Where a steep front cuts a column this is the share of the base on its wet side; in a film thinner than a cell
    /// it is the thickness in cells.
    pub(crate) fn cover(cells: &Cells) -> Self {
        Self::new(cells, f64::max)
    }

    /// Gathers each column's fill from the lowest cell to the highest, beginning with 0.
    fn new(cells: &Cells, gather: impl Fn(f64, f64) -> f64) -> Self {
        let [nx, ny, _] = cells.count;
        let mut values = vec![0.0; nx * ny];
        if !values.is_empty() {
            for layer in cells.fill.chunks_exact(nx * ny) {
                for (value, fill) in values.iter_mut().zip(layer) {
                    *value = gather(*value, *fill);
                }
            }
        }
        Self { axes: [Axis::new(cells, 0), Axis::new(cells, 1)], size: cells.size, values }
    }

    /// Value in the column at place (i, j), counted from the snapshot's first; any place may be asked for.
    fn column(&self, i: isize, j: isize) -> f64 {
        match (self.axes[0].cell(i), self.axes[1].cell(j)) {
            (Some(i), Some(j)) => self.values[i + self.axes[0].count as usize * j],
            _ => 0.0,
        }
    }

    /// Value at a point (x, y) in m, interpolated between the four columns around it.
    pub(crate) fn at(&self, point: DVec2) -> f64 {
        let origin = DVec2::new(self.axes[0].origin, self.axes[1].origin);
        let place = (point - origin) / self.size - 0.5;
        let (i, j) = (floor(place.x), floor(place.y));
        let t = place - DVec2::new(i as f64, j as f64);
        let row = |j| self.column(i, j) * (1.0 - t.x) + self.column(i + 1, j) * t.x;
        row(j) * (1.0 - t.y) + row(j + 1) * t.y
    }

    /// Largest value.
    pub(crate) fn max(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// Edge of a column in m.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Lower and upper corner in m of what the whole body, with its mirror images, may cover.
    pub(crate) fn extent(&self) -> [DVec2; 2] {
        self.corners(|axis| axis.extent())
    }

    /// Lower and upper corner in m of what holds all points but those where the value is 0.
    pub(crate) fn seen(&self) -> [DVec2; 2] {
        // As far as to the centres of the columns beyond.
        self.corners(|axis| axis.seen().start - 1..axis.seen().end + 1)
    }

    fn corners(&self, places: impl Fn(&Axis) -> Range<isize>) -> [DVec2; 2] {
        let [x, y] = self.axes.map(|axis| axis.span(places(&axis)));
        [0, 1].map(|s| DVec2::new(x[s], y[s]))
    }

    /// Values of all columns that the whole body may cover, x fastest, and their number along x and y.
    pub(crate) fn whole(&self) -> ([usize; 2], Vec<f64>) {
        let [is, js] = self.axes.map(|axis| axis.extent());
        let count = [is.len(), js.len()];
        (count, js.flat_map(|j| is.clone().map(move |i| self.column(i, j))).collect())
    }
}

/// Largest integer not above `x`. (What the library has is a call where the processor is not known.)
fn floor(x: f64) -> isize {
    let whole = x as isize;
    whole - isize::from(whole as f64 > x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    /// Two by one columns of height 0.3 and 0.1 m, away from the sides of a domain of 4 x 2 columns.
    fn cells(symmetry: [[bool; 2]; 3]) -> Cells {
        Cells {
            origin: DVec3::new(1.1, 0.1, 0.0),
            size: 0.1,
            count: [2, 1, 3],
            fill: vec![1.0, 0.7, 1.0, 0.3, 1.0, 0.0],
            domain: [DVec3::new(1.0, 0.0, 0.0), DVec3::new(1.4, 0.2, 0.3)],
            symmetry,
            ..Cells::default()
        }
    }

    #[test]
    fn the_whole_body_is_shown_with_its_mirror_images() {
        let plan = Plan::height(&cells([[false; 2]; 3]));
        let (count, height) = plan.whole();
        assert_eq!(count, [4, 2]);
        assert!((plan.extent()[1] - DVec2::new(1.4, 0.2)).length() < 1e-12);
        let rounded = |v: &[f64]| v.iter().map(|h| (h * 10.0).round() as i32).collect::<Vec<_>>();
        assert_eq!(rounded(&height), [0, 0, 0, 0, 0, 3, 1, 0]);

        let plan = Plan::height(&cells([[true, false], [false, true], [false; 2]]));
        let (count, height) = plan.whole();
        assert_eq!(count, [8, 4]);
        assert!((plan.extent()[0] - DVec2::new(0.6, 0.0)).length() < 1e-12);
        let (dry, wet) = ([0; 8], [0, 1, 3, 0, 0, 3, 1, 0]);
        assert_eq!(rounded(&height), [dry, wet, wet, dry].concat());
    }

    #[test]
    fn heights_are_interpolated_and_cover_is_the_fullest_cell() {
        let cells = cells([[false; 2]; 3]);
        let (height, cover) = (Plan::height(&cells), Plan::cover(&cells));
        // Half-way between the columns; the side of the domain repeats them.
        assert!((height.at(DVec2::new(1.2, 0.15)) - 0.2).abs() < 1e-12);
        assert!((cover.at(DVec2::new(1.25, 0.2)) - 0.7).abs() < 1e-12);
        assert!((cover.at(DVec2::new(1.3, 0.15)) - 0.35).abs() < 1e-12);
        assert!((height.max() - 0.3).abs() < 1e-12);
    }
}
