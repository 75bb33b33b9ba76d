//! Which runs of servers are gone? Each says in a place that all can read how often it has been heard of. Who looks there time and
//! again, and finds that a number stands still while it is answered, knows that nobody raises it any more: no clock but
//! one's own pace counts, and while that place is away nobody is taken for gone.

use std::collections::BTreeMap;

/// A home that was not heard of in so many looks one after the other is gone. Looks are as far apart as beats.
const SILENT_LOOKS: u32 = 3;
/// After so many more nobody will ask for what it held.
const FORSAKEN_LOOKS: u32 = 300;

/// What is known of all homes.
#[derive(Debug, Clone, Default)]
pub struct Homes(BTreeMap<String, Seen>);

#[derive(Debug, Clone, Copy)]
struct Seen {
    beats: i64,
    ended: bool,
    /// So many looks one after the other have found no other number.
    silent: u32,
}

/// Whether a home is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Life {
    /// It was heard of since.
    Lives,
    /// It was not, for long enough, or has said that it ends; this was its number.
    Gone(i64),
    /// A later look will tell.
    Unsure,
}

impl Homes {
    /// All homes, each with its number and whether it has said that it ends.
    pub fn look(&mut self, homes: impl IntoIterator<Item = (String, i64, bool)>) {
        let before = std::mem::take(&mut self.0);
        let seen = |(home, beats, ended)| {
            let known: Option<&Seen> = before.get(&home).filter(|known| known.beats == beats);
            let silent = known.map_or(0, |known| known.silent.saturating_add(1));
            (home, Seen { beats, ended, silent })
        };
        self.0 = homes.into_iter().map(seen).collect();
    }

    /// Nobody could look: what has been silent until now had perhaps nowhere to speak.
    pub fn blink(&mut self) {
        self.0.values_mut().for_each(|seen| seen.silent = 0);
    }

    /// Whether a home is there that had this number when somebody asked; the last look may have been before that.
    #[must_use]
    pub fn life(&self, home: &str, before: i64) -> Life {
        match self.0.get(home).filter(|seen| seen.beats >= before) {
            Some(seen) if seen.ended || seen.silent >= SILENT_LOOKS => Life::Gone(seen.beats),
            Some(seen) if seen.beats > before => Life::Lives,
            Some(_) | None => Life::Unsure,
        }
    }

    /// Whether a home has said that it ends.
    #[must_use]
    pub fn has_ended(&self, home: &str) -> bool {
        self.0.get(home).is_some_and(|seen| seen.ended)
    }

    /// Homes that are gone for so long that nobody comes back to them, with their numbers.
    pub fn forsaken(&self) -> impl Iterator<Item = (&str, i64)> {
        let long = self.0.iter().filter(|(_, seen)| seen.silent >= FORSAKEN_LOOKS);
        long.map(|(home, seen)| (home.as_str(), seen.beats))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(homes: &mut Homes, beats: i64) {
        homes.look([("a".to_owned(), beats, false)]);
    }

    #[test]
    fn who_is_silent_for_some_looks_is_gone_and_who_is_heard_of_lives() {
        let mut homes = Homes::default();
        assert_eq!(homes.life("a", 0), Life::Unsure, "nobody has looked yet");
        for beats in 1..5 {
            look(&mut homes, beats);
            assert_eq!(homes.life("a", beats), Life::Unsure);
            assert_eq!(homes.life("a", beats - 1), Life::Lives);
            assert_eq!(homes.life("a", beats + 1), Life::Unsure, "nobody has looked since");
        }
        for _ in 1..SILENT_LOOKS {
            look(&mut homes, 4);
            assert_eq!(homes.life("a", 4), Life::Unsure);
        }
        look(&mut homes, 4);
        assert_eq!(homes.life("a", 4), Life::Gone(4));
        look(&mut homes, 5);
        assert_eq!(homes.life("a", 4), Life::Lives);
        homes.look([("a".to_owned(), 5, true)]);
        assert_eq!(homes.life("a", 4), Life::Gone(5), "it has said so");
        assert!(homes.has_ended("a") && !homes.has_ended("b"));
    }

    #[test]
    fn while_nobody_can_look_nobody_is_taken_for_gone() {
        let mut homes = Homes::default();
        for _ in 0..SILENT_LOOKS {
            look(&mut homes, 4);
        }
        homes.blink();
        look(&mut homes, 4);
        assert_eq!(homes.life("a", 4), Life::Unsure);
    }

    #[test]
    fn who_is_gone_for_long_is_forsaken() {
        let mut homes = Homes::default();
        for _ in 0..FORSAKEN_LOOKS {
            look(&mut homes, 4);
            assert_eq!(homes.forsaken().count(), 0);
        }
        look(&mut homes, 4);
        assert_eq!(homes.forsaken().collect::<Vec<_>>(), [("a", 4)]);
    }
}
