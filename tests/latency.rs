//! tbd
use std::path::Path;
use twinrig::{Assembly, Registry};
use twinrig_runtime::Group;
#[test]
fn show() {
    let registry = Registry::standard();
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let assembly = Assembly::of_file(&registry, &root.join("scenarios/bench.toml"), &[]).unwrap();
    let rig = assembly.rig().unwrap();
    for g in [Group::Plant, Group::ProcessInputs, Group::ProcessOutputs, Group::Diagnostics] {
        for f in rig.layout(g).fields() { eprintln!("{g:?} {} {:?}", f.port.name, f.range()); }
    }
    eprintln!("{:?} {:?}", rig.traces(), rig.task_names().collect::<Vec<_>>());
}
