//! What is wrong with a floor plan, where, and what would put it right?

/// Why a floor plan was refused. Line and column count from 1.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {problem}")]
pub struct PlanError {
    /// Line in the text.
    pub line: usize,
    /// Character in the line.
    pub column: usize,
    /// What is wrong there.
    pub problem: Problem,
}

/// What is wrong at one place of a floor plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// There is no drawing.
    #[error(
        "there is no drawing; draw walls as `#`, floor as `.` and doorways as `+`, after a line `plan:` if there are headers"
    )]
    NoDrawing,
    /// The drawing has too many tiles on one side.
    #[error("the drawing is {tiles} tiles {side}; the limit is {limit}")]
    TooLarge {
        /// How many there are.
        tiles: usize,
        /// `wide` or `deep`.
        side: &'static str,
        /// How many there may be.
        limit: usize,
    },
    /// There are too many of something.
    #[error("more than {limit} {what}; make several plans of it")]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// How many there may be.
        limit: usize,
    },
    /// A tab, whose width nobody knows.
    #[error("a tab in the drawing; use spaces, because a tab has no fixed width")]
    Tab,
    /// A character that means nothing.
    #[error("`{symbol}` is not in the legend; add a line `{symbol} = …` or use one of {known}")]
    UnknownSymbol {
        /// The character.
        symbol: char,
        /// Those that are known.
        known: String,
    },
    /// A line of the header that cannot be read.
    #[error("cannot read `{found}`; expected {expected}")]
    Expected {
        /// What stands there.
        found: String,
        /// What may stand there.
        expected: String,
    },
    /// A number outside its range.
    #[error("{what} must be between {min} and {max} m")]
    OutOfRange {
        /// Which quantity.
        what: String,
        /// Lowest, metres.
        min: String,
        /// Highest, metres.
        max: String,
    },
    /// A symbol, room or header given twice.
    #[error("`{key}` was already given on line {first_line}; remove one of the two")]
    Duplicate {
        /// What is given twice.
        key: String,
        /// Where it was given first.
        first_line: usize,
    },
    /// A symbol with a fixed meaning.
    #[error("`{symbol}` always means {meaning}; choose another character")]
    Reserved {
        /// The character.
        symbol: char,
        /// What it means.
        meaning: &'static str,
    },
    /// A floor with no wall between it and the open ground.
    #[error("this floor has no wall towards the open ground; close the room with `#`, or with `+` for a doorway")]
    Unclosed,
    /// Two room numbers in one room.
    #[error("this room already has number {first}, on line {first_line}; wall the two rooms off or remove a number")]
    TwoNumbers {
        /// The number met first.
        first: u32,
        /// Where.
        first_line: usize,
    },
    /// A number that is used for two rooms.
    #[error("room {number} is already the room on line {first_line}; give this one another number")]
    NumberTaken {
        /// The number.
        number: u32,
        /// Where it was met first.
        first_line: usize,
    },
    /// A room of the `rooms:` section that was not drawn.
    #[error("room {number} is not in the drawing; write {number} on its floor or remove this line")]
    RoomNotDrawn {
        /// The number.
        number: u32,
    },
    /// A doorway or window that does not lie in a straight wall.
    #[error(
        "this opening is not in a straight wall; put `#` at both of its ends and floor or open ground on both of its sides"
    )]
    OpeningNotInWall,
    /// Something to hang, with nothing to hang it on.
    #[error("a {kind} hangs on a wall, and no `#` is within {reach} tiles; move it nearer to a wall")]
    NothingToHangOn {
        /// What hangs.
        kind: &'static str,
        /// How far walls were looked for.
        reach: usize,
    },
}
