//! Imports between the files of a crate, read from their text: `use` declarations and paths in code. A re-export leads to
//! the file that defines the name. Modules of unit tests are left out, in files of their own as well.

use std::collections::{BTreeMap, BTreeSet};

/// A module by its path in the crate; empty for the root.
type Module = Vec<String>;

/// For each file, the files that it imports from.
pub type Imports = BTreeMap<String, BTreeSet<String>>;

/// A `use` declaration.
struct Use {
    path: Vec<String>,
    /// The last segment, or what follows `as`.
    name: String,
    is_export: bool,
}

/// A file of a crate.
struct Source {
    file: String,
    uses: Vec<Use>,
    /// Paths in the code itself.
    paths: Vec<Vec<String>>,
}

/// The imports of a crate, from its files by their path below `src`, with their texts.
pub fn of_crate(files: &[(String, String)]) -> Imports {
    let tests: Vec<Module> = files.iter().flat_map(|(file, text)| test_modules(&module_of(file), text)).collect();
    let sources: BTreeMap<Module, Source> = files
        .iter()
        .map(|(file, text)| (module_of(file), source(file, &code_of(text))))
        .filter(|(module, _)| !tests.iter().any(|tests| module.starts_with(tests)))
        .collect();
    let mut imports = Imports::new();
    for (module, source) in &sources {
        let used = source.uses.iter().filter(|used| !used.is_export).map(|used| &used.path);
        let targets = used.chain(&source.paths).filter_map(|path| definer(&sources, module, path, 0));
        let others: BTreeSet<String> =
            targets.filter(|target| target != module).map(|target| sources[&target].file.clone()).collect();
        imports.insert(source.file.clone(), others);
    }
    imports
}

/// The imports between the modules of each folder: what the files of a module, and of its folder, import from the other
/// modules beside it. The crate itself is the first folder.
pub fn between_modules(imports: &Imports) -> Vec<Imports> {
    let modules: BTreeSet<Module> = imports.keys().map(|file| module_of(file)).collect();
    let folders: BTreeSet<&[String]> =
        modules.iter().flat_map(|module| (0..module.len()).map(|depth| &module[..depth])).collect();
    folders.into_iter().map(|folder| within(imports, folder)).collect()
}

/// The imports between the modules of one folder.
fn within(imports: &Imports, folder: &[String]) -> Imports {
    let part = |file: &str| {
        let module = module_of(file);
        (module.len() > folder.len() && module.starts_with(folder)).then(|| module[..=folder.len()].join("::"))
    };
    let mut found = Imports::new();
    for (file, others) in imports {
        let Some(own) = part(file) else { continue };
        let others = others.iter().filter_map(|other| part(other)).filter(|other| *other != own);
        found.entry(own.clone()).or_default().extend(others);
    }
    found
}

/// A circle of files that import from each other, if there is one.
pub fn circle(imports: &Imports) -> Option<Vec<String>> {
    let mut done = BTreeSet::new();
    imports.keys().find_map(|file| visit(imports, file, &mut Vec::new(), &mut done))
}

fn visit(imports: &Imports, file: &str, way: &mut Vec<String>, done: &mut BTreeSet<String>) -> Option<Vec<String>> {
    if let Some(place) = way.iter().position(|earlier| earlier == file) {
        return Some(way[place..].to_vec());
    }
    if done.contains(file) {
        return None;
    }
    way.push(file.to_owned());
    let found = imports[file].iter().find_map(|other| visit(imports, other, way, done));
    way.pop();
    done.insert(file.to_owned());
    found
}

fn module_of(file: &str) -> Module {
    let mut parts: Module = file.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if matches!(parts.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        parts.pop();
    }
    parts
}

/// The modules of unit tests that a file declares and that have files of their own.
fn test_modules(parent: &Module, text: &str) -> Vec<Module> {
    let mut found = Vec::new();
    for (at, attribute) in text.match_indices("#[cfg(test)]") {
        let mut lines = text[at + attribute.len()..]
            .lines()
            .map(str::trim)
            .skip_while(|line| line.is_empty() || line.starts_with("#["));
        let declared = lines.next().and_then(|line| line.strip_suffix(';')?.strip_prefix("mod "));
        found.extend(declared.map(|name| [&parent[..], &[name.to_owned()]].concat()));
    }
    found
}

/// The file that defines what a path names, as seen from a module. `None` for other crates.
fn definer(sources: &BTreeMap<Module, Source>, from: &Module, path: &[String], depth: usize) -> Option<Module> {
    let mut rest = path;
    let mut module = from.clone();
    match rest.first()?.as_str() {
        "crate" => (module, rest) = (Module::new(), &rest[1..]),
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|part| part == "super") {
                module.pop()?;
                rest = &rest[1..];
            }
        }
        first => {
            module.push(first.to_owned());
            let is_child = sources.contains_key(&module);
            module.pop();
            if !is_child {
                return None;
            }
        }
    }
    while let Some(part) = rest.first() {
        module.push(part.clone());
        if !sources.contains_key(&module) {
            module.pop();
            break;
        }
        rest = &rest[1..];
    }
    let source = sources.get(&module)?;
    let exported = rest.first().and_then(|name| source.uses.iter().find(|used| used.is_export && used.name == *name));
    match exported {
        // Deeper than any chain of exports here.
        Some(export) if depth < 8 => definer(sources, &module, &export.path, depth + 1).or(Some(module)),
        _ => Some(module),
    }
}

fn source(file: &str, code: &str) -> Source {
    let (mut uses, mut body) = (Vec::new(), String::new());
    let mut rest = code;
    while let Some(start) = next_use(rest) {
        let end = start + rest[start..].find(';').unwrap_or(rest.len() - start);
        let before = rest[..start].trim_end();
        let is_export = before.ends_with("pub") || before.ends_with(')') && visibility(before);
        expand("", rest[start + "use ".len()..end].trim(), is_export, &mut uses);
        body.push_str(&rest[..start]);
        rest = &rest[end..];
    }
    body.push_str(rest);
    Source { file: file.to_owned(), uses, paths: inline_paths(&body) }
}

/// Whether the text ends with `pub(...)`.
fn visibility(text: &str) -> bool {
    text.rfind('(').is_some_and(|open| text[..open].ends_with("pub"))
}

/// The next `use ` at the start of a word.
fn next_use(text: &str) -> Option<usize> {
    let is_start = |at: &usize| text[..*at].chars().next_back().is_none_or(char::is_whitespace);
    text.match_indices("use ").map(|(at, _)| at).find(is_start)
}

/// Adds every path of a tree such as `a::{b, c::{self, d as e}}`.
fn expand(prefix: &str, tree: &str, is_export: bool, uses: &mut Vec<Use>) {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let inner = tree[open + 1..].trim_end().trim_end_matches('}');
        let (mut depth, mut start) = (0, 0);
        let prefix = format!("{prefix}{}", &tree[..open]);
        for (at, c) in inner.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    expand(&prefix, &inner[start..at], is_export, uses);
                    start = at + 1;
                }
                _ => {}
            }
        }
        // A brace of an inner tree that was trimmed with the outer one does no harm: names end before it.
        expand(&prefix, &inner[start..], is_export, uses);
    } else if !tree.is_empty() {
        let (path, alias) = tree.split_once(" as ").map_or((tree, None), |(path, alias)| (path, Some(alias)));
        let mut path: Vec<String> = format!("{prefix}{path}").split("::").map(|part| part.trim().to_owned()).collect();
        if path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        let name = alias.map_or_else(|| path.last().cloned().unwrap_or_default(), |alias| alias.trim().to_owned());
        uses.push(Use { path, name, is_export });
    }
}

/// Paths in code of more than one segment: from the crate, from a parent, or from a module of this file.
fn inline_paths(code: &str) -> Vec<Vec<String>> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let mut paths = Vec::new();
    let mut at = 0;
    while let Some(start) = code[at..].find(is_part).map(|found| at + found) {
        let end = code[start..].find(|c| !is_part(c)).map_or(code.len(), |found| start + found);
        let path = code[start..end].trim_end_matches(':');
        // `<T as Trait>::name` and `$crate::name` begin before the word; `pub(in crate::a)` imports nothing.
        let is_whole = !path.starts_with(':') && !code[..start].ends_with('$') && !code[..start].ends_with("(in ");
        if is_whole && path.contains("::") {
            paths.push(path.split("::").map(str::to_owned).collect());
        }
        at = end;
    }
    paths
}

/// The text without comments and without modules of unit tests.
fn code_of(text: &str) -> String {
    let mut code: String = String::new();
    for line in text.lines() {
        code.push_str(line.split("//").next().unwrap_or(""));
        code.push('\n');
    }
    while let Some(start) = code.find("#[cfg(test)]") {
        let Some(open) = code[start..].find(['{', ';']).map(|at| start + at) else { break };
        let end = if code[open..].starts_with(';') { open + 1 } else { closing(&code, open) };
        code.replace_range(start..end, "");
    }
    code
}

/// The end of the block that opens at `open`.
fn closing(code: &str, open: usize) -> usize {
    let mut depth = 0;
    for (at, c) in code[open..].char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return open + at + 1;
        }
    }
    code.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn imports(files: &[(&str, &str)]) -> Imports {
        let files: Vec<_> = files.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect();
        of_crate(&files)
    }

    #[test]
    fn exports_lead_to_the_file_that_defines_a_name() {
        let found = imports(&[
            ("lib.rs", "mod a;\nmod b;\npub use a::{Thing, other as renamed};\n"),
            ("a.rs", "pub struct Thing;\npub fn other() {}\n"),
            (
                "b/mod.rs",
                "mod c;\nuse super::Thing;\n// use crate::missing;\npub(in crate::b) fn f() { crate::renamed() }\n",
            ),
            ("b/c.rs", "use std::fmt;\nuse super::super::a::{self, Thing};\n"),
        ]);
        assert!(found["lib.rs"].is_empty());
        assert_eq!(found["b/mod.rs"], BTreeSet::from(["a.rs".to_owned()]));
        assert_eq!(found["b/c.rs"], BTreeSet::from(["a.rs".to_owned()]));
        assert_eq!(circle(&found), None);
    }

    #[test]
    fn paths_that_begin_with_a_child_module_are_imports() {
        let parent = "mod child;\npub struct Part;\nfn f() -> u8 { child::g(std::u8::MAX) }\n";
        let found = imports(&[("lib.rs", parent), ("child.rs", "use super::Part;\npub fn g() {}\n")]);
        assert_eq!(circle(&found), Some(vec!["child.rs".to_owned(), "lib.rs".to_owned()]));
    }

    #[test]
    fn circles_of_modules_are_found_where_files_have_none() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\n"),
            ("a/mod.rs", "mod low;\nmod high;\n"),
            ("a/low.rs", "pub struct Low;\n"),
            ("a/high.rs", "use crate::b::Middle;\n"),
            ("b.rs", "use crate::a::low::Low;\npub struct Middle;\n"),
        ];
        let found = imports(&files);
        assert_eq!(circle(&found), None);
        let circles: Vec<_> = between_modules(&found).iter().filter_map(circle).collect();
        assert_eq!(circles, [["a", "b"]]);

        // In a folder of the crate.
        let nested: Vec<_> = files
            .map(|(file, text)| (format!("n/{file}").replace("lib", "mod"), text.replace("crate::", "crate::n::")))
            .into();
        let found = of_crate(&[&nested[..], &[("lib.rs".to_owned(), "mod n;".to_owned())]].concat());
        let circles: Vec<_> = between_modules(&found).iter().filter_map(circle).collect();
        assert_eq!(circles, [["n::a", "n::b"]]);
    }

    #[test]
    fn files_of_unit_tests_are_left_out() {
        let found = imports(&[
            ("lib.rs", "mod a;\nmod b;\n"),
            ("a/mod.rs", "#[cfg(test)]\n#[allow(x)]\nmod compared;\npub struct A;\n"),
            ("a/compared.rs", "use crate::b::B;\n"),
            ("b.rs", "use crate::a::A;\npub struct B;\n"),
        ]);
        assert_eq!(found.keys().collect::<Vec<_>>(), ["a/mod.rs", "b.rs", "lib.rs"]);
        assert_eq!(circle(&found), None);
    }

    #[test]
    fn circles_are_found_and_imports_of_unit_tests_are_not_counted() {
        let parent = "mod child;\nuse child::Part;\nconst SIZE: usize = 1;\n";
        let test = "#[cfg(test)]\nmod tests {\n    use super::super::SIZE;\n}\n";
        assert_eq!(circle(&imports(&[("lib.rs", parent), ("child.rs", test)])), None);
        let child = "use super::SIZE;\npub struct Part([u8; SIZE]);\n";
        let found = circle(&imports(&[("lib.rs", parent), ("child.rs", child)]));
        assert_eq!(found, Some(vec!["child.rs".to_owned(), "lib.rs".to_owned()]));
    }
}
