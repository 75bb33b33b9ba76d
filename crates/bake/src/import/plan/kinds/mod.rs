//! What furniture is there? One drawing routine for each kind, all in metres, standing on y = 0 and facing +Z.

mod antiquity;
mod figures;
mod furniture;
mod modern;
mod natural;
mod pictures;
mod vessels;

use super::finish::{self, Finish};
use super::legend::{Entry, Stuff};
use super::mesh::Mesh;

/// How a kind takes its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stance {
    /// In the middle of its tile.
    Free,
    /// Its back to the nearest wall.
    AgainstWall {
        /// From front to back, metres.
        depth_m: f32,
    },
    /// Hung on the nearest wall; its origin lies in the wall's face.
    OnWall,
    /// Hung from the ceiling; its origin lies in the ceiling.
    FromCeiling,
}

macro_rules! kinds {
    ($($kind:ident $name:literal $stance:expr, $draw:path;)*) => {
        /// A kind of furniture.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub(crate) enum Kind { $($kind),* }

        impl Kind {
            const ALL: &'static [Self] = &[$(Self::$kind),*];

            /// As written in a legend.
            pub(crate) fn name(self) -> &'static str {
                match self { $(Self::$kind => $name),* }
            }

            pub(crate) fn stance(self) -> Stance {
                use Stance::*;
                match self { $(Self::$kind => $stance),* }
            }

            fn drawer(self) -> fn(&mut Mesh, &Piece) {
                match self { $(Self::$kind => $draw),* }
            }
        }
    };
}

kinds! {
    Marker "marker" Free, furniture::marker;
    Bench "bench" Free, furniture::bench;
    Sofa "sofa" AgainstWall { depth_m: 0.9 }, furniture::sofa;
    Chair "chair" Free, furniture::chair;
    Table "table" Free, furniture::table;
    CafeTable "cafe-table" Free, furniture::cafe_table;
    Counter "counter" AgainstWall { depth_m: 0.7 }, furniture::counter;
    Desk "desk" Free, furniture::desk;
    Bookshelf "bookshelf" AgainstWall { depth_m: 0.36 }, furniture::bookshelf;
    Rug "rug" Free, furniture::rug;
    Barrier "barrier" Free, furniture::barrier;
    Lamp "lamp" Free, furniture::lamp;
    Chandelier "chandelier" FromCeiling, furniture::chandelier;
    Pendant "pendant" FromCeiling, furniture::pendant;
    Plinth "plinth" Free, furniture::plinth;
    Vitrine "vitrine" Free, furniture::vitrine;
    Vase "vase" Free, vessels::vase;
    Amphora "amphora" Free, vessels::amphora;
    Bowl "bowl" Free, vessels::bowl;
    Urn "urn" Free, vessels::urn;
    GlassVessel "glass-vessel" Free, vessels::glass_vessel;
    Fountain "fountain" Free, vessels::fountain;
    Globe "globe" Free, vessels::globe;
    Statue "statue" Free, figures::statue;
    Bust "bust" Free, figures::bust;
    Armour "armour" Free, figures::armour;
    Column "column" Free, antiquity::column;
    BrokenColumn "broken-column" Free, antiquity::broken_column;
    Obelisk "obelisk" Free, antiquity::obelisk;
    Sphinx "sphinx" Free, antiquity::sphinx;
    Sarcophagus "sarcophagus" Free, antiquity::sarcophagus;
    CanopicJar "canopic-jar" Free, antiquity::canopic_jar;
    Shield "shield" OnWall, antiquity::shield;
    Knot "knot" Free, modern::knot;
    Spheres "spheres" Free, modern::spheres;
    Pebble "pebble" Free, modern::pebble;
    Mobile "mobile" FromCeiling, modern::mobile;
    Dinosaur "dinosaur" Free, natural::dinosaur;
    Ammonite "ammonite" Free, natural::ammonite;
    Crystal "crystal" Free, natural::crystal;
    Plant "plant" Free, natural::plant;
    Tree "tree" Free, natural::tree;
    Painting "painting" OnWall, pictures::painting;
    Tapestry "tapestry" OnWall, pictures::tapestry;
    Clock "clock" OnWall, pictures::clock;
}

impl Kind {
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// All names, for messages.
    pub(crate) fn names() -> String {
        Self::ALL.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ")
    }

    /// Whether every piece has geometry of its own.
    pub(crate) fn is_unique(self) -> bool {
        matches!(self, Self::Painting)
    }

    /// Whether its height follows the ceiling.
    pub(crate) fn fills_height(self) -> bool {
        matches!(self, Self::Column | Self::Pendant | Self::Chandelier | Self::Mobile)
    }
}

/// What is to be drawn.
struct Piece {
    entry: Entry,
    seed: u64,
    ceiling_m: f32,
}

impl Piece {
    fn height(&self, usual_m: f32) -> f32 {
        self.entry.height_m.unwrap_or(usual_m)
    }

    fn width(&self, usual_m: f32) -> f32 {
        self.entry.width_m.unwrap_or(usual_m)
    }

    /// The finish asked for, else the usual one; a colour dyes it.
    fn finish(&self, usual: Finish) -> Finish {
        let stuff = match self.entry.stuff {
            None => usual,
            Some(Stuff::Marble) => finish::MARBLE,
            Some(Stuff::Limestone) => finish::LIMESTONE,
            Some(Stuff::Granite) => finish::GRANITE,
            Some(Stuff::Bronze) => finish::BRONZE,
            Some(Stuff::Gold) => finish::GOLD,
            Some(Stuff::Steel) => finish::STEEL,
            Some(Stuff::Iron) => finish::IRON,
            Some(Stuff::Clay) => finish::CLAY,
            Some(Stuff::Oak) => finish::OAK,
            Some(Stuff::Walnut) => finish::WALNUT,
        };
        stuff.dyed(self.entry.colour)
    }
}

/// Draws one piece; `seed` varies it, `ceiling_m` is the clear height of its room.
pub(super) fn draw(mesh: &mut Mesh, entry: &Entry, seed: u64, ceiling_m: f32) {
    entry.kind.drawer()(
        mesh,
        &Piece {
            entry: *entry,
            seed,
            ceiling_m,
        },
    );
}
