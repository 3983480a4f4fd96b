//! Lines, areas and text on a white sheet; positions in pixels from the upper left corner.

use std::ops::Range;
use std::sync::LazyLock;

use rayon::prelude::*;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform,
};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Red, green, blue.
pub(super) type Colour = [u8; 3];

pub(super) const INK: Colour = [38, 38, 38];
pub(super) const FAINT: Colour = [226, 226, 226];

/// A finished picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green and blue of each pixel, row by row from the top.
    pub rgb: Vec<u8>,
}

/// A rectangle in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Numbers of the columns and of the rows of pixels that it covers.
    fn pixels(&self) -> [Range<usize>; 2] {
        [self.left as usize..self.right() as usize, self.top as usize..self.bottom() as usize]
    }

    /// Where the centres of these columns and rows are.
    pub(super) fn centres(&self) -> [Vec<f64>; 2] {
        self.pixels().map(|pixels| pixels.map(|n| n as f64 + 0.5).collect())
    }

    pub(super) fn contains(&self, [x, y]: [f64; 2]) -> bool {
        x >= self.left && x <= self.right() && y >= self.top && y <= self.bottom()
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen {
    pub(super) colour: Colour,
    pub(super) width: f32,
    pub(super) dashed: bool,
}

/// Where a text stands relative to its position: shares of its width and of its height, 0 at the left and the top.
pub(super) type Anchor = [f64; 2];

/// Type of a text.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lettering {
    /// Size in pixels.
    pub(super) size: f64,
    pub(super) bold: bool,
    /// Turned to be read from the right side of the sheet.
    pub(super) upwards: bool,
    /// With a thin white outline, to be read on colours.
    pub(super) outlined: bool,
}

impl Lettering {
    pub(super) const fn plain(size: f64) -> Self {
        Self { size, bold: false, upwards: false, outlined: false }
    }
}

pub(super) struct Canvas {
    pixmap: Pixmap,
    clip: Option<Mask>,
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let mut pixmap = Pixmap::new(width, height).expect("the layouts give moderate sizes");
        pixmap.fill(tiny_skia::Color::WHITE);
        Self { pixmap, clip: None }
    }

    pub(super) fn finish(self) -> Picture {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        // All is drawn on opaque white, so that colours are not premultiplied.
        let rgb = self.pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        Picture { width, height, rgb }
    }

    /// Limits what is drawn from now on, except [`Self::paint`], to an area; `None` ends it.
    pub(super) fn clip(&mut self, area: Option<Area>) {
        self.clip = area.and_then(|area| {
            let mut mask = Mask::new(self.pixmap.width(), self.pixmap.height())?;
            mask.fill_path(&rectangle(area)?, FillRule::Winding, true, Transform::identity());
            Some(mask)
        });
    }

    /// Colours each pixel of an area by its column and row there; the share from 0 to 1 says how much of it is covered.
    pub(super) fn paint(&mut self, area: Area, colour: impl Fn([usize; 2]) -> Option<(Colour, f64)> + Sync) {
        let width = self.pixmap.width() as usize;
        let [columns, rows] = area.pixels();
        let lines = self.pixmap.data_mut().par_chunks_exact_mut(4 * width);
        lines.skip(rows.start).take(rows.len()).enumerate().for_each(|(row, line)| {
            let pixels = line.chunks_exact_mut(4).skip(columns.start).take(columns.len()).enumerate();
            for (column, pixel) in pixels {
                let Some((colour, share)) = colour([column, row]) else { continue };
                for (old, new) in pixel.iter_mut().zip(colour) {
                    *old = mix(*old, new, share);
                }
            }
        });
    }

    pub(super) fn fill(&mut self, area: Area, colour: Colour, opacity: f64) {
        if let Some(path) = rectangle(area) {
            self.fill_path(&path, colour, opacity);
        }
    }

    pub(super) fn disc(&mut self, [x, y]: [f64; 2], radius: f64, colour: Colour) {
        if let Some(path) = PathBuilder::from_circle(x as f32, y as f32, radius as f32) {
            self.fill_path(&path, colour, 1.0);
        }
    }

    pub(super) fn frame(&mut self, area: Area, pen: Pen) {
        if let Some(path) = rectangle(area) {
            self.stroke(&path, pen);
        }
    }

    pub(super) fn line(&mut self, points: &[[f64; 2]], pen: Pen) {
        let mut builder = PathBuilder::new();
        for (n, &[x, y]) in points.iter().enumerate() {
            if n == 0 {
                builder.move_to(x as f32, y as f32);
            } else {
                builder.line_to(x as f32, y as f32);
            }
        }
        if let Some(path) = builder.finish() {
            self.stroke(&path, pen);
        }
    }

    /// A polygon, closed from its last point to its first.
    pub(super) fn polygon(&mut self, points: &[[f64; 2]], colour: Colour, pen: Pen) {
        let mut builder = PathBuilder::new();
        for (n, &[x, y]) in points.iter().enumerate() {
            match n {
                0 => builder.move_to(x as f32, y as f32),
                _ => builder.line_to(x as f32, y as f32),
            }
        }
        builder.close();
        if let Some(path) = builder.finish() {
            self.fill_path(&path, colour, 1.0);
            self.stroke(&path, pen);
        }
    }

    pub(super) fn circle(&mut self, [x, y]: [f64; 2], radius: f64, pen: Pen) {
        if let Some(path) = PathBuilder::from_circle(x as f32, y as f32, radius as f32) {
            self.stroke(&path, pen);
        }
    }

    pub(super) fn text(
        &mut self,
        text: &str,
        [x, y]: [f64; 2],
        anchor: Anchor,
        lettering: Lettering,
        colour: Colour,
    ) {
        let face = face(lettering);
        let scale = lettering.size as f32 / f32::from(face.units_per_em());
        let mut outline = Outline { path: PathBuilder::new(), at: [0.0; 2], scale: 1.0 };
        for letter in text.chars().map(|c| letter(face, c)) {
            outline.at[1] = letter.raise;
            outline.scale = letter.scale;
            face.outline_glyph(letter.glyph, &mut outline);
            outline.at[0] += letter.advance;
        }
        // Anchored by the height of capitals: it looks centred where the line height does not.
        let capital = f64::from(face.capital_height().unwrap_or(face.ascender())) * f64::from(scale);
        let (dx, dy) = (-anchor[0] * text_width(text, lettering), (1.0 - anchor[1]) * capital);
        let place = if lettering.upwards {
            Transform::from_row(0.0, -scale, -scale, 0.0, (x + dy) as f32, (y - dx) as f32)
        } else {
            Transform::from_row(scale, 0.0, 0.0, -scale, (x + dx) as f32, (y + dy) as f32)
        };
        if let Some(path) = outline.path.finish().and_then(|path| path.transform(place)) {
            if lettering.outlined {
                self.stroke(&path, Pen { colour: [255; 3], width: 4.0, dashed: false });
            }
            self.fill_path(&path, colour, 1.0);
        }
    }

    fn fill_path(&mut self, path: &Path, colour: Colour, opacity: f64) {
        let paint = paint(colour, opacity);
        self.pixmap.fill_path(path, &paint, FillRule::Winding, Transform::identity(), self.clip.as_ref());
    }

    fn stroke(&mut self, path: &Path, pen: Pen) {
        let stroke = Stroke {
            width: pen.width,
            line_cap: if pen.dashed { LineCap::Butt } else { LineCap::Round },
            line_join: LineJoin::Round,
            dash: if pen.dashed { StrokeDash::new(vec![9.0, 6.0], 0.0) } else { None },
            ..Stroke::default()
        };
        let paint = paint(pen.colour, 1.0);
        self.pixmap.stroke_path(path, &paint, &stroke, Transform::identity(), self.clip.as_ref());
    }
}

/// Width of a text in pixels.
pub(super) fn text_width(text: &str, lettering: Lettering) -> f64 {
    let face = face(lettering);
    let units: f32 = text.chars().map(|c| letter(face, c).advance).sum();
    f64::from(units) * lettering.size / f64::from(face.units_per_em())
}

/// `share` of the new colour over the old one.
pub(super) fn mix(old: u8, new: u8, share: f64) -> u8 {
    // Rounded, as it is not negative.
    (f64::from(old) + (f64::from(new) - f64::from(old)) * share + 0.5) as u8
}

fn paint(colour: Colour, opacity: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(colour[0], colour[1], colour[2], (255.0 * opacity) as u8);
    paint
}

fn rectangle(area: Area) -> Option<Path> {
    let [x, y, w, h] = [area.left, area.top, area.width, area.height].map(|v| v as f32);
    Some(PathBuilder::from_rect(tiny_skia::Rect::from_xywh(x, y, w, h)?))
}

fn face(lettering: Lettering) -> &'static Face<'static> {
    static FACES: LazyLock<[Face<'static>; 2]> = LazyLock::new(|| {
        [ttf_noto_sans::REGULAR, ttf_noto_sans::BOLD]
            .map(|font| Face::parse(font, 0).expect("the font is compiled in and known to be sound"))
    });
    &FACES[usize::from(lettering.bold)]
}

/// A glyph as it is placed in a line of text, in font units.
struct Letter {
    glyph: GlyphId,
    advance: f32,
    scale: f32,
    raise: f32,
}

/// Superscripts are made from the plain characters: not every font has them all.
fn letter(face: &Face, c: char) -> Letter {
    const SUPERSCRIPTS: [(char, char); 11] = [
        ('⁰', '0'),
        ('¹', '1'),
        ('²', '2'),
        ('³', '3'),
        ('⁴', '4'),
        ('⁵', '5'),
        ('⁶', '6'),
        ('⁷', '7'),
        ('⁸', '8'),
        ('⁹', '9'),
        ('⁻', '−'),
    ];
    let raised = SUPERSCRIPTS.iter().find(|(superscript, _)| *superscript == c);
    let (plain, scale, raise) = match raised {
        Some(&(_, plain)) => (plain, 0.65, 0.36 * f32::from(face.units_per_em())),
        None => (c, 1.0, 0.0),
    };
    // Glyph 0 is an empty box, for characters that the font does not have.
    let glyph = face.glyph_index(plain).unwrap_or(GlyphId(0));
    let advance = scale * f32::from(face.glyph_hor_advance(glyph).unwrap_or(0));
    Letter { glyph, advance, scale, raise }
}

/// Collects glyph outlines side by side, in font units.
struct Outline {
    path: PathBuilder,
    /// Where the next glyph stands.
    at: [f32; 2],
    scale: f32,
}

impl Outline {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        (self.at[0] + self.scale * x, self.at[1] + self.scale * y)
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.place(x1, y1), self.place(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
