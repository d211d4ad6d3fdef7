use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::ErrorKind;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::{MetadataExt, symlink};
use std::os::unix::net::{SocketAddr, UnixListener};
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::errno::Errno;
use nix::fcntl::OFlag;
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use twinrig_runtime::{Device, DeviceError};

use crate::tty::Tty;

/// A pseudo-terminal: this is its master end, and [`Pty::path`] is where a program opens the other one, which
/// it cannot tell from a serial port, but that bytes take no time on it.
///
/// While nobody has the other end open, reading says [`DeviceError::HungUp`]; somebody may open it at any time,
/// and may then find what was written meanwhile. A write never waits: what does not fit because nobody reads is
/// [`DeviceError::Stuck`].
///
/// ```
/// use twinrig_runtime::Device;
/// use twinrig_wire::{Pty, SerialPort};
///
/// let mut twin = Pty::open()?;
/// let mut robot = SerialPort::open(twin.path(), 3_333_333)?;
/// robot.write(b"hello")?;
/// let mut heard = Vec::new();
/// twin.read(std::time::Duration::from_secs(1), &mut heard)?;
/// assert_eq!(heard, b"hello");
/// # Ok::<(), twinrig_runtime::DeviceError>(())
/// ```
#[derive(Debug)]
pub struct Pty {
    tty: Tty,
    slave: PathBuf,
    link: Option<PathBuf>,
    /// Says that the link is in use, for as long as this is.
    claim: Option<UnixListener>,
}

/// Where the system keeps the other ends.
const SLAVES: &str = "/dev/pts";

impl Pty {
    /// A new one.
    ///
    /// # Errors
    /// [`DeviceError::Other`] if the system has none to give.
    pub fn open() -> Result<Self, DeviceError> {
        // Not for programs that are started from here: with a copy of it, they would keep it plugged in.
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_NONBLOCK | OFlag::O_CLOEXEC;
        let master = posix_openpt(flags).map_err(no_pty)?;
        grantpt(&master).map_err(no_pty)?;
        unlockpt(&master).map_err(no_pty)?;
        let slave = PathBuf::from(ptsname_r(&master).map_err(no_pty)?);
        make_raw(&Tty::open_file(&slave)?).map_err(no_pty)?;
        let master = File::from(OwnedFd::from(master));
        Ok(Self {
            tty: Tty::new(slave.display().to_string(), master, Duration::ZERO),
            slave,
            link: None,
            claim: None,
        })
    }

    /// Makes the other end known by a name that is the same every time, too: a symbolic link at `link`, which is
    /// removed when this is dropped. One that an earlier run has left is replaced; one whose [`Pty`]
    /// is still there, in whatever program, is not.
    ///
    /// # Errors
    /// [`DeviceError::Other`] if another [`Pty`] is linked there, there is something else at `link`, or nothing can be
    /// there.
    pub fn linked(mut self, link: &Path) -> Result<Self, DeviceError> {
        let place = link.display().to_string();
        let failed = |why: String| DeviceError::Other {
            place: place.clone(),
            why,
        };
        self.claim = Some(claim(link).map_err(&failed)?);
        match fs::read_link(link) {
            Ok(old) if old.starts_with(SLAVES) => {
                fs::remove_file(link).map_err(|error| failed(error.to_string()))?;
            }
            _ if link.symlink_metadata().is_ok() => {
                let why = "there is something of that name, which is not the end of a PTY; \
                           take another name, or remove it";
                return Err(failed(why.into()));
            }
            _ => {}
        }
        symlink(&self.slave, link).map_err(|error| failed(error.to_string()))?;
        self.link = Some(link.into());
        self.tty.place = link.display().to_string();
        Ok(self)
    }

    /// Where the other end is: the link, if there is one.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.slave)
    }
}

/// Claims the name `link` until the listener is dropped, or the program ends, however that is: a socket in the abstract
/// namespace, which is nowhere in the file system and leaves nothing behind. Nobody connects to it.
fn claim(link: &Path) -> Result<UnixListener, String> {
    let folder = match link.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let folder = fs::metadata(folder).map_err(|error| error.to_string())?;
    // Whatever path leads there, and however long the name is.
    let mut hash = DefaultHasher::new();
    link.file_name().hash(&mut hash);
    let name = format!(
        "twinrig/pty/{:x}/{:x}/{:016x}",
        folder.dev(),
        folder.ino(),
        hash.finish()
    );
    let address = SocketAddr::from_abstract_name(name).map_err(|error| error.to_string())?;
    UnixListener::bind_addr(&address).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => {
            "another twin is served at that name; take another name, or end the other".to_owned()
        }
        _ => error.to_string(),
    })
}

/// Bytes pass as they are: no echo, no line ends, no Ctrl-C. This holds for whoever opens it later.
fn make_raw(slave: &File) -> Result<(), Errno> {
    let mut settings = tcgetattr(slave)?;
    cfmakeraw(&mut settings);
    tcsetattr(slave, SetArg::TCSANOW, &settings)
}

fn no_pty(error: Errno) -> DeviceError {
    DeviceError::Other {
        place: "a new PTY".into(),
        why: error.to_string(),
    }
}

/// The master's end is there as long as this is: what is gone can only be the other one.
fn hung_up(error: DeviceError) -> DeviceError {
    match error {
        DeviceError::Gone { place } => DeviceError::HungUp { place },
        error => error,
    }
}

impl Device for Pty {
    fn place(&self) -> &str {
        &self.tty.place
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.tty.write(bytes).map_err(hung_up)
    }

    fn read_up_to(
        &mut self,
        limit: usize,
        patience: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        self.tty.read_up_to(limit, patience, bytes).map_err(hung_up)
    }

    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        Some(self.tty.descriptor())
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|now| now == self.slave)
        {
            let _ = fs::remove_file(link);
        }
    }
}
