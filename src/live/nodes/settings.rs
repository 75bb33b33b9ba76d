//! Where do nodes meet, and what is this one called?

use std::{fmt, str::FromStr};

use async_nats::ServerAddr;
use belvedere_live::nodes::NodeId;

/// How a server joins others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeSettings {
    /// Where they meet.
    pub nats: NatsAddress,
    /// What it is called, for people; none means any name.
    pub name: Option<NodeName>,
}

/// Servers of one NATS cluster. What secrets an address holds is not shown.
#[derive(Clone, PartialEq, Eq)]
pub struct NatsAddress(Vec<ServerAddr>);

/// The text is no address of NATS servers. It is not quoted, since it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("it must be like `nats://host:4222` or `tls://user:password@host:4222`, several of them with commas between")]
pub struct NotNats;

impl NatsAddress {
    pub(super) fn servers(&self) -> &[ServerAddr] {
        &self.0
    }
}

impl FromStr for NatsAddress {
    type Err = NotNats;

    fn from_str(text: &str) -> Result<Self, NotNats> {
        let servers: Result<Vec<ServerAddr>, _> = text.split(',').map(|one| one.trim().parse()).collect();
        let servers = servers.map_err(|_| NotNats)?;
        let meant = |server: &ServerAddr| matches!(server.scheme(), "nats" | "tls") && !server.host().is_empty();
        servers.iter().all(meant).then_some(Self(servers)).ok_or(NotNats)
    }
}

impl fmt::Display for NatsAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, server) in self.0.iter().enumerate() {
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
    fn two_runs_of_a_node_are_two_nodes() {
        let name: NodeName = "eu-1".parse().unwrap();
        assert_eq!(NodeName::run(Some(&name), 0x1f).to_string(), "eu-1-0000001f");
        assert_ne!(NodeName::run(Some(&name), 1), NodeName::run(Some(&name), 2));
        assert_eq!("eu.1".parse::<NodeName>(), Err(NotANodeName));
    }
}
