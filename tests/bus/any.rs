//! Strategies: which buses the properties are asked of, and what goes wrong on them.

use proptest::array::uniform4;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::Following;
use twinrig_runtime::Timing;
use twinrig_wire::{FaultKind, UsbPreset};

use crate::bench::GRID;
use crate::scope::LEGS;
use crate::setting::{Between, FAULT_MAX, Setting, Trouble, jitter, micros, millis};

/// Which kinds of faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kinds {
    /// None.
    Nothing,
    /// All of them, everywhere.
    All,
    /// Whole bursts are lost, nothing else: what comes is what was sent, when it was sent. Not on a bus whose controller would not
    /// hear an answer and then talk over it.
    Losses,
    /// The same, in one place, between host and boards: the bus, or the link to a controller.
    LossesBetween,
}

const BUS: &str = "wire/sbcp";
const LINK: &str = "wire/sbcp/link";

fn stub() -> impl Strategy<Value = String> {
    (0..4_usize).prop_map(|leg| format!("wire/sbcp/{}", LEGS[leg]))
}

fn any_place(kinds: Kinds, between: Between) -> BoxedStrategy<String> {
    let whole = match between {
        Between::Nothing => BUS,
        Between::CutThrough | Between::StoreAndForward => LINK,
    };
    match kinds {
        Kinds::Nothing | Kinds::LossesBetween => Just(whole.to_owned()).boxed(),
        Kinds::Losses => prop_oneof![Just(whole.to_owned()), stub()].boxed(),
        Kinds::All => prop_oneof![Just(BUS.to_owned()), Just(LINK.to_owned()), stub()].boxed(),
    }
}

fn any_kind() -> impl Strategy<Value = FaultKind> {
    let probability = || prop_oneof![Just(1.0), 0.0..1.0_f64];
    prop_oneof![
        probability().prop_map(|probability| FaultKind::Drop { probability }),
        select(vec![1e-1, 1e-2, 1e-3, 1e-4]).prop_map(|rate| FaultKind::Flip { rate }),
        (0..5_000_u64).prop_map(|by| FaultKind::Delay { by: micros(by) }),
        probability().prop_map(|probability| FaultKind::Duplicate { probability }),
        probability().prop_map(|probability| FaultKind::Reorder { probability }),
        Just(FaultKind::Unplug { fails: false }),
        Just(FaultKind::Stuck),
        (0..2_000_u64).prop_map(|pause| FaultKind::Babble {
            pause: micros(pause)
        }),
    ]
}

/// Up to six faults that begin within 200 ms after the boards are ready, each of up to 100 ms.
fn troubles(kinds: Kinds, between: Between) -> BoxedStrategy<Vec<Trouble>> {
    let kind = match kinds {
        Kinds::Nothing => return Just(Vec::new()).boxed(),
        Kinds::All => any_kind().boxed(),
        Kinds::Losses | Kinds::LossesBetween => (0.0..1.0_f64)
            .prop_map(|probability| FaultKind::Drop { probability })
            .boxed(),
    };
    let on = any_place(kinds, between);
    let lasts = 1..=FAULT_MAX.as_nanos() / 1_000;
    let trouble = (0..200_000_u64, on, kind, lasts).prop_map(|(after, on, kind, lasts)| Trouble {
        after: micros(after),
        on,
        kind,
        lasts: micros(lasts),
    });
    vec(trouble, 0..=6).boxed()
}

fn between() -> impl Strategy<Value = Between> {
    prop_oneof![
        Just(Between::Nothing),
        Just(Between::CutThrough),
        Just(Between::StoreAndForward)
    ]
}

fn preset() -> impl Strategy<Value = UsbPreset> {
    prop_oneof![
        4 => Just(UsbPreset::Thesis),
        2 => Just(UsbPreset::Earliest),
        1 => Just(UsbPreset::LowLatency),
        1 => Just(UsbPreset::FullSpeed),
    ]
}

/// Longest jitter of completions and writes together for which the usual time-outs leave room: 1 ms less a round trip of 5 microframes and its
/// turnaround directly, 2 ms less 9 microframes and the same through a bus controller.
const fn jitter_max(between: Between) -> SimDuration {
    match between {
        Between::Nothing => micros(1_000 - 5 * 125 - 100 - 25),
        Between::CutThrough | Between::StoreAndForward => micros(2_000 - 9 * 125 - 100 - 25),
    }
}

/// Jitters of completions and of writes that are so long at most, together.
fn jitters(most: SimDuration) -> impl Strategy<Value = (Timing, Timing)> {
    jitter(most).prop_flat_map(move |completions| {
        let writes = prop_oneof![
            Just(Timing::ZERO),
            jitter(most.checked_sub(completions.longest()).unwrap_or_default())
        ];
        (Just(completions), writes)
    })
}

prop_compose! {
    fn usb(between: Between)(
        preset in preset(),
        timer in prop_oneof![Just(0_u64), 0..4_000_u64],
        turnaround in 0..100_u64,
        jitters in jitters(jitter_max(between)),
        frame_offset in 0..1_000_000_u64,
        frame_rate_ppb in -100_000..100_000_i64,
    ) -> Setting {
        let (jitter, write_jitter) = jitters;
        Setting {
            between,
            preset,
            latency_timer: micros(timer),
            turnaround: micros(turnaround),
            jitter,
            write_jitter,
            frame_offset: SimDuration::from_nanos(frame_offset),
            frame_rate_ppb,
            rates_ppb: [0; 4],
            phases: [SimDuration::ZERO; 4],
            following: Following::Smooth,
            free_running: false,
            period: millis(2),
            compute: Timing::ZERO,
            troubles: Vec::new(),
            seed: 0,
            opened: SimTime::ZERO,
        }
    }
}

/// Shortest and longest control period.
const PERIODS_MS: std::ops::RangeInclusive<u64> = 2..=20;

/// Any bus whose cycles fit into their period, with those faults.
pub fn any_setting(kinds: Kinds) -> impl Strategy<Value = Setting> {
    between().prop_flat_map(move |between| setting_of(kinds, between))
}

fn setting_of(kinds: Kinds, between: Between) -> impl Strategy<Value = Setting> {
    let parts = (
        usb(between),
        uniform4(-2_000_000..2_000_000_i64),
        uniform4(0..1_000_000_u64),
        prop_oneof![Just(Following::Smooth), Just(Following::Plain)],
        prop_oneof![Just(0_u64), 0..19_u64],
        jitter(micros(850)),
        troubles(kinds, between),
        any::<u32>(),
    );
    let built = parts.prop_map(
        |(usb, rates_ppb, phases, following, longer, compute, troubles, seed)| {
            let busy = usb.transfer_max() + compute.longest() + GRID;
            let least = busy.as_nanos().div_ceil(1_000_000).max(2);
            let room = PERIODS_MS.end().saturating_sub(least);
            Setting {
                period: millis(least + longer.min(room)),
                rates_ppb,
                phases: phases.map(SimDuration::from_nanos),
                following,
                compute,
                troubles,
                seed: u64::from(seed),
                ..usb
            }
        },
    );
    built.prop_filter("its cycles do not fit into any period", |setting| {
        PERIODS_MS.contains(&(setting.period.as_nanos() / 1_000_000))
    })
}
