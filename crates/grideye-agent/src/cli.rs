//! The command line of `grideye-agent`: names, defaults and help. Man pages and completions are generated from it.
//!
//! `--help` fits a screen of 24 lines and 80 columns; `--help-all` and the man page have everything.

use crate::output;
use amg8833::Address;
use clap::CommandFactory as _;
use clap::builder::PossibleValue;
use clap::{Arg, ArgAction, Args, Command as ClapCommand, Parser, Subcommand};
use std::path::PathBuf;

/// The service's configuration.
pub const CONFIG_FILE: &str = "/etc/grideye/agent.toml";
/// The bus that `check` opens by default.
pub const BUS: &str = "/dev/i2c-1";
/// The file that `join` writes and the service reads.
pub const JOINED_FILE: &str = "/etc/grideye/collector.toml";
/// Sorts help after every other option.
const HELP_COMES_LAST: usize = 1000;

/// Read AMG8833 sensors and deliver every frame to a collector exactly once.
///
/// Exit codes: 0 done, 1 failed, 2 bad usage or configuration, 3 done but data lost
///
/// Example: grideye-agent check --bus /dev/i2c-1 --address 0x69
#[derive(Debug, Parser)]
#[command(name = "grideye-agent", version, max_term_width = 100)]
pub struct Cli {
    /// The command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands of the program.
#[derive(Debug, Subcommand)]
#[expect(
    missing_docs,
    reason = "a comment here would replace the help of the command"
)]
pub enum Command {
    Check(CheckArgs),
    Join(JoinArgs),
    Run(RunArgs),
    Resend(ResendArgs),
}

/// Test the sensors and show how to fix what fails.
///
/// Opens the bus, configures the sensor, and prints one frame and the measured frame rate. With a configuration, tests all
/// of its sensors, the clock and the connection to the collector, and prints how much data a power cut can lose.
///
/// Without options, checks /etc/grideye/agent.toml if it exists, otherwise address 0x69 on /dev/i2c-1.
///
/// Exit code 1: a sensor or the collector failed the test
///
/// Example: grideye-agent check --config /etc/grideye/agent.toml
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Configuration [default: /etc/grideye/agent.toml].
    ///
    /// The default applies if that file exists and neither --bus nor --address is given.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["bus", "address"])]
    pub config: Option<PathBuf>,
    /// I2C bus of the sensor [default: /dev/i2c-1].
    #[arg(long, value_name = "DEVICE")]
    pub bus: Option<PathBuf>,
    /// Address of the sensor: 0x68 or 0x69 [default: 0x69].
    #[arg(long, value_parser = parse_address)]
    pub address: Option<Address>,
    /// Print JSON, one object per line.
    #[arg(long)]
    pub json: bool,
}

impl CheckArgs {
    /// The address given, or the default.
    #[must_use]
    pub fn address(&self) -> Address {
        self.address.unwrap_or(Address::High)
    }
}

/// Join a collector with the code that `grideye enroll` printed.
///
/// Joining runs six steps. Each reports success or tells you how to fix it:
///
/// 1. read the code;
/// 2. reach the collector and verify its authority by the pin in the code;
/// 3. post an empty batch to prove that the token works for this device;
/// 4. write address, token and authority to a file;
/// 5. enable and start the service, if systemd runs and has it;
/// 6. wait until the collector has a frame.
///
/// Nothing changes before step 4. If a later step fails, the file stays, and you may run the same command again.
///
/// Exit codes: 1 a step failed, 2 bad code or file, 3 no frame in time
///
/// Example: echo 'CODE' | sudo grideye-agent join -
#[derive(Debug, Args)]
pub struct JoinArgs {
    /// Code from `grideye enroll`; `-` reads standard input [default: -].
    ///
    /// Starts with `grideye:`. The whole line that `grideye enroll` printed works too. On a terminal, you are asked for it.
    /// As an argument, quoted, the code and its token are visible to other users of this machine in the process list.
    #[arg(default_value = "-", hide_default_value = true)]
    pub code: String,
    /// File to write.
    ///
    /// The agent reads `collector.toml` beside its configuration.
    #[arg(long, value_name = "FILE", default_value = JOINED_FILE)]
    pub out: PathBuf,
    /// Replace the file if it exists.
    ///
    /// Without this option, a file that says something else stays, and joining fails.
    #[arg(long)]
    pub replace: bool,
    /// Stop after writing the file; start no service.
    #[arg(long, conflicts_with_all = ["service", "wait"])]
    pub no_start: bool,
    /// Service to start [default: grideye-agent].
    ///
    /// With another --out, no service starts unless this option names the one that reads that file and the `agent.toml`
    /// beside it.
    #[arg(long, value_name = "UNIT")]
    pub service: Option<String>,
    /// Wait for a frame, 1 to 3600 s.
    #[arg(long, value_name = "SECONDS", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub wait: u64,
    /// Client certificate with its chain (PEM).
    ///
    /// Needed if the collector runs with --tls-client-ca.
    #[arg(long, value_name = "FILE", requires = "client_key")]
    pub client_cert: Option<PathBuf>,
    /// Private key of --client-cert (PEM).
    #[arg(long, value_name = "FILE", requires = "client_cert")]
    pub client_key: Option<PathBuf>,
}

/// Read sensors and deliver frames until SIGINT or SIGTERM.
///
/// Frames that the collector does not have yet wait in memory, then in the spool, if the configuration has one.
///
/// Exit code 3: done, but frames were lost
///
/// Example: grideye-agent run --config /etc/grideye/agent.toml
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Configuration of the agent (TOML).
    #[arg(long, value_name = "FILE")]
    pub config: PathBuf,
    /// Stop after N frames of each sensor [default: never].
    #[arg(long, value_name = "N")]
    pub frames: Option<u64>,
    /// Log format.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub log: LogFormat,
}

/// Send again the records that the collector rejected.
///
/// A record that a collector rejects for its content is kept in the spool's folder quarantine/ and counted as dropped. Once
/// the cause is gone (another agent had the same device name, an older collector did not know a value), this sends them
/// again, also beside a running agent. The collector's count of dropped frames falls by those that it takes.
///
/// Exit code 1: some were rejected again, and stay
///
/// Example: grideye-agent resend --config /etc/grideye/agent.toml
#[derive(Debug, Args)]
pub struct ResendArgs {
    /// Configuration [default: /etc/grideye/agent.toml].
    #[arg(long, value_name = "FILE", default_value = CONFIG_FILE, hide_default_value = true)]
    pub config: PathBuf,
}

/// The format of log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object per line.
    Json,
}

/// Parses the program's arguments; exits if they are wrong or ask for help.
#[must_use]
pub fn parse() -> Cli {
    output::arguments(command())
}

/// The whole command line, as parsed and documented.
#[must_use]
pub fn command() -> ClapCommand {
    with_helps(Cli::command())
}

/// Adds the short `--help` and the complete `--help-all` to a program.
///
/// The first paragraph of a comment is in both, the rest in `--help-all`. Paragraphs that begin with `Exit code` or
/// `Example: ` end both.
#[must_use]
pub fn with_helps(command: ClapCommand) -> ClapCommand {
    let program = command.get_name().to_owned();
    let help = Arg::new("help")
        .short('h')
        .long("help")
        .global(true)
        .action(ArgAction::HelpShort)
        .display_order(HELP_COMES_LAST)
        .help("Print help");
    let help_all = Arg::new("help-all")
        .long("help-all")
        .global(true)
        .action(ArgAction::HelpLong)
        .display_order(HELP_COMES_LAST)
        .hide_short_help(true)
        .help("Print complete help");
    ended(command, &program)
        .disable_help_flag(true)
        .args([help, help_all])
}

/// Adds exit codes and example at the end, for this command and its subcommands; lets every option take a negative number.
fn ended(command: ClapCommand, path: &str) -> ClapCommand {
    let long = command.get_long_about().map(ToString::to_string);
    let (mut about, mut exit, mut examples) = (Vec::new(), String::new(), String::new());
    for paragraph in long.unwrap_or_default().split("\n\n") {
        if let Some(example) = paragraph.strip_prefix("Example: ") {
            examples += &format!("\n  {example}");
        } else if paragraph.starts_with("Exit code") {
            exit += &format!("{paragraph}\n");
        } else {
            about.push(paragraph.to_owned());
        }
    }
    let end = format!("{exit}Example:{examples}");
    let more = match about.len() > 1 || command.get_arguments().any(has_more) {
        true => format!("\nMore: {path} --help-all"),
        false => String::new(),
    };
    let negative = |option: Arg| match option.get_action().takes_values() {
        true if !option.is_positional() => option.allow_negative_numbers(true),
        _ => option,
    };
    command
        .after_help(format!("{end}{more}"))
        .after_long_help(end)
        .long_about(about.join("\n\n"))
        .mut_args(negative)
        .mut_subcommands(|below| {
            let path = format!("{path} {}", below.get_name());
            ended(below, &path)
        })
}

/// Whether the complete help says more of an argument than the short one.
fn has_more(argument: &Arg) -> bool {
    let choices = argument.get_possible_values();
    argument.is_hide_short_help_set()
        || argument.get_long_help().is_some()
        || choices
            .iter()
            .any(|choice| PossibleValue::get_help(choice).is_some())
}

fn parse_address(text: &str) -> Result<Address, String> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let number = digits.map_or_else(|| text.parse(), |digits| u8::from_str_radix(digits, 16));
    let number: u8 =
        number.map_err(|error| format!("expected 0x68 or 0x69, found {text:?}: {error}"))?;
    Address::try_from(number).map_err(|error| error.to_string())
}
