//! How does a scene's blocker travel to who answers questions on line?
//!
//! [`Scenery::encode`] writes occluders and the boxes around objects as one immutable object, extension `.occ`; the server
//! reads it back without the scene. `docs/FORMAT.md` gives the bytes. A reader refuses whatever could make a proof
//! wrong or a search endless: numbers that are not finite, lines that do not rise, objects that do not exist.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};

use super::{Body, Occluders, Region, Tolerance, Wall, Way};
use crate::{frame::Frame, visibility::conservative::Scenery};

const MAGIC: &[u8; 4] = b"BVOC";
const VERSION: u16 = 3;
/// The last version before frames could be turned.
const UNTURNED: u16 = 2;
/// The first version, in which every body hides.
const ALL_HIDE: u16 = 1;
const NO_DOOR: u32 = u32::MAX;
/// A reader takes no longer lists of lines than a wall may have.
const MAX_LINES: u32 = 1 << 16;
/// … nor walls of more squares.
const MAX_SQUARES: usize = 1 << 24;

/// Why bytes are not a stored blocker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StoredError {
    /// The first four bytes are not `BVOC`.
    #[error("it does not begin as stored occluders do")]
    NotOccluders,
    /// A version of which this reader knows nothing.
    #[error("it is version {0}, this reader knows version {VERSION}")]
    UnknownVersion(u16),
    /// It ends early, goes on after its end, or holds what makes no sense.
    #[error("it is damaged at byte {0}")]
    Damaged(usize),
}

/// A blocker as it was read.
pub struct Stored {
    /// The blocker.
    pub scenery: Scenery,
    /// The frame in which its positions are …
    pub frame: Frame,
    /// … and the place in that frame that they are relative to, in metres.
    pub origin: DVec3,
}

impl Scenery {
    /// Writes it; `origin` is the place in its frame that its positions are relative to, in metres.
    #[must_use]
    pub fn encode(&self, frame: &Frame, origin: DVec3) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(origin.to_array().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(frame.half_tangent().to_le_bytes());
        let occluders = &self.blocker.occluders;
        floats(&mut bytes, &[occluders.tolerance.plane_m, occluders.tolerance.hole_m]);
        count(&mut bytes, self.targets.len());
        for target in &self.targets {
            let none = [f32::NAN; 6];
            let sides = target
                .as_ref()
                .map_or(none, |t| [t.min.x, t.min.y, t.min.z, t.max.x, t.max.y, t.max.z]);
            floats(&mut bytes, &sides);
        }
        count(&mut bytes, occluders.bodies.len());
        for body in &occluders.bodies {
            count(&mut bytes, body.object as usize);
            floats(&mut bytes, &body.min.to_array());
            floats(&mut bytes, &body.max.to_array());
            floats(&mut bytes, &[body.stands_m]);
            let flags = u8::from(body.open_below) | u8::from(!body.hides) << 1;
            bytes.extend([flags, body.planes.len() as u8]);
            body.planes
                .iter()
                .for_each(|plane| floats(&mut bytes, &plane.to_array()));
        }
        count(&mut bytes, occluders.walls.len());
        for wall in &occluders.walls {
            count(&mut bytes, wall.door.unwrap_or(NO_DOOR) as usize);
            floats(&mut bytes, &wall.normal.to_array());
            floats(&mut bytes, &[wall.offset]);
            wall.axes.iter().for_each(|axis| floats(&mut bytes, &axis.to_array()));
            for lines in &wall.lines {
                count(&mut bytes, lines.len());
                floats(&mut bytes, lines);
            }
            for way in [Way::Against, Way::Along] {
                let squares = wall.opaque_squares(way);
                bytes.push(u8::from(squares.is_some()));
                for eight in squares.unwrap_or_default().chunks(8) {
                    let bits = eight.iter().enumerate().map(|(i, opaque)| u8::from(*opaque) << i);
                    bytes.push(bits.sum());
                }
            }
        }
        bytes
    }

    /// Reads it.
    ///
    /// # Errors
    /// When the bytes are not what [`Scenery::encode`] writes.
    pub fn decode(bytes: &[u8]) -> Result<Stored, StoredError> {
        let mut from = Reader { bytes, at: 0 };
        if from.take::<4>().ok().as_ref() != Some(MAGIC) {
            return Err(StoredError::NotOccluders);
        }
        let version = u16::from_le_bytes(from.take()?);
        if !(ALL_HIDE..=VERSION).contains(&version) {
            return Err(StoredError::UnknownVersion(version));
        }
        let mut origin = DVec3::ZERO;
        for axis in 0..3 {
            origin[axis] = f64::from_le_bytes(from.take()?);
        }
        from.check(origin.is_finite())?;
        let frame = if version > UNTURNED {
            Frame::of_half_tangent(f64::from_le_bytes(from.take()?)).ok_or(StoredError::Damaged(from.at))?
        } else {
            Frame::SOURCE
        };
        let [plane_m, hole_m] = from.finite()?;
        from.check(plane_m >= 0.0 && hole_m >= 0.0)?;
        let targets = from.list(24, |from| {
            let sides: [f32; 6] = from.floats()?;
            if sides.iter().all(|x| x.is_nan()) {
                return Ok(None);
            }
            let [min, max] = [Vec3::from_slice(&sides[..3]), Vec3::from_slice(&sides[3..])];
            from.check(min.is_finite() && max.is_finite() && min.cmple(max).all())?;
            Ok(Some(Region::of_box(min, max)))
        })?;
        let mut last = 0;
        let bodies = from.list(34, |from| {
            let body = from.body()?;
            from.check(body.hides || version > ALL_HIDE)?;
            from.check(body.object >= last && (body.object as usize) < targets.len())?;
            last = body.object;
            Ok(body)
        })?;
        let walls = from.list(58, |from| {
            let wall = from.wall()?;
            from.check(wall.door.is_none_or(|door| (door as usize) < targets.len()))?;
            Ok(Arc::new(wall))
        })?;
        from.check(from.at == bytes.len())?;
        let tolerance = Tolerance { plane_m, hole_m };
        let occluders = Occluders {
            bodies,
            walls,
            tolerance,
        };
        Ok(Stored {
            scenery: Self::new(occluders, targets),
            frame,
            origin,
        })
    }
}

fn count(bytes: &mut Vec<u8>, count: usize) {
    bytes.extend((count as u32).to_le_bytes());
}

fn floats(bytes: &mut Vec<u8>, floats: &[f32]) {
    bytes.extend(floats.iter().flat_map(|x| x.to_le_bytes()));
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn check(&self, holds: bool) -> Result<(), StoredError> {
        if holds {
            Ok(())
        } else {
            Err(StoredError::Damaged(self.at))
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], StoredError> {
        let taken = self.bytes.get(self.at..).and_then(|left| left.first_chunk::<N>());
        let taken = *taken.ok_or(StoredError::Damaged(self.at))?;
        self.at += N;
        Ok(taken)
    }

    fn number(&mut self) -> Result<u32, StoredError> {
        self.take().map(u32::from_le_bytes)
    }

    fn floats<const N: usize>(&mut self) -> Result<[f32; N], StoredError> {
        let mut floats = [0.0; N];
        for float in &mut floats {
            *float = f32::from_le_bytes(self.take()?);
        }
        Ok(floats)
    }

    fn finite<const N: usize>(&mut self) -> Result<[f32; N], StoredError> {
        let floats = self.floats::<N>()?;
        self.check(floats.iter().all(|x| x.is_finite()))?;
        Ok(floats)
    }

    fn flag(&mut self) -> Result<bool, StoredError> {
        let [flag] = self.take()?;
        self.check(flag <= 1)?;
        Ok(flag == 1)
    }

    /// A list whose items take at least so many bytes each.
    fn list<T>(
        &mut self,
        least_bytes: usize,
        mut item: impl FnMut(&mut Self) -> Result<T, StoredError>,
    ) -> Result<Vec<T>, StoredError> {
        let count = self.number()? as usize;
        self.check(count <= (self.bytes.len() - self.at) / least_bytes)?;
        (0..count).map(|_| item(self)).collect()
    }

    fn body(&mut self) -> Result<Body, StoredError> {
        let object = self.number()?;
        let [min, max] = [self.finite()?, self.finite()?].map(Vec3::from_array);
        let [stands_m] = self.finite()?;
        self.check(min.cmple(max).all())?;
        let [flags, planes] = self.take()?;
        self.check(flags <= 3)?;
        let planes = (0..planes).map(|_| self.finite().map(Vec4::from_array));
        Ok(Body {
            min,
            max,
            planes: planes.collect::<Result<_, _>>()?,
            stands_m,
            open_below: flags & 1 != 0,
            hides: flags & 2 == 0,
            object,
        })
    }

    fn wall(&mut self) -> Result<Wall, StoredError> {
        let door = Some(self.number()?).filter(|door| *door != NO_DOOR);
        let normal = Vec3::from(self.finite()?);
        let [offset] = self.finite()?;
        let axes = [self.finite()?, self.finite()?].map(Vec3::from_array);
        let unit = |v: Vec3| (v.length_squared() - 1.0).abs() < 1e-3;
        let across = |a: Vec3, b: Vec3| a.dot(b).abs() < 1e-3;
        self.check([normal, axes[0], axes[1]].into_iter().all(unit))?;
        self.check(across(normal, axes[0]) && across(normal, axes[1]) && across(axes[0], axes[1]))?;
        let lines = [self.lines()?, self.lines()?];
        let count = (lines[0].len() - 1) * (lines[1].len() - 1);
        self.check(count <= MAX_SQUARES)?;
        let squares = [self.squares(count)?, self.squares(count)?];
        let mut wall = Wall::new(normal, offset, axes, lines, squares);
        wall.door = door;
        Ok(wall)
    }

    fn lines(&mut self) -> Result<Vec<f32>, StoredError> {
        let lines = self.list(4, |from| from.finite().map(|[line]| line))?;
        self.check(lines.len() >= 2 && lines.len() <= MAX_LINES as usize && lines.is_sorted())?;
        Ok(lines)
    }

    fn squares(&mut self, count: usize) -> Result<Vec<bool>, StoredError> {
        if !self.flag()? {
            return Ok(vec![false; count]);
        }
        let bytes = self.bytes.get(self.at..self.at + count.div_ceil(8));
        let bytes = bytes.ok_or(StoredError::Damaged(self.at))?;
        self.at += bytes.len();
        Ok((0..count).map(|i| bytes[i / 8] >> (i % 8) & 1 == 1).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{city::City, visibility::Method, visibility::conservative::Observer, world::World};

    fn small_city() -> (Scenery, DVec3) {
        let city = City {
            blocks: [5, 4],
            ..City::DENSE
        };
        let world = World::new(&city.scene()).unwrap();
        (Scenery::of(&world), world.origin())
    }

    #[test]
    fn what_was_written_hides_the_same() {
        let (scenery, origin) = small_city();
        let turned = Frame::of_half_tangent(0.25).unwrap();
        let bytes = scenery.encode(&turned, origin);
        let stored = Scenery::decode(&bytes).unwrap();
        assert_eq!((stored.frame, stored.origin), (turned, origin));
        let read = stored.scenery;
        assert_eq!(read.blocker.occluders, scenery.blocker.occluders);
        assert_eq!(read.targets, scenery.targets);
        let settings = Method::Conservative.proofs();
        let eye = Region::of_box(Vec3::new(-20.0, -5.0, -20.0), Vec3::new(-18.0, -3.0, -19.0));
        let visible = |scenery| Observer::new(scenery, settings).visible(&eye, &[]);
        assert_eq!(visible(&read), visible(&scenery));
    }

    #[test]
    fn what_is_no_blocker_is_refused() {
        assert_eq!(Scenery::decode(b"").err(), Some(StoredError::NotOccluders));
        assert_eq!(
            Scenery::decode(b"BVOC\x09\x00").err(),
            Some(StoredError::UnknownVersion(9))
        );
        let (scenery, origin) = small_city();
        let bytes = scenery.encode(&Frame::SOURCE, origin);
        for end in (6..bytes.len()).step_by(97) {
            assert!(
                matches!(Scenery::decode(&bytes[..end]).err(), Some(StoredError::Damaged(_))),
                "{end}"
            );
        }
        let longer = [&bytes[..], &[0]].concat();
        assert!(matches!(Scenery::decode(&longer).err(), Some(StoredError::Damaged(_))));
    }

    proptest! {
        #[test]
        fn damage_is_an_error_or_another_blocker_but_no_panic(at in 6usize..4000, bits in 1u8..) {
            let (scenery, origin) = small_city();
            let mut bytes = scenery.encode(&Frame::SOURCE, origin);
            let at = at % bytes.len();
            bytes[at] ^= bits;
            let _ = Scenery::decode(&bytes);
        }
    }
}
