//! Passages of documentation that tests make.

use std::path::Path;

use twinrig_document::declaration::TableReference;

/// Compares the tables of keys in a page, after this heading, with their declarations: each is
/// between the comments `<!-- keys of NAME -->` and `<!-- end -->`. With `UPDATE_DOCS` in the
/// environment they are written.
pub fn check_keys(page: &Path, heading: &str, tables: &[TableReference]) {
    let kept = std::fs::read_to_string(page).unwrap();
    let mut made = kept.clone();
    let after = made.find(heading);
    let after = after.unwrap_or_else(|| panic!("no {heading}"));
    for table in tables {
        replace(
            &mut made,
            after,
            &format!("keys of {}", table.name),
            &table.markdown(),
        );
    }
    compare(page, &kept, &made);
}

/// The same for one passage, between `<!-- NAME -->` and `<!-- end -->`.
pub fn check_passage(page: &Path, name: &str, passage: &str) {
    let kept = std::fs::read_to_string(page).unwrap();
    let mut made = kept.clone();
    replace(&mut made, 0, name, passage);
    compare(page, &kept, &made);
}

/// Replaces the passage of this name, behind `after`.
fn replace(made: &mut String, after: usize, name: &str, passage: &str) {
    let begin = format!("<!-- {name} -->\n");
    let start = made[after..].find(&begin);
    let start = after + start.unwrap_or_else(|| panic!("no {begin}")) + begin.len();
    let length = made[start..].find("\n<!-- end -->");
    let end = start + length.unwrap_or_else(|| panic!("no end of {begin}"));
    assert!(!made[start..end].contains("<!--"), "no end of {begin}");
    made.replace_range(start..end, passage);
}

fn compare(page: &Path, kept: &str, made: &str) {
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(page, made).unwrap();
    } else {
        let page = page.display();
        assert!(
            made == kept,
            "{page} is not up to date: run this test with UPDATE_DOCS=1"
        );
    }
}
