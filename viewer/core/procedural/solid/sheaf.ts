/**
 * Which triangles do the meshes of several turns of a loop have? Their faces are the same in each turn; what is placed lies
 * in columns, a number for each turn. As `writeMesh` does it for one, without steps between: each number is read once.
 */

import type { Reach } from "../bounds.ts";
import { num } from "../numbers.ts";
import { WIDTH } from "../plain/columns.ts";
import type { Planned } from "../plain/plan.ts";
import type { Faces } from "./flat.ts";
import type { Mesh } from "./mesh.ts";

/** Where the points of one turn are, three numbers each, and where they are placed, as it is written. */
let pointsOfTurn = new Float64Array(3 * 16);
let placedOfTurn = new Float32Array(3 * 16);
/** Its axes and its origin. */
const frame = new Float64Array(12);

/** Whether faces can be written so. */
export function areTriangles(faces: Faces): boolean {
  return faces.areSound && faces.count > 0 && faces.length === 3 * faces.count && !faces.isFlat;
}

/**
 * Writes triangles of a plan in turns from `turn` to `end`, and has a box hold them; before which turn that ended, because a
 * triangle of it is none.
 */
export function writeSheaf(
  mesh: Mesh,
  reach: Reach,
  extent: Reach,
  columns: Float64Array,
  { pose, numbers }: Planned,
  faces: Faces,
  turn: number,
  end: number,
): number {
  if (numbers.length > pointsOfTurn.length) {
    pointsOfTurn = new Float64Array(2 * numbers.length);
    placedOfTurn = new Float32Array(2 * numbers.length);
  }
  const points = pointsOfTurn;
  const placed = placedOfTurn;
  const room = mesh.growing;
  room.reserve(mesh.vertices + (end - turn) * faces.length, mesh.triangles + (end - turn) * faces.count);
  const { points: positions, directions, corners: indices } = room;
  const { ends } = reach;
  const xAxis = pose.x * WIDTH;
  const yAxis = pose.y * WIDTH;
  const zAxis = pose.z * WIDTH;
  const origin = pose.origin * WIDTH;
  for (let at = turn; at < end; at += 1) {
    const xx = num(columns, xAxis + at);
    const xy = num(columns, xAxis + WIDTH + at);
    const xz = num(columns, xAxis + 2 * WIDTH + at);
    const yx = num(columns, yAxis + at);
    const yy = num(columns, yAxis + WIDTH + at);
    const yz = num(columns, yAxis + 2 * WIDTH + at);
    const zx = num(columns, zAxis + at);
    const zy = num(columns, zAxis + WIDTH + at);
    const zz = num(columns, zAxis + 2 * WIDTH + at);
    const ox = num(columns, origin + at);
    const oy = num(columns, origin + WIDTH + at);
    const oz = num(columns, origin + 2 * WIDTH + at);
    // How far the points of the turn lie from its origin along each axis, either way.
    let farU = 0;
    let farV = 0;
    let farW = 0;
    for (let point = 0; point < numbers.length; point += 3) {
      const u = num(columns, Math.imul(numbers[point] as number, WIDTH) + at);
      const v = num(columns, Math.imul(numbers[point + 1] as number, WIDTH) + at);
      const w = num(columns, Math.imul(numbers[point + 2] as number, WIDTH) + at);
      if (Math.abs(u) > farU) farU = Math.abs(u);
      if (Math.abs(v) > farV) farV = Math.abs(v);
      if (Math.abs(w) > farW) farW = Math.abs(w);
      points[point] = u;
      points[point + 1] = v;
      points[point + 2] = w;
      placed[point] = xx * u + yx * v + zx * w + ox;
      placed[point + 1] = xy * u + yy * v + zy * w + oy;
      placed[point + 2] = xz * u + yz * v + zz * w + oz;
    }
    // The map of normals, up to their length: outward stays outward.
    let nxx = yy * zz - yz * zy;
    let nxy = yz * zx - yx * zz;
    let nxz = yx * zy - yy * zx;
    let nyx = zy * xz - zz * xy;
    let nyy = zz * xx - zx * xz;
    let nyz = zx * xy - zy * xx;
    let nzx = xy * yz - xz * yy;
    let nzy = xz * yx - xx * yz;
    let nzz = xx * yy - xy * yx;
    const mirrored = xx * nxx + xy * nxy + xz * nxz < 0;
    if (mirrored) {
      [nxx, nxy, nxz] = [-nxx, -nxy, -nxz];
      [nyx, nyy, nyz] = [-nyx, -nyy, -nyz];
      [nzx, nzy, nzz] = [-nzx, -nzy, -nzz];
    }
    const { corners } = faces;
    let vertex = mesh.vertices;
    let index = 3 * mesh.triangles;
    for (let corner = 0; corner < faces.length; corner += 3, vertex += 3, index += 3) {
      const a = Math.imul(3, corners[corner] as number);
      const b = Math.imul(3, corners[corner + 1] as number);
      const c = Math.imul(3, corners[corner + 2] as number);
      const ax = num(points, a);
      const ay = num(points, a + 1);
      const az = num(points, a + 2);
      const bx = num(points, b);
      const by = num(points, b + 1);
      const bz = num(points, b + 2);
      const cx = num(points, c);
      const cy = num(points, c + 1);
      const cz = num(points, c + 2);
      const u = 0 + (ay - by) * (az + bz) + (by - cy) * (bz + cz) + (cy - ay) * (cz + az);
      const v = 0 + (az - bz) * (ax + bx) + (bz - cz) * (bx + cx) + (cz - az) * (cx + ax);
      const w = 0 + (ax - bx) * (ay + by) + (bx - cx) * (by + cy) + (cx - ax) * (cy + ay);
      if (!isEar(u, v, w, ax - cx, ay - cy, az - cz, bx - cx, by - cy, bz - cz)) return at;
      const x = nxx * u + nyx * v + nzx * w;
      const y = nxy * u + nyy * v + nzy * w;
      const z = nxz * u + nyz * v + nzz * w;
      const length = Math.sqrt(x * x + y * y + z * z);
      const isLong = length > 0;
      const nx = isLong ? x / length : 0;
      const ny = isLong ? y / length : 1;
      const nz = isLong ? z / length : 0;
      const to = 3 * vertex;
      positions[to] = placed[a] as number;
      positions[to + 1] = placed[a + 1] as number;
      positions[to + 2] = placed[a + 2] as number;
      positions[to + 3] = placed[b] as number;
      positions[to + 4] = placed[b + 1] as number;
      positions[to + 5] = placed[b + 2] as number;
      positions[to + 6] = placed[c] as number;
      positions[to + 7] = placed[c + 1] as number;
      positions[to + 8] = placed[c + 2] as number;
      directions[to] = nx;
      directions[to + 1] = ny;
      directions[to + 2] = nz;
      directions[to + 3] = nx;
      directions[to + 4] = ny;
      directions[to + 5] = nz;
      directions[to + 6] = nx;
      directions[to + 7] = ny;
      directions[to + 8] = nz;
      // Cut off from its last corner on.
      indices[index] = vertex + 2;
      indices[index + 1] = mirrored ? vertex + 1 : vertex;
      indices[index + 2] = mirrored ? vertex : vertex + 1;
    }
    mesh.vertices = vertex;
    mesh.triangles += faces.count;
    // No corner of the box around them lies farther along x, y and z: rounding keeps order. Most lie within what is held.
    const farX = Math.abs(xx) * farU + Math.abs(yx) * farV + Math.abs(zx) * farW;
    const farY = Math.abs(xy) * farU + Math.abs(yy) * farV + Math.abs(zy) * farW;
    const farZ = Math.abs(xz) * farU + Math.abs(yz) * farV + Math.abs(zz) * farW;
    if (
      ox - farX >= num(ends, 0) &&
      oy - farY >= num(ends, 1) &&
      oz - farZ >= num(ends, 2) &&
      ox + farX <= num(ends, 3) &&
      oy + farY <= num(ends, 4) &&
      oz + farZ <= num(ends, 5)
    ) {
      continue;
    }
    extent.points(points, numbers.length / 3, 3);
    for (let i = 0; i < 3; i += 1) {
      frame[i] = num(columns, xAxis + i * WIDTH + at);
      frame[3 + i] = num(columns, yAxis + i * WIDTH + at);
      frame[6 + i] = num(columns, zAxis + i * WIDTH + at);
      frame[9 + i] = num(columns, origin + i * WIDTH + at);
    }
    reach.placed(extent, frame, 0);
  }
  return end;
}

/**
 * Whether a triangle with this normal is cut off as it is, by how its first and its second corner lie from the third: as
 * `writeFace` looks at it, along the axis along which it has most area.
 */
function isEar(
  x: number,
  y: number,
  z: number,
  ax: number,
  ay: number,
  az: number,
  bx: number,
  by: number,
  bz: number,
): boolean {
  let steep = x;
  let area = ay * bz - az * by;
  if (Math.abs(y) > Math.abs(steep)) {
    steep = y;
    area = az * bx - ax * bz;
  }
  if (Math.abs(z) > Math.abs(steep)) {
    steep = z;
    area = ax * by - ay * bx;
  }
  return steep < 0 ? area < 0 : area > 0;
}
