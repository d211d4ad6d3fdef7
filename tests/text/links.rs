//! Links of the documents: files and sections to which they point exist.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Tracked Markdown files, relative to the repository.
fn pages() -> Vec<String> {
    let listed = Command::new("git")
        .args(["ls-files", "-z", "*.md"])
        .current_dir(root())
        .output()
        .expect("git lists the files");
    let names = String::from_utf8(listed.stdout).expect("names are UTF-8");
    let names = names.split('\0').filter(|name| !name.is_empty());
    names.map(str::to_owned).collect()
}

/// Lines outside blocks of code.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut in_code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        in_code ^= fence;
        !in_code && !fence
    })
}

/// Anchors of the headings of a page, as GitHub makes them: small letters, digits, `-` for spaces;
/// the second of a name ends in `-1`.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for line in prose(text).filter(|line| line.starts_with('#')) {
        let heading = line.trim_start_matches('#').trim();
        let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
        let anchor: String = heading.to_lowercase().chars().filter(kept).collect();
        let anchor = anchor.replace(' ', "-");
        let mut name = anchor.clone();
        let mut number = 0;
        while !found.insert(name) {
            number += 1;
            name = format!("{anchor}-{number}");
        }
    }
    found
}

/// Targets of the links `[…](target)` of a page, of which code in a line has none.
fn targets(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for line in prose(text) {
        let outside: String = line.split('`').step_by(2).collect();
        let openings = outside.split("](").skip(1);
        found.extend(openings.filter_map(|rest| Some(rest.split(')').next()?.to_owned())));
    }
    found
}

/// Why a link of a page leads nowhere, or `None`.
fn broken(page: &str, target: &str) -> Option<String> {
    if target.contains("://") {
        return None;
    }
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let folder = root().join(page).parent()?.to_owned();
    let file = if path.is_empty() {
        root().join(page)
    } else {
        folder.join(path)
    };
    if !file.exists() {
        return Some(format!("{page}: there is no {target}"));
    }
    let is_page = file.extension().is_some_and(|it| it == "md");
    let missing = is_page && !anchor.is_empty() && {
        let text = fs::read_to_string(&file).unwrap_or_default();
        !anchors(&text).contains(anchor)
    };
    missing.then(|| format!("{page}: {target} has no such section"))
}

#[test]
fn links_lead_to_files_and_sections() {
    let (mut count, mut found) = (0, Vec::new());
    for page in pages() {
        let text = fs::read_to_string(root().join(&page)).unwrap_or_default();
        for target in targets(&text) {
            count += 1;
            found.extend(broken(&page, &target));
        }
    }
    assert!(count > 100, "{count} links");
    assert!(found.is_empty(), "broken links:\n{}", found.join("\n"));
}

/// All pages of `docs` can be reached from its index, and the index from README.md.
#[test]
fn the_index_lists_every_page() {
    let index = fs::read_to_string(root().join("docs/README.md")).unwrap();
    let listed = targets(&index);
    let docs = pages().into_iter();
    let docs = docs.filter_map(|page| page.strip_prefix("docs/").map(str::to_owned));
    let missing: Vec<String> = docs
        .filter(|page| page != "README.md" && !listed.contains(page))
        .collect();
    assert!(missing.is_empty(), "docs/README.md lacks {missing:?}");
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(targets(&readme).contains("docs/README.md"));
}

#[test]
fn broken_links_are_found() {
    assert!(broken("README.md", "docs/nothing.md").is_some());
    assert!(broken("README.md", "docs/plants.md#nothing").is_some());
    assert!(broken("README.md", "docs/plants.md#choice-of-plant-and-step").is_none());
}
