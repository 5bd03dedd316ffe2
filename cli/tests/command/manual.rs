//! What the command says of itself: completions for shells, and pages for `man`.

use std::fs;
use std::process::{Command, Stdio};

use crate::run::run;
use crate::scratch;

const COMMANDS: [&str; 25] = [
    "demo",
    "inspect",
    "drop",
    "merge",
    "plan",
    "compare",
    "verify",
    "post",
    "simulate",
    "stream",
    "control",
    "order",
    "render",
    "view",
    "animate",
    "report",
    "sample",
    "schema",
    "tools",
    "reach",
    "prototype",
    "stock",
    "store",
    "shard",
    "diff",
];

#[test]
fn shells_complete_commands_and_options() {
    let folder = scratch();
    for (shell, mark) in [
        ("bash", "complete -F _claymill"),
        ("zsh", "#compdef claymill"),
        ("fish", "complete -c claymill"),
        ("powershell", "Register-ArgumentCompleter"),
        ("elvish", "edit:completion"),
    ] {
        let made = run(folder.path(), ["completions", shell]);
        assert_eq!((made.code, made.stderr.as_str()), (Some(0), ""), "{shell}");
        assert!(made.stdout.contains(mark), "{shell}");
        // Only some complete the values of options.
        let values: &[&str] =
            if ["bash", "zsh", "fish"].contains(&shell) { &["isoparametric", "one-way"] } else { &[] };
        for word in COMMANDS.iter().chain(&["scallop"]).chain(values) {
            assert!(made.stdout.contains(word), "{shell}: {word}");
        }
        let json = run(folder.path(), ["completions", shell, "--json"]).json();
        assert_eq!(json["script"].as_str(), Some(made.stdout.as_str()));
    }
    let wrong = run(folder.path(), ["completions", "cmd"]);
    assert_eq!(wrong.code, Some(2));
    assert!(wrong.stderr.contains("bash") && wrong.stderr.contains("powershell"), "{wrong:?}");
}

#[test]
fn bash_takes_its_script() {
    let folder = scratch();
    let script = run(folder.path(), ["completions", "bash"]).stdout;
    fs::write(folder.path().join("claymill.bash"), script).unwrap();
    let ask = "source ./claymill.bash && COMP_WORDS=(claymill plan --strategy fl) COMP_CWORD=3 && \
               _claymill claymill fl --strategy && echo \"${COMPREPLY[@]}\"";
    let mut bash = Command::new("bash");
    let bash = bash.args(["--norc", "-c", ask]).current_dir(folder.path()).stdin(Stdio::null());
    let Ok(bash) = bash.output() else { return eprintln!("skipped: no bash") };
    assert!(bash.status.success(), "{bash:?}");
    assert_eq!(String::from_utf8_lossy(&bash.stdout).trim(), "flow", "{bash:?}");
}

#[test]
fn each_command_has_a_page() {
    let folder = scratch();
    let made = run(folder.path(), ["man", "-o", "share/man1", "--json"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    assert_eq!(made.json()["pages"].as_array().map(Vec::len), Some(1 + COMMANDS.len()));
    let pages = folder.path().join("share/man1");
    let page = |name: &str| fs::read_to_string(pages.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    for command in COMMANDS {
        assert!(page("claymill.1").contains(&format!("claymill\\-{command}(1)")), "{command}");
        let text = page(&format!("claymill-{command}.1"));
        assert!(text.contains(&format!(".TH claymill-{command} 1")), "{text}");
        assert!(text.contains("Examples:"), "{command}");
    }
    assert_eq!(fs::read_dir(&pages).unwrap().count(), 1 + COMMANDS.len());
    // Pages of before are replaced, those of others are not.
    assert_eq!(run(folder.path(), ["man", "-o", "share/man1"]).code, Some(0));
    fs::write(pages.join("claymill-plan.1"), "my own notes").unwrap();
    fs::remove_file(pages.join("claymill.1")).unwrap();
    let refused = run(folder.path(), ["man", "-o", "share/man1"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("claymill-plan.1") && refused.stderr.contains("--force"), "{refused:?}");
    assert!(!pages.join("claymill.1").exists());
    assert_eq!(page("claymill-plan.1"), "my own notes");
    assert_eq!(run(folder.path(), ["man", "-o", "share/man1", "--force"]).code, Some(0));
    assert!(page("claymill-plan.1").contains("claymill"));
    // Whoever has `man` sees them.
    let shown =
        Command::new("man").args(["-l", "share/man1/claymill-plan.1"]).current_dir(folder.path()).output();
    match shown {
        Ok(shown) if shown.status.success() => {
            let text = String::from_utf8_lossy(&shown.stdout);
            assert!(text.contains("--scallop"), "{text}");
        }
        _ => eprintln!("skipped: no man"),
    }
}
