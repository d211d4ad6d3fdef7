//! Framing of a stream of bytes: properties of the messages of a protocol, and bursts of damaged
//! frames.

use std::fmt::Debug;

use twinrig_kernel::{HostTime, Stream, stream};
use twinrig_runtime::Driver;
use twinrig_wire::{FrameMatch, FramedMessage, Framer};

/// Returns the frames of a stream that is received in these pieces, and the number of bytes outside
/// frames.
pub fn frames<M: FramedMessage>(pieces: &[&[u8]]) -> (Vec<Vec<u8>>, u64) {
    let mut framer = Framer::new(M::match_frame);
    let mut frames = Vec::new();
    for piece in pieces {
        framer.push(piece);
        while let Some(frame) = framer.next_frame() {
            frames.push(frame.to_vec());
        }
    }
    (frames, framer.skipped())
}

/// Checks that the frames of a stream do not depend on its division into pieces, and that a message
/// decoded from one of them has the same frame.
pub fn check_arbitrary_bytes<M: FramedMessage>(bytes: &[u8], mut cuts: Vec<usize>) {
    for cut in &mut cuts {
        *cut = (*cut).min(bytes.len());
    }
    cuts.extend([0, bytes.len()]);
    cuts.sort_unstable();
    let pieces: Vec<&[u8]> = cuts.windows(2).map(|cut| &bytes[cut[0]..cut[1]]).collect();
    let found = frames::<M>(&pieces);
    assert_eq!(found, frames::<M>(&[bytes]));
    for frame in found.0 {
        if let Ok(message) = M::decode(&frame) {
            assert_eq!(message.to_frame(), frame);
        }
    }
}

/// Checks a message in a stream: its frame is decoded as the same message; no part of it is taken
/// for a frame, and the number of missing bytes is not too large; it is found after garbage.
pub fn check_message<M: FramedMessage + Debug + PartialEq>(message: &M, garbage: &[u8]) {
    let frame = message.to_frame();
    assert_eq!(M::decode(&frame).as_ref(), Ok(message));
    for kept in 0..frame.len() {
        let FrameMatch::Missing(count) = M::match_frame(&frame[..kept]) else {
            panic!("{kept} bytes of {frame:02x?}");
        };
        assert!(
            count >= 1 && kept + count <= frame.len(),
            "{kept} bytes of {frame:02x?}"
        );
    }
    // Enough bytes to complete a frame that seems to begin in the garbage.
    let bytes = [garbage, &frame.repeat(10)].concat();
    assert!(frames::<M>(&[&bytes]).0.contains(&frame));
}

/// Checks that the checksum detects a wrong bit in the frame of a message: the `n`-th, modulo the
/// number of bits.
pub fn check_wrong_bit<M: FramedMessage>(message: &M, n: usize) {
    let mut frame = message.to_frame();
    let bit = n % (8 * frame.len());
    frame[bit / 8] ^= 1 << (bit % 8);
    let undetected = FrameMatch::Frame(frame.len());
    assert_ne!(M::match_frame(&frame), undetected, "{frame:02x?}");
}

/// Bursts of bytes, drawn by a named stream: noise, or frames with altered, lost or inserted bytes.
pub struct BurstGenerator {
    random: Stream,
    frames: Vec<Vec<u8>>,
    burst: Vec<u8>,
}

impl BurstGenerator {
    /// Creates a generator of these frames.
    pub fn new(name: &str, frames: Vec<Vec<u8>>) -> Self {
        let (random, burst) = (stream(1, name), Vec::new());
        Self {
            random,
            frames,
            burst,
        }
    }

    /// Returns a random number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        let drawn = self.random.between(0, end as u64 - 1);
        usize::try_from(drawn).unwrap()
    }

    /// Returns the next burst.
    pub fn next_burst(&mut self) -> &[u8] {
        self.burst.clear();
        if self.below(4) == 0 {
            for _ in 0..=self.below(60) {
                let [byte, ..] = self.random.bits().to_le_bytes();
                self.burst.push(byte);
            }
            return &self.burst;
        }
        for _ in 0..=self.below(3) {
            let which = self.below(self.frames.len());
            self.burst.extend_from_slice(&self.frames[which]);
        }
        for _ in 0..self.below(4) {
            let (at, end) = (self.below(self.burst.len()), self.burst.len());
            match self.below(4) {
                0 => self.burst[at] ^= 1 << self.below(8),
                1 => self.burst[at] = self.random.bits().to_le_bytes()[0],
                2 if end > 1 => drop(self.burst.remove(at)),
                // Insertion of a header byte.
                _ => self.burst.insert(at, self.frames[0][0]),
            }
        }
        &self.burst
    }
}

/// Returns whether a frame ends with its CRC-16/IBM-3740, computed bytewise here, low byte first.
pub fn has_crc16(frame: &[u8]) -> bool {
    let (content, found) = frame.split_at(frame.len() - 2);
    let crc = content.iter().fold(0xFFFF, |crc: u16, byte| {
        let mut x = (crc >> 8) as u8 ^ byte;
        x ^= x >> 4;
        let x = u16::from(x);
        (crc << 8) ^ (x << 12) ^ (x << 5) ^ x
    });
    crc.to_le_bytes() == found
}

/// Returns whether a frame ends with the sum of its bytes, modulo 2¹⁶, high byte first.
pub fn has_sum16(frame: &[u8]) -> bool {
    let (content, found) = frame.split_at(frame.len() - 2);
    let sum: u32 = content.iter().map(|byte| u32::from(*byte)).sum();
    (sum % 65_536).to_be_bytes()[2..] == *found
}

/// Passes millions of bytes in damaged bursts of these frames to the framer of a message and to a
/// driver: none panics, all outputs of the driver are finite, and all frames found are `intact`,
/// more than a thousand.
pub fn check_damaged_bursts<M: FramedMessage>(
    frames: Vec<Vec<u8>>,
    intact: fn(&[u8]) -> bool,
    mut driver: impl Driver,
) {
    const BYTES: usize = 10_000_000 / 3;
    let mut generator = BurstGenerator::new(driver.name(), frames);
    let mut framer = Framer::new(M::match_frame);
    let (mut bytes, mut found, mut tx) = (0, 0, Vec::new());
    let mut now = HostTime::from_nanos(0);
    driver.open(now);
    while bytes < BYTES {
        let pause = generator.below(20_000_000) as u64;
        let burst = generator.next_burst();
        bytes += burst.len();
        framer.push(burst);
        while let Some(frame) = framer.next_frame() {
            assert!(intact(frame), "{frame:02x?}");
            found += 1;
        }
        now = HostTime::from_nanos(now.as_nanos() + pause);
        driver.handle_bytes(now, burst);
        driver.handle_timeout(now);
        tx.clear();
        while driver.poll_transmit(&mut tx) {}
        match driver.is_busy() {
            Ok(false) => driver.begin(now, &[0.1]),
            Ok(true) => {}
            Err(_) => driver.open(now),
        }
        assert!(driver.to_process().iter().all(|value| value.is_finite()));
    }
    assert!(found > 1_000, "{found} frames in {bytes} bytes");
}
