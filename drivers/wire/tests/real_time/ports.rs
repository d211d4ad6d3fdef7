//! Serial ports without hardware: both ends of a PTY.

use std::path::{Path, PathBuf};
use std::time::Duration;

use twinrig_runtime::{Device, DeviceError};
use twinrig_wire::{Pty, SerialPort, ports};

const BAUD: u32 = 3_333_333;
const SOON: Duration = Duration::from_secs(5);

/// Reads until `count` bytes are there; fails if no more bytes arrive.
fn read(device: &mut dyn Device, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while bytes.len() < count {
        let before = bytes.len();
        device.read(SOON, &mut bytes).unwrap();
        assert!(
            bytes.len() > before,
            "{} of {count} bytes received",
            bytes.len()
        );
    }
    bytes
}

fn temporary(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("twinrig-{}-{name}", std::process::id()))
}

#[test]
fn bytes_pass_unchanged_in_both_directions() {
    let mut twin = Pty::open().unwrap();
    let mut robot = SerialPort::open(twin.path(), BAUD).unwrap();
    let all: Vec<u8> = (0..=255).collect();
    robot.write(&all).unwrap();
    assert_eq!(read(&mut twin, all.len()), all);
    twin.write(&all).unwrap();
    assert_eq!(read(&mut robot, all.len()), all);
    let mut rest = Vec::new();
    twin.read(Duration::from_millis(5), &mut rest).unwrap();
    assert!(rest.is_empty(), "the terminal echoes: {rest:?}");
}

#[test]
fn bytes_pass_unchanged_without_terminal_settings() {
    let mut twin = Pty::open().unwrap();
    let mut plain = std::fs::OpenOptions::new()
        .read(true)
        .write(true)
        .open(twin.path())
        .unwrap();
    std::io::Write::write_all(&mut plain, b"\x03\r\n\x04").unwrap();
    assert_eq!(read(&mut twin, 4), b"\x03\r\n\x04");
}

#[test]
fn second_open_is_refused_until_the_first_is_closed() {
    let twin = Pty::open().unwrap();
    let first = SerialPort::open(twin.path(), BAUD).unwrap();
    let second = SerialPort::open(twin.path(), BAUD).err().unwrap();
    let place = twin.place().to_string();
    assert_eq!(second, DeviceError::Busy { place });
    drop(first);
    SerialPort::open(twin.path(), BAUD).unwrap();
}

#[test]
fn absent_port_is_missing_and_non_terminal_is_an_error() {
    let none = Path::new("/dev/there-is-no-such-port");
    let error = SerialPort::open(none, BAUD).err().unwrap();
    assert!(matches!(error, DeviceError::Missing { .. }), "{error}");
    assert!(
        error
            .to_string()
            .starts_with("/dev/there-is-no-such-port: ")
    );
    let error = SerialPort::open(Path::new("/dev/null"), BAUD)
        .err()
        .unwrap();
    assert!(matches!(error, DeviceError::Other { .. }), "{error}");
}

#[test]
fn port_with_closed_peer_is_gone_without_blocking() {
    let twin = Pty::open().unwrap();
    let mut robot = SerialPort::open(twin.path(), BAUD).unwrap();
    let place = robot.place().to_string();
    drop(twin);
    let mut bytes = Vec::new();
    let gone = Err(DeviceError::Gone { place });
    assert_eq!(robot.read(SOON, &mut bytes), gone);
    assert_eq!(robot.write(b"hello"), gone);
}

#[test]
fn twin_detects_hang_up_and_reconnection_of_the_host() {
    let mut twin = Pty::open().unwrap();
    let mut bytes = Vec::new();
    for _ in 0..3 {
        let hung_up = Err(DeviceError::HungUp {
            place: twin.place().into(),
        });
        assert_eq!(twin.read(SOON, &mut bytes), hung_up);
        let mut robot = SerialPort::open(twin.path(), BAUD).unwrap();
        robot.write(b"here").unwrap();
        assert_eq!(read(&mut twin, 4), b"here");
    }
}

#[test]
fn write_does_not_block_if_the_host_does_not_read() {
    let mut twin = Pty::open().unwrap();
    let _robot = SerialPort::open(twin.path(), BAUD).unwrap();
    let error = (0..10_000).find_map(|_| twin.write(&[0; 4096]).err());
    assert!(
        matches!(error, Some(DeviceError::Stuck { .. })),
        "{error:?}"
    );
}

#[test]
fn write_does_not_block_if_the_host_closed_without_reading() {
    let mut twin = Pty::open().unwrap();
    let host = SerialPort::open(twin.path(), BAUD).unwrap();
    while twin.write(&[7; 1000]).is_ok() {}
    drop(host);
    // Closing may free some room in the buffer first.
    let error = (0..10_000).find_map(|_| twin.write(&[7; 1000]).err());
    assert!(
        matches!(error, Some(DeviceError::HungUp { .. })),
        "{error:?}"
    );
}

#[test]
fn link_exists_while_the_pty_does_and_replaces_stale_links_only() {
    let link = temporary("link");
    // Stale link of a process that was killed.
    std::os::unix::fs::symlink("/dev/pts/987654321", &link).unwrap();
    let first = Pty::open().unwrap().linked(&link).unwrap();
    assert_eq!(
        (first.path(), first.place()),
        (&*link, link.to_str().unwrap())
    );
    SerialPort::open(&link, BAUD).unwrap();
    drop(first);
    assert!(link.symlink_metadata().is_err(), "the link still exists");

    std::fs::write(&link, "precious").unwrap();
    let error = Pty::open().unwrap().linked(&link).unwrap_err();
    assert!(matches!(error, DeviceError::Other { .. }), "{error}");
    assert_eq!(std::fs::read_to_string(&link).unwrap(), "precious");
    std::fs::remove_file(&link).unwrap();
}

#[test]
fn link_in_use_is_refused_by_any_path_and_stays() {
    let link = temporary("taken");
    let first = Pty::open().unwrap().linked(&link).unwrap();
    let folder = link.parent().unwrap();
    let roundabout = folder.join(".").join(link.file_name().unwrap());
    for name in [&link, &roundabout] {
        let error = Pty::open().unwrap().linked(name).unwrap_err();
        assert!(
            error.to_string().contains("another twin is served"),
            "{error}"
        );
        SerialPort::open(&link, BAUD).unwrap();
    }
    drop(first);
    let second = Pty::open().unwrap().linked(&roundabout).unwrap();
    SerialPort::open(&link, BAUD).unwrap();
    drop(second);
}

#[test]
fn pty_has_no_latency_timer_and_ports_are_sorted() {
    let twin = Pty::open().unwrap();
    let robot = SerialPort::open(twin.path(), BAUD).unwrap();
    assert_eq!((robot.latency_timer(), robot.advice()), (None, None));
    let list = ports().unwrap();
    assert!(list.is_sorted(), "{list:?}");
}
