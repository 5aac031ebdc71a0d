//! The documents are consistent: links resolve, each page names its readers, the index is complete, and the tests that
//! documents name exist.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

mod configuration;
mod steering;
mod words;

/// Folders without documents of the project.
const SKIPPED: [&str; 4] = [".git", "node_modules", "target", "corpus"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the files under a folder whose names end with one of these endings.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder can be read").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() && !SKIPPED.contains(&&*name) && !name.starts_with("show-") {
            found.extend(files(&path, endings));
        } else if path.is_file() && endings.iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A document: the targets of its links and pictures, and the anchors of its headings.
struct Page {
    targets: Vec<String>,
    anchors: BTreeSet<String>,
}

impl Page {
    fn read(path: &Path) -> Self {
        let text = read(path);
        let (mut targets, mut anchors, mut heading) = (Vec::new(), BTreeSet::new(), None);
        for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    targets.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => anchors.extend(heading.take().map(|heading| anchor(&heading))),
                Event::Text(text) | Event::Code(text) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&text);
                    }
                }
                _ => {}
            }
        }
        Self { targets, anchors }
    }
}

/// Returns the anchor of a heading, as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase();
    let kept = kept.chars().filter(|char| char.is_alphanumeric() || " -_".contains(*char));
    kept.map(|char| if char == ' ' { '-' } else { char }).collect()
}

/// Returns a path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut plain, component| {
        match component {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            other => plain.push(other),
        }
        plain
    })
}

/// Returns the fault of a link of a page, if there is one.
fn fault(page: &Path, target: &str, pages: &BTreeMap<PathBuf, Page>) -> Option<String> {
    if target.contains("://") {
        return None;
    }
    let (file, anchor) = target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
    let path = if file.is_empty() { page.to_owned() } else { plain(&page.parent()?.join(file)) };
    if !path.exists() {
        return Some(format!("{}: {target}: there is no such file", page.display()));
    }
    let anchor = anchor?;
    match pages.get(&path) {
        Some(page) if page.anchors.contains(anchor) => None,
        _ => Some(format!("{}: {target}: there is no such heading", page.display())),
    }
}

#[test]
fn every_link_between_documents_resolves() {
    let pages: BTreeMap<PathBuf, Page> =
        files(root(), &[".md"]).into_iter().map(|path| (path.clone(), Page::read(&path))).collect();
    assert!(pages.len() > 25, "{} documents were found", pages.len());
    let faults: Vec<String> = pages
        .iter()
        .flat_map(|(path, page)| page.targets.iter().filter_map(|target| fault(path, target, &pages)))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_page_opens_with_its_readers() {
    for path in files(&root().join("docs"), &[".md"]) {
        let text = read(&path);
        let mut paragraphs = text.split("\n\n");
        let (title, opening) = (paragraphs.next().unwrap_or_default(), paragraphs.next().unwrap_or_default());
        assert!(title.starts_with("# "), "{} has no title", path.display());
        assert!(opening.starts_with("This page is for "), "{} opens with {opening:?}", path.display());
    }
}

#[test]
fn no_document_has_a_placeholder() {
    for path in files(root(), &[".md"]) {
        let text = read(&path);
        let words =
            text.split_whitespace().filter(|word| word.len() > 2 && word.starts_with('@') && word.ends_with('@'));
        assert_eq!(words.collect::<Vec<_>>(), [""; 0], "{}", path.display());
    }
}

#[test]
fn the_index_lists_every_page() {
    let index = root().join("docs/README.md");
    let listed: BTreeSet<PathBuf> = Page::read(&index)
        .targets
        .iter()
        .map(|target| plain(&index.parent().expect("the file is in a folder").join(target)))
        .collect();
    let missing: Vec<PathBuf> = files(&root().join("docs"), &[".md"])
        .into_iter()
        .filter(|path| *path != index && !listed.contains(path))
        .collect();
    assert!(missing.is_empty(), "not in the index: {missing:?}");
}

#[test]
fn documents_that_the_program_names_exist() {
    let sources = ["src", "packaging", "geometry/src", "ipc"].map(|folder| root().join(folder));
    let endings = [".rs", ".yml", ".service", ".conf", ".js", ".h", ".py"];
    let mut named = 0;
    for path in sources.iter().flat_map(|folder| files(folder, &endings)) {
        let text = read(&path);
        let words = text.split(|char: char| !(char.is_alphanumeric() || "/-_.".contains(char)));
        for word in words.filter(|word| word.starts_with("docs/")) {
            let document = word.trim_end_matches('.');
            assert!(root().join(document).exists(), "{} names {document}", path.display());
            named += 1;
        }
    }
    assert!(named > 0, "no message names a document");
}

#[test]
fn the_first_documents_stay_short() {
    for (name, most) in [("README.md", 200), ("ARCHITECTURE.md", 140)] {
        let lines = read(&root().join(name)).lines().count();
        assert!(lines <= most, "{name} has {lines} lines, at most {most} are allowed");
    }
}

/// Returns the names of the tests and of their modules in a target of `cargo test`.
fn names_of_tests(target: &str) -> Vec<String> {
    let folders = ["tests", "geometry/tests"].map(|folder| root().join(folder));
    let mut sources: Vec<PathBuf> = folders.iter().map(|folder| folder.join(format!("{target}.rs"))).collect();
    sources.extend(
        folders
            .iter()
            .map(|folder| folder.join(target))
            .filter(|folder| folder.is_dir())
            .flat_map(|folder| files(&folder, &[".rs"])),
    );
    sources.retain(|source| source.is_file());
    let modules = sources.iter().filter_map(|source| source.file_stem()?.to_str().map(str::to_owned));
    let functions = sources.iter().flat_map(|source| {
        let text = read(source);
        text.lines()
            .filter_map(|line| line.trim().strip_prefix("fn ")?.split(['(', '<']).next().map(str::to_owned))
            .collect::<Vec<_>>()
    });
    modules.chain(functions).collect()
}

#[test]
fn tests_that_documents_name_exist() {
    let mut checked = 0;
    for path in files(root(), &[".md"]) {
        for command in read(&path).split(['`', '\n']).filter(|text| is_test_command(text)) {
            let command = command.split("  #").next().unwrap_or(command);
            for (target, filters) in named_tests(command) {
                let names = names_of_tests(target);
                assert!(!names.is_empty(), "{}: `{command}`: there is no test target {target}", path.display());
                for filter in filters {
                    let is_there = names.iter().any(|name| name.contains(filter));
                    assert!(is_there, "{}: `{command}`: no test of {target} has {filter}", path.display());
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 20, "{checked} names of tests were found");
}

fn is_test_command(text: &str) -> bool {
    text.contains("--test ") && (text.contains("tests/run") || text.contains("cargo test"))
}

/// Returns the targets and filters of a command line such as `tests/run --test processes show guard`.
fn named_tests(command: &str) -> Vec<(&str, Vec<&str>)> {
    let mut named: Vec<(&str, Vec<&str>)> = Vec::new();
    let mut words = command.split_whitespace().map(|word| word.trim_matches(','));
    while let Some(word) = words.next() {
        match word {
            "--test" => named.extend(words.next().map(|target| (target, Vec::new()))),
            "--kills" | "--ends" | "--scenarios" | "--only" | "--seed" => drop(words.next()),
            word if word.starts_with('-') => {}
            word => {
                if let Some((_, filters)) = named.last_mut() {
                    filters.push(word);
                }
            }
        }
    }
    named
}

#[test]
fn anchors_are_those_of_github() {
    assert_eq!(anchor("When periods are missed"), "when-periods-are-missed");
    assert_eq!(anchor("Another machine: zenoh"), "another-machine-zenoh");
    assert_eq!(anchor("`solve contact`"), "solve-contact");
    assert_eq!(anchor("summary.json"), "summaryjson");
}
