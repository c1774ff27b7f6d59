//! The `sombrero` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    sombrero_cli::run(std::env::args_os())
}
