//! Words about a finished job: its title, and command lines that a shell reads back.

use std::path::Path;

use claymill_toolpath::Job;

/// The model's file name.
pub(crate) fn title(job: &Job) -> String {
    let path = Path::new(&job.model.path);
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// A word as a shell reads it back.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_+=./:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_from_the_shell_as_they_were() {
        for word in ["car.igs", "my car's model.igs", "layer:a b", "", "$HOME;ls", "+z", "-y"] {
            let shell = std::process::Command::new("sh")
                .args(["-c", &format!("printf '%s' {}", quoted(word))])
                .output();
            let Ok(shell) = shell else {
                return claymill_tests::leave_out(claymill_tests::Need::UnixTools, "no sh");
            };
            assert_eq!(String::from_utf8_lossy(&shell.stdout), word);
        }
    }
}
