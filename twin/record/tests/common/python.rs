//! The Python with the packages of others that `ci/setup` installs in `target/venv`, or that `TWINRIG_PYTHON` names.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// Python, if it can import `modules`. Without them a test says so and passes, except on CI.
pub fn python(modules: &str) -> Option<PathBuf> {
    // Tests stand in `FOLDER/CRATE/tests`.
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/venv/bin/python");
    let named = std::env::var_os("TWINRIG_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or(venv);
    let import = format!("import {modules}");
    let check = Command::new(&python).args(["-c", &import]).output();
    if check.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let why = format!("{} cannot import {modules}: run ci/setup", python.display());
    assert!(std::env::var_os("CI").is_none(), "{why}");
    eprintln!("SKIPPED: {why}");
    None
}

/// The JSON that `script` of this crate's tests (or a path from there) prints, given `words` and, on its standard input,
/// `input`.
pub fn run(python: &Path, script: &str, words: &[&Path], input: &Value) -> Value {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut child = Command::new(python)
        .arg(tests.join(script))
        .args(words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A script that does not read ends with an error of its own, or does without.
    let _ = write!(child.stdin.take().unwrap(), "{input}");
    let output = child.wait_with_output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{script}: {complaint}");
    serde_json::from_slice(&output.stdout).unwrap()
}
