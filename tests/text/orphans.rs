//! Snapshots and kept failures of property tests: each belongs to a test that exists.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::vocabulary::{has, sources};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns the modules of a source file, those of its program or library included, as in the names
/// of its snapshots: `study__precision` of `twin/experiment/tests/study/precision.rs`.
fn modules(source: &str) -> Option<String> {
    let (path, mut names) = if let Some((folder, path)) = source.split_once("/src/") {
        let manifest = fs::read_to_string(root().join(folder).join("Cargo.toml")).ok()?;
        let name = manifest.split_once("name = \"")?.1.split_once('"')?.0;
        (path, vec![name.replace('-', "_")])
    } else {
        (source.split_once("tests/")?.1, Vec::new())
    };
    names.extend(path.strip_suffix(".rs")?.split('/').map(str::to_owned));
    // Such a file is the module of its folder.
    names.pop_if(|last| ["lib", "main", "mod"].contains(&last.as_str()));
    Some(names.join("__"))
}

/// Whether a source takes a snapshot of this name: that of a test, one that it states or makes of a
/// prefix (`"widths_{name}"`), or that of one of `files` that it reads.
fn takes(code: &str, name: &str, files: &BTreeSet<String>) -> bool {
    let is_made = |at: usize| {
        let (prefix, rest) = name.split_at(at + 1);
        code.contains(&format!("\"{prefix}{{")) && code.contains(&format!("\"{rest}\""))
    };
    code.contains("assert_snapshot!(")
        && (has(code, name)
            || name.match_indices('_').any(|(at, _)| is_made(at))
            || code.contains("assert_snapshot!(name,") && files.contains(name))
}

/// Why a snapshot with this text belongs to no test, or `None`.
fn lost_snapshot(path: &str, text: &str, files: &BTreeSet<String>) -> Option<String> {
    let source = text.lines().find_map(|line| line.strip_prefix("source: "));
    let source = source.unwrap_or_default();
    let Ok(code) = fs::read_to_string(root().join(source)) else {
        return Some(format!("{path}: its source does not exist: {source:?}"));
    };
    let modules = modules(source).unwrap_or_default();
    let beside = Path::new(source).with_file_name("snapshots").join(&modules);
    let name = path.strip_prefix(beside.to_str()?);
    let name = name.and_then(|it| it.strip_prefix("__")?.strip_suffix(".snap"));
    let Some(name) = name else {
        return Some(format!("{path} is not {}__….snap", beside.display()));
    };
    // A module within the file; the second snapshot of a test ends in `-2`.
    let name = name.rsplit("__").next()?.split('-').next()?;
    let is_taken = takes(&code, name, files);
    (!is_taken).then(|| format!("{path}: {source} takes no such snapshot"))
}

/// Why a file of failures belongs to no test, or `None`. Those of `FOLDER/SOURCES/a/b.rs` are in
/// `FOLDER/proptest-regressions/a/b.txt`, where `SOURCES` has the root of a crate; those of laws of
/// `FOLDER/a.rs` in `FOLDER/regressions/a.txt`.
fn lost_failures(path: &str) -> Option<String> {
    let is_test = |source: PathBuf| {
        fs::read_to_string(source)
            .is_ok_and(|code| code.contains("proptest") || code.contains("laws!("))
    };
    let found = if let Some((folder, rest)) = path.split_once("/proptest-regressions/") {
        let folders = fs::read_dir(root().join(folder)).ok()?.flatten();
        let mut folders = folders.map(|entry| entry.path());
        folders.any(|sources| {
            let has_root = ["lib.rs", "main.rs"]
                .iter()
                .any(|it| sources.join(it).exists());
            has_root && is_test(sources.join(rest).with_extension("rs"))
        })
    } else if let Some((folder, rest)) = path.split_once("/regressions/") {
        is_test(root().join(folder).join(rest).with_extension("rs"))
    } else {
        return None;
    };
    (!found).then(|| format!("{path}: no property has these failures"))
}

/// Names of TOML files.
fn toml_names() -> BTreeSet<String> {
    let files = sources(&["toml"]).into_iter();
    files
        .filter_map(|(name, _)| Some(Path::new(&name).file_stem()?.to_str()?.to_owned()))
        .collect()
}

#[test]
fn snapshots_and_failures_belong_to_tests() {
    let files = toml_names();
    let snapshots = sources(&["snap"]);
    assert!(snapshots.len() > 200, "{} snapshots", snapshots.len());
    let mut lost: Vec<String> = Vec::new();
    for (path, text) in &snapshots {
        lost.extend(lost_snapshot(path, text, &files));
    }
    lost.extend(
        sources(&["txt"])
            .iter()
            .filter_map(|(path, _)| lost_failures(path)),
    );
    assert!(
        lost.is_empty(),
        "{} lost files:\n{}",
        lost.len(),
        lost.join("\n")
    );
}

#[test]
fn lost_files_are_found() {
    let files = toml_names();
    let source = "twin/experiment/tests/study/precision.rs";
    let lost = |path: &str| lost_snapshot(path, &format!("---\nsource: {source}\n"), &files);
    let folder = "twin/experiment/tests/study/snapshots";
    assert_eq!(
        lost(&format!(
            "{folder}/study__precision__rows_match_snapshot.snap"
        )),
        None
    );
    for name in [
        "study__precision__no_test",
        "study__rows_match_snapshot",
        "precision__rows_match_snapshot",
    ] {
        assert!(lost(&format!("{folder}/{name}.snap")).is_some(), "{name}");
    }
    let elsewhere = "twin/experiment/tests/snapshots/study__precision__rows_match_snapshot.snap";
    assert!(lost(elsewhere).is_some());
    assert!(lost_snapshot(elsewhere, "", &files).is_some());

    assert_eq!(
        lost_failures("plants/contact/proptest-regressions/problem/tests.txt"),
        None
    );
    assert!(lost_failures("plants/contact/proptest-regressions/tests.txt").is_some());
    assert!(lost_failures("drivers/feetech/tests/feetech/regressions/no.txt").is_some());
    assert_eq!(
        lost_failures("drivers/feetech/tests/feetech/regressions/laws.txt"),
        None
    );
}
