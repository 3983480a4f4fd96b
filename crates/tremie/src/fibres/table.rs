//! The figures as tables for people.

use super::figures::{Figures, Lying, PARTS, Through};
use crate::numbers::significant;

/// Names of axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Rows under a header, the first column to the left and others to the right.
pub(super) fn lined_up(title: &str, header: &[&str], rows: &[Vec<String>]) -> String {
    let header: Vec<String> = header.iter().map(|&name| name.to_owned()).collect();
    let all = || std::iter::once(&header).chain(rows);
    let width = |n: usize| {
        let cells = all().filter_map(|row| row.get(n));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let line = |row: &Vec<String>| {
        let cells = row.iter().enumerate().map(|(n, cell)| match n {
            0 => format!("  {cell:<0$}", width(0)),
            _ => format!("  {cell:>0$}", width(n)),
        });
        cells.collect::<String>().trim_end().to_owned()
    };
    let lines: Vec<String> = all().map(line).collect();
    format!("{title}\n{}", lines.join("\n"))
}

/// A number with so many decimals; a dash where there is none.
pub(super) fn decimals(number: Option<f64>, digits: usize) -> String {
    match number.filter(|x| x.is_finite()) {
        Some(number) => {
            let told = format!("{number:.digits$}");
            // What is rounded to zero has no sign.
            let zero = told.chars().all(|c| "-0.".contains(c));
            if zero { told.trim_start_matches('-').to_owned() } else { told }
        }
        None => "-".to_owned(),
    }
}

/// All figures.
pub(super) fn all(figures: &Figures) -> String {
    let parts = parts(figures);
    let held: Vec<Vec<String>> = parts.iter().map(|(name, part)| held(name, part)).collect();
    let lying: Vec<Vec<String>> = parts.iter().map(|(name, part)| lying(name, part)).collect();
    let header = ["", "fibres", "length [m]", "volume [cm3]", "share [%]"];
    let mut tables = vec![
        format!("{}, {} at t = {:.3} s", figures.title, figures.run, figures.time),
        lined_up("Fibres with any part there, and what of them lies there", &header, &held),
        lined_up(
            "Orientation tensor, weighted by length",
            &["", "a11", "a22", "a33", "a12", "a13", "a23"],
            &parts.iter().map(|(name, part)| tensor(name, part)).collect::<Vec<_>>(),
        ),
        lined_up(
            "Its eigenvalues, and the direction of the largest",
            &["", "largest", "middle", "smallest", "x", "y", "z", "from x [degrees]"],
            &lying,
        ),
    ];
    if !figures.beams.is_empty() {
        let row = |beam: &super::figures::BeamFigures| {
            let at = format!("{} = {} mm", AXES[beam.along], significant(1e3 * beam.at));
            [vec![beam.name.clone(), at], through(&beam.section)].concat()
        };
        let rows: Vec<Vec<String>> = figures.beams.iter().map(row).collect();
        let header = ["", "at", "fibres", "per m2", "concrete [cm2]", "alpha"];
        tables.push(lined_up("Fibres through the sections in the middle of the beams", &header, &rows));
    }
    if !figures.planes.is_empty() {
        let row = |plane: &super::figures::PlaneFigures| {
            [vec![plane.name.clone()], through(&plane.through)].concat()
        };
        let rows: Vec<Vec<String>> = figures.planes.iter().map(row).collect();
        let header = ["", "fibres", "per m2", "concrete [cm2]", "alpha"];
        tables.push(lined_up("Fibres through planes", &header, &rows));
    }
    tables.join("\n\n")
}

/// The parts of the cast and of the beams, each with its name; halves are indented.
pub(super) fn parts(figures: &Figures) -> Vec<(String, &Lying)> {
    let beams = figures.beams.iter().map(|beam| (beam.name.as_str(), &beam.parts));
    let all = std::iter::once(("cast", &figures.cast)).chain(beams);
    let named = all.flat_map(|(name, parts)| {
        let name = move |n: usize| match n {
            0 => name.to_owned(),
            _ => format!("  {}", PARTS[n]),
        };
        parts.iter().enumerate().map(move |(n, part)| (name(n), part))
    });
    named.collect()
}

fn held(name: &str, part: &Lying) -> Vec<String> {
    let fibres = &part.held.fibres;
    vec![
        name.to_owned(),
        fibres.parts.to_string(),
        significant(fibres.length),
        significant(1e6 * fibres.volume),
        decimals(Some(100.0 * part.held.share()), 3),
    ]
}

fn tensor(name: &str, part: &Lying) -> Vec<String> {
    let components = part.components();
    let cells = (0..6).map(|n| decimals(components.map(|all| all[n]), 3));
    std::iter::once(name.to_owned()).chain(cells).collect()
}

fn lying(name: &str, part: &Lying) -> Vec<String> {
    let values = (0..3).map(|n| decimals(part.principal.map(|found| found.values[n]), 3));
    let axis = (0..3).map(|n| decimals(part.axis().map(|axis| axis[n]), 2));
    let azimuth = decimals(part.azimuth(), 0);
    std::iter::once(name.to_owned()).chain(values).chain(axis).chain([azimuth]).collect()
}

fn through(through: &Through) -> Vec<String> {
    vec![
        through.crossing.count.to_string(),
        significant(through.density()),
        significant(1e4 * through.crossing.section),
        decimals(Some(through.factor), 3),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let row = |a: &str, b: &str| vec![a.to_owned(), b.to_owned()];
        let table = lined_up("T", &["", "n"], &[row("long name", "1"), row("b", "100")]);
        assert_eq!(table, "T\n               n\n  long name    1\n  b          100");
        let numbers = [Some(0.12345), None, Some(f64::NAN), Some(-1e-9), Some(-0.25)];
        assert_eq!(numbers.map(|x| decimals(x, 3)), ["0.123", "-", "-", "0.000", "-0.250"]);
    }
}
