//! The codes on the page `docs/sbcp.md` are those of the code, all of them.

use std::path::Path;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    std::fs::read_to_string(path).unwrap()
}

/// Names of constants with the values of one byte, of `codes.rs`.
fn codes() -> Vec<(String, String)> {
    let code = |line: &str| {
        let (name, value) = line.trim().strip_prefix("pub const ")?.split_once(": ")?;
        let value = ["u8 = ", "Self = Self("]
            .iter()
            .find_map(|begin| value.strip_prefix(begin))?
            .trim_end_matches([';', ')']);
        value
            .starts_with("0x")
            .then(|| (name.to_owned(), value.to_owned()))
    };
    read("src/codes.rs").lines().filter_map(code).collect()
}

#[test]
fn page_has_every_code() {
    let (page, codes) = (read("../../docs/sbcp.md"), codes());
    // Registers are compared by the crate of the boards, which has more of them.
    let codes = codes
        .iter()
        .filter(|(name, _)| !name.starts_with("REGISTER_"));
    let rows: Vec<String> = codes
        .map(|(name, value)| format!("| `{name}` | `{value}` | "))
        .collect();
    assert!(rows.len() >= 5 + 5 + 13, "{rows:?}");
    let missing: Vec<_> = rows.iter().filter(|row| !page.contains(*row)).collect();
    assert!(missing.is_empty(), "docs/sbcp.md lacks {missing:#?}");
}
