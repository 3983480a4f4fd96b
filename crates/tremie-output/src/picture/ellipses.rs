//! Ellipses over the outline of a body seen from above, such as those that show how fibres lie (Svec 2013, Figures 7.11 to 7.15).

use std::f64::consts::TAU;

use super::axes::{Scale, TICK, class_colour};
use super::canvas::{INK, Lettering, Pen};
use super::field::{Edge, Sheet, covered, outlined};
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
    /// Names of classes, shown in colours of their own instead of a scale: first of what is inside of the outline, then of the ellipses, whose values
    /// are numbers of classes. Such ellipses are lines, so that one does not hide another.
    pub classes: Option<&'a [&'a str]>,
    /// Rectangles around some of it.
    pub frames: &'a [Frame<'a>],
}

/// A rectangle with a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<'a> {
    /// Lower corner in metres.
    pub low: [f64; 2],
    /// Upper corner in metres.
    pub high: [f64; 2],
    /// Its name.
    pub label: &'a str,
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
        let edge = Edge::new(&self.grid, &covered);
        let largest = self.ellipses.iter().map(|ellipse| ellipse.value).fold(0.0, f64::max);
        let scale = Scale::new(0.0, largest, false);
        let mut sheet = Sheet::new(&self.grid);
        sheet.axes.draw_grid(&mut sheet.canvas);
        let body = if self.classes.is_some() { class_colour(0) } else { BODY };
        sheet.paint(&self.grid, |point, pixel| Some(outlined(body, edge.distance(point, pixel)?)));
        sheet.canvas.clip(Some(sheet.axes.area));
        for ellipse in self.ellipses {
            let points: Vec<[f64; 2]> =
                ellipse.points().map(|point| sheet.axes.pixel(point.map(|x| 1e3 * x))).collect();
            if self.classes.is_some() {
                let closed: Vec<[f64; 2]> = points.iter().chain(points.first()).copied().collect();
                let pen = Pen { colour: class_colour(ellipse.value as usize), width: 2.5, dashed: false };
                sheet.canvas.line(&closed, pen);
                continue;
            }
            let colour = self.palette.at(scale.position(ellipse.value));
            sheet.canvas.polygon(&points, colour, Pen { colour: INK, width: 1.0, dashed: false });
        }
        for frame in self.frames {
            let [[left, bottom], [right, top]] =
                [frame.low, frame.high].map(|corner| sheet.axes.pixel(corner.map(|x| 1e3 * x)));
            let corners = [[left, bottom], [right, bottom], [right, top], [left, top], [left, bottom]];
            sheet.canvas.line(&corners, Pen { colour: INK, width: 2.0, dashed: false });
            let lettering = Lettering { outlined: true, ..TICK };
            sheet.canvas.text(frame.label, [left + 6.0, top + 6.0], [0.0, 0.0], lettering, INK);
        }
        sheet.canvas.clip(None);
        if let Some(names) = self.classes {
            return Ok(sheet.finish_with_classes(self.title, ["x", "y"], names));
        }
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
                classes: None,
                frames: &[],
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

    /// Lines in the colours of the classes and around the frame; nothing is filled.
    #[test]
    fn classes_are_lines_in_frames() {
        let grid = Grid { origin: [0.0; 2], spacing: [0.01; 2], cells: [40, 40], mirror: [false; 2] };
        let height = vec![0.1; 1600];
        let draw = |ellipses: &[Ellipse], frames: &[Frame]| {
            let map = EllipseMap {
                title: "",
                grid,
                height: &height,
                ellipses,
                quantity: "",
                palette: Palette::Viridis,
                classes: Some(&["concrete", "lower half", "upper half"]),
                frames,
            };
            map.draw().unwrap()
        };
        let count = |picture: &Picture, colour: [u8; 3]| {
            picture.rgb.as_chunks::<3>().0.iter().filter(|p| **p == colour).count() as f64
        };
        let half_axes = [[0.1, 0.0], [0.0, 0.1]];
        let ellipse = |value| Ellipse { centre: [0.2; 2], half_axes, value };
        let plain = draw(&[], &[]);
        for class in [1, 2] {
            let drawn = draw(&[ellipse(class as f64)], &[]);
            let found = count(&drawn, class_colour(class)) - count(&plain, class_colour(class));
            // 225 pixels of radius; of the line's width some is smoothed at its edges.
            assert!((1.0..3.0).contains(&(found / (TAU * 225.0))), "{found}");
        }
        let framed = draw(&[], &[Frame { low: [0.1; 2], high: [0.3; 2], label: "" }]);
        let found = count(&framed, INK) - count(&plain, INK);
        assert!((1.0..3.0).contains(&(found / (4.0 * 450.0))), "{found}");
    }
}
