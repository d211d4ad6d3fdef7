//! After faults, and during them.

use std::collections::BTreeSet;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::FaultKind;

use crate::any::{Kinds, any_setting};
use crate::bench::Cycle;
use crate::run::{ask, before_step, bench_of, run};
use crate::scope::LEGS;
use crate::setting::{Setting, micros, millis};
use crate::values::{QUIET, timeout};

/// How long after the last fault something of it may still be under way to the host: what was delayed, by all delays
/// together; half a millisecond of copies and of bursts that were held; what waits in the converter. A line that is stuck makes
/// one burst of all its time: once more for a place that copies or holds it, twice as much for two, and so on. What comes
/// to that place meanwhile waits, and goes on behind it: of a wire that is busy for a quarter of the time at most (four
/// packets with their answers, 106 µs each, in 2 ms or more), a third as much again.
fn echo(setting: &Setting) -> SimDuration {
    let usb = setting.usb();
    let converter = usb.latency_timer + usb.microframe * 5 + setting.late_max();
    let (mut delays, mut noise) = (SimDuration::ZERO, SimDuration::ZERO);
    let mut places = BTreeSet::new();
    for trouble in &setting.troubles {
        match trouble.kind {
            FaultKind::Delay { by } => delays += by,
            FaultKind::Stuck | FaultKind::Babble { .. } => noise += trouble.lasts,
            FaultKind::Duplicate { .. } | FaultKind::Reorder { .. } => {
                places.insert(&trouble.on);
            }
            _ => {}
        }
    }
    let copies = noise * ((1 << places.len()) - 1);
    micros(500) + converter + delays + copies + copies / 3
}

/// Longest that a transfer takes while no byte comes that it did not ask for: quiet, then a time-out for each packet, or one for
/// the frame.
fn transfer_max(setting: &Setting) -> SimDuration {
    let (trips, _) = setting.round_trips();
    QUIET + timeout(setting) * trips
}

/// From when on cycles are good: the echo is over, and the transfer that was then under way.
fn recovered(setting: &Setting) -> SimTime {
    setting.last_fault() + echo(setting) + transfer_max(setting)
}

#[test]
fn once_faults_echo_and_one_transfer_are_over_every_cycle_is_good_and_boards_follow() {
    ask(128, any_setting(Kinds::All), |setting| {
        let good = recovered(setting);
        let bench = run(setting, good - setting.last_fault() + setting.period * 40)?;
        let errors = bench.diagnostic("sbcp/errors");
        let first = bench.watch.cycles.iter().find(|cycle| cycle.begun >= good);
        let first = first.ok_or("no cycle begins any longer")?;
        if errors > first.errors_before {
            let more = errors - first.errors_before;
            return Err(format!("{more} errors in cycles from {good} on"));
        }
        let late = |cycle: &&Cycle| {
            cycle.begun > good
                && cycle
                    .ended
                    .is_none_or(|end| end - cycle.begun > QUIET + setting.transfer_max())
        };
        if let Some(cycle) = bench.watch.cycles.iter().find(late) {
            return Err(format!("{cycle:?} takes too long"));
        }
        for (leg, name) in LEGS.iter().enumerate() {
            let (shown, sent) = (bench.shown(leg), &bench.watch.sent[leg]);
            let last = shown.last().ok_or("nothing is shown")?;
            // Nothing is further behind than what the board can hold: 8 points, the one under way, and the one that comes.
            let recent = sent.iter().rev().take(10);
            let near = |goals: [i64; 2]| {
                let off = |n: usize| Some((last.goals[n]? - goals[n]).abs());
                let most = i64::try_from(30 * (setting.period.as_nanos() / 1_000_000 - 1)).unwrap();
                off(0) <= Some(most) && off(1) <= Some(most) && off(0).is_some()
            };
            if !recent.into_iter().any(|sent| near(sent.goals)) {
                return Err(format!("{name} does not follow: {last:?}"));
            }
        }
        Ok(())
    });
}

#[test]
fn every_transfer_ends_within_a_transfer_and_an_echo_of_the_last_fault() {
    ask(96, any_setting(Kinds::All), |setting| {
        let bench = run(setting, millis(200))?;
        let most = transfer_max(setting);
        let echo_over = setting.last_fault() + echo(setting);
        for cycle in &bench.watch.cycles {
            let by = cycle.begun.max(echo_over) + most;
            let ended = cycle.ended.is_some_and(|end| end <= by);
            if !ended && by < bench.rig.now() {
                return Err(format!("{cycle:?} should have ended by {by}"));
            }
        }
        Ok(())
    });
}

#[test]
fn a_session_whose_opening_meets_faults_opens_or_says_why_not_and_the_run_comes_to_its_end() {
    ask(48, any_setting(Kinds::All), |setting| {
        // From power-on, not from when the boards are ready.
        let early = Setting {
            opened: SimTime::ZERO,
            ..setting.clone()
        };
        let mut bench = bench_of(&early);
        let end = before_step(&early, SimTime::ZERO + SimDuration::from_secs(8));
        match bench.run_until(end) {
            Ok(()) if bench.watch.opened.is_none() => Err("it opens for ever".into()),
            Err(why) if !why.contains("board ") => Err(format!("it fails, but why? {why}")),
            _ => Ok(()),
        }
    });
}

/// Bytes on the way \[B\]: whatever a wire of 333 bytes a millisecond carries in the longest time that it is held up, both ways,
/// at two places; a frame for each side of the master, controller and boards; and the times that go with them, at most 14 bytes
/// a stretch of bytes.
#[test]
fn what_is_held_on_the_way_stays_below_what_the_wire_carries_in_the_longest_delay() {
    ask(32, any_setting(Kinds::All), |setting| {
        let mut bench = bench_of(setting);
        bench.run_until(setting.opened)?;
        let calm = bench.rig.save().0.len();
        let delays = echo(setting) + millis(2);
        let on_the_way = delays.as_nanos() / 3_000 * 2 * 2 * (1 + 14);
        let most = calm + usize::try_from(on_the_way).unwrap() + 4_096;
        let mut at = setting.opened;
        while at < setting.last_fault() + millis(20) {
            at += micros(1_700);
            bench.run_until(at)?;
            let held = bench.rig.save().0.len();
            if held > most {
                return Err(format!(
                    "{held} bytes of state at {at}, {calm} when it was calm, {most} at most"
                ));
            }
        }
        Ok(())
    });
}
