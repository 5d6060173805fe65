//! The program `os-convert`.
fn main() {}
