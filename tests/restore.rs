//! A rig that is saved at any instant and restored goes on bit for bit.

use std::path::Path;

use proptest::prelude::*;
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Group, Observer, RunEvent};
use twinrig::scenario::Setting;
use twinrig::{Assembly, Registry};
use twinrig_tests::{Scene, run_from};

const AHEAD: SimDuration = SimDuration::from_millis(100);

/// Transfers and iterations that take time, so that some are under way at any instant.
fn scene() -> Scene {
    Scene {
        io: "step = \"1 ms\"\ntransfer_time = { min = \"300 us\", max = \"1500 us\" }",
        ..Scene::default()
    }
}

/// Saves at `at`, goes on, and compares with a new rig and with the old one, restored.
fn goes_on_alike(scene: &Scene, at: SimTime) -> Result<(), TestCaseError> {
    let registry = Registry::standard();
    goes_on_alike_as(&scene.assembly(&registry), at)
}

fn goes_on_alike_as(assembly: &Assembly<'_>, at: SimTime) -> Result<(), TestCaseError> {
    let mut rig = assembly.rig().unwrap();
    rig.run_until(at, &mut ()).unwrap();
    let saved = rig.save();
    let went = run_from(&mut rig, at + AHEAD);
    let after = rig.save();

    let mut other = assembly.rig().unwrap();
    other.restore(&saved).unwrap();
    prop_assert_eq!(&other.save(), &saved);
    prop_assert_eq!(run_from(&mut other, at + AHEAD), went);
    prop_assert_eq!(&other.save(), &after);

    rig.restore(&saved).unwrap();
    prop_assert_eq!(run_from(&mut rig, at + AHEAD), went);
    Ok(())
}

/// Those of the scenario, with a host that is not even.
const BUSES: &str = concat!(
    r#"[{ kind = "sbcp", error_threshold = -1, gains = { p = 1900, i = 0, d = 700 }, "#,
    r#"clock = { LF = "40 ppm", RH = "-300 ppm" }, usb = { jitter = { min = "0 us", max = "400 us" } } }, "#,
    r#"{ kind = "rb110" }]"#,
);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn at_any_instant(at in 0..600_000_000_u64) {
        goes_on_alike(&scene(), SimTime::from_nanos(at))?;
    }

    #[test]
    fn at_any_instant_with_full_legs(at in 0..600_000_000_u64) {
        goes_on_alike(&scene().of_full_legs(), SimTime::from_nanos(at))?;
    }

    /// Frames, packets and bytes under way, boards between two ticks, faults and jitter included.
    #[test]
    fn at_any_instant_over_a_bus(at in 0..700_000_000_u64) {
        let registry = Registry::standard();
        let trot = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/oncilla-trot.toml");
        let setting = |key: &str, value: &str| Setting {
            origin: "the test".to_owned(),
            key: key.to_owned(),
            value: value.to_owned(),
        };
        let settings = [
            setting("bus", BUSES),
            setting("fault", "[{ at = \"300 ms\", on = \"wire/sbcp\", kind = \"flip\", rate = 1e-4 }]"),
        ];
        let assembly = Assembly::of_file(&registry, &trot, &settings).unwrap();
        goes_on_alike_as(&assembly, SimTime::from_nanos(at))?;
    }

    #[test]
    fn at_any_instant_with_forces_from_the_table(at in 0..600_000_000_u64) {
        let scene = Scene { plant: "force = \"lookup\"", ..scene() };
        goes_on_alike(&scene, SimTime::from_nanos(at))?;
    }
}

/// When feet come down: the first observation of a load after none.
#[derive(Default)]
struct TouchDowns {
    loads: Vec<usize>,
    loaded: Vec<bool>,
    times: Vec<SimTime>,
}

impl Observer for TouchDowns {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group != Group::Plant {
            return;
        }
        for (foot, &load) in self.loads.iter().enumerate() {
            let loaded = values[load] > 0.0;
            if loaded && !self.loaded[foot] {
                self.times.push(now);
            }
            self.loaded[foot] = loaded;
        }
    }

    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

#[test]
fn in_the_middle_of_an_impact() {
    let registry = Registry::standard();
    let assembly = scene().assembly(&registry);
    let mut rig = assembly.rig().unwrap();
    let fields = rig.layout(Group::Plant).fields();
    let loads = fields.filter(|field| field.port.name.ends_with("foot/load"));
    let loads: Vec<usize> = loads.map(|field| field.offset).collect();
    let mut touch_downs = TouchDowns {
        loaded: vec![true; loads.len()],
        loads,
        times: Vec::new(),
    };
    rig.run_until(assembly.end(), &mut touch_downs).unwrap();
    assert!(touch_downs.times.len() >= 2, "nothing came down");
    // The impact lies in the two milliseconds before it was seen.
    for before_us in [1999, 1500, 1000, 500, 1] {
        for &seen in touch_downs.times.iter().take(4) {
            let at = SimTime::from_nanos(seen.as_nanos() - 1000 * before_us);
            goes_on_alike(&scene(), at).unwrap();
        }
    }
}
