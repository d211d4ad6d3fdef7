//! A rig that is saved at any instant and restored goes on bit for bit.

use proptest::prelude::*;
use twinrig::Registry;
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Group, Observer, RunEvent};
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
    let assembly = scene.assembly(&registry);
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
