//! The command line: what can be typed.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::validate;

#[derive(Debug, Parser)]
#[command(version, about)]
struct Program {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compare every benchmark with its reference.
    Validate(validate::Arguments),
}

/// Runs the program.
pub fn main() -> ExitCode {
    let done = match Program::parse().command {
        Command::Validate(arguments) => validate::run(arguments),
    };
    done.unwrap_or(ExitCode::FAILURE)
}
