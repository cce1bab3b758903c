//! The first directory of a TIFF file (TIFF 6.0 §2, BigTIFF), every entry checked to lie inside the file.

use super::super::error::{ReadError, ReadErrorKind};

pub(super) struct Directory<'a> {
    bytes: &'a [u8],
    name: &'a str,
    little: bool,
    entries: Vec<Entry>,
}

struct Entry {
    tag: u16,
    kind: u16,
    count: usize,
    /// Byte of the first value.
    at: usize,
}

const MEND_COPY: &str = "copy the whole file again";

impl<'a> Directory<'a> {
    pub fn read(bytes: &'a [u8], name: &'a str) -> Result<Directory<'a>, ReadError> {
        let mut directory = Directory { bytes, name, little: bytes.starts_with(b"II"), entries: Vec::new() };
        let magic = if bytes.starts_with(b"II") || bytes.starts_with(b"MM") { directory.uint(2, 2) } else { None };
        let big = match magic {
            Some(42) => false,
            Some(43) if directory.uint(4, 2) == Some(8) => true,
            _ => {
                let (found, mend) = ("other bytes", "check that the file is a TIFF, and whole");
                let expected = "the signature II*, MM* or that of BigTIFF";
                return Err(ReadError::new(name, ReadErrorKind::Magic, "byte 0", found, expected, mend));
            }
        };
        let (word, count_size, entry_size) = if big { (8, 8, 20) } else { (4, 2, 12) };
        let first = directory.uint(if big { 8 } else { 4 }, word);
        let first = first.and_then(|at| usize::try_from(at).ok()).filter(|&at| at < bytes.len());
        let start = first.ok_or_else(|| directory.cut("the offset of the first directory"))?;
        let count = directory.uint(start, count_size).ok_or_else(|| directory.cut("the first directory"))?;
        let room = (bytes.len() - start) / entry_size;
        let count = usize::try_from(count).ok().filter(|&n| n <= room);
        let count = count.ok_or_else(|| directory.cut("the first directory"))?;
        for k in 0..count {
            let at = start + count_size + k * entry_size;
            if let Some(entry) = directory.entry(at, word)? {
                directory.entries.push(entry);
            }
        }
        Ok(directory)
    }

    /// The entry at byte `at`; `None` for a type of value that this reader does not know.
    fn entry(&self, at: usize, word: usize) -> Result<Option<Entry>, ReadError> {
        let cut = || self.cut("the first directory");
        let tag = self.uint(at, 2).ok_or_else(cut)? as u16;
        let kind = self.uint(at + 2, 2).ok_or_else(cut)? as u16;
        let count = self.uint(at + 4, word).ok_or_else(cut)?;
        let Some(size) = size_of_kind(kind) else { return Ok(None) };
        let inline = at + 4 + word;
        let length = usize::try_from(count).ok().and_then(|count| count.checked_mul(size));
        let start = match length {
            Some(length) if length <= word => Some(inline),
            _ => usize::try_from(self.uint(inline, word).ok_or_else(cut)?).ok(),
        };
        let within = start
            .zip(length)
            .filter(|&(start, length)| start.checked_add(length).is_some_and(|end| end <= self.bytes.len()));
        match within {
            Some((start, length)) => Ok(Some(Entry { tag, kind, count: length / size, at: start })),
            None => Err(self.cut(&format!("tag {}, {count} values", named(tag)))),
        }
    }

    pub fn is_little_endian(&self) -> bool {
        self.little
    }

    fn cut(&self, place: &str) -> ReadError {
        let found = format!("it reaches beyond the {} bytes of the file", self.bytes.len());
        ReadError::new(self.name, ReadErrorKind::Truncated, place, found, "it inside of the file", MEND_COPY)
    }

    fn find(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    /// An unsigned number of `size` ≤ 8 bytes at byte `at`.
    fn uint(&self, at: usize, size: usize) -> Option<u64> {
        let bytes = self.bytes.get(at..at.checked_add(size)?)?;
        let fold = |value: u64, &byte: &u8| (value << 8) | u64::from(byte);
        Some(if self.little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) })
    }

    /// An error about the value of a tag.
    pub fn wrong(
        &self,
        kind: ReadErrorKind,
        tag: u16,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        mend: &str,
    ) -> ReadError {
        ReadError::new(self.name, kind, format!("tag {}", named(tag)), found, expected, mend)
    }

    /// The unsigned numbers of a tag, if it is there.
    pub fn unsigned(&self, tag: u16) -> Result<Option<Vec<u64>>, ReadError> {
        self.numbers(tag, &[1, 3, 4, 16], "unsigned integers", |at, size, _| self.uint(at, size))
    }

    /// The first unsigned number of a tag, or `default` where it is absent.
    pub fn first(&self, tag: u16, default: u64) -> Result<u64, ReadError> {
        Ok(self.unsigned(tag)?.and_then(|values| values.first().copied()).unwrap_or(default))
    }

    /// The floating-point numbers of a tag, if it is there.
    pub fn doubles(&self, tag: u16) -> Result<Option<Vec<f64>>, ReadError> {
        self.numbers(tag, &[11, 12], "floating-point numbers", |at, size, kind| {
            let bits = self.uint(at, size)?;
            Some(if kind == 11 { f64::from(f32::from_bits(bits as u32)) } else { f64::from_bits(bits) })
        })
    }

    fn numbers<T>(
        &self,
        tag: u16,
        kinds: &[u16],
        what: &str,
        get: impl Fn(usize, usize, u16) -> Option<T>,
    ) -> Result<Option<Vec<T>>, ReadError> {
        let Some(entry) = self.find(tag) else { return Ok(None) };
        if !kinds.contains(&entry.kind) {
            let found = format!("values of type {}", entry.kind);
            return Err(self.wrong(
                ReadErrorKind::Header,
                tag,
                found,
                what,
                "write the file again with gdal_translate",
            ));
        }
        let size = size_of_kind(entry.kind).unwrap_or(1);
        // In range by the check of the entry, so no value is dropped.
        Ok(Some((0..entry.count).filter_map(|k| get(entry.at + k * size, size, entry.kind)).collect()))
    }

    /// The text of a tag up to its closing NUL, if it is there; a byte that is not ASCII becomes one '?', so that the
    /// offsets of the keys hold.
    pub fn text(&self, tag: u16) -> Option<String> {
        let entry = self.find(tag).filter(|entry| size_of_kind(entry.kind) == Some(1))?;
        let bytes = self.bytes.get(entry.at..entry.at + entry.count)?;
        let end = bytes.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
        Some(bytes[..end].iter().map(|&b| if b.is_ascii() { char::from(b) } else { '?' }).collect())
    }
}

fn size_of_kind(kind: u16) -> Option<usize> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16 | 17 | 18 => Some(8),
        _ => None,
    }
}

fn named(tag: u16) -> String {
    let name = match tag {
        256 => "ImageWidth",
        257 => "ImageLength",
        258 => "BitsPerSample",
        259 => "Compression",
        262 => "PhotometricInterpretation",
        273 => "StripOffsets",
        277 => "SamplesPerPixel",
        278 => "RowsPerStrip",
        279 => "StripByteCounts",
        317 => "Predictor",
        322 => "TileWidth",
        323 => "TileLength",
        324 => "TileOffsets",
        325 => "TileByteCounts",
        339 => "SampleFormat",
        33550 => "ModelPixelScale",
        33922 => "ModelTiepoint",
        34264 => "ModelTransformation",
        34735 => "GeoKeyDirectory",
        34736 => "GeoDoubleParams",
        34737 => "GeoAsciiParams",
        42112 => "GDAL_METADATA",
        42113 => "GDAL_NODATA",
        _ => return tag.to_string(),
    };
    format!("{tag} ({name})")
}
