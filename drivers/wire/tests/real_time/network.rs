//! Ports over a network, on loopback: clients of this crate and of pySerial at a served twin,
//! further clients, and such that flood, do not read or disappear. No assertion depends on the
//! speed of the machine.

#![cfg(target_os = "linux")]

use std::io::{Error, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::support::{BAUD, SCHEMES, Twin, listen, read};
use serde_json::json;
use twinrig_runtime::{Device, DeviceError};
use twinrig_testing::python;
use twinrig_wire::{NetworkAddress, PortServer, RemotePort};

const SOON: Duration = Duration::from_secs(5);

fn open(text: &str) -> Result<RemotePort, DeviceError> {
    RemotePort::open(&NetworkAddress::parse(text).unwrap()?, BAUD)
}

/// All bytes, some doubled.
fn all_bytes() -> Vec<u8> {
    (0..=255).chain([255, 255, 13, 10, 0]).collect()
}

#[test]
fn successive_clients_exchange_all_bytes() {
    for scheme in SCHEMES {
        let twin = Twin::serve(&[scheme]);
        for _ in 0..3 {
            let mut port = twin.open(0);
            for _ in 0..3 {
                port.write(&all_bytes()).unwrap();
                assert_eq!(read(&mut port, all_bytes().len()), all_bytes());
            }
        }
        assert_eq!(twin.stop().unread, 0);
    }
}

#[test]
fn further_client_is_disconnected_and_the_first_is_not() {
    for scheme in SCHEMES {
        let twin = Twin::serve(&[scheme]);
        let mut first = twin.open(0);
        let mut further = twin.connect(0);
        further.set_read_timeout(Some(SOON)).unwrap();
        let refused = further.read(&mut [0]);
        let is_late = |error: &Error| error.kind() == ErrorKind::WouldBlock;
        assert!(
            refused.as_ref().is_ok_and(|count| *count == 0)
                || refused.as_ref().is_err_and(|error| !is_late(error)),
            "{refused:?}"
        );
        if scheme == "rfc2217" {
            let refused = open(&twin.addresses[0].to_string()).unwrap_err();
            assert!(matches!(refused, DeviceError::Closed { .. }), "{refused}");
        }
        first.write(b"still here").unwrap();
        assert_eq!(read(&mut first, 10), b"still here");
        twin.stop();
    }
}

/// Waits for the echo of a new client, after the bytes that were on the wire.
fn is_served(address: &NetworkAddress) -> Result<(), DeviceError> {
    let mut port = RemotePort::open(address, BAUD)?;
    port.write(b"next")?;
    let mut received = Vec::new();
    while !received.ends_with(b"next") {
        port.read(SOON, &mut received)?;
    }
    Ok(())
}

#[test]
fn client_that_floods_and_does_not_read_is_throttled_and_harms_no_other() {
    for scheme in SCHEMES {
        let twin = Twin::serve(&[scheme, scheme]);
        let mut flooding = twin.connect(0);
        let mut other = twin.open(1);
        let stop = Arc::new(AtomicBool::new(false));
        let flag = stop.clone();
        let flood = thread::Builder::new().spawn(move || {
            let timeout = Some(Duration::from_millis(5));
            flooding.set_write_timeout(timeout).unwrap();
            // Two bytes of Telnet are one of data.
            let bytes = [255; 4096];
            while !flag.load(Ordering::SeqCst) {
                let _ = flooding.write(&bytes);
            }
        });
        // The wire of the twin fails if it is given more bytes than it has room for.
        while twin.unread() == 0 {
            other.write(&all_bytes()).unwrap();
            assert_eq!(read(&mut other, all_bytes().len()), all_bytes());
        }
        stop.store(true, Ordering::SeqCst);
        flood.unwrap().join().unwrap();
        // TCP may notice late that the flooding client is gone; others are refused until then.
        while let Err(error) = is_served(&twin.addresses[0]) {
            assert!(matches!(error, DeviceError::Closed { .. }), "{error}");
            thread::sleep(Duration::from_millis(1));
        }
        assert!(twin.stop().unread > 0);
    }
}

#[test]
fn client_that_reads_late_receives_all_accepted_writes_as_a_whole() {
    for scheme in SCHEMES {
        let mut server = listen(scheme);
        let mut client = connect(&mut server);
        let mut accepted = 0;
        let stuck = loop {
            assert!(accepted < 100 << 20, "more than the buffers of the system");
            // IACs, which must not be separated from their doubles.
            match server.write(&[255; 4099]) {
                Ok(()) => accepted += 4099,
                Err(error) => break error,
            }
        };
        assert!(matches!(stuck, DeviceError::Stuck { .. }), "{stuck}");
        client.set_read_timeout(Some(SOON)).unwrap();
        let (mut received, mut chunk) = (Vec::new(), vec![0; 1 << 16]);
        let doubled = if scheme == "tcp" { 1 } else { 2 };
        let opening = if scheme == "tcp" { 0 } else { 12 };
        while received.len() < opening + doubled * accepted {
            let count = client.read(&mut chunk).unwrap();
            received.extend_from_slice(&chunk[..count]);
            server.read(Duration::ZERO, &mut Vec::new()).unwrap();
        }
        server.write(b".").unwrap();
        received.push(0);
        client
            .read_exact(&mut received[opening + doubled * accepted..])
            .unwrap();
        assert!(
            received[opening..]
                .iter()
                .rev()
                .skip(1)
                .all(|byte| *byte == 255)
        );
        assert_eq!(received.last(), Some(&b'.'));
    }
}

/// Connects a client that the server has noticed.
fn connect(server: &mut PortServer) -> TcpStream {
    let client = TcpStream::connect(("127.0.0.1", server.address().port)).unwrap();
    while server.read(Duration::ZERO, &mut Vec::new()).is_err() {}
    client
}

#[test]
fn client_that_requests_without_reading_is_throttled() {
    let mut server = listen("rfc2217");
    let mut client = connect(&mut server);
    client.set_nonblocking(true).unwrap();
    // Requests for the signature: the answers are longer.
    let requests = [255, 250, 44, 0, 255, 240].repeat(1000);
    let (mut blocked, mut requested, mut data) = (0, 0, Vec::new());
    while blocked < 100 {
        blocked += 1;
        if let Ok(count) = client.write(&requests) {
            (blocked, requested) = (0, requested + count);
        }
        assert!(requested < 100 << 20, "no end of the answers");
        server.read(Duration::ZERO, &mut data).unwrap();
    }
    assert!(data.is_empty());
    drop(client);
    let ended = server.read(SOON, &mut data);
    assert!(
        matches!(ended, Err(DeviceError::HungUp { .. })),
        "{ended:?}"
    );
}

#[test]
fn last_bytes_of_an_aborted_connection_are_read_once() {
    let mut server = listen("tcp");
    let mut client = connect(&mut server);
    server.write(b"unread").unwrap();
    client.write_all(&[7; 10_000]).unwrap();
    // A connection with unread bytes is aborted where they have arrived.
    client.peek(&mut [0]).unwrap();
    drop(client);
    let is_hung_up = |error: &DeviceError| matches!(error, DeviceError::HungUp { .. });
    while server.write(b"late").is_ok() {
        thread::sleep(Duration::from_millis(1));
    }
    let mut received = Vec::new();
    server.read_up_to(4096, SOON, &mut received).unwrap();
    let ended = server.read(SOON, &mut received);
    assert!(ended.as_ref().is_err_and(is_hung_up), "{ended:?}");
    assert_eq!(received, [7; 4096]);
}

#[test]
fn client_that_follows_a_closed_one_is_served() {
    let mut server = listen("tcp");
    let mut first = connect(&mut server);
    first.write_all(b"first").unwrap();
    drop(first);
    let mut second = TcpStream::connect(("127.0.0.1", server.address().port)).unwrap();
    second.write_all(b"second").unwrap();
    let (mut received, mut hung_up) = (Vec::new(), 0);
    while received.len() < 11 {
        match server.read(SOON, &mut received) {
            Ok(()) => {}
            Err(DeviceError::HungUp { place }) => {
                assert_eq!(place, server.place());
                hung_up += 1;
                assert!(hung_up < 5000, "the second client is refused");
                thread::sleep(Duration::from_millis(1));
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(received, b"firstsecond");
    assert!(hung_up > 0);
    second.write_all(b".").unwrap();
    assert_eq!(read(&mut server, 1), b".");
    drop(second);
    let ended = server.read(SOON, &mut received);
    assert!(
        matches!(ended, Err(DeviceError::HungUp { .. })),
        "{ended:?}"
    );
    let ended = server.write(b"x");
    assert!(
        matches!(ended, Err(DeviceError::HungUp { .. })),
        "{ended:?}"
    );
}

#[test]
fn ended_server_and_absent_server_are_distinguished() {
    let twin = Twin::serve(&["rfc2217"]);
    let mut port = twin.open(0);
    let place = port.place().to_owned();
    twin.stop();
    let closed = Err(DeviceError::Closed {
        place: place.clone(),
    });
    assert_eq!(port.read(SOON, &mut Vec::new()), closed);
    let refused = DeviceError::ConnectionRefused {
        place: place.clone(),
    };
    assert_eq!(open(&place).unwrap_err(), refused);
    // A name that no name server is asked for: it has a part of more than 63 letters.
    let error = open(&format!("tcp://{}.invalid:1", "a".repeat(64))).unwrap_err();
    assert!(matches!(error, DeviceError::NoHost { .. }), "{error}");
}

#[test]
fn port_in_use_and_foreign_address_are_refused() {
    let first = listen("tcp");
    let error = PortServer::listen(first.address(), BAUD).unwrap_err();
    let place = first.place().to_owned();
    assert_eq!(error, DeviceError::Busy { place });
    // Reserved for documentation (RFC 5737).
    let foreign = NetworkAddress::parse_served("tcp://192.0.2.1:0").unwrap();
    let error = PortServer::listen(&foreign, BAUD).unwrap_err();
    assert!(
        error.to_string().contains("does not have that address"),
        "{error}"
    );
}

#[test]
fn refused_settings_are_named() {
    let twin = Twin::serve(&["rfc2217"]);
    let error = RemotePort::open(&twin.addresses[0], 115_200).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("at 1000000 bit/s, not at 115200 bit/s"),
        "{text}"
    );
    twin.stop();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = format!("rfc2217://{}", listener.local_addr().unwrap());
    let telnet = thread::Builder::new().spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        // A Telnet server refuses the option, and closes the connection.
        stream.write_all(&[255, 254, 44]).unwrap();
        let _ = stream.read(&mut [0; 100]);
    });
    let text = open(&place).unwrap_err().to_string();
    assert!(
        text.contains("it does not have the COM port control option"),
        "{text}"
    );
    telnet.unwrap().join().unwrap();
}

/// pySerial, unmodified, as a client of both transports.
#[test]
fn pyserial_exchanges_all_bytes_and_detects_another_baud_rate() {
    let Some(python) = python::python("serial") else {
        return;
    };
    let twin = Twin::serve(&SCHEMES);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pyserial.py");
    let urls = [
        twin.addresses[0].to_string().replace("tcp:", "socket:"),
        twin.addresses[1].to_string(),
    ];
    let words: Vec<&Path> = urls.iter().map(Path::new).collect();
    let input = json!({"bytes": all_bytes(), "baud": BAUD});
    let found = python::run(&python, &script, &words, &input);
    let echoes = vec![all_bytes(); 3];
    assert_eq!(found["echoes"], json!([echoes, echoes]));
    assert_eq!(
        found["lines"],
        json!({"cts": true, "dsr": true, "cd": true})
    );
    let refused = found["refused"].as_str().unwrap();
    assert!(refused.contains("baudrate"), "{refused}");
    assert_eq!(twin.stop().unread, 0);
}
