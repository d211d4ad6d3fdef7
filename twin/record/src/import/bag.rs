//! Bags of rosbag2: folders with metadata and several files.

use std::path::{Component, Path, PathBuf};

use twinrig_document::{TEXT_MOST, read_file};

use super::error::LogFault;

/// Returns the files of a bag, in their order.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, LogFault> {
    let bag = |why: String| LogFault::Bag { why };
    let metadata = read_file(&folder.join("metadata.yaml"), TEXT_MOST);
    let metadata =
        metadata.map_err(|error| bag(format!("metadata.yaml cannot be read: {error}")))?;
    let text = String::from_utf8_lossy(&metadata);
    let mut lines = text.lines().map(str::trim);
    if !lines.any(|line| line == "relative_file_paths:") {
        return Err(bag("metadata.yaml has no `relative_file_paths`".to_owned()));
    }
    let names = lines.map_while(|line| line.strip_prefix("- "));
    let names = names.map(|name| name.trim().trim_matches(['"', '\'']));
    let mut files = Vec::new();
    for name in names {
        let path = Path::new(name);
        let extension = path.extension().and_then(|extension| extension.to_str());
        if extension == Some("db3") {
            return Err(LogFault::Sqlite);
        }
        let is_inside = path
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if extension != Some("mcap") || !is_inside {
            return Err(bag(format!("`{name}` is not an MCAP file in it")));
        }
        files.push(folder.join(path));
    }
    if files.is_empty() {
        return Err(bag("it has no files".to_owned()));
    }
    Ok(files)
}
