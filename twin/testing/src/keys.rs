//! Tables of keys in documentation.

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
        let begin = format!("<!-- keys of {} -->\n", table.name);
        let start = made[after..].find(&begin);
        let start = after + start.unwrap_or_else(|| panic!("no {begin}")) + begin.len();
        let length = made[start..].find("\n<!-- end -->");
        let end = start + length.unwrap_or_else(|| panic!("no end of {begin}"));
        assert!(!made[start..end].contains("<!--"), "no end of {begin}");
        made.replace_range(start..end, &table.markdown());
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(page, &made).unwrap();
    } else {
        let page = page.display();
        assert!(
            made == kept,
            "{page} is not up to date: run this test with UPDATE_DOCS=1"
        );
    }
}
