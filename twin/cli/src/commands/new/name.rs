//! Names of what is made.

use crate::error::TwinError;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

/// Greatest length of a name: that of crates on crates.io.
const LENGTH_MAX: usize = 64;

/// Keywords, and names of crates that the new crate depends on or that cargo refuses.
const RESERVED: &[&str] = &[
    "abstract",
    "alloc",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "build",
    "const",
    "continue",
    "core",
    "crate",
    "deps",
    "do",
    "dyn",
    "else",
    "enum",
    "examples",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "incremental",
    "let",
    "libm",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "override",
    "priv",
    "proc_macro",
    "proptest",
    "pub",
    "ref",
    "return",
    "self",
    "serde",
    "static",
    "std",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "twin",
    "twinrig",
    "type",
    "typeof",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "yield",
];

/// Checks the name of a crate, which is also that of its part in scenarios: none of the parts in
/// `registry`, which it would replace.
pub fn check_crate(name: &str, registry: &Registry) -> Result<(), TwinError> {
    check_file(name)?;
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) {
        return Err(refused(name, "a crate begins with a letter"));
    }
    if RESERVED.contains(&name.replace('-', "_").as_str()) {
        return Err(refused(name, "Rust, cargo or Twinrig use it"));
    }
    let mut known = registry.plants().chain(registry.controllers());
    if known.any(|part| part == name) || registry.buses().any(|part| part == name) {
        return Err(refused(name, "a part of scenarios has it"));
    }
    Ok(())
}

/// Checks the name of a file of a scenario or robot.
pub fn check_file(name: &str) -> Result<(), TwinError> {
    let valid = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
    let first = name.starts_with(|c: char| c.is_ascii_lowercase() || c.is_ascii_digit());
    if first && name.chars().all(valid) && name.len() <= LENGTH_MAX {
        return Ok(());
    }
    let why = "it has small letters, digits, `-` and `_`, without `.toml`, at most 64";
    Err(refused(name, why))
}

fn refused(name: &str, why: &str) -> TwinError {
    TwinError::from(Error::InvalidOptions {
        why: format!("`{name}` cannot be the name: {why}"),
        help: format!("for example `{}`", suggested(name)),
    })
}

/// Returns a valid name close to `name`.
fn suggested(name: &str) -> String {
    let stem = name.strip_suffix(".toml").unwrap_or(name);
    let words = stem.split(|c: char| !c.is_ascii_alphanumeric());
    let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
    let mut joined = words.join("-").to_ascii_lowercase();
    joined.truncate(LENGTH_MAX - "my-".len());
    if joined == name || !joined.starts_with(|c: char| c.is_ascii_lowercase()) {
        joined = format!("my-{joined}");
    }
    joined.trim_end_matches('-').to_owned()
}
