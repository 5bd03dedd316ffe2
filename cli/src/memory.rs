//! A watch on memory: a job that takes nearly all there is ends with a message instead of being killed.

use std::time::Duration;

use sysinfo::{MemoryRefreshKind, ProcessesToUpdate, System, get_current_pid};

use crate::console::peak_memory_mb;
use crate::failure::Failure;
use crate::interrupt;

/// How often one looks: much may be taken in between.
const EVERY: Duration = Duration::from_millis(50);
/// So much has to stay free: a share of all there is, and at least so many bytes.
const RESERVE: f64 = 1.0 / 32.0;
const LEAST_RESERVE: f64 = 256.0 * MB;
/// This process is the cause only where it has taken so much of all there is.
const OWN_SHARE: f64 = 0.5;

const MB: f64 = 1024.0 * 1024.0;

/// What the machine, or the container this runs in, has, bytes.
#[derive(Debug, Clone, Copy)]
struct Memory {
    total: f64,
    free: f64,
}

impl Memory {
    fn now(system: &mut System) -> Self {
        system.refresh_memory_specifics(MemoryRefreshKind::everything());
        let swap = system.free_swap() as f64;
        let machine =
            Memory { total: system.total_memory() as f64, free: system.available_memory() as f64 + swap };
        // Of what counts for a container, files that were read give way.
        let container = system.cgroup_limits().map(|limits| {
            let total = limits.total_memory as f64;
            Memory { total, free: total - limits.rss as f64 }
        });
        container.filter(|container| container.free < machine.free).unwrap_or(machine)
    }

    fn is_short(&self, own: f64) -> bool {
        self.free < (self.total * RESERVE).max(LEAST_RESERVE) && own > OWN_SHARE * self.total
    }

    /// The addresses of this process, where they are limited (`ulimit -v`). Beyond them the system refuses memory at once, and the
    /// standard library aborts without a word of what to do.
    fn of_addresses() -> Option<Self> {
        let read = |file: &str| std::fs::read_to_string(file).ok();
        let total = address_limit(&read("/proc/self/limits")?)?;
        let status = read("/proc/self/status")?;
        let line = status.lines().find_map(|l| l.strip_prefix("VmSize:"))?;
        let taken_kb: f64 = line.split_whitespace().next()?.parse().ok()?;
        Some(Memory { total, free: total - 1024.0 * taken_kb })
    }
}

/// The limit of the address space in the text of `/proc/self/limits`, bytes; `None` where there is none.
fn address_limit(limits: &str) -> Option<f64> {
    let line = limits.lines().find_map(|l| l.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// From now on the process ends with a message and this exit code, and nothing half-written, before the system ends it without any.
pub(crate) fn watch(code: u8) {
    abort_with(code);
    let look = move || {
        let Ok(mut system) = System::new() else { return };
        loop {
            std::thread::sleep(EVERY);
            let own = own_bytes(&mut system);
            let (there_is, it_may_have) = (Some(Memory::now(&mut system)), Memory::of_addresses());
            for (memory, what) in [(there_is, "there is"), (it_may_have, "it may have (ulimit -v)")] {
                if let Some(memory) = memory.filter(|memory| memory.is_short(own)) {
                    interrupt::end(i32::from(code), || eprintln!("{}", failure(what, &memory)));
                }
            }
        }
    };
    // Without it work goes on as before.
    let _ = std::thread::Builder::new().name("memory".into()).spawn(look);
}

/// Where the system refuses memory at once the standard library says so and aborts: that is no crash. Without this the message is the same.
#[cfg(unix)]
fn abort_with(code: u8) {
    let always = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
    let aborts = signal_hook::consts::SIGABRT;
    let _ = signal_hook::flag::register_conditional_shutdown(aborts, i32::from(code), always);
}

#[cfg(not(unix))]
fn abort_with(_: u8) {}

/// What this process has, bytes: the most that it ever had, or, where the system does not tell that, what it has now.
fn own_bytes(system: &mut System) -> f64 {
    let peak = peak_memory_mb() * MB;
    if peak > 0.0 {
        return peak;
    }
    let Ok(this) = get_current_pid() else { return 0.0 };
    system.refresh_processes(ProcessesToUpdate::Some(&[this]), false);
    system.process(this).map_or(0.0, |process| process.memory() as f64)
}

fn failure(what: &str, memory: &Memory) -> Failure {
    Failure::problem(
        format!("this needs more memory than {what}: {:.1} GB", memory.total / (1024.0 * MB)),
        "Is the model's unit right? A larger ball or scallop height, some regions at a time (--only), fewer --threads or fewer \
         pixels take less. Nothing was left behind.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_short_where_little_is_left_and_this_process_has_it() {
        let gb = 1024.0 * MB;
        let memory = |free| Memory { total: 16.0 * gb, free };
        assert!(memory(0.4 * gb).is_short(14.0 * gb));
        assert!(!memory(0.6 * gb).is_short(14.0 * gb));
        assert!(!memory(0.4 * gb).is_short(6.0 * gb));
        assert!(Memory { total: 2.0 * gb, free: 0.2 * gb }.is_short(1.7 * gb));
        let line = |soft: &str| {
            format!("Max processes 1 1\nMax address space         {soft}           unlimited    bytes\n")
        };
        assert_eq!((address_limit(&line("2048")), address_limit(&line("unlimited"))), (Some(2048.0), None));
        let mut system = System::new().unwrap();
        assert!(own_bytes(&mut system) > MB);
        let now = Memory::now(&mut system);
        assert!(now.total > 0.0 && now.free > 0.0 && now.free <= now.total * 2.0, "{now:?}");
    }
}
