use std::path::PathBuf;
use std::sync::Mutex;

/// Folders and files that must not survive an interruption.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Ends the process on Ctrl-C with exit code 130, after removing what is half-written. Everything is written
/// beside its destination and renamed when whole, so there is nothing else to undo, and nothing to wait for.
pub(crate) fn install() {
    // Without a handler Ctrl-C still works, but may leave a .partial folder: not worth refusing to run.
    let _ = ctrlc::set_handler(|| {
        if let Ok(paths) = UNFINISHED.lock() {
            for path in paths.iter() {
                let _ = std::fs::remove_dir_all(path);
            }
        }
        std::process::exit(130);
    });
}

/// Names a folder that is removed when the process is interrupted.
pub(crate) fn remove_on_interrupt(path: PathBuf) {
    if let Ok(mut paths) = UNFINISHED.lock() {
        paths.push(path);
    }
}
