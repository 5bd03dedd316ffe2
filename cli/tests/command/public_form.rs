//! The forms that others rely on, as they were kept: the options of every command and the schemas of the job folder. A
//! change of either is a decision, and is seen in the difference of a snapshot. `INSTA_UPDATE=always` keeps them anew.

use serde_json::Value;

use crate::run::{claymill, run};
use crate::scratch;

/// What a command prints about itself, in lines of 100 columns.
fn help(words: &[&str]) -> String {
    let said = claymill().args(words).arg("--help").env("COLUMNS", "100").output().unwrap();
    assert!(said.status.success() && said.stderr.is_empty(), "{said:?}");
    String::from_utf8(said.stdout).unwrap()
}

/// The names in the list of commands, without `help`, which is clap's.
fn commands(help: &str) -> Vec<&str> {
    let (_, list) = help.split_once("\nCommands:\n").unwrap();
    let lines = list.lines().take_while(|line| !line.is_empty());
    // Continued descriptions begin farther to the right.
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split_once(' '));
    names.map(|(name, _)| name).filter(|name| !name.is_empty() && *name != "help").collect()
}

/// Without the windowed command there is one less.
#[cfg(feature = "window")]
#[test]
fn options_are_those_that_were_kept() {
    let all = help(&[]);
    let names = commands(&all);
    assert!(names.len() > 15 && names.contains(&"plan") && names.contains(&"view"), "{names:?}");
    insta::assert_snapshot!("help", all);
    for name in names {
        let own = help(&[name]);
        // Those that have commands of their own.
        for of in if own.contains("\nCommands:\n") { commands(&own) } else { Vec::new() } {
            insta::assert_snapshot!(format!("help_{name}_{of}"), help(&[name, of]));
        }
        insta::assert_snapshot!(format!("help_{name}"), own);
    }
}

/// Comments may be reworded: the form is what remains without them.
fn without_descriptions(schema: &mut Value) {
    match schema {
        Value::Object(fields) => {
            // A property of that name would be a schema, not a text.
            fields.retain(|key, value| key != "description" || !value.is_string());
            fields.values_mut().for_each(without_descriptions);
        }
        Value::Array(items) => items.iter_mut().for_each(without_descriptions),
        _ => {}
    }
}

#[test]
fn schemas_are_those_that_were_kept() {
    let folder = scratch();
    let printed = run(folder.path(), ["schema"]);
    assert_eq!(printed.code, Some(0), "{printed:?}");
    let Value::Object(schemas) = printed.json() else { panic!("{printed:?}") };
    let names: Vec<&String> = schemas.keys().collect();
    assert_eq!(names, ["job.json", "machine.toml", "regions.json", "toolpaths.jsonl", "verify.json"]);
    for (name, mut schema) in schemas {
        without_descriptions(&mut schema);
        insta::assert_snapshot!(format!("schema_{name}"), serde_json::to_string_pretty(&schema).unwrap());
    }
}
