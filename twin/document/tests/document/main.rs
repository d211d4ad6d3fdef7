//! Tests of documents: values, diagnostics, arbitrary contents.

mod fuzz;
mod reading;
