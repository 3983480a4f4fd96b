//! Two casts side by side.

use super::figures::{Figures, Lying, Through};
use super::table::{decimals, lined_up, parts};

/// The angle in degrees, up to 90, between the main axes of two parts in the horizontal plane; none where one is upright or not known.
pub(super) fn angle(one: &Lying, two: &Lying) -> Option<f64> {
    let between = (one.azimuth()? - two.azimuth()?).abs() % 180.0;
    Some(between.min(180.0 - between))
}

/// Both casts; the same has been cut out of both.
pub(super) fn all(one: &Figures, two: &Figures) -> String {
    let title = format!(
        "Against {} at t = {:.3} s: the value of {}, the other, and the first less the second",
        two.run, two.time, one.run
    );
    let rows: Vec<Vec<String>> = parts(one)
        .into_iter()
        .zip(parts(two))
        .map(|((name, one), (_, two))| {
            let largest = |part: &Lying| part.principal.map_or(f64::NAN, |found| found.values[0]);
            let counts = counts(one.held.fibres.parts, two.held.fibres.parts);
            let largest = numbers(largest(one), largest(two));
            let azimuths = [one.azimuth(), two.azimuth(), angle(one, two)].map(|x| decimals(x, 0));
            std::iter::once(name).chain(counts).chain(largest).chain(azimuths).collect()
        })
        .collect();
    let header = [
        "",
        "fibres",
        "other",
        "difference",
        "largest eigenvalue",
        "other",
        "difference",
        "from x [degrees]",
        "other",
        "angle",
    ];
    let mut tables = vec![title, lined_up("How fibres lie", &header, &rows)];
    let sections = one.beams.iter().zip(&two.beams).map(|(a, b)| (&a.name, &a.section, &b.section));
    let planes = one.planes.iter().zip(&two.planes).map(|(a, b)| (&a.name, &a.through, &b.through));
    for (title, pairs) in [
        ("Through the sections in the middle of the beams", sections.collect::<Vec<_>>()),
        ("Through planes", planes.collect()),
    ] {
        let row = |(name, a, b): &(&String, &Through, &Through)| {
            let counts = counts(a.crossing.count, b.crossing.count);
            let factors = numbers(a.factor, b.factor);
            std::iter::once((*name).clone()).chain(counts).chain(factors).collect()
        };
        let rows: Vec<Vec<String>> = pairs.iter().map(row).collect();
        if !rows.is_empty() {
            let header = ["", "fibres", "other", "difference", "alpha", "other", "difference"];
            tables.push(lined_up(title, &header, &rows));
        }
    }
    tables.join("\n\n")
}

/// Two counts and their difference.
fn counts(one: usize, two: usize) -> [String; 3] {
    [one.to_string(), two.to_string(), format!("{:+}", one as i64 - two as i64)]
}

/// Two numbers and their difference.
fn numbers(one: f64, two: f64) -> [String; 3] {
    let difference = one - two;
    let told = if difference.is_finite() { format!("{difference:+.3}") } else { "-".to_owned() };
    [decimals(Some(one), 3), decimals(Some(two), 3), told]
}
