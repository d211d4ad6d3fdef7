//! Cost of a cycle.

fn main() {
    divan::main();
}
