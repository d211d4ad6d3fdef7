//! Facts that only Linux gives: rights, limits, space.

use std::os::unix::fs::MetadataExt as _;

use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use nix::sys::statvfs::statvfs;
use nix::unistd::{AccessFlags, access as is_accessible};

use super::system::{Access, Limit};

/// Returns the rights of this process to a device.
pub(super) fn access(path: &str) -> Access {
    let rights = AccessFlags::R_OK | AccessFlags::W_OK;
    Access {
        is_granted: is_accessible(path, rights).is_ok(),
        group: group_of(path),
    }
}

/// Returns the name of the group of a file.
fn group_of(path: &str) -> Option<String> {
    let id = std::fs::metadata(path).ok()?.gid().to_string();
    let groups = std::fs::read_to_string("/etc/group").ok()?;
    let mut groups = groups.lines().map(|line| line.split(':'));
    groups.find_map(|mut fields| {
        let name = fields.next()?;
        (fields.nth(1)? == id).then(|| name.to_owned())
    })
}

/// Returns a limit of this process.
pub(super) fn limit(limit: Limit) -> Option<u64> {
    let resource = match limit {
        Limit::RealTimePriority => Resource::RLIMIT_RTPRIO,
        Limit::LockedMemory => Resource::RLIMIT_MEMLOCK,
    };
    let (soft, _) = getrlimit(resource).unwrap_or((0, 0));
    (soft != RLIM_INFINITY).then_some(soft)
}

/// Returns the space for files in the present folder \[byte\].
pub(super) fn free_space() -> Option<u64> {
    let found = statvfs(".").ok()?;
    // The types of the fields differ between systems.
    #[allow(clippy::useless_conversion, reason = "u32 on 32-bit systems")]
    let (blocks, size) = (
        u64::from(found.blocks_available()),
        u64::from(found.fragment_size()),
    );
    blocks.checked_mul(size)
}
