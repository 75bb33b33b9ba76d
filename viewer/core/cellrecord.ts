/**
 * What is visible from one view cell? Decodes the binary record (`.cell`): `BVCR`, a u16 version, then a payload in
 * bincode 2's standard encoding. Integers are little-endian and variable in length: below 251 one byte; 251, 252 and 253
 * announce 2, 4 and 8 bytes.
 *
 * Guarantee: bytes that are cut short, have anything after their end, or hold a value that makes no sense are refused;
 * no list is allocated larger than the bytes that are there could fill.
 */
import type { Vec3 } from "./geometry.ts";

export interface CellRecord {
  readonly cell: number;
  readonly hull: { readonly points: readonly Vec3[]; readonly faces: readonly (readonly number[])[] };
  /** Cells that share an opening with it, rising. */
  readonly adjacent: readonly number[];
  readonly portals: readonly Portal[];
  /** Cells that can be seen into from here, rising, without the cell itself. */
  readonly cpvs: readonly number[];
  /** Visible objects that do not lie wholly inside the cell, largest visible solid angle first. */
  readonly opvs: readonly Visible[];
  /** Visible objects that lie wholly inside the cell, largest visible solid angle first. */
  readonly lpvs: readonly Visible[];
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

export interface Visible {
  readonly object: number;
  /** The share of sight lines from the cell that arrive, in (0, 1]. */
  readonly fraction: number;
  /** The solid angle that what is visible of it fills on average over all eyes in the cell, steradians. */
  readonly solidAngle: number;
  /** Doors that hide it when they are closed. */
  readonly doors: readonly number[];
}

/** A solid angle is stored as the n that stands for 4π · 2^(−n/256) steradians. */
export function solidAngleOf(code: number): number {
  return 4 * Math.PI * 2 ** (-code / 256);
}

export class CellRecordError extends Error {
  override readonly name = "CellRecordError";
}

const MAGIC = [0x42, 0x56, 0x43, 0x52];
const VERSION = 1;
const FRACTION_STEPS = 65535;

/** Objects of both sets, largest visible solid angle first. */
export function visibleObjects(record: CellRecord): readonly Visible[] {
  return [...record.lpvs, ...record.opvs].sort((a, b) => b.solidAngle - a.solidAngle || a.object - b.object);
}

/** Reads the binary form. */
export function decodeCellRecord(bytes: Uint8Array): CellRecord {
  if (MAGIC.some((byte, i) => bytes[i] !== byte)) {
    throw new CellRecordError("not a cell record: it does not start with BVCR");
  }
  const reader = new Reader(bytes, MAGIC.length);
  const version = reader.u16le();
  if (version !== VERSION) {
    throw new CellRecordError(`cell record of version ${version}; this viewer reads version ${VERSION}`);
  }
  const record: CellRecord = {
    cell: reader.u32(),
    hull: { points: reader.points(), faces: reader.list(1, () => reader.u32s()) },
    adjacent: reader.u32s(),
    portals: reader.list(3, () => ({ to: reader.u32(), polygon: reader.points(), door: reader.option() })),
    cpvs: reader.u32s(),
    opvs: reader.list(3, () => reader.visible()),
    lpvs: reader.list(3, () => reader.visible()),
    method: reader.text(),
    conservative: reader.boolean(),
    missBound: reader.f64(),
    visibleLevel0Bytes: reader.varint(Number.MAX_SAFE_INTEGER),
    visibleCoarsestBytes: reader.varint(Number.MAX_SAFE_INTEGER),
  };
  reader.finish();
  if (record.hull.faces.some((face) => face.some((index) => index >= record.hull.points.length))) {
    reader.fail("a hull face names a point that is not there");
  }
  if (!(record.missBound >= 0 && record.missBound <= 1)) reader.fail("the miss bound is not in [0, 1]");
  return record;
}

/** Walks forward through the payload; every step checks that its bytes are there. */
class Reader {
  private readonly view: DataView;

  constructor(
    private readonly bytes: Uint8Array,
    private at: number,
  ) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  fail(what: string): never {
    throw new CellRecordError(`cell record is damaged: ${what}`);
  }

  /** Moves on by `length` bytes and returns where they start. */
  private take(length: number): number {
    const start = this.at;
    if (length > this.bytes.length - start) {
      this.fail(`it ends at byte ${this.bytes.length}, where ${start + length} are needed`);
    }
    this.at = start + length;
    return start;
  }

  u8(): number {
    return this.view.getUint8(this.take(1));
  }

  u16le(): number {
    return this.view.getUint16(this.take(2), true);
  }

  varint(max: number): number {
    const first = this.u8();
    let value = first;
    if (first === 251) value = this.u16le();
    else if (first === 252) value = this.view.getUint32(this.take(4), true);
    else if (first === 253) value = Number(this.view.getBigUint64(this.take(8), true));
    else if (first > 253) this.fail(`byte ${first} does not start a number here`);
    if (value > max) this.fail(`${value} is more than ${max}`);
    return value;
  }

  u32(): number {
    return this.varint(0xffff_ffff);
  }

  f64(): number {
    const value = this.view.getFloat64(this.take(8), true);
    return Number.isFinite(value) ? value : this.fail("a number is not finite");
  }

  boolean(): boolean {
    const byte = this.u8();
    return byte <= 1 ? byte === 1 : this.fail(`byte ${byte} is neither true nor false`);
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
      return this.fail("a text is not UTF-8");
    }
  }

  /** A list whose items take at least `itemBytes` bytes each, so that a claimed length can be believed or refused. */
  list<T>(itemBytes: number, read: () => T): T[] {
    const length = this.varint(Number.MAX_SAFE_INTEGER);
    if (length * itemBytes > this.bytes.length - this.at) this.fail(`it claims a list of ${length} items`);
    const items: T[] = [];
    for (let i = 0; i < length; i += 1) items.push(read());
    return items;
  }

  u32s(): number[] {
    return this.list(1, () => this.u32());
  }

  points(): Vec3[] {
    return this.list(24, () => [this.f64(), this.f64(), this.f64()] as const);
  }

  visible(): Visible {
    const object = this.u32();
    const fraction = this.varint(FRACTION_STEPS) / FRACTION_STEPS;
    if (fraction === 0) this.fail("a visible fraction is 0");
    const solidAngle = solidAngleOf(this.varint(0xffff));
    return { object, fraction, solidAngle, doors: this.u32s() };
  }

  finish(): void {
    const after = this.bytes.length - this.at;
    if (after > 0) this.fail(`${after} bytes follow its end`);
  }
}
