//! Choices of benches.

use bench_dragon::bridge::{BenchSelection, BenchSelectionError};
use bench_dragon::config::NamedLayout;
use proptest::prelude::*;
use test_support::property::random_cases;

fn selection(text: &str) -> BenchSelection {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn indices(text: &str, benches: usize) -> Vec<usize> {
    selection(text).indices(benches).collect()
}

#[test]
fn a_range_includes_both_of_its_ends() {
    assert_eq!(indices("10..13", 223), [10, 11, 12, 13]);
    assert_eq!(indices("7..7", 223), [7]);
    assert_eq!(indices("220..", 223), [220, 221, 222]);
}

#[test]
fn the_order_and_repetitions_of_a_list_do_not_matter() {
    assert_eq!(selection("20,3..6,0,5..8,9,3"), selection("0,3..9,20"));
    assert_eq!(indices("20,3..6,0,5..8,9,3", 223), [0, 3, 4, 5, 6, 7, 8, 9, 20]);
    assert_eq!(selection("5..,2..7,99999").to_string(), "2..");
}

#[test]
fn the_default_is_every_bench() {
    assert_eq!(BenchSelection::default(), selection("0.."));
    assert_eq!(BenchSelection::default().count(100_000), 100_000);
    assert_eq!(BenchSelection::default().missing(1), None);
}

#[test]
fn benches_beyond_the_dragon_are_skipped_and_named() {
    let missing = |text, benches| selection(text).missing(benches).map(|missing| missing.to_string());
    for (text, benches, sent, expected) in [
        ("0,10..20", 21, 12, None),
        ("0,10..20", 20, 11, Some("20")),
        ("0,10..20", 15, 6, Some("15..20")),
        ("0,10..20,300", 5, 1, Some("10..20,300")),
        ("10..", 11, 1, None),
        ("10..", 10, 0, Some("10..")),
        ("0..", 0, 0, Some("0..")),
    ] {
        assert_eq!(selection(text).count(benches), sent, "{text} of {benches}");
        assert_eq!(missing(text, benches).as_deref(), expected, "{text} of {benches}");
    }
}

#[test]
fn only_numbers_and_ascending_ranges_are_accepted() {
    let bad = [
        "",
        ",",
        "1,",
        "a",
        "-1",
        "+1",
        "1.5",
        "2..1",
        "..5",
        "..",
        "1...5",
        "1..=5",
        "1-5",
        " 1",
        "100000",
        "0..100000",
        "gold",
        "gold:",
        ":1",
        "Gold:1",
        "gold:2..1",
        "gold:1-5",
    ];
    for text in bad {
        assert_eq!(text.parse::<BenchSelection>(), Err(BenchSelectionError), "{text}");
    }
    assert_eq!(indices("99999", 100_000), [99_999]);
}

#[test]
fn benches_of_a_named_dragon_are_numbered_on() {
    let dragons = NamedLayout::of_toml(
        "[[dragons]]\nname = \"gold\"\nbenches = 40\n[[dragons]]\nname = \"silver-2\"\nbenches = 30\n",
    );
    let chosen = |text: &str| selection(text).of(&dragons).indices(70).collect::<Vec<_>>();
    assert_eq!(chosen("silver-2:0..2,gold:38.."), [38, 39, 40, 41, 42]);
    assert_eq!(chosen("gold:0,silver-2:28..99,1"), [0, 1, 68, 69]);
    assert_eq!(chosen("0.."), (0..70).collect::<Vec<_>>());
    let ranges: Vec<_> = selection("39..40").of(&dragons).ranges(70).collect();
    assert_eq!(ranges, [39..=39, 40..=40], "each range is of one dragon");
    let missing = |text: &str| selection(text).missing_of(&dragons, 70).map(|missing| missing.to_string());
    assert_eq!(missing("gold:0..,silver-2:0..29,69"), None);
    assert_eq!(missing("gold:30..40,bronze:0..,70..71").as_deref(), Some("70..71,gold:40,bronze:0.."));
    assert_eq!(missing("silver-2:30..").as_deref(), Some("silver-2:30.."));
    assert_eq!(selection("gold:0..5,3").to_string(), "3,gold:0..5");
    let one = NamedLayout::default();
    assert_eq!((chosen("bronze:1"), selection("gold:1").of(&one).count(9)), (vec![], 0));
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn a_choice_is_the_set_of_its_parts(
        parts in prop::collection::vec((0..40_usize, prop::option::of(0..10_usize)), 1..8),
        benches in 0..60_usize,
    ) {
        let written = parts.iter().map(|(first, more)| match more {
            Some(more) => format!("{first}..{}", first + more),
            None => first.to_string(),
        });
        let choice = selection(&written.collect::<Vec<_>>().join(","));
        let is_chosen = |index: usize| parts.iter().any(|(first, more)| (*first..=first + more.unwrap_or(0)).contains(&index));
        let expected: Vec<usize> = (0..benches).filter(|index| is_chosen(*index)).collect();
        prop_assert_eq!(choice.count(benches), expected.len());
        prop_assert_eq!(choice.indices(benches).collect::<Vec<_>>(), expected);
        let absent: Vec<usize> = (benches..60).filter(|index| is_chosen(*index)).collect();
        let missing = choice.missing(benches).map_or(Vec::new(), |missing| missing.indices(60).collect());
        prop_assert_eq!(missing, absent);
        prop_assert_eq!(selection(&choice.to_string()), choice);
    }
}
