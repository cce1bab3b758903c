//! The report of a run. An experiment fills an [`Outcome`]; the run writes its files, then `report.json` and `index.html`.
//!
//! What depends on the machine goes only to `report.json`, `timings/` and `index.html`: every other file has the same bytes on
//! every run and any number of threads.

mod comparison;
mod csv;
pub mod files;
mod html;
mod json;
mod number;
mod outcome;
mod plot;
mod record;
mod table;
pub mod words;

pub use comparison::{Compared, Comparison, Tolerance};
pub use files::is_file_name;
pub use html::page;
pub use json::report as json;
pub use outcome::{Claim, Control, Deviation, Outcome, OutcomeError, Picture, PngFile};
pub use plot::{Axis, Plot, Scale, Style};
pub use record::{Record, Report};
pub use table::{Cell, Column, Table};
