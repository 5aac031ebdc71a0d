//! Which benches belong to which dragon, by its name.

use std::ops::Range;

/// The names of the dragons of a description, and the benches of each. A show of one dragon without `[[dragons]]` has none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NamedLayout {
    dragons: Vec<(String, usize)>,
}

impl NamedLayout {
    /// Reads names and numbers in the text of a description. Places no dragon on its route, so it takes little time.
    ///
    /// ```
    /// use bench_dragon::config::NamedLayout;
    ///
    /// let toml = "[[dragons]]\nname = \"gold\"\nbenches = 40\n[[dragons]]\nname = \"silver\"\nbenches = 30\n";
    /// let names = NamedLayout::of_toml(toml);
    /// assert_eq!((names.place(39), names.place(40)), (Some(("gold", 39)), Some(("silver", 0))));
    /// assert_eq!((names.place(70), NamedLayout::of_toml("").place(0)), (None, None));
    /// ```
    pub fn of_toml(toml: &str) -> Self {
        let table = toml.parse::<toml::Table>().unwrap_or_default();
        let dragon = |dragon: &toml::Value| {
            let benches = dragon.get("benches")?.as_integer()?;
            Some((dragon.get("name")?.as_str()?.to_owned(), usize::try_from(benches).ok()?))
        };
        let dragons = table.get("dragons").and_then(|dragons| dragons.as_array()?.iter().map(dragon).collect());
        Self { dragons: dragons.unwrap_or_default() }
    }

    /// Whether the dragons have names.
    pub fn are_named(&self) -> bool {
        !self.dragons.is_empty()
    }

    /// The dragons with their benches, the leading one first.
    pub fn dragons(&self) -> impl Iterator<Item = (&str, Range<usize>)> {
        let mut first = 0;
        self.dragons.iter().map(move |(name, benches)| {
            let range = first..first + benches;
            first = range.end;
            (name.as_str(), range)
        })
    }

    /// The name of a dragon by its number.
    pub fn name(&self, dragon: usize) -> Option<&str> {
        self.dragons.get(dragon).map(|(name, _)| name.as_str())
    }

    /// The benches of a dragon.
    pub fn of_dragon(&self, name: &str) -> Option<Range<usize>> {
        self.dragons().find(|(other, _)| *other == name).map(|(_, benches)| benches)
    }

    /// The dragon of a bench, and the index of the bench within it. `None` for a show of one dragon, or for a bench that none has.
    pub fn place(&self, bench: usize) -> Option<(&str, usize)> {
        let (name, benches) = self.dragons().find(|(_, benches)| benches.contains(&bench))?;
        Some((name, bench - benches.start))
    }

    /// A bench as people call it: `gold 3`, or its number.
    pub fn text(&self, bench: usize) -> String {
        self.place(bench).map_or_else(|| bench.to_string(), |(name, index)| format!("{name} {index}"))
    }
}
