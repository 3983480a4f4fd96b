//! The figures of a report.

use std::collections::BTreeSet;
use std::path::PathBuf;

use tremie_output::picture::{Axis, Curve, Picture, Plot, Reference, Style};
use tremie_simulation::gauges::{self, Half};
use tremie_simulation::pictures::{self, Frame, Quantity};

use super::evidence::Evidence;
use crate::lab;

/// A picture with what it shows.
pub(super) struct Figure {
    /// As PNG.
    pub(super) png: Vec<u8>,
    /// In a few words, for those who cannot see it.
    pub(super) alt: String,
    /// What to see in it; HTML is not allowed.
    pub(super) caption: String,
    /// Whether it is lines on white, which may be shown white on black.
    pub(super) lines: bool,
}

/// Smallest value of a logarithmic axis over the largest: what lies below is as good as zero.
const SMALLEST: f64 = 1e-8;

/// Curves over time, and the profile.
pub(super) fn plots(evidence: &Evidence) -> anyhow::Result<Vec<Figure>> {
    let plots = [
        spread(evidence),
        profile(evidence),
        levels(evidence),
        fronts(evidence),
        travels(evidence),
        bearings(evidence),
        pressures(evidence),
        pressure_history(evidence),
        speeds(evidence),
        energies(evidence),
    ];
    plots.into_iter().flatten().collect()
}

/// The last state in a cut, by several quantities, and from above.
pub(super) fn last_state(evidence: &Evidence) -> anyhow::Result<Vec<Figure>> {
    let Some((time, cells, bodies)) = &evidence.last else {
        return Ok(Vec::new());
    };
    let case = &evidence.case;
    let mut figures = vec![shown(
        &pictures::above(cells, bodies, case, &format!("From above, t = {time:.2} s"))?,
        "The surface from above",
        "Height of the surface, from above.",
    )?];
    for (half, name) in [(Half::Lower, "lower"), (Half::Upper, "upper")] {
        let title = format!("How fibres lie, t = {time:.2} s");
        if let Some(picture) = pictures::lying(cells, bodies, case, half, &title)? {
            let alt = format!("How fibres lie in the {name} half");
            let caption = format!(
                "How fibres lie in the {name} half of the fluid, from above: a line across its square where all are aligned, a disc of a third of it where they lie in all directions alike."
            );
            figures.push(shown(&picture, &alt, &caption)?);
        }
    }
    let batch = (Quantity::Batch, "Batches", "The batch that there is most of, in a vertical cut.");
    let batch = (!cells.batches.is_empty()).then_some(batch);
    let always = [
        (Quantity::Speed, "Speed", "Speed in a vertical cut."),
        (Quantity::Pressure, "Pressure", "Pressure above that of the air in a vertical cut."),
        (
            Quantity::ShearRate,
            "Shear rate",
            "Shear rate sqrt(2 D:D) in a vertical cut; zero where the fluid has not yielded.",
        ),
        (
            Quantity::ApparentViscosity,
            "Apparent viscosity",
            "Stress over shear rate in a vertical cut, from the plastic viscosity up to five times as much; fluid that has not yielded is there, too.",
        ),
        (
            Quantity::Yielded,
            "Yielded",
            "Where the fluid flows, and where the stress is below the yield stress.",
        ),
    ];
    for (quantity, name, caption) in always.into_iter().chain(batch) {
        let picture =
            pictures::cut(cells, case, quantity, Frame::Fluid, &format!("{name}, t = {time:.2} s"))?;
        figures.push(shown(&picture, &format!("{name} in a cut"), caption)?);
    }
    Ok(figures)
}

/// How the form filled, from the pictures of the run.
pub(super) fn filling(evidence: &Evidence) -> (Vec<Figure>, Vec<String>) {
    let (mut figures, missing) = read(&evidence.filling, "How the form filled");
    for (figure, path) in figures.iter_mut().zip(&evidence.filling) {
        let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let where_ =
            if name.ends_with("_level") { "at half the height of the fluid" } else { "in a vertical cut" };
        let what = match name.split('_').nth(1) {
            Some("time") => "When each place was filled",
            Some("fronts") => "Where fronts met that came from different sides",
            _ => "Dead zones: where the fluid has not been sheared since the place was filled",
        };
        figure.caption = format!("{what}, {where_}.");
    }
    (figures, missing)
}

/// The pictures of the run at times that double, and the last: most happens at the start.
pub(super) fn over_time(paths: &[PathBuf], what: &str) -> (Vec<Figure>, Vec<String>) {
    let Some(last) = paths.len().checked_sub(1) else {
        return (Vec::new(), Vec::new());
    };
    let doubling = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n < last);
    let numbers: BTreeSet<usize> = [0, last].into_iter().chain(doubling).collect();
    read(&numbers.into_iter().map(|n| paths[n].clone()).collect::<Vec<_>>(), what)
}

/// Pictures from their files, and what is wrong with those that are none.
fn read(paths: &[PathBuf], what: &str) -> (Vec<Figure>, Vec<String>) {
    let (mut figures, mut missing) = (Vec::new(), Vec::new());
    for path in paths {
        let name = path.file_stem().map(|name| name.to_string_lossy()).unwrap_or_default();
        match std::fs::read(path) {
            Ok(png) if png.starts_with(b"\x89PNG\r\n\x1a\n") => figures.push(Figure {
                png,
                alt: format!("{what}, picture {name}"),
                caption: String::new(),
                lines: false,
            }),
            Ok(_) => missing.push(format!("{} is no picture.", path.display())),
            Err(error) => missing.push(format!("{} cannot be read: {error}.", path.display())),
        }
    }
    (figures, missing)
}

fn shown(picture: &Picture, alt: &str, caption: &str) -> anyhow::Result<Figure> {
    let mut png = Vec::new();
    picture.encode(&mut png)?;
    Ok(Figure { png, alt: alt.to_owned(), caption: caption.to_owned(), lines: false })
}

fn drawn(plot: &Plot, caption: &str) -> anyhow::Result<Figure> {
    Ok(Figure { lines: true, ..shown(&plot.draw(), plot.title, caption)? })
}

fn curve<'a>(label: &'a str, points: &'a Option<Vec<[f64; 2]>>) -> Option<Curve<'a>> {
    Some(Curve { label, points: points.as_deref()?, style: Style::Line })
}

/// Spread against time, with what EN 12350-8 asks for where it is a slump flow.
fn spread(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let mean = evidence.readings("spread_m", 1e3);
    let largest = evidence.readings("spread_max_m", 1e3);
    let curves: Vec<Curve> =
        [curve("mean diameter", &mean), curve("largest diameter", &largest)].into_iter().flatten().collect();
    if curves.is_empty() {
        return None;
    }
    let slump_flow = evidence.experiment.as_ref().is_some_and(|(name, _)| lab::tells_t500(name));
    let t500 = evidence.summary.t500;
    let t500_label = t500.map(|time| format!("T500 = {time:.1} s")).unwrap_or_default();
    let reference = Reference { at: 500.0, label: "500 mm" };
    let plot = Plot {
        title: "Spread",
        x: Axis::linear("time [s]"),
        y: Axis::linear("diameter [mm]"),
        curves,
        horizontals: if slump_flow { vec![reference] } else { Vec::new() },
        verticals: t500
            .filter(|_| slump_flow)
            .map(|at| Reference { at, label: &t500_label })
            .into_iter()
            .collect(),
    };
    let caption = if slump_flow {
        "Diameter against time. T500 is the first touch of the 500 mm circle by the largest diameter (twice the largest radius)."
    } else {
        "Diameter against time; the largest is twice the largest radius."
    };
    Some(drawn(&plot, caption))
}

/// Height against radius, beside that of the thin sheet.
fn profile(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let centre = evidence.case.gauges.spread?.centre;
    let (time, cells, _) = evidence.last.as_ref()?;
    let millimetres = |points: Vec<[f64; 2]>| points.into_iter().map(|p| p.map(|v| 1e3 * v)).collect();
    let simulated: Vec<[f64; 2]> = millimetres(gauges::profile(cells, centre));
    let sheet = evidence.sheet();
    let analytic: Vec<[f64; 2]> = millimetres(sheet.map_or(Vec::new(), |sheet| {
        // Steep at the edge, so that the points are closer there.
        let edge = |n: i32| sheet.radius * (1.0 - f64::from(n).powi(2) / 1e4);
        (0..=100).rev().map(|n| [edge(n), sheet.height(edge(n))]).collect()
    }));
    let mut curves = vec![Curve { label: "simulated", points: &simulated, style: Style::Line }];
    if sheet.is_some() {
        curves.push(Curve { label: "Roussel and Coussot 2005", points: &analytic, style: Style::Dashed });
    }
    let title = format!("Profile, t = {time:.2} s");
    let plot = Plot {
        title: &title,
        x: Axis::linear("radius [mm]"),
        y: Axis::linear("height [mm]"),
        curves,
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    let caption = match sheet {
        Some(sheet) => format!(
            "Mean height around the axis. Dashed: h(r) = sqrt(2 tau0 (R - r) / (rho g)) with R = {:.0} mm from the volume. It neglects inertia, normal stresses, surface tension and slip, and holds where the height is well below the radius (here {:.2} of it).",
            1e3 * sheet.radius,
            sheet.height(0.0) / sheet.radius
        ),
        None => "Mean height around the axis.".to_owned(),
    };
    Some(drawn(&plot, &caption))
}

/// A logarithmic axis that leaves out what is as good as zero.
fn logarithmic<'a>(label: &'a str, curves: &[Curve], least: f64) -> Axis<'a> {
    let values = || curves.iter().flat_map(|c| c.points).map(|p| p[1]).filter(|v| v.is_finite() && *v > 0.0);
    let high = values().fold(least, f64::max);
    let low = values().fold(least, f64::min).max(SMALLEST * high);
    Axis { label, range: Some([0.5 * low, 2.0 * high]), log: true }
}

/// Levels against time.
fn levels(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let names: Vec<&str> = evidence.case.gauges.level.iter().map(|gauge| gauge.name.as_str()).collect();
    let caption = "Level of the surface over each rectangle (median) against time, as a coordinate.";
    lengths(evidence, "Levels", "level [mm]", &names, |name| format!("level_{name}_m"), caption)
}

/// Ways of the front against time.
fn fronts(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let names: Vec<&str> = evidence.case.gauges.front.iter().map(|gauge| gauge.name.as_str()).collect();
    let caption = "How far the front has come beyond each plane against time; it arrives at zero.";
    lengths(evidence, "Front", "way beyond the plane [mm]", &names, |name| format!("front_{name}_m"), caption)
}

/// Way of a solid that a load moves against time.
fn travels(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let loaded = evidence.case.solids.iter().filter(|solid| solid.load.is_some());
    let names: Vec<&str> = loaded.map(|solid| solid.name.as_str()).collect();
    let caption = "How far a solid has come along the load that moves it against time.";
    lengths(evidence, "Way of what is loaded", "way [mm]", &names, |name| format!("{name}_travel_m"), caption)
}

/// Upward forces on solids that move against time.
fn bearings(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let moving = |solid: &&tremie_case::Solid| solid.load.is_some() || solid.motion.largest_speed(0.0) > 0.0;
    let solids = evidence.case.solids.iter().filter(moving);
    let readings: Vec<_> = solids
        .map(|solid| (solid.name.as_str(), evidence.readings(&format!("{}_force_z_N", solid.name), 1.0)))
        .collect();
    let curves: Vec<Curve> = readings.iter().filter_map(|(name, points)| curve(name, points)).collect();
    if curves.is_empty() {
        return None;
    }
    let plot = Plot {
        title: "Force on solids that move",
        x: Axis::linear("time [s]"),
        y: Axis::linear("upward force [N]"),
        curves,
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    Some(drawn(
        &plot,
        "What the fluid does to solids that move against time: upward force, mirror images included.",
    ))
}

/// Lengths that gauges of these names read, in mm, against time.
fn lengths(
    evidence: &Evidence,
    title: &str,
    axis: &str,
    names: &[&str],
    column: impl Fn(&str) -> String,
    caption: &str,
) -> Option<anyhow::Result<Figure>> {
    let readings: Vec<_> = names.iter().map(|name| evidence.readings(&column(name), 1e3)).collect();
    let curves: Vec<Curve> =
        names.iter().zip(&readings).filter_map(|(name, points)| curve(name, points)).collect();
    if curves.is_empty() {
        return None;
    }
    let plot = Plot {
        title,
        x: Axis::linear("time [s]"),
        y: Axis::linear(axis),
        curves,
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    Some(drawn(&plot, caption))
}

/// What each pressure gauge has read: height against the largest and the last pressure, beside the hydrostatic one at the end.
fn pressures(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let (case, gravity) = (&evidence.case, evidence.gravity()?);
    let weight = case.material.density * gravity;
    let mut curves: Vec<(String, Vec<[f64; 2]>, Style)> = Vec::new();
    for gauge in &case.gauges.pressure {
        let [low, high] = [gauge.min.unwrap_or(case.domain.min).z, gauge.max.unwrap_or(case.domain.max).z];
        let read = evidence.summary.readings.pressures.iter().find(|(name, _)| *name == gauge.name);
        let (name, read) = (&gauge.name, &read?.1);
        let height = |band: usize| low + (band as f64 + 0.5) * (high - low) / gauge.bands as f64;
        let largest = |band: usize| {
            let readings = evidence.readings(&format!("pressure_{name}_{}_Pa", band + 1), 1e-3)?;
            Some([readings.iter().fold(0.0, |most: f64, p| most.max(p[1])), height(band)])
        };
        let wet = |point: &[f64; 2]| point[0] > 0.0;
        let envelope: Option<Vec<[f64; 2]>> = (0..gauge.bands).map(largest).collect();
        let last = (0..gauge.bands).map(|band| [1e-3 * read.bands[band], height(band)]).filter(wet).collect();
        let foot = [1e-3 * weight * (read.level - low).max(0.0), low];
        let hydrostatic = vec![foot, [0.0, read.level.max(low)]];
        curves.push((format!("{name}, largest"), envelope?.into_iter().filter(wet).collect(), Style::Line));
        curves.push((format!("{name}, at the end"), last, Style::Marks));
        curves.push((format!("{name}, hydrostatic at the end"), hydrostatic, Style::Dashed));
    }
    if curves.is_empty() {
        return None;
    }
    let plot = Plot {
        title: "Pressure on walls",
        x: Axis::linear("pressure [kPa]"),
        y: Axis::linear("height [m]"),
        curves: curves.iter().map(|(label, points, style)| Curve { label, points, style: *style }).collect(),
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    let caption = "Normal stress on each wall, band by band over the height: the largest of the whole run, and the last. \
        Dashed: the hydrostatic pressure under the surface beside the wall at the end.";
    Some(drawn(&plot, caption))
}

/// The pressure on the lowest band of each gauge over time, beside the hydrostatic one at the time.
fn pressure_history(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let (case, gravity) = (&evidence.case, evidence.gravity()?);
    let weight = case.material.density * gravity;
    let mut curves: Vec<(String, Vec<[f64; 2]>, Style)> = Vec::new();
    for gauge in &case.gauges.pressure {
        let [low, high] = [gauge.min.unwrap_or(case.domain.min).z, gauge.max.unwrap_or(case.domain.max).z];
        let (name, middle) = (&gauge.name, low + 0.5 * (high - low) / gauge.bands as f64);
        let read = evidence.readings(&format!("pressure_{name}_1_Pa"), 1e-3)?;
        let level = evidence.readings(&format!("pressure_{name}_level_m"), 1.0)?;
        let hydrostatic =
            level.into_iter().map(|[t, level]| [t, 1e-3 * weight * (level - middle).max(0.0)]).collect();
        curves.push((format!("{name}, lowest band"), read, Style::Line));
        curves.push((format!("{name}, hydrostatic"), hydrostatic, Style::Dashed));
    }
    if curves.is_empty() {
        return None;
    }
    let plot = Plot {
        title: "Pressure on walls over time",
        x: Axis::linear("time [s]"),
        y: Axis::linear("pressure [kPa]"),
        curves: curves.iter().map(|(label, points, style)| Curve { label, points, style: *style }).collect(),
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    let caption = "Normal stress on the lowest band of each wall, and the hydrostatic pressure under the surface \
        beside the wall at the same time.";
    Some(drawn(&plot, caption))
}

fn speeds(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let [median, p99, largest] =
        ["speed_p50_m_s", "speed_p99_m_s", "speed_max_m_s"].map(|column| evidence.readings(column, 1e3));
    let curves: Vec<Curve> =
        [curve("median", &median), curve("99th percentile", &p99), curve("largest", &largest)]
            .into_iter()
            .flatten()
            .collect();
    if curves.is_empty() {
        return None;
    }
    let rule = evidence.case.stop.rest;
    let rest = rule.map(|rest| 1e3 * rest.speed);
    let plot = Plot {
        title: "Speed",
        x: Axis::linear("time [s]"),
        y: logarithmic("speed [mm/s]", &curves, rest.unwrap_or(f64::NAN)),
        curves,
        horizontals: rest.map(|at| Reference { at, label: "rest" }).into_iter().collect(),
        verticals: Vec::new(),
    };
    let caption = match rule.map(|rest| rest.level_rate) {
        Some(None) => "Speed of the fluid against time. At rest 99 % of it is slower than the dashed line.",
        Some(Some(_)) => {
            "Speed of the fluid against time. At rest 99 % of it is slower than the dashed line, or half of it while the levels stay."
        }
        None => "Speed of the fluid against time.",
    };
    Some(drawn(&plot, caption))
}

fn energies(evidence: &Evidence) -> Option<anyhow::Result<Figure>> {
    let kinetic = evidence.readings("kinetic_energy_J", 1.0);
    let end = evidence.summary.readings.potential_energy;
    // Along a periodic axis the potential has no meaning.
    let potential = evidence.gravity().and_then(|_| evidence.readings("potential_energy_J", 1.0));
    let released =
        potential.map(|points| points.into_iter().map(|[t, e]| [t, e - end]).collect::<Vec<[f64; 2]>>());
    let curves: Vec<Curve> = [curve("kinetic", &kinetic), curve("potential, above the end's", &released)]
        .into_iter()
        .flatten()
        .collect();
    if curves.is_empty() {
        return None;
    }
    let plot = Plot {
        title: "Energy",
        x: Axis::linear("time [s]"),
        y: logarithmic("energy [J]", &curves, f64::NAN),
        curves,
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    let caption = "Energy of the whole body against time.";
    Some(drawn(&plot, caption))
}
