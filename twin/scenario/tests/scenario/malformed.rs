//! Messages of malformed scenario files.

use std::fs;
use std::path::Path;

/// Every file of `tests/malformed` is rejected with the message of its snapshot.
#[test]
fn malformed_files_are_rejected_with_a_message() {
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
        let Err(error) = crate::common::scene(&text) else {
            panic!("{name} is accepted");
        };
        insta::assert_snapshot!(name, error);
    }
}
