/** How do triangles come into a mesh? Placed by the turtle's frame. */
import { num } from "../numbers.ts";
import { Mesh } from "./mesh.ts";

/** Where writers are aimed at first. */
const NOWHERE = new Mesh(0);

/** Adds vertices and triangles as they lie in a frame. Typed arrays round to single precision, last. */
export class Writer {
  private mesh = NOWHERE;
  private room = this.mesh.growing;
  /** Axes x, y, z and the origin. */
  private readonly frame = new Float64Array(12);
  /** The map of normals, up to their length: outward stays outward. */
  private readonly normals = new Float64Array(9);
  /** The normal of the vertices to come. */
  private readonly written = new Float64Array(3);
  /** Corners that faces share, as they are placed. */
  private placed = new Float64Array(3 * 8);
  /** Whether the frame turns left into right. */
  private mirrored = false;
  /** Triangles that the mesh had before. */
  private before = 0;

  /** How many triangles were added since it was aimed. */
  get added(): number {
    return this.mesh.triangles - this.before;
  }

  /** Writes into a mesh from now on, in the frame whose twelve numbers begin at a place. */
  aim(mesh: Mesh, numbers: Float64Array, at: number): void {
    const { frame, normals } = this;
    this.mesh = mesh;
    this.room = mesh.growing;
    this.before = mesh.triangles;
    copy(numbers, at, frame, 0);
    copy(numbers, at + 3, frame, 3);
    copy(numbers, at + 6, frame, 6);
    copy(numbers, at + 9, frame, 9);
    cross(normals, 0, frame, 3, 6);
    cross(normals, 3, frame, 6, 0);
    cross(normals, 6, frame, 0, 3);
    const determinant =
      num(frame, 0) * num(normals, 0) + num(frame, 1) * num(normals, 1) + num(frame, 2) * num(normals, 2);
    this.mirrored = determinant < 0;
    for (let i = 0; this.mirrored && i < 9; i += 1) normals[i] = -num(normals, i);
  }

  reserve(vertices: number, triangles: number): void {
    this.room.reserve(this.mesh.vertices + vertices, this.mesh.triangles + triangles);
  }

  /** The index of the next vertex. */
  get next(): number {
    return this.mesh.vertices;
  }

  /** The vertices to come have this normal: as it is written, of length one; upright when it has no direction. */
  normal(u: number, v: number, w: number): void {
    const { normals, written } = this;
    const x = num(normals, 0) * u + num(normals, 3) * v + num(normals, 6) * w;
    const y = num(normals, 1) * u + num(normals, 4) * v + num(normals, 7) * w;
    const z = num(normals, 2) * u + num(normals, 5) * v + num(normals, 8) * w;
    const length = Math.sqrt(x * x + y * y + z * z);
    const isLong = length > 0;
    written[0] = isLong ? x / length : 0;
    written[1] = isLong ? y / length : 1;
    written[2] = isLong ? z / length : 0;
  }

  /** Adds a vertex for which there is room. */
  vertex(u: number, v: number, w: number): void {
    const { frame, mesh } = this;
    const { points } = this.room;
    const at = 3 * mesh.vertices;
    points[at] = num(frame, 0) * u + num(frame, 3) * v + num(frame, 6) * w + num(frame, 9);
    points[at + 1] = num(frame, 1) * u + num(frame, 4) * v + num(frame, 7) * w + num(frame, 10);
    points[at + 2] = num(frame, 2) * u + num(frame, 5) * v + num(frame, 8) * w + num(frame, 11);
    this.finish(at);
  }

  /**
   * Adds a ring of vertices, for which there is room: directions x, z of each from the y axis, how far from it and how high they
   * lie. Normals are to come.
   */
  ring(circle: Float64Array, radius: number, y: number): void {
    const { frame, mesh } = this;
    const { points } = this.room;
    const xx = num(frame, 0);
    const xy = num(frame, 1);
    const xz = num(frame, 2);
    const upX = num(frame, 3) * y;
    const upY = num(frame, 4) * y;
    const upZ = num(frame, 5) * y;
    const zx = num(frame, 6);
    const zy = num(frame, 7);
    const zz = num(frame, 8);
    const ox = num(frame, 9);
    const oy = num(frame, 10);
    const oz = num(frame, 11);
    let at = 3 * mesh.vertices;
    for (let i = 0; i < circle.length; i += 2, at += 3) {
      const u = radius * num(circle, i);
      const w = radius * num(circle, i + 1);
      points[at] = xx * u + upX + zx * w + ox;
      points[at + 1] = xy * u + upY + zy * w + oy;
      points[at + 2] = xz * u + upZ + zz * w + oz;
    }
    mesh.vertices += circle.length / 2;
  }

  /** Gives the last ring its normals, which lean so much outwards and upwards. */
  ringNormals(circle: Float64Array, out: number, up: number): void {
    const { written, mesh } = this;
    const { directions } = this.room;
    let at = 3 * mesh.vertices - 1.5 * circle.length;
    for (let i = 0; i < circle.length; i += 2, at += 3) {
      this.normal(out * num(circle, i), up, out * num(circle, i + 1));
      directions[at] = num(written, 0);
      directions[at + 1] = num(written, 1);
      directions[at + 2] = num(written, 2);
    }
  }

  /** Gives as many last vertices the normals of those from `first` on. */
  sameNormals(first: number, count: number): void {
    const { directions } = this.room;
    const to = 3 * (this.mesh.vertices - count);
    for (let i = 0; i < 3 * count; i += 1) directions[to + i] = directions[3 * first + i] as number;
  }

  /** Gives the vertex whose position was written its normal. */
  private finish(at: number): void {
    const { mesh, written } = this;
    const { directions } = this.room;
    directions[at] = num(written, 0);
    directions[at + 1] = num(written, 1);
    directions[at + 2] = num(written, 2);
    mesh.vertices += 1;
  }

  /** Adds a triangle that is counter-clockwise before the frame, for which there is room. */
  triangle(a: number, b: number, c: number): void {
    const { mesh, mirrored } = this;
    const { corners } = this.room;
    const at = 3 * mesh.triangles;
    corners[at] = a;
    corners[at + 1] = mirrored ? c : b;
    corners[at + 2] = mirrored ? b : c;
    mesh.triangles += 1;
  }

  /** Places one of the first corners that faces share. */
  place(corner: number, u: number, v: number, w: number): void {
    const { frame, placed } = this;
    const at = 3 * corner;
    placed[at] = num(frame, 0) * u + num(frame, 3) * v + num(frame, 6) * w + num(frame, 9);
    placed[at + 1] = num(frame, 1) * u + num(frame, 4) * v + num(frame, 7) * w + num(frame, 10);
    placed[at + 2] = num(frame, 2) * u + num(frame, 5) * v + num(frame, 8) * w + num(frame, 11);
  }

  /** Places so many corners. */
  placeAll(points: Float64Array, count: number): void {
    if (3 * count > this.placed.length) this.placed = new Float64Array(6 * count);
    const { frame, placed } = this;
    const xx = num(frame, 0);
    const xy = num(frame, 1);
    const xz = num(frame, 2);
    const yx = num(frame, 3);
    const yy = num(frame, 4);
    const yz = num(frame, 5);
    const zx = num(frame, 6);
    const zy = num(frame, 7);
    const zz = num(frame, 8);
    const ox = num(frame, 9);
    const oy = num(frame, 10);
    const oz = num(frame, 11);
    for (let at = 0; at < 3 * count; at += 3) {
      const u = num(points, at);
      const v = num(points, at + 1);
      const w = num(points, at + 2);
      placed[at] = xx * u + yx * v + zx * w + ox;
      placed[at + 1] = xy * u + yy * v + zy * w + oy;
      placed[at + 2] = xz * u + yz * v + zz * w + oz;
    }
  }

  /** Adds a triangle between corners that were placed, for which there is room, from its last corner on. */
  placedTriangle(a: number, b: number, c: number): void {
    const first = this.mesh.vertices;
    this.corner(a);
    this.corner(b);
    this.corner(c);
    this.triangle(first + 2, first, first + 1);
  }

  /** Adds a flat quadrangle between corners in order, for which there is room; it has vertices of its own. */
  quad(a: number, b: number, c: number, d: number): void {
    const first = this.mesh.vertices;
    this.corner(a);
    this.corner(b);
    this.corner(c);
    this.corner(d);
    this.triangle(first, first + 1, first + 2);
    this.triangle(first, first + 2, first + 3);
  }

  /** Adds a vertex at a corner that was placed, for which there is room. */
  corner(corner: number): void {
    const { mesh, placed } = this;
    const { points } = this.room;
    const at = 3 * mesh.vertices;
    points[at] = num(placed, 3 * corner);
    points[at + 1] = num(placed, 3 * corner + 1);
    points[at + 2] = num(placed, 3 * corner + 2);
    this.finish(at);
  }
}

function copy(of: Float64Array, from: number, to: Float64Array, at: number): void {
  to[at] = num(of, from);
  to[at + 1] = num(of, from + 1);
  to[at + 2] = num(of, from + 2);
}

/** The vector product of two vectors of an array. */
function cross(to: Float64Array, at: number, of: Float64Array, a: number, b: number): void {
  to[at] = num(of, a + 1) * num(of, b + 2) - num(of, a + 2) * num(of, b + 1);
  to[at + 1] = num(of, a + 2) * num(of, b) - num(of, a) * num(of, b + 2);
  to[at + 2] = num(of, a) * num(of, b + 1) - num(of, a + 1) * num(of, b);
}
