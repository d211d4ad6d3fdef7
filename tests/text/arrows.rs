//! Permitted dependencies between crates, in the table of ARCHITECTURE.md, and between the folders
//! of the largest plant, in a table below. A dependency that is in neither requires a reason before
//! it is added.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::imports::Imports;
use crate::vocabulary::sources;

/// Exchangeable plants and controllers, on which only the rig and what is above it may depend.
const EXCHANGEABLE: &str = "bench gait lcp massless mujoco rapier script";
/// The module of exchangeable plants in a crate on which others depend.
const EXCHANGEABLE_MODULE: &str = "twinrig_actuator::drives";
/// Folders of the rig and what is above it.
const RIG_AND_ABOVE: [&str; 5] = [
    "twin/rig",
    "twin/engines",
    "twin/experiment",
    "twin/cli",
    "tests",
];

/// Returns the full names of crates.
fn full_names(names: &str) -> impl Iterator<Item = String> {
    let full = |name| match name {
        "twinrig" => String::from(name),
        _ => format!("twinrig-{name}"),
    };
    names.split_whitespace().map(full)
}

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

fn page(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap()
}

/// A crate has one row in ARCHITECTURE.md: folder, name, contents, dependencies within the project
/// without dev-dependencies.
#[test]
fn dependencies_match_the_table() {
    let packages = packages();
    let found = packages.iter().map(|(name, package)| {
        let ours = package.dependencies.iter();
        let ours = ours.filter(|other| packages.contains_key(*other));
        let folder = format!("`{}/`", package.folder.display());
        ([folder, name.clone()], ours.cloned().collect())
    });
    let architecture = page("ARCHITECTURE.md");
    let rows = architecture.lines().filter(|line| line.starts_with("| `"));
    let table = rows.filter_map(|row| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, folder, name, _, arrows, _] = cells[..] else {
            return None;
        };
        let arrows = arrows.split([',', ' ', '–']).collect::<Vec<_>>().join(" ");
        let key = [folder, name].map(str::to_owned);
        folder
            .ends_with("/`")
            .then(|| (key, full_names(&arrows).collect()))
    });
    let (found, table): (BTreeMap<_, BTreeSet<_>>, _) = (found.collect(), table.collect());
    assert_eq!(found, table);
}

#[test]
fn only_rig_and_above_depend_on_exchangeable_crates() {
    for (name, package) in packages() {
        if RIG_AND_ABOVE
            .iter()
            .any(|folder| package.folder.starts_with(folder))
        {
            continue;
        }
        for other in full_names(EXCHANGEABLE) {
            assert!(
                !package.all_dependencies.contains(&other),
                "{name} depends on {other}, possibly in its tests only"
            );
        }
    }
    for (name, text) in sources(&["rs"]) {
        let mut folders = RIG_AND_ABOVE.iter().chain(&["plants/actuator"]);
        let may = folders.any(|folder| name.starts_with(folder));
        assert!(may || !text.contains(EXCHANGEABLE_MODULE), "{name}");
    }
}

#[test]
fn libraries_do_not_depend_on_the_program() {
    for (name, package) in packages() {
        let below = ["twin", "plants", "controllers", "drivers"]
            .iter()
            .any(|folder| package.folder.starts_with(folder));
        // The Python module is another front end of the program; tests of the library of FMUs
        // export by the program.
        let is_front_end = ["twinrig", "twinrig-fmu", "twinrig-python"].contains(&name.as_str());
        if below && !is_front_end {
            assert!(!package.all_dependencies.contains("twinrig"), "{name}");
        }
    }
}

#[test]
fn every_dependency_has_a_reason() {
    let reasons = page("docs/dependencies.md");
    let packages = packages();
    for (name, package) in &packages {
        for dependency in &package.all_dependencies {
            let row = format!("| `{dependency}` |");
            assert!(
                packages.contains_key(dependency) || reasons.contains(&row),
                "{name} depends on {dependency} without a reason in docs/dependencies.md"
            );
        }
    }
}

/// Modules at the root of `lcp`, each with the others that it may use; tests may use any.
const LCP_ROOMS: &[(&str, &str)] = &[
    ("compliant", "formulation model options"),
    ("constraints", "model"),
    ("integrators", "constraints model"),
    ("model", "options"),
    (
        "plant",
        "compliant constraints formulation integrators model options",
    ),
];

#[test]
fn rooms_of_lcp_match_the_table() {
    let imports = Imports::read(&root().join("plants/lcp/src"));
    let mut found = BTreeMap::<String, BTreeSet<String>>::new();
    for (room, used) in imports.arrows_of_rooms() {
        found.entry(room).or_default().insert(used);
    }
    let table = LCP_ROOMS.iter().map(|(room, uses)| {
        let uses = uses.split_whitespace().map(str::to_owned);
        ((*room).to_owned(), uses.collect())
    });
    assert_eq!(found, table.collect());
}

/// Files that reach themselves by imports: none is understood without all others of its circle.
const FILES_IN_CIRCLES: usize = 17;
/// Files of the largest circle.
const LARGEST_CIRCLE: usize = 3;
/// Crates whose rooms form circles, with the number of circles.
const CIRCLES_OF_ROOMS: &[(&str, usize)] = &[("twinrig-sensor", 1)];

#[test]
fn circles_of_imports_are_as_counted() {
    let mut sizes = Vec::new();
    let mut rooms = Vec::new();
    for (name, package) in packages() {
        let source = root().join(&package.folder).join("src");
        if !source.exists() {
            continue;
        }
        let imports = Imports::read(&source);
        let circles = imports.circles_of_files();
        // Shown where the test fails.
        for circle in &circles {
            println!("{name}: {}", circle.join(", "));
        }
        sizes.extend(circles.iter().map(Vec::len));
        let circles = imports.circles_of_rooms();
        for circle in &circles {
            println!("{name}, rooms: {circle:?}");
        }
        let circles = circles.len();
        if circles > 0 {
            rooms.push((name, circles));
        }
    }
    assert_eq!(sizes.iter().sum::<usize>(), FILES_IN_CIRCLES);
    assert_eq!(sizes.iter().max(), Some(&LARGEST_CIRCLE));
    let expected = CIRCLES_OF_ROOMS
        .iter()
        .map(|&(name, count)| (name.to_owned(), count));
    assert_eq!(rooms, expected.collect::<Vec<_>>());
}
