//! The `etendue` command.

fn main() {}
