import { describe, expect, it } from "vitest";
import { encodeCellRecord } from "../test/encode.ts";
import { hullOf } from "../test/fixture.ts";
import { type CellRecord, CellRecordError, decodeCellRecord, solidAngleOf, visibleObjects } from "./cellrecord.ts";

/** Written by the scene crate for the record below. */
const GOLDEN_HEX =
  "4256435201000c08000000000000000000000000000000000000000000000000000000000000f03f00000000000000000000000000000000" +
  "000000000000000000000000000000400000000000000000000000000000f03f000000000000004000000000000000000000000000000000" +
  "00000000000000000000000000000840000000000000f03f0000000000000000000000000000084000000000000000000000000000000040" +
  "0000000000000840000000000000f03f00000000000000400000000000000840060400040602040103070504000105040402060703040002" +
  "03010404050706020bfb2c01010b0300000000000000000000000000000000000000000000f03f0000000000000000000000000000004000" +
  "0000000000f03f0000000000000000000000000000004000000000000000400107020bfc701101000109fb0040fba70401070101fbfffffb" +
  "9517000773616d706c6564002d431cebe2361a3ffc40e20100fb1503";

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
  opvs: [{ object: 9, fraction: 16384 / 65535, solidAngle: solidAngleOf(1191), doors: [7] }],
  lpvs: [{ object: 1, fraction: 1, solidAngle: solidAngleOf(6037), doors: [] }],
  method: "sampled",
  conservative: false,
  missBound: 1e-4,
  visibleLevel0Bytes: 123_456,
  visibleCoarsestBytes: 789,
};
const golden = Uint8Array.from(Buffer.from(GOLDEN_HEX, "hex"));

describe("a cell record", () => {
  it("is read as the bake wrote it", () => {
    expect(decodeCellRecord(golden)).toEqual(SAMPLE);
    expect(encodeCellRecord(SAMPLE)).toEqual(golden);
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
    for (let bit = 0; bit < golden.length * 8; bit += 1) {
      const flipped = Uint8Array.from(golden);
      flipped[bit >> 3] = (flipped[bit >> 3] ?? 0) ^ (1 << (bit & 7));
      try {
        const record = decodeCellRecord(flipped);
        expect(record.hull.points.flat().every(Number.isFinite)).toBe(true);
      } catch (error) {
        expect(error).toBeInstanceOf(CellRecordError);
      }
    }
  });

  it("that claims a huge list is refused before the list is made", () => {
    const huge = [0x42, 0x56, 0x43, 0x52, 1, 0, 12, 253, 0, 0, 0, 0, 1, 0, 0, 0];
    expect(() => decodeCellRecord(Uint8Array.from(huge))).toThrow(/claims a list/);
  });

  it("of a newer version says so", () => {
    const newer = Uint8Array.from(golden);
    newer[4] = 9;
    expect(() => decodeCellRecord(newer)).toThrow("version 9; this viewer reads version 1");
  });

  it("lists what fills most of the view first", () => {
    expect(visibleObjects(SAMPLE).map(({ object }) => object)).toEqual([9, 1]);
  });

  it("is read from the middle of a larger buffer", () => {
    const larger = new Uint8Array(golden.length + 5);
    larger.set(golden, 5);
    expect(decodeCellRecord(larger.subarray(5)).cell).toBe(12);
  });
});
