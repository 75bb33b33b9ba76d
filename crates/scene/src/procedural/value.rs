//! What can be computed with? Numbers, and lists of them.

use std::sync::Arc;

use super::limits::MAX_LIST_DEPTH;
use super::random::{step, step_number};

/// A number or a list. Lists are shared, never changed.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Finite.
    Number(f64),
    /// Items, and how much they are with all that is inside of them.
    List(Arc<[Value]>, Extent),
}

/// How much a list is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Numbers and lists in it, without itself. As few bytes as will do: a text may ask for millions of values.
    size: u32,
    /// Lists inside each other, itself included. Bounds the machine's stack wherever a value is gone through.
    depth: u32,
}

impl Value {
    /// A list of these.
    #[must_use]
    pub fn list(items: Vec<Self>) -> Self {
        let size = items.iter().map(Self::size).fold(0, usize::saturating_add);
        let size = u32::try_from(size).unwrap_or(u32::MAX);
        let depth = items.iter().map(Self::depth).max().unwrap_or(0).saturating_add(1);
        Self::List(items.into(), Extent { size, depth })
    }

    /// A list of numbers.
    pub(super) fn numbers(numbers: impl IntoIterator<Item = f64>) -> Self {
        Self::list(numbers.into_iter().map(Self::Number).collect())
    }

    /// Whether it is a list of so many numbers.
    pub(super) fn is_numbers(&self, count: usize) -> bool {
        let Self::List(items, _) = self else { return false };
        items.len() == count && items.iter().all(|item| matches!(item, Self::Number(_)))
    }

    /// Numbers and lists in it, itself included.
    pub(super) fn size(&self) -> usize {
        match self {
            Self::Number(_) => 1,
            Self::List(_, extent) => (extent.size as usize).saturating_add(1),
        }
    }

    /// The same of a list; nothing of a number.
    pub(super) fn listed(&self) -> usize {
        match self {
            Self::Number(_) => 0,
            Self::List(..) => self.size(),
        }
    }

    /// Lists inside each other.
    pub(super) fn depth(&self) -> u32 {
        match self {
            Self::Number(_) => 0,
            Self::List(_, extent) => extent.depth,
        }
    }

    /// The same value as JSON says it: a number, or an array of values; `None` for anything else, and for more than
    /// [`MAX_LIST_DEPTH`] lists inside each other.
    #[must_use]
    pub fn from_json(json: &serde_json::Value) -> Option<Self> {
        match json {
            serde_json::Value::Array(items) => {
                let list = Self::list(items.iter().map(Self::from_json).collect::<Option<_>>()?);
                (list.depth() <= MAX_LIST_DEPTH).then_some(list)
            }
            _ => json.as_f64().filter(|number| number.is_finite()).map(Self::Number),
        }
    }

    /// As JSON.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Self::Number(number) => serde_json::json!(number),
            Self::List(items, _) => items.iter().map(Self::to_json).collect(),
        }
    }

    /// Adds the bits by which values are told apart.
    pub(super) fn key(&self, key: &mut Vec<u64>) {
        match self {
            // Adding 0 turns −0 into 0.
            Self::Number(number) => key.push((number + 0.0).to_bits()),
            Self::List(items, _) => {
                // No finite number has these bits.
                key.push(u64::MAX - items.len() as u64);
                items.iter().for_each(|item| item.key(key));
            }
        }
    }

    /// The path after this value.
    pub(super) fn step(&self, path: u32) -> u32 {
        match self {
            Self::Number(number) => step_number(path, number + 0.0),
            Self::List(items, _) => items
                .iter()
                .fold(step(path, items.len() as u32), |path, item| item.step(path)),
        }
    }
}
