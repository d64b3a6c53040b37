//! The commands of `grideye` in groups: the list in its help.

use clap::Command;

type Group = (&'static str, &'static [(&'static str, &'static str)]);

/// Every command in a few words, in the two columns of `--help`.
const COLUMNS: [&[Group]; 2] = [
    &[
        ("Start here", &[("demo", "Try it without hardware")]),
        (
            "Capture",
            &[
                ("collect", "Receive and show frames"),
                ("enroll", "Let a device join"),
                ("record", "Name and save frames"),
                ("orient", "Find a sensor's mounting"),
            ],
        ),
        (
            "Simulate",
            &[
                ("simulate", "Compute a scene's frames"),
                ("dataset", "Make labeled frames"),
                ("fuse", "Merge several sensors"),
                ("distinguish", "Tell situations apart"),
                ("coverage", "Place sensors in a room"),
            ],
        ),
        ("Emulate", &[("emulate", "Test a driver or program")]),
    ],
    &[
        (
            "Compare",
            &[
                ("compare", "Recording against scene"),
                ("calibrate", "Fit a scene's unknowns"),
                ("characterize", "Measure a sensor's noise"),
            ],
        ),
        (
            "Data",
            &[
                ("convert", "Change the file format"),
                ("audit", "Account for every frame"),
                ("backup", "Copy a running store"),
                ("migrate", "Move to PostgreSQL"),
            ],
        ),
        (
            "Administration",
            &[
                ("token", "Manage access tokens"),
                ("mqtt", "Clean up Home Assistant"),
                ("completions", "Complete in your shell"),
                ("man", "Write man pages"),
            ],
        ),
    ],
];
const COLUMN_WIDTH: usize = 40;
const OPTIONS: &str = "Options:
  -V, --version   Print version
  -h, --help      Print help
      --help-all  Print help with every option and detail
";

/// Puts the groups into the help of the program, in place of clap's plain list.
pub(super) fn listed(command: Command) -> Command {
    let end = command.get_after_long_help().map(ToString::to_string);
    let end = end.unwrap_or_default();
    let short = format!(
        "{}\n{end}\nMore: grideye COMMAND --help, grideye --help-all",
        in_two_columns()
    );
    let long = format!("{}{OPTIONS}\n{end}", one_on_a_line(&command));
    command
        .help_template("{about-with-newline}\n{usage-heading} {usage}{after-help}")
        .after_help(short)
        .after_long_help(long)
}

fn in_two_columns() -> String {
    let lines = |groups: &[Group]| -> Vec<String> {
        let group = |(title, commands): &Group| {
            let of = |(name, brief): &(&str, &str)| format!("  {name:12} {brief}");
            let title = std::iter::once(format!("{title}:"));
            title.chain(commands.iter().map(of)).collect::<Vec<_>>()
        };
        groups.iter().flat_map(group).collect()
    };
    let [left, right] = COLUMNS.map(lines);
    let mut right = right.into_iter();
    let beside = |line: String| {
        let right = right.next().unwrap_or_default();
        format!("{line:COLUMN_WIDTH$}{right}").trim_end().to_owned() + "\n"
    };
    left.into_iter().map(beside).collect()
}

fn one_on_a_line(command: &Command) -> String {
    let mut list = String::new();
    for (title, commands) in COLUMNS.into_iter().flatten() {
        list += &format!("{title}:\n");
        for (name, _) in *commands {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            list += &format!("  {name:12}  {about}\n");
        }
        list += "\n";
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli;

    #[test]
    fn the_groups_have_every_command_once_and_no_other() {
        let groups = COLUMNS.into_iter().flatten();
        let mut listed: Vec<&str> = groups
            .flat_map(|(_, commands)| commands.iter().map(|(name, _)| *name))
            .collect();
        let program = cli::command();
        let mut real: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
        listed.sort_unstable();
        real.sort_unstable();
        assert_eq!(listed, real);
    }
}
