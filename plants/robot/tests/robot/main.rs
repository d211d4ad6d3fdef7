//! Tests of robot files.

mod malformed;
mod robots;
