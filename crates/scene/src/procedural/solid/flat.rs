//! Which triangles do boxes, prisms, sets of polygons and height fields have?

use super::mesh::{Tools, Writer};
use super::polygon::{Ears, flat, is_convex, newell, outline};
use super::{Faces, Heights};
use crate::procedural::problem::Problem;

/// Six faces, each with corners of its own.
pub(super) fn write_box(writer: &mut Writer, [width, height, depth]: [f64; 3]) {
    let (x, z) = (width / 2.0, depth / 2.0);
    let at = |i: usize| {
        [
            if i & 1 == 1 { x } else { -x },
            if i & 2 == 2 { height } else { 0.0 },
            if i & 4 == 4 { z } else { -z },
        ]
    };
    let faces: [([usize; 4], [f64; 3]); 6] = [
        ([1, 3, 7, 5], [1.0, 0.0, 0.0]),
        ([0, 4, 6, 2], [-1.0, 0.0, 0.0]),
        ([2, 6, 7, 3], [0.0, 1.0, 0.0]),
        ([0, 1, 5, 4], [0.0, -1.0, 0.0]),
        ([4, 5, 7, 6], [0.0, 0.0, 1.0]),
        ([0, 2, 3, 1], [0.0, 0.0, -1.0]),
    ];
    let mut positions = [[0.0; 3]; 8];
    for (i, position) in positions.iter_mut().enumerate() {
        *position = writer.position(at(i));
    }
    writer.reserve(24, 12);
    for ([a, b, c, d], normal) in faces {
        writer.quad([positions[a], positions[b], positions[c], positions[d]], normal);
    }
}

/// A wall for each edge, a lid and a floor.
pub(super) fn write_prism(
    writer: &mut Writer,
    ears: &mut Ears,
    footprint: &[[f64; 2]],
    height: f64,
) -> Result<(), Problem> {
    let corners = outline(footprint);
    let triangles = ears.cut_off(&corners)?;
    for (i, &[x, z]) in corners.iter().enumerate() {
        let [to_x, to_z] = corners[(i + 1) % corners.len()];
        let wall = [[x, 0.0, z], [to_x, 0.0, to_z], [to_x, height, to_z], [x, height, z]];
        writer.quad(wall.map(|corner| writer.position(corner)), [z - to_z, 0.0, to_x - x]);
    }
    for (y, up) in [(height, 1.0), (0.0, -1.0)] {
        let normal = writer.normal([0.0, up, 0.0]);
        let first = writer.next();
        writer.flat(corners.iter().map(|&[x, z]| [x, y, z]), normal);
        for &[a, b, c] in triangles {
            if up > 0.0 {
                writer.triangle(first + a, first + b, first + c);
            } else {
                writer.triangle(first + a, first + c, first + b);
            }
        }
    }
    Ok(())
}

/// Polygons, shaded as if they were flat; each has corners of its own.
pub(super) fn write_mesh(
    writer: &mut Writer,
    tools: &mut Tools,
    points: &[[f64; 3]],
    faces: &Faces,
) -> Result<(), Problem> {
    if faces.is_flat && points.len() > 3 {
        flat(points)?;
    }
    tools.positions.clear();
    tools
        .positions
        .extend(points.iter().map(|&point| writer.position(point)));
    faces
        .iter()
        .try_for_each(|face| write_face(writer, tools, points, face))
}

fn write_face(writer: &mut Writer, tools: &mut Tools, points: &[[f64; 3]], face: &[u32]) -> Result<(), Problem> {
    // Triangles and quadrangles, which most are, need no list.
    let is_written = match *face {
        [a, b, c] => write_convex(writer, tools, points, [a, b, c], [[2, 0, 1]]),
        [a, b, c, d] => write_convex(writer, tools, points, [a, b, c, d], [[3, 0, 1], [3, 1, 2]]),
        _ => false,
    };
    if is_written {
        return Ok(());
    }
    let corners = &mut tools.corners;
    corners.clear();
    corners.extend(face.iter().map(|&i| points[i as usize]));
    let normal = newell(corners);
    let [u, v] = seen_along(normal);
    tools.flattened.clear();
    tools.flattened.extend(corners.iter().map(|p| [p[u], p[v]]));
    let triangles = tools.ears.cut_off(&tools.flattened)?;
    let normal = writer.normal(normal);
    let first = writer.next();
    writer.written(face.iter().map(|&i| tools.positions[i as usize]), normal);
    for &[a, b, c] in triangles {
        writer.triangle(first + a, first + b, first + c);
    }
    Ok(())
}

/// The axes of a plane on which a polygon with this normal has most area, so that its side's order is kept.
#[inline]
fn seen_along(normal: [f64; 3]) -> [usize; 2] {
    let steep = (0..3).fold(0, |best, a| if normal[a].abs() > normal[best].abs() { a } else { best });
    let (u, v) = ((steep + 1) % 3, (steep + 2) % 3);
    if normal[steep] < 0.0 { [u, v] } else { [v, u] }
}

/// A polygon whose ears are cut off one after the other from its first corner on; whether that is so.
#[inline]
fn write_convex<const N: usize, const T: usize>(
    writer: &mut Writer,
    tools: &Tools,
    points: &[[f64; 3]],
    face: [u32; N],
    triangles: [[u32; 3]; T],
) -> bool {
    let mut corners = [[0.0; 3]; N];
    for (corner, i) in corners.iter_mut().zip(face) {
        *corner = points[i as usize];
    }
    let normal = newell(&corners);
    let [u, v] = seen_along(normal);
    let mut flat = [[0.0; 2]; N];
    for (flat, corner) in flat.iter_mut().zip(corners) {
        *flat = [corner[u], corner[v]];
    }
    if !is_convex(&flat) {
        return false;
    }
    let first = writer.next();
    let positions = face.into_iter().map(|i| tools.positions[i as usize]);
    writer.written(positions, writer.normal(normal));
    writer.triangles(1, |_| triangles.map(|corners| corners.map(|corner| first + corner)));
    true
}

/// A grid; normals by the slope between the samples on both sides.
pub(super) fn write_heights(writer: &mut Writer, field: &Heights) {
    let [columns, rows] = field.steps.map(|steps| steps as usize);
    let [width, depth] = field.over;
    let (twice_dx, twice_dz) = (2.0 * (width / columns as f64), 2.0 * (depth / rows as f64));
    let across = columns + 1;
    let along = |i: usize| width * (i as f64 / columns as f64 - 0.5);
    let x: Vec<f64> = (0..across).map(along).collect();
    let first = writer.next();
    writer.reserve(across * (rows + 1), 2 * columns * rows);
    for j in 0..=rows {
        let z = depth * (j as f64 / rows as f64 - 0.5);
        // Samples begin one step before the rectangle.
        let row = |j: usize| &field.heights[j * (columns + 3)..(j + 1) * (columns + 3)];
        let (nearer, farther) = (&row(j)[1..=across], &row(j + 2)[1..=across]);
        let (left, here, right) = (&row(j + 1)[..across], &row(j + 1)[1..=across], &row(j + 1)[2..]);
        writer.positions(x.iter().zip(here).map(|(&x, &y)| [x, y, z]));
        writer.normals((0..across).map(|i| {
            let slope_x = (right[i] - left[i]) / twice_dx;
            let slope_z = (farther[i] - nearer[i]) / twice_dz;
            [-slope_x, 1.0, -slope_z]
        }));
    }
    for j in 0..rows {
        let near = first + (j * across) as u32;
        let far = near + across as u32;
        writer.triangles(columns as u32, |i| {
            [[near + i, far + i, far + i + 1], [near + i, far + i + 1, near + i + 1]]
        });
    }
}
