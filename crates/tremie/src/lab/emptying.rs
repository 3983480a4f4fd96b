//! Tests that time how long a vessel takes to empty: until one first sees light through it from above.
//!
//! A funnel or pipe stands above a tray on the floor, whose walls are the sides of the domain; at the start all of its outlet opens at
//! once. A cone that stands on the plate is lifted instead. What flows out must find room: the tray is wide and its floor well below the
//! outlet.

use serde_json::{Value, json};
use tremie_case::Case;
use tremie_simulation::Summary;

use super::Figures;
use super::setup::{Mix, Setup, at_event, cuboid, point};
use crate::numbers::significant;

/// Name of the gauge that sees the light.
const LIGHT: &str = "empty";

/// A vessel that empties.
pub(super) struct Emptying<'a> {
    pub(super) test: String,
    pub(super) title: &'a str,
    /// The sides of the domain that are planes of symmetry.
    pub(super) symmetry: Vec<&'a str>,
    /// Corners of the domain in m.
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    /// Concrete and vessel, as text.
    pub(super) parts: String,
    /// The box through which one looks, in m.
    pub(super) view: [[f64; 3]; 2],
    /// Name of the solid with which it moves.
    pub(super) with: Option<&'a str>,
}

impl Emptying<'_> {
    /// The case file.
    pub(super) fn case_text(self, mix: &Mix, cell_size: f64) -> String {
        let Self { test, title, symmetry, min, max, parts, view: [low, high], with } = self;
        let with = with.map(|name| format!(", with = \"{name}\"")).unwrap_or_default();
        let setup = Setup {
            test,
            title,
            mix,
            domain: match symmetry.len() {
                0 => "All of it.".to_owned(),
                n => format!("One part of {}, between planes of symmetry.", 1 << n),
            },
            min,
            max,
            symmetry,
            parts,
            cell_size,
            gauges: format!(
                "# Until light is seen from above.\nlight = [{{ name = \"{LIGHT}\", min = {}, max = {}{with} }}]\n",
                point(low),
                point(high)
            ),
            stop_time: LONGEST,
            stop: at_event(LIGHT),
            intervals: [0.5, 2.0],
        };
        setup.text()
    }
}

/// Time in s after which nobody waits any longer.
const LONGEST: f64 = 60.0;

/// The time in s at which the vessel was empty, if it was.
pub(super) fn time(summary: &Summary) -> Option<f64> {
    summary.event(&format!("light_{LIGHT}_s"))
}

/// The time for people.
pub(super) fn shown(summary: &Summary) -> String {
    match time(summary) {
        Some(time) => format!("{time:.1} s"),
        None => format!("none: not empty after {} s", significant(summary.readings.time)),
    }
}

/// The figures of a test whose result is the time alone.
pub(super) fn figures(
    name: &'static str,
    key: &str,
    class: Option<&str>,
    notes: Vec<(&'static str, String)>,
    case: &Case,
    summary: &Summary,
) -> Figures {
    let time = time(summary);
    let cell_size = case.method.resolution();
    let mut headline = vec![(name, shown(summary))];
    let mut rows = vec![
        (name, shown(summary)),
        ("", "(from when the concrete is let go to the first light seen from above)".to_owned()),
    ];
    let mut json: Vec<(String, Value)> = vec![(key.to_owned(), json!(time))];
    if let Some(class) = class {
        headline.push(("class", class.to_owned()));
        rows.push(("class", class.to_owned()));
        json.push(("class".to_owned(), json!(class)));
    }
    rows.extend(notes);
    rows.push(("resolution", format!("cells of {} mm", significant(1e3 * cell_size))));
    Figures { headline, rows, json: json.into_iter().collect() }
}

/// A block that holds a vessel: all of the domain above the height `bottom` in m, but for what is cut from it.
pub(super) fn block(mix: &Mix, min: [f64; 3], max: [f64; 3], bottom: f64, without: &[String]) -> String {
    let beyond = |a: usize, sign: f64| sign * (max[a] - min[a]);
    let low = [min[0] + beyond(0, -1.0), min[1] + beyond(1, -1.0), bottom];
    let high = [max[0] + beyond(0, 1.0), max[1] + beyond(1, 1.0), max[2] + beyond(2, 1.0)];
    let cut: Vec<String> = without.iter().map(|shape| format!("    {{ {shape} }},\n")).collect();
    format!(
        "[[solid]]\nname = \"vessel\"\n{}difference.from.{}\ndifference.without = [\n{}]\n",
        mix.surface(),
        cuboid(low, high),
        cut.concat()
    )
}
