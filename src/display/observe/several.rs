//! Sentences about one dragon, for a formation: with several dragons, the show goes on and stands as a whole.

/// Words of a sentence about one dragon, and those about a formation. They are replaced in this order.
const WORDS: [(&str, &str); 10] = [
    ("The dragon walks.", "The show runs."),
    ("dragon then walks on", "show then goes on"),
    ("dragon walks on", "show goes on"),
    ("Look at the dragon,", "Look at all dragons,"),
    ("let the dragon walk", "let the show run"),
    ("the dragon", "the show"),
    ("The dragon", "The show"),
    ("the head", "the show"),
    ("The head", "The show"),
    ("proven travel", "proven part of the plan"),
];

/// A sentence about one dragon, as one about a formation.
///
/// ```
/// use bench_dragon::display::observe::of_formation;
///
/// assert_eq!(of_formation("Wait: the dragon then walks on by itself."), "Wait: the show then goes on by itself.");
/// assert_eq!(of_formation("Look at the dragon, then release it."), "Look at all dragons, then release it.");
/// ```
pub fn of_formation(sentence: &str) -> String {
    WORDS.iter().fold(sentence.to_owned(), |text, (one, several)| text.replace(one, several))
}
