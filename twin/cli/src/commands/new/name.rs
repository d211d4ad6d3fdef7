//! Names of what is made.

use crate::error::TwinError;

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

/// Names of the kinds of parts in scenarios, which a new kind must not take.
const KINDS: &[&str] = &[
    "cpg",
    "stand",
    "motordriver",
    "optoforce",
    "phidget",
    "rb110",
    "sbcp",
];

/// Checks the name of a crate, which is also that of its part in scenarios.
pub fn check_crate(name: &str) -> Result<(), TwinError> {
    let mut letters = name.chars();
    let first = letters
        .next()
        .is_some_and(|letter| letter.is_ascii_lowercase());
    let rest = letters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if !first || !rest {
        let why = "a crate has small letters, digits and `_`, a letter first";
        return Err(refused(name, why, '_'));
    }
    if RESERVED.contains(&name) || KINDS.contains(&name) {
        return Err(refused(name, "it is taken by Rust, cargo or Twinrig", '_'));
    }
    Ok(())
}

/// Checks the name of a file of a scenario or robot.
pub fn check_file(name: &str) -> Result<(), TwinError> {
    let valid = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
    let first = name.starts_with(|c: char| c.is_ascii_lowercase() || c.is_ascii_digit());
    if first && name.chars().all(valid) {
        return Ok(());
    }
    let why = "it has small letters, digits, `-` and `_`, without `.toml`";
    Err(refused(name, why, '-'))
}

fn refused(name: &str, why: &str, joint: char) -> TwinError {
    let suggested = suggested(name, joint);
    TwinError::Together {
        why: format!("`{name}` cannot be the name: {why}"),
        help: format!("for example `{suggested}`"),
    }
}

/// Returns a valid name close to `name`.
fn suggested(name: &str, joint: char) -> String {
    let stem = name.strip_suffix(".toml").unwrap_or(name);
    let words = stem.split(|c: char| !c.is_ascii_alphanumeric());
    let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
    let joined = words.join(joint.to_string().as_str()).to_ascii_lowercase();
    if joined == name || !joined.starts_with(|c: char| c.is_ascii_lowercase()) {
        return format!("my{joint}{joined}")
            .trim_end_matches(joint)
            .to_owned();
    }
    joined
}

/// Returns the name as that of a Rust type: `my_gait` gives `MyGait`.
pub fn camel_case(name: &str) -> String {
    let capital = |word: &str| {
        let (first, rest) = word.split_at(word.len().min(1));
        first.to_ascii_uppercase() + rest
    };
    name.split('_').map(capital).collect()
}
