//! Interruption sets a flag of the process: a program of its own.

use twinrig_campaign::search::{Dimension, SearchError, Swarm};
use twinrig_runtime::interrupt;

#[test]
fn ctrl_c_ends_the_search_within_an_iteration() {
    let swarm = Swarm {
        dimensions: vec![Dimension::linear(0.0, 1.0)],
        particles: 10,
        iterations: 1000,
        seed: 1,
        threads: 2,
    };
    let mut last = 0;
    let result = swarm.minimise(&|x| x[0], &mut |progress| {
        last = progress.iteration;
        if last == 5 {
            interrupt::request();
        }
        true
    });
    assert_eq!(last, 5);
    assert_eq!(result, Err(SearchError::Interrupted { done: 5, of: 1000 }));
}
