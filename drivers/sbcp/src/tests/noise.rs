//! Arbitrary bytes at arbitrary paces, in any order, from both sides, cause no panic and no endless
//! wait.

use super::support::{frame, host, micros, slave};
use proptest::collection::vec;
use proptest::prelude::*;
use twinrig_kernel::SimTime;
use twinrig_sbcp::{
    Controller, ControllerConfig, ForwardingMode, Master, MasterConfig, Packet, Parser, Topology,
};
use twinrig_wire::{Arrivals, Piece};

/// Pause \[µs\], spacing \[µs\], whether from the host (else from the boards), and the bytes:
/// noise, or a request.
type Burst = (u64, u64, bool, Vec<u8>);

fn burst() -> impl Strategy<Value = Burst> {
    let noise = vec(prop_oneof![any::<u8>(), Just(0xFF), 0..8_u8], 0..60);
    let request = (0..4_usize, 0..11_usize).prop_map(|(which, length)| {
        let mut bytes = Vec::new();
        frame()[which].emit(&mut bytes);
        bytes.truncate(length);
        bytes
    });
    let bytes = prop_oneof![noise, request];
    (0..60_u64, 0..30_u64, any::<bool>(), bytes)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn arbitrary_bytes_cause_no_panic_and_every_wait_ends(
        bursts in vec(burst(), 0..20),
        stored in any::<bool>(),
        direct in any::<bool>(),
    ) {
        let passing = if stored { ForwardingMode::StoreAndForward } else { ForwardingMode::CutThrough };
        let config = ControllerConfig { passing, ..ControllerConfig::default() };
        let mut controller = Controller::new(config).unwrap();
        let topology = if direct { Topology::Direct } else { Topology::Controller };
        let mut master = Master::new(MasterConfig::new(topology));
        let (mut slave, mut now, mut tx) = (slave(1), SimTime::ZERO, Vec::new());
        for (pause, spacing, link, bytes) in &bursts {
            let piece = Piece { first: now + micros(*pause), spacing: micros(*spacing), bytes, framing_error: false };
            now = now.max(piece.last());
            if controller.poll_timeout().is_some_and(|due| due < now) {
                controller.handle_timeout(now);
            }
            slave.receive(piece);
            while slave.poll_event().is_some() {}
            slave.poll_transmit(&mut tx);
            if *link {
                controller.handle_link(now, piece);
            } else {
                controller.handle_bus(now, piece);
            }
            let _ = master.cycle(host(now), &frame());
            master.poll_transmit(&mut tx);
            master.handle_bytes(host(now), bytes);
            master.handle_timeout(host(now));
        }
        let mut wakes = 0;
        while let Some(wake) = [controller.poll_timeout(), controller.bus_start()].into_iter().flatten().min() {
            now = now.max(wake);
            controller.handle_timeout(now);
            while controller.poll_bus(now, &mut |_| {}) {}
            wakes += 1;
            prop_assert!(wakes < 1_000, "endless wait of the controller");
        }
        for _ in 0..5 {
            if let Some(due) = master.poll_timeout() {
                master.handle_timeout(due);
            }
            master.poll_transmit(&mut tx);
        }
        prop_assert!(!master.is_busy());
    }

    #[test]
    fn controller_sends_one_error_packet_per_request_to_silent_boards(
        lengths in vec(0..11_usize, 1..5),
    ) {
        // Complete and truncated requests with pauses between them.
        let mut controller = Controller::new(ControllerConfig::default()).unwrap();
        let mut now = SimTime::ZERO;
        for (which, length) in lengths.iter().enumerate() {
            now += micros(500);
            let mut bytes = Vec::new();
            frame()[which].emit(&mut bytes);
            bytes.truncate(*length);
            if length > &0 {
                controller.handle_link(now, Piece { first: now, spacing: micros(3), bytes: &bytes, framing_error: false });
            }
            for _ in 0..3 {
                if let Some(due) = controller.poll_timeout() {
                    controller.handle_timeout(due);
                }
                while controller.poll_bus(now + micros(400), &mut |_| {}) {}
            }
        }
        let mut arrivals = Arrivals::default();
        controller.poll_link(&mut arrivals);
        let (mut parser, mut rest) = (Parser::default(), arrivals.bytes());
        let mut packets = 0;
        while let Some(packet) = parser.next(&mut rest) {
            prop_assert!(Packet::new(packet.bytes()).is_ok());
            packets += 1;
        }
        // The address of an error packet is known from four bytes on.
        prop_assert_eq!(packets, lengths.iter().filter(|length| **length >= 4).count());
        prop_assert_eq!(parser.skipped(), 0);
    }
}
