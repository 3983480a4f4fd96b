//! `tremie validate`: benchmarks against closed forms, published numbers and invariances.
//!
//! Each benchmark is a folder of `validation/`, built into the program, and a function in `scales`, `channel`, `pipe`, `thixotropy`, `tension`, `slip`, `cavity`,
//! `surface`, `collapse`, `l_box`, `lcpc_box`, `control_volume`, `drag`, `momentum`, `fibre_field`, `orbit`, `settling`, `mixture`, `slab`, `slump`, `stl`, `wake`, `fracture` or `invariance`; `benchmark` is
//! what they share, `flow` how they drive a simulation, `shear` how they shear bodies, `report` what is shown.
//! A new one is a folder, a function, and a line in `BENCHMARKS`.
//!
//! The references know nothing of the solver, and tolerances are fixed in the folders before the run.

mod benchmark;
mod cage;
mod cavity;
mod channel;
mod collapse;
mod control_volume;
mod drag;
mod fibre_field;
mod figure;
mod flow;
mod fracture;
mod invariance;
mod l_box;
mod lcpc_box;
mod mixture;
mod momentum;
mod orbit;
mod packing;
mod particles;
mod pipe;
mod profile;
mod report;
mod scales;
mod settling;
mod shear;
mod slab;
mod slip;
mod slump;
mod squeeze;
mod stl;
mod surface;
mod tension;
mod thin_layer;
mod thixotropy;
mod wake;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

use clap::builder::PossibleValuesParser;

use benchmark::{Benchmark, Context};
use report::{Report, Verdict};

/// Arguments of `tremie validate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  tremie validate --quick
  tremie validate cavity-newtonian dam-break-water
  tremie validate --out results

A line is a quantity: reference, value, error, tolerance. The exit code is 1 if any error is larger than its tolerance.")]
pub struct Arguments {
    /// Benchmarks to run; all of them if none is given
    #[arg(value_name = "ID", value_parser = PossibleValuesParser::new(BENCHMARKS.iter().map(|b| b.id)))]
    ids: Vec<String>,
    /// Leave out the benchmarks that take long
    #[arg(long)]
    quick: bool,
    /// Print a JSON list instead of a table
    #[arg(long)]
    json: bool,
    /// Also write the table, the list and figures into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// The files of a folder of `validation/`; all have `benchmark.toml`.
macro_rules! folder {
    ($id:literal $(, $file:literal)*) => {
        &[
            ("benchmark.toml", include_str!(concat!("../../../../validation/", $id, "/benchmark.toml"))),
            $(($file, include_str!(concat!("../../../../validation/", $id, "/", $file))),)*
        ]
    };
}

macro_rules! benchmark {
    ($run:path, $id:literal $(, $file:literal)*) => {
        Benchmark { id: $id, files: folder!($id $(, $file)*), run: $run }
    };
}

/// All benchmarks, in the order in which they run.
const BENCHMARKS: &[Benchmark] = &[
    benchmark!(scales::scaling, "scaling", "case.toml"),
    benchmark!(scales::flow_curves, "flow-curves"),
    benchmark!(channel::channel_newtonian, "channel-newtonian", "case.toml"),
    benchmark!(channel::channel_bingham, "channel-bingham", "case.toml", "reference.csv"),
    benchmark!(channel::channel_herschel_bulkley, "channel-herschel-bulkley", "case.toml", "reference.csv"),
    benchmark!(channel::channel_casson, "channel-casson", "case.toml", "reference.csv"),
    benchmark!(channel::channel_power_law, "channel-power-law", "case.toml", "reference.csv"),
    benchmark!(channel::channel_cross, "channel-cross", "case.toml", "reference.csv"),
    benchmark!(channel::channel_carreau, "channel-carreau", "case.toml"),
    benchmark!(channel::couette_bingham, "couette-bingham", "case.toml"),
    benchmark!(channel::couette_return, "couette-return", "case.toml"),
    benchmark!(channel::film_newtonian, "film-newtonian", "case.toml"),
    benchmark!(pipe::pipe_bingham, "pipe-bingham", "case.toml", "reference.csv"),
    benchmark!(thixotropy::thixotropy_box, "thixotropy-box", "rest.toml", "couette.toml", "stiffen.toml"),
    benchmark!(slip::slip_newtonian, "slip-newtonian", "case.toml"),
    benchmark!(slip::slip_bingham, "slip-bingham", "case.toml"),
    benchmark!(slip::slip_inclined, "slip-inclined", "case.toml"),
    benchmark!(slip::wall_law, "wall-law", "case.toml"),
    benchmark!(cavity::cavity_casson, "cavity-casson", "case.toml", "reference.csv"),
    benchmark!(
        cavity::cavity_newtonian,
        "cavity-newtonian",
        "case.toml",
        "reference.csv",
        "ghia-u.csv",
        "ghia-v.csv"
    ),
    benchmark!(surface::tank_hydrostatic, "tank-hydrostatic", "case.toml"),
    benchmark!(surface::closed_box, "closed-box", "case.toml"),
    benchmark!(surface::advection, "advection-disc", "case.toml"),
    benchmark!(surface::advection, "advection-drop", "case.toml"),
    benchmark!(surface::free_fall, "free-fall", "lbm.toml", "isph.toml", "ldd.toml"),
    benchmark!(surface::falling_lump, "falling-lump", "lbm.toml", "isph.toml", "ldd.toml"),
    benchmark!(tension::capillary_drop, "capillary-drop", "case.toml"),
    benchmark!(invariance::invariance, "invariance", "slump.toml", "lumps.toml"),
    benchmark!(collapse::dam_break_water, "dam-break-water", "case.toml", "reference.csv", "height.csv"),
    benchmark!(collapse::dam_break_bingham, "dam-break-bingham", "case.toml", "reference.csv", "paper.csv"),
    benchmark!(collapse::block_at_rest, "block-at-rest", "case.toml"),
    benchmark!(collapse::collapse_planar_bingham, "collapse-planar-bingham", "case.toml", "reference.csv"),
    benchmark!(particles::hydrostatic_cloud::<tremie_sph::Particles>, "hydrostatic-cloud"),
    benchmark!(particles::tank, "tank-isph", "case.toml"),
    benchmark!(particles::channels, "channel-isph", "case.toml"),
    benchmark!(particles::channels, "channel-sph", "case.toml"),
    benchmark!(particles::kernels, "kernels"),
    benchmark!(particles::taylor_green::<tremie_sph::Particles>, "taylor-green"),
    benchmark!(particles::both_methods, "planar-slump", "isph.toml", "lbm.toml"),
    benchmark!(particles::both_methods, "cone-isph", "isph.toml", "lbm.toml"),
    benchmark!(collapse::block_at_rest, "block-isph", "case.toml"),
    benchmark!(collapse::collapse_planar_bingham, "collapse-isph", "case.toml", "reference.csv"),
    benchmark!(collapse::dam_break_water, "dam-break-isph", "case.toml", "reference.csv", "height.csv"),
    benchmark!(
        collapse::dam_break_bingham,
        "dam-break-bingham-isph",
        "case.toml",
        "reference.csv",
        "paper.csv"
    ),
    benchmark!(particles::operators, "operators-ldd"),
    benchmark!(particles::hydrostatic_cloud::<tremie_ldd::Nodes>, "hydrostatic-ldd"),
    benchmark!(particles::tank, "tank-ldd", "case.toml"),
    benchmark!(particles::channels, "channel-ldd", "case.toml"),
    benchmark!(particles::taylor_green::<tremie_ldd::Nodes>, "taylor-green-ldd"),
    benchmark!(
        cavity::cavity_newtonian_nodes,
        "cavity-ldd",
        "case.toml",
        "reference.csv",
        "ghia-u.csv",
        "ghia-v.csv"
    ),
    benchmark!(cavity::cavity_casson_nodes, "cavity-casson-ldd", "case.toml", "reference.csv"),
    benchmark!(cavity::cavity_skewed, "cavity-skewed", "case.toml", "computed.csv"),
    benchmark!(collapse::block_at_rest, "block-ldd", "case.toml"),
    benchmark!(collapse::dam_break_water, "dam-break-ldd", "case.toml", "reference.csv", "height.csv"),
    benchmark!(
        collapse::dam_break_bingham,
        "dam-break-bingham-ldd",
        "case.toml",
        "reference.csv",
        "paper.csv"
    ),
    benchmark!(collapse::collapse_planar_bingham, "collapse-ldd", "case.toml", "reference.csv"),
    benchmark!(
        particles::slump_abrams,
        "slump-abrams",
        "ldd-papanastasiou.toml",
        "lbm-papanastasiou.toml",
        "ldd-exact.toml",
        "lbm-exact.toml"
    ),
    benchmark!(l_box::l_box_rest, "l-box-rest", "case.toml", "reference.csv"),
    benchmark!(control_volume::control_volume, "control-volume", "l-box.toml", "slab.toml"),
    benchmark!(
        cage::porous_cage,
        "porous-cage",
        "spacing-3.toml",
        "spacing-5.toml",
        "spacing-8.toml",
        "one-row.toml"
    ),
    benchmark!(lcpc_box::lcpc_box, "lcpc-box", "case.toml", "reference.csv"),
    benchmark!(slump::cone_rigid, "cone-rigid", "case.toml"),
    benchmark!(slump::cone_lift, "cone-lift", "case.toml"),
    benchmark!(stl::stl_cone, "stl-cone", "case.toml"),
    benchmark!(slump::gravity_current, "gravity-current", "case.toml"),
    benchmark!(slump::slump_stiff, "slump-stiff", "case.toml", "lifted.toml", "reference.csv"),
    benchmark!(slump::slump_thesis, "slump-thesis", "case.toml"),
    benchmark!(drag::cylinder_drag, "cylinder-drag", "case.toml"),
    benchmark!(drag::sphere_drag, "sphere-drag", "case.toml"),
    benchmark!(drag::fibre_drag, "fibre-drag", "case.toml"),
    benchmark!(momentum::momentum, "momentum", "case.toml"),
    benchmark!(momentum::spread, "moment-spread", "case.toml"),
    benchmark!(orbit::fibre_shear, "fibre-shear", "case.toml"),
    benchmark!(fibre_field::folgar_tucker_shear, "folgar-tucker-shear", "case.toml"),
    benchmark!(fibre_field::squeezed_layer, "squeezed-layer", "case.toml"),
    benchmark!(orbit::jeffery_spheroid, "jeffery-spheroid", "case.toml", "reference.csv"),
    benchmark!(settling::settling_sphere, "settling-sphere", "case.toml", "reference.csv", "velocity.csv"),
    benchmark!(settling::yield_stress_sphere, "yield-stress-sphere", "case.toml", "reference.csv"),
    benchmark!(mixture::dense_contacts, "dense-contacts", "case.toml"),
    benchmark!(mixture::suspension_viscosity, "suspension-viscosity", "case.toml", "reference.csv"),
    benchmark!(mixture::fibre_viscosity, "fibre-viscosity", "case.toml", "reference.csv"),
    benchmark!(packing::wall_effect, "wall-effect", "reference.csv"),
    benchmark!(slump::slump_inclusions, "slump-inclusions", "case.toml"),
    benchmark!(slab::slab_fibres, "slab-fibres", "case.toml"),
    benchmark!(wake::wake, "bar-wake", "case.toml"),
    benchmark!(wake::wake, "stiffener-wake", "case.toml"),
    benchmark!(squeeze::thin_gap, "squeeze-thin-gap", "case.toml"),
    benchmark!(squeeze::newtonian, "squeeze-newtonian", "case.toml"),
    benchmark!(squeeze::load, "squeeze-load", "case.toml", "reference.csv"),
    benchmark!(squeeze::velocity, "squeeze-velocity", "case.toml", "reference.csv"),
    benchmark!(slump::slump_spread, "slump-spread", "case.toml", "reference.csv"),
    benchmark!(fracture::nine_cells, "fracture-v1"),
    benchmark!(fracture::patch, "fracture-v2"),
    benchmark!(fracture::geometry, "fracture-v3"),
    benchmark!(fracture::elastic, "fracture-v4"),
    benchmark!(fracture::softening, "fracture-v5"),
    benchmark!(fracture::tension, "fracture-v6"),
    benchmark!(fracture::plain, "fracture-v7", "reference.csv"),
    benchmark!(fracture::notched, "fracture-v8", "reference.csv"),
    benchmark!(fracture::hinge, "fracture-v9"),
    benchmark!(fracture::single_fibre, "fracture-v10"),
    benchmark!(fracture::many_fibres, "fracture-v11"),
    benchmark!(fracture::counts, "fracture-v12"),
    benchmark!(fracture::fibre_count, "fracture-v13"),
    benchmark!(fracture::lattices, "fracture-v14"),
    benchmark!(fracture::slab, "fracture-v15", "b1.csv", "b2.csv", "b3.csv"),
    benchmark!(fracture::anywhere, "fracture-anywhere", "reference.csv"),
];

/// Runs the benchmarks, shows each once it and those before it have ended, and says whether all pass.
///
/// A benchmark that breaks down has failed; the others still run.
///
/// # Errors
/// If a benchmark's own files are wrong, or the results cannot be shown or written.
pub fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    let Arguments { ids, quick, json, out } = arguments;
    let mut contexts = Vec::new();
    for benchmark in BENCHMARKS {
        let context = Context::new(benchmark)?.drawing(out.as_deref());
        let asked = ids.is_empty() || ids.iter().any(|id| id == benchmark.id);
        if asked && (!quick || context.definition().quick) {
            contexts.push(context);
        }
    }
    let mut report = Report::new(json);
    side_by_side(&contexts, &mut report)?;
    report.close(out.as_deref())?;
    Ok(if report.all_pass() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs as many benchmarks at once as there are threads, which they share: most are small, and gain little from a second thread.
fn side_by_side(contexts: &[Context<'_>], report: &mut Report) -> anyhow::Result<()> {
    let threads = rayon::current_num_threads();
    let at_once = contexts.len().clamp(1, threads);
    let next = AtomicUsize::new(0);
    let (send, ended) = mpsc::channel();
    thread::scope(|scope| {
        for n in 0..at_once {
            let (send, next) = (send.clone(), &next);
            let share = threads / at_once + usize::from(n < threads % at_once);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(share).build()?;
            scope.spawn(move || {
                pool.install(|| {
                    loop {
                        let n = next.fetch_add(1, Ordering::Relaxed);
                        // Nobody listens any more once the results cannot be shown.
                        if contexts.get(n).is_none_or(|context| send.send((n, verdict(context))).is_err()) {
                            break;
                        }
                    }
                });
            });
        }
        drop(send);
        let mut early = BTreeMap::new();
        for (n, verdict) in ended {
            early.insert(n, verdict);
            while let Some(verdict) = early.remove(&report.shown()) {
                report.ends(verdict)?;
            }
        }
        Ok(())
    })
}

/// Runs a benchmark.
fn verdict(context: &Context<'_>) -> Verdict {
    report::progress(&format!("{} begins", context.id()));
    let start = Instant::now();
    let checks = context.run();
    Verdict::new(context.id(), &context.definition().title, checks, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    fn names_in(folder: &Path) -> BTreeSet<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn every_folder_is_a_benchmark_and_every_file_is_built_in() {
        let validation = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../validation");
        let mut folders = names_in(&validation);
        folders.remove("README.md");
        assert_eq!(folders, BENCHMARKS.iter().map(|b| b.id.to_owned()).collect());
        for benchmark in BENCHMARKS {
            let built_in = benchmark.files.iter().map(|(name, _)| (*name).to_owned()).collect();
            assert_eq!(names_in(&validation.join(benchmark.id)), built_in, "{}", benchmark.id);
        }
    }

    #[test]
    fn definitions_are_complete_and_cases_are_right() {
        for benchmark in BENCHMARKS {
            let context = Context::new(benchmark).unwrap();
            let definition = context.definition();
            for text in [&definition.title, &definition.what, &definition.why, &definition.reference] {
                assert!(!text.trim().is_empty(), "{}", benchmark.id);
            }
            let limits = definition.tolerances.values().chain(definition.at_least.values());
            assert!(limits.clone().count() > 0 && limits.clone().all(|t| *t >= 0.0), "{}", benchmark.id);
            for (name, _) in benchmark.files {
                match name.rsplit_once('.') {
                    Some((_, "csv")) => assert!(!context.table(name).unwrap().is_empty()),
                    _ if *name != "benchmark.toml" => drop(context.case(name).unwrap()),
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn what_needs_no_flow_passes() {
        for id in ["scaling", "flow-curves"] {
            let benchmark = BENCHMARKS.iter().find(|b| b.id == id).unwrap();
            let checks = (benchmark.run)(&Context::new(benchmark).unwrap()).unwrap();
            assert!(!checks.is_empty());
            for check in checks {
                assert!(check.passes(), "{id}: {check:?}");
            }
        }
    }
}
