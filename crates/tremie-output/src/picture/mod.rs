//! Pictures as PNG files: fields over a grid in colour, and line plots.
//!
//! Grids and circles are in metres and labelled in millimetres, with the same scale along both axes. Colours are
//! perceptually uniform. What is shown between cell centres is a cubic B-spline of the cell values, which smooths over
//! about half a cell, and edges are smoothed over about a cell more; numbers must be read from the arrays, not from the
//! picture.

mod axes;
mod canvas;
mod ellipses;
mod field;
mod grid;
mod plot;

use std::io;
use std::path::Path;

pub use canvas::Picture;
pub use ellipses::{Ellipse, EllipseMap, Frame};
pub use field::{Circle, Cut, HeightMap};
pub use grid::Grid;
pub use plot::{Axis, Curve, Plot, Reference, Style};

use crate::{Error, atomic};

/// A perceptually uniform sequence of colours, from low to high.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Palette {
    /// Dark blue over green to yellow.
    #[default]
    Viridis,
    /// Black over purple to light yellow.
    Magma,
    /// Blue over grey to yellow; looks the same to the colour-blind.
    Cividis,
}

impl Palette {
    /// Colour at `t` from 0 to 1.
    fn at(self, t: f64) -> canvas::Colour {
        let gradient = match self {
            Self::Viridis => colorous::VIRIDIS,
            Self::Magma => colorous::MAGMA,
            Self::Cividis => colorous::CIVIDIS,
        };
        gradient.eval_continuous(t.clamp(0.0, 1.0)).as_array()
    }
}

impl Picture {
    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        atomic::write_with(path, |file| self.encode(file))
    }

    /// Writes the picture as PNG into anything.
    ///
    /// # Errors
    /// If `sink` refuses.
    pub fn encode(&self, sink: &mut dyn io::Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(sink, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        Ok(writer.finish()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back_as_drawn() {
        let picture = Picture { width: 3, height: 2, rgb: (0..18).map(|n| n * 14).collect() };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        picture.write(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Rgb));
        assert_eq!(rgb, picture.rgb);
    }

    #[test]
    fn palettes_grow_lighter() {
        for palette in [Palette::Viridis, Palette::Magma, Palette::Cividis] {
            let lightness = |t: f64| {
                let [r, g, b] = palette.at(t).map(f64::from);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            assert!((1..=20).all(|n| lightness(f64::from(n) / 20.0) > lightness(f64::from(n - 1) / 20.0)));
        }
    }
}
