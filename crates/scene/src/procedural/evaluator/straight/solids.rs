//! Which numbers does a solid take, and what is asked of them? As its terminal asks them of values, one by one.

use super::code::Register;
use super::plan::{Planned, Planner};
use super::sheaf::Sheaf;
use crate::procedural::evaluator::terminal::{MAX_LENGTH, outline_at};
use crate::procedural::limits::{MAX_CORNERS, MAX_SIDES};
use crate::procedural::solid::{Faces, Solid, SolidKind};
use crate::procedural::syntax::{At, Expr, Written};

impl<'p> Planner<'p> {
    pub(super) fn solid(&mut self, at: At, kind: SolidKind, arguments: &'p [Option<Written>]) -> Option<()> {
        let mut numbers = Vec::new();
        let mut formal = |planner: &mut Self, index: usize, most: f64| {
            let register = match &arguments[index] {
                Some(written) => planner.compiler.ranged(&written.of, (0.0, most))?,
                None => planner
                    .compiler
                    .emitter
                    .constant(kind.formals()[index].1.unwrap_or_default()),
            };
            numbers.push(register);
            Some(())
        };
        let solid = match kind {
            SolidKind::Box => {
                (0..3).try_for_each(|i| formal(self, i, MAX_LENGTH))?;
                Solid::Box([0.0; 3])
            }
            SolidKind::Cone | SolidKind::Cylinder => {
                let order: &[usize] = if kind == SolidKind::Cone {
                    &[0, 2, 1, 3, 4]
                } else {
                    &[0, 1, 2, 3]
                };
                for &i in order {
                    let most = match kind.formals()[i].0 {
                        "sides" => MAX_SIDES,
                        "closed" => 1.0,
                        _ => MAX_LENGTH,
                    };
                    formal(self, i, most)?;
                }
                if kind == SolidKind::Cylinder {
                    numbers.insert(0, numbers[0]);
                }
                Solid::Cone {
                    radii: [0.0; 2],
                    height: 0.0,
                    sides: 0,
                    closed: false,
                }
            }
            SolidKind::Sphere => {
                formal(self, 0, MAX_LENGTH)?;
                formal(self, 1, MAX_SIDES)?;
                let (radius, sides) = (0.0, 0);
                Solid::Sphere { radius, sides }
            }
            SolidKind::Prism => {
                let rows = self.rows::<2>(&arguments[0].as_ref()?.of)?;
                if !(3..=MAX_CORNERS).contains(&(rows.len() / 2)) {
                    return None;
                }
                self.count_ears(rows.len() / 2)?;
                formal(self, 1, MAX_LENGTH)?;
                let footprint = vec![[0.0; 2]; rows.len() / 2];
                numbers.extend(rows);
                Solid::Prism { footprint, height: 0.0 }
            }
            SolidKind::Lathe => {
                let rows = self.rows::<2>(&arguments[0].as_ref()?.of)?;
                if !(2..=MAX_CORNERS).contains(&(rows.len() / 2)) {
                    return None;
                }
                for radius in rows.iter().step_by(2) {
                    self.compiler.emitter.within(*radius, (0.0, MAX_LENGTH));
                }
                formal(self, 1, MAX_SIDES)?;
                formal(self, 2, 1.0)?;
                let profile = vec![[0.0; 2]; rows.len() / 2];
                numbers.extend(rows);
                Solid::Lathe {
                    profile,
                    sides: 0,
                    smooth: false,
                }
            }
            SolidKind::Polygon | SolidKind::Mesh => {
                numbers = self.rows::<3>(&arguments[0].as_ref()?.of)?;
                let points = vec![[0.0; 3]; numbers.len() / 3];
                let faces = match kind {
                    SolidKind::Polygon => Faces::one(points.len() as u32),
                    _ => self.faces(&arguments[1].as_ref()?.of, points.len())?,
                };
                for face in faces.iter() {
                    if face.len() < 3 || face.len() > MAX_CORNERS {
                        return None;
                    }
                    self.count_ears(face.len())?;
                }
                Solid::Mesh { points, faces }
            }
        };
        let triangles = match &solid {
            Solid::Mesh { faces, .. } => faces.triangles().unwrap_or_default(),
            _ => Vec::new(),
        };
        self.solids.push(Planned {
            at,
            outline_at: outline_at(kind, arguments, at),
            frame: self.frame,
            paint: self.paint,
            numbers,
            solid,
            triangles,
            sheaf: Sheaf::default(),
            is_placed: false,
        });
        Some(())
    }

    fn count_ears(&mut self, corners: usize) -> Option<()> {
        self.compiler.count((corners * corners * corners / 16) as u32)
    }

    /// Rows of `N` numbers, one after the other.
    fn rows<const N: usize>(&mut self, list: &'p Expr) -> Option<Vec<Register>> {
        let mut numbers = Vec::new();
        self.compiler.enter()?;
        for row in list.items()? {
            let items = row.items().filter(|items| items.len() == N)?;
            self.compiler.enter()?;
            for item in items {
                let number = self.compiler.value(item)?;
                self.compiler.emitter.within(number, (-MAX_LENGTH, MAX_LENGTH));
                numbers.push(number);
            }
            self.compiler.leave();
        }
        self.compiler.leave();
        Some(numbers)
    }

    /// Faces that are written out.
    fn faces(&mut self, list: &'p Expr, points: usize) -> Option<Faces> {
        let mut faces = Faces::default();
        self.compiler.enter()?;
        for face in list.items()? {
            self.compiler.enter()?;
            for corner in face.items()? {
                let Expr::Number(corner) = corner else { return None };
                self.compiler.enter()?;
                faces.corner(*corner, points)?;
                self.compiler.leave();
            }
            faces.end();
            self.compiler.leave();
        }
        self.compiler.leave();
        Some(faces)
    }
}
