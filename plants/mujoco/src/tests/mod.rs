//! Tests of the plant and of models in files.

mod model_file;
mod plant;
