//! Where do nodes meet, and what is this one called?

use std::{fmt, str::FromStr};

use async_nats::{ConnectOptions, ServerAddr};
use belvedere_live::nodes::NodeId;
use percent_encoding::percent_decode_str;

use crate::secret::Secret;

/// How a server joins others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeSettings {
    /// Where they meet.
    pub nats: NatsAddress,
    /// What it is called, for people; none means any name.
    pub name: Option<NodeName>,
}

/// Servers of one NATS cluster, and how to log in there. No secret is shown.
#[derive(Clone, PartialEq, Eq)]
pub struct NatsAddress {
    /// Without what stood before the `@`, which the client would log.
    servers: Vec<ServerAddr>,
    login: Option<Login>,
}

/// Who a node is to NATS.
#[derive(Clone, PartialEq, Eq)]
enum Login {
    User { name: String, password: Secret },
    Token(Secret),
}

/// The text is no address of NATS servers. It is not quoted, since it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotNats {
    /// It is no list of addresses.
    #[error(
        "it must be like `nats://host:4222`, `tls://user:password@host:4222` or `nats://token@host:4222`, several of them with \
         commas between; in user, password and token `%40` stands for @, `%3A` for :, `%2F` for / and `%2C` for a comma"
    )]
    Form,
    /// Its servers would have to be told different things.
    #[error(
        "servers of one cluster take the same user and password, or the same token: give it with each, or with one alone"
    )]
    Logins,
}

impl NatsAddress {
    pub(super) fn servers(&self) -> &[ServerAddr] {
        &self.servers
    }

    /// Options that log in. The client takes nothing of that from addresses.
    pub(super) fn log_in(&self, options: ConnectOptions) -> ConnectOptions {
        match &self.login {
            None => options,
            Some(Login::User { name, password }) => {
                options.user_and_password(name.clone(), password.reveal().to_owned())
            }
            Some(Login::Token(token)) => options.token(token.reveal().to_owned()),
        }
    }
}

impl FromStr for NatsAddress {
    type Err = NotNats;

    fn from_str(text: &str) -> Result<Self, NotNats> {
        let (mut servers, mut login) = (Vec::new(), None);
        for one in text.split(',') {
            let server: ServerAddr = one.trim().parse().map_err(|_| NotNats::Form)?;
            if !matches!(server.scheme(), "nats" | "tls") || server.host().is_empty() {
                return Err(NotNats::Form);
            }
            if let Some(own) = Login::of(&server)?
                && *login.get_or_insert_with(|| own.clone()) != own
            {
                return Err(NotNats::Logins);
            }
            let mut bare = server.into_inner();
            let cleared = bare.set_username("").and_then(|()| bare.set_password(None));
            cleared.map_err(|()| NotNats::Form)?;
            servers.push(ServerAddr::from_url(bare).map_err(|_| NotNats::Form)?);
        }
        Ok(Self { servers, login })
    }
}

impl Login {
    /// What stands before the `@`: a user and a password, or a token.
    fn of(server: &ServerAddr) -> Result<Option<Self>, NotNats> {
        let meant = |text: &str| match percent_decode_str(text).decode_utf8() {
            Ok(text) => Ok(text.into_owned()),
            Err(_) => Err(NotNats::Form),
        };
        Ok(match (server.username(), server.password()) {
            (None, None) => None,
            (None, Some(_)) => return Err(NotNats::Form),
            (Some(token), None) => Some(Self::Token(meant(token)?.as_str().into())),
            (Some(name), Some(password)) => Some(Self::User {
                name: meant(name)?,
                password: meant(password)?.as_str().into(),
            }),
        })
    }
}

impl fmt::Display for NatsAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, server) in self.servers.iter().enumerate() {
            let comma = if number > 0 { "," } else { "" };
            write!(f, "{comma}{}://{}:{}", server.scheme(), server.host(), server.port())?;
        }
        Ok(())
    }
}

impl fmt::Debug for NatsAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

/// What a node is called: short enough that a number which tells its runs apart can follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeName(String);

const MOST_NAME: usize = 40;

/// The text is no name of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a node's name has 1 to {MOST_NAME} lower-case letters, digits and hyphens")]
pub struct NotANodeName;

impl NodeName {
    /// What a node is called that nobody has named.
    pub const UNLESS_SET: &str = "node";

    /// This run of the node.
    pub(super) fn run(name: Option<&Self>, number: u32) -> NodeId {
        let name = name.map_or(Self::UNLESS_SET, |name| &name.0);
        let id = format!("{name}-{number:08x}");
        id.parse().expect("letters, digits and hyphens, few of them")
    }
}

impl fmt::Display for NodeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for NodeName {
    type Err = NotANodeName;

    fn from_str(text: &str) -> Result<Self, NotANodeName> {
        let fits = text.len() <= MOST_NAME && text.parse::<NodeId>().is_ok();
        fits.then(|| Self(text.to_owned())).ok_or(NotANodeName)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_shows_no_secret() {
        let address: NatsAddress = "nats://me:sesame@a:4222, tls://b".parse().unwrap();
        assert_eq!(format!("{address:?}"), "nats://a:4222,tls://b:4222");
        for wrong in ["", "ftp://a", "nats://", "nats://a:sesame:b"] {
            let error = wrong.parse::<NatsAddress>().unwrap_err().to_string();
            assert!(!error.contains("sesame"), "{error}");
        }
    }

    #[test]
    fn what_stands_before_the_at_is_decoded_and_one_for_all_servers() {
        let login = |text: &str| text.parse::<NatsAddress>().map(|address| address.login);
        let user = Login::User {
            name: "me".to_owned(),
            password: "open:se@me".into(),
        };
        for text in [
            "nats://m%65:open%3Ase%40me@a",
            "tls://b, nats://me:open%3Ase%40me@a",
            "nats://me:open:se%40me@a, nats://me:open%3Ase%40me@b",
        ] {
            assert!(login(text) == Ok(Some(user.clone())), "{text}");
        }
        assert!(login("nats://to%2Fken@a") == Ok(Some(Login::Token("to/ken".into()))));
        assert!(login("nats://a,tls://b") == Ok(None));
        for text in ["nats://me:one@a,nats://me:two@b", "nats://me@a,nats://me:two@b"] {
            assert!(login(text) == Err(NotNats::Logins), "{text}");
        }
        for text in ["nats://:one@a", "nats://m%ffe:one@a"] {
            assert!(login(text) == Err(NotNats::Form), "{text}");
        }
        let address: NatsAddress = "nats://me:sesame@a".parse().unwrap();
        let shown = format!("{:?} {:?}", address.servers(), address.log_in(ConnectOptions::new()));
        assert!(!shown.contains("sesame"), "{shown}");
    }

    #[test]
    fn two_runs_of_a_node_are_two_nodes() {
        let name: NodeName = "eu-1".parse().unwrap();
        assert_eq!(NodeName::run(Some(&name), 0x1f).to_string(), "eu-1-0000001f");
        assert_ne!(NodeName::run(Some(&name), 1), NodeName::run(Some(&name), 2));
        assert_eq!("eu.1".parse::<NodeName>(), Err(NotANodeName));
    }
}
