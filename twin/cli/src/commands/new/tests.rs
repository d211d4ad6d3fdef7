use std::path::Path;

use proptest::prelude::*;
use twinrig_experiment::execute;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::execution::Execution;

use super::*;

fn args(kind: NewKind, name: &str, folder: &Path) -> NewArgs {
    NewArgs {
        kind,
        name: name.to_owned(),
        folder: folder.to_owned(),
        robot: None,
        twinrig: None,
    }
}

/// Returns a folder that did not exist before.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("twin-new-{}-{name}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    folder
}

#[test]
fn new_scenarios_pass_for_small_large_and_new_robots() {
    let folder = folder("scenario");
    let registry = Registry::standard();
    make(&args(NewKind::Robot, "mine", &folder), &registry).unwrap();
    for robot in ["cheetah-cub", "oncilla", "mine"] {
        let mut args = args(NewKind::Scenario, &format!("try-{robot}"), &folder);
        args.robot = Some(robot.to_owned());
        make(&args, &registry).unwrap_or_else(|error| panic!("{error}"));
        let path = folder.join(format!("try-{robot}.toml"));
        assert!(!fs::read_to_string(&path).unwrap().contains('@'));
        let assembly = Assembly::builder(&registry).file(&path);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        assert!(assembly.scenario().warnings.is_empty());
        let report = execute(&assembly, &Execution::default()).unwrap();
        assert_eq!(report.expectations.len(), 6);
        for line in &report.expectations {
            assert!(line.holds(), "{robot}: {:?}", line.outcome);
        }
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn nothing_is_overwritten() {
    let folder = folder("existing");
    for kind in [
        NewKind::Controller,
        NewKind::Driver,
        NewKind::Plant,
        NewKind::Scenario,
        NewKind::Robot,
    ] {
        let args = args(kind, &format!("my-{kind:?}").to_lowercase(), &folder);
        make(&args, &Registry::standard()).unwrap();
        let error = make(&args, &Registry::standard()).unwrap_err().to_string();
        assert!(
            error.contains("exists") && error.contains("--in"),
            "{error}"
        );
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn files_of_crates_have_no_placeholder_left() {
    for (file, text) in [CONTROLLER, DRIVER, PLANT].concat() {
        let filled = filled(text, "my-part", "version = \"0.1.0\"");
        let left = ["template_name", "@TWINRIG@"];
        assert!(!left.iter().any(|word| filled.contains(word)), "{file}");
    }
}

#[test]
fn a_folder_that_is_no_clone_is_refused_before_anything_is_written() {
    let folder = folder("clone");
    let mut args = args(NewKind::Controller, "jump", &folder);
    args.twinrig = Some(folder.join("missing"));
    let error = make(&args, &Registry::standard()).unwrap_err().to_string();
    assert!(error.contains("is not a clone of Twinrig"), "{error}");
    assert!(!folder.exists());
}

#[test]
fn the_clone_of_the_build_is_named_within_it_only() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = path.join("../..").canonicalize().unwrap();
    let of = |place: PathBuf| Dependency::of_places(path, [place].into_iter()).toml();
    assert!(of(root.join("target/debug/twin")).starts_with("path = "));
    let version = format!("version = \"{VERSION}\"");
    for elsewhere in [
        "/home/user/venv/lib/twinrig/_native.abi3.so",
        "/home/user/robots",
    ] {
        assert_eq!(of(PathBuf::from(elsewhere)), version);
    }
    let gone = Path::new("/nowhere/twin/cli");
    let within = Dependency::of_places(gone, [PathBuf::from("/nowhere/crates")].into_iter());
    assert_eq!(within.toml(), version);
}

proptest! {
    /// A refused name comes with one that is accepted.
    #[test]
    fn suggested_names_are_valid(name in "\\PC{0,12}|fn|cpg|My Gait|proc-macro|[a-z]{60,70}|gait.toml") {
        let registry = Registry::standard();
        for of_crate in [true, false] {
            let check = |name: &str| if of_crate {
                name::check_crate(name, &registry)
            } else {
                name::check_file(name)
            };
            if let Err(error) = check(&name) {
                let error = error.to_string();
                let suggested = error.rsplit('`').nth(1).unwrap();
                prop_assert!(check(suggested).is_ok(), "{}", error);
            }
        }
    }
}
