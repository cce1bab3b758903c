//! The papers' tables as printed, read from the `tables.toml` of each paper's folder. Columns derived from the printed ones
//! are methods, so that no derived number can drift from the table it comes from.

mod genevaux2015;
mod hnaidi2010;
mod paris2019;

pub use genevaux2015::{Genevaux2015Row, Genevaux2015Table1, genevaux2015_table1};
pub use hnaidi2010::{
    Hnaidi2010Curves, Hnaidi2010Table1, Hnaidi2010Table2, Hnaidi2010Times, hnaidi2010_table1, hnaidi2010_table2,
};
pub use paris2019::{Paris2019Row, Paris2019Table1, paris2019_table1};

use serde::Deserialize;

pub(crate) const GENEVAUX2015: &str = include_str!("../../genevaux2015/tables.toml");
pub(crate) const HNAIDI2010: &str = include_str!("../../hnaidi2010/tables.toml");
pub(crate) const PARIS2019: &str = include_str!("../../paris2019/tables.toml");

/// A printed table could not be read; the text names the file, the line and the column.
#[derive(Debug, thiserror::Error)]
#[error("papers/{paper}/tables.toml: {source}")]
pub struct TableError {
    paper: &'static str,
    source: toml::de::Error,
}

/// What a paper's prose says about a quantity that its table gives otherwise: a report prints both.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prose {
    /// Section or caption.
    pub place: String,
    /// What it speaks of.
    pub quantity: String,
    /// The words.
    pub says: String,
}

fn read<T: serde::de::DeserializeOwned>(paper: &'static str, text: &str) -> Result<T, TableError> {
    toml::from_str(text).map_err(|source| TableError { paper, source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_table_is_refused_with_its_file_and_line() {
        let error = read::<genevaux2015::File>("genevaux2015", "[table1]\nhardwear = \"\"\n").unwrap_err().to_string();
        assert!(error.contains("papers/genevaux2015/tables.toml") && error.contains("line 2"), "{error}");
    }
}
