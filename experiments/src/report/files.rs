//! Writing without half-written files, and the experiment folders, of which only those we made are ever replaced.

use std::fmt::Display;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::experiment::ExperimentError;

/// The file that says a folder is ours to replace.
const MARK: &str = ".made-by-reproduce";
const MARK_TEXT: &str = "`reproduce` made this folder and replaces it on its next run.\n";

/// A file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The name would leave the folder, or is not portable.
    #[error("`{0}` is no file name: use lower-case letters, digits, `-`, `_` and `.`")]
    Name(String),
    /// The disk refused.
    #[error("{path}: {source}")]
    Disk {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A folder with this name holds something we did not make.
    #[error("{0} was not made by `reproduce`: move it away or choose another --out")]
    NotOurs(PathBuf),
}

impl WriteError {
    fn disk(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Disk { path, source }
    }
}

/// Whether a name is safe as a file name on every system: lower case, no separators, no hidden files.
pub fn is_file_name(name: &str) -> bool {
    !name.starts_with('.')
        && !name.is_empty()
        && name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_.".contains(&byte))
}

pub(crate) fn checked(name: &str) -> Result<&str, WriteError> {
    if is_file_name(name) { Ok(name) } else { Err(WriteError::Name(name.into())) }
}

/// Writes a file whole or not at all, making its folder when needed.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(WriteError::disk(folder))?;
    }
    let partial = partial(path);
    fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path)).map_err(|error| {
        let _ = fs::remove_file(&partial);
        WriteError::disk(path)(error)
    })
}

/// Like `write`, for a writer that takes a path.
pub(crate) fn write_with<E: Display>(
    path: &Path,
    write: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), ExperimentError> {
    let partial = partial(path);
    let written = write(&partial).map_err(ExperimentError::failed);
    let renamed = written.and_then(|()| Ok(fs::rename(&partial, path).map_err(WriteError::disk(path))?));
    if renamed.is_err() {
        let _ = fs::remove_file(&partial);
    }
    renamed
}

/// A neighbour of the path, so that the rename stays on one disk; it keeps the extension, by which writers choose a format.
fn partial(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".partial-{name}"))
}

/// Refuses a folder that holds something and does not carry our mark.
pub(crate) fn check_ours(path: &Path) -> Result<(), WriteError> {
    let occupied = path.exists() && fs::read_dir(path).map_err(WriteError::disk(path))?.next().is_some();
    if occupied && !path.join(MARK).is_file() { Err(WriteError::NotOurs(path.to_owned())) } else { Ok(()) }
}

/// An empty folder of ours at `path`, marked; an older one of ours is removed first.
pub(crate) fn fresh_folder(path: &Path) -> Result<(), WriteError> {
    check_ours(path)?;
    if path.exists() {
        fs::remove_dir_all(path).map_err(WriteError::disk(path))?;
    }
    write(&path.join(MARK), MARK_TEXT.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_ours_is_replaced_and_another_is_refused() {
        let out = tempfile::tempdir().unwrap();
        let ours = out.path().join("paper/x");
        fresh_folder(&ours).unwrap();
        write(&ours.join("old.csv"), b"old").unwrap();
        fresh_folder(&ours).unwrap();
        assert!(!ours.join("old.csv").exists());

        let theirs = out.path().join("paper/y");
        write(&theirs.join("thesis.txt"), b"years of work").unwrap();
        assert!(matches!(fresh_folder(&theirs), Err(WriteError::NotOurs(_))));
        assert!(theirs.join("thesis.txt").exists());
    }
}
