//! The machine that the program runs on.

use std::io::IsTerminal as _;
use std::process::{Command, Stdio};

use super::system::{Access, Limit, Output, System};

/// The machine.
pub(crate) struct Machine;

impl System for Machine {
    fn is_linux(&self) -> bool {
        cfg!(target_os = "linux")
    }

    fn text(&self, path: &str) -> Option<String> {
        let text = std::fs::read_to_string(path).ok()?;
        Some(text.trim().to_owned())
    }

    fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<_> = names.collect();
        names.sort();
        names
    }

    fn output(&self, program: &str, arguments: &[&str]) -> Output {
        let run = Command::new(program)
            .args(arguments)
            .stdin(Stdio::null())
            .output();
        let Ok(output) = run else {
            return Output::Missing;
        };
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        if output.status.success() {
            let text = text(&output.stdout);
            return Output::Line(text.lines().next().unwrap_or_default().to_owned());
        }
        let text = text(&output.stderr);
        Output::Failed(text.lines().next_back().unwrap_or_default().to_owned())
    }

    #[cfg(target_os = "linux")]
    fn access(&self, path: &str) -> Access {
        super::linux::access(path)
    }

    #[cfg(target_os = "linux")]
    fn limit(&self, limit: Limit) -> Option<u64> {
        super::linux::limit(limit)
    }

    #[cfg(target_os = "linux")]
    fn free_space(&self) -> Option<u64> {
        super::linux::free_space()
    }

    #[cfg(not(target_os = "linux"))]
    fn access(&self, _: &str) -> Access {
        Access {
            is_granted: false,
            group: None,
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn limit(&self, _: Limit) -> Option<u64> {
        Some(0)
    }

    #[cfg(not(target_os = "linux"))]
    fn free_space(&self) -> Option<u64> {
        None
    }

    fn is_writable(&self) -> bool {
        let name = format!(".twin-doctor-{}", std::process::id());
        let is_created = std::fs::File::create_new(&name).is_ok();
        is_created && std::fs::remove_file(&name).is_ok()
    }

    fn variable(&self, name: &str) -> Option<String> {
        std::env::var(name).ok().filter(|value| !value.is_empty())
    }

    fn is_terminal(&self) -> bool {
        std::io::stdout().is_terminal()
    }
}
