//! What does a file of rules say? Its nodes: a directed graph, cyclic where rules call each other.
//!
//! Names of variables are already slots: where a value lies in the frame of a rule, or among the values of a file. Calls
//! lie in a table beside the nodes; [`link`](super::link) fills in what they lead to.

use super::operation::{BuiltIn, Operator};
use super::solid::SolidKind;
use std::ops::Range;

/// Byte in the text of a module.
pub(super) type At = u32;

/// One file.
#[derive(Debug, Clone, Default)]
pub(super) struct Module {
    pub(super) file: String,
    pub(super) text: String,
    pub(super) imports: Vec<Import>,
    pub(super) parameters: Vec<Parameter>,
    /// `let` outside of rules: value `i` of these lies behind the parameters.
    pub(super) globals: Vec<Named<Written>>,
    pub(super) rules: Vec<Rule>,
    pub(super) functions: Vec<Function>,
    pub(super) materials: Vec<MaterialRule>,
    pub(super) body: Vec<Statement>,
    /// Values that the body has besides the globals.
    pub(super) body_slots: u32,
    pub(super) calls: Vec<Call>,
    /// Where `model` stands, and the file that it names.
    pub(super) models: Vec<(At, String)>,
    /// Uses of globals.
    pub(super) uses: Vec<Use>,
    /// Statements that have a number of their own, which may be done [at one go](super::evaluator).
    pub(super) plans: u32,
    /// Expressions that stay the same as long as the values of the file do.
    pub(super) settled: u32,
}

#[derive(Debug, Clone)]
pub(super) struct Named<T> {
    pub(super) name: String,
    pub(super) at: At,
    pub(super) value: T,
}

#[derive(Debug, Clone)]
pub(super) struct Import {
    pub(super) alias: String,
    /// Where the path stands.
    pub(super) at: At,
    pub(super) path: String,
    /// Index of the module, once linked.
    pub(super) module: usize,
}

/// An expression, and where it begins: an argument with its name, if it has one.
#[derive(Debug, Clone)]
pub(super) struct Written {
    pub(super) at: At,
    pub(super) of: Expr,
}

/// What a file can be given from outside.
#[derive(Debug, Clone)]
pub(super) struct Parameter {
    pub(super) formal: Formal,
    pub(super) range: Option<[Written; 2]>,
    /// Where its own value stands in the text, with the blanks behind it.
    pub(super) default: Range<usize>,
    /// Its name with its range, as they are written.
    pub(super) shown: String,
}

/// What a rule, function or material can be given.
#[derive(Debug, Clone)]
pub(super) struct Formal {
    pub(super) name: String,
    pub(super) at: At,
    pub(super) default: Option<Written>,
}

#[derive(Debug, Clone)]
pub(super) struct Rule {
    pub(super) name: String,
    pub(super) at: At,
    /// Its geometry depends on its parameters alone and is shared.
    pub(super) is_part: bool,
    pub(super) formals: Vec<Formal>,
    pub(super) levels: Option<Written>,
    /// Two opposite corners of a box that holds it.
    pub(super) within: Option<[Written; 2]>,
    pub(super) body: Statement,
    /// In place of the body when `levels` are used up.
    pub(super) then: Option<Statement>,
    pub(super) slots: u32,
}

#[derive(Debug, Clone)]
pub(super) struct Function {
    pub(super) name: String,
    pub(super) formals: Vec<Formal>,
    pub(super) value: Written,
    pub(super) slots: u32,
}

#[derive(Debug, Clone)]
pub(super) struct MaterialRule {
    pub(super) name: String,
    pub(super) formals: Vec<Formal>,
    pub(super) properties: Vec<(Property, Written)>,
    pub(super) slots: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Property {
    Colour,
    Roughness,
    Metallic,
    Emissive,
    Opacity,
    DoubleSided,
    Recolour,
}

impl Property {
    pub(super) const ALL: [(&'static str, Self); 7] = [
        ("colour", Self::Colour),
        ("roughness", Self::Roughness),
        ("metallic", Self::Metallic),
        ("emissive", Self::Emissive),
        ("opacity", Self::Opacity),
        ("double_sided", Self::DoubleSided),
        ("recolour", Self::Recolour),
    ];
}

/// A call of a rule, a part, a file, a function or a material.
#[derive(Debug, Clone)]
pub(super) struct Call {
    pub(super) at: At,
    /// The alias before the dot.
    pub(super) module: Option<String>,
    pub(super) name: String,
    pub(super) arguments: Vec<Argument>,
    /// Which word the call adds to the path.
    pub(super) site: u32,
    pub(super) wanted: Wanted,
    /// Whether it names another file and no brackets follow, as where one reads a value: there is none to be read.
    pub(super) is_value: bool,
    /// What it leads to, once linked.
    pub(super) target: Target,
    /// The formals that are given, rising, and the argument of each, once linked.
    pub(super) given: Vec<(usize, usize)>,
}

impl Call {
    /// The arguments in the order of the formals that they give, with these.
    pub(super) fn given(&self) -> impl Iterator<Item = (usize, &Argument)> {
        self.given
            .iter()
            .map(|(formal, argument)| (*formal, &self.arguments[*argument]))
    }

    /// The formals that no argument gives, with their places.
    pub(super) fn left<'f>(&self, formals: &'f [Formal]) -> impl Iterator<Item = (usize, &'f Formal)> {
        let mut given = self.given.iter().map(|(formal, _)| *formal).peekable();
        formals
            .iter()
            .enumerate()
            .filter(move |(place, _)| given.next_if_eq(place).is_none())
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Wanted {
    Shape,
    Function,
    Material,
}

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Target {
    pub(super) module: usize,
    /// Index of the rule, function or material; `None` for the file as a whole.
    pub(super) index: Option<usize>,
}

#[derive(Debug, Clone)]
pub(super) struct Argument {
    pub(super) name: Option<String>,
    pub(super) value: Written,
}

/// A global that is used before it may be known.
#[derive(Debug, Clone)]
pub(super) struct Use {
    pub(super) name: String,
    pub(super) at: At,
    pub(super) slot: usize,
}

#[derive(Debug, Clone)]
pub(super) enum Statement {
    Group {
        of: Vec<Statement>,
        plan: u32,
    },
    Let {
        at: At,
        slot: u32,
        value: Written,
    },
    If {
        at: At,
        condition: Written,
        then: Box<Statement>,
        otherwise: Option<Box<Statement>>,
    },
    Choose {
        at: At,
        number: Written,
        of: Vec<Statement>,
    },
    Place {
        transform: Transform,
        at: At,
        by: Vec<Written>,
        body: Box<Statement>,
        plan: u32,
    },
    Paint {
        call: usize,
        body: Box<Statement>,
    },
    Called {
        at: At,
        name: String,
        body: Box<Statement>,
    },
    Call {
        call: usize,
        plan: u32,
    },
    Solid {
        kind: SolidKind,
        at: At,
        arguments: Vec<Option<Written>>,
        plan: u32,
    },
    Viewpoint {
        at: At,
        name: String,
    },
    Impostor {
        at: At,
        arguments: Vec<Option<Written>>,
    },
    Model {
        at: At,
        path: String,
    },
    For {
        at: At,
        site: u32,
        slots: Vec<u32>,
        over: Written,
        body: Box<Statement>,
        plan: u32,
    },
    Scatter {
        at: At,
        site: u32,
        slots: [u32; 2],
        count: Written,
        over: [Written; 2],
        body: Box<Statement>,
    },
    Edges {
        at: At,
        site: u32,
        slots: Vec<u32>,
        polygon: Written,
        body: Box<Statement>,
    },
    Heights {
        at: At,
        slots: [u32; 2],
        over: [Written; 2],
        steps: [Written; 2],
        height: Written,
        plan: u32,
    },
}

impl Statement {
    /// Where a value is named, when this does that.
    pub(super) fn let_at(&self) -> Option<At> {
        match self {
            Self::Let { at, .. } => Some(*at),
            _ => None,
        }
    }

    /// Its number among those that may be done at one go. That of a loop is for its turns.
    pub(super) fn plan(&self) -> Option<u32> {
        match self {
            Self::Group { plan, .. }
            | Self::Place { plan, .. }
            | Self::Call { plan, .. }
            | Self::Solid { plan, .. } => Some(*plan),
            _ => None,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Transform {
    Move,
    Turn,
    Tilt,
    Roll,
    Scale,
}

impl Transform {
    pub(super) const NAMES: [&'static str; 5] = ["move", "turn", "tilt", "roll", "scale"];
}

#[derive(Debug, Clone)]
pub(super) enum Expr {
    Number(f64),
    Colour([f64; 3]),
    Local(u32),
    /// Index into [`Module::uses`].
    Global(usize),
    Detail,
    Level,
    Minus(Box<Expr>),
    Not(Box<Expr>),
    Binary {
        operator: Operator,
        at: At,
        sides: Box<[Expr; 2]>,
    },
    And(Box<[Expr; 2]>),
    Or(Box<[Expr; 2]>),
    If(Box<[Expr; 3]>),
    List(Vec<Expr>, At),
    Item {
        at: At,
        of: Box<[Expr; 2]>,
    },
    BuiltIn {
        name: BuiltIn,
        at: At,
        site: u32,
        arguments: Vec<Written>,
    },
    Call(usize),
    Plain(Box<Plain>),
}

impl Expr {
    /// Whether it is a list, where one can see that.
    pub(super) fn is_list(&self) -> Option<bool> {
        match self {
            Self::Plain(plain) => plain.of.is_list(),
            Self::List(..) | Self::Colour(_) => Some(true),
            Self::Local(_) | Self::Global(_) | Self::If(_) | Self::Item { .. } | Self::Call(_) => None,
            Self::BuiltIn { name, .. } => (*name != BuiltIn::Mix).then_some(false),
            _ => Some(false),
        }
    }

    /// Whether it is a value that has a name, or an item of one.
    pub(super) fn is_of_name(&self) -> bool {
        match self {
            Self::Local(_) | Self::Global(_) => true,
            Self::Item { of, .. } => of[0].is_of_name(),
            _ => false,
        }
    }
}

/// An expression of numbers alone, every node of which is visited whenever it is: so what that takes is known beforehand.
#[derive(Debug, Clone)]
pub(super) struct Plain {
    pub(super) of: Expr,
    pub(super) cost: Cost,
    /// Its number among those that are the same wherever they are computed with the same values of the file.
    pub(super) settled: Option<u32>,
}

/// What the visit of an expression takes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cost {
    pub(super) steps: u32,
    /// Nodes inside each other.
    pub(super) nesting: u32,
}
