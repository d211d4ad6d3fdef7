//! Tests of the test bench and of its files.

mod bench;
mod files;
