//! Scenario files that are wrong, and what a person is told about each.

mod common;

use std::fs;
use std::path::Path;

/// Every file of `tests/malformed` is refused, and its message is pinned.
#[test]
fn every_malformed_file_is_told_what_is_wrong() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/malformed");
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(files.len() >= 30, "{} files", files.len());
    for file in files {
        let name = file.file_stem().unwrap().to_str().unwrap();
        let bytes = fs::read(&file).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let Err(error) = common::scene(&text) else {
            panic!("{name} is accepted");
        };
        insta::assert_snapshot!(name, error);
    }
}
