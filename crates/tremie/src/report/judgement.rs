//! What to think of a run: is it resolved, and what casts doubt on it.

use std::f64::consts::PI;

use tremie_case::Side;
use tremie_simulation::EndReason;

use super::evidence::Evidence;
use crate::numbers::significant;

/// Relative change of the volume that is of no account.
const VOLUME_CHANGE: f64 = 1e-3;
/// Cells over the mean height below which a sheet is coarse.
const COARSE: f64 = 4.0;
/// Cells from which on it is fine.
const FINE: f64 = 8.0;

/// How well the cells resolve the fluid, in numbers and in a sentence.
pub(super) struct Resolution {
    pub(super) rows: Vec<(&'static str, String)>,
    pub(super) advice: String,
}

pub(super) fn resolution(evidence: &Evidence) -> Resolution {
    let plan = &evidence.numbers.plan;
    let (cell, elements) = (plan.resolution(), plan.elements());
    let readings = &evidence.summary.readings;
    let cells =
        |length: f64| format!("{} {elements} ({} mm)", significant(length / cell), significant(1e3 * length));
    let mut rows = vec![(
        if plan.lattice().is_some() { "cell size" } else { "spacing" },
        format!("{} mm", significant(1e3 * cell)),
    )];
    rows.push(("least extent at the start", cells(evidence.numbers.cells_across * cell)));
    let thinnest = match &readings.spread {
        Some(spread) if spread.mean > 0.0 => {
            let mean = readings.volume / (0.25 * PI * spread.mean * spread.mean);
            rows.push(("spread", cells(spread.mean)));
            rows.push(("height in the middle", cells(spread.height)));
            rows.push(("mean height (volume over area)", cells(mean)));
            mean
        }
        _ => {
            rows.push(("largest height", cells(readings.top)));
            readings.top
        }
    };
    let across = (thinnest / cell).min(evidence.numbers.cells_across);
    let size =
        |cells: f64| format!("{} of about {} mm", plan.sizes(), significant(1e3 * across * cell / cells));
    let advice = if across < COARSE {
        format!(
            "Coarse: for a first look. For figures to rely on, run it again with {}.",
            size(1.25 * COARSE)
        )
    } else if across < FINE {
        format!(
            "Fair: the usual resolution. To see what {elements} still change, run it again with {} and compare.",
            size(FINE)
        )
    } else {
        format!("Fine: smaller {} should change little.", plan.sizes())
    };
    Resolution { rows, advice }
}

/// What casts doubt on the results.
pub(super) fn warnings(evidence: &Evidence) -> Vec<String> {
    let mut warnings: Vec<String> = evidence.numbers.doubts().iter().map(|doubt| sentence(doubt)).collect();
    let summary = &evidence.summary;
    let mut warn = |wrong: bool, text: String| {
        if wrong {
            warnings.push(text);
        }
    };
    warn(
        summary.volume_error.abs() > evidence.numbers.plan.compressibility() + VOLUME_CHANGE,
        format!(
            "The volume has changed by {} % during the run, more than the fluid's own weight can compress it.",
            significant(100.0 * summary.volume_error)
        ),
    );
    let time = significant(summary.readings.time);
    match (summary.end_reason, evidence.case.stop.rest) {
        (EndReason::Time, Some(_)) => warn(
            true,
            format!(
                "The fluid had not come to rest when the stop time was reached at {time} s; 99 % of it was slower than {} mm/s. Raise `time` under [stop] and resume the run.",
                significant(1e3 * summary.readings.speed_p99)
            ),
        ),
        (EndReason::Interrupted, _) => {
            warn(true, format!("The run was interrupted at {time} s; `tremie resume` goes on with it."));
        }
        _ => {}
    }
    warn(
        evidence.record.end_reason.as_deref() == Some("breakdown"),
        "The numbers broke down after the state shown here.".to_owned(),
    );
    warn(
        at_a_wall(evidence),
        "The fluid reaches a wall at the side of the domain: the spread is not free. Use a larger domain."
            .to_owned(),
    );
    let then = evidence.record.scaling.get("time_step_s").and_then(serde_json::Value::as_f64);
    let now = evidence.numbers.plan.time_step();
    warn(
        then.is_some_and(|then| (then / now - 1.0).abs() > 1e-9),
        "The case or the program has changed since the run began: the numbers under Method are those of the case as it stands now.".to_owned(),
    );
    warnings
}

/// Whether the spread touches a wall.
fn at_a_wall(evidence: &Evidence) -> bool {
    let (Some(gauge), Some(spread)) = (evidence.case.gauges.spread, evidence.summary.readings.spread) else {
        return false;
    };
    let domain = &evidence.case.domain;
    let reach = 0.5 * spread.max + evidence.numbers.plan.resolution();
    (0..2).any(|axis| {
        let centre = gauge.centre[axis];
        [(2 * axis, centre - domain.min[axis]), (2 * axis + 1, domain.max[axis] - centre)]
            .into_iter()
            .any(|(side, room)| matches!(domain.sides[side], Side::Wall { .. }) && reach >= room)
    })
}

/// With a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    format!("{first}{}.", letters.as_str())
}
