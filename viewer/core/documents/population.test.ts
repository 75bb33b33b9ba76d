import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { encodePopulation } from "../../test/encode.ts";
import { Json } from "../basics/json.ts";
import { decodePopulation } from "./population.ts";
import { readRules } from "./rulesdocument.ts";

/** A population as the tests in Rust wrote it, and what they read of it. */
const GOLDEN = join(import.meta.dirname, "../../../tests/golden/population");
const RUN = { first: 512, count: 256 };

interface Told {
  readonly object: string;
  readonly model: string;
  readonly triangles: number;
  readonly scale: number;
  readonly transform: readonly number[];
  readonly procedural: object;
}

const file = readFileSync(join(GOLDEN, "village.pop"));
const village = new Uint8Array(file).buffer;
const decode = (bytes: ArrayBuffer | Uint8Array, run = RUN) =>
  decodePopulation(bytes instanceof Uint8Array ? new Uint8Array(bytes).buffer : bytes, run, "it");

/** The village with another head. */
function withHead(
  change: (head: { count: number; origin: number[]; recipes: { rules: number }[] }) => void,
): Uint8Array {
  const length = new DataView(village).getUint32(8, true);
  const head = JSON.parse(file.toString("utf8", 12, 12 + length));
  change(head);
  const bytes = Buffer.from(JSON.stringify(head).padEnd(length + 40));
  const front = Buffer.from(file.subarray(0, 12));
  front.writeUint32LE(bytes.length, 8);
  return Buffer.concat([front, bytes, file.subarray(12 + length)]);
}

describe("a population", () => {
  it("says what it says in Rust", () => {
    const told = JSON.parse(readFileSync(join(GOLDEN, "village.json"), "utf8")) as { members: Told[] };
    const members = decode(village);
    expect(members.length).toBe(4);
    expect(members.length).toBe(told.members.length);
    for (const [i, { object, recipe, scale, worldFromObject }] of members.entries()) {
      const { transform, triangles, procedural, ...others } = told.members[i] as Told;
      expect({ object: `o${object}`, model: `m${recipe.model}`, scale }).toEqual(others);
      const finest = { triangles, geometricError: 0 };
      expect(recipe.rules).toEqual(readRules(Json.parse(JSON.stringify(procedural), "it"), finest));
      for (const [j, x] of worldFromObject.entries()) expect(x).toBeCloseTo(transform[j] ?? Number.NaN, 9);
    }
    expect(members[0]?.recipe).toBe(members[3]?.recipe);
  });

  it("is refused when it is cut, goes on, or claims to be longer or something else", () => {
    for (let end = 0; end < village.byteLength; end += 1)
      expect(() => decode(village.slice(0, end)), `${end}`).toThrow();
    expect(() => decode(village.slice(0, -1))).toThrow(`it should be ${village.byteLength} bytes long`);
    expect(() => decode(Buffer.concat([file, Buffer.of(0)]))).toThrow("bytes long, and not");
    expect(() => decode(withHead((head) => (head.count = 2 ** 40)))).toThrow("bytes long, and not");
    expect(() => decode(withHead((head) => (head.count = -1)))).toThrow("it.count");
    expect(() => decode(Buffer.concat([Buffer.from("BVPA"), file.subarray(4)]))).toThrow("a population of version 1");
    expect(() => decode(Buffer.concat([file.subarray(0, 4), Buffer.of(2), file.subarray(5)]))).toThrow("version 1");
    const longHead = Buffer.from(file);
    longHead.writeUint32LE(0xffff_ffff, 8);
    expect(() => decode(longHead)).toThrow("it should be 4294967307 bytes long");
  });

  it("is refused where a member or a recipe is not sound", () => {
    expect(() => decode(withHead(({ recipes }) => ((recipes[1] ?? { rules: 0 }).rules = 2)))).toThrow("list of rules");
    expect(() => decode(withHead(({ recipes }) => recipes.pop()))).toThrow("member 1 should be");
    expect(() => decode(village, { first: 512, count: 255 })).toThrow("member 3 should be");
    const member = { object: 9, recipe: 0, position: [1, 2, 3], rotation: [0, 0, 0, 1], scale: 1 };
    const url = `/o/${"0".repeat(64)}.dcg`;
    const of = (...changes: Partial<typeof member>[]) =>
      decode(
        encodePopulation(
          {
            rules: [{ url, bytes: 1 }],
            recipes: [{ rules: 0, parameters: {}, model: "m0", triangles: 1 }],
            members: changes.map((change) => ({ ...member, ...change })),
          },
          5,
        ),
        { first: 5, count: 64 },
      );
    expect(of({}, { object: 10 }).map(({ object }) => object)).toEqual([9, 10]);
    expect(of()).toEqual([]);
    for (const wrong of [{ scale: 0 }, { scale: Number.NaN }, { scale: -1 }, { rotation: [0, 0, 0, 0] }]) {
      expect(() => of(wrong), JSON.stringify(wrong)).toThrow("member 0 should be");
    }
    expect(() => of({}, {})).toThrow("member 1 should be");
  });
});
