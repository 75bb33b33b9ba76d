//! What mesh has a reader of a stream's beginning? Found without decoding, from the collapses that have been undone by then.

use belvedere_scene::smooth::course::Told;
use glam::DVec3;

use super::lattices::twice_drawn;
use super::quantise::QuantisedMesh;
use super::script::Undo;
use super::surface::Surface;

/// The triangles of a beginning.
#[derive(Clone)]
pub(super) struct Prefix<'a> {
    mesh: &'a QuantisedMesh,
    /// All of the story.
    undo: &'a Undo<'a>,
    told: Told,
    /// By triangle of the source: at which of the source's vertices its corners are.
    corners: Vec<[u32; 3]>,
}

impl<'a> Prefix<'a> {
    /// Before anything is told of a mesh, all of whose collapses have been undone once.
    pub(super) fn new(mesh: &'a QuantisedMesh, undo: &'a Undo<'a>) -> Self {
        Self {
            mesh,
            undo,
            told: Told {
                vertices: 1,
                coarse_bits: mesh.bits,
                refined: 0,
            },
            corners: undo.first_corners().to_vec(),
        }
    }

    /// Goes on to where no less has been told.
    pub(super) fn go_on(&mut self, told: Told) {
        for split in self.told.vertices..told.vertices {
            let (gone, moved) = self.undo.split(split);
            for &corner in moved {
                self.corners[corner as usize / 3][corner as usize % 3] = gone;
            }
        }
        self.told = told;
    }

    /// How many triangles it has.
    pub(super) fn triangles(&self) -> usize {
        self.undo.triangles_before(self.told.vertices)
    }

    /// The surface as it is drawn, its triangles in the order of the stream.
    pub(super) fn surface(&self) -> Surface {
        let corner = |corner: u32| {
            let vertex = self.corners[corner as usize / 3][corner as usize % 3];
            let lacking = self.told.coarse_bits - u32::from(self.undo.stream_vertex(vertex) < self.told.refined);
            let twice = self.mesh.positions[vertex as usize].map(|x| twice_drawn(x, lacking));
            DVec3::from_array(twice.map(|x| 0.5 * f64::from(x)))
        };
        let shapes = (0..self.triangles() as u32).map(|triangle| self.undo.corners_of(triangle).map(corner));
        Surface::of_shapes(shapes.collect())
    }

    /// The source's triangle that one of the drawn ones is on the way to.
    pub(super) fn source_triangle(&self, triangle: u32) -> u32 {
        self.undo.source_triangle(triangle) as u32
    }
}
