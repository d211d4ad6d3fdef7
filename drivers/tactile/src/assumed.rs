//! Parameters for which no source exists, each marked ASSUMED.

use twinrig_kernel::SimDuration;

/// Symbol rate of the serial line \[baud\]. ASSUMED: the highest of common serial ports. A frame of
/// 18 bytes takes 195 µs, a fifth of the shortest period; at 115 200 it would take 1.56 ms.
pub(crate) const BAUD: u32 = 921_600;
/// Force at which the reference cell has [`REFERENCE_SENSITIVITY`] \[N\]: the nominal force of the
/// thesis' cell.
pub(crate) const REFERENCE_CAPACITY: f64 = 50.0;
/// Output over supply of the reference cell at its nominal force \[1\]: 2 mV/V. ASSUMED.
pub(crate) const REFERENCE_SENSITIVITY: f64 = 2e-3;
/// Deviation of the noise of a voltage \[V\]. ASSUMED: one count.
pub(crate) const VOLTAGE_NOISE: f64 = 10.0 / 32_768.0;
/// Deviation of the noise of the reference force \[N\]. ASSUMED.
pub(crate) const REFERENCE_NOISE: f64 = 1e-3;
/// Longest delay of the start of a transmission by the board's firmware. ASSUMED.
pub(crate) const JITTER: SimDuration = SimDuration::from_micros(50);
/// Frames that the board stores while the line is busy. ASSUMED.
pub(crate) const FIFO: usize = 64;
/// Time from the last byte of a command to the first bit of its acknowledgement. ASSUMED.
pub(crate) const REACTION: SimDuration = SimDuration::from_micros(50);
/// Time from a reset of the board until it accepts commands. ASSUMED.
pub(crate) const BOOT_TIME: SimDuration = SimDuration::from_millis(100);
/// Time-out of an acknowledgement, and then, in addition to two periods, of a sample. ASSUMED.
pub(crate) const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(200);
/// Missing samples after which the driver starts the board again. ASSUMED.
pub(crate) const SILENT_PERIODS: u64 = 20;
/// Interval of clock reports. ASSUMED.
pub(crate) const REPORT_INTERVAL: SimDuration = SimDuration::from_secs(1);
