//! Each part of a run is built exactly once: controller, plant, driver and wire.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use twinrig::{BusContext, BusKind, ControllerKind, PlantKind};
use twinrig_devices::FramedDevice;
use twinrig_devices::rb110::{PulseMap, Rb110};

use crate::common::{Folder, Toy, registry, toy_ports, twin_of};

const PARTS: [&str; 4] = ["controller", "plant", "driver", "wire"];

const SCENARIO: &str = r#"
robot = "cheetah-cub"
duration = "1 s"
plant = { model = "counted" }
controller = { kind = "counted", period = "600 ms" }
bus = { kind = "counted" }
"#;

fn board(context: &BusContext<'_>) -> Rb110 {
    Rb110::with_servos(context.name, PulseMap::ONCILLA, &[])
}

/// Returns how often a command builds each of [`PARTS`].
fn builds(words: &[&str]) -> [usize; 4] {
    let counts: Arc<[AtomicUsize; 4]> = Arc::default();
    let count = |part: usize| {
        let counts = Arc::clone(&counts);
        move || counts[part].fetch_add(1, Ordering::Relaxed)
    };
    let [controller, plant, driver, wire] = [0, 1, 2, 3].map(count);
    let registry = registry()
        .with_controller(ControllerKind::new(
            "counted",
            "commands nothing",
            move |_| {
                controller();
                Ok(crate::common::Clumsy { steps: 0 })
            },
        ))
        .with_plant(
            PlantKind::new("counted", "bobs", move |_| {
                plant();
                Ok(Toy::sound())
            })
            .with_ports(|_| Ok(toy_ports())),
        )
        .with_bus(BusKind::new(
            "counted",
            "a servo board",
            move |context| {
                driver();
                Ok(board(context).driver()?)
            },
            move |context| {
                wire();
                Ok(board(context).wire(&context.fault_schedule())?)
            },
        ));
    let folder = Folder::new(&format!("builds-{}", words[0]));
    let scenario = folder.file("counted.toml", SCENARIO);
    let done = twin_of(&registry, &[words, &[&scenario]].concat());
    assert_eq!(done.code, 0, "{}{}", done.out, done.err);
    [0, 1, 2, 3].map(|part| counts[part].load(Ordering::Relaxed))
}

#[test]
fn commands_build_each_part_of_a_run_once() {
    for words in [&["check"][..], &["plan"], &["run", "--no-record"]] {
        let built = builds(words);
        for (part, count) in PARTS.into_iter().zip(built) {
            assert_eq!(count, 1, "{words:?} builds the {part} {count} times");
        }
    }
}
