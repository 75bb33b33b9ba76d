/**
 * How does a mesh that was made here become what draws downloaded levels? As a GLB like theirs, in plain floats, whose pictures
 * have the same names as in levels.
 */

const [ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER] = [34962, 34963];
const [UNSIGNED_SHORT, UNSIGNED_INT, FLOAT] = [5123, 5125, 5126];
const [GLB_MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];
const MOST_SHORT_VERTICES = 65_535;

export type Numbers = Float32Array | Uint16Array | Uint32Array;

/** What a glTF attribute or index is made of. */
type Kind = "SCALAR" | "VEC2" | "VEC3" | "VEC4";

/** Vertices that some triangles share. */
export interface Vertices {
  readonly positions: Float32Array;
  readonly others: readonly Attribute[];
}

/** Its name in glTF, and what each vertex has of it. */
export type Attribute = readonly [name: string, numbers: Float32Array, kind: Kind];

/** Triangles of one material. */
export interface Triangles {
  readonly vertices: Vertices;
  readonly indices: Uint32Array;
  readonly material: number;
}

/** A GLB of triangles; those without a corner are left out. `document` is a glTF document with their materials and no meshes. */
export function glbOf(triangles: readonly Triangles[], document: Readonly<Record<string, unknown>>): ArrayBuffer {
  const binary = new Binary();
  const known = new Map<Vertices, Record<string, number>>();
  const attributesOf = (vertices: Vertices) => {
    const attributes = known.get(vertices) ?? binary.addVertices(vertices);
    known.set(vertices, attributes);
    return attributes;
  };
  const primitives = triangles.flatMap(({ vertices, indices, material }) => {
    if (indices.length === 0) return [];
    const isShort = vertices.positions.length / 3 <= MOST_SHORT_VERTICES;
    const attributes = attributesOf(vertices);
    return [{ attributes, indices: binary.add(isShort ? Uint16Array.from(indices) : indices, "SCALAR"), material }];
  });
  const drawn = primitives.length > 0;
  const { bytes, accessors, bufferViews } = binary;
  const json = {
    ...document,
    asset: { version: "2.0" },
    scene: 0,
    scenes: [drawn ? { nodes: [0] } : {}],
    ...(drawn && { nodes: [{ mesh: 0 }], meshes: [{ primitives }], accessors, bufferViews }),
    ...(drawn && { buffers: [{ byteLength: bytes }] }),
  };
  return container(JSON.stringify(json), binary);
}

/** The binary chunk while it is put together; every view begins at a multiple of four bytes. */
class Binary {
  readonly accessors: object[] = [];
  readonly bufferViews: object[] = [];
  private readonly parts: Numbers[] = [];
  bytes = 0;

  /** Answers the accessors of all attributes, by name. */
  addVertices({ positions, others }: Vertices): Record<string, number> {
    const attributes: Record<string, number> = { POSITION: this.add(positions, "VEC3", boxOf(positions)) };
    for (const [name, numbers, kind] of others) attributes[name] = this.add(numbers, kind);
    return attributes;
  }

  /** Answers the number of the accessor. */
  add(numbers: Numbers, type: Kind, box: object = {}): number {
    const components = type === "SCALAR" ? 1 : Number(type.slice(3));
    const componentType =
      numbers instanceof Float32Array ? FLOAT : numbers instanceof Uint16Array ? UNSIGNED_SHORT : UNSIGNED_INT;
    const target = type === "SCALAR" ? ELEMENT_ARRAY_BUFFER : ARRAY_BUFFER;
    this.bufferViews.push({ buffer: 0, byteOffset: this.bytes, byteLength: numbers.byteLength, target });
    this.accessors.push({
      bufferView: this.bufferViews.length - 1,
      componentType,
      count: numbers.length / components,
      type,
      ...box,
    });
    this.parts.push(numbers);
    this.bytes += padded(numbers.byteLength);
    return this.accessors.length - 1;
  }

  writeTo(target: Uint8Array): void {
    let at = 0;
    for (const { buffer, byteOffset, byteLength } of this.parts) {
      target.set(new Uint8Array(buffer, byteOffset, byteLength), at);
      at += padded(byteLength);
    }
  }
}

function padded(bytes: number): number {
  return (bytes + 3) & ~3;
}

function boxOf(positions: Float32Array): { min: number[]; max: number[] } {
  const min = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY];
  const max = min.map((x) => -x);
  for (let i = 0; i < positions.length; i += 1) {
    const [axis, x] = [i % 3, positions[i] as number];
    min[axis] = Math.min(min[axis] as number, x);
    max[axis] = Math.max(max[axis] as number, x);
  }
  return { min, max };
}

function container(json: string, binary: Binary): ArrayBuffer {
  const text = new TextEncoder().encode(json);
  const jsonBytes = padded(text.length);
  const hasBinary = binary.bytes > 0;
  const whole = new Uint8Array(20 + jsonBytes + (hasBinary ? 8 + binary.bytes : 0));
  const view = new DataView(whole.buffer);
  [GLB_MAGIC, 2, whole.length, jsonBytes, JSON_CHUNK].forEach((word, i) => {
    view.setUint32(4 * i, word, true);
  });
  whole.fill(0x20, 20, 20 + jsonBytes);
  whole.set(text, 20);
  if (hasBinary) {
    view.setUint32(20 + jsonBytes, binary.bytes, true);
    view.setUint32(24 + jsonBytes, BINARY_CHUNK, true);
    binary.writeTo(whole.subarray(28 + jsonBytes));
  }
  return whole.buffer;
}
