//! Forms of the bus's types in other languages and documents, generated from the Rust types.

use std::path::Path;
use std::{env, fs};

/// Environment variable. If it is set, the tests write the generated files and passages.
pub const WRITE: &str = "BENCH_DRAGON_WRITE";
/// The command that writes all of them.
const COMMAND: &str = "cargo test --workspace --test wire --test header";

/// A named number of an enum, with its meaning in one sentence or more.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "the names of the fields describe them")]
pub struct Constant {
    pub name: String,
    pub number: u32,
    pub meaning: String,
}

impl Constant {
    /// A constant that no variant has.
    pub fn new(name: &str, number: u32, meaning: &str) -> Self {
        Self { name: name.to_owned(), number, meaning: meaning.to_owned() }
    }

    /// The constants of an enum's variants, in capitals and with a prefix: `BD_OUT_OF_RANGE` for `OutOfRange`.
    pub fn all(prefix: &str, meanings: &[(&str, u32, &str)]) -> Vec<Self> {
        let constant = |&(variant, number, text): &_| Self {
            name: prefix.to_owned() + &capitals(variant),
            number,
            meaning: line(text),
        };
        meanings.iter().map(constant).collect()
    }

    /// The bits of an enum's variants, each with the bit of its number.
    pub fn bits(prefix: &str, meanings: &[(&str, u32, &str)]) -> Vec<Self> {
        let bit = |constant: Self| Self { number: 1 << constant.number, ..constant };
        Self::all(prefix, meanings).into_iter().map(bit).collect()
    }
}

fn capitals(variant: &str) -> String {
    let parted = |(at, letter): (usize, char)| {
        let gap = if at > 0 && letter.is_ascii_uppercase() { "_" } else { "" };
        format!("{gap}{}", letter.to_ascii_uppercase())
    };
    variant.char_indices().map(parted).collect()
}

/// A comment's text in one line.
pub fn line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Breaks a text into lines of at most `width` characters, the first of which begin with `first` and the others with `rest`.
pub fn wrapped(text: &str, first: &str, rest: &str, width: usize) -> String {
    let (mut lines, mut current) = (Vec::new(), first.to_owned());
    let mut is_empty = true;
    for word in text.split(' ') {
        if !is_empty && current.chars().count() + 1 + word.chars().count() > width {
            lines.push(std::mem::replace(&mut current, rest.to_owned()));
            is_empty = true;
        }
        current.push_str(if is_empty { "" } else { " " });
        current.push_str(word);
        is_empty = false;
    }
    lines.push(current);
    lines.join("\n")
}

/// Requires that a file is the generated one, or writes it.
pub fn require_file(path: &Path, generated: &str) {
    if env::var_os(WRITE).is_some() {
        // Another test may read the file meanwhile, so it is replaced as a whole.
        let new = path.with_extension("new");
        let written = fs::write(&new, generated).and_then(|()| fs::rename(&new, path));
        written.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    let text = fs::read_to_string(path).unwrap_or_default();
    assert!(text == generated, "{} is stale: regenerate it with `{WRITE}=1 {COMMAND}`", path.display());
}

/// Requires that a file has the generated text after the first `before`, up to the next `after`, or writes it there.
pub fn require_passage(path: &Path, before: &str, generated: &str, after: &str) {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let missing = |what: &str| panic!("{} has no {what:?}", path.display());
    let begin = text.find(before).unwrap_or_else(|| missing(before)) + before.len();
    let length = text[begin..].find(after).unwrap_or_else(|| missing(after));
    require_file(path, &[&text[..begin], generated, &text[begin + length..]].concat());
}
