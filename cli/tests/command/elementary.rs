//! The same digits on every machine: the program calls no elementary function of the system's C library.

use std::process::Command;

/// Names of functions of which the system's library has its own, by the processor.
const NAMES: [&str; 24] = [
    "sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh",
    "atanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "hypot", "cbrt",
];

#[cfg(target_os = "linux")]
#[test]
fn the_program_imports_no_elementary_function_of_the_system() {
    let imports =
        Command::new("nm").args(["-D", "--undefined-only", env!("CARGO_BIN_EXE_claymill")]).output();
    let imports = imports.expect("nm is there where a linker is").stdout;
    let text = String::from_utf8_lossy(&imports);
    let names: Vec<&str> = text.split_whitespace().filter_map(|word| word.split('@').next()).collect();
    assert!(names.contains(&"malloc"), "these are no imports: {text}");
    let taken = |name: &&&str| names.contains(*name) || names.contains(&format!("{name}f").as_str());
    let found: Vec<&&str> = NAMES.iter().filter(taken).collect();
    assert!(found.is_empty(), "{found:?} come from the system: their digits differ from machine to machine");
}
