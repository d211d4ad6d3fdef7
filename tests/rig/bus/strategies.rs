//! Proptest strategies of bus scenarios and faults.

use proptest::array::uniform4;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::Following;
use twinrig_runtime::Timing;
use twinrig_wire::{FaultKind, UsbPreset};

use crate::bus::bus_scenario::{
    BusScenario, FAULT_MAX, TimedFault, Topology, jitter, micros, millis,
};
use crate::bus::harness::GRID;
use crate::bus::probe_plant::LEGS;

/// Set of fault kinds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKinds {
    /// No faults.
    None,
    /// All kinds, at all places.
    All,
    /// Loss of whole bursts only: received bytes are those sent, at the time they were sent. The
    /// bus itself is excluded with a bus controller, which would miss an answer and then transmit
    /// concurrently with it.
    Losses,
    /// As `Losses`, at one place between host and boards: the bus, or the link to the bus
    /// controller.
    LossesAtOnePlace,
}

const BUS: &str = "wire/sbcp";
const LINK: &str = "wire/sbcp/link";

fn stub() -> impl Strategy<Value = String> {
    (0..4_usize).prop_map(|leg| format!("wire/sbcp/{}", LEGS[leg]))
}

fn any_place(kinds: FaultKinds, topology: Topology) -> BoxedStrategy<String> {
    let main_place = match topology {
        Topology::Direct => BUS,
        Topology::CutThrough | Topology::StoreAndForward => LINK,
    };
    match kinds {
        FaultKinds::None | FaultKinds::LossesAtOnePlace => Just(main_place.to_owned()).boxed(),
        FaultKinds::Losses => prop_oneof![Just(main_place.to_owned()), stub()].boxed(),
        FaultKinds::All => prop_oneof![Just(BUS.to_owned()), Just(LINK.to_owned()), stub()].boxed(),
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

/// Up to six faults that begin within 200 ms after the boards are ready and last up to 100 ms each.
fn timed_faults(kinds: FaultKinds, topology: Topology) -> BoxedStrategy<Vec<TimedFault>> {
    let kind = match kinds {
        FaultKinds::None => return Just(Vec::new()).boxed(),
        FaultKinds::All => any_kind().boxed(),
        FaultKinds::Losses | FaultKinds::LossesAtOnePlace => (0.0..1.0_f64)
            .prop_map(|probability| FaultKind::Drop { probability })
            .boxed(),
    };
    let on = any_place(kinds, topology);
    let lasts = 1..=FAULT_MAX.as_nanos() / 1_000;
    let timed_fault =
        (0..200_000_u64, on, kind, lasts).prop_map(|(after, on, kind, lasts)| TimedFault {
            after: micros(after),
            on,
            kind,
            lasts: micros(lasts),
        });
    vec(timed_fault, 0..=6).boxed()
}

fn topology() -> impl Strategy<Value = Topology> {
    prop_oneof![
        Just(Topology::Direct),
        Just(Topology::CutThrough),
        Just(Topology::StoreAndForward)
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

/// Maximum sum of the jitters of completions and writes for which the default time-outs suffice: 1
/// ms less a round trip of 5 microframes and its turnaround without a bus controller, 2 ms less 9
/// microframes and the same with one.
const fn jitter_max(topology: Topology) -> SimDuration {
    match topology {
        Topology::Direct => micros(1_000 - 5 * 125 - 100 - 25),
        Topology::CutThrough | Topology::StoreAndForward => micros(2_000 - 9 * 125 - 100 - 25),
    }
}

/// Jitters of completions and writes whose sum is at most `max`.
fn jitters(max: SimDuration) -> impl Strategy<Value = (Timing, Timing)> {
    jitter(max).prop_flat_map(move |completions| {
        let writes = prop_oneof![
            Just(Timing::ZERO),
            jitter(max.checked_sub(completions.longest()).unwrap_or_default())
        ];
        (Just(completions), writes)
    })
}

prop_compose! {
    fn usb(topology: Topology)(
        preset in preset(),
        timer in prop_oneof![Just(0_u64), 0..4_000_u64],
        turnaround in 0..100_u64,
        jitters in jitters(jitter_max(topology)),
        frame_offset in 0..1_000_000_u64,
        frame_rate_ppb in -100_000..100_000_i64,
    ) -> BusScenario {
        let (jitter, write_jitter) = jitters;
        BusScenario {
            topology,
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
            timed_faults: Vec::new(),
            seed: 0,
            opened: SimTime::ZERO,
        }
    }
}

/// Range of control periods \[ms\].
const PERIODS_MS: std::ops::RangeInclusive<u64> = 2..=20;

/// Bus scenarios whose cycles fit into their period, with faults of the given kinds.
pub fn any_scenario(kinds: FaultKinds) -> impl Strategy<Value = BusScenario> {
    topology().prop_flat_map(move |topology| scenario_with(kinds, topology))
}

fn scenario_with(kinds: FaultKinds, topology: Topology) -> impl Strategy<Value = BusScenario> {
    let parts = (
        usb(topology),
        uniform4(-2_000_000..2_000_000_i64),
        uniform4(0..1_000_000_u64),
        prop_oneof![Just(Following::Smooth), Just(Following::Plain)],
        prop_oneof![Just(0_u64), 0..19_u64],
        jitter(micros(850)),
        timed_faults(kinds, topology),
        any::<u32>(),
    );
    let built = parts.prop_map(
        |(usb, rates_ppb, phases, following, excess, compute, timed_faults, seed)| {
            let busy = usb.transfer_max() + compute.longest() + GRID;
            let period_min = busy.as_nanos().div_ceil(1_000_000).max(2);
            let excess_max = PERIODS_MS.end().saturating_sub(period_min);
            BusScenario {
                period: millis(period_min + excess.min(excess_max)),
                rates_ppb,
                phases: phases.map(SimDuration::from_nanos),
                following,
                compute,
                timed_faults,
                seed: u64::from(seed),
                ..usb
            }
        },
    );
    built.prop_filter("cycles fit into a period", |scenario| {
        PERIODS_MS.contains(&(scenario.period.as_nanos() / 1_000_000))
    })
}
