import { expect, it } from "vitest";
import {
  writeBytes,
  writeDoor,
  writeLength,
  writePeople,
  writeProgress,
  writeQuality,
  writeShare,
  writeStandIns,
  writeTime,
  writeVisible,
} from "./format.ts";

it.each([
  [0, "0 B"],
  [999, "999 B"],
  [1000, "1.0 kB"],
  [999_949, "1.0 MB"],
  [1_234_567, "1.2 MB"],
  [99_960_000, "100 MB"],
  [35.4e9, "35.4 GB"],
])("%d bytes are written as %s", (bytes, text) => {
  expect(writeBytes(bytes)).toBe(text);
});

it.each([
  [0.0005, "0.5 mm"],
  [0.005, "5 mm"],
  [0.02, "2 cm"],
  [0.114, "11 cm"],
  [1, "1 m"],
  [34.3, "34 m"],
  [500, "500 m"],
  [999.9, "1 km"],
  [2000, "2 km"],
  [7260, "7.3 km"],
])("%d m are written as %s", (length_m, text) => {
  expect(writeLength(length_m)).toBe(text);
});

it("what was fetched is set against the whole, when the whole is known", () => {
  expect(writeShare(1.2e6, 35.4e6)).toBe("1.2 MB of 35.4 MB · 3.4 %");
  expect(writeShare(113e3, 112e3)).toBe("113 kB of 112 kB · 101 %");
  expect(writeShare(5, undefined)).toBe("5 B");
});

it("progress says where it is not exact", () => {
  const progress = { loaded_bytes: 3.1e6, total_bytes: 4e6, isAbout: false };
  expect(writeProgress({ ...progress, bound: "exact" })).toBe("3.1 MB of 4.0 MB");
  expect(writeProgress({ ...progress, bound: "least" })).toBe("3.1 MB of at least 4.0 MB");
  expect(writeProgress({ ...progress, bound: "most", isAbout: true })).toBe("about 3.1 MB of at most 4.0 MB");
});

it("quality and what is visible are told only as far as they are known", () => {
  expect(writeQuality({ here: 0.98, sharp: 0.755 }, 200)).toBe("98.0 % here, 75.5 % sharp");
  expect(writeQuality(undefined, undefined)).toBe("looking around");
  expect(writeQuality(undefined, 200)).toBe("looking around");
  expect(writeQuality(undefined, 0)).toBe("nothing in sight");
  expect([writeVisible(3, 20), writeVisible(undefined, 20)]).toEqual([
    "3 of 20 objects visible",
    "– of 20 objects visible",
  ]);
});

it("times are minutes and seconds", () => {
  expect([0, 7_999, 3_690_000].map(writeTime)).toEqual(["0:00", "0:07", "61:30"]);
});

it.each([
  ["door:front", "door “front”"],
  ["door: garden_gate", "door “garden gate”"],
  ["door:3", "door 3"],
  ["door:Front door", "Front door"],
  ["door", "the door"],
])("a door named %s is written as %s", (sourceNode, text) => {
  expect(writeDoor(sourceNode)).toBe(text);
});

it.each([
  [[], "Nobody else in sight"],
  [["Ada"], "1 person in sight: Ada"],
  [["Ben", "Ada"], "2 people in sight: Ada, Ben"],
  [["", " "], "2 people in sight"],
  [["Ben", "", "Ada"], "3 people in sight: Ada, Ben, and 1 more"],
  [["h", "g", "f", "e", "d", "c", "b", "a"], "8 people in sight: a, b, c, d, e, f, and 2 more"],
])("people named %j are written as %s", (names, text) => {
  expect(writePeople(names)).toBe(text);
});

it("says why the sharp picture may take less than the first, and nothing where it does not", () => {
  const of = (total_bytes: number) => ({ loaded_bytes: 0, isAbout: false, total_bytes, bound: "exact" }) as const;
  expect(writeStandIns(of(943_000), of(754_000))).toMatch(/less/);
  expect([
    writeStandIns(of(754_000), of(943_000)),
    writeStandIns(of(5), of(5)),
    writeStandIns(undefined, of(5)),
  ]).toEqual(["", "", ""]);
});
