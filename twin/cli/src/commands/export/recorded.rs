//! Commands `twin export csv` and `twin export npz`: the signals of a recording for other programs.

use std::fs::{self, File};
use std::io::{self, BufWriter, Cursor, Write};
use std::path::{Path, PathBuf};

use twinrig_record::{Recording, SampledGroup};
use twinrig_rig::error::Error;
use twinrig_rig::report::seconds;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::args::RecordedArgs;
use crate::commands::Terminal;
use crate::error::TwinError;

/// Writes a table of text for each group of signals.
pub(super) fn csv(args: &RecordedArgs, terminal: &mut Terminal<'_>) -> Result<(), TwinError> {
    let recording = open(&args.recording)?;
    let folder = args.out.clone().unwrap_or_default();
    if !folder.as_os_str().is_empty() {
        fs::create_dir_all(&folder).map_err(|source| failed(&folder, source))?;
    }
    for group in recording.groups() {
        let path = folder.join(format!("{}-{}.csv", stem(&args.recording), group.name));
        let written = File::create(&path).and_then(|file| {
            let mut file = BufWriter::new(file);
            write_csv(&recording, group, &mut file)?;
            file.flush()
        });
        written.map_err(|source| failed(&path, source))?;
        print_written(terminal, &path, &recording, group);
    }
    Ok(())
}

/// Writes all signals as arrays of `NumPy`, in one archive.
pub(super) fn npz(args: &RecordedArgs, terminal: &mut Terminal<'_>) -> Result<(), TwinError> {
    let recording = open(&args.recording)?;
    let path = args.out.clone().unwrap_or_else(|| {
        let name = format!("{}.npz", stem(&args.recording));
        PathBuf::from(name)
    });
    let archive = archive(&recording).map_err(|error| failed(&path, error.into()))?;
    crate::commands::outputs::write_whole(&path, &archive)?;
    for group in recording.groups() {
        print_written(terminal, &path, &recording, group);
    }
    Ok(())
}

fn open(path: &Path) -> Result<Recording, TwinError> {
    Recording::open(path).map_err(|source| {
        let path = path.to_owned();
        TwinError::from(Error::Record { path, source })
    })
}

fn failed(path: &Path, source: io::Error) -> TwinError {
    let path = path.to_owned();
    TwinError::from(Error::Write { path, source })
}

fn stem(recording: &Path) -> String {
    let stem = recording.file_stem().unwrap_or(recording.as_os_str());
    stem.to_string_lossy().into_owned()
}

fn print_written(
    terminal: &mut Terminal<'_>,
    path: &Path,
    recording: &Recording,
    group: &SampledGroup,
) {
    terminal.print(&format!(
        "written {}: {}, {} signals, {} samples",
        path.display(),
        group.name,
        group.signals.len(),
        recording.samples(group).len(),
    ));
}

/// Writes times and values; each number reads back as its bits.
fn write_csv(recording: &Recording, group: &SampledGroup, out: &mut impl Write) -> io::Result<()> {
    write!(out, "time [s]")?;
    for signal in &group.signals {
        let unit = match signal.unit.as_str() {
            "" | "1" => String::new(),
            unit => format!(" [{unit}]"),
        };
        for component in 0..signal.size {
            let number = match signal.size {
                1 => String::new(),
                _ => format!(".{component}"),
            };
            write!(out, ",{}{number}{unit}", signal.name)?;
        }
    }
    writeln!(out)?;
    for sample in recording.samples(group) {
        write!(out, "{:?}", seconds(sample.time.as_nanos()))?;
        for value in sample.all() {
            write!(out, ",{value:?}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Returns an archive with an array for each signal, named `GROUP/SIGNAL`, and one for the times of
/// each group, `GROUP/time`.
fn archive(recording: &Recording) -> Result<Vec<u8>, ZipError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .large_file(true);
    let mut add = |name: String, shape: &[usize], values: &mut dyn Iterator<Item = f64>| {
        archive.start_file(format!("{name}.npy"), options)?;
        archive.write_all(&npy_header(shape))?;
        for value in values {
            archive.write_all(&value.to_le_bytes())?;
        }
        Ok::<(), ZipError>(())
    };
    for group in recording.groups() {
        let samples = || recording.samples(group);
        let count = samples().len();
        let mut times = samples().map(|sample| seconds(sample.time.as_nanos()));
        add(format!("{}/time", group.name), &[count], &mut times)?;
        let mut begin = 0;
        for signal in &group.signals {
            let range = begin..begin + signal.size;
            begin = range.end;
            let shape = [count, signal.size];
            let shape = if signal.size == 1 {
                &shape[..1]
            } else {
                &shape
            };
            let mut values = samples().flat_map(|sample| sample.values(range.clone()));
            add(
                format!("{}/{}", group.name, signal.name),
                shape,
                &mut values,
            )?;
        }
    }
    Ok(archive.finish()?.into_inner())
}

/// Returns the header of an array of doubles, in the format of `NumPy`, version 1.0.
fn npy_header(shape: &[usize]) -> Vec<u8> {
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    // A tuple of one length has a comma.
    let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
    let lengths = lengths.join(",");
    let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({lengths},), }}");
    // Magic, length, text and a line feed are a multiple of 64 bytes.
    let length = (MAGIC.len() + 2 + text.len() + 1).next_multiple_of(64) - MAGIC.len() - 2;
    let mut header = MAGIC.to_vec();
    // Two lengths have 40 digits at most.
    header.extend(u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes());
    header.extend(format!("{text:<width$}\n", width = length - 1).bytes());
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_is_aligned() {
        for shape in [&[0][..], &[3], &[1_000_000, 12], &[usize::MAX, usize::MAX]] {
            let header = npy_header(shape);
            assert_eq!(header.len() % 64, 0);
            let length = usize::from(u16::from_le_bytes([header[8], header[9]]));
            assert_eq!(10 + length, header.len());
            assert_eq!(header.last(), Some(&b'\n'));
        }
        let header = String::from_utf8_lossy(&npy_header(&[7, 3])).into_owned();
        assert!(header.contains("'shape': (7,3,)"), "{header}");
    }
}
