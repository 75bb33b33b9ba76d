/** Where do triangles go? Into one mesh for each material of a part, placed by the turtle's frame. */
import { type Affine, direction, mirrors, normalsOf, unit, type Vector } from "../affine.ts";

/** Triangles of one material, in the space of their part. */
export class Mesh {
  private points = new Float32Array(48);
  private directions = new Float32Array(48);
  private corners = new Uint32Array(48);
  /** How many there are. */
  vertices = 0;
  triangles = 0;

  /** @param material Index into the model's materials. */
  constructor(readonly material: number) {}

  /** Three for each vertex. */
  get positions(): Float32Array {
    return this.points.subarray(0, 3 * this.vertices);
  }

  /** Three for each vertex, of length one. */
  get normals(): Float32Array {
    return this.directions.subarray(0, 3 * this.vertices);
  }

  /** Three for each triangle, counter-clockwise from the front. */
  get indices(): Uint32Array {
    return this.corners.subarray(0, 3 * this.triangles);
  }

  vertex(x: number, y: number, z: number, normal: Vector): number {
    const at = 3 * this.vertices;
    if (at + 3 > this.points.length) {
      this.points = widened(this.points, Float32Array);
      this.directions = widened(this.directions, Float32Array);
    }
    this.points[at] = x;
    this.points[at + 1] = y;
    this.points[at + 2] = z;
    this.directions[at] = normal[0];
    this.directions[at + 1] = normal[1];
    this.directions[at + 2] = normal[2];
    this.vertices += 1;
    return this.vertices - 1;
  }

  triangle(a: number, b: number, c: number): void {
    const at = 3 * this.triangles;
    if (at + 3 > this.corners.length) this.corners = widened(this.corners, Uint32Array);
    this.corners[at] = a;
    this.corners[at + 1] = b;
    this.corners[at + 2] = c;
    this.triangles += 1;
  }
}

function widened<T extends Float32Array | Uint32Array>(array: T, type: new (length: number) => T): T {
  const wide = new type(2 * array.length);
  wide.set(array);
  return wide;
}

/** Adds vertices and triangles as they lie in a frame. Typed arrays round to single precision, last. */
export class Writer {
  private readonly normals: Affine;
  private readonly mirrored: boolean;

  constructor(
    private readonly mesh: Mesh,
    private readonly frame: Affine,
  ) {
    this.normals = normalsOf(frame);
    this.mirrored = mirrors(frame);
  }

  /** A normal as it is written. */
  normal(normal: Vector): Vector {
    return unit(direction(this.normals, normal));
  }

  /** Adds a vertex; its index. */
  vertex(u: number, v: number, w: number, normal: Vector): number {
    const { x, y, z, origin } = this.frame;
    return this.mesh.vertex(
      x[0] * u + y[0] * v + z[0] * w + origin[0],
      x[1] * u + y[1] * v + z[1] * w + origin[1],
      x[2] * u + y[2] * v + z[2] * w + origin[2],
      normal,
    );
  }

  private corner(at: Vector, normal: Vector): number {
    return this.vertex(at[0], at[1], at[2], normal);
  }

  /** Adds a triangle that is counter-clockwise before the frame. */
  triangle(a: number, b: number, c: number): void {
    if (this.mirrored) this.mesh.triangle(a, c, b);
    else this.mesh.triangle(a, b, c);
  }

  /** Adds a flat quadrangle with corners in order. */
  quad(corners: readonly [Vector, Vector, Vector, Vector], normal: Vector): void {
    const written = this.normal(normal);
    const a = this.corner(corners[0], written);
    const b = this.corner(corners[1], written);
    const c = this.corner(corners[2], written);
    const d = this.corner(corners[3], written);
    this.triangle(a, b, c);
    this.triangle(a, c, d);
  }
}
