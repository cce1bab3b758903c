//! Which functions of the library return a bound, found in its source by their return type, and which of them no certificate names.

use std::collections::BTreeSet;
use std::path::Path;
use terrain_papers::certificates;

/// Types whose return makes a function one that promises bounds.
const TYPES: &[&str] = &["Bounds", "RayBounds", "Option<Bounds>", "NoiseBounds"];

/// A declaration without a body, or a dispatch over all nodes, promises nothing of its own.
const DISPATCH: &[&str] = &["operator/mod.rs", "primitive/mod.rs", "trace/mod.rs"];

/// `file::function` of every function below `folder` whose return type is a bound, in the code before the tests.
fn returned(folder: &Path, below: &Path, found: &mut BTreeSet<String>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            returned(&path, below, found)?;
            continue;
        }
        let Ok(relative) = path.strip_prefix(below) else { continue };
        let file = relative.to_string_lossy().replace('\\', "/");
        if !file.ends_with(".rs") {
            continue;
        }
        let text = std::fs::read_to_string(&path)?;
        let dispatch = DISPATCH.contains(&file.as_str());
        found.extend(declared(&text, dispatch).into_iter().map(|name| format!("{file}::{name}")));
    }
    Ok(())
}

/// The names of functions with a body that return a bound. Of a file that dispatches, methods are left out.
fn declared(text: &str, dispatch: bool) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap_or(text);
    let mut names = Vec::new();
    for (at, _) in code.match_indices("fn ") {
        let rest = &code[at + 3..];
        let Some(end) = rest.find(['{', ';']) else { continue };
        let signature = &rest[..end];
        let Some((_, result)) = signature.rsplit_once("->") else { continue };
        let name: String = signature.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let result = result.trim();
        let method = signature.contains("self");
        if rest.as_bytes()[end] == b'{' && TYPES.contains(&result) && !(dispatch && method) {
            names.push(name);
        }
    }
    names
}

/// What was found.
pub struct Coverage {
    /// Functions that return a bound.
    pub functions: usize,
    /// Those that no certificate names.
    pub without: Vec<String>,
    /// What certificates name and the source does not have.
    pub unknown: Vec<String>,
}

/// Compares the source below `root` with what certificates name.
///
/// # Errors
/// When the source cannot be read.
pub fn coverage(root: &Path) -> std::io::Result<Coverage> {
    let source = root.join("model/src");
    let mut found = BTreeSet::new();
    returned(&source, &source, &mut found)?;
    let named: BTreeSet<String> =
        certificates::all().flat_map(|certificate| certificate.certifies).map(|name| (*name).to_owned()).collect();
    Ok(Coverage {
        functions: found.len(),
        without: found.difference(&named).cloned().collect(),
        unknown: named.difference(&found).cloned().collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_that_return_bounds_are_found_by_type() {
        let text = "pub fn a(x: f64) -> Bounds {}\nfn b() -> Bounds;\nfn c(&self) -> RayBounds {\n}\nfn d() -> f64 {}\n\
                    fn e(\n x: f64,\n) -> Bounds {}\n#[cfg(test)] mod t { fn f() -> Bounds {} }";
        assert_eq!(declared(text, false), ["a", "c", "e"]);
        assert_eq!(declared(text, true), ["a", "e"]);
    }

    #[test]
    fn every_bound_is_named_by_a_certificate_and_every_name_exists() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let coverage = coverage(root).unwrap();
        assert!(coverage.functions > 20);
        assert_eq!(coverage.without, Vec::<String>::new(), "no certificate names these");
        assert_eq!(coverage.unknown, Vec::<String>::new(), "certificates name these, the source does not have them");
    }
}
