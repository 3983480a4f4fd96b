//! Tremie's command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    tremie::main()
}
