//! The schema of scenario files that the repository keeps is that of the program.

use std::path::Path;

use twinrig::Registry;
use twinrig::robot::RobotFile;

/// Regenerate with `UPDATE_SCHEMA=1 cargo test -p twinrig schema`.
#[test]
fn the_schema_that_is_kept_is_that_of_this_build() {
    let robot = RobotFile::find("cheetah-cub", Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
    let schema = Registry::standard().schema(&robot.robot().unwrap());
    let made = serde_json::to_string_pretty(&schema).unwrap() + "\n";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/scenario.schema.json");
    if std::env::var_os("UPDATE_SCHEMA").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap();
    assert!(
        made == kept,
        "run UPDATE_SCHEMA=1 cargo test -p twinrig schema"
    );
    for key in ["massless", "cpg", "hip_height", "phase_difference"] {
        assert!(made.contains(&format!("\"{key}\"")), "{key}");
    }
}
