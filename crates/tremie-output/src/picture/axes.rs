//! Scales, ticks at round numbers, frames with labels, and colour bars.

use super::Palette;
use super::canvas::{Area, Canvas, Colour, FAINT, INK, Lettering, Pen, text_width};

pub(super) const TITLE: Lettering = Lettering { bold: true, ..Lettering::plain(27.0) };
pub(super) const LABEL: Lettering = Lettering::plain(22.0);
pub(super) const TICK: Lettering = Lettering::plain(19.0);

const TICK_LENGTH: f64 = 7.0;
/// About so many pixels lie between ticks.
const TICK_SPACING: f64 = 105.0;
const FRAME: Pen = Pen { colour: INK, width: 1.5, dashed: false };

/// An interval of values along an axis or a colour bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    log: bool,
}

/// A value with its label.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

impl Scale {
    /// The interval, widened where it is empty and replaced where it cannot be drawn.
    pub(super) fn new(low: f64, high: f64, log: bool) -> Self {
        let drawable = |v: f64| v.is_finite() && v.abs() < 1e100 && (!log || v > 1e-100);
        if !(drawable(low) && drawable(high) && low <= high) {
            return Self { low: if log { 0.1 } else { 0.0 }, high: 1.0, log };
        }
        let enough = 1e-9 * low.abs().max(high.abs());
        if high - low > enough.max(1e-100) {
            return Self { low, high, log };
        }
        if log {
            return Self { low: low / 2.0, high: high * 2.0, log };
        }
        let half = if low == 0.0 { 0.5 } else { 0.1 * low.abs() };
        Self { low: low - half, high: high + half, log }
    }

    /// Position of a value, 0 at the low end and 1 at the high end.
    pub(super) fn position(&self, value: f64) -> f64 {
        if self.log {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Value at a position on a linear scale.
    pub(super) fn value(&self, position: f64) -> f64 {
        self.low + (self.high - self.low) * position
    }

    /// Some `count` ticks at round numbers.
    pub(super) fn ticks(&self, count: f64) -> Vec<Tick> {
        if self.log && self.high / self.low >= 10.0 { self.decades(count) } else { self.steps(count) }
    }

    /// Ticks along `length` pixels from left to right, as many as have room for their labels.
    fn ticks_along(&self, length: f64) -> Vec<Tick> {
        const GAP: f64 = 14.0;
        let mut count = length / TICK_SPACING;
        loop {
            let ticks = self.ticks(count);
            let widest = ticks.iter().map(|tick| text_width(&tick.label, TICK)).fold(0.0, f64::max);
            let crowded = ticks.windows(2).any(|pair| {
                length * (self.position(pair[1].value) - self.position(pair[0].value)) < widest + GAP
            });
            if !crowded || count < 2.0 {
                return ticks;
            }
            count *= 0.7;
        }
    }

    fn steps(&self, count: f64) -> Vec<Tick> {
        let rough = (self.high - self.low) / count.max(1.0);
        let mut exponent = rough.log10().floor() as i32;
        let mut digit = 1.0;
        for candidate in [2.0, 5.0, 10.0] {
            // As many ticks as asked for, or a few more.
            if candidate * power(exponent) <= rough * 1.4 {
                digit = candidate;
            }
        }
        if digit == 10.0 {
            (digit, exponent) = (1.0, exponent + 1);
        }
        let step = digit * power(exponent);
        // A little beyond the ends, for ends that are ticks up to rounding.
        let first = (self.low / step - 1e-6).ceil();
        let last = (self.high / step + 1e-6).floor();
        let largest = first.abs().max(last.abs()) * step;
        let scientific = largest >= 1e6 || exponent < -4;
        (0..)
            .map(|n| first + f64::from(n))
            .take_while(|&n| n <= last)
            .map(|n| {
                let label = if scientific {
                    let common = largest.log10().floor() as i32;
                    let decimals = (common - exponent).clamp(0, 15) as usize;
                    if n == 0.0 {
                        "0".into()
                    } else {
                        format!("{:.decimals$}×10{}", n * step / power(common), superscript(common))
                    }
                } else {
                    format!("{:.*}", (-exponent).max(0) as usize, n * step)
                };
                Tick { value: n * step, label: label.replace('-', "−") }
            })
            .collect()
    }

    fn decades(&self, count: f64) -> Vec<Tick> {
        let first = (self.low.log10() - 1e-9).ceil() as i32;
        let last = (self.high.log10() + 1e-9).floor() as i32;
        let decades = last - first + 1;
        let (start, every, digits): (_, _, &[f64]) = if decades <= 2 {
            (first - 1, 1, &[1.0, 2.0, 5.0])
        } else {
            (first, (f64::from(decades) / count.max(1.0)).ceil() as usize, &[1.0])
        };
        (start..=last)
            .step_by(every)
            .flat_map(|n| digits.iter().map(move |&digit| (digit, n)))
            .map(|(digit, n)| {
                let plain = (-3..=3).contains(&n);
                let label = match (plain, digit == 1.0) {
                    (true, _) => format!("{:.*}", (-n).max(0) as usize, digit * power(n)),
                    (false, true) => format!("10{}", superscript(n)),
                    (false, false) => format!("{digit}×10{}", superscript(n)),
                };
                Tick { value: digit * power(n), label }
            })
            .filter(|tick| (-1e-6..=1.0 + 1e-6).contains(&self.position(tick.value)))
            .collect()
    }
}

fn power(exponent: i32) -> f64 {
    10f64.powi(exponent)
}

fn superscript(number: i32) -> String {
    number
        .to_string()
        .chars()
        .map(|c| match c.to_digit(10) {
            Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
            None => '⁻',
        })
        .collect()
}

/// Two scales at right angles, over an area of the canvas.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes {
    pub(super) area: Area,
    pub(super) x: Scale,
    pub(super) y: Scale,
}

impl Axes {
    pub(super) fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Area { left, width, height, .. } = self.area;
        [left + width * self.x.position(x), self.area.bottom() - height * self.y.position(y)]
    }

    /// Thin lines at the ticks, to be drawn before the content.
    pub(super) fn draw_grid(&self, canvas: &mut Canvas) {
        let pen = Pen { colour: FAINT, width: 1.0, dashed: false };
        for (x, _) in self.x_ticks() {
            canvas.line(&[[x, self.area.top], [x, self.area.bottom()]], pen);
        }
        for (y, _) in self.y_ticks() {
            canvas.line(&[[self.area.left, y], [self.area.right(), y]], pen);
        }
    }

    /// Frame, ticks, labels and title, to be drawn after the content.
    pub(super) fn draw_frame(&self, canvas: &mut Canvas, title: &str, labels: [&str; 2]) {
        let Area { left, top, width, height } = self.area;
        let (right, bottom) = (self.area.right(), self.area.bottom());
        canvas.frame(self.area, FRAME);
        for (x, tick) in self.x_ticks() {
            canvas.line(&[[x, bottom], [x, bottom + TICK_LENGTH]], FRAME);
            canvas.text(&tick.label, [x, bottom + TICK_LENGTH + 8.0], [0.5, 0.0], TICK, INK);
        }
        let mut widest = 0.0f64;
        for (y, tick) in self.y_ticks() {
            canvas.line(&[[left - TICK_LENGTH, y], [left, y]], FRAME);
            canvas.text(&tick.label, [left - TICK_LENGTH - 7.0, y], [1.0, 0.5], TICK, INK);
            widest = widest.max(text_width(&tick.label, TICK));
        }
        canvas.text(labels[0], [left + 0.5 * width, bottom + 46.0], [0.5, 0.0], LABEL, INK);
        let beside = [left - TICK_LENGTH - 7.0 - widest - 16.0, top + 0.5 * height];
        canvas.text(labels[1], beside, [0.5, 1.0], Lettering { upwards: true, ..LABEL }, INK);
        canvas.text(title, [0.5 * (left + right), top - 24.0], [0.5, 1.0], TITLE, INK);
    }

    fn x_ticks(&self) -> impl Iterator<Item = (f64, Tick)> {
        let (scale, area) = (self.x, self.area);
        scale.ticks_along(area.width).into_iter().map(move |tick| {
            let x = area.left + area.width * scale.position(tick.value);
            (x.round(), tick)
        })
    }

    fn y_ticks(&self) -> impl Iterator<Item = (f64, Tick)> {
        let (scale, area) = (self.y, self.area);
        scale.ticks(area.height / TICK_SPACING).into_iter().map(move |tick| {
            let y = area.bottom() - area.height * scale.position(tick.value);
            (y.round(), tick)
        })
    }
}

/// The colours of a linear scale beside or below a picture: standing if higher than wide.
pub(super) fn draw_colour_bar(canvas: &mut Canvas, area: Area, scale: Scale, palette: Palette, label: &str) {
    let Area { left, top, width, height } = area;
    let standing = height > width;
    let [columns, rows] = area.centres();
    canvas.paint(area, |[column, row]| {
        let t = match standing {
            true => (area.bottom() - rows[row]) / height,
            false => (columns[column] - left) / width,
        };
        Some((palette.at(t), 1.0))
    });
    canvas.frame(area, FRAME);
    let mut widest = 0.0f64;
    let ticks = if standing { scale.ticks(height / TICK_SPACING) } else { scale.ticks_along(width) };
    for tick in ticks {
        let t = scale.position(tick.value);
        if standing {
            let (x, y) = (area.right(), (area.bottom() - height * t).round());
            canvas.line(&[[x, y], [x + TICK_LENGTH, y]], FRAME);
            canvas.text(&tick.label, [x + TICK_LENGTH + 7.0, y], [0.0, 0.5], TICK, INK);
            widest = widest.max(text_width(&tick.label, TICK));
        } else {
            let (x, y) = ((left + width * t).round(), area.bottom());
            canvas.line(&[[x, y], [x, y + TICK_LENGTH]], FRAME);
            canvas.text(&tick.label, [x, y + TICK_LENGTH + 8.0], [0.5, 0.0], TICK, INK);
        }
    }
    if standing {
        let beside = [area.right() + TICK_LENGTH + 7.0 + widest + 18.0, top + 0.5 * height];
        canvas.text(label, beside, [0.5, 0.0], Lettering { upwards: true, ..LABEL }, INK);
    } else {
        canvas.text(label, [left + 0.5 * width, area.bottom() + 46.0], [0.5, 0.0], LABEL, INK);
    }
}

/// Colours of classes: pale for the first, which matters least, then such as the colour-blind can tell apart (Okabe and Ito 2008).
const CLASSES: [Colour; 8] = [
    [221, 221, 221],
    [33, 145, 140],
    [230, 159, 0],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
    [240, 228, 66],
    [86, 180, 233],
];

/// The colour of a class; from the last on they come again, but for the pale one.
pub(super) fn class_colour(number: usize) -> Colour {
    CLASSES[if number < CLASSES.len() { number } else { 1 + (number - 1) % (CLASSES.len() - 1) }]
}

/// The colours of classes with their names, where a colour bar would stand.
pub(super) fn draw_classes(canvas: &mut Canvas, bar: Area, names: &[&str]) {
    const SIZE: f64 = 24.0;
    const GAP: f64 = 12.0;
    let standing = bar.height > bar.width;
    let [mut x, mut y] = [bar.left, bar.top];
    for (number, name) in names.iter().enumerate() {
        let swatch = Area { left: x, top: y, width: SIZE, height: SIZE };
        canvas.fill(swatch, class_colour(number), 1.0);
        canvas.frame(swatch, FRAME);
        canvas.text(name, [x + SIZE + GAP, y + 0.5 * SIZE], [0.0, 0.5], LABEL, INK);
        if standing {
            y += SIZE + GAP;
        } else {
            x += SIZE + text_width(name, LABEL) + 4.0 * GAP;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, log: bool, count: f64) -> Vec<String> {
        Scale::new(low, high, log).ticks(count).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_stand_at_round_numbers() {
        assert_eq!(labels(-310.0, 290.0, false, 6.0), ["−300", "−200", "−100", "0", "100", "200"]);
        assert_eq!(labels(0.0, 0.3, false, 6.0), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
        assert_eq!(labels(0.0, 1.0, false, 5.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(0.0, 2.4e6, false, 2.0), ["0", "1×10⁶", "2×10⁶"]);
        assert_eq!(labels(0.01, 1e5, true, 9.0), ["0.01", "0.1", "1", "10", "100", "1000", "10⁴", "10⁵"]);
        assert_eq!(labels(1e-6, 1e-4, true, 9.0).first().unwrap(), "10⁻⁶");
        assert_eq!(labels(2.0, 30.0, true, 5.0), ["2", "5", "10", "20"]);
    }

    #[test]
    fn labels_along_an_axis_do_not_run_into_each_other() {
        let wide = Scale::new(0.0, 1.95e-5, false).ticks_along(684.0);
        let labels: Vec<&str> = wide.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(labels, ["0", "0.5×10⁻⁵", "1.0×10⁻⁵", "1.5×10⁻⁵"]);
        assert_eq!(Scale::new(0.0, 2.0, false).ticks_along(684.0).len(), 11);
    }

    #[test]
    fn any_interval_gives_few_finite_ticks() {
        let odd = [0.0, -1.0, 1e-300, 1.0, 1.0 + 1e-15, 3e9, f64::MAX, -f64::MAX, f64::NAN, f64::INFINITY];
        for low in odd {
            for high in odd {
                for log in [false, true] {
                    let scale = Scale::new(low, high, log);
                    let ticks = scale.ticks(8.0);
                    assert!(ticks.len() < 40, "{low} to {high}: {} ticks", ticks.len());
                    assert!(ticks.iter().all(|tick| scale.position(tick.value).is_finite()));
                }
            }
        }
    }
}
