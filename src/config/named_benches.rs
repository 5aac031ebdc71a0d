//! Names of benches and places for people and for JSON. The bus numbers benches on from dragon to dragon; with several dragons,
//! a bench also has the name of its dragon and its index within that dragon.

use std::fmt::Display;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::Alert;
use serde::{Deserialize, Serialize};

use super::Config;

/// The dragons of some benches, and the indices of the benches within them, in the order of the benches.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedBenches {
    /// Names of the dragons.
    pub dragons: Vec<String>,
    /// Indices within these dragons.
    pub indices: Vec<usize>,
}

impl NamedBenches {
    /// Two benches in words: `benches 0 and 8`, or `gold 3 and silver 0` of several dragons.
    pub fn pair_words(named: Option<&Self>, [one, other]: [impl Display; 2]) -> String {
        match named.map(Self::names).as_deref() {
            Some([one, other]) => format!("{one} and {other}"),
            _ => format!("benches {one} and {other}"),
        }
    }

    /// A bench in words: `bench 3`, or `gold 3`.
    pub fn bench_words(named: Option<&Self>, bench: impl Display) -> String {
        match named.map(Self::names).as_deref() {
            Some([name]) => name.clone(),
            _ => format!("bench {bench}"),
        }
    }

    fn names(&self) -> Vec<String> {
        self.dragons.iter().zip(&self.indices).map(|(dragon, index)| format!("{dragon} {index}")).collect()
    }
}

impl Config {
    /// The dragons of benches that are numbered on from dragon to dragon. `None` for the short form for one dragon, and for benches
    /// that the configuration does not have.
    pub fn named_benches(&self, benches: impl IntoIterator<Item = usize>) -> Option<NamedBenches> {
        let named = self.named()?;
        let count = self.formation().layout().benches();
        let member = |bench| (bench < count).then(|| named.named_bench(bench));
        let members: Option<Vec<(&str, usize)>> = benches.into_iter().map(member).collect();
        let (dragons, indices) = members?.into_iter().map(|(name, index)| (name.to_owned(), index)).unzip();
        Some(NamedBenches { dragons, indices })
    }

    /// The same for the benches of an alert. `None` too for an alert without a bench.
    pub fn named_benches_of(&self, alert: &Alert) -> Option<NamedBenches> {
        match (alert.pair(), alert.bench()) {
            (Some(pair), _) => self.named_benches(pair.map(|bench| bench as usize)),
            (None, Some(bench)) => self.named_benches([bench as usize]),
            (None, None) => None,
        }
    }

    /// A bench in few letters: `3`, or `gold 3`.
    pub fn bench_name(&self, bench: usize) -> String {
        match self.named() {
            Some(named) if bench < self.formation.layout().benches() => {
                let (name, index) = named.named_bench(bench);
                format!("{name} {index}")
            }
            _ => bench.to_string(),
        }
    }

    /// A bench in words.
    pub fn bench_words(&self, bench: usize) -> String {
        NamedBenches::bench_words(self.named_benches([bench]).as_ref(), bench)
    }

    /// Two benches in words.
    pub fn pair_words(&self, benches: [usize; 2]) -> String {
        NamedBenches::pair_words(self.named_benches(benches).as_ref(), benches)
    }

    /// A place on the course in words, with this number of digits: `412.47 m of travel`, or the plan time of several dragons.
    pub fn place_words<const DIGITS: usize>(&self, course_m: f64) -> String {
        if self.formation().has_plan_course() {
            format!("plan time {} s", Fixed::<DIGITS>(self.formation().plan_s(course_m)))
        } else {
            format!("{} m of travel", Fixed::<DIGITS>(course_m))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "[[dragons]]\nname = \"gold\"\nbenches = 4\n[dragons.route]\nkind = \"path\"\n\
        segments = [{ kind = \"line\", length_m = 40 }]\n[dragons.head]\nspeed_mps = 0.5\n\
        [[dragons]]\nname = \"silver\"\nbenches = 3\n[dragons.route]\nkind = \"path\"\nstart_y_m = 5\n\
        segments = [{ kind = \"line\", length_m = 40 }]\n";

    #[test]
    fn benches_of_several_dragons_have_the_name_and_the_index() {
        let config = Config::from_toml(TWO).expect("valid");
        assert_eq!(config.pair_words([3, 4]), "gold 3 and silver 0");
        let named = config.named_benches([3, 4]).expect("names");
        assert_eq!((named.dragons, named.indices), (vec!["gold".to_owned(), "silver".to_owned()], vec![3, 0]));
        assert_eq!(NamedBenches::bench_words(config.named_benches([6]).as_ref(), 6), "silver 2");
        assert_eq!(config.pair_words([3, 7]), "benches 3 and 7", "there is no bench 7");
        assert_eq!(config.place_words::<2>(3.0), "plan time 6.00 s");
    }

    #[test]
    fn benches_of_one_dragon_have_their_numbers() {
        let config = Config::from_toml("").expect("valid");
        assert_eq!((config.named_benches([0, 8]), config.pair_words([0, 8])), (None, "benches 0 and 8".to_owned()));
        assert_eq!(NamedBenches::bench_words(None, 3), "bench 3");
        assert_eq!(config.place_words::<2>(3.0), "3.00 m of travel");
    }
}
