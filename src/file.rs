//! Files that are there whole or not at all: the bytes go to a temporary file in the target's folder,
//! reach the disk, and then take the target's name in one step. After any failure the old file, if there
//! was one, is untouched and nothing new is left behind; what a process that was killed has left is removed by who next
//! writes in the folder from the same machine.

pub(crate) mod text;

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// Writes `bytes` as the file `path`, which is there whole or not at all.
///
/// # Errors
/// Where the file must not be replaced, or the file system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    stream_atomically(path, |file| file.write_all(bytes))
}

/// Writes the file `path` piece by piece, as `write` does it.
pub(crate) fn stream_atomically(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> std::io::Result<()>,
) -> Result<()> {
    /// Bytes handed to the system at a time.
    const BUFFER: usize = 1 << 18;
    let target = resolve(path)?;
    let refused = |cause: &std::io::Error| Error::system("write", path, cause);
    fs::create_dir_all(folder_of(&target)).map_err(|e| refused(&e))?;
    let mut file = temporary_beside(&target).map_err(|e| refused(&e))?;
    let mut buffer = BufWriter::with_capacity(BUFFER, file.as_file_mut());
    write(&mut buffer)
        .and_then(|()| buffer.flush())
        .map_err(|e| refused(&e))?;
    drop(buffer);
    file.as_file().sync_all().map_err(|e| refused(&e))?;
    file.persist(&target).map_err(|e| refused(&e.error))?;
    // The new name must reach the disk too. Some file systems cannot sync a folder; the file itself is
    // whole either way, so that is no failure of the write.
    if let Ok(folder) = File::open(folder_of(&target)) {
        folder.sync_all().ok();
    }
    Ok(())
}

/// Leaves a file for the next time, whole or not at all, in a folder that is made where it is not there. It may be lost
/// with the machine's power: nobody waits for the disk.
pub(crate) fn leave(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let folder = folder_of(path);
    fs::create_dir_all(folder)?;
    remove_stale(folder);
    let mut file = temporary_beside(path)?;
    write(&mut file)?;
    file.persist(path)?;
    Ok(())
}

/// What stands at the end of a file that is [left](leave): a hash of the checksums of its parts, which belong to `key`.
pub(crate) fn seal(key: &blake3::Hash, sums: &[u32]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new_keyed(key.as_bytes());
    sums.iter().for_each(|sum| {
        hasher.update(&sum.to_le_bytes());
    });
    hasher.finalize()
}

/// Finds out, without leaving anything behind, whether `path` could be written.
///
/// # Errors
/// Where it could not.
pub fn check_writable(path: &Path) -> Result<()> {
    let target = resolve(path)?;
    // Of folders that would be made, the one that they would be made in is tried.
    let folder = existing(folder_of(&target));
    remove_stale(folder);
    temporary_beside(&folder.join("file"))
        .map(drop)
        .map_err(|e| Error::system("write", path, &e))
}

/// The folder, or the nearest above it that is there.
fn existing(folder: &Path) -> &Path {
    match folder.parent() {
        Some(above) if !folder.exists() && above.as_os_str().is_empty() => Path::new("."),
        Some(above) if !folder.exists() => existing(above),
        _ => folder,
    }
}

/// Opens a regular file. Others are refused before they are opened: opening a pipe may wait for ever.
pub(crate) fn open(path: &Path) -> std::io::Result<File> {
    let about = fs::metadata(path)?;
    if about.is_file() {
        return File::open(path);
    }
    Err(std::io::Error::other(match about.is_dir() {
        true => "it is a folder",
        false => "it is no regular file",
    }))
}

/// The file that `path` names, links followed, after checking that it can be replaced.
fn resolve(path: &Path) -> Result<PathBuf> {
    let folder = existing(folder_of(path));
    if !folder.is_dir() {
        let message = format!("{} is not a folder", folder.display());
        return Err(Error::input(message).help("choose another place"));
    }
    let Ok(there) = fs::metadata(path) else {
        return follow(path);
    };
    let name = path.display();
    if there.is_dir() {
        return Err(
            Error::input(format!("{name} is a folder")).help("give the name of a file in it")
        );
    }
    if !there.is_file() {
        return Err(Error::input(format!("{name} is not a regular file")));
    }
    if there.permissions().readonly() {
        return Err(Error::input(format!("{name} is read-only"))
            .help("make it writable or choose another name"));
    }
    fs::canonicalize(path).map_err(|e| Error::system("write", path, &e))
}

/// Fills `bytes` with what a file holds from a place on.
#[cfg(unix)]
pub(crate) fn read_at(file: &File, at: u64, bytes: &mut [u8]) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, at)
}

/// Fills `bytes` with what a file holds from a place on.
#[cfg(windows)]
pub(crate) fn read_at(file: &File, mut at: u64, mut bytes: &mut [u8]) -> std::io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, bytes, at)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            count => {
                at += count as u64;
                bytes = &mut bytes[count..];
            }
        }
    }
    Ok(())
}

/// Where a link leads whose file is not there yet; the path itself where it is none.
fn follow(path: &Path) -> Result<PathBuf> {
    match fs::read_link(path) {
        Ok(target) if folder_of(path).join(&target).exists() => Ok(folder_of(path).join(target)),
        Ok(target) => {
            let (name, target) = (path.display(), target.display());
            let message = format!("{name} is a link to {target}, which is not there");
            Err(Error::input(message).help("remove the link or make what it leads to"))
        }
        Err(_) => Ok(path.to_path_buf()),
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// As names begin on machines whose own is not known.
const NOBODYS: &str = ".etendue--";

/// What the names of this machine's temporary files begin with.
fn prefix_of_machine() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let plain = name.chars().filter(char::is_ascii_alphanumeric);
    format!(".etendue-{}-", plain.take(32).collect::<String>())
}

/// What the names of this process's temporary files begin with.
fn temporary_prefix() -> String {
    format!("{}{}-", prefix_of_machine(), std::process::id())
}

/// Removes temporary files of this machine's processes that are no more: who writes one holds a lock on it, which ends
/// with the process. Young ones stay, for theirs may be about to be locked, and so do those whose file system has no locks.
fn remove_stale(folder: &Path) {
    const AGE: Duration = Duration::from_secs(60);
    let prefix = prefix_of_machine();
    if prefix == NOBODYS {
        return;
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(&prefix) {
            continue;
        }
        let Ok(about) = entry.metadata() else {
            continue;
        };
        let modified = about.modified().ok();
        let age = modified
            .and_then(|time| time.elapsed().ok())
            .unwrap_or_default();
        if about.is_file()
            && age > AGE
            && let Ok(file) = File::open(entry.path())
            && file.try_lock_shared().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Removes what this process has begun to write as `path` or beside it, for who is about to end the process.
pub fn remove_unfinished(path: &Path) {
    let prefix = temporary_prefix();
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    for entry in fs::read_dir(folder_of(&target))
        .into_iter()
        .flatten()
        .flatten()
    {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn temporary_beside(target: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    let prefix = temporary_prefix();
    builder.prefix(&prefix);
    #[cfg(unix)]
    {
        // What any program asks for a new file; the user's umask takes its share.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder_of(target))?;
    // Where there are no locks nothing is removed.
    #[cfg(unix)]
    let _ = file.as_file().try_lock();
    if let Ok(there) = fs::metadata(target) {
        // What takes a file's place is for the same people to read.
        file.as_file().set_permissions(there.permissions())?;
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_whole_and_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_atomically(&path, b"first, and longer").unwrap();
        stream_atomically(&path, |file| {
            file.write_all(b"sec")?;
            file.write_all(b"ond")
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(entries(folder.path()), ["a.exr"]);
    }

    #[test]
    fn what_cannot_be_replaced_is_refused_and_nothing_is_left_behind() {
        let folder = tempfile::tempdir().unwrap();
        let read_only = folder.path().join("locked.exr");
        fs::write(&read_only, b"old").unwrap();
        let mut permissions = fs::metadata(&read_only).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&read_only, permissions).unwrap();
        let subfolder = folder.path().join("sub.exr");
        fs::create_dir(&subfolder).unwrap();
        let below = read_only.join("none/a.exr");
        for (path, message) in [
            (&read_only, "is read-only"),
            (&subfolder, "is a folder"),
            (&below, "is not a folder"),
        ] {
            for error in [
                check_writable(path).unwrap_err(),
                write_atomically(path, b"new").unwrap_err(),
                stream_atomically(path, |_| Ok(())).unwrap_err(),
            ] {
                assert!(error.to_string().contains(message), "{error}");
            }
        }
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        let stopped = stream_atomically(&folder.path().join("new.exr"), |file| {
            file.write_all(b"half")?;
            Err(full)
        });
        assert!(stopped.is_err());
        assert_eq!(fs::read(&read_only).unwrap(), b"old");
        assert_eq!(entries(folder.path()), ["locked.exr", "sub.exr"]);
    }

    #[test]
    fn checking_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        check_writable(&folder.path().join("a.exr")).unwrap();
        assert!(entries(folder.path()).is_empty());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_killed_process_has_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let hour = std::time::SystemTime::now() - Duration::from_secs(3600);
        let make = |name: &str, old: bool| {
            let file = File::create(folder.path().join(name)).unwrap();
            if old {
                file.set_modified(hour).unwrap();
            }
            file
        };
        let here = prefix_of_machine();
        let [stale, young, held] = ["1-a", "2-b", "3-c"].map(|end| format!("{here}{end}"));
        let elsewhere = ".etendue-another-4-d".to_owned();
        drop(make(&stale, true));
        drop(make(&young, false));
        let held_open = make(&held, true);
        held_open.lock().unwrap();
        drop(make(&elsewhere, true));
        drop(make("a.exr", true));
        check_writable(&folder.path().join("b.exr")).unwrap();
        let mut left = vec!["a.exr".to_owned(), young.clone(), held.clone(), elsewhere];
        left.sort();
        assert_eq!(entries(folder.path()), left);
        drop(held_open);
        check_writable(&folder.path().join("b.exr")).unwrap();
        assert!(!folder.path().join(held).exists());
        // While this process writes a file, it is held.
        let file = temporary_beside(&folder.path().join("c.exr")).unwrap();
        file.as_file().set_modified(hour).unwrap();
        remove_stale(folder.path());
        assert!(file.path().exists());
    }

    #[test]
    fn folders_are_made_when_something_is_written_to_them_and_no_sooner() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b/c.exr");
        check_writable(&path).unwrap();
        assert!(entries(folder.path()).is_empty());
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_keeps_its_mode_and_a_broken_link_is_refused() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        fs::write(&path, b"old").unwrap();
        for mode in [0o600, 0o640, 0o664] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            write_atomically(&path, b"new").unwrap();
            assert_eq!(
                fs::metadata(&path).unwrap().permissions().mode() & 0o777,
                mode
            );
        }
        let link = folder.path().join("link.exr");
        symlink("nowhere.exr", &link).unwrap();
        let error = check_writable(&link).unwrap_err().to_string();
        assert!(error.contains("a link to nowhere.exr"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_a_device_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.exr"), folder.path().join("l.exr"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert!(check_writable(Path::new("/dev/null")).is_err());
    }
}
