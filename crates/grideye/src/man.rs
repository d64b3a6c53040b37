//! `grideye man`: the man pages of both programs, one for each command, from the command lines themselves.

use crate::cli::{self, Man};
use crate::exit::{Outcome, bad_input};
use crate::files;
use crate::output::outln;
use anyhow::{Result, anyhow};
use clap::Command;
use clap_mangen::Man as Page;
use std::io::{self, Write};
use std::path::Path;

pub(crate) fn run(options: &Man) -> Result<Outcome> {
    let folder = &options.folder;
    let shown = folder.display();
    std::fs::create_dir_all(folder).map_err(|error| {
        bad_input(anyhow!(
            "cannot make {shown}: {error}\nhint: name a folder that you may write"
        ))
    })?;
    let mut pages = 0;
    for program in [cli::command(), grideye_agent::cli::command()] {
        let mut program = program.disable_help_subcommand(true);
        program.build();
        pages += write_pages(&program, folder)?;
    }
    outln!("wrote {pages} man pages to {shown}")?;
    Ok(Outcome::Done)
}

fn write_pages(command: &Command, folder: &Path) -> Result<usize> {
    let name = command.get_display_name();
    let name = name.unwrap_or_else(|| command.get_name()).to_owned();
    let path = folder.join(format!("{name}.1"));
    files::write_whole(&path, |file| Ok(write_page(command, &name, file)?))?;
    let below = command.get_subcommands();
    let below = below.map(|below| write_pages(below, folder));
    below.sum::<Result<usize>>().map(|pages| pages + 1)
}

/// As `clap_mangen` writes a page, but with the end of the help under the headings that man pages have for it.
fn write_page(command: &Command, name: &str, out: &mut impl Write) -> io::Result<()> {
    let version = env!("CARGO_PKG_VERSION");
    // A man page is complete, but clap_mangen leaves out the text of options that the short help leaves out.
    let complete = command.clone().mut_args(|arg| arg.hide_short_help(false));
    let page = Page::new(complete)
        .title(name)
        .source(format!("grideye-hil {version}"))
        .manual("Grid-EYE AMG8833");
    page.render_title(out)?;
    page.render_name_section(out)?;
    page.render_synopsis_section(out)?;
    page.render_description_section(out)?;
    page.render_options_section(out)?;
    if command.has_subcommands() {
        page.render_subcommands_section(out)?;
    }
    let end = command.get_after_long_help().map(ToString::to_string);
    let end = end.unwrap_or_default();
    let (before, examples) = end.split_once("Example:\n").unwrap_or((&end, ""));
    if let Some(line) = before.lines().find(|line| line.starts_with("Exit code")) {
        write!(out, ".SH \"EXIT STATUS\"\n{}\n", roff(line))?;
    }
    writeln!(out, ".SH EXAMPLE\n.nf")?;
    for example in examples.lines() {
        writeln!(out, "{}", roff(example.trim_start()))?;
    }
    writeln!(out, ".fi")?;
    Ok(())
}

/// A line of text as roff takes it: no command, and with hyphens and quotation marks that can be copied into a shell.
fn roff(line: &str) -> String {
    let escaped = line
        .replace('\\', "\\e")
        .replace('-', "\\-")
        .replace('\'', "\\(aq")
        .replace('`', "\\(ga");
    if escaped.starts_with('.') {
        format!("\\&{escaped}")
    } else {
        escaped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_text_whatever_it_begins_with() {
        assert_eq!(roff(".PP"), "\\&.PP");
        assert_eq!(roff("a --b \\n"), "a \\-\\-b \\en");
    }
}
