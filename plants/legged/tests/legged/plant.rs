//! Properties of [`LeggedPlant`], with dynamics whose motion is known: one servo, whose hip has a
//! rate equal to its input.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime, Snapshot};
use twinrig_runtime::{Plant, PlantEventKind, PlantState};

use crate::fixture::{STEP, hip, plant, plant_with_readings};

fn at(nanos: u64) -> SimTime {
    SimTime::from_nanos(nanos)
}

#[test]
fn steps_divide_an_advance_and_never_exceed_the_greatest() {
    let mut plant = plant();
    plant.advance(at(3_500_000), &[1.0]).unwrap();
    let steps: Vec<f64> = plant
        .dynamics()
        .steps
        .iter()
        .map(|step| step.seconds)
        .collect();
    assert_eq!(steps, [1e-3, 1e-3, 1e-3, 5e-4]);
    assert!((hip(&plant) - 3.5e-3).abs() < 1e-15);
}

#[test]
fn fault_has_time_and_energy_of_the_last_valid_state() {
    let mut plant = plant();
    plant.dynamics_mut().fails_at = Some(at(2_000_000));
    let fault = plant.advance(at(5_000_000), &[1.0]).unwrap_err();
    assert_eq!((fault.time, fault.part.as_str()), (at(2_000_000), "leg/LF"));
    // The dynamics overwrite their energy before they fail, as an engine does.
    assert_eq!(fault.energy, 2e-3);
    let fault = plant.advance(at(5_000_000), &[f64::NAN]).unwrap_err();
    assert_eq!(fault.part, "leg/LF/hip/command");
}

#[test]
fn events_are_collected_in_order_until_the_log_is_cleared() {
    let mut plant = plant();
    plant.advance(at(1_000_000), &[1.0]).unwrap();
    assert!(plant.events().is_empty(), "disabled in a new plant");
    plant.log_events(true);
    plant.advance(at(3_000_000), &[1.0]).unwrap();
    plant.advance(at(4_000_000), &[1.0]).unwrap();
    let times: Vec<f64> = plant.events().iter().map(|event| event.at_s).collect();
    assert_eq!(times, [2e-3, 3e-3, 4e-3]);
    assert_eq!(plant.events()[0].kind, PlantEventKind::Reached);
    plant.log_events(true);
    assert!(plant.events().is_empty());
}

#[test]
fn state_with_extra_entries_is_resumed_at_its_time() {
    let mut from = plant();
    from.advance(at(2_000_000), &[3.0]).unwrap();
    let state = from.state().unwrap();
    let mut to = plant();
    assert_eq!(to.resume_from(&state).unwrap(), Vec::<String>::new());
    assert_eq!((hip(&to), to.dynamics().extra), (hip(&from), 2.0));
    assert_eq!(to.state().unwrap(), state);
    // Unknown and missing entries are reported, each once.
    let other = state
        .only(|name| name != "leg/LF/extra")
        .with("mood", &[1.0]);
    let lines = to.resume_from(&other).unwrap();
    assert_eq!(
        lines,
        [
            "mood is not a state of this plant",
            "leg/LF/extra is missing"
        ]
    );
}

#[test]
fn invalid_state_of_another_plant_is_rejected_unchanged() {
    let mut plant = plant();
    plant.advance(at(2_000_000), &[3.0]).unwrap();
    let (before, state) = (plant.save(), plant.state().unwrap());
    for (name, values) in [
        ("body/position", vec![f64::NAN, 0.0, 0.0]),
        ("body/orientation", vec![0.0; 4]),
    ] {
        let invalid = state.only(|other| other != name).with(name, &values);
        let fault = plant.resume_from(&invalid).unwrap_err();
        assert_eq!((fault.part.as_str(), fault.time), ("body", at(2_000_000)));
        assert_eq!(plant.save(), before);
    }
}

#[test]
fn foreign_snapshot_is_refused() {
    let mut plant = plant();
    assert!(plant.restore(&Snapshot::of(&1_u8)).is_err());
    let empty = PlantState::at(at(7));
    let lines = plant.resume_from(&empty).unwrap();
    assert!(
        lines
            .iter()
            .any(|line| line.starts_with("body/position is missing"))
    );
}

proptest! {
    /// Windows, time and dynamics are restored: the plant continues bit for bit.
    #[test]
    fn restored_plant_continues_unchanged(
        inputs in prop::collection::vec(-1.0..1.0_f64, 2..20),
        lengths in prop::collection::vec(1..3 * STEP.as_nanos(), 20),
        saved_at in 0..19_usize,
    ) {
        let mut plants = [plant_with_readings(), plant_with_readings()];
        let mut now = SimTime::ZERO;
        for (i, (input, nanos)) in inputs.iter().zip(lengths).enumerate() {
            now += SimDuration::from_nanos(nanos);
            let [one, two] = &mut plants;
            one.advance(now, &[*input]).unwrap();
            if i == saved_at % inputs.len() {
                one.begin_window();
                two.restore(&one.save()).unwrap();
            } else if i > saved_at % inputs.len() {
                two.advance(now, &[*input]).unwrap();
                let [mut a, mut b] = [[0.0; 3]; 2];
                one.observe(&mut a);
                two.observe(&mut b);
                prop_assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits));
                prop_assert_eq!(one.save(), two.save());
            }
        }
    }
}
