//! Buses over a network.

use super::{Running, STAND, with_retries};
use crate::common::Folder;

#[test]
fn run_at_a_served_address_passes_and_ends_the_twin() {
    let folder = Folder::new("network");
    let scenario = folder.file("bench.toml", STAND);
    for scheme in ["tcp", "rfc2217"] {
        let listen = format!("{scheme}://0");
        let [run, served] = with_retries(|| {
            let mut served = Running::serve(&folder, &scenario, &listen, &[]);
            let place = served.place();
            assert!(
                place.starts_with(&format!("{scheme}://127.0.0.1:")),
                "{place}"
            );
            let command = format!("connect with: twin run {scenario} --port sbcp={place}\n");
            assert!(served.prints().ends_with(&command), "{}", served.prints());
            let run = Running::run(&folder, &scenario, &place, &["--json"]).end();
            Ok([run.in_time("")?, served.end()])
        });
        assert_eq!(
            (run.code, served.code),
            (Some(0), Some(0)),
            "{run:?} {served:?}"
        );
        let bus = &run.report()["buses"][0];
        assert!(bus["answers"].as_u64() > Some(0), "{bus}");
    }
}
