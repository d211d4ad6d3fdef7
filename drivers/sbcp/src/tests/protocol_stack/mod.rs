//! Cycles do not allocate.

mod harness;

use harness::ProtocolStack;

#[test]
fn cycles_do_not_allocate() {
    let mut protocol_stack = ProtocolStack::new();
    for _ in 0..10 {
        protocol_stack.cycle();
    }
    let counted = allocation_counter::measure(|| (0..100).for_each(|_| protocol_stack.cycle()));
    assert_eq!(counted.count_total, 0);
    assert_eq!(protocol_stack.master.counters().answers, 440);
}
