//! Writes the page around a module: `page MODULE SCENARIOS PAGE`, a WebAssembly file, a folder, and
//! the HTML file to write. `ci/playground` calls it.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use twinrig_report::page::{Script, document};
use twinrig_view::packed;

/// A scenario to choose.
#[derive(Serialize)]
struct Scenario {
    name: String,
    text: String,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [module, scenarios, page] = arguments.as_slice() else {
        return Err("usage: page MODULE SCENARIOS PAGE".into());
    };
    let worker = concat!(
        include_str!("../page/module.js"),
        include_str!("../page/worker.js")
    );
    let scripts = [
        Script::Data {
            id: "module",
            text: packed(&fs::read(module)?)?,
        },
        Script::Data {
            id: "scenarios",
            text: serde_json::to_string(&offered(scenarios)?)?,
        },
        // Not as it stands: `<` is escaped in data.
        Script::Data {
            id: "worker",
            text: packed(worker.as_bytes())?,
        },
        Script::Module(include_str!("../page/main.js").to_owned()),
    ];
    let html = document(
        "Twinrig in the browser",
        include_str!("../page/style.css"),
        include_str!("../page/body.html"),
        &scripts,
    );
    fs::write(page, html)?;
    Ok(())
}

/// Returns the scenarios of a folder, by name.
fn offered(folder: &Path) -> Result<Vec<Scenario>, Box<dyn Error>> {
    let mut offered = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let Some(name) = path.file_stem().and_then(|it| it.to_str()) else {
            continue;
        };
        if path.extension().is_some_and(|it| it == "toml") {
            let text = fs::read_to_string(&path)?;
            let name = name.to_owned();
            offered.push(Scenario { name, text });
        }
    }
    offered.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(offered)
}
