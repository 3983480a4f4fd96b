//! The report of a test: a page that needs nothing else.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::folder::Folder;
use super::results::{Done, STRENGTHS, strengths};
use crate::numbers::significant;

const STYLE: &str = include_str!("../report/style.css");
const PICTURES: [(&str, &str); 4] = [
    ("load_opening.png", "Nominal stress over the opening of the crack"),
    ("load_deflection.png", "Load over the deflection in the middle"),
    ("energy.png", "Where the work of the first beam went: what was put in, and what was found"),
    ("crack.png", "Fibres across the crack of the first beam"),
];

/// Writes the report.
pub(super) fn write(folder: &Folder, done: &Done) -> anyhow::Result<()> {
    let mut pictures = Vec::new();
    for (name, caption) in PICTURES {
        let path = folder.file(name);
        // After a resumption the crack of the first beam was drawn before.
        if path.is_file() {
            pictures.push((STANDARD.encode(std::fs::read(path)?), caption));
        }
    }
    let page = page(folder, done, &pictures)?;
    Ok(tremie_output::atomic::write(&folder.file("report.html"), page.as_bytes())?)
}

fn page(folder: &Folder, done: &Done, pictures: &[(String, &str)]) -> anyhow::Result<String> {
    let case = &done.case;
    let record = folder.record()?;
    let mpa = |stress: f64| if stress.is_nan() { "-".to_owned() } else { format!("{:.2}", 1e-6 * stress) };
    let tiles: Vec<(&str, String)> = STRENGTHS
        .into_iter()
        .zip(done.scatter())
        .filter(|(_, scatter)| !scatter.mean.is_nan())
        .map(|((name, _), scatter)| (name, format!("{} MPa", mpa(scatter.mean))))
        .collect();
    let matrix = &case.matrix;
    let material = [
        ("modulus of elasticity", format!("{} GPa", significant(1e-9 * matrix.modulus))),
        ("tensile strength", format!("{} MPa", significant(1e-6 * matrix.strength))),
        (
            "softening",
            format!(
                "to {} MPa at {} mm, to nothing at {} mm",
                significant(1e-6 * matrix.kink[0]),
                significant(1e3 * matrix.kink[1]),
                significant(1e3 * matrix.last_opening)
            ),
        ),
        ("friction of fibres", format!("{} MPa", significant(1e-6 * case.bond.friction))),
        (
            "snubbing, spalling",
            format!("{}, {}", significant(case.bond.snubbing), significant(case.bond.spalling)),
        ),
        (
            "distance of nodes",
            format!(
                "{} mm at the crack, {} mm far from it",
                significant(1e3 * case.lattice.finest),
                significant(1e3 * case.lattice.coarsest)
            ),
        ),
        (
            "machine",
            format!(
                "{}, {} threads",
                record.machine.processor.as_deref().unwrap_or("unknown processor"),
                record.machine.threads
            ),
        ),
    ];
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
                    p.soft { "Tested by " (record.program) ", begun " (record.started) ": " (done.test()) "." }
                    ul.tiles { @for (name, value) in &tiles { li { span { (name) } strong { (value) } } } }
                }
                h2 { "Results" }
                (table(&done.rows()))
                h2 { "Figures" }
                div.figures {
                    @for (data, caption) in pictures {
                        figure.lines {
                            img src=(format!("data:image/png;base64,{data}")) alt=(caption);
                            figcaption { (caption) }
                        }
                    }
                }
                h2 { "Beams" }
                p.soft { "Stresses in MPa." }
                table {
                    tr {
                        th { "beam" } th { "seed" }
                        @for (name, _) in STRENGTHS { th { (name) } }
                        th { "fibres in the crack" }
                    }
                    @for (n, beam) in done.beams.iter().enumerate() {
                        tr {
                            td { (n + 1) } td { (beam.seed) }
                            @for stress in strengths(beam) { td { (mpa(stress)) } }
                            td { (beam.crack().map_or(0, |count| count.fibres)) }
                        }
                    }
                }
                h2 { "What to think of it" }
                ul.notes.calm {
                    li { "One crack, in a plane that is given: a real beam without a notch breaks where it is weakest, and may crack more than once." }
                    li { "Hooks are spread along the fibre as friction; what straightening a hook adds at a slip of some millimetres is not in it." }
                    li { "The matrix is elastic in compression, and nothing depends on time." }
                }
                h2 { "Inputs" }
                (table(&material))
                h2 { "Beam file" }
                details { summary { "beam.toml" } pre { (case.text) } }
                footer { "Folder " (done.path.display()) ". Report by tremie " (env!("CARGO_PKG_VERSION")) "." }
            }
        }
    };
    Ok(page.into_string())
}

fn table(rows: &[(&'static str, String)]) -> Markup {
    html! { table { @for (name, value) in rows { tr { th scope="row" { (name) } td { (value) } } } } }
}
