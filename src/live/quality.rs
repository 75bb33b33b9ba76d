//! How much of what there is to see do participants see? Those that say so; each counts as it said last.
//!
//! It is the download quality of Marvie & Bouatouch (*A VRML97-X3D extension for massive scenery management in virtual
//! worlds*, 2004, §7): the share of what is visible that is there.

use std::sync::atomic::{AtomicU32, Ordering};

/// What one participant has said last.
#[derive(Debug)]
pub(super) struct Reported(AtomicU32);

/// Nothing yet; else millionths.
const NOTHING: u32 = u32::MAX;
const WHOLE: f64 = 1e6;

/// It is no share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a share is a number from 0 to 1")]
pub struct NoShare;

impl Default for Reported {
    fn default() -> Self {
        Self(AtomicU32::new(NOTHING))
    }
}

impl Reported {
    pub(super) fn set(&self, share: f64) -> Result<(), NoShare> {
        if !(0.0..=1.0).contains(&share) {
            return Err(NoShare);
        }
        self.0.store((share * WHOLE).round() as u32, Ordering::Relaxed);
        Ok(())
    }

    pub(super) fn last(&self) -> Option<f64> {
        match self.0.load(Ordering::Relaxed) {
            NOTHING => None,
            millionths => Some(f64::from(millionths) / WHOLE),
        }
    }
}

/// What all have said that say it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Quality {
    /// How many they are.
    pub sessions: usize,
    /// The mean of their shares; 0 without any.
    pub mean: f64,
    /// The worst of them; 0 without any.
    pub worst: f64,
}

impl FromIterator<f64> for Quality {
    fn from_iter<T: IntoIterator<Item = f64>>(shares: T) -> Self {
        let (mut sessions, mut sum, mut worst) = (0, 0.0, f64::INFINITY);
        for share in shares {
            sessions += 1;
            sum += share;
            worst = share.min(worst);
        }
        if sessions == 0 {
            return Self::default();
        }
        Self {
            sessions,
            mean: sum / sessions as f64,
            worst,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_counts_as_it_said_last_and_who_is_silent_not_at_all() {
        let said: [Reported; 3] = Default::default();
        said[0].set(0.25).unwrap();
        said[0].set(1.0).unwrap();
        said[2].set(0.5).unwrap();
        for wrong in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
            assert_eq!(said[1].set(wrong), Err(NoShare));
        }
        let all: Quality = said.iter().filter_map(Reported::last).collect();
        assert_eq!((all.sessions, all.mean, all.worst), (2, 0.75, 0.5));
        assert_eq!(Quality::from_iter([]), Quality::default());
    }
}
