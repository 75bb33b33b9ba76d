/**
 * How does the mesh of a smooth LOD become what draws levels? As a GLB like theirs: the mesh so far in plain floats, with the
 * materials of the model's glTF document, whose pictures have the same names as in levels.
 */
import type { Snapshot } from "./smooth/index.ts";

const [ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER] = [34962, 34963];
const [UNSIGNED_SHORT, UNSIGNED_INT, FLOAT] = [5123, 5125, 5126];
const [GLB_MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];
const MOST_SHORT_VERTICES = 65_535;

type Numbers = Float32Array | Uint16Array | Uint32Array;

/** A GLB of a mesh; `materials` is the text of a glTF document whose material *i* is the mesh's *i*. */
export function glbOf(mesh: Snapshot, materials: string): ArrayBuffer {
  const document = JSON.parse(materials) as Record<string, unknown>;
  const binary = new Binary();
  const attributes: Record<string, number> = { POSITION: binary.add(mesh.positions, "VEC3", boxOf(mesh.positions)) };
  if (mesh.normals.length > 0) attributes.NORMAL = binary.add(mesh.normals, "VEC3");
  mesh.uvs.forEach((set, i) => {
    attributes[`TEXCOORD_${i}`] = binary.add(set, "VEC2");
  });
  if (mesh.colours.length > 0) attributes.COLOR_0 = binary.add(mesh.colours, "VEC4");
  const isShort = mesh.positions.length / 3 <= MOST_SHORT_VERTICES;
  const primitives = mesh.indices.flatMap((corners, material) => {
    const indices = isShort ? Uint16Array.from(corners) : corners;
    return corners.length === 0 ? [] : [{ attributes, indices: binary.add(indices, "SCALAR"), material }];
  });
  const drawn = primitives.length > 0;
  const { bytes, accessors, bufferViews } = binary;
  return container(
    JSON.stringify({
      ...document,
      asset: { version: "2.0" },
      scene: 0,
      scenes: [drawn ? { nodes: [0] } : {}],
      ...(drawn && { nodes: [{ mesh: 0 }], meshes: [{ primitives }], accessors, bufferViews }),
      ...(drawn && { buffers: [{ byteLength: bytes }] }),
    }),
    drawn ? binary : new Binary(),
  );
}

/** The binary chunk while it is put together; every view begins at a multiple of four bytes. */
class Binary {
  readonly accessors: object[] = [];
  readonly bufferViews: object[] = [];
  private readonly parts: Numbers[] = [];
  bytes = 0;

  /** Answers the number of the accessor. */
  add(numbers: Numbers, type: "SCALAR" | "VEC2" | "VEC3" | "VEC4", box: object = {}): number {
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
