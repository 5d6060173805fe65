//! The program `os`.
fn main() {}
