//! Arbitrary bytes at arbitrary paces, in any order, from both sides: nobody panics, and nobody waits for ever.

mod support;

use proptest::collection::vec;
use proptest::prelude::*;
use support::{frame, host, micros, slave};
use twinrig_kernel::SimTime;
use twinrig_sbcp::{
    Controller, ControllerConfig, Master, MasterConfig, Packet, Parser, Passing, Topology,
};
use twinrig_wire::{Arrivals, Piece};

/// A pause \[µs\], a spacing \[µs\], from the host or from the boards, and the bytes: noise, or a request.
type Burst = (u64, u64, bool, Vec<u8>);

fn burst() -> impl Strategy<Value = Burst> {
    let noise = vec(prop_oneof![any::<u8>(), Just(0xFF), 0..8_u8], 0..60);
    let request = (0..4_usize, 0..11_usize).prop_map(|(which, cut)| {
        let mut bytes = Vec::new();
        frame()[which].emit(&mut bytes);
        bytes.truncate(cut);
        bytes
    });
    let bytes = prop_oneof![noise, request];
    (0..60_u64, 0..30_u64, any::<bool>(), bytes)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn nobody_panics_and_everybody_comes_to_an_end(
        bursts in vec(burst(), 0..20),
        stored in any::<bool>(),
        direct in any::<bool>(),
    ) {
        let passing = if stored { Passing::StoreAndForward } else { Passing::CutThrough };
        let config = ControllerConfig { passing, ..ControllerConfig::default() };
        let mut controller = Controller::new(config).unwrap();
        let topology = if direct { Topology::Direct } else { Topology::Controller };
        let mut master = Master::new(MasterConfig::new(topology));
        let (mut slave, mut now, mut said) = (slave(1), SimTime::ZERO, Vec::new());
        for (pause, spacing, link, bytes) in &bursts {
            let piece = Piece { first: now + micros(*pause), spacing: micros(*spacing), bytes, framing_error: false };
            now = now.max(piece.last());
            if controller.poll_timeout().is_some_and(|due| due < now) {
                controller.handle_timeout(now);
            }
            slave.receive(piece);
            while slave.poll_event().is_some() {}
            slave.poll_transmit(&mut said);
            if *link {
                controller.handle_link(now, piece);
            } else {
                controller.handle_bus(now, piece);
            }
            let _ = master.cycle(host(now), &frame());
            master.poll_transmit(&mut said);
            master.handle_bytes(host(now), bytes);
            master.handle_timeout(host(now));
        }
        let mut wakes = 0;
        while let Some(wake) = [controller.poll_timeout(), controller.bus_start()].into_iter().flatten().min() {
            now = now.max(wake);
            controller.handle_timeout(now);
            while controller.poll_bus(now, &mut |_| {}) {}
            wakes += 1;
            prop_assert!(wakes < 1_000, "the controller waits for ever");
        }
        for _ in 0..5 {
            if let Some(due) = master.poll_timeout() {
                master.handle_timeout(due);
            }
            master.poll_transmit(&mut said);
        }
        prop_assert!(!master.is_busy());
    }

    #[test]
    fn what_the_controller_says_for_silent_boards_is_one_error_packet_for_each_request(
        cuts in vec(0..11_usize, 1..5),
    ) {
        // Whole requests and broken ones, with a pause behind each.
        let mut controller = Controller::new(ControllerConfig::default()).unwrap();
        let mut now = SimTime::ZERO;
        for (which, cut) in cuts.iter().enumerate() {
            now += micros(500);
            let mut bytes = Vec::new();
            frame()[which].emit(&mut bytes);
            bytes.truncate(*cut);
            if cut > &0 {
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
        // It takes four bytes to know whom an error packet is for.
        prop_assert_eq!(packets, cuts.iter().filter(|cut| **cut >= 4).count());
        prop_assert_eq!(parser.skipped(), 0);
    }
}
