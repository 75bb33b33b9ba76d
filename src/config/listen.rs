//! Where shall one listen? An address and a port; `localhost` stands for this machine's.

use std::net::SocketAddr;

use serde::{Deserialize, Deserializer, de::Error};

/// The address that a text names.
///
/// # Errors
/// What it should look like, for people.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    let numeric = match text.split_once(':') {
        Some((host, port)) if host.eq_ignore_ascii_case("localhost") => format!("127.0.0.1:{port}"),
        _ => text.to_owned(),
    };
    let wrong = format!("an address and a port are wanted, like 127.0.0.1:8080, 0.0.0.0:80 or [::]:8080; got `{text}`");
    numeric.parse().map_err(|_| wrong)
}

/// The same out of a file.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<SocketAddr>, D::Error> {
    let text = Option::<String>::deserialize(from)?;
    let found = text.map(|text| address(&text)).transpose();
    found.map_err(|wrong| Error::custom(format!("listen: {wrong}")))
}

#[cfg(test)]
mod tests {
    use super::address;

    #[test]
    fn addresses_are_numbers_or_this_machine() {
        for (text, expected) in [
            ("127.0.0.1:80", "127.0.0.1:80"),
            ("[::]:8080", "[::]:8080"),
            ("localhost:0", "127.0.0.1:0"),
            ("Localhost:9", "127.0.0.1:9"),
        ] {
            assert_eq!(address(text), Ok(expected.parse().unwrap()));
        }
        for text in ["", "8080", "localhost", ":8080", "example.org:80", "127.0.0.1:65536"] {
            let said = address(text).unwrap_err();
            assert!(
                said.contains("127.0.0.1:8080") && said.ends_with(&format!("got `{text}`")),
                "{said}"
            );
        }
    }
}
