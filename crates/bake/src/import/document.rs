//! What does the document say in a place? Tolerant access to JSON that may hold anything anywhere.
//!
//! A missing member is `None` or empty; a member of the wrong type is a [`Flaw`](super::error::Flaw) with its JSON
//! pointer. Nothing here panics, whatever the document is.

use serde_json::Value;

use super::error::{Read, flaw};

const WRONG_TYPE: &str = "member of the wrong type: left out with what needs it";
const NOT_THERE: &str = "reference to something that is not there: left out with what needs it";

/// A value with the JSON pointer to it.
#[derive(Debug, Clone)]
pub(super) struct Item<'a> {
    pub(super) value: &'a Value,
    pub(super) place: String,
}

impl<'a> Item<'a> {
    /// The document itself.
    pub(super) fn root(value: &'a Value) -> Self {
        Self {
            value,
            place: String::new(),
        }
    }

    /// A member, when it is there.
    pub(super) fn member(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key).filter(|v| !v.is_null())?;
        Some(Self {
            value,
            place: format!("{}/{key}", self.place),
        })
    }

    /// A member, or a flaw.
    pub(super) fn needed(&self, key: &str) -> Read<Self> {
        self.member(key).map_or_else(
            || {
                flaw(
                    "needed member missing: left out with what needs it",
                    format!("{}/{key}", self.place),
                )
            },
            Ok,
        )
    }

    /// An object inside `extensions`.
    pub(super) fn extension(&self, name: &str) -> Option<Self> {
        self.member("extensions")?.member(name).filter(|e| e.value.is_object())
    }

    /// Element `index` of the document's list `list`; call it on the root.
    pub(super) fn listed(&self, list: &str, index: usize) -> Read<Self> {
        let place = format!("/{list}/{index}");
        match self
            .value
            .get(list)
            .and_then(|l| l.as_array())
            .and_then(|l| l.get(index))
        {
            Some(value) if value.is_object() => Ok(Self { value, place }),
            Some(_) => flaw(WRONG_TYPE, place),
            None => flaw(NOT_THERE, place),
        }
    }

    /// The element of the list `list` of a document that a member of this names by its number; none without that member.
    pub(super) fn referred(&self, root: &Self, key: &str, list: &str) -> Read<Option<(usize, Self)>> {
        let Some(index) = self.index(key)? else {
            return Ok(None);
        };
        let element = root.listed(list, index);
        let element = element.map_err(|trouble| trouble.named_by(format!("{}/{key}", self.place)));
        Ok(Some((index, element?)))
    }

    /// The length of a list that may be missing or no list.
    pub(super) fn length(&self, key: &str) -> usize {
        self.value.get(key).and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// The elements of a list; none when it is missing.
    pub(super) fn elements(&self, key: &str) -> Read<Vec<Self>> {
        let Some(member) = self.member(key) else {
            return Ok(Vec::new());
        };
        let Some(list) = member.value.as_array() else {
            return flaw(WRONG_TYPE, member.place);
        };
        Ok(list
            .iter()
            .enumerate()
            .map(|(i, value)| Self {
                value,
                place: format!("{}/{i}", member.place),
            })
            .collect())
    }

    /// A number that counts or indexes something.
    pub(super) fn as_index(&self) -> Read<usize> {
        whole(self.value)
            .and_then(|i| usize::try_from(i).ok())
            .map_or_else(|| flaw(WRONG_TYPE, self.place.clone()), Ok)
    }

    /// An optional member that counts or indexes something.
    pub(super) fn index(&self, key: &str) -> Read<Option<usize>> {
        self.member(key).map(|m| m.as_index()).transpose()
    }

    /// An optional text.
    pub(super) fn text(&self, key: &str) -> Read<Option<&'a str>> {
        match self.member(key) {
            None => Ok(None),
            Some(member) => match member.value.as_str() {
                Some(text) => Ok(Some(text)),
                None => flaw(WRONG_TYPE, member.place),
            },
        }
    }

    /// An optional truth value.
    pub(super) fn truth(&self, key: &str) -> Read<bool> {
        match self.member(key) {
            None => Ok(false),
            Some(member) => match member.value.as_bool() {
                Some(truth) => Ok(truth),
                None => flaw(WRONG_TYPE, member.place),
            },
        }
    }

    /// An optional list of exactly `N` numbers.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Read<Option<[f64; N]>> {
        let Some(member) = self.member(key) else {
            return Ok(None);
        };
        let Some(list) = member.value.as_array().filter(|l| l.len() == N) else {
            return flaw(WRONG_TYPE, member.place);
        };
        let mut numbers = [0.0; N];
        for (number, value) in numbers.iter_mut().zip(list) {
            match value.as_f64() {
                Some(f) => *number = f,
                None => return flaw(WRONG_TYPE, member.place),
            }
        }
        Ok(Some(numbers))
    }

    /// Its name for people, when it has one.
    pub(super) fn name(&self) -> Option<&'a str> {
        self.value.get("name").and_then(Value::as_str).filter(|n| !n.is_empty())
    }
}

/// A number that counts something. Some exporters write 3.0 for 3.
pub(super) fn whole(value: &Value) -> Option<u64> {
    let whole = |f: f64| (f >= 0.0 && f <= 2f64.powi(53) && f.fract() == 0.0).then_some(f as u64);
    value.as_u64().or_else(|| value.as_f64().and_then(whole))
}

/// An upper bound of the memory that a JSON text takes as values, found without parsing it.
///
/// A parsed object costs at least one B-tree leaf (eleven keys and values); everything else one value per separator.
pub(super) fn parsed_bytes(text: &[u8]) -> usize {
    const OBJECT_BYTES: usize = 640;
    const VALUE_BYTES: usize = 56;
    let (mut bytes, mut in_string, mut escaped) = (text.len(), false, false);
    for &byte in text {
        if in_string {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b'{' => bytes = bytes.saturating_add(OBJECT_BYTES),
            b'[' | b',' => bytes = bytes.saturating_add(VALUE_BYTES),
            _ => {}
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_member_of_the_wrong_type_is_a_flaw_with_its_place() {
        let document = json!({"nodes": [{"mesh": "no", "children": 3, "matrix": [1, 2]}], "accessors": "no"});
        let root = Item::root(&document);
        let node = root.listed("nodes", 0).unwrap();
        for trouble in [
            node.index("mesh").err(),
            node.elements("children").err(),
            node.numbers::<16>("matrix").err(),
            root.listed("accessors", 0).err(),
            root.listed("nodes", 1).err(),
        ] {
            let Some(super::super::error::Trouble::Flaw(flaw)) = trouble else {
                panic!("no flaw: {trouble:?}")
            };
            assert!(flaw.place.starts_with('/'), "{flaw:?}");
        }
    }

    #[test]
    fn whole_floats_are_indices_and_others_are_not() {
        let document = json!({"a": 3.0, "b": 3.5, "c": -1, "d": 1e300});
        let root = Item::root(&document);
        assert_eq!(root.index("a").unwrap(), Some(3));
        assert!(root.index("b").is_err() && root.index("c").is_err() && root.index("d").is_err());
        assert_eq!(root.index("e").unwrap(), None);
    }

    #[test]
    fn text_inside_strings_is_not_counted_as_structure() {
        let text = br#""[{,\"[""#;
        assert_eq!(parsed_bytes(text), text.len());
        assert_eq!(parsed_bytes(b"[1,2]"), 5 + 2 * 56);
    }
}
