/**
 * What changes from one cell's record to another's? The coding of records and steps, the same as in the scene crate: a
 * `.cell` changes from nothing, a step from the record of an adjacent cell. Sets are gaps between rising ids; solid angles
 * and fractions are powers of two.
 */
import {
  Bit,
  bits,
  ChangeModel,
  type Coder,
  damaged,
  NumberModel,
  SymbolModel,
  type Way,
} from "../basics/rangecoder.ts";
import type { Pieces } from "../pace/pieces.ts";

const SMALLEST_ANGLE = 63;
const SMALLEST_FRACTION = 7;
/** No geometry section is larger. */
const LONGEST_GEOMETRY = 1 << 20;
/** So many are coded in one go. */
const PIECE_OBJECTS = 256;

/** A record as it is coded. Its lists rise. */
export interface Coded {
  /** Hull, portals and sizes, see `geometrysection.ts`. */
  readonly geometry: Uint8Array;
  readonly objects: readonly CodedObject[];
  /** Doors that hide any of them. */
  readonly doors: readonly number[];
  /** Cells that can be seen into. */
  readonly cells: readonly number[];
}

export interface CodedObject {
  readonly object: number;
  /** Its solid angle is 4π · 2⁻ⁿ sr. */
  readonly angle: number;
  /** Its fraction is 2⁻ⁿ. */
  readonly fraction: number;
  /** Whether it lies wholly inside the cell. */
  readonly local: boolean;
  readonly doors: readonly number[];
}

export const NOTHING: Coded = { geometry: new Uint8Array(), objects: [], doors: [], cells: [] };

/** Gives what a stream says has become of `before`; a coder that writes is given it as `after`. */
export function* codeChanges(coder: Coder, before: Coded, after: Coded = NOTHING): Pieces<Coded> {
  const geometry = codeText(coder, before.geometry, after.geometry);
  const ids = (coded: Coded) => coded.objects.map(({ object }) => object);
  yield;
  const members = codeSet(coder, ids(before), ids(after));
  yield;
  const doors = codeSet(coder, before.doors, after.doors);
  const objects = yield* codeObjects(coder, before, after, members, doors);
  return { geometry, objects, doors, cells: codeSet(coder, before.cells, after.cells) };
}

/** Which members go, and the gaps between those that come, counted without members. */
function codeSet(coder: Coder, before: readonly number[], after: readonly number[]): number[] {
  const [goes, wanted, known] = [bits(2), new Set(after), new Set(before)];
  let went = false;
  const members = before.filter((id) => {
    went = coder.bit(goes[went ? 1 : 0] as Bit, !wanted.has(id));
    return !went;
  });
  const arriving = after.filter((id) => !known.has(id));
  const rank = (id: number) => id - before.filter((member) => member < id).length;
  const gaps = new NumberModel();
  const count = new NumberModel().code(coder, arriving.length);
  for (let index = 0, next = 0, passed = 0; index < count; index += 1) {
    const given = arriving[index];
    const found = next + gaps.code(coder, given === undefined ? 0 : rank(given) - next);
    while (passed < before.length && (before[passed] as number) <= found + passed) passed += 1;
    if (found + passed > 0xffff_ffff) damaged("an id has more than 32 bits");
    members.push(found + passed);
    next = found + 1;
  }
  return members.sort((a, b) => a - b);
}

function* codeObjects(
  coder: Coder,
  before: Coded,
  after: Coded,
  objects: readonly number[],
  doors: readonly number[],
): Pieces<CodedObject[]> {
  const anyLocal = coder.bit(
    new Bit(),
    after.objects.some(({ local }) => local),
  );
  const byId = (coded: Coded) => new Map(coded.objects.map((entry) => [entry.object, entry]));
  const [were, given] = [byId(before), byId(after)];
  const angles = new SymbolModel(SMALLEST_ANGLE + 1);
  const fractions = Array.from({ length: 16 }, () => new SymbolModel(SMALLEST_FRACTION + 1));
  const [angleChange, fractionChange] = [new ChangeModel(), new ChangeModel()];
  const localModels = bits(3);
  const doorModels = [bits(2), bits(2), bits(2)];
  const last = doors.map(() => false);
  let way: Way = 0;
  const code = (object: number): CodedObject => {
    const [was, goal] = [were.get(object), given.get(object)];
    let angle: number;
    let fraction: number;
    if (was) {
      const change = angleChange.code(coder, way, was.angle, goal?.angle ?? 0);
      way = change.way;
      angle = within(change.after, SMALLEST_ANGLE);
      const changed = fractionChange.code(coder, way, was.fraction, goal?.fraction ?? 0);
      fraction = within(changed.after, SMALLEST_FRACTION);
    } else {
      angle = angles.code(coder, goal?.angle);
      fraction = (fractions[angle >> 2] as SymbolModel).code(coder, goal?.fraction);
    }
    const local = anyLocal && coder.bit(localModels[contextOf(was?.local)] as Bit, goal?.local ?? false);
    const hiding = doors.filter((door, index) => {
      const model = doorModels[contextOf(was?.doors.includes(door))]?.[last[index] ? 1 : 0] as Bit;
      last[index] = coder.bit(model, goal?.doors.includes(door) ?? false);
      return last[index];
    });
    return { object, angle, fraction, local, doors: hiding };
  };
  const coded: CodedObject[] = [];
  for (const object of objects) {
    if (coded.length % PIECE_OBJECTS === 0) yield;
    coded.push(code(object));
  }
  return coded;
}

function contextOf(was: boolean | undefined): number {
  return was === undefined ? 0 : was ? 2 : 1;
}

function within(value: number, most: number): number {
  return value >= 0 && value <= most ? value : damaged("a class changes beyond its range");
}

/** Bytes as literals and copies from what is known: the bytes before, then those that are already there. */
function codeText(coder: Coder, before: Uint8Array, after: Uint8Array): Uint8Array {
  const length = new NumberModel().code(coder, after.length);
  if (length > LONGEST_GEOMETRY) damaged("its geometry claims to be larger than any");
  const known = Array.from(before);
  const end = before.length + length;
  const [copies, literals, place, copied] = [bits(2), new SymbolModel(256), new ChangeModel(), new NumberModel()];
  let on = 0;
  let copiedLast = false;
  while (known.length < end) {
    // Who writes with this function writes literals only.
    copiedLast = coder.bit(copies[copiedLast ? 1 : 0] as Bit, false);
    if (!copiedLast) {
      known.push(literals.code(coder, after[known.length - before.length]));
      on += 1;
      continue;
    }
    const from = place.code(coder, 0, on, on).after;
    const count = copied.code(coder) + 1;
    if (from < 0 || from >= known.length) damaged("it copies from where nothing is");
    if (count > end - known.length) damaged("it copies beyond its end");
    for (let at = from; at < from + count; at += 1) known.push(known[at] as number);
    on = from + count;
  }
  return Uint8Array.from(known.slice(before.length));
}
