//! `twin examples` and `twin --version`.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Done, Folder, json};

/// Executes a command of the program as it is installed.
fn twin(words: &[&str]) -> Done {
    crate::common::twin_of(&twinrig::Registry::standard(), words)
}

fn object(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn copied_example_runs_as_in_the_documentation_and_is_not_overwritten() {
    let folder = Folder::new("examples-copied");
    let to = folder.join("new");
    let copied = twin(&["examples", "copy", "trot", "--to", &to, "--json"]);
    assert_eq!((copied.code, copied.err.as_str()), (0, ""));
    let files = [
        "trot.toml",
        "robots/cheetah-cub.toml",
        "scenario.schema.json",
    ];
    let paths = files.map(|file| Path::new(&to).join(file));
    assert_eq!(object(&copied.out)["written"], serde_json::json!(paths));

    let trot = folder.join("new/trot.toml");
    let done = twin(&["run", &trot, "--no-record", "--json"]);
    let report = &json(&done.out)[0];
    assert_eq!((done.code, &report["verdict"]), (0, &"pass".into()));
    let fingerprint = report["fingerprint"].as_str().unwrap();
    assert_eq!(fingerprint.len(), 64);
    for page in ["README.md", "docs/program.md"] {
        let page = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../..")
            .join(page);
        let text = fs::read_to_string(&page).unwrap();
        assert!(text.contains(fingerprint), "{}", page.display());
    }

    // A changed robot remains in use, a changed example is in the way of a copy, and then nothing
    // else is written.
    let robot = folder.join("new/robots/cheetah-cub.toml");
    let changed = fs::read_to_string(&robot).unwrap() + "# mine\n";
    fs::write(&robot, &changed).unwrap();
    let again = twin(&["examples", "copy", "trot", "walk", "--to", &to]);
    assert_eq!(again.code, 0);
    assert!(again.err.contains("cheetah-cub.toml has other contents"));
    assert_eq!(again.out.trim(), folder.join("new/walk.toml"));
    assert_eq!(fs::read_to_string(&robot).unwrap(), changed);
    fs::write(&trot, "").unwrap();
    let refused = twin(&["examples", "copy", "--all", "--to", &to]);
    assert_eq!((refused.code, refused.out.as_str()), (2, ""));
    assert!(refused.err.contains("trot.toml") && refused.err.contains("--to"));
    assert_eq!(fs::read_to_string(&trot).unwrap(), "");
    assert!(!Path::new(&folder.join("new/stand.toml")).exists());
}

#[test]
fn all_examples_are_valid_where_they_are_copied() {
    let folder = Folder::new("examples-all");
    let to = folder.join("");
    assert_eq!(twin(&["examples", "copy", "--all", "--to", &to]).code, 0);
    let listed = twin(&["examples", "--json"]);
    let listed = object(&listed.out);
    let examples = listed["examples"].as_array().unwrap();
    let mut check = vec!["check".to_owned()];
    for example in examples {
        let name = example["name"].as_str().unwrap();
        check.push(folder.join(&format!("{name}.toml")));
        // What the list says was read from the file.
        assert!(example["simulated_s"].as_f64().unwrap() > 0.0, "{example}");
        assert!(
            example["about"].as_str().unwrap().ends_with(['.', ':']),
            "{example}"
        );
        assert_eq!(
            example["robot"].is_null(),
            ["bench", "servo"]
                .iter()
                .any(|plant| example["plant"] == *plant),
            "{example}"
        );
    }
    let words: Vec<_> = check.iter().map(String::as_str).collect();
    let checked = twin(&words);
    assert_eq!(checked.code, 0, "{}", checked.err);
    assert!(
        !fs::read_to_string(folder.join("scenario.schema.json"))
            .unwrap()
            .is_empty()
    );
    let unknown = twin(&["examples", "copy", "trott"]);
    assert!(
        unknown.code == 2 && unknown.err.contains("`trot`"),
        "{}",
        unknown.err
    );
}

/// Files of crates are links into folders of the repository. Where a check-out writes links as
/// text, programs would contain the paths in place of the files.
#[test]
fn links_of_crates_have_the_contents_of_their_targets() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let files = [
        "plants/robot/files",
        "plants/sensor/files",
        "twin/cli/files",
    ];
    let mut compared = 0;
    for folder in files {
        let mut folders = vec![root.join(folder)];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let shown = [
                    "robots",
                    "benches",
                    "calibrations",
                    "docs",
                    "mappings",
                    "scenarios",
                ]
                .map(|shown| root.join(shown).join(path.file_name().unwrap()));
                let shown = shown.iter().find(|shown| shown.exists()).unwrap();
                assert_eq!(
                    fs::read(&path).unwrap(),
                    fs::read(shown).unwrap(),
                    "{shown:?}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn version_names_the_build() {
    let short = twin(&["-V"]);
    assert_eq!(short.out, format!("twin {}\n", env!("CARGO_PKG_VERSION")));
    let long = twin(&["--version"]);
    let lines: Vec<_> = long.out.lines().skip(1).collect();
    let values: Vec<_> = ["commit", "features", "target", "profile"]
        .iter()
        .zip(&lines)
        .map(|(key, line)| line.strip_prefix(key).unwrap().trim())
        .collect();
    let git = std::process::Command::new("git")
        .args(["rev-parse", "HEAD"])
        .output();
    let head = git.ok().filter(|git| git.status.success());
    let head = head.and_then(|git| String::from_utf8(git.stdout).ok());
    let commit = head.as_deref().map_or("unknown", |head| &head[..12]);
    // This program is target/PROFILE/deps/cli-HASH.
    let program = std::env::current_exe().unwrap();
    let is_debug = program.ancestors().nth(2).unwrap().ends_with("debug");
    let profile = if is_debug { "debug" } else { "release" };
    assert_eq!((long.out.starts_with(&short.out), values.len()), (true, 4));
    assert_eq!((values[0], values[3]), (commit, profile));
    assert!(values[2].contains(std::env::consts::ARCH));
}
