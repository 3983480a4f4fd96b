//! The figures for programs, in SI units; what is not known is null.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::against::angle;
use super::figures::{Figures, Lying, Through};
use super::table::AXES;

/// All figures, of one cast or of two side by side.
pub(super) fn all(one: &Figures, two: Option<&Figures>, written: &[PathBuf]) -> Value {
    let mut all = figures(one);
    if let Some(two) = two {
        all["against"] = figures(two);
        all["difference"] = differences(one, two);
    }
    if !written.is_empty() {
        all["files"] = written.iter().map(|path| path.display().to_string()).collect();
    }
    all
}

fn figures(figures: &Figures) -> Value {
    let beams = figures.beams.iter().map(|beam| {
        let mut section = through(&beam.section);
        section["axis"] = json!(AXES[beam.along]);
        section["at_m"] = json!(beam.at);
        json!({
            "name": beam.name,
            "min_m": beam.block.low.to_array(),
            "max_m": beam.block.high.to_array(),
            "fibres": parts(&beam.parts),
            "section": section,
        })
    });
    let planes = figures.planes.iter().map(|plane| {
        let mut told = through(&plane.through);
        told["name"] = json!(plane.name);
        told
    });
    json!({
        "run": figures.run,
        "title": figures.title,
        "time_s": figures.time,
        "cast": parts(&figures.cast),
        "beams": beams.collect::<Vec<_>>(),
        "planes": planes.collect::<Vec<_>>(),
    })
}

fn parts([whole, lower, upper]: &[Lying; 3]) -> Value {
    json!({ "whole": lying(whole), "lower_half": lying(lower), "upper_half": lying(upper) })
}

fn lying(part: &Lying) -> Value {
    let fibres = &part.held.fibres;
    json!({
        "count": fibres.parts,
        "length_m": fibres.length,
        "volume_m3": fibres.volume,
        "concrete_m3": part.held.fluid,
        "volume_fraction": part.held.share(),
        // In the order 11, 22, 33, 12, 13, 23.
        "tensor": part.components(),
        "eigenvalues": part.principal.map(|found| found.values),
        "axis": part.axis().map(|axis| axis.to_array()),
        "azimuth_degrees": part.azimuth(),
    })
}

fn through(through: &Through) -> Value {
    json!({
        "count": through.crossing.count,
        "per_m2": through.density(),
        "concrete_m2": through.crossing.section,
        "orientation_factor": through.factor,
    })
}

/// The first less the second, and the angles between main axes.
fn differences(one: &Figures, two: &Figures) -> Value {
    let largest = |part: &Lying| part.principal.map_or(f64::NAN, |found| found.values[0]);
    let lying = |one: &Lying, two: &Lying| {
        json!({
            "count": one.held.fibres.parts as i64 - two.held.fibres.parts as i64,
            "largest_eigenvalue": largest(one) - largest(two),
            "angle_degrees": angle(one, two),
        })
    };
    let parts = |one: &[Lying; 3], two: &[Lying; 3]| {
        json!({
            "whole": lying(&one[0], &two[0]),
            "lower_half": lying(&one[1], &two[1]),
            "upper_half": lying(&one[2], &two[2]),
        })
    };
    let through = |one: &Through, two: &Through| {
        json!({
            "count": one.crossing.count as i64 - two.crossing.count as i64,
            "orientation_factor": one.factor - two.factor,
        })
    };
    let beams = one.beams.iter().zip(&two.beams).map(|(a, b)| {
        json!({
            "name": a.name,
            "fibres": parts(&a.parts, &b.parts),
            "section": through(&a.section, &b.section),
        })
    });
    let planes = one.planes.iter().zip(&two.planes).map(|(a, b)| {
        let mut told = through(&a.through, &b.through);
        told["name"] = json!(a.name);
        told
    });
    json!({
        "cast": parts(&one.cast, &two.cast),
        "beams": beams.collect::<Vec<_>>(),
        "planes": planes.collect::<Vec<_>>(),
    })
}
