//! `tremie check`: what a case will cost, before it is run.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use indicatif::{HumanBytes, HumanCount};
use serde_json::{Value, json};
use tremie_case::{Cage, Case, InclusionGroup, Incoming, Layer, MeshFile, Role, Solid};
use tremie_geometry::{Body, Shape};
use tremie_numerics::DVec3;

use crate::numbers::{Numbers, duration, significant};
use crate::pace::Pace;
use crate::terminal;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie check cases/slump-flow/case.toml
  tremie check my-case.toml --json

The first steps are run to see how fast this machine is; nothing is written.")]
pub(crate) struct Arguments {
    /// The case file
    case: PathBuf,
    /// Print JSON, in SI units
    #[arg(long)]
    json: bool,
}

/// Checks a case.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let case = Case::read(&arguments.case)?;
    let numbers = Numbers::new(&case);
    if let Some(refusal) = numbers.refusal(&case) {
        return Err(refusal.into());
    }
    let pace = Pace::of(&case, &numbers.plan)?;
    let warnings = numbers.warnings();

    if arguments.json {
        let mut json = numbers.json();
        json["threads"] = json!(rayon::current_num_threads());
        json["estimated_time_s"] = json!(pace.step * numbers.plan.steps());
        json["updates_per_second"] = json!(pace.updates);
        json["warnings"] = json!(warnings);
        if let Some(plan) = numbers.plan.lattice()
            && case.has_bodies()
        {
            json["bodies"] = json!(case.inclusions.len());
            json["bodies_in"] = json!(plan.incoming.iter().sum::<u64>());
            json["bodies_memory_bytes"] = json!(plan.memory_of_bodies.round());
            json["bodies_time_share"] = json!(pace.burden);
        }
        json["meshes"] = case.meshes.iter().map(described).collect();
        terminal::say(&format!("{json:#}"));
    } else {
        let mut rows = numbers.rows();
        rows.extend(case.meshes.iter().map(|mesh| ("mesh", extent(mesh))));
        rows.extend(case.solids.iter().filter_map(bars).map(|bars| ("bars", bars)));
        rows.extend(case.cages.iter().map(|cage| ("cage", zone(cage))));
        if let Some(plan) = numbers.plan.lattice()
            && case.has_bodies()
        {
            rows.extend(swimmers(&case, plan).into_iter().map(|bodies| ("bodies", bodies)));
            rows.extend(arrivals(&case, plan).into_iter().map(|bodies| ("bodies", bodies)));
            let memory = HumanBytes(plan.memory_of_bodies as u64);
            let time = significant(100.0 * pace.burden);
            rows.push(("they add", format!("about {memory} of the memory, {time} % to the time of a step")));
        }
        // Particles take longer steps while they are slower than they may become.
        let about = match (numbers.plan.lattice().is_some(), case.inlets.is_empty()) {
            (false, _) => "at most ",
            (true, true) => "",
            (true, false) => "about ",
        };
        let earlier = if case.stop.rest.is_some() { ", less if it comes to rest earlier" } else { "" };
        let threads = rayon::current_num_threads();
        rows.push((
            "estimated time",
            format!(
                "{about}{}{earlier} ({} M {} updates/s on {threads} threads)",
                duration(pace.step * numbers.plan.steps()),
                significant(1e-6 * pace.updates),
                numbers.plan.element()
            ),
        ));
        terminal::say(&format!("{}\n{}", case.title, terminal::columns(&rows)));
        for warning in warnings {
            terminal::warn(&warning);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What a mesh is there for, and where it lies, so that a wrong unit is seen.
fn extent(file: &MeshFile) -> String {
    let volume = significant(1e3 * file.mesh.mesh().volume());
    format!("{} ({}), {}, {volume} litres", file.path, role(file), span(file.mesh.bounds()))
}

/// How many bars a solid is made of, if it is, and where they lie.
fn bars(solid: &Solid) -> Option<String> {
    let Body::Union(union) = &solid.body else { return None };
    let bars = union.bodies();
    let is_bar = |body: &Body| matches!(body, Body::Shape(Shape::Bar { .. }));
    bars.iter().all(is_bar).then(|| format!("{} ({}), {}", solid.name, bars.len(), span(solid.body.bounds())))
}

/// The bars of a cage, and where it lies.
fn zone(cage: &Cage) -> String {
    let layers = cage.layers.iter().map(|Layer { grid, .. }| {
        let [diameter, spacing] = [grid.diameter, grid.spacing].map(|length| significant(1e3 * length));
        format!(
            "bars of {diameter} mm at {spacing} mm, {} % of the volume",
            significant(100.0 * grid.share())
        )
    });
    format!("{}, {}", layers.collect::<Vec<_>>().join("; "), span(cage.body.bounds()))
}

/// How many bodies of each name there are, and which share of the fluid at the start they take.
fn swimmers(case: &Case, plan: &tremie_lbm::Plan) -> Vec<String> {
    let bodies = &case.inclusions;
    let fluid = plan.wet_cells * plan.scaling.cell_size.powi(3);
    let of = |group: &InclusionGroup| {
        let its = |n: &usize| bodies.kinds[usize::from(bodies.kind[*n])].name == group.name;
        let volume: f64 = (0..bodies.len()).filter(its).map(|n| bodies.form(n).volume()).sum();
        let number = HumanCount((0..bodies.len()).filter(its).count() as u64);
        format!("{number} {}, {} % of the volume", group.name, significant(100.0 * volume / fluid))
    };
    case.groups.iter().map(of).collect()
}

/// How many bodies of each name are expected by each inlet, and which share of what comes in they take.
fn arrivals(case: &Case, plan: &tremie_lbm::Plan) -> Vec<String> {
    let expected = case.incoming().zip(&plan.incoming);
    let of = |((inlet, of), number): ((usize, &Incoming), &u64)| {
        let (number, share) = (HumanCount(*number), significant(100.0 * of.share));
        format!("{number} {} to come by inlet {}, {share} % of what comes in", of.name, inlet + 1)
    };
    expected.map(of).collect()
}

/// From where to where something reaches.
fn span((min, max): (DVec3, DVec3)) -> String {
    // Without the noise of turning, which is far below a micrometre.
    let millimetres = |length: f64| (1e6 * length).round() / 1e3 + 0.0;
    let along = |axis: usize| format!("{} to {}", millimetres(min[axis]), millimetres(max[axis]));
    format!("x {}, y {}, z {} mm", along(0), along(1), along(2))
}

fn described(file: &MeshFile) -> Value {
    let (min, max) = file.mesh.bounds();
    json!({
        "file": file.path,
        "role": role(file),
        "min_m": min.to_array(),
        "max_m": max.to_array(),
        "volume_m3": file.mesh.mesh().volume(),
        "facets": file.mesh.mesh().triangles.len(),
        "turned": file.mesh.turned(),
    })
}

fn role(file: &MeshFile) -> &'static str {
    match file.role {
        Role::Obstacle => "obstacle",
        Role::Formwork => "formwork",
    }
}
