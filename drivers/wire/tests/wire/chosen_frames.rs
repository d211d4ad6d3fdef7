//! Faults of chosen frames harm these and no others, and those of chosen phases the bytes in them.

use crate::faults::{END, FRAMES, Harness, PLACE, fault, run, schedule, text};
use crate::support::*;
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{BusHealth, Part};
use twinrig_wire::{
    DriverPhase, Fault, FaultDirection, FaultKind, FaultSelection, Faulty, FrameChoice, FrameCount,
    Rs485,
};

const DROP: FaultKind = FaultKind::Drop { probability: 1.0 };

fn chosen(kind: FaultKind, direction: FaultDirection, frames: FrameChoice) -> Fault {
    Fault {
        select: FaultSelection {
            direction: Some(direction),
            frames: Some(frames),
            ..FaultSelection::default()
        },
        ..fault(0, END, kind)
    }
}

fn numbered(count: FrameCount) -> FrameChoice {
    FrameChoice { after: None, count }
}

/// Frame of the kind 0, `ping`, or 2, `set`, with its number.
fn frame(kind: u8, number: u8) -> [u8; 3] {
    [b'@' + kind, b'a' + number, b'.']
}

#[test]
fn frames_within_a_burst_are_dropped_by_their_number() {
    // Four frames without a pause.
    let burst: Vec<u8> = (0..4).flat_map(|n| frame(0, n)).collect();
    let bursts = vec![(0, burst)];
    let only = |count| {
        let drop = chosen(DROP, FaultDirection::Out, numbered(count));
        let (far, near) = run(vec![drop], &bursts);
        assert_eq!(text(&near), "@a.@b.@c.@d.", "the other direction");
        text(&far)
    };
    assert_eq!(only(FrameCount::Nth(3)), "@a.@b.@d.");
    assert_eq!(only(FrameCount::Every(2)), "@a.@c.");
    assert_eq!(only(FrameCount::All), "");
}

#[test]
fn other_faults_harm_the_chosen_frame_only() {
    let burst: Vec<u8> = (0..3).flat_map(|n| frame(0, n)).collect();
    let bursts = vec![(0, burst)];
    let second = |kind| {
        let fault = chosen(kind, FaultDirection::In, numbered(FrameCount::Nth(2)));
        text(&run(vec![fault], &bursts).1)
    };
    let probability = 1.0;
    assert_eq!(second(FaultKind::Duplicate { probability }), "@a.@b.@b.@c.");
    assert_eq!(second(FaultKind::Reorder { probability }), "@a.@c.@b.");
    assert_eq!(second(FaultKind::Unplug { fails: false }), "@a.@c.");
    let delay = FaultKind::Delay { by: us(30) };
    let delayed = chosen(delay, FaultDirection::In, numbered(FrameCount::Nth(2)));
    let (_, near) = run(vec![delayed], &bursts);
    let times: Vec<u64> = near.iter().map(|it| it.0.as_nanos() / 1_000).collect();
    assert_eq!(times, [3, 6, 9, 42, 45, 48, 51, 54, 57]);
}

#[test]
fn faults_that_act_in_time_only_choose_no_frames() {
    let babble = FaultKind::Babble { pause: us(1) };
    let wrong = |fault: Fault| {
        let bus = Rs485::new("sbcp", BYTE, us(2), Vec::new()).unwrap();
        let line = Faulty::framed(PLACE, BYTE, &schedule(vec![fault]), Some(FRAMES), bus);
        line.err().unwrap().to_string()
    };
    let all = numbered(FrameCount::All);
    assert_eq!(
        wrong(chosen(babble, FaultDirection::In, all)),
        "a fault `babble` on wire/sbcp acts in a window of time only: give neither frames nor phase"
    );
    let after = Some("pnig".to_owned());
    let count = FrameCount::All;
    assert_eq!(
        wrong(chosen(
            DROP,
            FaultDirection::In,
            FrameChoice { after, count }
        )),
        "there is no message `pnig` on wire/sbcp; its messages are: ping, set"
    );
    let zero = numbered(FrameCount::Every(0));
    assert_eq!(
        wrong(chosen(DROP, FaultDirection::In, zero)),
        "a fault on wire/sbcp chooses frames by the number 0; they are counted from 1"
    );
}

#[test]
fn fault_in_a_phase_harms_the_bytes_of_that_phase_and_is_reported() {
    let bursts = vec![(0, b"one".to_vec()), (50_000, b"two".to_vec())];
    let harmed = |phase| {
        let mut drop = fault(0, END, DROP);
        drop.select.phase = Some(phase);
        drop.select.direction = Some(FaultDirection::Out);
        let mut harness = Harness::new(&schedule(vec![drop]), &bursts);
        harness.line.begin_phase(at(0), DriverPhase::Opening);
        harness.advance_to(&bursts, SimTime::ZERO, at(30), &[]);
        harness.line.begin_phase(at(30), DriverPhase::Transfer);
        harness.advance_to(&bursts, at(30), at(END), &[]);
        let mut health = BusHealth::default();
        harness.line.report_health(&mut health);
        let effects: Vec<(usize, u64)> = health
            .fault_effects
            .iter()
            .map(|it| (it.fault, it.harmed))
            .collect();
        (text(&harness.far()), effects)
    };
    assert_eq!(
        harmed(DriverPhase::Opening),
        ("two".to_owned(), vec![(0, 1)])
    );
    assert_eq!(
        harmed(DriverPhase::Transfer),
        ("one".to_owned(), vec![(0, 1)])
    );
}

proptest! {
    /// The reference counts the frames of a list.
    #[test]
    fn chosen_frames_and_no_others_are_missing(
        out in prop::collection::vec((0_u64..200, prop_oneof![Just(0_u8), Just(2)]), 1..12),
        inward in prop::collection::vec(0_u64..200, 1..12),
        after in any::<bool>(),
        count in prop_oneof![
            Just(FrameCount::All), (1_u64..8).prop_map(FrameCount::Nth), (1_u64..4).prop_map(FrameCount::Every),
        ],
        direction in prop_oneof![Just(FaultDirection::Out), Just(FaultDirection::In)],
    ) {
        // A pause of less than two byte times continues the burst.
        let framed = |gaps: &mut dyn Iterator<Item = (u64, u8)>| {
            let mut now = 0;
            let frames = gaps.enumerate().map(|(n, (gap, kind))| {
                now += gap * 100;
                let first = now;
                now += 9_000;
                (first, now, frame(kind, u8::try_from(n).unwrap()))
            });
            frames.collect::<Vec<_>>()
        };
        let messages = framed(&mut out.iter().copied());
        let answers = framed(&mut inward.iter().map(|gap| (*gap, 0)));
        let bursts = |frames: &[(u64, u64, [u8; 3])]| {
            let mut free = 0;
            let bursts = frames.iter().map(|(first, end, bytes)| {
                let gap = first - free;
                free = *end;
                (gap, bytes.to_vec())
            });
            bursts.collect::<Vec<_>>()
        };
        let choice = FrameChoice { after: after.then(|| "ping".to_owned()), count };
        let drop = chosen(DROP, direction, choice);
        let mut harness = Harness::new(&schedule(vec![drop]), &bursts(&answers));
        harness.advance_to(&bursts(&messages), SimTime::ZERO, at(END), &[]);
        let (far, near) = (text(&harness.far()), text(&harness.near()));

        let frames = if direction == FaultDirection::Out { &messages } else { &answers };
        let mut number = 0;
        let mut kept = String::new();
        for (first, _, bytes) in frames {
            // Its first byte is complete a byte time behind its beginning.
            let begins = SimTime::from_nanos(*first) + SimDuration::from_nanos(3_000);
            let before = messages.iter().rfind(|it| SimTime::from_nanos(it.1) < begins);
            let counts = !after || before.is_some_and(|it| it.2[0] == b'@');
            number += u64::from(counts);
            if !(counts && count.includes(number)) {
                kept.extend(bytes.iter().map(|byte| char::from(*byte)));
            }
        }
        let all = |frames: &[(u64, u64, [u8; 3])]| -> String {
            frames.iter().flat_map(|it| it.2).map(char::from).collect()
        };
        match direction {
            FaultDirection::Out => prop_assert_eq!((far, near), (kept, all(&answers))),
            FaultDirection::In => prop_assert_eq!((far, near), (all(&messages), kept)),
        }
    }
}
