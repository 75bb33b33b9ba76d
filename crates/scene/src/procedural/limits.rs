//! How much may a model take, and how much of that has it taken?

use super::problem::Problem;

/// Most bytes of one file of rules.
pub const MAX_TEXT_BYTES: usize = 1 << 20;
/// Most bytes of all files of one model: what is read of them takes some hundred times as much memory.
pub const MAX_ALL_TEXT_BYTES: usize = 4 << 20;
/// Most files of one model.
pub const MAX_MODULES: usize = 256;
/// Most letters of a name.
pub const MAX_NAME: usize = 255;
/// Most blocks, brackets and signs inside each other in a text.
pub const MAX_NESTING: u32 = 96;
/// Most transforms, loops and conditions around one another in a text: they need no brackets.
pub const MAX_AROUND: u32 = 256;
/// Most numbers in one list, those of lists inside of it included.
pub const MAX_LIST: usize = 1 << 16;
/// Most numbers of lists that are needed at once: by the calls that are open, and by what is being computed.
pub const MAX_HELD: usize = 1 << 21;
/// Most lists inside each other in a value.
pub const MAX_LIST_DEPTH: u32 = 64;
/// Most operators in a row.
pub const MAX_CHAIN: u32 = 64;
/// Most corners of a polygon.
pub const MAX_CORNERS: usize = 256;
/// Most sides of a round solid.
pub const MAX_SIDES: f64 = 256.0;
/// Most cells of a height field along one side.
pub const MAX_STEPS: f64 = 4_096.0;
/// The finest level of detail.
pub const FINEST: u32 = 4;

/// What the evaluation of a model may take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Calls inside each other.
    pub levels: u32,
    /// Everything inside each other: calls, blocks and expressions. Bounds the machine's stack.
    pub nesting: u32,
    /// Nodes visited, of rules and of expressions.
    pub steps: u64,
    /// Triangles, each part counted once.
    pub triangles: u64,
    /// Parts: pieces of geometry that can be placed often.
    pub parts: u64,
    /// Parts, glTF files and viewpoints placed, counting again whatever they contain.
    pub placements: u64,
    /// Different materials.
    pub materials: u64,
    /// Numbers that are kept: what parts, materials and files were given, and 8 letters of a name or path for each number.
    pub kept: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            levels: 64,
            nesting: 640,
            steps: 1_000_000_000,
            triangles: 16_000_000,
            parts: 65_536,
            placements: 1_000_000,
            materials: 4_096,
            kept: 1 << 22,
        }
    }
}

/// What was taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Usage {
    /// Most calls that were inside each other.
    pub levels: u32,
    /// Most of everything that was inside each other.
    pub nesting: u32,
    /// Nodes visited.
    pub steps: u64,
    /// Triangles, each part counted once.
    pub triangles: u64,
    /// Parts.
    pub parts: u64,
    /// Parts, glTF files and viewpoints placed.
    pub placements: u64,
    /// Materials.
    pub materials: u64,
    /// Numbers kept.
    pub kept: u64,
    /// Files, the first included.
    pub files: u64,
    /// Bytes of all files.
    pub text: u64,
}

impl Usage {
    /// Name, taken and allowed, for each limit.
    #[must_use]
    pub fn of(&self, limits: &Limits) -> [(&'static str, u64, u64); 10] {
        [
            ("levels", self.levels.into(), limits.levels.into()),
            ("nesting", self.nesting.into(), limits.nesting.into()),
            ("steps", self.steps, limits.steps),
            ("triangles", self.triangles, limits.triangles),
            ("parts", self.parts, limits.parts),
            ("placements", self.placements, limits.placements),
            ("materials", self.materials, limits.materials),
            ("numbers kept", self.kept, limits.kept),
            ("files", self.files, MAX_MODULES as u64),
            ("bytes of text", self.text, MAX_ALL_TEXT_BYTES as u64),
        ]
    }
}

/// The error of a limit that was reached.
#[must_use]
pub fn reached(what: &'static str, limit: u64) -> Problem {
    let way_out = match what {
        "brackets and blocks inside each other" => "give a part of it a name, with `let`, `rule` or `function`",
        "transforms, loops and conditions around one another" => {
            "put what is inside into a `rule` or `function`, or `choose` by a number"
        }
        "operators in a row" => "compute a part of it before, with `let`",
        "letters in a name" | "letters in a path" => "choose a shorter one",
        "numbers in lists at once" => {
            "name long lists outside of rules, with `let`, and hand fewer of them down through calls"
        }
        "numbers kept" => "give parts, materials and files fewer different lists, and use shorter names",
        "levels of calls, those of functions too" => {
            "stop the recursion earlier, with `if`, or let each call halve what is left"
        }
        "levels" | "levels of nesting" => "stop the recursion earlier, with `if` or `levels`",
        "steps" => "repeat less, or grow it with less detail",
        "triangles" => "use fewer sides or steps, or a `part` for what is repeated",
        "placements" => "place fewer, or split the world into several files",
        "parts" => "give parts parameters that take fewer different values, and call less by names of its own",
        "bytes of text in all files" => "leave out what is not used, or make several models of it",
        "materials" => "let their parameters, and those of the files that have them, take fewer different values",
        _ => "make it smaller",
    };
    Problem::Limit { what, limit, way_out }
}
