//! The process begun anew with a variable that a library reads before anything can be said to it.

/// Mesa's layer that chooses between graphics cards asks a Wayland display which one it is on, even where there is none, and
/// prints an error then: in ssh, containers and cron, where nobody has set `XDG_RUNTIME_DIR`. Nothing but this variable keeps it
/// from that, and variables of a running process cannot be set safely.
#[cfg(target_os = "linux")]
pub(crate) fn without_display_layer() {
    use std::os::unix::process::CommandExt;
    const LAYER_OFF: &str = "NODEVICE_SELECT";
    let runtime = std::env::var_os("XDG_RUNTIME_DIR");
    let has_display = runtime.is_some_and(|dir| std::path::Path::new(&dir).is_absolute());
    if has_display || std::env::var_os(LAYER_OFF).is_some() {
        return;
    }
    let Ok(this) = std::env::current_exe() else { return };
    let mut arguments = std::env::args_os();
    let mut command = std::process::Command::new(this);
    if let Some(name) = arguments.next() {
        command.arg0(name);
    }
    // It returns only where it failed: then the message has to be borne.
    let _ = command.args(arguments).env(LAYER_OFF, "1").exec();
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn without_display_layer() {}
