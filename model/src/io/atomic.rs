//! A file appears whole or not at all: it is written beside its destination under another name, then renamed.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a file through `write` into a temporary file of the same folder and renames it to `path`.
///
/// When `write` fails the temporary file is removed and what stood at `path` before stays. The writer can seek. The
/// file is not forced to the disk: this guards against an interrupted process, not against a power cut.
///
/// # Errors
/// Whatever `write` returns; an `io::Error` when the folder does not exist, cannot be written to, or is full.
pub fn atomic_write<E, F>(path: &Path, write: F) -> Result<(), E>
where
    E: From<io::Error>,
    F: FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
{
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".terrain-").suffix(".part");
    #[cfg(unix)]
    {
        // tempfile's own default is 0600; an output is an ordinary file, subject to the umask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(folder)?;
    {
        let mut buffered = BufWriter::new(temporary.as_file_mut());
        write(&mut buffered)?;
        buffered.flush()?;
    }
    temporary.persist(path).map_err(|failure| failure.error)?;
    Ok(())
}

/// [`atomic_write`] of bytes that are already there.
///
/// # Errors
/// As [`atomic_write`].
pub fn atomic_write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    atomic_write(path, |file| file.write_all(bytes))
}

/// Removes `path` if it is there.
pub(super) fn remove_if_present(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        atomic_write_bytes(&path, b"old").unwrap();
        let failed: io::Result<()> = atomic_write(&path, |file| {
            file.write_all(b"new, half")?;
            Err(io::Error::other("interrupted"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn success_replaces_the_file_and_leaves_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        atomic_write_bytes(&path, b"old").unwrap();
        atomic_write_bytes(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn missing_folder_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        assert!(atomic_write_bytes(&folder.path().join("none/a.bin"), b"x").is_err());
    }
}
