import { describe, expect, it } from "vitest";
import { encodeCellRecord, encodeSteps } from "../../test/encode.ts";
import { hullOf } from "../../test/fixture.ts";
import { atOnce } from "../pace/pieces.ts";
import {
  type CellRecord,
  CellRecordError,
  type DecodedRecord,
  decodeSteps,
  decodeCellRecord as decoding,
  followStep as following,
  solidAngleOf,
  visibleObjects,
} from "./cellrecord.ts";
import { missBoundOf } from "./geometrysection.ts";

const decodeCellRecord = (bytes: Uint8Array) => atOnce(decoding(bytes));
const followStep = (from: DecodedRecord, step: Uint8Array) => atOnce(following(from, step));

/** Written by the scene crate for the record below. */
const GOLDEN_RECORD =
  "4256435202004102a7cfeed93036be46a49f20e079ba2ae2af07db43bde9ce0326af93d092717a879860677c093a7fec8e88515490658c64" +
  "3bd2da849def81eabed327b09442887b";
/** From that record to the one next door. */
const GOLDEN_STEPS =
  "4256535402000c01ac024d027413cf154c47b5bd2a9321629b4333d6f4663ca3b6ebd640eb269d786e5f0ac99282b61cef2b113a35ffb378" +
  "c70119c3872ec1272ae8317f44669e31e0026156e0c4d4f4501b2463bc251a59";

const SAMPLE: CellRecord = {
  cell: 12,
  hull: hullOf({ min: [0, 0, 0], max: [1, 2, 3] }),
  adjacent: [11, 300],
  portals: [
    {
      to: 11,
      polygon: [
        [0, 0, 1],
        [0, 2, 1],
        [0, 2, 2],
      ],
      door: 7,
    },
  ],
  cpvs: [11, 70_000],
  opvs: [
    { object: 9, fraction: 0.25, solidAngle: solidAngleOf(5), doors: [7] },
    { object: 40, fraction: 0.5, solidAngle: solidAngleOf(5), doors: [7, 8] },
  ],
  lpvs: [{ object: 1, fraction: 1, solidAngle: solidAngleOf(24), doors: [] }],
  method: "sampled",
  conservative: false,
  missBound: missBoundOf(107),
  visibleLevel0Bytes: 123_456,
  visibleCoarsestBytes: 789,
};
const NEXT_DOOR: CellRecord = {
  cell: 300,
  hull: {
    points: [
      [1, 0, 0],
      [4, 0, 0],
      [1, 2, 0],
      [1, 0, 3],
    ],
    faces: [
      [0, 2, 1],
      [0, 1, 3],
      [0, 3, 2],
      [1, 2, 3],
    ],
  },
  adjacent: [12],
  portals: [],
  cpvs: [12, 13, 70_000],
  opvs: [
    { object: 9, fraction: 0.5, solidAngle: solidAngleOf(3), doors: [] },
    { object: 41, fraction: 0.5, solidAngle: solidAngleOf(5), doors: [8, 10] },
    { object: 1, fraction: 0.0625, solidAngle: solidAngleOf(14), doors: [] },
  ],
  lpvs: [{ object: 0xffff_ffff, fraction: 1, solidAngle: solidAngleOf(3), doors: [] }],
  method: "of our own",
  conservative: true,
  missBound: 0,
  visibleLevel0Bytes: 2 ** 50,
  visibleCoarsestBytes: 0,
};
const bytesOf = (hex: string) => Uint8Array.from(Buffer.from(hex, "hex"));
const golden = bytesOf(GOLDEN_RECORD);
const goldenSteps = bytesOf(GOLDEN_STEPS);

/** Damaged bytes are refused, or are read as something that makes sense. */
function survives(read: () => CellRecord): void {
  try {
    const record = read();
    expect(record.hull.points.flat().every(Number.isFinite)).toBe(true);
    expect(visibleObjects(record).every(({ fraction }) => fraction > 0 && fraction <= 1)).toBe(true);
  } catch (error) {
    expect(error).toBeInstanceOf(CellRecordError);
  }
}

function flips(bytes: Uint8Array): Uint8Array[] {
  return Array.from({ length: bytes.length * 8 }, (_, bit) => {
    const flipped = Uint8Array.from(bytes);
    flipped[bit >> 3] = (flipped[bit >> 3] ?? 0) ^ (1 << (bit & 7));
    return flipped;
  });
}

describe("a cell record", () => {
  it("is read as the bake wrote it", () => {
    expect(decodeCellRecord(golden).record).toEqual(SAMPLE);
  });

  it("is read as these tests write it", () => {
    expect(decodeCellRecord(encodeCellRecord(SAMPLE)).record).toEqual(SAMPLE);
  });

  it("is refused at every length that cuts it short", () => {
    for (let end = 0; end < golden.length; end += 1) {
      expect(() => decodeCellRecord(golden.subarray(0, end)), `accepted ${end} bytes`).toThrow(CellRecordError);
    }
  });

  it("is refused when bytes follow its end", () => {
    expect(() => decodeCellRecord(Uint8Array.from([...golden, 0]))).toThrow(/1 bytes follow/);
  });

  it("never fails in any other way when a bit is flipped", () => {
    for (const flipped of flips(golden)) survives(() => decodeCellRecord(flipped).record);
  });

  it("that claims more than is there is refused before anything is read", () => {
    const huge = [0x42, 0x56, 0x43, 0x52, 2, 0, 255, 255, 255, 255, 15];
    expect(() => decodeCellRecord(Uint8Array.from(huge))).toThrow(/claims 4294967295 bytes/);
  });

  it("whose stream never ends is refused", () => {
    for (const byte of [0, 0xff]) {
      const endless = [0x42, 0x56, 0x43, 0x52, 2, 0, 4, byte, byte, byte, byte];
      expect(() => decodeCellRecord(Uint8Array.from(endless))).toThrow(CellRecordError);
    }
  });

  it("of another version says so", () => {
    const other = Uint8Array.from(golden);
    other[4] = 1;
    expect(() => decodeCellRecord(other)).toThrow("version 1; this viewer reads version 2");
  });

  it("lists what fills most of the view first", () => {
    expect(visibleObjects(SAMPLE).map(({ object }) => object)).toEqual([9, 40, 1]);
  });

  it("is read from the middle of a larger buffer", () => {
    const larger = new Uint8Array(golden.length + 5);
    larger.set(golden, 5);
    expect(decodeCellRecord(larger.subarray(5)).record.cell).toBe(12);
  });
});

describe("steps", () => {
  const step = decodeSteps(goldenSteps).to.get(300) ?? new Uint8Array();

  it("lead to the record next door", () => {
    expect(decodeSteps(goldenSteps).from).toBe(12);
    expect(followStep(decodeCellRecord(golden), step).record).toEqual(NEXT_DOOR);
  });

  it("can be followed by further steps", () => {
    const there = { ...NEXT_DOOR, method: "portals" };
    const [forth, back] = [encodeSteps(SAMPLE, [there]), encodeSteps(there, [SAMPLE])].map(decodeSteps);
    const first = followStep(decodeCellRecord(golden), forth?.to.get(300) ?? new Uint8Array());
    expect(first.record).toEqual(there);
    expect(followStep(first, back?.to.get(12) ?? new Uint8Array()).record).toEqual(SAMPLE);
  });

  it("are refused when they are cut short or go on", () => {
    for (let end = 0; end < goldenSteps.length; end += 1) {
      expect(() => decodeSteps(goldenSteps.subarray(0, end)), `accepted ${end} bytes`).toThrow(CellRecordError);
    }
    expect(() => decodeSteps(Uint8Array.from([...goldenSteps, 0]))).toThrow(/1 bytes follow/);
  });

  it("never fail in any other way when a bit is flipped", () => {
    const from = decodeCellRecord(golden);
    for (const flipped of flips(step)) survives(() => followStep(from, flipped).record);
  });
});
