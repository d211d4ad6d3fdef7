//! Tells the program what it was built from: `twin --version` prints it.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Commit that a crate file was packed from; cargo writes it.
const PACKED: &str = ".cargo_vcs_info.json";
/// Root of the repository, seen from this crate. A package that lies in the repository of someone
/// else has none there.
const REPOSITORY: &str = "../../.git";
/// Digits of a commit that are shown.
const DIGITS: usize = 12;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = packed().or_else(checked_out);
    let commit = commit.filter(|hash| hash.len() >= DIGITS && hash.is_ascii());
    let commit = commit.as_deref().map_or("unknown", |hash| &hash[..DIGITS]);
    println!("cargo::rustc-env=TWINRIG_COMMIT={commit}");
    println!("cargo::rustc-env=TWINRIG_FEATURES={}", features());
    for name in ["TARGET", "PROFILE"] {
        let value = env::var(name).unwrap_or_default();
        println!("cargo::rustc-env=TWINRIG_{name}={value}");
    }
}

/// Returns the cargo features that a user selects, separated by commas.
fn features() -> String {
    let names = env::vars().filter_map(|(name, _)| {
        let name = name.strip_prefix("CARGO_FEATURE_")?.to_ascii_lowercase();
        let selected = name != "default";
        selected.then(|| name.replace('_', "-"))
    });
    let mut names: Vec<_> = names.collect();
    names.sort();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

/// Returns the commit of a package.
fn packed() -> Option<String> {
    let text = std::fs::read_to_string(PACKED).ok()?;
    println!("cargo::rerun-if-changed={PACKED}");
    let (_, hash) = text.split_once("\"sha1\"")?;
    hash.split('"').nth(1).map(str::to_owned)
}

/// Returns the commit of the repository, and has the build repeated where another one is checked
/// out.
fn checked_out() -> Option<String> {
    if !Path::new(REPOSITORY).exists() {
        return None;
    }
    let head = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in [Some("HEAD"), Some("logs/HEAD"), head.as_deref()] {
        let path = name.and_then(|name| git(&["rev-parse", "--git-path", name]));
        // A file that is missing would repeat the build each time.
        if let Some(path) = path.map(PathBuf::from).filter(|path| path.exists()) {
            println!("cargo::rerun-if-changed={}", path.display());
        }
    }
    git(&["rev-parse", "HEAD"])
}

/// Returns the output of git; none if it fails or is not installed.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
