//! What stands above the drawing of a floor plan? Its title and measures, the names and styles of its rooms, and what its letters
//! mean, line by line.

use std::collections::BTreeMap;

use super::error::{PlanError, Problem};
use super::kinds::Kind;
use super::legend::{At, Entry, Facing, RoomStyle, Words, read_entry, read_style};
use super::place::Symbol;

const FIXED: [(char, &str); 8] = [
    ('#', "wall"),
    ('.', "floor"),
    (' ', "floor or open ground"),
    ('+', "a doorway"),
    ('%', "a glass door"),
    ('=', "a window"),
    ('@', "a viewpoint that looks north"),
    ('0', "part of a room's number, as all digits do"),
];

/// What all of them say.
pub(super) struct Headers {
    pub(super) title: Option<String>,
    pub(super) tile_m: f32,
    pub(super) wall_height_m: f32,
    pub(super) door_height_m: f32,
    pub(super) rooms: BTreeMap<u32, (usize, String, RoomStyle)>,
    /// `None` in a bare drawing, where every letter is a marker.
    pub(super) legend: Option<BTreeMap<char, (usize, Symbol)>>,
}

impl Headers {
    pub(super) fn bare() -> Self {
        Self {
            title: None,
            tile_m: 1.0,
            wall_height_m: 3.0,
            door_height_m: 2.2,
            rooms: BTreeMap::new(),
            legend: None,
        }
    }

    pub(super) fn symbol(&self, symbol: char) -> Option<Symbol> {
        match &self.legend {
            Some(legend) => match legend.get(&symbol) {
                Some((_, meaning)) => Some(*meaning),
                None => (symbol == '@').then_some(Symbol::Viewpoint(Facing::North)),
            },
            None if symbol.is_ascii_alphabetic() => Some(Symbol::Furniture(Entry::plain(Kind::Marker))),
            None => (symbol == '@').then_some(Symbol::Viewpoint(Facing::North)),
        }
    }

    pub(super) fn known_symbols(&self) -> String {
        let letters: Vec<String> = match &self.legend {
            Some(legend) => legend.keys().map(char::to_string).collect(),
            None => vec!["a–z".to_owned(), "A–Z".to_owned()],
        };
        format!("# . + % = @ 0–9 {}", letters.join(" ")).trim_end().to_owned()
    }
}

/// Whether a line is neither empty nor a remark.
pub(super) fn says_something(line: &str) -> bool {
    !line.trim().is_empty() && !line.trim_start().starts_with("//")
}

const KEYS: [&str; 7] = ["title", "tile", "wall height", "door height", "rooms", "legend", "plan"];

/// The key of a header line and what follows its colon.
pub(super) fn header_key(line: &str) -> Option<(&'static str, &str)> {
    let (key, value) = line.split_once(':')?;
    let key = KEYS.into_iter().find(|known| *known == key.trim())?;
    Some((key, value))
}

#[derive(PartialEq)]
enum Section {
    Top,
    Rooms,
    Legend,
}

/// Reads all of them; and on which line the drawing begins, counted from 0.
pub(super) fn read_headers(lines: &[&str]) -> Result<(Headers, usize), PlanError> {
    let mut headers = Headers {
        legend: Some(BTreeMap::new()),
        ..Headers::bare()
    };
    let mut section = Section::Top;
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, line) in lines.iter().enumerate() {
        let number = index + 1;
        let located = |(column, problem)| PlanError {
            line: number,
            column,
            problem,
        };
        if !says_something(line) {
            continue;
        }
        if let Some((key, value)) = header_key(line) {
            if let Some(first_line) = seen.insert(key, number) {
                return Err(located((
                    1,
                    Problem::Duplicate {
                        key: key.to_owned(),
                        first_line,
                    },
                )));
            }
            let column = line.chars().count() - value.chars().count() + 1;
            let mut words = Words::new(value, column);
            match key {
                "title" => {
                    headers.title = Some(value.trim().chars().filter(|c| !c.is_control()).take(200).collect());
                    continue;
                }
                "tile" => headers.tile_m = words.metres("a tile", 0.1, 10.0).map_err(located)?,
                "wall height" => headers.wall_height_m = words.metres("the wall height", 2.2, 30.0).map_err(located)?,
                "door height" => headers.door_height_m = words.metres("the door height", 1.8, 6.0).map_err(located)?,
                "rooms" => section = Section::Rooms,
                "legend" => section = Section::Legend,
                _ => {}
            }
            if words.peek().is_some() {
                return words.expected("the end of the line").map_err(located);
            }
            if key == "plan" {
                return Ok((headers, index + 1));
            }
            continue;
        }
        match section {
            Section::Top => {
                let expected = format!("a header: {}", KEYS.map(|k| format!("`{k}:`")).join(", "));
                let mut words = Words::new(line, 1);
                let found = words.next().unwrap_or_default().chars().take(24).collect();
                let column = 1 + line.chars().take_while(|c| c.is_whitespace()).count();
                return Err(located((column, Problem::Expected { found, expected })));
            }
            Section::Rooms => read_room(line, number, &mut headers.rooms).map_err(located)?,
            Section::Legend => {
                if let Some(legend) = &mut headers.legend {
                    read_symbol(line, number, legend).map_err(located)?;
                }
            }
        }
    }
    Err(PlanError {
        line: lines.len().max(1),
        column: 1,
        problem: Problem::NoDrawing,
    })
}

/// `12 = Armoury, walls #667, floor planks #852`.
fn read_room(line: &str, number: usize, rooms: &mut BTreeMap<u32, (usize, String, RoomStyle)>) -> At<()> {
    let indent = line.chars().take_while(|c| c.is_whitespace()).count();
    let expected = || Problem::Expected {
        found: line.trim().chars().take(24).collect(),
        expected: "a room, such as `12 = Armoury, walls #667`".to_owned(),
    };
    let (key, rest) = line.split_once('=').ok_or_else(|| (indent + 1, expected()))?;
    let digits = key.trim();
    if digits.is_empty() || digits.len() > 6 || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return Err((indent + 1, expected()));
    }
    let room: u32 = digits.parse().map_err(|_| (indent + 1, expected()))?;
    let mut column = key.chars().count() + 2;
    let mut style = RoomStyle::default();
    let mut name = String::new();
    for (i, part) in rest.split(',').enumerate() {
        let mut words = Words::new(part, column);
        if i == 0 {
            name = part
                .trim()
                .chars()
                .filter(|c| !c.is_control() && *c != '/')
                .take(80)
                .collect();
            if name.is_empty() {
                return words.expected("the room's name");
            }
        } else {
            read_style(&mut words, &mut style)?;
        }
        column += part.chars().count() + 1;
    }
    match rooms.insert(room, (number, name, style)) {
        Some((first_line, ..)) => Err((
            indent + 1,
            Problem::Duplicate {
                key: room.to_string(),
                first_line,
            },
        )),
        None => Ok(()),
    }
}

/// `v = vase height 0.6 colour #2a5`.
fn read_symbol(line: &str, number: usize, legend: &mut BTreeMap<char, (usize, Symbol)>) -> At<()> {
    let indent = line.chars().take_while(|c| c.is_whitespace()).count();
    let mut words = Words::new(line, 1);
    let key = words.next().unwrap_or_default();
    let mut characters = key.chars();
    let (Some(symbol), None) = (characters.next(), characters.next()) else {
        let expected = "one character, a space and `=`, such as `b = bench`".to_owned();
        return Err((
            indent + 1,
            Problem::Expected {
                found: key.chars().take(24).collect(),
                expected,
            },
        ));
    };
    let fixed = if symbol.is_ascii_digit() { '0' } else { symbol };
    if let Some((_, meaning)) = FIXED.into_iter().find(|(c, _)| *c == fixed && *c != '@') {
        return Err((indent + 1, Problem::Reserved { symbol, meaning }));
    }
    if words.peek() != Some("=") {
        return words.expected("`=`");
    }
    words.next();
    let meaning = if words.peek() == Some("viewpoint") {
        words.next();
        let mut facing = Facing::North;
        if words.peek() == Some("facing") {
            words.next();
            facing = words.facing()?;
        }
        if words.peek().is_some() {
            return words.expected("the end of the line");
        }
        Symbol::Viewpoint(facing)
    } else {
        Symbol::Furniture(read_entry(&mut words)?)
    };
    match legend.insert(symbol, (number, meaning)) {
        Some((first_line, _)) => Err((
            indent + 1,
            Problem::Duplicate {
                key: symbol.to_string(),
                first_line,
            },
        )),
        None => Ok(()),
    }
}
