//! One shape for everything that can be wrong with a file: which file, where in it, what was found, what was expected,
//! and how to mend it. Each prints as one line.

use std::fmt::{self, Display};
use std::io;
use std::path::Path;

use thiserror::Error;

use crate::grid::GridError;

/// What is wrong with a file, for code that branches on it; people read the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadErrorKind {
    /// The file, or the sidecar it needs, cannot be opened or read.
    Io,
    /// No reader for this extension or file name.
    Name,
    /// The file is not of the format its name says.
    Magic,
    /// The file ends before what its header promises, or holds more.
    Truncated,
    /// The header contradicts itself or cannot be.
    Header,
    /// A value cannot be: not a number, not finite, or no value at all.
    Value,
    /// A sound file that uses a feature we do not read.
    Unsupported,
}

/// A file that could not be read as a raster.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{file}: {place}: {found}; expected {expected}; {mend}")]
pub struct ReadError {
    /// The file as it was named by the caller.
    pub file: Box<str>,
    /// What is wrong.
    pub kind: ReadErrorKind,
    /// The line, tag, byte, strip or sample.
    pub place: Box<str>,
    /// What stands there.
    pub found: Box<str>,
    /// What should.
    pub expected: Box<str>,
    /// What to do about it.
    pub mend: Box<str>,
}

impl ReadError {
    /// An error at `place` of `file`. Control characters are replaced, so that it prints as one line.
    pub fn new(
        file: &str,
        kind: ReadErrorKind,
        place: impl Display,
        found: impl Display,
        expected: impl Display,
        mend: impl Display,
    ) -> ReadError {
        let [file, place, found, expected, mend] =
            [one_line(file), one_line(place), one_line(found), one_line(expected), one_line(mend)].map(Into::into);
        ReadError { file, kind, place, found, expected, mend }
    }

    pub(super) fn io(file: &str, error: &io::Error) -> ReadError {
        let mend = match error.kind() {
            io::ErrorKind::NotFound => "check the path",
            io::ErrorKind::PermissionDenied => "check the permissions of the file",
            _ => "check the disk, or copy the file again",
        };
        ReadError::new(file, ReadErrorKind::Io, "opening or reading", error, "a readable file", mend)
    }

    pub(super) fn grid(file: &str, place: impl Display, error: &GridError) -> ReadError {
        let expected = "a raster with positive, finite spacing and finite corners";
        let mend = "correct the numbers of the header";
        ReadError::new(file, ReadErrorKind::Header, place, error, expected, mend)
    }
}

/// A raster or mesh that could not be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The file system refused.
    #[error("{file}: writing: {source}; check that the folder exists, can be written to and has room")]
    Io {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// The format cannot hold this.
    #[error("{file}: {problem}; {mend}")]
    Unrepresentable {
        /// The file.
        file: String,
        /// What the format cannot hold.
        problem: String,
        /// What to do about it.
        mend: String,
    },
    /// No writer for this extension.
    #[error("{file}: no writer for the extension {extension:?}; use one of {known}")]
    Extension {
        /// The file.
        file: String,
        /// Its extension.
        extension: String,
        /// The extensions there are writers for.
        known: String,
    },
}

impl WriteError {
    pub(super) fn cannot(path: &Path, problem: impl Display, mend: impl Display) -> WriteError {
        WriteError::Unrepresentable { file: name_of(path), problem: one_line(problem), mend: one_line(mend) }
    }
}

/// An error inside a writer that does not yet know its file: turned into a [`WriteError`] by [`name_file`].
#[derive(Debug)]
pub(super) enum Failure {
    Io(io::Error),
    Other(String),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Failure {
        Failure::Io(error)
    }
}

impl Failure {
    pub(super) fn other(problem: impl Display) -> Failure {
        Failure::Other(one_line(problem))
    }
}

/// Puts the name of the file on a failure.
pub(super) fn name_file(path: &Path) -> impl Fn(Failure) -> WriteError + '_ {
    move |failure| match failure {
        Failure::Io(source) => WriteError::Io { file: name_of(path), source },
        Failure::Other(problem) => WriteError::cannot(path, problem, "write another format"),
    }
}

/// A path as it appears in messages.
pub(super) fn name_of(path: &Path) -> String {
    one_line(path.display())
}

/// A token of a file as it appears in messages: quoted, and cut when it is long.
pub(super) fn quoted(bytes: &[u8]) -> String {
    let shown = String::from_utf8_lossy(bytes.get(..40).unwrap_or(bytes));
    if bytes.len() > 40 { format!("{shown:?}…") } else { format!("{shown:?}") }
}

fn one_line(text: impl Display) -> String {
    struct Flat(String);
    impl fmt::Write for Flat {
        fn write_str(&mut self, part: &str) -> fmt::Result {
            self.0.extend(part.chars().map(|c| if c.is_control() { ' ' } else { c }));
            Ok(())
        }
    }
    let mut flat = Flat(String::new());
    // Writing to a String cannot fail; a Display that reports an error has then said all it can.
    let _ = fmt::Write::write_fmt(&mut flat, format_args!("{text}"));
    flat.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_one_line_whatever_the_file_holds() {
        let error =
            ReadError::new("a\nb.asc", ReadErrorKind::Value, "line 7", quoted(b"1\n2\x00"), "a number", "mend\r\nit");
        assert_eq!(error.to_string(), r#"a b.asc: line 7: "1\n2\0"; expected a number; mend  it"#);
    }

    #[test]
    fn long_tokens_are_cut() {
        assert!(quoted(&[b'x'; 5000]).len() < 60);
    }
}
