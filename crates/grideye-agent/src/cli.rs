//! The command line of `grideye-agent`: names, defaults and help, for the program and for what is written from them
//! (man pages, completions).
//!
//! `--help` is one screen of 80 columns, with an example; `grideye-agent help COMMAND` and the man page say everything.

use amg8833::Address;
use clap::{Arg, ArgAction, Args, Command as ClapCommand, Parser, Subcommand};
use clap::{CommandFactory as _, FromArgMatches as _};
use std::path::PathBuf;

/// The service's configuration.
pub const CONFIG_FILE: &str = "/etc/grideye/agent.toml";
/// The bus that is looked at where none is named.
pub const BUS: &str = "/dev/i2c-1";
/// Where joining leaves what the service reads.
pub const JOINED_FILE: &str = "/etc/grideye/collector.toml";
/// Behind every option of our own.
const HELP_COMES_LAST: usize = 1000;

/// Reads AMG8833 sensors over I2C and delivers every frame to a collector, once.
///
/// Exit codes: 0 done, 1 failed, 2 bad usage or configuration, 3 finished but data was lost.
///
/// Example: grideye-agent check --bus /dev/i2c-1 --address 0x69
#[derive(Debug, Parser)]
#[command(name = "grideye-agent", version, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What the program is asked to do.
#[derive(Debug, Subcommand)]
#[expect(
    missing_docs,
    reason = "a comment here would stand in the help instead of the longer one of the options"
)]
pub enum Command {
    Check(CheckArgs),
    Join(JoinArgs),
    Run(RunArgs),
}

/// Look for the sensors, show a frame of each, and say what to do about a failure.
///
/// Opens the bus, sets the sensor up, shows one frame and the measured rate. With a configuration every sensor of it, the
/// clock, the way to the collector, and what a loss of power can cost. Where nothing is named, and the service has a
/// configuration, /etc/grideye/agent.toml, it is that one.
///
/// Exit code 1: a sensor or the collector is not as it should be.
///
/// Example: grideye-agent check --config /etc/grideye/agent.toml
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Check all of this configuration, and the way to the collector.
    ///
    /// By default /etc/grideye/agent.toml if it is there, unless a bus or an address is named.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["bus", "address"])]
    pub config: Option<PathBuf>,
    /// The bus to look at [default: /dev/i2c-1].
    #[arg(long, value_name = "DEVICE")]
    pub bus: Option<PathBuf>,
    /// The sensor's 7-bit address [default: 0x69].
    #[arg(long, value_parser = parse_address)]
    pub address: Option<Address>,
    /// One JSON object a sensor and line, for programs.
    #[arg(long)]
    pub json: bool,
}

impl CheckArgs {
    /// The address to look at.
    #[must_use]
    pub fn address(&self) -> Address {
        self.address.unwrap_or(Address::High)
    }
}

/// Join a collector: `grideye enroll DEVICE` prints this command with its code there.
///
/// In six steps, each told when it is done: reads the line; reaches the collector and believes its authority by the pin in
/// the line; posts a batch without frames to see that this device's frames are taken; keeps address, token and authority in a file; enables and starts the service
/// where systemd runs and has it; waits until the collector has a frame. A step that fails is named, with what to do. Until
/// the file nothing is changed; what is done then stays, and the line may be pasted again.
///
/// Exit codes: 1 a step failed, 2 the line or a file is wrong, 3 no frame in time.
///
/// Example: echo 'CODE' | sudo grideye-agent join -
#[derive(Debug, Args)]
pub struct JoinArgs {
    /// The code in that line; `-` reads standard input [default: -].
    ///
    /// It begins with `grideye:`; the whole line is understood as well. A terminal is asked for it. As an argument, in
    /// quotation marks, other users of this machine can see it and its token in the list of processes.
    #[arg(default_value = "-", hide_default_value = true)]
    pub code: String,
    /// Where to keep what joining leaves.
    ///
    /// `collector.toml` beside the agent's configuration is found by itself.
    #[arg(long, value_name = "FILE", default_value = JOINED_FILE)]
    pub out: PathBuf,
    /// Start nothing: leave it at the file.
    #[arg(long, conflicts_with_all = ["service", "wait"])]
    pub no_start: bool,
    /// Another service that reads it [default: grideye-agent].
    ///
    /// With a file of one's own nothing is started, unless this names the unit that reads it, and `agent.toml` beside it.
    #[arg(long, value_name = "UNIT")]
    pub service: Option<String>,
    /// How long to wait for the first frame.
    #[arg(long, value_name = "SECONDS", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub wait: u64,
    /// The agent's own certificate with its chain, in PEM.
    ///
    /// For a collector that asks for one.
    #[arg(long, value_name = "FILE", requires = "client_key")]
    pub client_cert: Option<PathBuf>,
    /// The key of that certificate, in PEM.
    #[arg(long, value_name = "FILE", requires = "client_cert")]
    pub client_key: Option<PathBuf>,
}

/// Read and deliver until SIGINT or SIGTERM, or until each sensor has given N frames.
///
/// What the collector does not have waits in memory, and then in the spool that the configuration names.
///
/// Exit code 3: finished, but frames were lost.
///
/// Example: grideye-agent run --config /etc/grideye/agent.toml
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The agent's configuration.
    #[arg(long, value_name = "FILE")]
    pub config: PathBuf,
    /// Stop after this many frames of each sensor.
    #[arg(long, value_name = "N")]
    pub frames: Option<u64>,
    /// How the log on standard error is written.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub log: LogFormat,
}

/// The form of log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object a line, for programs.
    Json,
}

/// The command line that the program was started with; ends the program where it is not understood, or asks for help.
#[must_use]
pub fn parse() -> Cli {
    Cli::from_arg_matches(&command().get_matches()).unwrap_or_else(|error| error.exit())
}

/// The whole command line as it is parsed and documented.
#[must_use]
pub fn command() -> ClapCommand {
    on_a_screen(Cli::command())
}

/// The same program with a `--help` of one screen, behind which `help COMMAND` says everything.
///
/// The first paragraph of a comment is what `--help` says; the paragraphs that begin with `Exit code` and `Example: ` stand
/// at the end of either.
#[must_use]
pub fn on_a_screen(command: ClapCommand) -> ClapCommand {
    let program = command.get_name().to_owned();
    let help = Arg::new("help")
        .short('h')
        .long("help")
        .global(true)
        .action(ArgAction::HelpShort)
        .display_order(HELP_COMES_LAST)
        .help(format!("Print this; `{program} help …` says more"));
    ended(command, &program).disable_help_flag(true).arg(help)
}

/// Exit codes and example at the end, for this command and those below.
fn ended(command: ClapCommand, path: &str) -> ClapCommand {
    let long = command.get_long_about().map(ToString::to_string);
    let long = long.unwrap_or_default();
    let mut first = Vec::new();
    let mut end = String::new();
    if command.get_arguments().any(Arg::is_hide_short_help_set) {
        end = format!("More options: {}\n", path.replacen(' ', " help ", 1));
    }
    for paragraph in long.split("\n\n") {
        if let Some(example) = paragraph.strip_prefix("Example: ") {
            end += &format!("Example:\n  {example}\n");
        } else if paragraph.starts_with("Exit code") {
            end += &format!("{paragraph}\n");
        } else {
            first.push(paragraph);
        }
    }
    let command = if end.is_empty() {
        command
    } else {
        command.after_help(end).long_about(first.join("\n\n"))
    };
    command.mut_subcommands(|below| {
        let path = format!("{path} {}", below.get_name());
        ended(below, &path)
    })
}

fn parse_address(text: &str) -> Result<Address, String> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let number = digits.map_or_else(|| text.parse(), |digits| u8::from_str_radix(digits, 16));
    let number: u8 =
        number.map_err(|error| format!("expected 0x68 or 0x69, found {text:?}: {error}"))?;
    Address::try_from(number).map_err(|error| error.to_string())
}
