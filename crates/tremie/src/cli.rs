//! The command line: what can be typed.

use std::num::NonZeroUsize;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::{
    bench, calc, check, compare, export, failure, fibres, fracture, lab, report, run, schema, template,
    validate,
};

/// Virtual laboratory and casting simulator for fresh concrete and other yield-stress fluids.
#[derive(Debug, Parser)]
#[command(
    version,
    propagate_version = true,
    after_help = "\
Examples:
  tremie lab slump-flow --yield-stress 50Pa --viscosity 30Pa.s
  tremie calc yield-stress --slump-flow 600mm
  tremie new planar-collapse
  tremie check planar-collapse.toml
  tremie run planar-collapse.toml
  tremie resume runs/planar-collapse
  tremie report runs/planar-collapse
  tremie fibres runs/fibre-slump
  tremie fracture --from runs/fibre-slab --beam B1
  tremie export runs/fibre-slump --format csv"
)]
struct Program {
    /// Threads that compute [default: all cores]; the results do not depend on it
    #[arg(long, global = true, value_name = "N")]
    threads: Option<NonZeroUsize>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented case file to start from
    New(template::Arguments),
    /// Print the JSON Schema of the case file, for editors
    Schema(schema::Arguments),
    /// Do a standard test in the virtual laboratory
    #[command(subcommand)]
    Lab(lab::Experiment),
    /// Work out a formula: slump, spread, L-box, pipe, formwork and more
    Calc(calc::Arguments),
    /// Run a case file
    Run(run::RunArguments),
    /// Go on with an interrupted run
    Resume(run::ResumeArguments),
    /// Make one page of a run: results, figures, pictures, checks
    Report(report::Arguments),
    /// Show the same gauges of several runs side by side
    Compare(compare::Arguments),
    /// Cut beams and planes out of a finished cast, and tell how the fibres in them lie
    Fibres(fibres::Arguments),
    /// Test a hardened beam, with every fibre that a cast has left in it
    Fracture(fracture::Arguments),
    /// Write the aggregates and fibres of a run as other programs read them
    Export(export::Arguments),
    /// Say what a case will cost, and whether its numbers are sound
    Check(check::Arguments),
    /// Compare benchmarks with their references
    Validate(validate::Arguments),
    /// Say how fast this machine is, against what its memory allows
    Bench(bench::Arguments),
}

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    let program = Program::parse();
    let result = (|| {
        // Within one pool, or else every parallel loop would be handed over from the main thread.
        let threads = program.threads.map_or(0, NonZeroUsize::get);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| match program.command {
            Command::New(arguments) => template::run(&arguments),
            Command::Schema(arguments) => Ok(schema::run(&arguments)),
            Command::Lab(experiment) => lab::run(experiment),
            Command::Calc(arguments) => calc::run(&arguments),
            Command::Run(arguments) => run::run(arguments),
            Command::Resume(arguments) => run::resume(&arguments),
            Command::Report(arguments) => report::run(&arguments),
            Command::Compare(arguments) => compare::run(&arguments),
            Command::Fibres(arguments) => fibres::run(&arguments),
            Command::Fracture(arguments) => fracture::run(&arguments),
            Command::Export(arguments) => export::run(&arguments),
            Command::Check(arguments) => check::run(&arguments),
            Command::Validate(arguments) => validate::run(arguments),
            Command::Bench(arguments) => bench::run(&arguments),
        })
    })();
    result.unwrap_or_else(|error| failure::report(&error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Program::command().debug_assert();
    }
}
