//! x
use pyo3::prelude::*;
/// m
#[pymodule]
mod _native {
    use pyo3::prelude::*;
    /// f
    #[pyfunction]
    fn f() -> usize { 1 }
    /// S
    #[pyclass(frozen, module = "twinrig._native")]
    struct S {}
    #[pymethods]
    impl S {
        /// g
        #[new]
        fn new() -> S { S {} }
    }
}
