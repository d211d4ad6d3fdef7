//! phidget.
