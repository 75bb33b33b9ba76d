//! Are two meshes the same? The same triangles, corner by corner, in whatever order.

use belvedere_scene::smooth::Lattice;

use super::quantise::QuantisedMesh;

/// A triangle's material, and of each corner the position and then the numbers of its wedge. The least corner is first.
pub type Face = (u16, [(Vec<i32>, Vec<i32>); 3]);

/// The triangles of a mesh, sorted.
#[must_use]
pub fn of_mesh(mesh: &QuantisedMesh) -> Vec<Face> {
    faces(
        &mesh.twice_positions(),
        &mesh.triangles,
        (&mesh.corners, &mesh.values, mesh.stride()),
        &mesh.materials,
    )
}

/// The triangles of what was decoded, sorted. A wedge has `stride` numbers.
#[must_use]
pub fn of_lattice(lattice: &Lattice, stride: usize) -> Vec<Face> {
    let wedges = (&lattice.corners[..], &lattice.values[..], stride);
    faces(&lattice.twice_positions, &lattice.triangles, wedges, &lattice.materials)
}

fn faces(
    twice: &[[i32; 3]],
    triangles: &[[u32; 3]],
    (corners, values, stride): (&[[u32; 3]], &[i32], usize),
    materials: &[u16],
) -> Vec<Face> {
    let face = |(i, triangle): (usize, &[u32; 3])| {
        let mut face: [(Vec<i32>, Vec<i32>); 3] = std::array::from_fn(|side| {
            let numbers = match corners.get(i) {
                Some(corners) => values[corners[side] as usize * stride..][..stride].to_vec(),
                None => Vec::new(),
            };
            (twice[triangle[side] as usize].to_vec(), numbers)
        });
        let least = (0..3).min_by_key(|&side| &face[side]).unwrap_or(0);
        face.rotate_left(least);
        (materials[i], face)
    };
    let mut faces: Vec<Face> = triangles.iter().enumerate().map(face).collect();
    faces.sort_unstable();
    faces
}
