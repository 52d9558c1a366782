//! Ends a run of the tests with the number and the names of those that were skipped.
//!
//! Cargo runs the test programs of a package in the order of their names, so this name must be the last one.

use std::fs;
use std::io::ErrorKind;

use gaitwright_tests::skipped;

fn main() {
    if std::env::var_os(skipped::FILE).is_some() {
        return;
    }
    let list = skipped::list();
    let lines = match fs::read_to_string(&list) {
        Ok(lines) => lines,
        Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
        Err(error) => panic!("{}: {error}", list.display()),
    };
    let mut lines: Vec<&str> = lines.lines().collect();
    lines.sort_unstable();
    println!("{} tests were skipped, entirely or in part", lines.len());
    for line in &lines {
        println!("  {line}");
    }
    if !lines.is_empty() {
        fs::remove_file(&list).unwrap();
    }
}
