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

/// Master end of a pseudo-terminal. A program opens the slave end at [`Pty::path`] as a serial
/// port; the only difference is that bytes take no time.
///
/// While the slave end is not open, reading returns [`DeviceError::HungUp`]; it may be opened at
/// any time and may then hold bytes written before. A write never blocks: bytes that do not fit
/// into the buffer are [`DeviceError::Stuck`].
///
/// ```
/// use twinrig_runtime::Device;
/// use twinrig_wire::{Pty, SerialPort};
///
/// let mut twin = Pty::open()?;
/// let mut robot = SerialPort::open(twin.path(), 3_333_333)?;
/// robot.write(b"hello")?;
/// let mut received = Vec::new();
/// twin.read(std::time::Duration::from_secs(1), &mut received)?;
/// assert_eq!(received, b"hello");
/// # Ok::<(), twinrig_runtime::DeviceError>(())
/// ```
#[derive(Debug)]
pub struct Pty {
    tty: Tty,
    slave: PathBuf,
    link: Option<PathBuf>,
    /// Marks the link as in use until it is dropped.
    claim: Option<UnixListener>,
}

/// Directory of the slave ends.
const SLAVES: &str = "/dev/pts";

impl Pty {
    /// Opens a new pseudo-terminal.
    ///
    /// # Errors
    /// [`DeviceError::Other`] if the system cannot allocate one.
    pub fn open() -> Result<Self, DeviceError> {
        // Child processes must not inherit the descriptor: it would keep the PTY connected.
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

    /// Makes the slave end available under a fixed name: a symbolic link at `link`, removed on
    /// drop. A link left by an earlier run is replaced; one whose [`Pty`] still exists, in any
    /// process, is not.
    ///
    /// # Errors
    /// [`DeviceError::Other`] if another [`Pty`] is linked there, another file exists at `link`, or
    /// the link cannot be created.
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
                let why = "a file that is not a link to a PTY exists there; \
                           choose another name, or remove the file";
                return Err(failed(why.into()));
            }
            _ => {}
        }
        symlink(&self.slave, link).map_err(|error| failed(error.to_string()))?;
        self.link = Some(link.into());
        self.tty.place = link.display().to_string();
        Ok(self)
    }

    /// Path of the slave end: the link, if there is one.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.slave)
    }
}

/// Claims the name `link` until the listener is dropped or the process ends: a socket in the
/// abstract namespace, which is not part of the file system and leaves nothing behind. It accepts
/// no connections.
fn claim(link: &Path) -> Result<UnixListener, String> {
    let folder = match link.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let folder = fs::metadata(folder).map_err(|error| error.to_string())?;
    // Independent of the path to the folder and of the length of the name.
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
            "another twin is served at that name; choose another name, or end the other".to_owned()
        }
        _ => error.to_string(),
    })
}

/// Sets raw mode: no echo, no conversion of line ends, no Ctrl-C. Applies to every later open.
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

/// The master end exists as long as `self`, so a closed connection means that the slave end is
/// closed.
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
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        self.tty.read_up_to(limit, timeout, bytes).map_err(hung_up)
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
