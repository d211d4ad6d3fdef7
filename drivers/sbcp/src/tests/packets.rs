//! Packets and their detection in a byte stream.

use proptest::collection::vec;
use proptest::prelude::*;
use twinrig_kernel::stream;
use twinrig_sbcp::codes::{BROADCAST, HEADER};
use twinrig_sbcp::{
    Address, ErrorCode, Instruction, PACKET_MAX, PAYLOAD_MAX, Packet, Parser, Request, Response,
    SbcpError,
};

fn request() -> impl Strategy<Value = Request> {
    let address = (0..HEADER, 0..HEADER);
    let payload = vec(any::<u8>(), 0..=PAYLOAD_MAX);
    (address, any::<u8>(), payload).prop_map(|((class, id), code, payload)| {
        let to = Address::new(class, id).unwrap();
        Request::new(to, Instruction(code), &payload).unwrap()
    })
}

fn bytes_of(request: &Request) -> Vec<u8> {
    let mut bytes = Vec::new();
    request.emit(&mut bytes);
    bytes
}

/// Returns all packets that a parser finds in `stream`, passed in pieces of these lengths,
/// cyclically.
fn found(stream: &[u8], pieces: &[usize]) -> Vec<Vec<u8>> {
    let mut parser = Parser::default();
    let mut packets = Vec::new();
    let mut rest = stream;
    let mut lengths = pieces.iter().cycle();
    while !rest.is_empty() {
        let count = (*lengths.next().unwrap()).clamp(1, rest.len());
        let (mut piece, behind) = rest.split_at(count);
        rest = behind;
        while let Some(packet) = parser.next(&mut piece) {
            packets.push(packet.bytes().to_vec());
        }
        assert!(piece.is_empty());
    }
    while let Some(packet) = parser.give_up() {
        packets.push(packet.bytes().to_vec());
    }
    let taken: usize = packets.iter().map(Vec::len).sum();
    assert_eq!(parser.skipped() + taken as u64, stream.len() as u64);
    packets
}

/// Random bytes with frequent headers.
fn noise() -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![3 => any::<u8>(), 1 => Just(HEADER), 1 => 0..8_u8];
    vec(byte, 0..200)
}

proptest! {
    #[test]
    fn emitted_packets_parse_to_the_same_value(request in request(), error in any::<u8>()) {
        let bytes = bytes_of(&request);
        prop_assert_eq!(bytes.len(), request.packet_len());
        let packet = Packet::new(&bytes).unwrap();
        prop_assert_eq!(Request::parse(&packet).unwrap(), request);
        let response = Response::new(request.to, ErrorCode(error), &request.payload);
        prop_assert_eq!(response.is_err(), request.to.is_broadcast());
        if let Ok(response) = response {
            let mut bytes = Vec::new();
            response.emit(&mut bytes);
            prop_assert_eq!(bytes.len(), response.packet_len());
            prop_assert_eq!(Response::parse(&Packet::new(&bytes).unwrap()).unwrap(), response);
        }
    }

    #[test]
    fn single_byte_change_is_always_detected(
        request in request(),
        at in any::<prop::sample::Index>(),
        change in 1..=255_u8,
    ) {
        let mut bytes = bytes_of(&request);
        let at = at.index(bytes.len());
        bytes[at] ^= change;
        prop_assert!(Packet::new(&bytes).is_err());
    }

    #[test]
    fn packets_found_in_noise_are_valid_and_independent_of_the_pieces(
        noise in noise(),
        pieces in vec(1..40_usize, 1..10),
    ) {
        let packets = found(&noise, &pieces);
        for packet in &packets {
            prop_assert!(Packet::new(packet).is_ok());
            let (found, sum) = (packet[packet.len() - 1], &packet[1..packet.len() - 1]);
            prop_assert_eq!(u64::from(found), sum.iter().map(|byte| u64::from(*byte)).sum::<u64>() % 256);
        }
        prop_assert_eq!(&found(&noise, &[1]), &packets);
        prop_assert_eq!(&found(&noise, &[1000]), &packets);
    }

    #[test]
    fn no_packet_is_lost_behind_garbage(
        requests in vec(request(), 1..5),
        garbage in vec(any::<u8>(), 0..80),
        pieces in vec(1..40_usize, 1..10),
    ) {
        let mut stream = garbage.clone();
        let clean: Vec<_> = requests.iter().map(bytes_of).collect();
        stream.extend(clean.concat());
        let packets = found(&stream, &pieces);
        // Excludes garbage that, with the following bytes, has a valid checksum by chance: 1 in 256
        // of its headers.
        let within = |packet: &Vec<u8>| {
            stream[..garbage.len()]
                .iter()
                .enumerate()
                .any(|(at, _)| stream[at..].starts_with(packet) && !clean.contains(packet))
        };
        prop_assume!(!packets.iter().any(within));
        prop_assert_eq!(packets, clean);
    }

    #[test]
    fn packet_is_found_within_the_maximum_length_behind_garbage(
        request in request(),
        garbage in vec(any::<u8>(), 0..80),
    ) {
        let mut stream = garbage;
        stream.extend(bytes_of(&request));
        let end = stream.len();
        // Followed by bytes that are no packet.
        stream.extend([0; PACKET_MAX - 1]);
        let mut parser = Parser::default();
        let mut late = None;
        for (at, byte) in stream.iter().enumerate() {
            let mut piece = std::slice::from_ref(byte);
            while let Some(packet) = parser.next(&mut piece) {
                if packet.bytes() == bytes_of(&request) {
                    late = Some((at + 1).saturating_sub(end));
                } else {
                    // A packet by chance: no property holds then.
                    return Ok(());
                }
            }
        }
        prop_assert!(late.is_some_and(|late| late < PACKET_MAX), "{:?}", late);
    }
}

#[test]
fn packet_bytes_are_in_the_order_of_the_thesis() {
    let to = Address::new(1, 3).unwrap();
    let request = Request::new(to, Instruction::SET, &[0x20, 0x90, 0xE0]).unwrap();
    let sum = (1 + 3 + 5 + 3 + 0x20 + 0x90 + 0xE0) % 256;
    let sum = u8::try_from(sum).unwrap();
    assert_eq!(
        bytes_of(&request),
        [0xFF, 1, 3, 5, 3, 0x20, 0x90, 0xE0, sum]
    );
}

#[test]
fn invalid_packets_are_refused() {
    assert!(matches!(
        Address::new(HEADER, 1),
        Err(SbcpError::Address { .. })
    ));
    assert!(matches!(
        Address::new(1, HEADER),
        Err(SbcpError::Address { .. })
    ));
    let all = Address::new(1, BROADCAST).unwrap();
    assert!(Response::new(all, ErrorCode::OK, &[]).is_err());
    let to = Address::new(1, 1).unwrap();
    assert_eq!(
        Request::new(to, Instruction::PING, &[0; PAYLOAD_MAX + 1]),
        Err(SbcpError::Payload { len: 27 })
    );
    for length in [0, 1, 29, 255] {
        let bytes = [HEADER, 1, 1, length, 1, 0];
        assert_eq!(Packet::new(&bytes), Err(SbcpError::Length { length }));
    }
    assert!(Packet::new(&[]).is_err());
}

/// Limit of the protocol: an additive checksum does not detect two flips of the same bit in
/// opposite directions.
#[test]
fn checksum_misses_one_response_in_1700_at_a_bit_error_rate_of_a_thousandth() {
    let from = Address::new(1, 2).unwrap();
    let mut numbers = stream(20, "bit errors");
    let mut accepted = 0_u32;
    let responses = 600_000_u32;
    let mut clean = Vec::new();
    let bits = 22 * 8;
    // The number of bits between errors is geometrically distributed.
    let scale = 1.0 / libm::log(1.0 - 1e-3);
    let mut gap = move || libm::log(1.0 - numbers.unit()) * scale;
    let mut next = gap();
    let mut payload = stream(20, "payload");
    for _ in 0..responses {
        let mut carried = [0; 16];
        carried[..8].copy_from_slice(&payload.bits().to_le_bytes());
        carried[8..].copy_from_slice(&payload.bits().to_le_bytes());
        clean.clear();
        Response::new(from, ErrorCode::OK, &carried)
            .unwrap()
            .emit(&mut clean);
        let mut received = clean.clone();
        while next < f64::from(bits) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to 175"
            )]
            let bit = next as usize;
            received[bit / 8] ^= 1 << (bit % 8);
            next += 1.0 + gap();
        }
        next -= f64::from(bits);
        let response = Packet::new(&received).and_then(|packet| Response::parse(&packet));
        if received != clean && response.is_ok_and(|response| response.from() == from) {
            accepted += 1;
        }
    }
    let one_in = f64::from(responses) / f64::from(accepted);
    println!("one response in {one_in} is accepted though it is wrong");
    assert!((1200.0..2400.0).contains(&one_in), "one in {one_in}");
}
