//! Every figure of the boards that is found nowhere, each marked ASSUMED, in one place. Values of the protocol itself
//! (codes, instructions, addresses) are in `twinrig_sbcp`'s table.

/// ASSUMED: how long the start-up calibration takes \[ticks of 1 ms\]. Encoders are absolute, so that nothing has to move.
pub(crate) const CALIBRATION_TICKS: u32 = 250;

/// ASSUMED: points that the overflow buffer holds. Draining it shortens every period by a tick, so that two are hardly
/// ever needed; the others are for what piles up behind a fault.
pub(crate) const OVERFLOW_BUFFER: usize = 8;

/// ASSUMED: newtons of a count of the force sensor, with its zero at mid-range: ± 102.4 N, twice the robot's weight.
pub(crate) const FORCE_PER_COUNT: f64 = 0.05;

/// ASSUMED: the count of the force sensor without load, the middle of its 12 bits.
pub(crate) const FORCE_ZERO: u16 = 2_048;

/// ASSUMED: bits behind the point of the gains. The firmware's sum, in 1/32768 of the supply's 24 V for counts, is
///
/// ```text
/// (8 · P · e + I · Σe + 64 · D · Δe) / 2⁵
/// ```
///
/// so that the defaults 400 / 20 / 200 are 73 mV a count, 0.46 mV a count and tick, and 293 mV a count in a tick. With
/// the motor of the robot (5.08 rad/s a volt, 1.66 ms) the loop is 50 Hz wide, and the integral takes 160 ms; a load that is
/// itself heavy (more than some 10⁻³ kg·m² at the joint) makes it swing.
pub(crate) const GAIN_BITS: u32 = 5;
/// ASSUMED: see [`GAIN_BITS`].
pub(crate) const P_FACTOR: i64 = 8;
/// ASSUMED: see [`GAIN_BITS`].
pub(crate) const D_FACTOR: i64 = 64;

/// ASSUMED: voltage that the resistance takes for a unit of the register `MaxTorque`, in 1/32768 of the supply. A unit
/// is 20 mA then, a step of a 12-bit converter over ± 41 A: through 0.593 Ω that is 11.86 mV. The default of 1100 is
/// 22 A, or 4.3 N·m at the joint; the motor stalls at 40.5 A.
pub(crate) const DUTY_PER_TORQUE_UNIT: i32 = 16;

/// Back-EMF of the motor behind its gear for a count in a tick, in 1/32768 of the supply: 14.05 mN·m/A · 14 · 1.534 rad/s
/// is 302 mV. The firmware was made for this motor, as it knows its resistance.
pub(crate) const DUTY_PER_COUNT_IN_A_TICK: i32 = 412;
