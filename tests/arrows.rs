//! Which crate may know which. An arrow that is not in the table below wants a reason before it is added there.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Every crate with the crates of the project it stands on. What only its tests use does not count.
const ARROWS: &[(&str, &[&str])] = &[
    ("rangefinder", &["twinrig", "twinrig-wire"]),
    ("squat", &["twinrig", "twinrig-leg"]),
    (
        "twinrig",
        &[
            "twinrig-contact",
            "twinrig-document",
            "twinrig-drives",
            "twinrig-gait",
            "twinrig-kernel",
            "twinrig-lcp",
            "twinrig-leg",
            "twinrig-legged",
            "twinrig-massless",
            "twinrig-motordriver",
            "twinrig-mujoco",
            "twinrig-optoforce",
            "twinrig-phidget",
            "twinrig-rapier",
            "twinrig-rb110",
            "twinrig-record",
            "twinrig-robot",
            "twinrig-runtime",
            "twinrig-sbcp",
            "twinrig-scenario",
            "twinrig-script",
            "twinrig-study",
            "twinrig-wire",
        ],
    ),
    ("twinrig-actuator", &["twinrig-robot"]),
    ("twinrig-contact", &[]),
    ("twinrig-document", &["twinrig-kernel"]),
    (
        "twinrig-drives",
        &[
            "twinrig-actuator",
            "twinrig-kernel",
            "twinrig-legged",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    (
        "twinrig-gait",
        &[
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    ("twinrig-kernel", &[]),
    (
        "twinrig-lcp",
        &[
            "twinrig-actuator",
            "twinrig-contact",
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-legged",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    ("twinrig-leg", &["twinrig-robot"]),
    (
        "twinrig-legged",
        &[
            "twinrig-actuator",
            "twinrig-contact",
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    (
        "twinrig-massless",
        &[
            "twinrig-actuator",
            "twinrig-contact",
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-legged",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    (
        "twinrig-motordriver",
        &[
            "twinrig-kernel",
            "twinrig-runtime",
            "twinrig-sbcp",
            "twinrig-wire",
        ],
    ),
    (
        "twinrig-mujoco",
        &[
            "twinrig-actuator",
            "twinrig-contact",
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-legged",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    (
        "twinrig-optoforce",
        &["twinrig-kernel", "twinrig-runtime", "twinrig-wire"],
    ),
    (
        "twinrig-phidget",
        &["twinrig-kernel", "twinrig-runtime", "twinrig-wire"],
    ),
    (
        "twinrig-rapier",
        &[
            "twinrig-actuator",
            "twinrig-contact",
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-legged",
            "twinrig-robot",
            "twinrig-runtime",
        ],
    ),
    (
        "twinrig-rb110",
        &["twinrig-kernel", "twinrig-runtime", "twinrig-wire"],
    ),
    (
        "twinrig-record",
        &["twinrig-document", "twinrig-kernel", "twinrig-runtime"],
    ),
    ("twinrig-robot", &["twinrig-document", "twinrig-kernel"]),
    ("twinrig-runtime", &["twinrig-kernel"]),
    (
        "twinrig-sbcp",
        &["twinrig-kernel", "twinrig-runtime", "twinrig-wire"],
    ),
    (
        "twinrig-scenario",
        &["twinrig-document", "twinrig-kernel", "twinrig-runtime"],
    ),
    (
        "twinrig-script",
        &["twinrig-kernel", "twinrig-robot", "twinrig-runtime"],
    ),
    (
        "twinrig-study",
        &["twinrig-kernel", "twinrig-record", "twinrig-runtime"],
    ),
    ("twinrig-tests", &["twinrig", "twinrig-record"]),
    ("twinrig-wire", &["twinrig-kernel", "twinrig-runtime"]),
];

/// Plants and controllers: what is exchanged for another, and what nobody but the program may know.
const EXCHANGEABLE: &[&str] = &[
    "twinrig-drives",
    "twinrig-gait",
    "twinrig-lcp",
    "twinrig-massless",
    "twinrig-mujoco",
    "twinrig-rapier",
    "twinrig-script",
];

/// A crate of the workspace.
struct Package {
    /// Its folder, seen from the root.
    folder: PathBuf,
    /// What it stands on, without what only its tests use.
    stands_on: BTreeSet<String>,
    /// Everything it names, its tests included.
    names: BTreeSet<String>,
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn packages() -> BTreeMap<String, Package> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version=1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let workspace = Path::new(metadata["workspace_root"].as_str().unwrap());
    let packages = metadata["packages"].as_array().unwrap();
    let read = |package: &Value| {
        let names = |wanted: &dyn Fn(&Value) -> bool| {
            let dependencies = package["dependencies"].as_array().unwrap().iter();
            dependencies
                .filter(|dependency| wanted(dependency))
                .map(|dependency| dependency["name"].as_str().unwrap().to_owned())
                .collect()
        };
        let manifest = Path::new(package["manifest_path"].as_str().unwrap());
        let folder = manifest.parent().unwrap().strip_prefix(workspace).unwrap();
        let package_read = Package {
            folder: folder.to_owned(),
            stands_on: names(&|dependency| dependency["kind"] != "dev"),
            names: names(&|_| true),
        };
        (package["name"].as_str().unwrap().to_owned(), package_read)
    };
    packages.iter().map(read).collect()
}

#[test]
fn the_arrows_are_those_of_the_table() {
    let packages = packages();
    let found: BTreeMap<&str, BTreeSet<&str>> = packages
        .iter()
        .map(|(name, package)| {
            let ours = package.stands_on.iter().map(String::as_str);
            let ours = ours.filter(|other| packages.contains_key(*other));
            (name.as_str(), ours.collect())
        })
        .collect();
    let table: BTreeMap<&str, BTreeSet<&str>> = ARROWS
        .iter()
        .map(|(name, arrows)| (*name, arrows.iter().copied().collect()))
        .collect();
    assert_eq!(found, table);
}

#[test]
fn only_the_program_and_the_tests_of_the_whole_know_what_can_be_exchanged() {
    for (name, package) in packages() {
        if package.folder.starts_with("twin/cli") || package.folder.starts_with("tests") {
            continue;
        }
        for other in EXCHANGEABLE {
            assert!(
                !package.names.contains(*other),
                "{name} knows {other}, if only in its tests"
            );
        }
    }
}

#[test]
fn nothing_below_the_program_knows_the_program() {
    for (name, package) in packages() {
        let below = ["twin", "plants", "controllers", "drivers"]
            .iter()
            .any(|folder| package.folder.starts_with(folder));
        if below && name != "twinrig" {
            assert!(!package.names.contains("twinrig"), "{name}");
        }
    }
}

#[test]
fn the_map_shows_every_crate_and_gives_a_reason_for_every_dependency() {
    let map = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let packages = packages();
    for (name, package) in &packages {
        let folder = format!("`{}/`", package.folder.display());
        assert!(map.contains(&folder), "{name} is not on the map");
        for dependency in &package.names {
            let row = format!("| `{dependency}` |");
            assert!(
                packages.contains_key(dependency) || map.contains(&row),
                "{name} depends on {dependency}, for which no reason is given"
            );
        }
    }
}
