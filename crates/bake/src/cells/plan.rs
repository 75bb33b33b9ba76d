//! Test worlds: floor plans drawn in text, and a museum.

use glam::{DMat4, DVec3};

use crate::source::{AuthoredShape, Material, Primitive, Role, SourceModel, SourceObject, SourceScene, Topology};

/// Builds scenes from boxes.
#[derive(Default)]
pub(crate) struct Builder {
    pub(crate) scene: SourceScene,
}

impl Builder {
    /// A box with outward faces; returns its object.
    pub(crate) fn block(&mut self, name: &str, min: [f32; 3], max: [f32; 3]) -> u32 {
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 1 { max[a] } else { min[a] });
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        self.mesh(
            name,
            (0..8).map(corner).collect(),
            quads.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]).collect(),
        )
    }

    /// A single face.
    pub(crate) fn quad(&mut self, name: &str, corners: [[f32; 3]; 4]) -> u32 {
        self.mesh(name, corners.to_vec(), vec![0, 1, 2, 0, 2, 3])
    }

    /// A ball of `2 * n * n` triangles or so.
    pub(crate) fn ball(&mut self, name: &str, center: [f32; 3], radius: f32, n: u32) -> u32 {
        let mut positions = Vec::new();
        let mut indices = Vec::new();
        for i in 0..=n {
            let (sin_i, cos_i) = (std::f32::consts::PI * i as f32 / n as f32).sin_cos();
            for j in 0..2 * n {
                let (sin_j, cos_j) = (std::f32::consts::PI * j as f32 / n as f32).sin_cos();
                let direction = [sin_i * cos_j, cos_i, sin_i * sin_j];
                positions.push([0, 1, 2].map(|a| center[a] + radius * direction[a]));
                if i < n {
                    let at = |i: u32, j: u32| i * 2 * n + j % (2 * n);
                    indices.extend([at(i, j), at(i, j + 1), at(i + 1, j)]);
                    indices.extend([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
                }
            }
        }
        self.mesh(name, positions, indices)
    }

    /// Any triangles.
    pub(crate) fn mesh(&mut self, name: &str, positions: Vec<[f32; 3]>, indices: Vec<u32>) -> u32 {
        self.shape(name, Topology::Triangles, positions, indices)
    }

    /// Any shape, opaque.
    pub(crate) fn shape(&mut self, name: &str, topology: Topology, positions: Vec<[f32; 3]>, indices: Vec<u32>) -> u32 {
        self.scene.models.push(SourceModel {
            name: name.to_owned(),
            primitives: vec![Primitive {
                topology,
                positions,
                indices,
                ..Primitive::default()
            }],
            ..SourceModel::default()
        });
        self.scene.objects.push(SourceObject {
            source_node: name.to_owned(),
            part: 0,
            model: self.scene.models.len() - 1,
            world_from_object: DMat4::IDENTITY,
            role: Role::Ordinary,
        });
        self.scene.objects.len() as u32 - 1
    }

    /// Gives an object a material of its own.
    pub(crate) fn paint(&mut self, object: u32, see_through: bool, double_sided: bool) {
        self.scene.materials.push(Material {
            gltf: serde_json::Value::Null,
            see_through,
            double_sided,
        });
        let material = Some(self.scene.materials.len() - 1);
        let model = self.scene.objects[object as usize].model;
        for primitive in &mut self.scene.models[model].primitives {
            primitive.material = material;
        }
    }

    /// Moves everything.
    pub(crate) fn shift(&mut self, by: DVec3) {
        for object in &mut self.scene.objects {
            object.world_from_object = DMat4::from_translation(by) * object.world_from_object;
        }
    }
}

/// A plan drawn from the north-west, one metre for each character: `#` is wall from floor to ceiling, a letter a small
/// thing on the floor, `.` free. Object 0 is the floor, 1 the ceiling, then the walls of each row, then the letters as
/// they come. Returns where each letter stands too.
pub(crate) fn floor_plan(text: &str) -> (Builder, Vec<(char, u32, [f64; 3])>) {
    const HEIGHT_M: f32 = 3.0;
    let rows: Vec<Vec<char>> = text.lines().map(|l| l.trim().chars().collect()).collect();
    let (width, depth) = (rows[0].len() as f32, rows.len() as f32);
    let mut builder = Builder::default();
    builder.block("floor", [0.0, -0.1, 0.0], [width, 0.0, depth]);
    builder.block("ceiling", [0.0, HEIGHT_M, 0.0], [width, HEIGHT_M + 0.1, depth]);
    for (z, row) in rows.iter().enumerate() {
        let mut x = 0;
        while x < row.len() {
            let run = row[x..].iter().take_while(|c| **c == '#').count();
            if run > 0 {
                let (x, z) = (x as f32, z as f32);
                builder.block("wall", [x, 0.0, z], [x + run as f32, HEIGHT_M, z + 1.0]);
            }
            x += run.max(1);
        }
    }
    let mut letters = Vec::new();
    for (z, row) in rows.iter().enumerate() {
        for (x, letter) in row.iter().enumerate().filter(|(_, c)| c.is_ascii_alphabetic()) {
            let (x, z) = (x as f32 + 0.5, z as f32 + 0.5);
            let object = builder.block(&letter.to_string(), [x - 0.2, 0.0, z - 0.2], [x + 0.2, 0.4, z + 0.2]);
            letters.push((*letter, object, [x, 1.5, z].map(f64::from)));
        }
    }
    (builder, letters)
}

/// Rooms of eight metres in a grid, each with a door in the middle or at the side of each inner wall, and things in
/// them: balls, tables and boxes, some on walls.
pub(crate) fn museum(rooms: [usize; 2], things: usize) -> Builder {
    const ROOM_M: f32 = 8.0;
    const WALL_M: f32 = 0.25;
    const HEIGHT_M: f32 = 3.5;
    let mut builder = Builder::default();
    let size = rooms.map(|n| n as f32 * ROOM_M);
    let mut random = 12_345u32;
    let mut next = move || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) as f32 / (1 << 24) as f32
    };
    for x in 0..rooms[0] {
        for z in 0..rooms[1] {
            let (x, z) = (x as f32 * ROOM_M, z as f32 * ROOM_M);
            builder.block("floor", [x, -0.2, z], [x + ROOM_M, 0.0, z + ROOM_M]);
            builder.block("ceiling", [x, HEIGHT_M, z], [x + ROOM_M, HEIGHT_M + 0.2, z + ROOM_M]);
        }
    }
    builder.block("roof", [0.0, HEIGHT_M + 0.2, 0.0], [size[0], HEIGHT_M + 0.3, size[1]]);
    for axis in [0, 1] {
        let other = 1 - axis;
        for line in 0..=rooms[axis] {
            for room in 0..rooms[other] {
                let at = (line as f32 * ROOM_M).clamp(0.5 * WALL_M, size[axis] - 0.5 * WALL_M);
                let start = room as f32 * ROOM_M;
                let mut part = |from: f32, to: f32, bottom: f32| {
                    let (mut min, mut max) = ([0.0, bottom, 0.0], [0.0, HEIGHT_M, 0.0]);
                    (min[2 * axis], max[2 * axis]) = (at - 0.5 * WALL_M, at + 0.5 * WALL_M);
                    (min[2 * other], max[2 * other]) = (start + from, start + to);
                    builder.block("wall", min, max);
                };
                let outer = line == 0 || line == rooms[axis];
                if outer && room != 0 {
                    part(0.0, ROOM_M, 0.0);
                } else {
                    let door = 1.0 + next() * (ROOM_M - 3.2);
                    part(0.0, door, 0.0);
                    part(door, door + 1.2, 2.2);
                    part(door + 1.2, ROOM_M, 0.0);
                }
            }
        }
    }
    for room in 0..rooms[0] * rooms[1] {
        let corner = [(room % rooms[0]) as f32 * ROOM_M, (room / rooms[0]) as f32 * ROOM_M];
        for thing in 0..things {
            let [x, z] = corner.map(|c| c + 0.6 + next() * (ROOM_M - 1.2));
            match thing % 3 {
                0 => builder.ball("ball", [x, 0.3 + next() * 1.5, z], 0.05 + 0.3 * next(), 6),
                1 => builder.block("table", [x - 0.4, 0.7, z - 0.3], [x + 0.4, 0.75, z + 0.3]),
                _ => {
                    let h = 0.05 + next() * 0.8;
                    builder.block("chest", [x - 0.15, 0.0, z - 0.15], [x + 0.15, h, z + 0.15])
                }
            };
        }
    }
    builder
}

/// An author's prism over a footprint in x and z, rising from one height to another.
pub(crate) fn prism(node: &str, footprint: &[[f64; 2]], [low, high]: [f64; 2]) -> AuthoredShape {
    let at = |i: usize, y: f64| {
        let [x, z] = footprint[i % footprint.len()];
        DVec3::new(x, y, z)
    };
    let mut triangles = Vec::new();
    for i in 0..footprint.len() {
        triangles.push([at(i, low), at(i + 1, low), at(i + 1, high)]);
        triangles.push([at(i, low), at(i + 1, high), at(i, high)]);
        if (1..footprint.len() - 1).contains(&i) {
            triangles.push([at(0, low), at(i, low), at(i + 1, low)]);
            triangles.push([at(0, high), at(i + 1, high), at(i, high)]);
        }
    }
    AuthoredShape {
        node: node.to_owned(),
        triangles,
        said: None,
    }
}
