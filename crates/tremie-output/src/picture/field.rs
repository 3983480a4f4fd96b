//! Fields over a plane grid in colour: the surface seen from above, and cuts.

use std::f64::consts::FRAC_1_SQRT_2;

use super::axes::{Axes, Scale, TICK, class_colour, draw_classes, draw_colour_bar};
use super::canvas::{Area, Canvas, Colour, INK, Lettering, Pen, mix};
use super::grid::{Along, Place};
use super::{Grid, Palette, Picture};
use crate::Error;

const SOLID: Colour = [190, 190, 190];

/// The surface of a body seen from above, coloured by its height.
#[derive(Debug, Clone)]
pub struct HeightMap<'a> {
    /// Title above the picture.
    pub title: &'a str,
    /// The cells, along x and y.
    pub grid: Grid,
    /// Height above the floor in metres, a cell each; where it is not positive there is nothing.
    pub height: &'a [f32],
    /// Heights in metres at the ends of the colours; from 0 to the largest if not given.
    pub range: Option<[f64; 2]>,
    /// Colours.
    pub palette: Palette,
    /// Circles to compare with, drawn dashed.
    pub circles: &'a [Circle<'a>],
    /// Lines over it, such as fibres, by both ends in metres.
    pub lines: &'a [[[f64; 2]; 2]],
}

/// A circle drawn over a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle<'a> {
    /// Centre in metres.
    pub centre: [f64; 2],
    /// Radius in metres.
    pub radius: f64,
    /// What it stands for, for instance "500 mm".
    pub label: &'a str,
}

/// A scalar field in a plane through the fluid.
#[derive(Debug, Clone)]
pub struct Cut<'a> {
    /// Title above the picture.
    pub title: &'a str,
    /// The cells, along the horizontal and the vertical axis of the picture.
    pub grid: Grid,
    /// Names of the axes, without unit, for instance "x" and "z".
    pub axes: [&'a str; 2],
    /// What is shown, with the unit of its values, for instance "speed \[m/s\]".
    pub quantity: &'a str,
    /// The field, a cell each; NaN where it is not known.
    pub values: &'a [f32],
    /// Share of each cell that is filled, from 0 (air, left white) to 1; NaN for a solid, painted grey. All cells are
    /// full if not given.
    pub fill: Option<&'a [f32]>,
    /// Values at the ends of the colours; the extremes over the fluid if not given, or zero where that is lower than
    /// all values.
    pub range: Option<[f64; 2]>,
    /// Colours.
    pub palette: Palette,
    /// Names of classes, shown in colours of their own instead of a scale. Of two, the second has values from one half on; of more,
    /// the value is the number of the class, from 0.
    pub classes: Option<&'a [&'a str]>,
    /// Whether the lower face is a floor.
    pub floor: bool,
}

impl HeightMap<'_> {
    /// Draws the picture.
    ///
    /// # Errors
    /// If the grid has no cells or not one height each.
    pub fn draw(&self) -> Result<Picture, Error> {
        self.grid.check("height", self.height)?;
        let body = |n: usize| self.height[n] > 0.0;
        let covered = covered(&self.grid, self.height);
        let height = self.grid.fill_gaps(self.height, body);
        let highest = self.height.iter().copied().filter(|h| h.is_finite()).fold(0.0, f32::max);
        let [low, high] = self.range.unwrap_or([0.0, f64::from(highest)]);
        let scale = Scale::new(1e3 * low, 1e3 * high, false);

        let edge = Edge::new(&self.grid, &covered);

        let mut sheet = Sheet::new(&self.grid);
        sheet.axes.draw_grid(&mut sheet.canvas);
        sheet.paint(&self.grid, |point, pixel| {
            let distance = edge.distance(point, pixel)?;
            let (h, slope) = self.grid.sample(&height, point);
            let light = hill_shade(slope);
            let colour =
                self.palette.at(scale.position(1e3 * h)).map(|c| (f64::from(c) * light).min(255.0) as u8);
            Some(outlined(colour, distance))
        });
        sheet.draw_lines(self.lines);
        sheet.draw_circles(self.circles);
        Ok(sheet.finish(self.title, ["x", "y"], scale, self.palette, "height [mm]"))
    }
}

/// Share of each cell that a body of these heights covers, smoothed. A column that the front has only partly crossed is lower
/// than its neighbours by that share; without this the edge would be a staircase.
pub(super) fn covered(grid: &Grid, height: &[f32]) -> Vec<f32> {
    // Slopes within the body must not look like its edge.
    const FULL: f32 = 0.7;
    let share = |n: usize| {
        let highest = grid.around(n).map(|(m, _)| height[m]).fold(0.0, f32::max);
        if height[n] > 0.0 { (height[n] / (FULL * highest)).min(1.0) } else { 0.0 }
    };
    let mut shares: Vec<f32> = (0..height.len()).map(share).collect();
    for _ in 0..2 {
        let smooth = |n| grid.around(n).map(|(m, weight)| weight * shares[m]).sum();
        shares = (0..shares.len()).map(smooth).collect();
    }
    shares
}

impl Cut<'_> {
    /// Draws the picture.
    ///
    /// # Errors
    /// If the grid has no cells or not one value each.
    pub fn draw(&self) -> Result<Picture, Error> {
        self.grid.check(self.quantity, self.values)?;
        let fill = match self.fill {
            Some(fill) => {
                self.grid.check("fill", fill)?;
                fill
            }
            None => &vec![1.0; self.values.len()],
        };
        let fluid = |n: usize| fill[n] >= 0.5;
        let known = || (0..fill.len()).filter(|&n| fluid(n) && self.values[n].is_finite());
        let extremes = known().map(|n| f64::from(self.values[n]));
        let (low, high) = extremes.fold((0.0f64, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        let [low, high] = self.range.unwrap_or([low, high]);
        let scale = Scale::new(low, high, false);
        let values = self.grid.fill_gaps(self.values, fluid);
        // The fluid is continued into solids, so that it meets them without a gap.
        let smooth_fill = self.grid.fill_gaps(fill, |n| !fill[n].is_nan());

        let edge = Edge::new(&self.grid, &smooth_fill);

        let mut sheet = Sheet::new(&self.grid);
        sheet.paint(&self.grid, |point, pixel| {
            if fill[self.grid.nearest(point)].is_nan() {
                return Some((SOLID, 1.0));
            }
            let distance = edge.distance(point, pixel)?;
            let (value, _) = self.grid.sample(&values, point);
            let colour = match self.classes {
                Some([_, _]) => class_colour(usize::from(value >= 0.5)),
                Some(_) => class_colour(self.values[self.grid.nearest(point)] as usize),
                None => self.palette.at(scale.position(value)),
            };
            Some(outlined(colour, distance))
        });
        if self.floor {
            let Area { left, .. } = sheet.axes.area;
            let (right, bottom) = (sheet.axes.area.right(), sheet.axes.area.bottom());
            sheet
                .canvas
                .line(&[[left, bottom], [right, bottom]], Pen { colour: INK, width: 5.0, dashed: false });
        }
        if let Some(names) = self.classes {
            return Ok(sheet.finish_with_classes(self.title, self.axes, names));
        }
        Ok(sheet.finish(self.title, self.axes, scale, self.palette, self.quantity))
    }
}

/// A canvas laid out for a grid: axes in millimetres, equal along both, and room for a colour bar.
pub(super) struct Sheet {
    pub(super) canvas: Canvas,
    pub(super) axes: Axes,
    bar: Area,
}

impl Sheet {
    pub(super) fn new(grid: &Grid) -> Self {
        const LEFT: f64 = 110.0;
        const TOP: f64 = 76.0;
        const BELOW: f64 = 96.0;
        let [x, y] = [grid.extent(0), grid.extent(1)];
        let aspect = (x[1] - x[0]) / (y[1] - y[0]);
        // Flat pictures have their colour bar below, others beside.
        let flat = aspect > 2.0;
        let (most_width, beside) = if flat { (1140.0, 50.0) } else { (940.0, 190.0) };
        let width = f64::min(most_width, 900.0 * aspect).round().max(20.0);
        let height = (width / aspect).round().clamp(20.0, 900.0);
        let total_width = f64::max(LEFT + width + beside, 920.0);
        let spare = (0.5 * (total_width - LEFT - width - beside)).round();
        let area = Area { left: LEFT + spare, top: TOP, width, height };
        let (bar, under_bar) = if flat {
            let bar_width = (0.6 * width).round();
            let left = area.left + (0.5 * (width - bar_width)).round();
            (Area { left, top: area.bottom() + BELOW, width: bar_width, height: 24.0 }, BELOW)
        } else {
            (Area { left: area.right() + 40.0, top: TOP, width: 26.0, height }, 0.0)
        };
        let total_height = area.bottom() + BELOW + if flat { bar.height + under_bar } else { 0.0 };
        let millimetres = |[low, high]: [f64; 2]| Scale::new(1e3 * low, 1e3 * high, false);
        Self {
            canvas: Canvas::new(total_width as u32, total_height as u32),
            axes: Axes { area, x: millimetres(x), y: millimetres(y) },
            bar,
        }
    }

    /// Colours the pixels by what is seen of a grid from their centres, and their size in metres.
    pub(super) fn paint(&mut self, grid: &Grid, colour: impl Fn(Place, f64) -> Option<(Colour, f64)> + Sync) {
        let Axes { area, x, y } = self.axes;
        let size = 1e-3 * (x.value(1.0) - x.value(0.0)) / area.width;
        let [columns, rows] = area.centres();
        let across = |column| grid.along(0, 1e-3 * x.value((column - area.left) / area.width));
        let up = |row| grid.along(1, 1e-3 * y.value((area.bottom() - row) / area.height));
        let across: Vec<Along> = columns.into_iter().map(across).collect();
        let up: Vec<Along> = rows.into_iter().map(up).collect();
        self.canvas.paint(area, |[column, row]| colour([&across[column], &up[row]], size));
    }

    fn draw_lines(&mut self, lines: &[[[f64; 2]; 2]]) {
        self.canvas.clip(Some(self.axes.area));
        for line in lines {
            let ends = line.map(|end| self.axes.pixel(end.map(|x| 1e3 * x)));
            self.canvas.line(&ends, Pen { colour: INK, width: 1.0, dashed: false });
        }
        self.canvas.clip(None);
    }

    fn draw_circles(&mut self, circles: &[Circle]) {
        let Axes { area, x, .. } = self.axes;
        self.canvas.clip(Some(area));
        for circle in circles {
            let centre = self.axes.pixel(circle.centre.map(|c| 1e3 * c));
            let radius = 1e3 * circle.radius * area.width / (x.value(1.0) - x.value(0.0));
            self.canvas.circle(centre, radius, Pen { colour: [255; 3], width: 4.5, dashed: false });
            self.canvas.circle(centre, radius, Pen { colour: INK, width: 2.0, dashed: true });
            let diagonal = (radius + 12.0) * FRAC_1_SQRT_2;
            let at = [centre[0] + diagonal, centre[1] - diagonal];
            let lettering = Lettering { outlined: true, ..TICK };
            self.canvas.text(circle.label, at, [0.0, 1.0], lettering, INK);
        }
        self.canvas.clip(None);
    }

    pub(super) fn finish(
        mut self,
        title: &str,
        axes: [&str; 2],
        scale: Scale,
        palette: Palette,
        quantity: &str,
    ) -> Picture {
        draw_colour_bar(&mut self.canvas, self.bar, scale, palette, quantity);
        self.frame(title, axes)
    }

    pub(super) fn finish_with_classes(mut self, title: &str, axes: [&str; 2], names: &[&str]) -> Picture {
        draw_classes(&mut self.canvas, self.bar, names);
        self.frame(title, axes)
    }

    fn frame(mut self, title: &str, axes: [&str; 2]) -> Picture {
        let [x, y] = axes.map(|name| format!("{name} [mm]"));
        self.axes.draw_frame(&mut self.canvas, title, [&x, &y]);
        self.canvas.finish()
    }
}

/// Where a share of cells between 0 and 1 passes one half: the edge of what is shown.
pub(super) struct Edge<'a> {
    grid: &'a Grid,
    share: &'a [f32],
    /// Cells from anywhere in which all that is seen of the share is the same: most of a picture, inside and out.
    even: Vec<bool>,
}

impl<'a> Edge<'a> {
    pub(super) fn new(grid: &'a Grid, share: &'a [f32]) -> Self {
        Self { grid, share, even: grid.even(share) }
    }

    /// Distance in pixels from a point inwards to the edge; `None` well outside.
    pub(super) fn distance(&self, point: Place, pixel: f64) -> Option<f64> {
        let cell = self.grid.nearest(point);
        let (value, gradient) = match self.even[cell] {
            true => (f64::from(self.share[cell]), [0.0; 2]),
            false => self.grid.sample(self.share, point),
        };
        let slope = (gradient[0] * gradient[0] + gradient[1] * gradient[1]).sqrt() * pixel;
        let distance = (value - 0.5) / slope.max(1e-9);
        (distance > -2.0).then_some(distance)
    }
}

/// The colour of a pixel at a distance from the edge of its body, which has a dark outline; and how much it covers.
pub(super) fn outlined(colour: Colour, distance: f64) -> (Colour, f64) {
    const OUTLINE: f64 = 2.0;
    let line = (OUTLINE + 0.5 - distance).clamp(0.0, 1.0);
    let colour = std::array::from_fn(|n| mix(colour[n], INK[n], line));
    (colour, (distance + 0.5).clamp(0.0, 1.0))
}

/// Brightness of a slope lit from the upper left, 1 where it is level.
fn hill_shade([dx, dy]: [f64; 2]) -> f64 {
    const EXAGGERATION: f64 = 1.5;
    const STRENGTH: f64 = 0.55;
    let light = [-0.5, 0.5, FRAC_1_SQRT_2];
    let normal = [-EXAGGERATION * dx, -EXAGGERATION * dy, 1.0];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    let lit = normal.iter().zip(light).map(|(n, l)| n * l).sum::<f64>() / length;
    1.0 + STRENGTH * (lit.max(0.0) / light[2] - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of radius 0.3 m and height 0.1 m in a square of 0.8 m, as mean heights of cells of 0.01 m.
    fn quarter_disc() -> (Grid, Vec<f32>) {
        let grid = Grid { origin: [0.0; 2], spacing: [0.01; 2], cells: [40, 40], mirror: [true; 2] };
        let inside = |x: f64, y: f64| f64::from(u8::from(x.hypot(y) < 0.3));
        let at = |cell: usize, part: usize| 0.01 * (cell as f64 + (part as f64 + 0.5) / 10.0);
        let mean =
            |n: usize| (0..100).map(|p| inside(at(n % 40, p % 10), at(n / 40, p / 10))).sum::<f64>() / 100.0;
        (grid, (0..1600).map(|n| 0.1 * mean(n) as f32).collect())
    }

    fn map<'a>(grid: Grid, height: &'a [f32]) -> HeightMap<'a> {
        HeightMap {
            title: "Disc",
            grid,
            height,
            range: None,
            palette: Palette::Viridis,
            circles: &[],
            lines: &[],
        }
    }

    /// Saturated pixels: the body in colour, not the grey and black of frame and text.
    fn coloured(picture: &Picture) -> usize {
        let pixels = picture.rgb.as_chunks::<3>().0;
        pixels.iter().filter(|p| p.iter().max().unwrap() - p.iter().min().unwrap() > 60).count()
    }

    #[test]
    fn a_mirrored_quarter_shows_the_whole_body_in_its_true_size() {
        let (grid, height) = quarter_disc();
        let picture = map(grid, &height).draw().unwrap();
        assert!(picture.width >= 900);
        assert_eq!(picture.rgb.len(), 3 * (picture.width * picture.height) as usize);
        let area = Sheet::new(&grid).axes.area;
        assert_eq!(area.width, area.height);
        let bar = Sheet::new(&grid).bar;
        let metre = area.width / 0.8;
        // Less the dark outline of about two pixels.
        let expected = std::f64::consts::PI * (0.3 * metre - 2.0).powi(2) + bar.width * bar.height;
        let found = coloured(&picture) as f64;
        assert!((found / expected - 1.0).abs() < 0.02, "{found} pixels against {expected}");
    }

    #[test]
    fn nothing_to_show_is_an_empty_frame() {
        let (grid, _) = quarter_disc();
        let picture = map(grid, &vec![0.0; 1600]).draw().unwrap();
        let bar = Sheet::new(&grid).bar;
        assert!((coloured(&picture) as f64) < 1.02 * bar.width * bar.height);
        let nothing_known = map(grid, &vec![f32::NAN; 1600]).draw();
        assert!(nothing_known.is_ok());
    }

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        let (grid, height) = quarter_disc();
        assert!(matches!(map(grid, &height[1..]).draw(), Err(Error::Length { expected: 1600, .. })));
        for (cells, spacing) in [([0, 40], [0.01; 2]), ([40, 40], [0.01, f64::NAN]), ([40, 40], [0.0, 0.01])]
        {
            let odd = Grid { cells, spacing, ..grid };
            assert!(matches!(map(odd, &height).draw(), Err(Error::EmptyGrid)), "{odd:?}");
        }
    }

    #[test]
    fn cuts_of_any_shape_can_be_drawn() {
        for cells in [[1, 1], [1, 400], [4000, 1], [30, 20]] {
            let grid = Grid { origin: [0.0; 2], spacing: [0.01; 2], cells, mirror: [false; 2] };
            let count = cells[0] * cells[1];
            let values: Vec<f32> = (0..count).map(|n| if n % 7 == 3 { f32::NAN } else { n as f32 }).collect();
            let fill: Vec<f32> =
                (0..count).map(|n| if n % 5 == 2 { f32::NAN } else { (n % 3) as f32 }).collect();
            let cut = Cut {
                title: "",
                grid,
                axes: ["x", "z"],
                quantity: "speed [m/s]",
                values: &values,
                fill: Some(&fill),
                range: None,
                palette: Palette::Magma,
                classes: (cells[0] > 100).then_some(&["below", "above"]),
                floor: true,
            };
            let picture = cut.draw().unwrap();
            assert!(picture.width >= 900 && picture.height < 1200, "{} x {}", picture.width, picture.height);
        }
    }
}
