//! Ellipses over the outline of a body seen from above, such as those that show how fibres lie (Svec 2013, Figures 7.11 to 7.15).

use std::f64::consts::TAU;

use super::axes::Scale;
use super::canvas::{INK, Pen};
use super::field::{Sheet, covered, edge_distance, outlined};
use super::{Grid, Palette, Picture};
use crate::Error;

/// What is inside of the outline, behind the ellipses.
const BODY: [u8; 3] = [240; 3];

/// Ellipses over the outline of a body.
#[derive(Debug, Clone)]
pub struct EllipseMap<'a> {
    /// Title above the picture.
    pub title: &'a str,
    /// The cells of the body, along x and y.
    pub grid: Grid,
    /// Height of the body in metres, a cell each; where it is not positive there is nothing.
    pub height: &'a [f32],
    /// The ellipses.
    pub ellipses: &'a [Ellipse],
    /// What their colours stand for, with its unit.
    pub quantity: &'a str,
    /// Colours.
    pub palette: Palette,
}

/// An ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Centre in metres.
    pub centre: [f64; 2],
    /// Both half-axes in metres, square to each other.
    pub half_axes: [[f64; 2]; 2],
    /// What its colour shows.
    pub value: f64,
}

impl Ellipse {
    /// So many points along it, in metres.
    fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        const POINTS: i32 = 60;
        (0..POINTS).map(|n| {
            let (sin, cos) = (TAU * f64::from(n) / f64::from(POINTS)).sin_cos();
            [0, 1].map(|d| self.centre[d] + cos * self.half_axes[0][d] + sin * self.half_axes[1][d])
        })
    }
}

impl EllipseMap<'_> {
    /// Draws the picture.
    ///
    /// # Errors
    /// If the grid has no cells or not one height each.
    pub fn draw(&self) -> Result<Picture, Error> {
        self.grid.check("height", self.height)?;
        let covered = covered(&self.grid, self.height);
        let largest = self.ellipses.iter().map(|ellipse| ellipse.value).fold(0.0, f64::max);
        let scale = Scale::new(0.0, largest, false);
        let mut sheet = Sheet::new(&self.grid);
        sheet.axes.draw_grid(&mut sheet.canvas);
        sheet.paint(|point, pixel| Some(outlined(BODY, edge_distance(&self.grid, &covered, point, pixel)?)));
        sheet.canvas.clip(Some(sheet.axes.area));
        for ellipse in self.ellipses {
            let points: Vec<[f64; 2]> =
                ellipse.points().map(|point| sheet.axes.pixel(point.map(|x| 1e3 * x))).collect();
            let colour = self.palette.at(scale.position(ellipse.value));
            sheet.canvas.polygon(&points, colour, Pen { colour: INK, width: 1.0, dashed: false });
        }
        sheet.canvas.clip(None);
        Ok(sheet.finish(self.title, ["x", "y"], scale, self.palette, self.quantity))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ellipse covers pi a b of the sheet, whichever way it is turned.
    #[test]
    fn ellipses_have_their_size() {
        let grid = Grid { origin: [0.0; 2], spacing: [0.01; 2], cells: [40, 40], mirror: [false; 2] };
        let height = vec![0.1; 1600];
        let coloured = |ellipses: &[Ellipse]| {
            let map = EllipseMap {
                title: "",
                grid,
                height: &height,
                ellipses,
                quantity: "share [%]",
                palette: Palette::Viridis,
            };
            let picture = map.draw().unwrap();
            let pixels = picture.rgb.as_chunks::<3>().0;
            pixels.iter().filter(|p| p.iter().max().unwrap() - p.iter().min().unwrap() > 60).count() as f64
        };
        let bar = coloured(&[]);
        let (cos, sin) = (0.6, 0.8);
        let half_axes = [[0.1 * cos, 0.1 * sin], [-0.05 * sin, 0.05 * cos]];
        let ellipse = Ellipse { centre: [0.2; 2], half_axes, value: 2.0 };
        // 900 pixels across 0.4 m; half of the line around it lies within.
        let pixel = 0.4 / 900.0;
        let expected = std::f64::consts::PI * (0.1 / pixel - 0.5) * (0.05 / pixel - 0.5);
        let found = coloured(&[ellipse]) - bar;
        assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
    }
}
