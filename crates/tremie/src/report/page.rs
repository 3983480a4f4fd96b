//! The page, in HTML: everything in it comes with it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use indicatif::HumanCount;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use tremie_case::Side;

use super::evidence::Evidence;
use super::figures::{self, Figure};
use super::judgement;
use crate::numbers::{duration, significant};
use crate::plan::Plan;
use crate::run;

const STYLE: &str = include_str!("style.css");

/// Names and values; a row without a name belongs to the one above it.
type Rows = Vec<(&'static str, String)>;

/// The report.
pub(super) fn page(evidence: &Evidence) -> anyhow::Result<String> {
    let Evidence { case, record, summary, .. } = evidence;
    let warnings = judgement::warnings(evidence);
    let resolution = judgement::resolution(evidence);
    let plots = figures::plots(evidence)?;
    let last = figures::last_state(evidence)?;
    let [above, cuts] = &evidence.pictures;
    let (above, no_above) = figures::over_time(above, "The surface from above");
    let (cuts, no_cuts) = figures::over_time(cuts, "Speed in a cut");
    let (filling, no_filling) = figures::filling(evidence);
    let missing = [&evidence.missing[..], &no_above, &no_cuts, &no_filling].concat();
    let results = match &evidence.experiment {
        Some((_, figures)) => figures.rows.clone(),
        None => run::readings(summary),
    };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (case.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (case.title) }
                    p.soft {
                        @if let Some((name, _)) = &evidence.experiment { "Standard test " (name) ". " }
                        "Simulated with " (record.program) ", begun " (record.started) "."
                    }
                    ul.tiles { @for (name, value) in headline(evidence) { li { span { (name) } strong { (value) } } } }
                }
                @if !warnings.is_empty() {
                    h2 { "Warnings" }
                    (notes(&warnings, "warn"))
                }
                h2 { "Results" }
                (table(&[results, ending(evidence)].concat()))
                h2 { "Figures" }
                div.figures { @for figure in &plots { (show(figure)) } }
                @if !last.is_empty() {
                    h2 { "The last state" }
                    div.figures { @for figure in &last { (show(figure)) } }
                }
                @if !filling.is_empty() {
                    h2 { "Filling" }
                    p.soft { "Times are those of readings, every " (significant(case.gauges.interval)) " s. Air is not computed: trapped air tells where a pocket would be." }
                    div.pictures { @for figure in &filling { (show(figure)) } }
                }
                @if !(above.is_empty() && cuts.is_empty()) {
                    h2 { "Over time" }
                    p.soft { "Times that double, and the end: most happens at the start. The folder holds all pictures." }
                    @if !above.is_empty() {
                        h3 { "From above" }
                        div.pictures { @for figure in &above { (show(figure)) } }
                    }
                    @if !cuts.is_empty() {
                        h3 { "Speed in a cut" }
                        div.pictures { @for figure in &cuts { (show(figure)) } }
                    }
                }
                @if !missing.is_empty() {
                    h2 { "Not shown" }
                    (notes(&missing, "calm"))
                }
                h2 { "Resolution" }
                (table(&resolution.rows))
                p { (resolution.advice) }
                @if warnings.is_empty() { p { "No number is out of its good range." } }
                h2 { "Inputs" }
                h3 { "Material" }
                (table(&material(evidence)))
                h3 { "Domain" }
                (table(&domain(evidence)))
                h3 { "Method" }
                (table(&numbers(evidence)))
                h2 { "Run" }
                (table(&cost(evidence)))
                h2 { "Case file" }
                details { summary { "case.toml" } pre { (case.text) } }
                footer { "Folder " (evidence.folder.display()) ". Report by tremie " (env!("CARGO_PKG_VERSION")) "." }
            }
        }
    };
    Ok(page.into_string())
}

/// The numbers that one takes away.
fn headline(evidence: &Evidence) -> Rows {
    let summary = &evidence.summary;
    let mut tiles = match &evidence.experiment {
        Some((_, figures)) => figures.headline.clone(),
        None => {
            let spread =
                summary.readings.spread.map(|spread| ("spread", format!("{:.0} mm", 1e3 * spread.mean)));
            spread
                .into_iter()
                .chain([("largest height", format!("{:.0} mm", 1e3 * summary.readings.top))])
                .collect()
        }
    };
    tiles.push((run::reason(summary.end_reason), format!("{} s", significant(summary.readings.time))));
    tiles
}

fn ending(evidence: &Evidence) -> Rows {
    let summary = &evidence.summary;
    vec![
        ("end", format!("{} at {:.2} s", run::reason(summary.end_reason), summary.readings.time)),
        ("change of volume", format!("{} %", significant(100.0 * summary.volume_error))),
        (
            "",
            match evidence.numbers.plan {
                Plan::Lattice(_) => {
                    "(mass is kept; the method is slightly compressible, see the density error under Method)"
                }
                Plan::Particles(_) => {
                    "(mass is kept; this is what particles enclose, measured by the cells that they fill)"
                }
            }
            .to_owned(),
        ),
    ]
}

fn material(evidence: &Evidence) -> Rows {
    let material = &evidence.case.material;
    let mut rows = vec![("density", format!("{} kg/m³", significant_or_whole(material.density)))];
    let yield_stress = material.curve.yield_stress();
    let viscosity = format!("{} Pa s", significant(material.curve.plastic_viscosity()));
    if yield_stress > 0.0 {
        rows.push(("yield stress", format!("{} Pa", significant(yield_stress))));
        rows.push(("plastic viscosity", viscosity));
    } else {
        rows.push(("viscosity", viscosity));
    }
    if let Some(thixotropy) = material.thixotropy {
        let build_up = yield_stress / thixotropy.build_up_time;
        rows.push(("build-up at rest (Athix)", format!("{} Pa/s", significant(build_up))));
        rows.push(("breakdown", significant(thixotropy.breakdown)));
    }
    if material.surface_tension > 0.0 {
        rows.push(("surface tension", format!("{} N/m", significant(material.surface_tension))));
    }
    rows.push(("volume", format!("{} litres", significant(1e3 * evidence.first_volume()))));
    rows
}

fn domain(evidence: &Evidence) -> Rows {
    let domain = &evidence.case.domain;
    let list = |values: [f64; 3]| values.map(significant).join(" x ");
    let planes = domain.sides.iter().filter(|side| matches!(side, Side::Symmetry)).count();
    let gravity = domain.gravity.to_array().map(significant).join(", ");
    vec![
        ("size", format!("{} mm", list((1e3 * (domain.max - domain.min)).to_array()))),
        ("symmetry planes", planes.to_string()),
        ("gravity", format!("({gravity}) m/s²")),
    ]
}

fn numbers(evidence: &Evidence) -> Rows {
    let mut rows = vec![("method", evidence.case.method.name().to_owned())];
    rows.extend(evidence.numbers.rows());
    rows
}

fn cost(evidence: &Evidence) -> Rows {
    let record = &evidence.record;
    let machine = &record.machine;
    let processor = machine.processor.as_deref().unwrap_or("unknown processor");
    vec![
        ("program", record.program.clone()),
        ("begun", record.started.clone()),
        (
            "machine",
            format!(
                "{processor}, {}, {} threads of {} cores",
                machine.system, machine.threads, machine.cores
            ),
        ),
        ("wall time", duration(record.wall_s)),
        ("steps", HumanCount(record.steps).to_string()),
        (
            "cost",
            format!(
                "{} cell updates, {:.1} M each second",
                HumanCount(record.updates),
                1e-6 * record.updates_per_second
            ),
        ),
    ]
}

/// Densities have four digits.
fn significant_or_whole(number: f64) -> String {
    if number >= 100.0 { format!("{number:.0}") } else { significant(number) }
}

fn table(rows: &[(&'static str, String)]) -> Markup {
    // What has no name goes on below the value before.
    let mut grouped: Vec<(&str, &str, Vec<&str>)> = Vec::new();
    for (name, value) in rows {
        match grouped.last_mut() {
            Some((.., more)) if name.is_empty() => more.push(value),
            _ => grouped.push((name, value, Vec::new())),
        }
    }
    html! {
        table {
            @for (name, value, more) in grouped {
                tr { th scope="row" { (name) } td { (value) @for line in more { small { (line) } } } }
            }
        }
    }
}

fn notes(lines: &[String], class: &str) -> Markup {
    html! { ul class={ "notes " (class) } { @for line in lines { li { (line) } } } }
}

fn show(figure: &Figure) -> Markup {
    let data = format!("data:image/png;base64,{}", STANDARD.encode(&figure.png));
    html! {
        figure class=[figure.lines.then_some("lines")] {
            img src=(data) alt=(figure.alt);
            @if !figure.caption.is_empty() { figcaption { (figure.caption) } }
        }
    }
}
