//! A rig snapshot at any instant and restored continues bit for bit.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Group, Observer, RunEvent};
use twinrig::{Assembly, Registry};
use twinrig_tests::{TrotFixture, run_from, settings};

const CONTINUATION: SimDuration = SimDuration::from_millis(100);

/// Transfers and iterations of non-zero duration, so that some are in progress at any instant.
fn fixture() -> TrotFixture {
    TrotFixture {
        io: "step = \"1 ms\"\ntransfer_time = { min = \"300 us\", max = \"1500 us\" }",
        ..TrotFixture::default()
    }
}

/// Saves at `at`, continues, and compares with a new rig and with the original one, both restored.
fn check_continuation(fixture: &TrotFixture, at: SimTime) -> Result<(), TestCaseError> {
    let registry = Registry::standard();
    check_continuation_of(&fixture.assembly(&registry), at)
}

fn check_continuation_of(assembly: &Assembly<'_>, at: SimTime) -> Result<(), TestCaseError> {
    // Continuations may be longer than the scenario.
    let mut rig = assembly.rig().unwrap();
    rig.set_end(None);
    rig.run_until(at, &mut ()).unwrap();
    let snapshot = rig.save();
    let expected = run_from(&mut rig, at + CONTINUATION);
    let after = rig.save();

    let mut other = assembly.rig().unwrap();
    other.set_end(None);
    other.restore(&snapshot).unwrap();
    prop_assert_eq!(&other.save(), &snapshot);
    prop_assert_eq!(run_from(&mut other, at + CONTINUATION), expected);
    prop_assert_eq!(&other.save(), &after);

    rig.restore(&snapshot).unwrap();
    prop_assert_eq!(run_from(&mut rig, at + CONTINUATION), expected);
    Ok(())
}

/// Returns the path of a scenario of the repository.
fn scenario(file: &str) -> PathBuf {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    scenarios.join(file)
}

/// Buses of the scenario, with clock errors and host jitter.
const BUSES: &str = concat!(
    r#"[{ kind = "sbcp", error_threshold = -1, gains = { p = 1900, i = 0, d = 700 }, "#,
    r#"clock = { LF = "40 ppm", RH = "-300 ppm" }, usb = { jitter = { min = "0 us", max = "400 us" } } }, "#,
    r#"{ kind = "rb110" }]"#,
);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn restored_at_any_instant(at in 0..600_000_000_u64) {
        check_continuation(&fixture(), SimTime::from_nanos(at))?;
    }

    #[test]
    fn restored_at_any_instant_with_leg_inertia(at in 0..600_000_000_u64) {
        check_continuation(&fixture().with_leg_inertia(), SimTime::from_nanos(at))?;
    }

    /// Also in the middle of an approach of linear set-points.
    #[test]
    fn restored_at_any_instant_with_linear_set_points(at in 0..600_000_000_u64) {
        let linear = TrotFixture { actuator: "set_point = \"linear\"", ..fixture() };
        check_continuation(&linear, SimTime::from_nanos(at))?;
    }

    /// Including frames, packets and bytes in transit, boards between two ticks, faults and jitter.
    #[test]
    fn restored_at_any_instant_with_buses(at in 0..700_000_000_u64) {
        let registry = Registry::standard();
        let trot = scenario("oncilla-trot.toml");
        let settings = settings(&[
            ("bus", BUSES),
            ("fault", "[{ at = \"300 ms\", on = \"wire/sbcp\", kind = \"flip\", rate = 1e-4 }]"),
        ]);
        let assembly = Assembly::builder(&registry).settings(&settings).file(&trot).unwrap();
        check_continuation_of(&assembly, SimTime::from_nanos(at))?;
    }

    /// Samples in transit, random walks and random streams included.
    #[test]
    fn restored_at_any_instant_with_sensors(at in 0..600_000_000_u64) {
        let registry = Registry::standard();
        let tegotae = scenario("tegotae-noisy.toml");
        let assembly = Assembly::builder(&registry).file(&tegotae).unwrap();
        check_continuation_of(&assembly, SimTime::from_nanos(at))?;
    }

    #[test]
    fn restored_at_any_instant_with_tabulated_forces(at in 0..600_000_000_u64) {
        let fixture = TrotFixture { plant: "force = \"lookup\"", ..fixture() };
        check_continuation(&fixture, SimTime::from_nanos(at))?;
    }
}

/// Observer of touch-downs: the first observation with a load after one without.
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
fn restored_during_an_impact() {
    let registry = Registry::standard();
    let assembly = fixture().assembly(&registry);
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
    assert!(touch_downs.times.len() >= 2, "at least two touch-downs");
    // The impact is within the two milliseconds before its observation.
    for before_us in [1999, 1500, 1000, 500, 1] {
        for &observed in touch_downs.times.iter().take(4) {
            let at = SimTime::from_nanos(observed.as_nanos() - 1000 * before_us);
            check_continuation(&fixture(), at).unwrap();
        }
    }
}
