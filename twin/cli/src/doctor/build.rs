//! This build: its version, its parts, the robots that it finds.

use std::path::Path;

use twinrig_robot::RobotFile;

use super::item::Item;
use twinrig_rig::registry::Registry;

/// Version of this program.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

pub(super) fn items(registry: &Registry) -> Vec<Item> {
    let mut items = vec![Item::ok(
        "twin",
        format!(
            "{VERSION}, {} {}",
            std::env::consts::OS,
            std::env::consts::ARCH
        ),
    )];
    for kind in &registry.catalogue(None).plants {
        let Some(remedy) = &kind.remedy else { continue };
        let item = Item::notice(format!("plant {}", kind.name), "not in this build");
        items.push(item.affecting(
            format!("scenarios with plant.model = \"{}\"", kind.name),
            remedy,
        ));
    }
    #[cfg(feature = "mujoco")]
    items.push(mujoco());
    items.extend(robots());
    items
}

#[cfg(feature = "mujoco")]
fn mujoco() -> Item {
    use twinrig_mujoco::Engine;

    // A program whose library is not found does not start.
    match Engine::check_version() {
        Ok(()) => Item::ok("MuJoCo's library", Engine::VERSION),
        Err(error) => Item::problem("MuJoCo's library", error.to_string())
            .affecting("plants mujoco and mjcf", "ci/setup mujoco")
            .needed(),
    }
}

/// Returns an item for all robots, or for each that cannot be read.
fn robots() -> Vec<Item> {
    let names = RobotFile::names(Path::new(""));
    let read = |name: &String| RobotFile::find(name, Path::new("")).and_then(|file| file.robot());
    let broken: Vec<_> = names
        .iter()
        .filter(|name| read(name).is_err())
        .map(|name| {
            Item::problem(format!("robot {name}"), "its file has mistakes")
                .affecting("scenarios of this robot", format!("twin list {name}"))
                .needed()
        })
        .collect();
    if broken.is_empty() {
        return vec![Item::ok("robots", names.join(", "))];
    }
    broken
}
