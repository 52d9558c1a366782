//! The gaitwright binary.

fn main() {}
