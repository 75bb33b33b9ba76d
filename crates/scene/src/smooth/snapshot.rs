//! What does a partly decoded smooth LOD look like? Arrays for a renderer, and the exact numbers for a test.

use super::attributes::ChannelKind;
use super::decoder::Decoder;
use super::mesh::Point;
use super::octahedron;
use super::replay::Phase;

/// A mesh to draw. Every array of a vertex has as many elements as `positions`, or none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Snapshot {
    /// In model space.
    pub positions: Vec<[f32; 3]>,
    /// Of unit length.
    pub normals: Vec<[f32; 3]>,
    /// Sets of texture coordinates.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear red, green, blue and alpha, 0 to 1.
    pub colours: Vec<[f32; 4]>,
    /// Corners of triangles, for each material.
    pub indices: Vec<Vec<u32>>,
}

/// A mesh on its lattice, exactly as it was encoded once it is complete.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Lattice {
    /// Twice the coordinates on the finest lattice: while the lattice is coarse, vertices lie in the middle of its cells.
    pub twice_positions: Vec<[i32; 3]>,
    /// Corners of triangles: indices into positions.
    pub triangles: Vec<[u32; 3]>,
    /// Their wedges, if there are attributes.
    pub corners: Vec<[u32; 3]>,
    /// Numbers of wedges, one after the other.
    pub values: Vec<i32>,
    /// Materials of triangles.
    pub materials: Vec<u16>,
}

impl Decoder {
    /// The numbers themselves. Empty before the header has come.
    #[must_use]
    pub fn lattice(&self) -> Lattice {
        let Some((_, replay)) = self.replay() else {
            return Lattice::default();
        };
        Lattice {
            twice_positions: self.twice_positions(),
            triangles: replay.mesh.triangles.clone(),
            corners: replay.attributes.corners().to_vec(),
            values: replay.attributes.values().to_vec(),
            materials: (0..replay.mesh.triangles.len())
                .map(|triangle| replay.attributes.material(triangle))
                .collect(),
        }
    }

    /// Twice the positions, and triangles over them, as [`Decoder::lattice`] has them.
    #[must_use]
    pub fn geometry(&self) -> (Vec<[i32; 3]>, &[[u32; 3]]) {
        let triangles = self.replay().map_or(&[][..], |(_, replay)| &replay.mesh.triangles);
        (self.twice_positions(), triangles)
    }

    fn twice_positions(&self) -> Vec<[i32; 3]> {
        let Some((_, replay)) = self.replay() else {
            return Vec::new();
        };
        // While the lattice becomes finer, vertices from `next` on are still on the coarse one.
        let next = match replay.phase {
            Phase::Refine { next, .. } => next as usize,
            _ => 0,
        };
        let twice = |(i, point): (usize, &Point)| {
            let lacking = replay.coarse_bits - u32::from(i < next);
            point.at().map(|x| (x << lacking) * 2 + (1 << lacking) - 1)
        };
        replay.mesh.points.iter().enumerate().map(twice).collect()
    }

    /// The mesh to draw. Empty before the header has come.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        let Some((_, replay)) = self.replay() else {
            return Snapshot::default();
        };
        let triangles = replay.mesh.triangles.iter().enumerate();
        self.snapshot_of(triangles.map(|(i, &triangle)| (i, triangle, replay.attributes.corners().get(i).copied())))
    }

    /// The mesh to draw, of these triangles: number, vertices, wedges.
    pub(super) fn snapshot_of(&self, triangles: impl Iterator<Item = (usize, [u32; 3], Option<[u32; 3]>)>) -> Snapshot {
        let Some((header, replay)) = self.replay() else {
            return Snapshot::default();
        };
        let twice_positions = self.twice_positions();
        let attributes = &replay.attributes;
        let position = |vertex: u32| -> [f32; 3] {
            let twice = twice_positions[vertex as usize];
            std::array::from_fn(|axis| {
                (f64::from(header.origin[axis]) + f64::from(header.step) * 0.5 * f64::from(twice[axis])) as f32
            })
        };
        let mut snapshot = Snapshot {
            indices: vec![Vec::new(); usize::from(header.materials)],
            uvs: vec![Vec::new(); header.channels.iter().filter(|c| c.kind == ChannelKind::Uv).count()],
            ..Snapshot::default()
        };
        let stride = attributes.stride();
        // A wedge belongs to one vertex, so wedges, or vertices where there are none, are what a renderer calls vertices.
        let wedges = attributes.values().len().checked_div(stride);
        let mut drawn = vec![u32::MAX; wedges.unwrap_or(twice_positions.len())];
        for (number, triangle, wedges) in triangles {
            let corners = wedges.unwrap_or(triangle);
            let material = usize::from(attributes.material(number));
            for (&vertex, &corner) in triangle.iter().zip(&corners) {
                let index = &mut drawn[corner as usize];
                if *index == u32::MAX {
                    *index = snapshot.positions.len() as u32;
                    snapshot.positions.push(position(vertex));
                    let values = &attributes.values()[corner as usize * stride..][..stride];
                    snapshot.push_values(header, values);
                }
                snapshot.indices[material].push(*index);
            }
        }
        snapshot
    }
}

impl Snapshot {
    fn push_values(&mut self, header: &super::Header, values: &[i32]) {
        let mut at = 0;
        let mut set = 0;
        for channel in &header.channels {
            let numbers = &values[at..at + channel.kind.numbers()];
            let real = |i: usize| channel.low[i % 2] + numbers[i] as f32 * channel.step[i % 2];
            match channel.kind {
                ChannelKind::Normal => {
                    let [x, y, z] = octahedron::direction([numbers[0], numbers[1]]).map(|x| x as f32);
                    let length = (x * x + y * y + z * z).sqrt();
                    self.normals.push([x, y, z].map(|x| x / length));
                }
                ChannelKind::Uv => {
                    self.uvs[set].push([real(0), real(1)]);
                    set += 1;
                }
                ChannelKind::Colour => self.colours.push([real(0), real(1), real(2), real(3)]),
            }
            at += channel.kind.numbers();
        }
    }
}
