//! Free-running cycles behind a USB serial converter, compared with the rates of the thesis
//! (section 5.3.2).

use std::ops::Range;

use super::support::{frame, micros, slave_with};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, PlantFault, TaskError, Wire};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    BYTE_TIME, ControlledBus, ControllerConfig, ForwardingMode, Master, MasterConfig, Slave,
    SlaveConfig, Topology,
};
use twinrig_wire::{Node, Piece, Rs485, UsbSerial, UsbTiming};

struct NoPlant;

impl PlantAccess for NoPlant {
    fn sample(&mut self, _: Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&[])
    }

    fn actuate(&mut self, _: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut [])
    }
}

struct Board(Slave);

impl Part for Board {
    fn save(&self) -> Snapshot {
        Snapshot::of(&self.0)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.0 = snapshot.read()?;
        Ok(())
    }
}

impl Node for Board {
    fn name(&self) -> &'static str {
        "board"
    }

    fn receive(&mut self, piece: Piece<'_>) {
        self.0.receive(piece);
    }

    fn next_wake(&self) -> Option<SimTime> {
        None
    }

    fn advance(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while self.0.poll_event().is_some() {}
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.0.poll_transmit(bytes)
    }
}

fn bus(reaction: SimDuration) -> Rs485 {
    let nodes = (1..=4).map(|id| {
        let config = SlaveConfig {
            low_latency_reaction: reaction,
            ..SlaveConfig::new(CLASS_MOTORDRIVER)
        };
        Box::new(Board(slave_with(id, config))) as Box<dyn Node>
    });
    Rs485::new("bus", BYTE_TIME, micros(1), nodes.collect()).unwrap()
}

/// Returns the durations of consecutive cycles \[µs\], each begun at the end of the previous one.
fn cycles(wire: &mut dyn Wire, topology: Topology) -> Vec<u64> {
    let mut master = Master::new(MasterConfig::new(topology));
    let mut now = SimTime::ZERO;
    let mut start = now;
    let mut lengths = Vec::new();
    let mut bytes = Vec::new();
    while lengths.len() < 20 {
        if !master.is_busy() {
            start = now;
            master.cycle(super::support::host(now), &frame()).unwrap();
        }
        bytes.clear();
        if master.poll_transmit(&mut bytes) {
            wire.advance(now, &mut NoPlant).unwrap();
            wire.send(now, &bytes);
            continue;
        }
        let due = master
            .poll_timeout()
            .map(|at| SimTime::from_nanos(at.as_nanos()));
        now = now.max(wire.next_wake().into_iter().chain(due).min().unwrap());
        wire.advance(now, &mut NoPlant).unwrap();
        wire.receive(&mut bytes);
        master.handle_bytes(super::support::host(now), &bytes);
        if due.is_some_and(|at| at <= now) {
            master.handle_timeout(super::support::host(now));
        }
        if !master.is_busy() {
            assert!(
                master.outcomes().iter().all(Result::is_ok),
                "{:?}",
                master.outcomes()
            );
            lengths.push((now - start).as_nanos() / 1_000);
        }
    }
    // The start of the first cycle is not aligned with a microframe.
    lengths.split_off(1)
}

fn controlled(config: ControllerConfig, reaction: u64) -> Vec<u64> {
    let line = ControlledBus::new("bus", config, bus(micros(reaction))).unwrap();
    let mut wire = UsbSerial::new("bus", UsbTiming::default(), BYTE_TIME, 1, line).unwrap();
    cycles(&mut wire, Topology::Controller)
}

#[test]
fn cycle_through_the_controller_is_eight_microframes() {
    let lengths = controlled(ControllerConfig::default(), 10);
    assert!(lengths.iter().all(|length| *length == 1000), "{lengths:?}");
}

#[test]
fn direct_cycle_is_twenty_microframes() {
    let mut wire =
        UsbSerial::new("bus", UsbTiming::default(), BYTE_TIME, 1, bus(micros(10))).unwrap();
    let lengths = cycles(&mut wire, Topology::Direct);
    assert!(lengths.iter().all(|length| *length == 2500), "{lengths:?}");
}

/// Whether a cycle takes one millisecond, rather than a microframe more.
fn takes_one_millisecond(config: ControllerConfig, reaction: u64) -> bool {
    let lengths = controlled(config, reaction);
    assert!(
        lengths.iter().all(|length| *length == lengths[0]),
        "{lengths:?}"
    );
    assert!([1000, 1125].contains(&lengths[0]), "{lengths:?}");
    lengths[0] == 1000
}

#[test]
fn store_and_forward_exceeds_one_millisecond() {
    let config = ControllerConfig {
        passing: ForwardingMode::StoreAndForward,
        ..ControllerConfig::default()
    };
    assert!(!takes_one_millisecond(config, 10));
}

#[test]
fn reaction_times_above_25_us_exceed_one_millisecond() {
    // A long time-out, so that no answer is lost.
    let config = ControllerConfig {
        timeout: micros(60),
        gap: SimDuration::ZERO,
        ..ControllerConfig::default()
    };
    let last = (10..40)
        .take_while(|reaction| takes_one_millisecond(config, *reaction))
        .last();
    assert_eq!(last, Some(25));
}

#[test]
fn gaps_above_20_us_exceed_one_millisecond() {
    let last = (0..40).take_while(|gap| {
        let config = ControllerConfig {
            gap: micros(*gap),
            ..ControllerConfig::default()
        };
        takes_one_millisecond(config, 10)
    });
    assert_eq!(last.last(), Some(20));
}
