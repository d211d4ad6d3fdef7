//! Temporary folder of a test.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of the next folder of this program.
static NEXT: AtomicUsize = AtomicUsize::new(0);

/// Temporary folder of a test, deleted on drop.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// Creates an empty folder, whose path starts with the name of its test.
    ///
    /// Tests of one program run side by side, and two of them may have one name: each folder has a
    /// number of its own.
    pub fn new(test: &str) -> Self {
        loop {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let name = format!("twinrig-{test}-{}-{number}", std::process::id());
            let path = std::env::temp_dir().join(name);
            match std::fs::create_dir(&path) {
                Ok(()) => return Self(path),
                // A program that was killed left it, and had the same process number.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => panic!("{}: {error}", path.display()),
            }
        }
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Returns the path of a file in it.
    pub fn join(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    /// Writes a file, with the folders that it needs, and returns its path.
    pub fn file(&self, name: &str, text: &str) -> String {
        let path = self.0.join(name);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).unwrap();
        }
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_one_name_are_apart() {
        let [first, second] = [Folder::new("apart"), Folder::new("apart")];
        let file = first.file("kept.txt", "first");
        assert!(!Path::new(&second.join("kept.txt")).exists());
        drop(second);
        assert_eq!(std::fs::read_to_string(file).unwrap(), "first");
    }
}
