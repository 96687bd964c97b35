//! How much memory this process may still take, known on Linux only: what the machine has free, what the control groups
//! leave in which the process is (those of containers and batch systems, of version 1 and 2), and what is left of its
//! address space (`ulimit -v`). The least of these counts.

use std::fs;
use std::path::{Path, PathBuf};

/// In bytes.
pub(super) fn bytes() -> Option<u64> {
    let root = Path::new("/");
    let least = [of_machine(root), of_groups(root), of_address_space(root)];
    least.into_iter().flatten().min()
}

/// A file of the system below `root`.
fn read(root: &Path, file: &str) -> Option<String> {
    fs::read_to_string(root.join(file)).ok()
}

/// What programs can still take without swapping.
fn of_machine(root: &Path) -> Option<u64> {
    kibibytes(&read(root, "proc/meminfo")?, "MemAvailable:")
}

/// The number behind `name` in lines such as `MemAvailable:  3 kB`, in bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// How a version of control groups calls its files.
struct Version {
    /// Of the file system in `/proc/self/mountinfo`.
    system: &'static str,
    limit: &'static str,
    usage: &'static str,
    /// In `memory.stat`: what the system takes back where memory is short.
    cache: &'static str,
}

const VERSIONS: [Version; 2] = [
    Version {
        system: "cgroup2",
        limit: "memory.max",
        usage: "memory.current",
        cache: "inactive_file",
    },
    Version {
        system: "cgroup",
        limit: "memory.limit_in_bytes",
        usage: "memory.usage_in_bytes",
        cache: "total_inactive_file",
    },
];

/// What is left in the group of this process and in each around it.
fn of_groups(root: &Path) -> Option<u64> {
    let groups = read(root, "proc/self/cgroup")?;
    let mounts = read(root, "proc/self/mountinfo")?;
    let left = VERSIONS.iter().flat_map(|version| {
        let folders = version.folders(&groups, &mounts);
        folders
            .into_iter()
            .filter_map(|folder| version.left(&root.join(folder)))
    });
    left.min()
}

impl Version {
    /// The folder of this process's group and those around it, as far as they can be seen from here; without the `/`
    /// before them.
    fn folders(&self, groups: &str, mounts: &str) -> Vec<PathBuf> {
        // 0::/path, or 4:cpu,memory:/path
        let group = groups.lines().find_map(|line| {
            let (_, line) = line.split_once(':')?;
            let (controllers, path) = line.split_once(':')?;
            let is_wanted = match self.system {
                "cgroup2" => controllers.is_empty(),
                _ => controllers.split(',').any(|name| name == "memory"),
            };
            is_wanted.then_some(path)
        });
        // 31 24 0:27 /its/root /mount/point rw,relatime shared:9 - cgroup cgroup rw,memory
        let mount = mounts.lines().find_map(|line| {
            let (place, about) = line.split_once(" - ")?;
            let mut about = about.split(' ');
            let is_system = about.next() == Some(self.system);
            let options = about.nth(1).unwrap_or_default();
            let has_memory = self.system == "cgroup2" || options.split(',').any(|o| o == "memory");
            let mut place = place.split(' ').skip(3);
            (is_system && has_memory).then_some((place.next()?, place.next()?))
        });
        let (Some(group), Some((root, point))) = (group, mount) else {
            return Vec::new();
        };
        // In a container the mount may begin at the container's own group.
        let inside = Path::new(group).strip_prefix(root).unwrap_or(Path::new(""));
        let point = Path::new(point.trim_start_matches('/'));
        let folder = point.join(inside.strip_prefix("/").unwrap_or(inside));
        let above = folder
            .ancestors()
            .take_while(|folder| folder.starts_with(point));
        above.map(Path::to_path_buf).collect()
    }

    /// What is left in a group.
    fn left(&self, folder: &Path) -> Option<u64> {
        let number = |file: &str| read(folder, file)?.trim().parse::<u64>().ok();
        let limit = number(self.limit)?;
        let usage = number(self.usage)?;
        let stat = read(folder, "memory.stat").unwrap_or_default();
        let cache = stat.lines().find_map(|line| {
            let (name, bytes) = line.split_once(' ')?;
            (name == self.cache).then(|| bytes.parse::<u64>().ok())?
        });
        Some(limit.saturating_sub(usage.saturating_sub(cache.unwrap_or(0))))
    }
}

/// What is left of the address space, where that has a limit.
#[cfg(unix)]
fn of_address_space(root: &Path) -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    let limit = getrlimit(Resource::As).current?;
    let status = read(root, "proc/self/status").unwrap_or_default();
    Some(limit.saturating_sub(kibibytes(&status, "VmSize:").unwrap_or(0)))
}

#[cfg(not(unix))]
fn of_address_space(_: &Path) -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_available_is_read_and_what_is_odd_is_not_believed() {
        let text = "MemTotal:       16 kB\nMemAvailable:    3 kB\n";
        assert_eq!(kibibytes(text, "MemAvailable:"), Some(3072));
        for odd in [
            "",
            "MemAvailable: kB",
            "MemAvailable: 99999999999999999999 kB",
        ] {
            assert_eq!(kibibytes(odd, "MemAvailable:"), None, "{odd}");
        }
    }

    /// A system with these files.
    fn system(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    #[test]
    fn the_least_that_a_group_and_those_around_it_leave_counts_less_what_is_cached() {
        let of_second = [
            ("proc/self/cgroup", "0::/jobs/seven\n"),
            (
                "proc/self/mountinfo",
                "1 0 8:1 / / rw - ext4 /dev/a rw\n31 24 0:27 / /sys/fs/cgroup rw - cgroup2 cgroup rw\n",
            ),
            ("sys/fs/cgroup/jobs/seven/memory.max", "max\n"),
            ("sys/fs/cgroup/jobs/seven/memory.current", "70\n"),
            ("sys/fs/cgroup/jobs/memory.max", "1000\n"),
            ("sys/fs/cgroup/jobs/memory.current", "300\n"),
            (
                "sys/fs/cgroup/jobs/memory.stat",
                "anon 9\ninactive_file 100\n",
            ),
        ];
        assert_eq!(of_groups(system(&of_second).path()), Some(800));
        let of_first = [
            (
                "proc/self/cgroup",
                "5:cpu:/x\n4:blkio,memory:/docker/ab/job\n0::/\n",
            ),
            (
                "proc/self/mountinfo",
                "9 8 0:9 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu\n\
                 10 8 0:9 /docker/ab /sys/fs/cgroup/memory rw shared:9 - cgroup cgroup rw,blkio,memory\n",
            ),
            (
                "sys/fs/cgroup/memory/job/memory.limit_in_bytes",
                "9223372036854771712\n",
            ),
            ("sys/fs/cgroup/memory/job/memory.usage_in_bytes", "1\n"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "500\n"),
            ("sys/fs/cgroup/memory/memory.usage_in_bytes", "600\n"),
            (
                "sys/fs/cgroup/memory/memory.stat",
                "total_inactive_file 150\n",
            ),
        ];
        assert_eq!(of_groups(system(&of_first).path()), Some(50));
        assert_eq!(of_groups(system(&of_first[..2]).path()), None);
        assert_eq!(of_groups(system(&[]).path()), None);
    }
}
