//! Locations of resources: file URIs and paths.

use std::path::PathBuf;

use crate::fmu::error::FmuError;

/// Returns the path of a location: `file:///folder%20with%20spaces`, `file:/folder`,
/// `file://localhost/folder`, or a path.
///
/// # Errors
/// [`FmuError::Location`] for another scheme or host, and for a wrong escape.
pub(crate) fn path_of(location: &str) -> Result<PathBuf, FmuError> {
    let refused = |why| FmuError::Location {
        location: location.to_owned(),
        why,
    };
    let scheme = location.get(..5);
    if !scheme.is_some_and(|scheme| scheme.eq_ignore_ascii_case("file:")) {
        if location.is_empty() {
            return Err(refused("it is empty"));
        }
        return match location.split_once("://") {
            Some(_) => Err(refused("only `file:` is supported")),
            None => Ok(PathBuf::from(location)),
        };
    }
    let rest = &location[5..];
    let path = match rest.strip_prefix("//") {
        Some(rest) => {
            let rest = rest.strip_prefix("localhost").unwrap_or(rest);
            rest.starts_with('/').then_some(rest)
        }
        None => rest.starts_with('/').then_some(rest),
    };
    let path = path.ok_or_else(|| refused("a file URI has an absolute path on this machine"))?;
    let bytes =
        percent_decoded(path).ok_or_else(|| refused("`%` is followed by two hex digits"))?;
    path_of_bytes(bytes).ok_or_else(|| refused("it is no text in UTF-8"))
}

/// Returns the path with these bytes, which may be any where there is Unix.
#[cfg(unix)]
#[expect(clippy::unnecessary_wraps, reason = "other systems refuse")]
fn path_of_bytes(bytes: Vec<u8>) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStringExt;

    Some(PathBuf::from(std::ffi::OsString::from_vec(bytes)))
}

/// Returns the path with these bytes, if they are text.
#[cfg(not(unix))]
fn path_of_bytes(bytes: Vec<u8>) -> Option<PathBuf> {
    String::from_utf8(bytes).ok().map(PathBuf::from)
}

fn percent_decoded(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes().iter();
    while let Some(byte) = rest.next() {
        if *byte != b'%' {
            bytes.push(*byte);
            continue;
        }
        let mut digit = || char::from(*rest.next()?).to_digit(16);
        let value = digit()? * 16 + digit()?;
        bytes.push(u8::try_from(value).ok()?);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn uris_and_paths_are_the_same_folder() {
        for location in [
            "file:///tmp/a%20b/%c3%a9/resources",
            "file:/tmp/a%20b/%C3%A9/resources",
            "FILE://localhost/tmp/a b/é/resources",
            "/tmp/a b/é/resources",
        ] {
            let path = path_of(location).unwrap();
            assert_eq!(path, Path::new("/tmp/a b/é/resources"), "{location}");
        }
        // A path is not decoded.
        assert_eq!(path_of("/tmp/100%25").unwrap(), Path::new("/tmp/100%25"));
    }

    #[test]
    fn other_schemes_hosts_and_escapes_are_refused() {
        for location in [
            "",
            "https://example.org/resources",
            "file://example.org/resources",
            "file:resources",
            "file:///tmp/%2",
            "file:///tmp/%zz",
        ] {
            assert!(path_of(location).is_err(), "{location}");
        }
    }
}
