//! Accepted values of a tactile sensor, but not what a slip of a unit makes of it.

use twinrig_document::Range;

/// Spread of the constants of cells: time constants must stay apart.
pub(crate) const SPREAD: Range = Range::between(0.0, 0.5);
/// Share of a creep \[1\].
pub(crate) const SHARE: Range = Range::between(0.0, 1.0);
/// Conductance of a cell \[S\].
pub(crate) const CONDUCTANCE: Range = Range::between(1e-12, 10.0);
/// Offset of a conductance \[S\].
pub(crate) const BASE: Range = Range::between(-10.0, 10.0);
/// Conductance of a branch without load \[S\].
pub(crate) const BRANCH_BASE: Range = Range::between(0.0, 10.0);
/// Conductance per force \[S/N\].
pub(crate) const SENSITIVITY: Range = Range::between(1e-12, 10.0);
/// Load of a cell \[N\].
pub(crate) const FORCE: Range = Range::between(1e-4, 1e6);
/// Load in the middle of a branch \[N\].
pub(crate) const MID: Range = Range::between(-1e6, 1e6);
/// Rate of the load at which the branch changes \[N/s\].
pub(crate) const RATE: Range = Range::between(1e-6, 1e9);
/// Time constant \[s\].
pub(crate) const TIME: Range = Range::between(1e-6, 1e6);
/// Resistor of an amplifier \[Ω\].
pub(crate) const RESISTANCE: Range = Range::between(1.0, 1e12);
/// Supply or reference \[V\].
pub(crate) const VOLTAGE: Range = Range::between(1e-3, 1e3);
/// Voltage per rate of the load \[V·s/N\].
pub(crate) const GAIN: Range = Range::between(-1e6, 1e6);
/// Offset of a voltage \[V\].
pub(crate) const OFFSET: Range = Range::between(-10.0, 10.0);
