/** Where do triangles lie? One mesh for each material of a part; while it grows, in room that the next will use again. */

/** So many rooms are kept for meshes to come, none for more numbers than this. */
const MOST_SPARE = 8;
const MOST_KEPT = 2 ** 19;
const spare: Room[] = [];

/** Where a mesh grows. */
class Room {
  points = new Float32Array(768);
  directions = new Float32Array(768);
  corners = new Uint32Array(768);

  /** Makes it large enough for so many. */
  reserve(vertices: number, triangles: number): void {
    if (3 * vertices > this.points.length) {
      const numbers = Math.max(2 * this.points.length, 3 * vertices);
      this.points = widened(this.points, new Float32Array(numbers));
      this.directions = widened(this.directions, new Float32Array(numbers));
    }
    if (3 * triangles > this.corners.length) {
      this.corners = widened(this.corners, new Uint32Array(Math.max(2 * this.corners.length, 3 * triangles)));
    }
  }
}

function widened<T extends Float32Array | Uint32Array>(array: T, wide: T): T {
  wide.set(array);
  return wide;
}

/** Triangles of one material, in the space of their part. */
export class Mesh {
  /** How many there are. */
  vertices = 0;
  triangles = 0;
  /** Where it grows until it is finished. */
  private room: Room | undefined = spare.pop() ?? new Room();
  private grown: Pick<Mesh, "positions" | "normals" | "indices"> | undefined;

  /** @param material Index into the model's materials. */
  constructor(readonly material: number) {}

  /** Three for each vertex. */
  get positions(): Float32Array {
    return this.grown?.positions ?? this.growing.points.subarray(0, 3 * this.vertices);
  }

  /** Three for each vertex, of length one. */
  get normals(): Float32Array {
    return this.grown?.normals ?? this.growing.directions.subarray(0, 3 * this.vertices);
  }

  /** Three for each triangle, counter-clockwise from the front. */
  get indices(): Uint32Array {
    return this.grown?.indices ?? this.growing.corners.subarray(0, 3 * this.triangles);
  }

  /** Only for who writes into it. */
  get growing(): Room {
    if (!this.room) throw new Error("this mesh is finished");
    return this.room;
  }

  /** Nothing is added any more: what is there takes only what it needs, and its room goes to the next. */
  finish(): void {
    const room = this.growing;
    this.grown = {
      positions: room.points.slice(0, 3 * this.vertices),
      normals: room.directions.slice(0, 3 * this.vertices),
      indices: room.corners.slice(0, 3 * this.triangles),
    };
    this.room = undefined;
    if (spare.length < MOST_SPARE && Math.max(room.points.length, room.corners.length) <= MOST_KEPT) spare.push(room);
  }
}
