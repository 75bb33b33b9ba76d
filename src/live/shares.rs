//! How much of what there is for all has one address? A share, so that who wants all of it leaves room for others.
//!
//! What outlives a server, and sessions that come from one that is gone, are nobody's where they come back: who has made them is not
//! kept.

use std::{collections::BTreeMap, net::IpAddr};

use super::{LiveError, LiveSettings};

/// What there is only so much of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Good {
    Sessions,
    Movers,
    /// Movers that outlive the server, which are movers as well.
    Staying,
}

impl Good {
    /// How many there may be of all addresses together.
    fn of_all(self, settings: &LiveSettings) -> usize {
        match self {
            Self::Sessions => settings.sessions,
            Self::Movers => settings.movers,
            Self::Staying => settings.persistent,
        }
    }

    /// And of one.
    fn of_an_address(self, settings: &LiveSettings) -> usize {
        match self {
            Self::Sessions => settings.sessions_of_an_address,
            Self::Movers | Self::Staying => {
                (self.of_all(settings) * usize::from(settings.movers_of_an_address_percent)).div_ceil(100)
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Sessions => "sessions",
            Self::Movers => "movers",
            Self::Staying => "persistent movers",
        }
    }
}

/// Who has how much.
#[derive(Debug, Default)]
pub(super) struct Shares {
    all: BTreeMap<Good, usize>,
    each: BTreeMap<(Good, IpAddr), usize>,
}

impl Shares {
    /// Whether there is one more for this address; where nobody knows which it is, for anybody.
    pub(super) fn check(&self, good: Good, from: Option<IpAddr>, settings: &LiveSettings) -> Result<(), LiveError> {
        let (what, most) = (good.name(), good.of_all(settings));
        if self.all.get(&good).copied().unwrap_or(0) >= most {
            return Err(LiveError::Full { what, most });
        }
        let most = good.of_an_address(settings);
        match from.map(|from| self.each.get(&(good, from)).copied().unwrap_or(0)) {
            Some(count) if count >= most => Err(LiveError::Crowded { what, most }),
            _ => Ok(()),
        }
    }

    pub(super) fn add(&mut self, good: Good, from: Option<IpAddr>) {
        *self.all.entry(good).or_default() += 1;
        if let Some(from) = from {
            *self.each.entry((good, from)).or_default() += 1;
        }
    }

    pub(super) fn remove(&mut self, good: Good, from: Option<IpAddr>) {
        if let Some(count) = self.all.get_mut(&good) {
            *count -= 1;
        }
        if let Some(key) = from.map(|from| (good, from))
            && let Some(count) = self.each.get_mut(&key)
        {
            *count -= 1;
            if *count == 0 {
                self.each.remove(&key);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_address_leaves_room_for_others_and_gets_back_what_it_gives() {
        let settings = LiveSettings {
            sessions: 5,
            sessions_of_an_address: 3,
            persistent: 5,
            ..LiveSettings::default()
        };
        let [one, other] = [1, 2].map(|last| Some(IpAddr::from([10, 0, 0, last])));
        let mut shares = Shares::default();
        for good in [Good::Sessions, Good::Staying] {
            let enter = |shares: &mut Shares, from| {
                shares.check(good, from, &settings)?;
                shares.add(good, from);
                Ok(())
            };
            for _ in 0..3 {
                enter(&mut shares, one).unwrap();
            }
            assert!(matches!(
                enter(&mut shares, one),
                Err(LiveError::Crowded { most: 3, .. })
            ));
            enter(&mut shares, other).unwrap();
            shares.remove(good, one);
            enter(&mut shares, one).unwrap();
            enter(&mut shares, None).unwrap();
            assert!(matches!(
                enter(&mut shares, other),
                Err(LiveError::Full { most: 5, .. })
            ));
            for from in [one, one, one, other, None] {
                shares.remove(good, from);
            }
        }
        assert!(shares.each.is_empty(), "who has gone takes no room");
    }
}
