//! `claymill man`: the manual as pages for `man`, one a command.

use std::process::ExitCode;

use clap::CommandFactory;
use clap_mangen::Man;
use claymill_toolpath::Kind;

use super::Context;
use crate::args::{Cli, ManArgs};
use crate::failure::Failure;
use crate::output;

/// `claymill man`.
pub(crate) fn man(context: &Context, args: &ManArgs) -> Result<ExitCode, Failure> {
    std::fs::create_dir_all(&args.out).map_err(Failure::at(&args.out))?;
    let mut pages = Vec::new();
    for page in manual() {
        let path = args.out.join(page.get_filename());
        let mut text = Vec::new();
        page.render(&mut text).map_err(Failure::at(&path))?;
        // All are looked at before one is written.
        pages.push((output::begin(context, &path, Kind::Manual, &[])?, text, path));
    }
    let mut written = Vec::new();
    for (out, text, path) in pages {
        output::write(out, Kind::Manual, &text)?;
        written.push(path.display().to_string());
    }
    if context.json {
        context.print_json(&serde_json::json!({"pages": written}))?;
    } else {
        context.console.say(format!("{} pages in {}", written.len(), args.out.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// The command's own page, and one for each of its commands that the help lists.
fn manual() -> Vec<Man> {
    let mut whole = Cli::command().disable_help_subcommand(true);
    whole.build();
    let commands = whole.get_subcommands().filter(|c| !c.is_hide_set()).cloned().collect::<Vec<_>>();
    std::iter::once(whole).chain(commands).map(Man::new).collect()
}
