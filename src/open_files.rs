//! How many files may this process have open, and how many of them may be connections? As many as the system grants who asks;
//! connections leave some of them to the catalogue, to objects that are read, and to bakes.

/// What connections leave to everything else, where there is so much.
const OTHERS: u64 = 256;

/// Asks for as many open files as the system grants, and says how many of the connections that are wanted find room there.
pub(crate) fn room_for(wanted: usize) -> usize {
    granted().map_or(wanted, |most| share(most, wanted))
}

fn share(most: u64, wanted: usize) -> usize {
    let room = most - OTHERS.min(most / 2);
    wanted.min(usize::try_from(room).unwrap_or(usize::MAX))
}

/// How many there may be; none where nobody counts.
#[cfg(unix)]
fn granted() -> Option<u64> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

    let now = getrlimit(Resource::Nofile);
    let all = Rlimit {
        current: now.maximum,
        maximum: now.maximum,
    };
    // Where that is refused, what there was holds.
    match setrlimit(Resource::Nofile, all) {
        Ok(()) => now.maximum,
        Err(_) => now.current,
    }
}

#[cfg(not(unix))]
fn granted() -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_leave_files_to_everything_else() {
        for (most, wanted, room) in [
            (1 << 20, 10_000, 10_000),
            (1024, 10_000, 768),
            (64, 10_000, 32),
            (1024, 100, 100),
        ] {
            assert_eq!(share(most, wanted), room, "{wanted} of {most}");
        }
    }
}
