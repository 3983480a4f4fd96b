//! Concrete that has come to rest in a straight channel with walls at its sides: the LCPC box and the L-box without
//! bars.
//!
//! Its weight is held by the yield stress at the bottom and the sides, `dh/dx = -tau0 (w + 2 h) / (rho g w h)`, in a
//! channel of width w (N. Roussel, Materials and Structures 40, 2007, 889-896; T. L. H. Nguyen, N. Roussel, P. Coussot,
//! Cement and Concrete Research 36, 2006, 1789-1796). With `A = 2 tau0 / (rho g w)` and `u = 2 h / w` the surface falls
//! from u to 0, and the channel holds there, over
//!
//! ```text
//!     x = w / (2 A) (u - ln(1 + u)),    V = w^3 / (4 A) (ln(1 + u) - u + u^2 / 2)
//! ```
//!
//! The layer is long against its height, and came there without inertia.

use clap::Args;
use tremie_numerics::root::turning_point;

use super::answer::{Answer, KG_PER_M3, LITRE, MM, ONE, PA, quantity, warnings};
use crate::lab::GRAVITY;
use crate::numbers::significant;
use crate::quantities::{density, length, stress, volume};

/// Below this A a surface is level to eight digits, and differences of volumes would be lost in rounding.
const LEAST_A: f64 = 1e-9;

/// Height over length above which a layer is not a shallow one.
const SHALLOW: f64 = 0.2;

/// `ln(1 + u) - u + u^2 / 2`, by its series where its terms would cancel.
fn content(u: f64) -> f64 {
    if u > 0.01 {
        return u.ln_1p() - u + 0.5 * u * u;
    }
    (3..12).map(|k| -(-u).powi(k) / f64::from(k)).sum()
}

/// `u - ln(1 + u)`.
fn reach(u: f64) -> f64 {
    0.5 * u * u - content(u)
}

/// `2 tau0 / (rho g w)`.
fn a_of(yield_stress: f64, density: f64, width: f64) -> f64 {
    2.0 * yield_stress / (density * GRAVITY * width)
}

/// An LCPC box: concrete is poured at its back.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LcpcBox {
    /// Inner width and length in m.
    pub(crate) width: f64,
    pub(crate) length: f64,
    /// Height of its walls in m.
    pub(crate) height: f64,
    /// Volume poured in m3.
    pub(crate) volume: f64,
}

/// How concrete rests in an LCPC box.
pub(crate) struct Spread {
    /// How far it has come in m.
    pub(crate) length: f64,
    /// Its height in m at the back.
    pub(crate) height: f64,
}

impl LcpcBox {
    /// Dimensions and volume of Roussel 2007, from memory of the paper.
    pub(crate) const STANDARD: Self = Self { width: 0.2, length: 1.2, height: 0.15, volume: 6e-3 };

    /// The state at rest of a fluid of a yield stress in Pa and a density in kg/m3.
    pub(crate) fn at_rest(&self, yield_stress: f64, density: f64) -> Spread {
        let a = a_of(yield_stress, density, self.width);
        let wanted = 4.0 * a * self.volume / self.width.powi(3);
        let u = turning_point(f64::MAX, |u| content(u) < wanted);
        Spread { length: 0.5 * self.width / a * reach(u), height: 0.5 * self.width * u }
    }

    /// The yield stress in Pa at which a fluid of a density in kg/m3 spreads over `length` in m.
    pub(crate) fn yield_stress(&self, length: f64, density: f64) -> f64 {
        let section = self.width * self.width;
        let u = turning_point(f64::MAX, |u| 2.0 * self.volume * reach(u) > length * section * content(u));
        0.5 * density * GRAVITY * self.width * (self.width.powi(3) * content(u) / (4.0 * self.volume))
    }

    /// What of a state is out of the range of the formula, or of the box.
    pub(crate) fn warnings(&self, state: &Spread) -> Vec<String> {
        warnings([
            (
                state.length > self.length,
                "the concrete reaches the end of the box of 1200 mm, and stands higher there than the formula has it"
                    .to_owned(),
            ),
            (state.height > self.height, "the concrete would overflow the walls of 150 mm".to_owned()),
            (
                state.height > SHALLOW * state.length,
                format!(
                    "the height is {} of the length, above {SHALLOW}: the layer is not shallow; for stiff concrete see `tremie calc slump`",
                    significant(state.height / state.length)
                ),
            ),
        ])
    }
}

pub(super) const LCPC_EQUATION: &[&str] = &[
    "V = w^3 / (4 A) (ln(1 + u) + u (u - 2) / 2),  L = h0 / A - w / (2 A) ln(1 + u)",
    "A = 2 tau0 / (rho g w), u = 2 h0 / w; w = 200 mm width, V = 6 l, h0 height at the back, L spread",
];
pub(super) const LCPC_SOURCE: &str =
    "N. Roussel, Materials and Structures 40 (2007), 889-896; dimensions of the box from memory";
pub(super) const LCPC_VALIDITY: &[&str] = &[
    "slow pouring (about 30 s), spreads up to 1200 mm, height below 0.2 of the spread; no slip at the walls",
];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc lcpc-box --yield-stress 50Pa
  tremie calc lcpc-box --yield-stress 80Pa --density 2400kg/m3")]
pub(super) struct LcpcArguments {
    /// Yield stress
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    yield_stress: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
}

/// The spread in the LCPC box.
pub(super) fn lcpc_box(arguments: &LcpcArguments) -> Answer {
    let &LcpcArguments { yield_stress, density } = arguments;
    let state = LcpcBox::STANDARD.at_rest(yield_stress, density);
    Answer {
        title: "Spread in the LCPC box",
        inputs: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
        ],
        results: vec![
            quantity("spread", "spread_m", state.length, MM),
            quantity("height at the back", "height_m", state.height, MM),
        ],
        equation: LCPC_EQUATION,
        source: LCPC_SOURCE,
        validity: LCPC_VALIDITY,
        warnings: LcpcBox::STANDARD.warnings(&state),
    }
}

/// An L-box without bars.
#[derive(Debug, Clone, Copy)]
pub(super) struct LBox {
    width: f64,
    /// Depth of the column, along the channel, in m.
    column: f64,
    /// Length of the channel beyond the gate in m.
    channel: f64,
    volume: f64,
    /// Whether the surface in the column is level instead of falling as in the channel.
    level_column: bool,
}

/// Heights in m at the back of an L-box and at its end.
pub(super) struct Heights {
    pub(super) back: f64,
    pub(super) end: f64,
}

impl LBox {
    /// EN 12350-10 with its 700 mm from the back of the column.
    pub(super) const STANDARD: Self =
        Self { width: 0.2, column: 0.1, channel: 0.6, volume: 12e-3, level_column: false };
    /// The same with its 700 mm from the gate.
    pub(super) const LONGER: Self = Self { channel: 0.7, ..Self::STANDARD };

    /// The heights at rest, from `A = 2 tau0 / (rho g w)`.
    fn heights(&self, a: f64) -> Heights {
        let a = a.max(LEAST_A);
        let (level, slope) =
            if self.level_column { (self.column, self.channel) } else { (0.0, self.column + self.channel) };
        let fall = 2.0 * a * slope / self.width;
        let at_end = |u: f64| {
            let left = reach(u) - fall;
            if left > 0.0 { turning_point(u, |end| reach(end) < left) } else { 0.0 }
        };
        // Both sides of the balance of volumes times 4 A / w^3.
        let scale = 4.0 * a / self.width.powi(3);
        let held =
            |u: f64| scale * level * self.width * 0.5 * self.width * u + content(u) - content(at_end(u));
        let u = turning_point(f64::MAX, |u| held(u) < scale * self.volume);
        Heights { back: 0.5 * self.width * u, end: 0.5 * self.width * at_end(u) }
    }

    /// The heights at rest of a fluid of a yield stress in Pa and a density in kg/m3.
    pub(super) fn at_rest(&self, yield_stress: f64, density: f64) -> Heights {
        self.heights(a_of(yield_stress, density, self.width))
    }

    /// The yield stress in Pa at which a fluid of a density in kg/m3 comes to rest with `ratio` of its heights, below
    /// 1.
    pub(super) fn yield_stress(&self, ratio: f64, density: f64) -> f64 {
        let a = turning_point(1.0, |a| {
            let heights = self.heights(a);
            heights.end > ratio * heights.back
        });
        0.5 * a * density * GRAVITY * self.width
    }
}

pub(super) const L_BOX_EQUATION: &[&str] = &[
    "dh/dx = -tau0 (w + 2 h) / (rho g w h), integrated in closed form with the volume kept",
    "w = 200 mm width, h height, x along the box; H1 at the back, H2 at the end",
];
pub(super) const L_BOX_SOURCE: &str =
    "T. L. H. Nguyen, N. Roussel, P. Coussot, Cement and Concrete Research 36 (2006), 1789-1796";
pub(super) const L_BOX_VALIDITY: &[&str] = &[
    "a box without bars, and a gate so slow that inertia plays no part (it raises H2/H1); no slip at the walls.",
    "Whether the 700 mm of the channel count from the back of the column or from the gate changes the result much",
];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc l-box --yield-stress 30Pa
  tremie calc l-box --yield-stress 30Pa --channel 700mm
  tremie calc l-box --yield-stress 30Pa --level-column")]
pub(super) struct LBoxArguments {
    /// Yield stress
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    yield_stress: f64,
    /// Density
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
    /// Length of the channel beyond the gate
    #[arg(long, value_name = "LENGTH", default_value = "600mm", value_parser = length)]
    channel: f64,
    /// Depth of the column
    #[arg(long, value_name = "LENGTH", default_value = "100mm", value_parser = length)]
    column: f64,
    /// Volume of concrete
    #[arg(long, value_name = "VOLUME", default_value = "12l", value_parser = volume)]
    volume: f64,
    /// Take the surface in the column as level, instead of falling as in the channel
    #[arg(long)]
    level_column: bool,
}

/// H2/H1 in the L-box.
pub(super) fn l_box(arguments: &LBoxArguments) -> Answer {
    let &LBoxArguments { yield_stress, density, channel, column, volume, level_column } = arguments;
    let geometry = LBox { column, channel, volume, level_column, ..LBox::STANDARD };
    let heights = geometry.at_rest(yield_stress, density);
    Answer {
        title: "H2/H1 in the L-box without bars",
        inputs: vec![
            quantity("yield stress", "yield_stress_Pa", yield_stress, PA),
            quantity("density", "density_kg_m3", density, KG_PER_M3),
            quantity("channel beyond the gate", "channel_m", channel, MM),
            quantity("depth of the column", "column_m", column, MM),
            quantity("volume", "volume_m3", volume, LITRE),
        ],
        results: vec![
            quantity("H2/H1", "ratio", heights.end / heights.back, ONE),
            quantity("H1, at the back", "h1_m", heights.back, MM),
            quantity("H2, at the end", "h2_m", heights.end, MM),
        ],
        equation: L_BOX_EQUATION,
        source: L_BOX_SOURCE,
        validity: L_BOX_VALIDITY,
        warnings: warnings([
            (heights.end == 0.0, "the concrete stops before the end of the channel".to_owned()),
            (
                heights.back > SHALLOW * (column + channel),
                format!(
                    "H1 is {} of the length, above {SHALLOW}: the layer is not shallow",
                    significant(heights.back / (column + channel))
                ),
            ),
        ]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_in_the_lcpc_box_are_those_that_others_have_worked_out() {
        // Yield stress in Pa; spread and height at the back in m, for 2300 kg/m3.
        for (tau0, length, height) in [
            (10.0, 1.24739, 0.0370354),
            (50.0, 0.703921, 0.0667039),
            (100.0, 0.546967, 0.0866462),
            (200.0, 0.423137, 0.113225),
        ] {
            let state = LcpcBox::STANDARD.at_rest(tau0, 2300.0);
            assert!((state.length / length - 1.0).abs() < 1e-5, "{}", state.length);
            assert!((state.height / height - 1.0).abs() < 1e-5, "{}", state.height);
            let back = LcpcBox::STANDARD.yield_stress(length, 2300.0);
            assert!((back / tau0 - 1.0).abs() < 1e-4, "{back}");
        }
    }

    #[test]
    fn l_boxes_with_a_level_column_are_as_others_have_worked_out() {
        let geometry = LBox { level_column: true, ..LBox::STANDARD };
        for (tau0, h1, ratio) in [
            (4.6, 0.0868484, 0.969445),
            (28.75, 0.0927506, 0.819752),
            (69.0, 0.102449, 0.600349),
            (184.0, 0.130656, 0.0),
        ] {
            let heights = geometry.at_rest(tau0, 2300.0);
            assert!((heights.back / h1 - 1.0).abs() < 1e-5, "{}", heights.back);
            assert!((heights.end / heights.back - ratio).abs() < 1e-5);
            if ratio > 0.0 {
                let back = geometry.yield_stress(ratio, 2300.0);
                assert!((back / tau0 - 1.0).abs() < 1e-4, "{back}");
            }
        }
    }

    #[test]
    fn the_surface_of_an_l_box_obeys_its_equation_and_keeps_its_volume() {
        // Steps of a tenth of a millimetre down the slope from the back, by the midpoint rule.
        let (tau0, rho, w) = (50.0, 2300.0, 0.2);
        let heights = LBox::STANDARD.at_rest(tau0, rho);
        let slope = |h: f64| -tau0 * (w + 2.0 * h) / (rho * GRAVITY * w * h);
        let (step, mut h, mut volume) = (1e-4, heights.back, 0.0);
        for _ in 0..7000 {
            let middle = h + 0.5 * step * slope(h);
            h += step * slope(middle);
            volume += step * w * middle;
        }
        assert!((h - heights.end).abs() < 1e-6, "{h}");
        assert!((volume - 12e-3).abs() < 1e-8, "{volume}");
    }

    #[test]
    fn without_yield_stress_the_surface_is_level() {
        for tau0 in [1e-300, 1e-12, 1e-6] {
            let heights = LBox::STANDARD.at_rest(tau0, 2300.0);
            assert!((heights.end / heights.back - 1.0).abs() < 1e-6);
            assert!((heights.back - 12e-3 / (0.2 * 0.7)).abs() < 1e-6, "{}", heights.back);
        }
    }

    #[test]
    fn the_series_continues_the_closed_form() {
        let (below, above) = (content(0.01), content(0.01 + 1e-12));
        assert!((below / above - 1.0).abs() < 1e-8, "{below} {above}");
        assert!((content(1e-5) / (1e-15 / 3.0) - 1.0).abs() < 1e-5);
    }
}
