//! The `terrain` command.
fn main() {}
