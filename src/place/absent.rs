//! Why does a place not take or give anything just now? Because somebody does not answer, or there is no room: the same may
//! work another time, and nothing is wrong with what was asked.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{db, store::StoreError};

/// What is not there just now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Absent {
    Catalogue,
    Store,
    Room,
}

impl Absent {
    /// What was not there when this failed, if that was why.
    pub(crate) fn of(error: &anyhow::Error) -> Option<Self> {
        let of_the_store = error.chain().find_map(|cause| cause.downcast_ref::<StoreError>());
        match of_the_store {
            Some(error) if error.found_no_room() => Some(Self::Room),
            Some(error) if error.was_away() => Some(Self::Store),
            _ if db::found_no_room(error) => Some(Self::Room),
            _ => db::was_away(error).then_some(Self::Catalogue),
        }
    }
}

impl fmt::Display for Absent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Catalogue => "the catalogue does not answer",
            Self::Store => "the store does not answer",
            Self::Room => "there is no room left where scenes are kept",
        })
    }
}
