//! Tests of sweeps and searches.

mod cma_es;
mod engine;
mod search;
mod spaces;
mod sweep;
