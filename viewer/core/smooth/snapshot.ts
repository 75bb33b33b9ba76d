/**
 * What does a partly decoded smooth LOD look like? Arrays for a renderer, and the exact numbers for a test.
 */
import type { SmoothDecoder } from "./decoder.ts";
import { type Channel, type Header, numbersOf } from "./header.ts";
import { direction } from "./octahedron.ts";

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
  const twicePositions = mesh.at.slice(0, 3 * mesh.vertices);
  for (let i = 0; i < twicePositions.length; i += 1) {
    const lacking = coarseBits - (i < 3 * refined ? 1 : 0);
    twicePositions[i] = ((twicePositions[i] as number) << lacking) * 2 + (1 << lacking) - 1;
  }
  return {
    twicePositions,
    triangles: mesh.corners.slice(0, 3 * mesh.triangles),
    corners: attributes.corners.values.slice(0, attributes.corners.length),
    values: attributes.values.values.slice(0, attributes.values.length),
    materials: attributes.materials.values.slice(0, attributes.materials.length),
  };
}

/** The mesh to draw. Empty before the header has come. */
export function snapshotOf(decoder: SmoothDecoder): Snapshot {
  const { header } = decoder;
  const lattice = latticeOf(decoder);
  const stride = header?.stride ?? 0;
  // A wedge belongs to one vertex, so wedges, or vertices where there are none, are what a renderer calls vertices.
  const corners = stride === 0 ? lattice.triangles : lattice.corners;
  const counts = new Uint32Array(header?.materials ?? 0);
  for (const material of lattice.materials) counts[material] = (counts[material] as number) + 3;
  const indices = Array.from(counts, (count) => new Uint32Array(count));

  const drawn = new Int32Array(stride === 0 ? lattice.twicePositions.length / 3 : lattice.values.length / stride);
  drawn.fill(-1);
  const vertices: number[] = [];
  counts.fill(0);
  for (let i = 0; i < corners.length; i += 1) {
    const corner = corners[i] as number;
    if (drawn[corner] === -1) {
      drawn[corner] = vertices.length;
      vertices.push(i);
    }
    const material = lattice.materials[Math.floor(i / 3)] as number;
    const at = counts[material] as number;
    (indices[material] as Uint32Array)[at] = drawn[corner] as number;
    counts[material] = at + 1;
  }
  return {
    ...dressed(
      header,
      lattice,
      vertices.map((i) => corners[i] as number),
    ),
    positions: placed(header, lattice, vertices),
    indices,
  };
}

/** Positions of the vertices that stand at these corners. */
function placed(header: Header | undefined, lattice: Lattice, vertices: readonly number[]): Float32Array {
  const positions = new Float32Array(3 * vertices.length);
  if (!header) return positions;
  vertices.forEach((corner, i) => {
    const first = 3 * (lattice.triangles[corner] as number);
    for (let axis = 0; axis < 3; axis += 1) {
      const twice = lattice.twicePositions[first + axis] as number;
      positions[3 * i + axis] = (header.origin[axis] as number) + header.step * 0.5 * twice;
    }
  });
  return positions;
}

/** Attributes of these wedges. */
function dressed(
  header: Header | undefined,
  { values }: Lattice,
  wedges: readonly number[],
): Omit<Snapshot, "positions" | "indices"> {
  let normals = new Float32Array(0);
  let colours = new Float32Array(0);
  const uvs: Float32Array[] = [];
  let number = 0;
  for (const channel of header?.channels ?? []) {
    const at = (wedge: number) => wedge * (header?.stride ?? 0) + number;
    if (channel.kind === "normal") {
      normals = normalsOf(wedges, (wedge, k) => values[at(wedge) + k] as number);
    } else {
      const numbers = realNumbers(channel, wedges, (wedge, k) => values[at(wedge) + k] as number);
      if (channel.kind === "uv") uvs.push(numbers);
      else colours = numbers;
    }
    number += numbersOf(channel.kind);
  }
  return { normals, uvs, colours };
}

type NumberOf = (wedge: number, k: number) => number;

function normalsOf(wedges: readonly number[], of: NumberOf): Float32Array<ArrayBuffer> {
  const normals = new Float32Array(3 * wedges.length);
  const way = new Float64Array(3);
  wedges.forEach((wedge, i) => {
    direction(of(wedge, 0), of(wedge, 1), way);
    const [x = 0, y = 0, z = 0] = way;
    const length = Math.fround(Math.sqrt(x * x + y * y + z * z));
    for (let axis = 0; axis < 3; axis += 1) normals[3 * i + axis] = (way[axis] as number) / length;
  });
  return normals;
}

/** Rounded as 32-bit floats are, so that every reader draws the same. */
function realNumbers(channel: Channel, wedges: readonly number[], of: NumberOf): Float32Array<ArrayBuffer> {
  const count = numbersOf(channel.kind);
  const numbers = new Float32Array(count * wedges.length);
  wedges.forEach((wedge, i) => {
    for (let k = 0; k < count; k += 1) {
      const part = Math.fround(Math.fround(of(wedge, k)) * (channel.step[k % 2] as number));
      numbers[count * i + k] = (channel.low[k % 2] as number) + part;
    }
  });
  return numbers;
}
