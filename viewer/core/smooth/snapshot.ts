/**
 * What does a partly decoded smooth LOD look like? Arrays for a renderer, and the exact numbers for a test.
 */
import type { SmoothDecoder } from "./decoder.ts";
import { type Channel, type Header, numbersOf } from "./header.ts";
import { direction } from "./octahedron.ts";
import { AT, POINT } from "./stars.ts";

/** A mesh to draw. Every array of a vertex has as many elements as `positions` has points, or there is none. */
export interface Snapshot {
  /** Three for each vertex, in model space. */
  readonly positions: Float32Array;
  /** Three for each vertex, of unit length; empty without normals. */
  readonly normals: Float32Array;
  /** Sets of texture coordinates, two for each vertex. */
  readonly uvs: readonly Float32Array[];
  /** Linear red, green, blue and alpha for each vertex, 0 to 1; empty without colours. */
  readonly colours: Float32Array;
  /** Corners of triangles, for each material. */
  readonly indices: readonly Uint32Array[];
}

/** A mesh on its lattice, exactly as it was encoded once it is complete. */
export interface Lattice {
  /** Twice the coordinates on the finest lattice: while the lattice is coarse, vertices lie in the middle of its cells. */
  readonly twicePositions: Int32Array;
  /** Three positions for each triangle. */
  readonly triangles: Int32Array;
  /** Three wedges for each triangle; empty without attributes. */
  readonly corners: Int32Array;
  /** Numbers of wedges, one after the other. */
  readonly values: Int32Array;
  /** Materials of triangles. */
  readonly materials: Int32Array;
}

const NOTHING: Lattice = {
  twicePositions: new Int32Array(0),
  triangles: new Int32Array(0),
  corners: new Int32Array(0),
  values: new Int32Array(0),
  materials: new Int32Array(0),
};

/** The numbers themselves. Empty before the header has come. */
export function latticeOf(decoder: SmoothDecoder): Lattice {
  if (!decoder.decoded) return NOTHING;
  const { mesh, attributes, coarseBits, refined } = decoder.decoded.replay;
  const twicePositions = new Int32Array(3 * mesh.vertices);
  const { points } = mesh;
  for (let vertex = 0; vertex < mesh.vertices; vertex += 1) {
    const lacking = coarseBits - (vertex < refined ? 1 : 0);
    const middle = (1 << lacking) - 1;
    const at = POINT * vertex + AT;
    twicePositions[3 * vertex] = ((points[at] as number) << lacking) * 2 + middle;
    twicePositions[3 * vertex + 1] = ((points[at + 1] as number) << lacking) * 2 + middle;
    twicePositions[3 * vertex + 2] = ((points[at + 2] as number) << lacking) * 2 + middle;
  }
  const materials = new Int32Array(mesh.triangles);
  materials.set(attributes.materials.values.subarray(0, attributes.materials.length));
  return {
    twicePositions,
    triangles: mesh.corners.slice(0, 3 * mesh.triangles),
    corners: attributes.corners.values.slice(0, attributes.corners.length),
    values: attributes.values.values.slice(0, attributes.values.length),
    materials,
  };
}

/** The mesh to draw. Empty before the header has come. */
export function snapshotOf(decoder: SmoothDecoder): Snapshot {
  return snapshotOfLattice(decoder.header, latticeOf(decoder));
}

/** The mesh to draw of these numbers. Empty before the header has come. */
export function snapshotOfLattice(header: Header | undefined, lattice: Lattice): Snapshot {
  const nothing = new Float32Array(0);
  if (!header) return { positions: nothing, normals: nothing, uvs: [], colours: nothing, indices: [] };
  const { firsts, indices } = indexed(header, lattice);
  let normals = nothing;
  let colours = nothing;
  const uvs: Float32Array[] = [];
  let number = 0;
  for (const channel of header.channels) {
    // Where the numbers of each vertex's wedge begin.
    const places = new Int32Array(firsts.length);
    for (let i = 0; i < places.length; i += 1) {
      places[i] = (lattice.corners[firsts[i] as number] as number) * header.stride + number;
    }
    if (channel.kind === "normal") normals = normalsAt(lattice.values, places);
    else if (channel.kind === "uv") uvs.push(realNumbers(channel, lattice.values, places));
    else colours = realNumbers(channel, lattice.values, places);
    number += numbersOf(channel.kind);
  }
  return { positions: positionsAt(header, lattice, firsts), normals, uvs, colours, indices };
}

/** The first corner of each vertex that is drawn, and the vertices of triangles for each material. */
function indexed(header: Header, lattice: Lattice): { firsts: Int32Array; indices: Uint32Array[] } {
  const { triangles, materials, values } = lattice;
  const counts = new Uint32Array(header.materials);
  for (let i = 0; i < materials.length; i += 1) {
    const material = materials[i] as number;
    counts[material] = (counts[material] as number) + 3;
  }
  const indices = Array.from(counts, (count) => new Uint32Array(count));
  counts.fill(0);
  // A wedge belongs to one vertex, so wedges, or vertices where there are none, are what a renderer calls vertices.
  const { stride } = header;
  const corners = stride === 0 ? triangles : lattice.corners;
  const drawn = new Int32Array(stride === 0 ? lattice.twicePositions.length / 3 : values.length / stride).fill(-1);
  const firsts = new Int32Array(drawn.length);
  let vertices = 0;
  for (let triangle = 0; triangle < materials.length; triangle += 1) {
    const material = materials[triangle] as number;
    const own = indices[material] as Uint32Array;
    const at = counts[material] as number;
    counts[material] = at + 3;
    for (let side = 0; side < 3; side += 1) {
      const corner = corners[3 * triangle + side] as number;
      if (drawn[corner] === -1) {
        drawn[corner] = vertices;
        firsts[vertices] = 3 * triangle + side;
        vertices += 1;
      }
      own[at + side] = drawn[corner] as number;
    }
  }
  return { firsts: firsts.subarray(0, vertices), indices };
}

/** Positions of the vertices that stand at these corners. */
function positionsAt(header: Header, lattice: Lattice, corners: Int32Array): Float32Array<ArrayBuffer> {
  const positions = new Float32Array(3 * corners.length);
  const { triangles, twicePositions } = lattice;
  const [x = 0, y = 0, z = 0] = header.origin;
  const halfStep = header.step * 0.5;
  for (let i = 0; i < corners.length; i += 1) {
    const first = 3 * (triangles[corners[i] as number] as number);
    positions[3 * i] = x + halfStep * (twicePositions[first] as number);
    positions[3 * i + 1] = y + halfStep * (twicePositions[first + 1] as number);
    positions[3 * i + 2] = z + halfStep * (twicePositions[first + 2] as number);
  }
  return positions;
}

function normalsAt(values: Int32Array, places: Int32Array): Float32Array<ArrayBuffer> {
  const normals = new Float32Array(3 * places.length);
  const way = new Float64Array(3);
  for (let i = 0; i < places.length; i += 1) {
    const place = places[i] as number;
    direction(values[place] as number, values[place + 1] as number, way);
    const x = way[0] as number;
    const y = way[1] as number;
    const z = way[2] as number;
    const length = Math.fround(Math.sqrt(x * x + y * y + z * z));
    normals[3 * i] = x / length;
    normals[3 * i + 1] = y / length;
    normals[3 * i + 2] = z / length;
  }
  return normals;
}

/** Rounded as 32-bit floats are, so that every reader draws the same. */
function realNumbers(channel: Channel, values: Int32Array, places: Int32Array): Float32Array<ArrayBuffer> {
  const count = numbersOf(channel.kind);
  const numbers = new Float32Array(count * places.length);
  const { low, step } = channel;
  for (let i = 0; i < places.length; i += 1) {
    for (let k = 0; k < count; k += 1) {
      const number = Math.fround(values[(places[i] as number) + k] as number);
      numbers[count * i + k] = (low[k & 1] as number) + Math.fround(number * (step[k & 1] as number));
    }
  }
  return numbers;
}
