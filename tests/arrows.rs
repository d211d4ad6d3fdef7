//! Permitted dependencies between crates. A dependency that is not in the table below requires a
//! reason before it is added.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Each crate with its dependencies within the project, dev-dependencies excluded.
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
    (
        "twinrig-testing",
        &[
            "twinrig-contact",
            "twinrig-kernel",
            "twinrig-leg",
            "twinrig-legged",
            "twinrig-robot",
            "twinrig-runtime",
            "twinrig-wire",
        ],
    ),
    ("twinrig-tests", &["twinrig", "twinrig-record"]),
    ("twinrig-wire", &["twinrig-kernel", "twinrig-runtime"]),
];

/// Exchangeable plants and controllers, on which only the program may depend.
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
    /// Folder relative to the workspace root.
    folder: PathBuf,
    /// Dependencies without dev-dependencies.
    dependencies: BTreeSet<String>,
    /// All dependencies, dev-dependencies included.
    all_dependencies: BTreeSet<String>,
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
        let names = |include: &dyn Fn(&Value) -> bool| {
            let dependencies = package["dependencies"].as_array().unwrap().iter();
            dependencies
                .filter(|dependency| include(dependency))
                .map(|dependency| dependency["name"].as_str().unwrap().to_owned())
                .collect()
        };
        let manifest = Path::new(package["manifest_path"].as_str().unwrap());
        let folder = manifest.parent().unwrap().strip_prefix(workspace).unwrap();
        let package_read = Package {
            folder: folder.to_owned(),
            dependencies: names(&|dependency| dependency["kind"] != "dev"),
            all_dependencies: names(&|_| true),
        };
        (package["name"].as_str().unwrap().to_owned(), package_read)
    };
    packages.iter().map(read).collect()
}

#[test]
fn dependencies_match_the_table() {
    let packages = packages();
    let found: BTreeMap<&str, BTreeSet<&str>> = packages
        .iter()
        .map(|(name, package)| {
            let ours = package.dependencies.iter().map(String::as_str);
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
fn only_the_program_and_these_tests_depend_on_exchangeable_crates() {
    for (name, package) in packages() {
        if package.folder.starts_with("twin/cli") || package.folder.starts_with("tests") {
            continue;
        }
        for other in EXCHANGEABLE {
            assert!(
                !package.all_dependencies.contains(*other),
                "{name} depends on {other}, possibly in its tests only"
            );
        }
    }
}

#[test]
fn libraries_do_not_depend_on_the_program() {
    for (name, package) in packages() {
        let below = ["twin", "plants", "controllers", "drivers"]
            .iter()
            .any(|folder| package.folder.starts_with(folder));
        if below && name != "twinrig" {
            assert!(!package.all_dependencies.contains("twinrig"), "{name}");
        }
    }
}

#[test]
fn architecture_lists_every_crate_and_a_reason_for_every_dependency() {
    let map = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let packages = packages();
    for (name, package) in &packages {
        let folder = format!("`{}/`", package.folder.display());
        assert!(
            map.contains(&folder),
            "{name} is missing from ARCHITECTURE.md"
        );
        for dependency in &package.all_dependencies {
            let row = format!("| `{dependency}` |");
            assert!(
                packages.contains_key(dependency) || map.contains(&row),
                "{name} depends on {dependency} without a reason in ARCHITECTURE.md"
            );
        }
    }
}
