//! Arguments of the examples: `--name value`.

/// The value after `name` on the command line, else `default`.
pub(crate) fn argument(name: &str, default: &str) -> String {
    let arguments: Vec<String> = std::env::args().collect();
    let place = arguments.iter().position(|a| a == name);
    place.and_then(|i| arguments.get(i + 1)).cloned().unwrap_or_else(|| default.to_owned())
}
