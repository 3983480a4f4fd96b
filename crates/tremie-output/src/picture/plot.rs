//! Line plots: one or more curves over common axes.

use super::Picture;
use super::axes::{Axes, Scale, TICK};
use super::canvas::{Area, Canvas, Colour, FAINT, INK, Lettering, Pen, text_width};

/// Okabe and Ito's colours, told apart by the colour-blind too; yellow is left out as too light for lines.
const COLOURS: [Colour; 6] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [230, 159, 0]];
const REFERENCE: Colour = [110, 110, 110];

/// Curves over common axes.
#[derive(Debug, Clone)]
pub struct Plot<'a> {
    /// Title above the plot.
    pub title: &'a str,
    /// Horizontal axis.
    pub x: Axis<'a>,
    /// Vertical axis.
    pub y: Axis<'a>,
    /// The curves, in the order of the legend.
    pub curves: Vec<Curve<'a>>,
    /// Dashed lines at values of y.
    pub horizontals: Vec<Reference<'a>>,
    /// Dashed lines at values of x.
    pub verticals: Vec<Reference<'a>>,
}

/// An axis of a plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis<'a> {
    /// What it shows, with its unit, for instance "time \[s\]".
    pub label: &'a str,
    /// Values at its ends; chosen after the curves and reference lines if not given.
    pub range: Option<[f64; 2]>,
    /// Whether it is logarithmic; values that are not positive are then left out.
    pub log: bool,
}

/// A curve of a plot; where a value is NaN or infinite, it has a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve<'a> {
    /// Name in the legend; none if empty.
    pub label: &'a str,
    /// Points (x, y), in the units of the axes.
    pub points: &'a [[f64; 2]],
    /// How it is drawn.
    pub style: Style,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// A continuous line.
    #[default]
    Line,
    /// A dashed line.
    Dashed,
    /// A mark at each point.
    Marks,
}

/// A line across a plot at a value to compare with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference<'a> {
    /// The value, in the unit of the axis.
    pub at: f64,
    /// What it stands for, for instance "500 mm".
    pub label: &'a str,
}

impl<'a> Axis<'a> {
    /// A linear axis whose range follows the curves.
    pub fn linear(label: &'a str) -> Self {
        Self { label, range: None, log: false }
    }

    /// A logarithmic axis whose range follows the curves.
    pub fn logarithmic(label: &'a str) -> Self {
        Self { label, range: None, log: true }
    }

    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }

    /// The scale for the given values, with `margin` as a share of the range left free beyond them.
    fn scale(&self, values: impl Iterator<Item = f64>, margin: f64) -> Scale {
        if let Some([low, high]) = self.range {
            return Scale::new(low, high, self.log);
        }
        let (low, high) = values
            .filter(|&v| self.shows(v))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if self.log {
            let factor = (high / low).powf(margin);
            return Scale::new(low / factor, high * factor, true);
        }
        // Zero belongs to the picture unless it is far from the values.
        let low = if low > 0.0 && low < 0.5 * high { 0.0 } else { low };
        let free = margin * (high - low);
        Scale::new(if low == 0.0 { 0.0 } else { low - free }, high + free, false)
    }
}

impl Plot<'_> {
    /// Draws the plot.
    pub fn draw(&self) -> Picture {
        const AREA: Area = Area { left: 130.0, top: 76.0, width: 1020.0, height: 580.0 };
        let values =
            |axis: usize| self.curves.iter().flat_map(move |c| c.points.iter().map(move |p| p[axis]));
        let lines = |references: &[Reference]| references.iter().map(|r| r.at).collect::<Vec<f64>>();
        let axes = Axes {
            area: AREA,
            x: self.x.scale(values(0).chain(lines(&self.verticals)), if self.x.log { 0.03 } else { 0.0 }),
            y: self.y.scale(values(1).chain(lines(&self.horizontals)), 0.06),
        };
        let runs: Vec<Vec<Vec<[f64; 2]>>> = self.curves.iter().map(|curve| self.runs(curve, &axes)).collect();

        let mut canvas = Canvas::new(1200, 756);
        axes.draw_grid(&mut canvas);
        axes.draw_frame(&mut canvas, self.title, [self.x.label, self.y.label]);
        canvas.clip(Some(AREA));
        self.draw_references(&mut canvas, &axes);
        for (n, (curve, runs)) in self.curves.iter().zip(&runs).enumerate() {
            // Marks on the frame are shown whole.
            canvas.clip((curve.style != Style::Marks).then_some(AREA));
            for run in runs {
                draw_run(&mut canvas, run, curve.style, COLOURS[n % COLOURS.len()]);
            }
        }
        canvas.clip(None);
        self.draw_legend(&mut canvas, AREA, &runs);
        canvas.finish()
    }

    /// The parts of a curve between its gaps, in pixels.
    fn runs(&self, curve: &Curve, axes: &Axes) -> Vec<Vec<[f64; 2]>> {
        // Far beyond the frame nothing can be seen, and single precision gives out.
        let near = |v: f64| v.clamp(-1e5, 1e5);
        curve
            .points
            .split(|&[x, y]| !(self.x.shows(x) && self.y.shows(y)))
            .map(|run| run.iter().map(|&point| axes.pixel(point).map(near)))
            .map(|run| match curve.style {
                Style::Marks => run.filter(|&point| axes.area.contains(point)).collect(),
                Style::Line | Style::Dashed => run.collect(),
            })
            .collect()
    }

    fn draw_references(&self, canvas: &mut Canvas, axes: &Axes) {
        let pen = Pen { colour: REFERENCE, width: 2.0, dashed: true };
        let area = axes.area;
        let lettering = Lettering { outlined: true, ..TICK };
        for line in self.horizontals.iter().filter(|line| self.y.shows(line.at)) {
            let y = area.bottom() - area.height * axes.y.position(line.at);
            canvas.line(&[[area.left, y], [area.right(), y]], pen);
            canvas.text(line.label, [area.right() - 12.0, y - 9.0], [1.0, 1.0], lettering, REFERENCE);
        }
        for line in self.verticals.iter().filter(|line| self.x.shows(line.at)) {
            let x = area.left + area.width * axes.x.position(line.at);
            canvas.line(&[[x, area.bottom()], [x, area.top]], pen);
            let upwards = Lettering { upwards: true, ..lettering };
            // To the left, or to the right where there is no room.
            let (beside, side) = if x - area.left < 50.0 { (x + 9.0, 0.0) } else { (x - 9.0, 1.0) };
            canvas.text(line.label, [beside, area.bottom() - 12.0], [0.0, side], upwards, REFERENCE);
        }
    }

    /// The names of the curves, in the corner where they hide least.
    fn draw_legend(&self, canvas: &mut Canvas, area: Area, runs: &[Vec<Vec<[f64; 2]>>]) {
        const ROW: f64 = 32.0;
        const SAMPLE: f64 = 44.0;
        const PADDING: f64 = 14.0;
        let named = || self.curves.iter().enumerate().filter(|(_, curve)| !curve.label.is_empty());
        let rows = named().count();
        if rows == 0 {
            return;
        }
        let widest = named().map(|(_, curve)| text_width(curve.label, TICK)).fold(0.0, f64::max);
        let width = 3.0 * PADDING + SAMPLE + widest;
        let height = PADDING + ROW * rows as f64;
        let corners = [(1.0, 0.0), (1.0, 1.0), (0.0, 0.0), (0.0, 1.0)].map(|(right, below)| Area {
            left: area.left + PADDING + right * (area.width - width - 2.0 * PADDING),
            top: area.top + PADDING + below * (area.height - height - 2.0 * PADDING),
            width,
            height,
        });
        let mut hidden = corners.map(|corner| (corner, 0usize));
        for run in runs.iter().flatten() {
            for pair in run.windows(2) {
                for step in 0..16 {
                    let t = f64::from(step) / 16.0;
                    let point = [0, 1].map(|d| pair[0][d] + t * (pair[1][d] - pair[0][d]));
                    for (corner, count) in &mut hidden {
                        *count += usize::from(corner.contains(point));
                    }
                }
            }
        }
        let [first, others @ ..] = hidden;
        let (corner, _) =
            others.into_iter().fold(first, |best, other| if other.1 < best.1 { other } else { best });

        canvas.fill(corner, [255; 3], 0.88);
        canvas.frame(corner, Pen { colour: FAINT, width: 1.5, dashed: false });
        for (row, (n, curve)) in named().enumerate() {
            let y = corner.top + 0.5 * PADDING + ROW * (row as f64 + 0.5);
            let x = corner.left + PADDING;
            let sample = match curve.style {
                Style::Marks => vec![[x + 0.5 * SAMPLE, y]],
                Style::Line | Style::Dashed => vec![[x, y], [x + SAMPLE, y]],
            };
            draw_run(canvas, &sample, curve.style, COLOURS[n % COLOURS.len()]);
            canvas.text(curve.label, [x + SAMPLE + PADDING, y], [0.0, 0.5], TICK, INK);
        }
    }
}

fn draw_run(canvas: &mut Canvas, run: &[[f64; 2]], style: Style, colour: Colour) {
    match style {
        Style::Line => canvas.line(run, Pen { colour, width: 3.0, dashed: false }),
        Style::Dashed => canvas.line(run, Pen { colour, width: 3.0, dashed: true }),
        Style::Marks => run.iter().for_each(|&point| canvas.disc(point, 5.5, colour)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot<'a>(points: &'a [[f64; 2]], log: bool) -> Plot<'a> {
        let axis = |label| Axis { label, range: None, log };
        Plot {
            title: "Plot",
            x: axis("x"),
            y: axis("y"),
            curves: vec![Curve { label: "", points, style: Style::Line }],
            horizontals: Vec::new(),
            verticals: Vec::new(),
        }
    }

    fn pixels_of(picture: &Picture, colour: Colour) -> usize {
        picture.rgb.as_chunks::<3>().0.iter().filter(|pixel| **pixel == colour).count()
    }

    #[test]
    fn a_curve_has_a_gap_where_it_is_not_known() {
        let whole = [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0]];
        let mut gap = whole;
        gap[1][1] = f64::NAN;
        let (whole, gap) = (plot(&whole, false).draw(), plot(&gap, false).draw());
        let share = pixels_of(&gap, COLOURS[0]) as f64 / pixels_of(&whole, COLOURS[0]) as f64;
        assert!((share - 1.0 / 3.0).abs() < 0.02, "{share}");
    }

    #[test]
    fn reference_lines_belong_to_the_range() {
        let mut with_line = plot(&[[0.0, 1.0], [1.0, 2.0]], false);
        with_line.horizontals = vec![Reference { at: 500.0, label: "500 mm" }];
        assert!(pixels_of(&with_line.draw(), REFERENCE) > 500);
    }

    #[test]
    fn any_numbers_can_be_drawn() {
        let odd = [0.0, -1.0, 1e-300, 1.0, 1e12, f64::MAX, -f64::MAX, f64::NAN, f64::INFINITY];
        for a in odd {
            for b in odd {
                for log in [false, true] {
                    let picture = plot(&[[a, b], [b, a], [1.0, 2.0]], log).draw();
                    assert_eq!(picture.rgb.len(), 3 * 1200 * 756);
                }
            }
        }
        plot(&[], true).draw();
    }
}
