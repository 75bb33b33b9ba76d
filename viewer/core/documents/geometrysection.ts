/**
 * What do hull, portals and sizes of a cell look like in bytes? Little-endian, integers variable in length: below 251 one
 * byte; 251, 252 and 253 announce 2, 4 and 8 bytes. A coordinate stands once; corners are indices into the lists of the
 * coordinates of each axis.
 *
 * Guarantee: bytes that are cut short, have anything after their end, or hold a value that makes no sense are refused; no
 * list is allocated larger than the bytes that are there could fill.
 */
import type { Vec3 } from "../basics/geometry.ts";
import { damaged } from "../basics/rangecoder.ts";

export interface GeometrySection {
  readonly cell: number;
  readonly hull: { readonly points: readonly Vec3[]; readonly faces: readonly (readonly number[])[] };
  /** Cells that share an opening with it, rising. */
  readonly adjacent: readonly number[];
  readonly portals: readonly Portal[];
  readonly method: string;
  /** Whether the sets never miss anything. */
  readonly conservative: boolean;
  readonly missBound: number;
  readonly visibleLevel0Bytes: number;
  readonly visibleCoarsestBytes: number;
}

export interface Portal {
  /** The cell on the other side. */
  readonly to: number;
  /** A convex polygon in world space, metres. */
  readonly polygon: readonly Vec3[];
  /** The door that closes it. */
  readonly door: number | undefined;
}

export const METHODS = ["sampled", "occluders", "portals", "conservative"];
const LEAST_MISS = 1000;
const BOX_FACES = [
  [0, 4, 6, 2],
  [1, 3, 7, 5],
  [0, 1, 5, 4],
  [2, 6, 7, 3],
  [0, 2, 3, 1],
  [4, 5, 7, 6],
];

/** 0 for 0; else eight steps to each halving, from 1 down. */
export function missBoundOf(code: number): number {
  return code === 0 ? 0 : ((16 - ((code - 1) % 8)) / 16) * 2 ** -Math.floor((code - 1) / 8);
}

export function readGeometrySection(bytes: Uint8Array): GeometrySection {
  const reader = new Reader(bytes);
  const cell = reader.u32();
  const axes = [0, 1, 2].map(() => reader.list(8, () => reader.f64()));
  const corner = (): Vec3 => {
    const [x, y, z] = axes.map((coordinates) => coordinates[reader.u32()]);
    if (x === undefined || y === undefined || z === undefined) {
      return damaged("a corner names a coordinate that is not there");
    }
    return [x, y, z];
  };
  const section: GeometrySection = {
    cell,
    hull: readHull(reader, corner),
    adjacent: reader.list(1, () => reader.u32()),
    portals: reader.list(3, () => ({ to: reader.u32(), polygon: reader.list(3, corner), door: reader.option() })),
    method: readMethod(reader),
    conservative: reader.boolean(),
    missBound: missBoundOf(reader.varint(LEAST_MISS)),
    visibleLevel0Bytes: reader.varint(Number.MAX_SAFE_INTEGER),
    visibleCoarsestBytes: reader.varint(Number.MAX_SAFE_INTEGER),
  };
  reader.finish();
  return section;
}

function readHull(reader: Reader, corner: () => Vec3): GeometrySection["hull"] {
  const kind = reader.varint(1);
  if (kind === 0) {
    const [min, max] = [corner(), corner()];
    const at = (i: number): Vec3 => [(i & 1 ? max : min)[0], (i & 2 ? max : min)[1], (i & 4 ? max : min)[2]];
    return { points: [0, 1, 2, 3, 4, 5, 6, 7].map(at), faces: BOX_FACES };
  }
  const points = reader.list(3, corner);
  const faces = reader.list(1, () => reader.list(1, () => reader.u32()));
  if (faces.some((face) => face.some((index) => index >= points.length))) {
    damaged("a hull face names a point that is not there");
  }
  return { points, faces };
}

function readMethod(reader: Reader): string {
  if (reader.varint(1) === 1) return reader.text();
  return METHODS[reader.u8()] ?? damaged("its method is unknown");
}

/** Walks forward through the bytes; every step checks that they are there. */
class Reader {
  private readonly view: DataView;
  private at = 0;

  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  /** Moves on by `length` bytes and returns where they start. */
  private take(length: number): number {
    const start = this.at;
    if (length > this.bytes.length - start) damaged("its geometry ends early");
    this.at = start + length;
    return start;
  }

  u8(): number {
    return this.view.getUint8(this.take(1));
  }

  varint(max: number): number {
    const first = this.u8();
    let value = first;
    if (first === 251) value = this.view.getUint16(this.take(2), true);
    else if (first === 252) value = this.view.getUint32(this.take(4), true);
    else if (first === 253) value = Number(this.view.getBigUint64(this.take(8), true));
    else if (first > 253) damaged(`byte ${first} does not start a number here`);
    return value > max ? damaged(`${value} is more than ${max}`) : value;
  }

  u32(): number {
    return this.varint(0xffff_ffff);
  }

  f64(): number {
    const value = this.view.getFloat64(this.take(8), true);
    return Number.isFinite(value) ? value : damaged("a coordinate is not finite");
  }

  boolean(): boolean {
    const byte = this.u8();
    return byte <= 1 ? byte === 1 : damaged(`byte ${byte} is neither true nor false`);
  }

  option(): number | undefined {
    return this.boolean() ? this.u32() : undefined;
  }

  text(): string {
    const length = this.u32();
    const start = this.take(length);
    try {
      return new TextDecoder("utf-8", { fatal: true }).decode(this.bytes.subarray(start, start + length));
    } catch {
      return damaged("a text is not UTF-8");
    }
  }

  /** A list whose items take at least `itemBytes` bytes each, so that a claimed length can be believed or refused. */
  list<T>(itemBytes: number, read: () => T): T[] {
    const length = this.varint(Number.MAX_SAFE_INTEGER);
    if (length * itemBytes > this.bytes.length - this.at) damaged(`it claims a list of ${length} items`);
    const items: T[] = [];
    for (let i = 0; i < length; i += 1) items.push(read());
    return items;
  }

  finish(): void {
    if (this.at < this.bytes.length) damaged("bytes follow the end of its geometry");
  }
}
