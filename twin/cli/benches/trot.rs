//! What a simulated second of the trot costs.

fn main() {
    divan::main();
}
