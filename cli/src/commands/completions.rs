//! `claymill completions`: the script by which a shell completes commands and options.

use std::io::Write;
use std::process::ExitCode;

use clap::CommandFactory;

use super::Context;
use crate::args::{Cli, CompletionsArgs};
use crate::failure::Failure;

/// `claymill completions`.
pub(crate) fn completions(context: &Context, args: &CompletionsArgs) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "claymill", &mut script);
    if context.json {
        let script = String::from_utf8_lossy(&script);
        context.print_json(&serde_json::json!({"shell": args.shell.to_string(), "script": script}))?;
        return Ok(ExitCode::SUCCESS);
    }
    match std::io::stdout().lock().write_all(&script) {
        // A reader that has seen enough (`| head`) is no error.
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::problem(format!("standard output: {e}"), ""))
        }
        _ => Ok(ExitCode::SUCCESS),
    }
}
