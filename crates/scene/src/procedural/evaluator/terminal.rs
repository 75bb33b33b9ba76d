//! Which solid do these values make? Values are checked here; a [`Solid`] is sound.

use std::sync::Arc;

use super::{Evaluator, Outcome, Scope, Turtle};
use crate::Bounds;
use crate::procedural::limits::{FINEST, MAX_CORNERS, MAX_SIDES, MAX_STEPS, reached};
use crate::procedural::problem::Problem;
use crate::procedural::solid::{Faces, Heights, Mesh, SIDES, Solid, SolidKind, Tools, Writer};
use crate::procedural::syntax::{At, Expr, Written};
use crate::procedural::value::Value;

/// Largest length of a solid, metres.
pub(super) const MAX_LENGTH: f64 = 1e6;
/// Most vertices of a mesh, so that indices and their differences stay within 32 bits.
const MAX_VERTICES: usize = 1 << 30;

pub(super) type Place<'s> = (&'s Scope, At);
/// A solid and its arguments.
type Given<'p> = (SolidKind, &'p [Option<Written>]);

impl<'p> Evaluator<'p> {
    /// Adds a solid to the part that is being made. Its polygons, which may cross themselves, stand at a place of their own.
    pub(super) fn add(
        &mut self,
        (scope, at, outline_at): (&Scope, At, At),
        turtle: &Turtle,
        solid: &Solid,
    ) -> Outcome<()> {
        let reach = (turtle.frame.bounds(&solid.extent()), solid.most_triangles());
        self.add_written((scope, at, outline_at), turtle.material, reach, |mesh, tools| {
            solid.write(&mut Writer::new(mesh, &turtle.frame), tools)
        })
    }

    /// Adds what is written: so many triangles at most, if there is room for them, within a box of the part.
    #[inline]
    pub(super) fn add_written(
        &mut self,
        (scope, at, outline_at): (&Scope, At, At),
        material: usize,
        (bounds, most): (Bounds, u64),
        write: impl FnOnce(&mut Mesh, &mut Tools) -> Result<(), Problem>,
    ) -> Outcome<()> {
        let part = &mut self.parts[self.part];
        part.bounds = part.bounds.union(&bounds);
        if self.measuring || most == 0 {
            return Ok(());
        }
        let limit = self.settings.limits.triangles;
        if self.usage.triangles + most > limit {
            return self.error(scope.module, at, reached("triangles", limit));
        }
        let index = match part.meshes.iter().position(|mesh| mesh.material == material) {
            Some(index) => index,
            None => {
                part.meshes.push(Mesh {
                    material,
                    ..Mesh::default()
                });
                part.meshes.len() - 1
            }
        };
        let mesh = &mut part.meshes[index];
        let before = mesh.indices.len();
        let written = write(mesh, &mut self.tools);
        self.usage.triangles += (mesh.indices.len() - before) as u64 / 3;
        if mesh.positions.len() > MAX_VERTICES {
            return self.error(scope.module, at, reached("triangles", limit));
        }
        written.or_else(|problem| self.error(scope.module, outline_at, problem))
    }

    pub(super) fn solid(&mut self, place: Place, kind: SolidKind, arguments: &'p [Option<Written>]) -> Outcome<Solid> {
        let given = (kind, arguments);
        let scope = place.0;
        Ok(match kind {
            SolidKind::Box => Solid::Box([
                self.length(scope, given, 0)?,
                self.length(scope, given, 1)?,
                self.length(scope, given, 2)?,
            ]),
            SolidKind::Cone => Solid::Cone {
                radii: [self.length(scope, given, 0)?, self.length(scope, given, 2)?],
                height: self.length(scope, given, 1)?,
                sides: self.sides(scope, given, 3)?,
                closed: self.flag(scope, given, 4)?,
            },
            SolidKind::Cylinder => {
                let radius = self.length(scope, given, 0)?;
                Solid::Cone {
                    radii: [radius, radius],
                    height: self.length(scope, given, 1)?,
                    sides: self.sides(scope, given, 2)?,
                    closed: self.flag(scope, given, 3)?,
                }
            }
            SolidKind::Sphere => Solid::Sphere {
                radius: self.length(scope, given, 0)?,
                sides: self.sides(scope, given, 1)?,
            },
            SolidKind::Lathe => {
                let profile = self.corners(scope, arguments[0].as_ref(), 2)?;
                if profile.iter().any(|[radius, _]| *radius < 0.0) {
                    let at = outline_at(kind, arguments, place.1);
                    return self.error(scope.module, at, amount("a radius of a profile", "0 or more"));
                }
                Solid::Lathe {
                    profile,
                    sides: self.sides(scope, given, 1)?,
                    smooth: self.flag(scope, given, 2)?,
                }
            }
            SolidKind::Prism => {
                let footprint = self.corners(scope, arguments[0].as_ref(), 3)?;
                self.count_ears(place, footprint.len())?;
                let height = self.length(scope, given, 1)?;
                Solid::Prism { footprint, height }
            }
            SolidKind::Polygon => {
                let points = self.points(scope, arguments[0].as_ref())?;
                let faces = Faces::one(points.len() as u32);
                self.mesh(place, outline_at(kind, arguments, place.1), (points, faces))?
            }
            SolidKind::Mesh => {
                let points = self.points(scope, arguments[0].as_ref())?;
                let faces = self.faces(scope, arguments[1].as_ref(), points.len())?;
                self.mesh(place, outline_at(kind, arguments, place.1), (points, faces))?
            }
        })
    }

    /// An argument, or what it is when it is not given.
    fn argument(&mut self, scope: &Scope, (kind, arguments): Given<'p>, index: usize, most: f64) -> Outcome<f64> {
        self.formal(scope, kind.formals()[index], &arguments[index], (0.0, most))
    }

    pub(super) fn formal(
        &mut self,
        scope: &Scope,
        (name, default): (&'static str, Option<f64>),
        given: &'p Option<Written>,
        range: (f64, f64),
    ) -> Outcome<f64> {
        match given {
            Some(written) => self.ranged(scope, written, name, range),
            None => Ok(default.unwrap_or_default()),
        }
    }

    fn length(&mut self, scope: &Scope, given: Given<'p>, index: usize) -> Outcome<f64> {
        self.argument(scope, given, index, MAX_LENGTH)
    }

    fn flag(&mut self, scope: &Scope, given: Given<'p>, index: usize) -> Outcome<bool> {
        Ok(self.argument(scope, given, index, 1.0)? != 0.0)
    }

    /// Sides of a round solid; by the level of detail when nobody says how many.
    fn sides(&mut self, scope: &Scope, given: Given<'p>, index: usize) -> Outcome<u32> {
        let sides = self.argument(scope, given, index, MAX_SIDES)?;
        Ok(sides_of(sides, self.settings.detail))
    }

    fn mesh(&mut self, place: Place, outline_at: At, (points, faces): (Vec<[f64; 3]>, Faces)) -> Outcome<Solid> {
        for face in faces.iter() {
            if face.len() < 3 || face.len() > MAX_CORNERS {
                let wanted = "three corners or more, up to 256";
                return self.error(place.0.module, outline_at, amount("a face", wanted));
            }
            self.count_ears(place, face.len())?;
        }
        Ok(Solid::Mesh { points, faces })
    }

    /// Cutting off ears looks at each corner from each corner, once for each ear.
    fn count_ears(&mut self, (scope, at): Place, corners: usize) -> Outcome<()> {
        self.count(scope, at, (corners * corners * corners / 16) as u64)
    }

    /// `heights`: a sample for each grid point, and one more around them for the slopes at the border.
    pub(super) fn heights(
        &mut self,
        (scope, at): Place,
        slots: [u32; 2],
        (over, steps): (&'p [Written; 2], &'p [Written; 2]),
        (plan, height): (u32, &'p Written),
    ) -> Outcome<Solid> {
        let over = [
            self.ranged(scope, &over[0], "a width", (1e-3, MAX_LENGTH))?,
            self.ranged(scope, &over[1], "a depth", (1e-3, MAX_LENGTH))?,
        ];
        let steps = [
            self.ranged(scope, &steps[0], "steps", (1.0, MAX_STEPS))?.floor() as u32,
            self.ranged(scope, &steps[1], "steps", (1.0, MAX_STEPS))?.floor() as u32,
        ];
        let limit = self.settings.limits.triangles;
        if self.usage.triangles + 2 * u64::from(steps[0]) * u64::from(steps[1]) > limit {
            return self.error(scope.module, at, reached("triangles", limit));
        }
        let mut heights = Vec::with_capacity((steps[0] as usize + 3) * (steps[1] as usize + 3));
        for j in 0..steps[1] + 3 {
            let z = over[1] * ((f64::from(j) - 1.0) / f64::from(steps[1]) - 0.5);
            let x = |i: u32| over[0] * ((f64::from(i) - 1.0) / f64::from(steps[0]) - 0.5);
            if self.row(scope, (plan, slots, &height.of), (x, z), (steps[0] + 3, &mut heights)) {
                continue;
            }
            *self.local(scope, slots[1]) = Value::Number(z);
            for i in 0..steps[0] + 3 {
                let x = x(i);
                *self.local(scope, slots[0]) = Value::Number(x);
                heights.push(self.ranged(scope, height, "a height", (-MAX_LENGTH, MAX_LENGTH))?);
            }
        }
        Ok(Solid::Heights(Heights { over, steps, heights }))
    }

    fn listed(&mut self, scope: &Scope, written: &'p Written) -> Outcome<Value> {
        self.items(scope, written.at, &written.of, "the corners of a solid")
    }

    fn points(&mut self, scope: &Scope, written: Option<&'p Written>) -> Outcome<Vec<[f64; 3]>> {
        let Some(written) = written else {
            return Ok(Vec::new());
        };
        if let Expr::Plain(plain) = &written.of
            && let Some(points) = self.plain_rows(scope, plain, 0..=usize::MAX)
        {
            return Ok(points);
        }
        let list = self.listed(scope, written)?;
        let Value::List(items, _) = list else {
            return Ok(Vec::new());
        };
        items
            .iter()
            .map(|item| self.point3((scope, written.at), "a point", item))
            .collect()
    }

    fn faces(&mut self, scope: &Scope, written: Option<&'p Written>, points: usize) -> Outcome<Faces> {
        let Some(written) = written else {
            return Ok(Faces::default());
        };
        if let Expr::Plain(plain) = &written.of
            && let Some(faces) = self.plain_faces(scope, plain, points)
        {
            return Ok(faces);
        }
        let list = self.listed(scope, written)?;
        faces_of(&list, points).or_else(|problem| self.error(scope.module, written.at, problem))
    }

    pub(super) fn point3(&self, (scope, at): (&Scope, At), what: &'static str, value: &Value) -> Outcome<[f64; 3]> {
        self.coordinates(value).map_or_else(
            || {
                let wanted = "`[x, y, z]`, each from -1000000 to 1000000";
                let wrong = if value.is_numbers(3) { amount } else { shape };
                self.error(scope.module, at, wrong(what, wanted))
            },
            Ok,
        )
    }

    /// Corners `[x, z]` of a polygon.
    pub(super) fn polygon(&self, scope: &Scope, at: At, value: &Value) -> Outcome<Vec<[f64; 2]>> {
        self.corners_of((scope, at), value, 3)
    }

    fn corners(&mut self, scope: &Scope, written: Option<&'p Written>, least: usize) -> Outcome<Vec<[f64; 2]>> {
        let Some(written) = written else {
            return Ok(Vec::new());
        };
        if let Expr::Plain(plain) = &written.of
            && let Some(corners) = self.plain_rows(scope, plain, least..=MAX_CORNERS)
        {
            return Ok(corners);
        }
        let list = self.listed(scope, written)?;
        self.corners_of((scope, written.at), &list, least)
    }

    fn corners_of(&self, (scope, at): Place, value: &Value, least: usize) -> Outcome<Vec<[f64; 2]>> {
        let corners = match value {
            Value::List(items, _) if (least..=MAX_CORNERS).contains(&items.len()) => {
                items.iter().map(|item| self.coordinates(item)).collect()
            }
            _ => None,
        };
        let wanted = "a list of `[x, z]`, each from -1000000 to 1000000: two or more in a profile, three or more around a polygon, up to 256";
        let is_outline = matches!(value, Value::List(items, _) if items.iter().all(|item| item.is_numbers(2)));
        let wrong = if is_outline { amount } else { shape };
        corners.map_or_else(|| self.error(scope.module, at, wrong("this outline", wanted)), Ok)
    }

    fn coordinates<const N: usize>(&self, value: &Value) -> Option<[f64; N]> {
        let Value::List(items, _) = value else { return None };
        let number = |item: &Value| match item {
            Value::Number(number) if number.abs() <= MAX_LENGTH => Some(*number),
            _ => None,
        };
        let numbers: Option<Vec<f64>> = items.iter().map(number).collect();
        numbers?.try_into().ok()
    }
}

/// Where the polygons of a solid are written.
pub(super) fn outline_at(kind: SolidKind, arguments: &[Option<Written>], at: At) -> At {
    let list = usize::from(kind == SolidKind::Mesh);
    arguments[list].as_ref().map_or(at, |written| written.at)
}

/// As many sides as that is; by the level of detail when it is nothing.
pub(super) fn sides_of(sides: f64, detail: u32) -> u32 {
    match sides as u32 {
        0 => SIDES[detail.min(FINEST) as usize],
        sides => sides.max(3),
    }
}

fn faces_of(list: &Value, points: usize) -> Result<Faces, Problem> {
    let no_list = || shape("a face", "a list of numbers of points, counted from 0");
    let items = |value: &Value| match value {
        Value::List(items, _) => Some(Arc::clone(items)),
        Value::Number(_) => None,
    };
    let mut faces = Faces::default();
    for (number, face) in items(list).ok_or_else(no_list)?.iter().enumerate() {
        for corner in items(face).ok_or_else(no_list)?.iter() {
            let Value::Number(corner) = *corner else {
                return Err(no_list());
            };
            faces.corner(corner, points).ok_or(Problem::NoPoint {
                face: number,
                corner,
                points,
            })?;
        }
        faces.end();
    }
    Ok(faces)
}

pub(super) fn shape(what: &'static str, wanted: &'static str) -> Problem {
    Problem::Shape { what, wanted }
}

pub(super) fn amount(what: &'static str, wanted: &'static str) -> Problem {
    Problem::Amount { what, wanted }
}
