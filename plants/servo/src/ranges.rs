//! Accepted values of a load that a hand can hold, but not what a slip of a unit makes of them.

use twinrig_document::Range;

pub(crate) const MASS: Range = Range::between(0.0, 100.0);
pub(crate) const LENGTH: Range = Range::positive_to(5.0);
pub(crate) const OFFSET: Range = Range::between(-3.2, 3.2);
