//! Throughput of the event queue (one push and one pop at a constant queue length) and of the
//! agenda (one wake-up re-armed), in events per second: 10 M/s is 100 ns per event.

use std::hint::black_box;

use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig_kernel::{Agenda, EventQueue, Rank, SimDuration, SimTime, stream};

const EVENTS: usize = 10_000;

fn main() {
    divan::main();
}

#[divan::bench(args = [4, 16, 64, 1024])]
fn push_and_pop(bencher: Bencher, pending: u64) {
    let mut random = stream(1, "bench");
    let delays: Vec<_> = (0..1024)
        .map(|_| SimDuration::from_nanos(random.between(0, 2_000_000)))
        .collect();
    bencher.counter(ItemsCount::new(EVENTS)).bench_local(|| {
        let mut queue = EventQueue::with_capacity(usize::try_from(pending).unwrap());
        for n in 0..pending {
            queue.push(SimTime::from_nanos(n), Rank(0), n);
        }
        for delay in delays.iter().cycle().take(EVENTS) {
            let due = queue.pop().unwrap();
            queue.push(due.time + *delay, Rank(0), black_box(due.event));
        }
        queue.len()
    });
}

#[divan::bench(args = [4, 16, 64])]
fn wake_and_re_arm(bencher: Bencher, parts: u64) {
    let mut random = stream(1, "bench");
    let delays: Vec<_> = (0..1024)
        .map(|_| SimDuration::from_nanos(random.between(1, 2_000_000)))
        .collect();
    bencher.counter(ItemsCount::new(EVENTS)).bench_local(|| {
        let mut agenda = Agenda::new(100_000);
        for n in 0..parts {
            let part = agenda.register("part", Rank(0));
            agenda.arm(part, SimTime::from_nanos(n));
        }
        for delay in delays.iter().cycle().take(EVENTS) {
            let wake = agenda.pop_until(SimTime::MAX).unwrap().unwrap();
            agenda.arm(wake.part, wake.time + *delay);
        }
        agenda.next_time()
    });
}
