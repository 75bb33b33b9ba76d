//! Which worlds are built into the program? Rules in `content/`, which import each other.

/// A world that can be shown without any file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct World {
    /// The scene's name.
    pub(crate) name: &'static str,
    /// Its name for people.
    pub(crate) title: &'static str,
    /// Its file, one of those that [`text`] knows.
    pub(crate) file: &'static str,
}

/// All of them, the one that is opened at the front.
pub(crate) const WORLDS: [World; 3] = [
    World {
        name: "town",
        title: "Town",
        file: "town.dcg",
    },
    World {
        name: "museum",
        title: "Museum",
        file: "museum.dcg",
    },
    World {
        name: "forest",
        title: "Forest",
        file: "forest.dcg",
    },
];

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../content/", $name)))),*]
    };
}

/// The files of the worlds and what these import.
const FILES: [(&str, &str); 10] = files![
    "conifer.dcg",
    "exhibits.dcg",
    "forest.dcg",
    "furniture.dcg",
    "houses.dcg",
    "museum.dcg",
    "pictures.dcg",
    "rooms.dcg",
    "town.dcg",
    "tree.dcg",
];

/// The text of a built-in file.
pub(crate) fn text(file: &str) -> Option<&'static str> {
    FILES.iter().find(|(name, _)| *name == file).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use belvedere_scene::procedural::{Loader, Program};

    use super::*;

    struct BuiltIn;

    impl Loader for BuiltIn {
        fn load(&self, path: &str) -> Result<String, String> {
            text(path).map(str::to_owned).ok_or_else(|| "not built in".to_owned())
        }
    }

    #[test]
    fn worlds_find_what_they_import_and_nothing_else_is_built_in() {
        let mut used = BTreeSet::new();
        for world in WORLDS {
            let main = text(world.file).expect("the world is built in").to_owned();
            let program = Program::read(world.file, main, &BuiltIn).expect("sound rules");
            used.extend(program.files().map(|(name, _)| name.to_owned()));
        }
        let built_in: BTreeSet<_> = FILES.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(used, built_in);
    }
}
