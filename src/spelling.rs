//! Which known name was meant by one that is not known?

/// The name that is spelt most alike, if one is; `own` bytes of the name are its own.
pub(crate) fn nearest_of<'a>(name: &str, known: impl Iterator<Item = &'a str>, own: usize) -> Option<String> {
    let far = |other: &str| match (other.strip_prefix(name), name.strip_prefix(other)) {
        // The start of one, or one with a word more.
        (Some(_), _) => 1,
        (_, Some(more)) if more.starts_with('_') => 2,
        _ => strsim::levenshtein(name, other),
    };
    let (far, nearest) = known.map(|other| (far(other), other)).min()?;
    (own > 0 && far <= own.div_ceil(3)).then(|| nearest.to_owned())
}
