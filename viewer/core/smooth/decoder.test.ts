import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { SmoothDecoder } from "./decoder.ts";
import { memoryBytes, readHeader } from "./header.ts";
import { SmoothError } from "./rans.ts";
import { latticeOf, snapshotOf } from "./snapshot.ts";

/** Streams that the encoder's own tests wrote, with hashes of what they give. */
const GOLDEN = join(import.meta.dirname, "../../../tests/golden/smooth");
const NAMES = ["bowl", "soup", "cube", "plain", "far", "nothing"];
const ENOUGH_BYTES = 2 ** 24;

const stream = (name: string) => new Uint8Array(readFileSync(join(GOLDEN, `${name}.slod`)));

function decoded(bytes: Uint8Array): SmoothDecoder {
  const decoder = new SmoothDecoder(ENOUGH_BYTES);
  decoder.push(bytes);
  return decoder;
}

/** The same as in the encoder's tests: lengths and words of every array. */
function hash(decoder: SmoothDecoder): string {
  const sum = createHash("sha256");
  const put = (words: Int32Array | Uint32Array | Float32Array, row: number) => {
    sum.update(Uint32Array.of(words.length / row));
    sum.update(words);
  };
  const lattice = latticeOf(decoder);
  const drawn = snapshotOf(decoder);
  put(lattice.triangles, 3);
  put(lattice.corners, 3);
  put(lattice.twicePositions, 3);
  put(lattice.values, 1);
  put(lattice.materials, 1);
  put(drawn.positions, 3);
  put(drawn.normals, 3);
  for (const set of drawn.uvs) put(set, 2);
  put(drawn.colours, 4);
  for (const corners of drawn.indices) put(corners, 1);
  return sum.digest("hex");
}

/** Whatever came: indices in range, no corner twice, everything finite. */
function expectValid(decoder: SmoothDecoder): void {
  const { triangles, twicePositions, materials } = latticeOf(decoder);
  const drawn = snapshotOf(decoder);
  const vertices = drawn.positions.length / 3;
  let fine = materials.length === triangles.length / 3;
  for (let i = 0; i < triangles.length; i += 3) {
    const [a = -1, b = -1, c = -1] = triangles.subarray(i, i + 3);
    fine &&= a !== b && b !== c && c !== a && Math.min(a, b, c) >= 0;
    fine &&= Math.max(a, b, c) < twicePositions.length / 3;
  }
  fine &&= drawn.indices.every((corners) => corners.every((corner) => corner < vertices));
  fine &&= drawn.indices.reduce((sum, { length }) => sum + length, 0) === triangles.length;
  fine &&= [drawn.positions, drawn.normals, drawn.colours].every((floats) => floats.every(Number.isFinite));
  expect(fine).toBe(true);
}

/** Decodes what may be damaged: it is refused or gives something valid. */
function expectHarmless(bytes: Uint8Array, portion: number): void {
  const decoder = new SmoothDecoder(ENOUGH_BYTES);
  for (let at = 0; at < bytes.length; at += portion) {
    try {
      decoder.push(bytes.subarray(at, at + portion));
    } catch (error) {
      expect(error).toBeInstanceOf(SmoothError);
      expectValid(decoder);
      expect(() => decoder.push(new Uint8Array(0))).toThrow(error as Error);
      return;
    }
  }
  expectValid(decoder);
}

/** The same numbers in every run, up to `below`. */
function randomNumbers(seed: number): (below: number) => number {
  let state = seed;
  return (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
}

describe("a header", () => {
  it("is refused with two normals or colours, of which readers would draw one or the other", () => {
    const bowl = stream("bowl");
    for (const kind of [0, 2]) {
      const twice = new Uint8Array(bowl.length);
      twice.set(bowl.subarray(0, 44));
      twice[6] = 2;
      const length = kind === 0 ? 1 : 17;
      twice[44] = kind;
      twice[44 + length] = kind;
      // No cuts, which lie elsewhere now.
      twice[7] = 0;
      expect(() => readHeader(twice)).toThrow("more than one normal or colour");
    }
  });
});

describe.each(NAMES)("%s", (name) => {
  const bytes = stream(name);
  const told = JSON.parse(readFileSync(join(GOLDEN, `${name}.json`), "utf8")) as {
    bytes: number;
    triangles: number;
    hash: string;
  }[];

  it("gives the encoder's mesh after each of its lengths", () => {
    const growing = new SmoothDecoder(ENOUGH_BYTES);
    let pushed = 0;
    for (const { bytes: length, triangles, hash: wanted } of told) {
      growing.push(bytes.subarray(pushed, length));
      pushed = length;
      for (const decoder of [growing, decoded(bytes.subarray(0, length))]) {
        expect([length, decoder.triangles, hash(decoder)]).toEqual([length, triangles, wanted]);
      }
    }
    expect(growing.isComplete).toBe(true);
    expect(growing.header?.cuts.at(-1)?.triangles ?? 0).toBe(growing.triangles);
  });

  it("gives the same when it comes byte by byte, and never less than before", () => {
    const decoder = new SmoothDecoder(ENOUGH_BYTES);
    const counts = Array.from(bytes, (byte) => {
      decoder.push(Uint8Array.of(byte));
      return decoder.triangles;
    });
    expect(counts).toEqual([...counts].sort((a, b) => a - b));
    expect(hash(decoder)).toBe(told.at(-1)?.hash);
  });

  it("is never whole when it claims to end earlier, and refused when it goes on", () => {
    expect(() => decoded(Uint8Array.of(...bytes, 0))).toThrow("goes on after its end");
    const short = bytes.slice(0, -1);
    new DataView(short.buffer).setUint32(8, short.length, true);
    const decoder = new SmoothDecoder(ENOUGH_BYTES);
    // Half a header may go on; half a stream is refused.
    if (name === "nothing") decoder.push(short);
    else expect(() => decoder.push(short)).toThrow(SmoothError);
    expect(decoder.isComplete).toBe(false);
  });

  it("does no harm with flipped bits", () => {
    const random = randomNumbers(name.length);
    for (let round = 0; round < 50; round += 1) {
      const damaged = bytes.slice();
      for (let flip = random(4); flip >= 0; flip -= 1) {
        const at = random(damaged.length);
        damaged[at] = (damaged[at] as number) ^ (1 << random(8));
      }
      expectHarmless(damaged, 1 + random(damaged.length));
    }
  });

  it("does no harm with noise behind a header that claims much", () => {
    const random = randomNumbers(99);
    const header = readHeader(bytes);
    for (let round = 0; round < 60; round += 1) {
      const noise = new Uint8Array((header?.bytes ?? 0) + random(700)).map(() => random(256));
      noise.set(bytes.subarray(0, header?.bytes));
      noise[7] = 0;
      const view = new DataView(noise.buffer);
      const wedges = header?.channels.length ? random(20000) : 0;
      [noise.length, random(5000), random(9000), wedges].forEach((n, i) => {
        view.setUint32(8 + 4 * i, n, true);
      });
      expectHarmless(noise, noise.length);
    }
  });
});

it("refuses a header that says what the stream does not", () => {
  const told = (at: number, change: (view: DataView, at: number) => void) => {
    const bytes = stream("bowl");
    const end = readHeader(bytes)?.bytes ?? 0;
    change(new DataView(bytes.buffer), at < 0 ? end + at : at);
    return () => decoded(bytes);
  };
  const more = (view: DataView, at: number) => view.setUint32(at, view.getUint32(at, true) + 1, true);
  const less = (view: DataView, at: number) => view.setUint32(at, view.getUint32(at, true) - 1, true);
  expect(told(0, () => {})).not.toThrow();
  for (const [change, at] of [
    [more, 12],
    [more, 20],
    [less, 20],
    [less, -8],
  ] as const) {
    expect(told(at, change)).toThrow(SmoothError);
  }
  const negated = (view: DataView, at: number) => view.setFloat32(at, -view.getFloat32(at, true), true);
  expect(told(40, negated)).toThrow("negative step");
  expect(told(-4, (view, at) => view.setFloat32(at, -1, true))).toThrow("cuts do not rise");
});

it("refuses what may take more memory than allowed, before it takes any", () => {
  const bytes = stream("bowl");
  const view = new DataView(bytes.buffer);
  const end = readHeader(bytes)?.bytes ?? 0;
  // The last cut is all there is.
  for (const at of [16, end - 8]) view.setUint32(at, 100_000_000, true);
  expect(() => decoded(bytes)).toThrow("bytes of memory");
  const header = readHeader(stream("bowl"));
  expect(header && memoryBytes(header)).toBeLessThan(ENOUGH_BYTES);
});

it("refuses to look at more than a mesh of its size needs, and keeps what it has", () => {
  // A thousand triangles around two vertices; a split of a few bits moves them all on to the next vertex, again and again.
  const decoder = new SmoothDecoder(ENOUGH_BYTES);
  expect(() => decoder.push(stream("hub"))).toThrow("look at more than a mesh of its size needs");
  // As in Rust.
  expect([latticeOf(decoder).twicePositions.length / 3, decoder.triangles]).toEqual([111, 1000]);
  expectValid(decoder);
});

it("says what is wrong with something else", () => {
  expect(() => decoded(Uint8Array.of(0x67, 0x6c))).toThrow("not a smooth LOD");
  expect(() => decoded(Uint8Array.of(0x53, 0x4c, 0x4f, 0x44, 1))).toThrow("version 1");
});
