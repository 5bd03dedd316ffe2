//! The `claymill` command.

mod args;
mod clearance;
mod commands;
mod console;
mod failure;
mod interrupt;
mod material;
mod memory;
mod merging;
mod output;
mod relaunch;
mod reuse;
mod secret;
mod trace;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};
use console::Console;
use failure::{Failure, MORE_MEMORY, PROBLEM};

fn main() -> ExitCode {
    let cli = Cli::parse();
    if cli.command.draws() {
        relaunch::without_display_layer();
    }
    let is_scheduled = cli.command.is_scheduled();
    interrupt::install(is_scheduled);
    memory::watch(if is_scheduled { MORE_MEMORY } else { PROBLEM });
    match run(&cli) {
        Ok(code) => code,
        Err(failure) => {
            interrupt::wait_if_interrupted();
            eprintln!("{failure}");
            ExitCode::from(failure.code())
        }
    }
}

/// A worker that waits begins other work on top of what it has: regions upon regions, in the worst case. Only what is
/// used of it takes memory.
const STACK_BYTES: usize = 64 << 20;

/// More worker threads than this for each core only take memory.
const MOST_THREADS_PER_CORE: usize = 8;
const FEWEST_MOST_THREADS: usize = 64;

fn run(cli: &Cli) -> Result<ExitCode, Failure> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = (MOST_THREADS_PER_CORE * cores).max(FEWEST_MOST_THREADS);
    if cli.threads > most {
        return Err(Failure::usage(
            format!("{} worker threads are too many for {cores} cores: at most {most}", cli.threads),
            "Leave --threads out: there is one for each core.",
        ));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(cli.threads)
        .stack_size(STACK_BYTES)
        .build_global()
        .map_err(|e| Failure::problem(format!("no worker threads: {e}"), "Try a smaller --threads."))?;
    cli.log.as_deref().map_or(Ok(()), trace::begin)?;
    let console = Console::new(cli.quiet);
    let context = commands::Context { console: &console, json: cli.json, force: cli.force };
    match &cli.command {
        Command::Demo(args) => commands::demo(&context, args),
        Command::Inspect(args) => commands::inspect(&context, args),
        Command::Drop(args) => commands::drop(&context, args),
        Command::Prototype(args) => commands::prototype_command(&context, args),
        Command::Reach(args) => commands::reach(&context, args),
        Command::Merge(args) => commands::merge(&context, args),
        Command::Plan(args) => commands::plan(&context, args),
        Command::Diff(args) => commands::diff(&context, args),
        Command::Stock(args) => commands::stock(&context, args),
        Command::Store(args) => commands::store(&context, args),
        Command::Shard(args) => commands::shard(&context, args),
        Command::Compare(args) => commands::compare(&context, args),
        Command::Verify(args) => commands::verify(&context, args),
        Command::Control(args) => commands::control(&context, args),
        Command::Order(args) => commands::order(&context, args),
        Command::Stream(args) => commands::stream(&context, args),
        Command::Simulate(args) => commands::simulate(&context, args),
        Command::Tools(args) => commands::tools(&context, args),
        Command::Post(args) => commands::post(&context, args),
        Command::Render(args) => commands::render(&context, args),
        Command::View(args) => commands::view(&context, args),
        Command::Animate(args) => commands::animate(&context, args),
        Command::Report(args) => commands::report(&context, args),
        Command::Sample(args) => commands::sample(&context, args),
        Command::Schema => commands::schema(),
        Command::Completions(args) => commands::completions(&context, args),
        Command::Man(args) => commands::man(&context, args),
    }
}
