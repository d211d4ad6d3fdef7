//! Which values arrive, and how many.

use std::cell::Cell;
use std::collections::BTreeMap;

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::Following;
use twinrig_wire::FaultKind;

use crate::any::{Kinds, any_setting};
use crate::bench::{Bench, Goals};
use crate::run::{ask, run};
use crate::scope::{LEGS, stamp_of};
use crate::setting::{Between, Setting, Trouble, micros, millis};

/// A tick of a board whose clock is slow by 2000 ppm, and what the plant's stamps leave open.
const TICK: SimDuration = micros(1_003 + 250);

/// The set-points that a board took, by their number among those that the master wrote for it; none for one that it never
/// wrote by then.
fn taken(bench: &Bench, leg: usize) -> Vec<Option<usize>> {
    let sent = &bench.watch.sent[leg];
    let numbers: BTreeMap<Goals, usize> = sent
        .iter()
        .enumerate()
        .map(|(n, sent)| (sent.goals, n))
        .collect();
    let shown = bench.shown(leg);
    let goals = shown.iter().filter_map(|shown| match shown.goals {
        [Some(hip), Some(knee)] if hip != 0 || knee != 0 => Some((shown.from, [hip, knee])),
        _ => None,
    });
    let number = |(from, goals): (SimTime, Goals)| {
        let number = numbers.get(&goals).copied();
        number.filter(|number| sent[*number].at <= from)
    };
    goals.map(number).collect()
}

/// What the process got that no board ever measured by then.
fn invented(bench: &Bench, setting: &Setting) -> usize {
    let wrong = |leg: usize| {
        bench
            .got(leg)
            .filter(|(at, got)| match stamp_of(leg, got) {
                Some(stamp) => setting.opened + stamp.since_start() > *at,
                None => true,
            })
            .count()
    };
    (0..4).map(wrong).sum()
}

/// Every set-point and every measurement is what was sent; set-points come in order and once, and what the process gets new
/// was measured for the cycle that brought it.
fn is_honest(bench: &Bench, setting: &Setting) -> Result<(), String> {
    if invented(bench, setting) > 0 {
        return Err("the process got what no board measured".into());
    }
    for (leg, name) in LEGS.iter().enumerate() {
        if setting.following == Following::Plain {
            let taken = taken(bench, leg);
            let order: Option<Vec<usize>> = taken.iter().copied().collect();
            let order = order.ok_or_else(|| format!("{name} took what was never sent"))?;
            if !order.is_sorted_by(|a, b| a < b) {
                return Err(format!(
                    "{name} took set-points twice or in disorder: {order:?}"
                ));
            }
        }
        is_fresh(bench, setting, leg)?;
    }
    Ok(())
}

/// What changes between two looks of the process comes from the transfer between them.
fn is_fresh(bench: &Bench, setting: &Setting, leg: usize) -> Result<(), String> {
    let mut last = None;
    for (at, got) in bench.got(leg) {
        let stamp = stamp_of(leg, &got);
        if stamp == last {
            continue;
        }
        last = stamp;
        let ended = bench.watch.cycles.iter().rev();
        let mut ended = ended.skip_while(|cycle| cycle.ended.is_none_or(|end| end > at));
        let (Some(stamp), Some(cycle)) = (stamp, ended.next()) else {
            continue;
        };
        let measured = setting.opened + stamp.since_start();
        if measured + TICK < cycle.begun {
            return Err(format!(
                "at {at} the process got of {} what was measured at {measured}, before the cycle of {}",
                LEGS[leg], cycle.begun
            ));
        }
    }
    Ok(())
}

/// How many set-points of those that came in a tick of each other cannot all be seen. Of two that were written, the first may
/// have come later by the write jitter.
fn hidden(bench: &Bench, setting: &Setting, leg: usize) -> usize {
    let sent = &bench.watch.sent[leg];
    let near = TICK + micros(250) + setting.write_jitter.longest();
    let close = |pair: &&[crate::bench::Sent]| pair[1].at - pair[0].at < near;
    1 + sent.windows(2).filter(close).count()
}

#[test]
fn without_damage_no_value_is_ever_invented_repeated_disordered_or_stale() {
    ask(48, any_setting(Kinds::Losses), |setting| {
        is_honest(&run(setting, millis(50))?, setting)
    });
}

/// Answers that come too late, but by not more than time-out and quiet together: twice the delay and a round trip.
fn late() -> impl Strategy<Value = Setting> {
    let trouble = (0..100_000_u64, 0..1_000_u64, 1..100_000_u64);
    (any_setting(Kinds::Nothing), trouble).prop_map(|(setting, (after, share, lasts))| {
        let on = match setting.between {
            Between::Nothing => "wire/sbcp",
            Between::CutThrough | Between::StoreAndForward => "wire/sbcp/link",
        };
        let (trips, _) = setting.round_trips();
        let told = timeout(&setting) + QUIET;
        let spare = told
            .checked_sub(setting.transfer_max() / trips)
            .unwrap_or_default();
        let by = SimDuration::from_nanos(spare.as_nanos() * share / 2_000);
        let trouble = Trouble {
            after: micros(after),
            on: on.into(),
            kind: FaultKind::Delay { by },
            lasts: micros(lasts),
        };
        Setting {
            troubles: vec![trouble],
            ..setting
        }
    })
}

/// For which the master waits for the line to be quiet after something went wrong.
pub const QUIET: SimDuration = millis(1);

/// Time-out of a packet or frame as the driver takes it from its configuration.
pub fn timeout(setting: &Setting) -> SimDuration {
    let usb = setting.usb();
    let usual = match setting.between {
        Between::Nothing => millis(1),
        Between::CutThrough | Between::StoreAndForward => millis(2),
    };
    usual * usb.microframe.as_nanos().div_ceil(125_000) + usb.latency_timer * 2
}

#[test]
fn an_answer_that_is_late_by_less_than_time_out_and_quiet_is_never_taken_for_that_of_a_later_cycle()
{
    ask(48, late(), |setting| {
        let bench = run(setting, millis(50))?;
        if invented(&bench, setting) > 0 {
            return Err("the process got what no board measured".into());
        }
        (0..4).try_for_each(|leg| is_fresh(&bench, setting, leg))
    });
}

#[test]
fn under_faults_that_damage_packets_wrong_values_pass_no_oftener_than_the_checksum_lets_them() {
    let (wrong, harmed) = (Cell::new(0_u64), Cell::new(0.0_f64));
    ask(96, any_setting(Kinds::All), |setting| {
        let plain = Setting {
            following: Following::Plain,
            ..setting.clone()
        };
        let bench = run(&plain, millis(50))?;
        let unsent = |leg: usize| {
            taken(&bench, leg)
                .iter()
                .filter(|number| number.is_none())
                .count()
        };
        let taken: usize = (0..4).map(unsent).sum();
        // What the process got wrong it keeps until the next good answer: that is one.
        let mut got = 0;
        for leg in 0..LEGS.len() {
            let mut last = Vec::new();
            for (_, values) in bench.got(leg) {
                got += usize::from(values != last && stamp_of(leg, &values).is_none());
                last = values;
            }
        }
        // Bytes that did not pass as they were, and bytes that met others, in packets of 10 at least.
        let bytes = bench.sum("harmed") + bench.sum("collisions");
        wrong.set(wrong.get() + (taken + got) as u64);
        harmed.set(harmed.get() + bytes / 10.0);
        let allowed = 3.0 + bytes / 10.0 / 20.0;
        if (taken + got) as f64 > allowed {
            return Err(format!(
                "{taken} set-points and {got} measurements are wrong; {bytes} bytes were harmed"
            ));
        }
        Ok(())
    });
    // A sum of 8 bits lets one in 256 pass of packets that are damaged at random, and fewer where few bits are.
    println!(
        "{} wrong values, {} packets' worth of bytes harmed",
        wrong.get(),
        harmed.get()
    );
    assert!(wrong.get() as f64 <= 3.0 + harmed.get() / 128.0);
}

#[test]
fn without_faults_every_set_point_that_was_sent_is_taken_once_and_in_order() {
    ask(32, any_setting(Kinds::Nothing), |setting| {
        let bench = run(setting, millis(300))?;
        is_honest(&bench, setting)?;
        if bench.diagnostic("sbcp/errors") > 0.0 || bench.watch.skipped > 0 {
            let (errors, skipped) = (bench.diagnostic("sbcp/errors"), bench.watch.skipped);
            return Err(format!("{errors} errors, {skipped} cycles left out"));
        }
        for (leg, name) in LEGS.iter().enumerate() {
            let sent = &bench.watch.sent[leg];
            if bench.of_leg(leg, "requests") != sent.len() as f64 {
                return Err(format!("{} did not take {}", name, sent.len()));
            }
            // Interpolated or not, every point is reached: all but those that wait at the end.
            let shown = bench.shown(leg);
            let mut shown = shown.iter();
            let mut reached = 0;
            while let Some(next) = sent.get(reached) {
                if shown.any(|shown| shown.goals == next.goals.map(Some)) {
                    reached += 1;
                } else {
                    break;
                }
            }
            let open = match setting.following {
                Following::Plain => hidden(&bench, setting, leg),
                // The one under way, and two that wait.
                Following::Smooth => 3,
            };
            if reached + open < sent.len() && hidden(&bench, setting, leg) == 1 {
                return Err(format!(
                    "{} reached {reached} of {} points",
                    name,
                    sent.len()
                ));
            }
        }
        Ok(())
    });
}

#[test]
fn under_losses_a_board_takes_what_was_sent_less_what_answers_and_errors_account_for() {
    ask(48, any_setting(Kinds::Losses), |setting| {
        let bench = run(setting, millis(50))?;
        let (mut sent, mut took) = (0.0, 0.0);
        for (leg, name) in LEGS.iter().enumerate() {
            let (of_leg, by_leg) = (
                bench.watch.sent[leg].len() as f64,
                bench.of_leg(leg, "requests"),
            );
            if by_leg > of_leg {
                return Err(format!("{name} took {by_leg} of {of_leg} set-points"));
            }
            if setting.following == Following::Plain {
                let seen = taken(&bench, leg).len() as f64;
                if seen > by_leg || seen + (hidden(&bench, setting, leg) as f64) < by_leg {
                    return Err(format!(
                        "{name} counts {by_leg} set-points and shows {seen}"
                    ));
                }
            }
            sent += of_leg;
            took += by_leg;
        }
        // Each that was lost is an error of the master.
        let errors = bench.diagnostic("sbcp/errors");
        if sent - took > errors {
            return Err(format!("{sent} sent, {took} taken, {errors} errors"));
        }
        Ok(())
    });
}

/// Where each loss takes a whole packet, of 10 bytes out or 22 back, errors and harmed bytes say how many went which way.
#[test]
fn under_losses_in_one_place_the_counters_say_exactly_how_many_set_points_are_lost() {
    ask(48, any_setting(Kinds::LossesBetween), |setting| {
        let bench = run(setting, millis(50))?;
        let sent: usize = bench.watch.sent.iter().map(Vec::len).sum();
        let took: f64 = (0..4).map(|leg| bench.of_leg(leg, "requests")).sum();
        let (errors, harmed) = (bench.diagnostic("sbcp/errors"), bench.sum("harmed"));
        let on_link = setting
            .troubles
            .iter()
            .any(|trouble| trouble.on.ends_with("link"));
        // Through the link four requests go in one burst: E = 4x + y, H = 40x + 22y; elsewhere E = x + y, H = 10x + 22y.
        let lost = if on_link {
            4.0 * (22.0 * errors - harmed) / 48.0
        } else {
            (22.0 * errors - harmed) / 12.0
        };
        if sent as f64 - took != lost {
            return Err(format!(
                "{sent} sent, {took} taken, but {lost} lost by {errors} errors and {harmed} bytes"
            ));
        }
        Ok(())
    });
}
