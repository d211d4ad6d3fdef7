//! Parameters of the boards for which no source exists, each marked ASSUMED, in one place.
//! Constants of the protocol itself (codes, instructions, addresses) are in the table of
//! `twinrig_sbcp`.

/// ASSUMED: duration of the start-up calibration \[ticks of 1 ms\]. The encoders are absolute, so
/// no motion is required.
pub(crate) const CALIBRATION_TICKS: u32 = 250;

/// ASSUMED: capacity of the overflow buffer \[points\]. Draining it shortens every period by one
/// tick, so two points are rarely needed; the others absorb the backlog after a fault.
pub(crate) const OVERFLOW_BUFFER: usize = 8;

/// ASSUMED: resolution of the force sensor \[N/count\]. With its zero at mid-range its range is
/// ±102.4 N, twice the robot's weight.
pub(crate) const FORCE_PER_COUNT: f64 = 0.05;

/// ASSUMED: count of the unloaded force sensor, the middle of its 12 bits.
pub(crate) const FORCE_ZERO: u16 = 2_048;

/// ASSUMED: fractional bits of the gains. The sum of the position controller, in 1/32768 of the
/// supply's 24 V, for errors in counts, is
///
/// ```text
/// (8 · P · e + I · Σe + 64 · D · Δe) / 2⁵
/// ```
///
/// so that the defaults 400 / 20 / 200 correspond to 73 mV per count, 0.46 mV per count and tick,
/// and 293 mV per count of change in one tick. With the motor of the robot (5.08 rad/s per volt,
/// 1.66 ms) the bandwidth of the loop is 50 Hz and the integral takes 160 ms; a load of large
/// inertia (more than about 10⁻³ kg·m² at the joint) makes it oscillate.
pub(crate) const GAIN_BITS: u32 = 5;
/// ASSUMED: see [`GAIN_BITS`].
pub(crate) const P_FACTOR: i64 = 8;
/// ASSUMED: see [`GAIN_BITS`].
pub(crate) const D_FACTOR: i64 = 64;

/// ASSUMED: resistive voltage drop per unit of the register `MaxTorque`, in 1/32768 of the supply.
/// One unit then is 20 mA, the step of a 12-bit converter over ± 41 A: 11.86 mV across 0.593 Ω. The
/// default of 1100 is 22 A, or 4.3 N·m at the joint; the motor stalls at 40.5 A.
pub(crate) const DUTY_PER_TORQUE_UNIT: i32 = 16;

/// Back-EMF of the motor behind its gear per count and tick, in 1/32768 of the supply:
/// 14.05 mN·m/A · 14 · 1.534 rad/s = 302 mV.
/// The firmware is specific to this motor: its current limit contains the motor's resistance.
pub(crate) const DUTY_PER_COUNT_IN_A_TICK: i32 = 412;

/// ASSUMED: unit of the speed word of velocity mode \[counts/s\]. The signed word of 16 bits then
/// reaches ±16 turns per second, and its step is 0.1 % of half a turn per second.
pub(crate) const SPEED_UNIT: i32 = 2;

/// ASSUMED: maximum following error of velocity mode \[counts\], a quarter of a turn. The set-point
/// waits at that distance from a shaft that cannot follow, which then makes up a quarter of a turn
/// once it is free, not the time of the stall.
pub(crate) const LAG_MAX: i32 = 1_024;
