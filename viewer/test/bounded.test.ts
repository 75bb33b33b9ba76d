import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import { DocumentError, Json } from "../core/basics/json.ts";
import { CellRecordError, decodeCellRecord, decodeSteps, followStep } from "../core/documents/cellrecord.ts";
import {
  readCellChunk,
  readManifest,
  readObjectChunk,
  readPage,
  readPointer,
  readSceneList,
} from "../core/documents/documents.ts";
import { readModelChunk } from "../core/documents/modeldocument.ts";
import { decodePopulation } from "../core/documents/population.ts";
import { atOnce } from "../core/pace/pieces.ts";
import { DcgError, grow, LIMITS, readProgram } from "../core/procedural/index.ts";
import { ClusterTree, Selection } from "../core/select/index.ts";
import { readHeader } from "../core/smooth/header.ts";
import { latticeOf, SmoothDecoder, SmoothError, snapshotOf } from "../core/smooth/index.ts";
import { publish } from "./fixture.ts";

/**
 * Do all readers stand a fixed number of damaged inputs? The same ones in every run. What the folder `fuzz` does for
 * the readers in Rust: sound examples, changed in one to five places; an input with an outcome that was not seen before
 * becomes another example. More rounds: `BELVEDERE_FUZZ_ROUNDS=100000 npx vitest run test/bounded.test.ts`.
 */
const ROUNDS = Number(process.env.BELVEDERE_FUZZ_ROUNDS ?? 0);
const MOST_EXAMPLES = 200;
const CLAIMS = [0, 1, 2, 0x7f, 0xff, 0x100, 0x7fff, 0xffff, 0x10000, 0x7fffffff, 0xffffffff];
const TEXTS = [
  "0",
  "-1",
  "4294967296",
  "1e308",
  "1e999",
  "-0.0",
  "9007199254740993",
  "null",
  "[]",
  "{}",
  '""',
  "((((((",
];

type Random = (below: number) => number;
/** A class of errors, whoever may make them. */
type Kind = { readonly prototype: Error };

function randomNumbers(seed: number): Random {
  let state = seed;
  return (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
}

const bytesOf = (text: string) => new TextEncoder().encode(text);
const textOf = (bytes: Uint8Array) => new TextDecoder().decode(bytes);
const joined = (...parts: Uint8Array[]) => Uint8Array.from(parts.flatMap((part) => [...part]));

/** An example with a change somewhere. */
function changed(bytes: Uint8Array, examples: readonly Uint8Array[], random: Random): Uint8Array {
  const at = random(bytes.length + 1);
  const end = Math.min(bytes.length, at + 1 + random(random(4) === 0 ? bytes.length : 16));
  const [before, part, after] = [bytes.subarray(0, at), bytes.subarray(at, end), bytes.subarray(end)];
  const flipped = bytes.slice();
  const noise = () => Uint8Array.from({ length: 1 + random(12) }, () => random(256));
  switch (random(8)) {
    case 0:
    case 1:
      if (at < bytes.length) flipped[at] = (flipped[at] as number) ^ (1 << random(8));
      return flipped;
    case 2:
      return before.slice();
    case 3:
      return joined(before, after);
    case 4:
      return joined(before, part, part, after);
    case 5: {
      const claim = random(3) === 0 ? bytes.length + random(5) - 2 : (CLAIMS[random(CLAIMS.length)] as number);
      for (let i = 0; i < 1 << random(3) && at + i < flipped.length; i += 1) flipped[at + i] = claim / 2 ** (8 * i);
      return flipped;
    }
    case 6: {
      const other = examples[random(examples.length)] as Uint8Array;
      return joined(before, other.subarray(random(other.length + 1)));
    }
    default: {
      const digits = /[0-9]+/.exec(Array.from(bytes.subarray(at), (byte) => String.fromCharCode(byte & 127)).join(""));
      if (!digits || random(3) === 0) return joined(before, noise(), bytes.subarray(at));
      const first = at + digits.index;
      const number = bytesOf(TEXTS[random(TEXTS.length)] as string);
      return joined(bytes.subarray(0, first), number, bytes.subarray(first + digits[0].length));
    }
  }
}

/** Runs a reader, which gives what kind of thing it found; it may only throw errors of these kinds. */
function run(
  seeds: readonly Uint8Array[],
  rounds: number,
  kinds: readonly Kind[],
  read: (bytes: Uint8Array) => string,
): void {
  const examples = [...seeds];
  const longest = Math.max(...seeds.map(({ length }) => length));
  const outcome = (bytes: Uint8Array): string => {
    try {
      return read(bytes);
    } catch (error) {
      if (!kinds.some(({ prototype }) => Object.prototype.isPrototypeOf.call(prototype, error as object))) {
        throw new Error(`a fault with the bytes ${Buffer.from(bytes).toString("hex")}`, { cause: error });
      }
      return (error as Error).message.replaceAll(/[0-9]+/g, "");
    }
  };
  const seen = new Set(seeds.map(outcome));
  const random = randomNumbers(7);
  for (let round = 0; round < (ROUNDS || rounds); round += 1) {
    let bytes = examples[random(examples.length)] as Uint8Array;
    for (let i = random(5); i >= 0; i -= 1) bytes = changed(bytes, examples, random);
    bytes = bytes.subarray(0, 4 * longest + 64);
    const found = outcome(bytes);
    if (seen.has(found)) continue;
    seen.add(found);
    if (examples.length < MOST_EXAMPLES) examples.push(bytes);
  }
  expect(seen.size).toBeGreaterThan(3);
}

const size = (count: number) => String(Math.ceil(Math.log2(count + 1)));
const files = [...publish({ rooms: 3, whole: true, smooth: true, packed: true, doored: true })];
const starting = (beginning: string) => {
  const found = files.map(([, bytes]) => bytes).filter((bytes) => textOf(bytes.subarray(0, 4)).startsWith(beginning));
  return found.sort((a, b) => a.length - b.length).slice(0, 12);
};
const golden = (folder: string, ending: string) => {
  const root = join(import.meta.dirname, "../../tests/golden", folder);
  const names = readdirSync(root).filter((name) => name.endsWith(ending));
  return names.sort().map((name) => new Uint8Array(readFileSync(join(root, name))));
};

it("cell records and steps", () => {
  const records = starting("BVCR");
  const from = atOnce(decodeCellRecord(records[0] as Uint8Array));
  const steps = starting("BVST");
  const single = steps.flatMap((bytes) => [...decodeSteps(bytes).to.values()]).slice(0, 12);
  run([...records, ...steps, ...single], 4000, [CellRecordError], (bytes) => {
    const kinds = [
      () => atOnce(decodeCellRecord(bytes)).record,
      () => decodeSteps(bytes),
      () => atOnce(followStep(from, bytes)).record,
    ];
    const found = kinds.map((decode) => {
      try {
        const thing = decode();
        if (!("hull" in thing)) return size(thing.to.size);
        const { hull, opvs, lpvs } = thing;
        const corners = hull.points.length;
        expect(hull.points.flat().every(Number.isFinite)).toBe(true);
        expect(hull.faces.flat().every((corner) => corner < corners)).toBe(true);
        return size(opvs.length + lpvs.length);
      } catch (error) {
        if (error instanceof CellRecordError) return error.message.replaceAll(/[0-9]+/g, "");
        throw error;
      }
    });
    return found.join();
  });
});

it("documents", () => {
  const readers = [readPointer, readManifest, readPage, readCellChunk, readModelChunk, readObjectChunk, readSceneList];
  run(starting("{"), 3000, [DocumentError], (bytes) => {
    const json = Json.parse(textOf(bytes), "it");
    const found = readers.map((read) => {
      try {
        read(json);
        return "";
      } catch (error) {
        if (error instanceof DocumentError) return error.message.replaceAll(/[0-9]+/g, "");
        throw error;
      }
    });
    return found.join();
  });
});

it("populations", () => {
  run(golden("population", ".pop"), 3000, [DocumentError], (bytes) => {
    const members = decodePopulation(bytes.slice().buffer, { first: 512, count: 256 }, "it");
    expect(members.length * 28).toBeLessThanOrEqual(bytes.length);
    for (const { object, scale, worldFromObject, recipe } of members) {
      expect(object >= 512 && object < 768 && scale > 0 && recipe.rules.file.bytes >= 0).toBe(true);
      expect(worldFromObject.every(Number.isFinite)).toBe(true);
    }
    return size(members.length);
  });
});

it("smooth LODs, and what an eye sees of them", () => {
  const most_bytes = 2 ** 24;
  run(golden("smooth", ".slod"), 800, [], (bytes) => {
    const decoder = new SmoothDecoder(most_bytes);
    const cut = Math.floor(((bytes.at(-1) ?? 0) * bytes.length) / 256);
    let message = "";
    try {
      decoder.push(bytes.subarray(0, cut));
      decoder.push(bytes.subarray(cut));
    } catch (error) {
      expect(error).toBeInstanceOf(SmoothError);
      message = (error as Error).message.replaceAll(/[0-9]+/g, "");
    }
    expect(decoder.stateBytes).toBeLessThan(most_bytes);
    const { triangles, twicePositions } = latticeOf(decoder);
    const { header } = decoder;
    expect(triangles.length / 3).toBeLessThanOrEqual(header?.triangles ?? 0);
    expect(twicePositions.length / 3).toBeLessThanOrEqual(Math.max(header?.vertices ?? 0, 1));
    expect(twicePositions.every((x) => x >= 0 && x < 2 ** ((header?.bits ?? 0) + 1))).toBe(true);
    for (let i = 0; i < triangles.length; i += 3) {
      const [a, b, c] = triangles.subarray(i, i + 3);
      expect(a !== b && b !== c && c !== a).toBe(true);
    }
    const selection = new Selection(new ClusterTree(decoder), 3);
    const view = {
      eye: [0.5, 1, 2] as const,
      planes: [[0, 0, -1, 2] as const],
      pixels: 500,
      mostError_px: 2,
      outside: 8,
    };
    selection.update(view, 2000);
    for (const drawn of [snapshotOf(decoder), selection.snapshot(decoder)]) {
      const count = drawn.positions.length / 3;
      expect(drawn.indices.every((corners) => corners.every((corner) => corner < count))).toBe(true);
      expect(drawn.positions.every(Number.isFinite)).toBe(true);
    }
    return `${message} ${size(decoder.triangles)}`;
  });
  expect(readHeader(new Uint8Array(0))).toBeUndefined();
});

it("rules", () => {
  const limits = { ...LIMITS, steps: 20_000, triangles: 5_000, placements: 2_000, parts: 200 };
  const imported = "function double(x) = 2 * x\nrule part { box(1, 1, 1) }\n";
  run(golden("procedural", ".dcg"), 800, [DcgError], (bytes) => {
    const grown = grow(
      readProgram("any.dcg", textOf(bytes), () => imported),
      { limits },
    );
    return size(grown.parts.length);
  });
});
