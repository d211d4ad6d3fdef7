//! Tests of sweeps and searches.

mod cma_es;
mod engine;
mod interrupt;
mod search;
mod spaces;
