//! Decoder of Telnet, and both ends of RFC 2217, under arbitrary bytes in arbitrary pieces: no
//! panic, the same events in all divisions, no data created, and bounded answers.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_wire::rfc2217::{
    Rfc2217Client, Rfc2217Server, SUBNEGOTIATION_MAX, TelnetDecoder, TelnetEvent, push_data,
    push_negotiation, push_subnegotiation,
};

/// The events of a stream in pieces of this length, encoded anew.
fn recoded(stream: &[u8], length: usize) -> Vec<u8> {
    let (mut decoder, mut bytes) = (TelnetDecoder::default(), Vec::new());
    for mut piece in stream.chunks(length) {
        while let Some(event) = decoder.next(&mut piece) {
            match event {
                TelnetEvent::Data(data) => push_data(data, &mut bytes),
                TelnetEvent::Negotiation(verb, option) => {
                    push_negotiation(verb, option, &mut bytes);
                }
                TelnetEvent::Subnegotiation(option, parameters) => {
                    assert!(parameters.len() < SUBNEGOTIATION_MAX);
                    push_subnegotiation(option, parameters, &mut bytes);
                }
            }
        }
    }
    bytes
}

fuzz_target!(|data: &[u8]| {
    let Some((&length, stream)) = data.split_first() else {
        return;
    };
    let length = usize::from(length).max(1);
    let whole = recoded(stream, usize::MAX);
    assert_eq!(recoded(stream, length), whole);
    assert_eq!(recoded(&whole, length), whole);
    let (mut reply, mut received) = (Vec::new(), Vec::new());
    let mut client = Rfc2217Client::new(115_200, &mut reply);
    for piece in stream.chunks(length) {
        client.handle_bytes(piece, &mut received, &mut reply);
    }
    let mut server = Rfc2217Server::new(115_200, &mut reply);
    for piece in stream.chunks(length) {
        server.handle_bytes(piece, &mut received, &mut reply);
    }
    assert!(received.len() <= 2 * stream.len());
    // Both openings, settings and state, and the longest answers to the shortest requests.
    assert!(reply.len() <= 100 + 4 * stream.len());
});
