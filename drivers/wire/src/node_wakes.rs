use std::cmp::Reverse;
use std::collections::BinaryHeap;

use twinrig_kernel::SimTime;

/// Times at which the nodes of a bus must be advanced. Finding the next one takes a time that grows
/// with the logarithm of their number.
#[derive(Debug, Default)]
pub(crate) struct NodeWakes {
    /// Of each node; the end of time for none.
    times: Vec<SimTime>,
    /// Time and node. Entries that differ from `times` are obsolete.
    heap: BinaryHeap<Reverse<(SimTime, usize)>>,
}

impl NodeWakes {
    /// No wake-up of `nodes` nodes.
    pub(crate) fn new(nodes: usize) -> Self {
        Self {
            times: vec![SimTime::MAX; nodes],
            heap: BinaryHeap::with_capacity(2 * nodes),
        }
    }

    /// Sets the wake-up of a node.
    #[inline]
    pub(crate) fn set(&mut self, node: usize, at: Option<SimTime>) {
        let at = at.unwrap_or(SimTime::MAX);
        if std::mem::replace(&mut self.times[node], at) != at && at < SimTime::MAX {
            self.heap.push(Reverse((at, node)));
        }
    }

    /// Returns the time of the next wake-up.
    pub(crate) fn next(&mut self) -> Option<SimTime> {
        while let Some(Reverse((at, node))) = self.heap.peek() {
            if self.times[*node] == *at {
                return Some(*at);
            }
            self.heap.pop();
        }
        None
    }

    /// Appends the nodes whose wake-up is due, in order of time, and clears their wake-ups.
    pub(crate) fn take_due(&mut self, now: SimTime, due: &mut Vec<usize>) {
        while self.next().is_some_and(|at| at <= now)
            && let Some(Reverse((_, node))) = self.heap.pop()
        {
            self.times[node] = SimTime::MAX;
            due.push(node);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn due_nodes_are_those_of_a_plain_list(
            changes in prop::collection::vec((0_usize..5, prop::option::of(0_u64..40)), 0..60),
        ) {
            let (mut wakes, mut list) = (NodeWakes::new(5), [None; 5]);
            for (n, (node, at)) in changes.into_iter().enumerate() {
                let at = at.map(SimTime::from_nanos);
                wakes.set(node, at);
                list[node] = at;
                prop_assert_eq!(wakes.next(), list.iter().flatten().min().copied());
                if n % 3 == 2 {
                    let now = SimTime::from_nanos(10);
                    let is_due = |node: &usize| list[*node].is_some_and(|at| at <= now);
                    let mut expected: Vec<usize> = (0..5).filter(is_due).collect();
                    expected.sort_by_key(|node| list[*node]);
                    let mut due = Vec::new();
                    wakes.take_due(now, &mut due);
                    prop_assert_eq!(&due, &expected);
                    for node in due {
                        list[node] = None;
                    }
                }
            }
        }
    }
}
