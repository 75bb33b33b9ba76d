//! Where in a cell may an eye be? Over its floor, where there is room beside it.

use glam::{DVec3, Vec3};

use super::Input;
use crate::cells::ViewCell;

/// Eye height over the floor where a cell is about as high as a room.
const EYE_HEIGHT_M: f64 = 1.65;
/// A place is as good as any with so much of half a cell's shorter side free around it, or so many metres …
const ROOMY: (f64, f64) = (0.3, 1.0);
/// … and with less than so much none is good.
const CRAMPED: (f64, f64) = (0.05, 0.2);
/// Floors that differ by so much, in metres, or by a tenth of a cell's height, are as low as each other.
const STEP_M: f64 = 0.5;
/// A cell is too low to stand in that is lower than an eye is high, and than this share of the world.
const LOW: f64 = 0.25;
/// So many places are tried along either side.
const TRIED_PLACES: u32 = 6;
/// One looks for what is near in so many directions.
const LOOKS: u32 = 8;

/// A place for an eye in a cell, and how near the nearest surface beside it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) eye: DVec3,
    floor_m: Option<f64>,
    room_m: f64,
    /// Half of the cell's shorter side.
    half_m: f64,
}

/// How well one can stand in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Footing {
    /// There is nothing below it.
    Air,
    /// There is a floor somewhere below it.
    Above,
    /// Who stands on what is below it has the eye in it, nearly everywhere.
    Floor,
}

impl Footing {
    /// In a cell of a world so high.
    pub(super) fn in_cell(cell: &ViewCell, world_m: f64, input: Input<'_>) -> Self {
        let is_upright = cell.bounds.size_m()[1] >= EYE_HEIGHT_M.min(LOW * world_m);
        let is_in = |height_m: f64| is_upright && (cell.bounds.min[1]..=cell.bounds.max[1]).contains(&height_m);
        let eye_over = |point: DVec3| floor_below(point, cell, input).map(|floor_m| eye_height(floor_m, cell));
        let stands = places(cell, 3).filter(|point| eye_over(*point).is_some_and(is_in));
        if 2 * stands.count() > places(cell, 3).count() {
            Self::Floor
        } else if floor_below(cell.center().into(), cell, input).is_some() {
            Self::Above
        } else {
            Self::Air
        }
    }
}

/// Places all over a cell at half its height, so many along either side.
fn places(cell: &ViewCell, along: u32) -> impl Iterator<Item = DVec3> {
    let (min, size) = (DVec3::from(cell.bounds.min), DVec3::from(cell.bounds.size_m()));
    let share = move |i: u32| (f64::from(i) + 0.5) / f64::from(along);
    (0..along * along)
        .map(move |i| min + size * DVec3::new(share(i % along), 0.5, share(i / along)))
        .filter(|point| cell.contains(point.to_array()))
}

impl Place {
    /// Over the lowest floor with room beside one: a lawn and not the roof of a hut on it. There over the middle, or where there is
    /// more room if something stands there; of equals nearest to the middle.
    pub(super) fn in_cell(cell: &ViewCell, input: Input<'_>) -> Self {
        let tried = places(cell, TRIED_PLACES);
        let mut places: Vec<Self> = tried.map(|point| Self::over(point, cell, input)).collect();
        let middle = Self::over(cell.center().into(), cell, input);
        places.push(middle);
        let roomy = places.iter().filter(|place| place.is_roomy());
        let lowest_m = roomy.filter_map(|place| place.floor_m).fold(f64::INFINITY, f64::min);
        let step_m = STEP_M.min(0.1 * cell.bounds.size_m()[1]);
        let is_low = |place: &&Self| place.floor_m.is_some_and(|floor_m| floor_m <= lowest_m + step_m);
        let nearness = |place: &Self| -(place.eye - middle.eye).length();
        let low = places.iter().filter(is_low);
        let best = low.max_by(|a, b| a.ease().total_cmp(&b.ease()).then(nearness(a).total_cmp(&nearness(b))));
        *best.unwrap_or(&middle)
    }

    /// At eye height over the floor below a point of a cell, or at that point if there is none.
    fn over(point: DVec3, cell: &ViewCell, input: Input<'_>) -> Self {
        let mut eye = point;
        let floor_m = floor_below(point, cell, input);
        if let Some(floor_m) = floor_m {
            eye.y = eye_height(floor_m, cell);
        }
        let [width_m, _, depth_m] = cell.bounds.size_m();
        Self {
            eye,
            floor_m,
            room_m: room_beside(eye, input),
            half_m: 0.5 * width_m.min(depth_m),
        }
    }

    /// Whether one can be here without the nose on a wall.
    pub(super) fn is_roomy(&self) -> bool {
        self.room_m >= self.part(CRAMPED)
    }

    /// Whether there is a floor to stand on.
    pub(super) fn has_floor(&self) -> bool {
        self.floor_m.is_some()
    }

    /// How much room there is, as far as more is better.
    fn ease(&self) -> f64 {
        self.room_m.min(self.part(ROOMY))
    }

    fn part(&self, (share, metres): (f64, f64)) -> f64 {
        metres.min(share * self.half_m)
    }
}

/// How high the eye is of who stands on a floor below a cell.
fn eye_height(floor_m: f64, cell: &ViewCell) -> f64 {
    floor_m + EYE_HEIGHT_M.min(0.6 * (cell.bounds.max[1] - floor_m))
}

/// Where one would stand below a point of a cell: the height of the first face that is seen from above.
fn floor_below(point: DVec3, cell: &ViewCell, input: Input<'_>) -> Option<f64> {
    let eye = input.world.relative(input.frame.enter(point).to_array());
    let mut passed = Vec::new();
    let floor = input.world.cast(eye, Vec3::NEG_Y, f32::INFINITY, &mut passed)?;
    let from_behind = passed.iter().any(|hit| input.world.triangle(hit.triangle).hides());
    let height_m = point.y - f64::from(floor.t);
    (!from_behind && height_m < cell.bounds.max[1]).then_some(height_m)
}

/// How near the nearest surface is, level with the eye; 0 inside something, of which one sees backs.
fn room_beside(eye: DVec3, input: Input<'_>) -> f64 {
    let eye = input.world.relative(input.frame.enter(eye).to_array());
    let (mut nearest_m, mut backs) = (f32::INFINITY, 0);
    let mut passed = Vec::new();
    for look in 0..LOOKS {
        let angle = std::f32::consts::TAU * look as f32 / LOOKS as f32;
        let direction = Vec3::new(angle.sin(), 0.0, angle.cos());
        let end = input.world.cast(eye, direction, f32::INFINITY, &mut passed);
        let is_back = |triangle: u32| input.world.triangle(triangle).hides();
        backs += u32::from(passed.first().is_some_and(|hit| is_back(hit.triangle)));
        nearest_m = passed.iter().chain(&end).map(|hit| hit.t).fold(nearest_m, f32::min);
    }
    if 2 * backs > LOOKS { 0.0 } else { f64::from(nearest_m) }
}
