/**
 * How would the bake write it? A second writing of the published format, for tests: cell records, steps, GLBs and
 * pictures.
 */
import { crc32, deflateSync } from "node:zlib";
import type { Vec3 } from "../core/basics/geometry.ts";
import { type Bit, type Coder, Interval } from "../core/basics/rangecoder.ts";
import { type CellRecord, VERSION, type Visible } from "../core/documents/cellrecord.ts";
import { METHODS, missBoundOf } from "../core/documents/geometrysection.ts";
import { type Coded, codeChanges, NOTHING } from "../core/documents/recordcoding.ts";
import { atOnce } from "../core/pace/pieces.ts";

/** Writes decisions. */
class Encoder implements Coder {
  private readonly interval = new Interval();
  private readonly bytes: number[] = [];

  bit(model: Bit, bit: boolean): boolean {
    this.interval.narrow(this.interval.split(model.chance), bit);
    model.learn(bit);
    for (let byte = this.interval.shift(); byte !== undefined; byte = this.interval.shift()) this.bytes.push(byte);
    return bit;
  }

  finish(): Uint8Array {
    const { low, high } = this.interval;
    for (let length = 0; length <= 4; length += 1) {
      const unit = 2 ** (32 - 8 * length);
      const number = Math.ceil(low / unit) * unit;
      if (number > high) continue;
      for (let i = 0; i < length; i += 1) this.bytes.push(Math.floor(number / 2 ** (24 - 8 * i)) % 256);
      break;
    }
    return Uint8Array.from(this.bytes);
  }
}

/** What has to be written of a record. */
function codedOf(record: CellRecord): Coded {
  const entry = (local: boolean) => (visible: Visible) => ({
    object: visible.object,
    angle: Math.min(63, Math.max(0, Math.round(-Math.log2(visible.solidAngle / (4 * Math.PI))))),
    fraction: Math.min(7, Math.max(0, Math.round(-Math.log2(visible.fraction)))),
    local,
    doors: visible.doors,
  });
  const objects = [...record.lpvs.map(entry(true)), ...record.opvs.map(entry(false))];
  const doors = new Set(objects.flatMap((object) => object.doors));
  return {
    geometry: geometryOf(record),
    objects: objects.sort((a, b) => a.object - b.object),
    doors: [...doors].sort((a, b) => a - b),
    cells: record.cpvs,
  };
}

function geometryOf(record: CellRecord): Uint8Array {
  const out: number[] = [];
  const varint = (value: number) => {
    const bytes = value < 251 ? 0 : value < 2 ** 16 ? 2 : value < 2 ** 32 ? 4 : 8;
    if (bytes === 0) out.push(value);
    else out.push(bytes === 2 ? 251 : bytes === 4 ? 252 : 253);
    for (let i = 0; i < bytes; i += 1) out.push(Number((BigInt(value) >> BigInt(8 * i)) & 0xffn));
  };
  const list = <T>(items: readonly T[], write: (item: T) => unknown) => {
    varint(items.length);
    for (const item of items) write(item);
  };
  const points = [...record.hull.points, ...record.portals.flatMap(({ polygon }) => polygon)];
  const axes = ([0, 1, 2] as const).map((axis) => [...new Set(points.map((p) => p[axis]))].sort((a, b) => a - b));
  const corner = (p: Vec3) => {
    for (const [axis, values] of axes.entries()) varint(values.indexOf(p[axis as 0 | 1 | 2]));
  };
  varint(record.cell);
  for (const values of axes) list(values, (value) => out.push(...new Uint8Array(new Float64Array([value]).buffer)));
  varint(1);
  list(record.hull.points, corner);
  list(record.hull.faces, (face) => list(face, varint));
  list(record.adjacent, varint);
  list(record.portals, ({ to, polygon, door }) => {
    varint(to);
    list(polygon, corner);
    out.push(door === undefined ? 0 : 1);
    if (door !== undefined) varint(door);
  });
  out.push(0, METHODS.indexOf(record.method), record.conservative ? 1 : 0);
  let miss = 1000;
  while (miss > 0 && missBoundOf(miss) < record.missBound) miss -= 1;
  varint(record.missBound === 0 ? 0 : miss);
  varint(record.visibleLevel0Bytes);
  varint(record.visibleCoarsestBytes);
  return Uint8Array.from(out);
}

function changes(before: Coded, after: Coded): Uint8Array {
  const encoder = new Encoder();
  atOnce(codeChanges(encoder, before, after));
  return encoder.finish();
}

/** Seven bits to a byte, lowest first. */
function integer(value: number): number[] {
  return value < 128 ? [value] : [(value % 128) + 128, ...integer(Math.floor(value / 128))];
}

/** The binary form of a cell record. */
export function encodeCellRecord(record: CellRecord): Uint8Array {
  const stream = changes(NOTHING, codedOf(record));
  return Uint8Array.from([0x42, 0x56, 0x43, 0x52, VERSION, 0, ...integer(stream.length), ...stream]);
}

/** The steps from a record to others, whose cells rise. */
export function encodeSteps(from: CellRecord, to: readonly CellRecord[]): Uint8Array {
  const steps = to.map((next) => changes(codedOf(from), codedOf(next)));
  const table = to.flatMap(({ cell }, i) => [...integer(cell), ...integer(steps[i]?.length ?? 0)]);
  const head = [0x42, 0x56, 0x53, 0x54, VERSION, 0, ...integer(from.cell), ...integer(to.length), ...table];
  return Uint8Array.from([...head, ...steps.flatMap((step) => [...step])]);
}

export interface Shape {
  readonly positions: readonly number[];
  readonly normals: readonly number[];
  readonly uvs: readonly number[];
  readonly indices: readonly number[];
}

/** A box between two corners. */
export function box(min: Vec3, max: Vec3): Shape {
  const shape = { positions: [] as number[], normals: [] as number[], uvs: [] as number[], indices: [] as number[] };
  for (const axis of [0, 1, 2] as const) {
    for (const side of [0, 1]) {
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      const first = shape.positions.length / 3;
      for (const [a, b] of [
        [0, 0],
        [1, 0],
        [1, 1],
        [0, 1],
      ] as const) {
        const corner = [0, 0, 0];
        const pick = (where: number, high: number) => (high === 1 ? max : min)[where as 0 | 1 | 2];
        corner[axis] = pick(axis, side);
        corner[u] = pick(u, a);
        corner[v] = pick(v, b);
        const normal = [0, 0, 0];
        normal[axis] = side === 1 ? 1 : -1;
        shape.positions.push(...corner);
        shape.normals.push(...normal);
        shape.uvs.push(a, b);
      }
      const turn = side === 1 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
      shape.indices.push(...turn.map((i) => first + i));
    }
  }
  return shape;
}

/** A ball of radius 1 around the origin with `rings` rings. */
export function ball(rings: number): Shape {
  const shape = { positions: [] as number[], normals: [] as number[], uvs: [] as number[], indices: [] as number[] };
  const sectors = rings * 2;
  for (let ring = 0; ring <= rings; ring += 1) {
    for (let sector = 0; sector <= sectors; sector += 1) {
      const [theta, phi] = [(Math.PI * ring) / rings, (2 * Math.PI * sector) / sectors];
      const p = [Math.sin(theta) * Math.cos(phi), Math.cos(theta), Math.sin(theta) * Math.sin(phi)];
      shape.positions.push(...p);
      shape.normals.push(...p);
      shape.uvs.push(sector / sectors, ring / rings);
      if (ring === rings || sector === sectors) continue;
      const [a, b] = [ring * (sectors + 1) + sector, (ring + 1) * (sectors + 1) + sector];
      shape.indices.push(a, a + 1, b, b, a + 1, b + 1);
    }
  }
  return shape;
}

/** A GLB with one mesh; `texture` names a picture beside it. */
export function encodeGlb(shape: Shape, color: Vec3, texture?: string): Uint8Array {
  const arrays = [
    new Uint8Array(new Float32Array(shape.positions).buffer),
    new Uint8Array(new Float32Array(shape.normals).buffer),
    new Uint8Array(new Float32Array(shape.uvs).buffer),
    new Uint8Array(new Uint32Array(shape.indices).buffer),
  ];
  let offset = 0;
  const bufferViews = arrays.map((array) => {
    const view = { buffer: 0, byteOffset: offset, byteLength: array.byteLength };
    offset += array.byteLength;
    return view;
  });
  const count = shape.positions.length / 3;
  const extent = (pick: (...values: number[]) => number) =>
    [0, 1, 2].map((axis) => pick(...shape.positions.filter((_, i) => i % 3 === axis)));
  const json = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2 }, indices: 3, material: 0 }] }],
    materials: [
      {
        pbrMetallicRoughness: {
          baseColorFactor: [...color, 1],
          metallicFactor: 0,
          roughnessFactor: 0.8,
          ...(texture && { baseColorTexture: { index: 0 } }),
        },
      },
    ],
    ...(texture && { textures: [{ source: 0 }], images: [{ uri: texture }] }),
    accessors: [
      { bufferView: 0, componentType: 5126, count, type: "VEC3", min: extent(Math.min), max: extent(Math.max) },
      { bufferView: 1, componentType: 5126, count, type: "VEC3" },
      { bufferView: 2, componentType: 5126, count, type: "VEC2" },
      { bufferView: 3, componentType: 5125, count: shape.indices.length, type: "SCALAR" },
    ],
    bufferViews,
    buffers: [{ byteLength: offset }],
  };
  const text = new TextEncoder().encode(JSON.stringify(json));
  const jsonBytes = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(0x20);
  jsonBytes.set(text);
  const words = (...values: number[]) => new Uint8Array(new Uint32Array(values).buffer);
  const total = 12 + 8 + jsonBytes.length + 8 + offset;
  return concat([
    words(0x46546c67, 2, total, jsonBytes.length, 0x4e4f534a),
    jsonBytes,
    words(offset, 0x004e4942),
    ...arrays,
  ]);
}

/** A population as it is written; members rise by object. */
export interface WrittenPopulation {
  readonly rules: readonly object[];
  readonly recipes: readonly object[];
  readonly members: readonly {
    readonly object: number;
    readonly recipe: number;
    readonly position: readonly number[];
    /** A quaternion of length 1. */
    readonly rotation: readonly number[];
    readonly scale: number;
  }[];
}

/** Of objects with ids from `first` on. */
export function encodePopulation({ rules, recipes, members }: WrittenPopulation, first: number): Uint8Array {
  const origin = members[0]?.position ?? [0, 0, 0];
  const json = JSON.stringify({ origin, count: members.length, rules, recipes });
  const head = new TextEncoder().encode(json.padEnd(Math.ceil(json.length / 4) * 4));
  const fromOrigin = members.flatMap(({ position }) => position.map((x, axis) => x - (origin[axis] ?? 0)));
  const turned = members.flatMap(({ rotation }) => rotation.map((x) => Math.round(32767 * x)));
  const last = members.flatMap(({ recipe }) => recipe).concat(members.map(({ object }) => object - first));
  return concat([
    new TextEncoder().encode("BVPO"),
    new Uint8Array(Uint16Array.of(1, 0, head.length, 0).buffer),
    head,
    ...[Float32Array.from(fromOrigin), Float32Array.from(members, ({ scale }) => scale)].map(bytesOf),
    ...[Int16Array.from(turned), Uint16Array.from(last)].map(bytesOf),
  ]);
}

function bytesOf({ buffer }: { readonly buffer: ArrayBuffer }): Uint8Array {
  return new Uint8Array(buffer);
}

/** A square RGB picture as PNG. */
export function encodePng(size: number, colorAt: (x: number, y: number) => Vec3): Uint8Array {
  const rows = new Uint8Array(size * (1 + size * 3));
  for (let y = 0; y < size; y += 1) {
    for (let x = 0; x < size; x += 1) rows.set(colorAt(x, y), y * (1 + size * 3) + 1 + x * 3);
  }
  const big = (value: number) => [24, 16, 8, 0].map((shift) => (value >>> shift) & 0xff);
  const chunk = (type: string, data: Uint8Array) => {
    const body = concat([new TextEncoder().encode(type), data]);
    return concat([Uint8Array.from(big(data.length)), body, Uint8Array.from(big(crc32(body)))]);
  };
  return concat([
    Uint8Array.from([137, 80, 78, 71, 13, 10, 26, 10]),
    chunk("IHDR", Uint8Array.from([...big(size), ...big(size), 8, 2, 0, 0, 0])),
    chunk("IDAT", deflateSync(rows)),
    chunk("IEND", new Uint8Array()),
  ]);
}

function concat(parts: readonly Uint8Array[]): Uint8Array {
  const whole = new Uint8Array(parts.reduce((total, part) => total + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}
