//! Cost of a whole event of the executor, with toy parts.

fn main() {}
