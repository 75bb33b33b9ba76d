/**
 * What is visible from one view cell, and from those next door? Decodes the binary record (`.cell`): `BVCR`, a u16 version,
 * the length of the rest, the rest; and the steps from a cell to its neighbours (`.steps`): `BVST`, a u16 version, the cell,
 * how many steps, for each where it leads and its length, then the steps. A record that a step led to can be stepped from.
 */
import { CellRecordError, Decoder, damaged } from "../basics/rangecoder.ts";
import type { Pieces } from "../pace/pieces.ts";
import { type GeometrySection, readGeometrySection } from "./geometrysection.ts";
import { type Coded, codeChanges, NOTHING } from "./recordcoding.ts";

export { CellRecordError } from "../basics/rangecoder.ts";
export type { Portal } from "./geometrysection.ts";

export interface CellRecord extends GeometrySection {
  /** Cells that can be seen into from here, rising, without the cell itself. */
  readonly cpvs: readonly number[];
  /** Visible objects that do not lie wholly inside the cell, largest visible solid angle first. */
  readonly opvs: readonly Visible[];
  /** Visible objects that lie wholly inside the cell, largest visible solid angle first. */
  readonly lpvs: readonly Visible[];
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

/** A record with what steps start from. */
export interface DecodedRecord {
  readonly record: CellRecord;
  readonly coded: Coded;
}

/** What changes on the way from one cell to each neighbour. */
export interface Steps {
  readonly from: number;
  readonly to: ReadonlyMap<number, Uint8Array>;
}

const RECORD = [0x42, 0x56, 0x43, 0x52];
const STEPS = [0x42, 0x56, 0x53, 0x54];
export const VERSION = 2;

/** Objects of both sets, largest visible solid angle first. */
export function visibleObjects({ lpvs, opvs }: CellRecord): readonly Visible[] {
  // Each list is in order already, and thousands long.
  const merged: Visible[] = [];
  let next = 0;
  for (const inside of lpvs) {
    for (let other = opvs[next]; other && isBefore(other, inside); other = opvs[next]) {
      merged.push(other);
      next += 1;
    }
    merged.push(inside);
  }
  return [...merged, ...opvs.slice(next)];
}

function isBefore(a: Visible, b: Visible): boolean {
  return a.solidAngle > b.solidAngle || (a.solidAngle === b.solidAngle && a.object < b.object);
}

/** Reads the binary form. */
export function* decodeCellRecord(bytes: Uint8Array): Pieces<DecodedRecord> {
  const header = new Header(bytes, RECORD, "a cell record");
  const length = header.integer();
  const stream = header.take(length);
  header.finish();
  return yield* changed(NOTHING, stream);
}

/** What a step makes of the record that it starts from. */
export function followStep(from: DecodedRecord, step: Uint8Array): Pieces<DecodedRecord> {
  return changed(from.coded, step);
}

export function decodeSteps(bytes: Uint8Array): Steps {
  const header = new Header(bytes, STEPS, "the steps of a cell");
  const from = header.integer();
  const count = header.integer();
  const lengths: (readonly [number, number])[] = [];
  for (let i = 0; i < count; i += 1) {
    const cell = header.integer();
    if (cell <= (lengths.at(-1)?.[0] ?? -1)) damaged("the cells that it leads to do not rise");
    lengths.push([cell, header.integer()]);
  }
  const to = new Map(lengths.map(([cell, length]) => [cell, header.take(length)]));
  header.finish();
  return { from, to };
}

function* changed(before: Coded, stream: Uint8Array): Pieces<DecodedRecord> {
  const decoder = new Decoder(stream);
  const coded = yield* codeChanges(decoder, before);
  decoder.finish();
  yield;
  const byAngle = [...coded.objects].sort((a, b) => a.angle - b.angle || a.object - b.object);
  const list = (inside: boolean): Visible[] =>
    byAngle
      .filter(({ local }) => local === inside)
      .map(({ object, fraction, angle, doors }) => ({
        object,
        fraction: 2 ** -fraction,
        solidAngle: solidAngleOf(angle),
        doors,
      }));
  const record = { ...readGeometrySection(coded.geometry), cpvs: coded.cells, opvs: list(false), lpvs: list(true) };
  return { record, coded };
}

/** A solid angle is stored as the n that stands for 4π · 2⁻ⁿ steradians. */
export function solidAngleOf(code: number): number {
  return 4 * Math.PI * 2 ** -code;
}

/** Walks through magic, version and integers of seven bits to a byte, lowest first. */
class Header {
  private at = 6;

  constructor(
    private readonly bytes: Uint8Array,
    magic: readonly number[],
    what: string,
  ) {
    if (magic.some((byte, i) => bytes[i] !== byte)) {
      throw new CellRecordError(`not ${what}: it does not start with ${String.fromCharCode(...magic)}`);
    }
    const version = (bytes[4] ?? damaged("no version")) + 256 * (bytes[5] ?? damaged("no version"));
    if (version !== VERSION) {
      throw new CellRecordError(`${what} of version ${version}; this viewer reads version ${VERSION}`);
    }
  }

  integer(): number {
    let value = 0;
    for (let weight = 1; weight < 2 ** 35; weight *= 128) {
      const byte = this.bytes[this.at] ?? damaged("it ends in its header");
      this.at += 1;
      value += (byte & 0x7f) * weight;
      if (byte < 0x80) return value;
    }
    return damaged("an integer of its header has more than five bytes");
  }

  take(length: number): Uint8Array {
    if (length > this.bytes.length - this.at) damaged(`it claims ${length} bytes that are not there`);
    this.at += length;
    return this.bytes.subarray(this.at - length, this.at);
  }

  finish(): void {
    const after = this.bytes.length - this.at;
    if (after > 0) damaged(`${after} bytes follow its end`);
  }
}
