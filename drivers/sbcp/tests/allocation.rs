//! Cycles allocate nothing.

#[path = "support/parties.rs"]
mod parties;

use parties::Parties;

#[test]
fn cycles_allocate_nothing() {
    let mut parties = Parties::new();
    for _ in 0..10 {
        parties.cycle();
    }
    let counted = allocation_counter::measure(|| (0..100).for_each(|_| parties.cycle()));
    assert_eq!(counted.count_total, 0);
    assert_eq!(parties.master.counters().answers, 440);
}
