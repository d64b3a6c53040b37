//! The program `grideye-agent`: parses its command line and runs a subcommand.

mod command;

use grideye_agent::cli::{self, Command};
use grideye_agent::output::say;
use std::process::ExitCode;

fn main() -> ExitCode {
    let outcome = match cli::parse().command {
        Command::Check(args) => command::check::run(&args),
        Command::Join(args) => command::join::run(&args),
        Command::Run(args) => command::run::run(&args),
        Command::Resend(args) => command::resend::run(&args),
    };
    outcome.unwrap_or_else(|error| {
        say(&format_args!("error: {error:#}"));
        command::common::code_of(&error)
    })
}
