//! Python with the third-party packages that `ci/setup` installs in two environments in `target`,
//! or the interpreter in `TWINRIG_PYTHON`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// Returns the Python interpreter of recordings and scenarios if it can import `modules`. Otherwise
/// the calling test prints a notice and passes, except on CI.
pub fn python(modules: &str) -> Option<PathBuf> {
    interpreter("venv", modules)
}

/// Returns the Python interpreter of peers of plants under the same conditions.
pub fn python_of_peers(modules: &str) -> Option<PathBuf> {
    interpreter("venv-peers", modules)
}

fn interpreter(environment: &str, modules: &str) -> Option<PathBuf> {
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target");
    let venv = target.join(environment).join("bin/python");
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

/// Runs `script` with arguments `words` and standard input `input`, and returns the JSON that it
/// prints.
pub fn run(python: &Path, script: &Path, words: &[&Path], input: &Value) -> Value {
    let mut child = Command::new(python)
        .arg(script)
        // The kernels of linear algebra that every x86-64 processor has: their last bits decide
        // whether an ill-conditioned fit of SciPy converges.
        .env("OPENBLAS_CORETYPE", "Nehalem")
        .args(words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A script that does not read its input may have exited; its status is checked below.
    let _ = write!(child.stdin.take().unwrap(), "{input}");
    let output = child.wait_with_output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {errors}", script.display());
    serde_json::from_slice(&output.stdout).unwrap()
}
