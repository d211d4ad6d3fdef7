//! The ZIP archive of an FMU. Equal contents give equal bytes: entries have no time of the machine,
//! and the compression is the same code on every processor.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::fmu::error::ExportError;

/// Permissions of the entries.
const MODE: u32 = 0o644;

/// Returns an archive with these files, in their order.
pub(crate) fn archive(files: &[(String, &[u8])]) -> Result<Vec<u8>, ExportError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(MODE);
    for (name, bytes) in files {
        archive.start_file(name.as_str(), options)?;
        archive
            .write_all(bytes)
            .map_err(zip::result::ZipError::Io)?;
    }
    Ok(archive.finish()?.into_inner())
}
