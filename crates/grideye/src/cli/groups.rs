//! The commands of `grideye` in groups: the list in its help.

use clap::Command;

/// Every command in a few words, in the two columns of `--help`.
const LEFT: &str = "Start here:
  demo         Try it without hardware
  view         Play any recording
Capture:
  collect      Receive and show frames
  enroll       Let a device join
  record       Name and save frames
  orient       Find a sensor's mounting
Simulate, emulate:
  simulate     Compute a scene's frames
  dataset      Make labeled frames
  fuse         Merge several sensors
  distinguish  Tell situations apart
  coverage     Place sensors in a room
  emulate      Test a driver or program";
const RIGHT: &str = "Compare, measure, count:
  compare      Recording against scene
  calibrate    Fit a scene's unknowns
  characterize Measure a sensor's noise
  count        Count people in frames
Data, administration:
  convert      Change the file format
  audit        Account for every frame
  backup       Copy a running store
  restore      Put a backup in place
  migrate      Move to PostgreSQL
  token        Manage access tokens
  mqtt         Clean up Home Assistant
  completions  Complete in your shell
  man          Write man pages
";
const WIDTH: usize = 40;
const OPTIONS: &str = "Options:
  -V, --version   Print version
  -h, --help      Print help
      --help-all  Print complete help
";

/// Puts the groups into the help of the program, in place of clap's plain list.
pub(super) fn listed(command: Command) -> Command {
    let end = command.get_after_long_help().map(ToString::to_string);
    let end = end.unwrap_or_default();
    let mut short = String::new();
    for (left, right) in LEFT.lines().zip(RIGHT.split('\n')) {
        short += format!("{left:WIDTH$}{right}").trim_end();
        short += "\n";
    }
    short += &format!("\n{end}\nMore: grideye COMMAND --help, grideye --help-all");
    let mut long = String::new();
    for line in LEFT.lines().chain(RIGHT.lines()) {
        long += &in_full(line, &command);
    }
    command
        .help_template("{about-with-newline}\n{usage-heading} {usage}{after-help}")
        .after_help(short)
        .after_long_help(format!("{}\n\n{OPTIONS}\n{end}", long.trim()))
}

/// A title, or a command with its help.
fn in_full(line: &str, command: &Command) -> String {
    let Some(name) = line
        .strip_prefix("  ")
        .and_then(|line| line.split(' ').next())
    else {
        return format!("\n{line}\n");
    };
    let about = command.find_subcommand(name).and_then(Command::get_about);
    let about = about.map(ToString::to_string).unwrap_or_default();
    format!("  {name:12}  {about}\n")
}
