import { Group } from "three";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { FileRef } from "../core/documents/documents.ts";
import type { Impostor } from "../core/documents/impostordocument.ts";
import { keyOf, Wardrobe } from "./wardrobe.ts";

/** Pictures that are decoded and not closed. */
let decoded = 0;

beforeEach(() => {
  decoded = 0;
  vi.spyOn(console, "warn").mockImplementation(() => {});
  vi.stubGlobal("createImageBitmap", async () => {
    decoded += 1;
    const close = () => {
      decoded -= 1;
    };
    return { width: 4, height: 4, close };
  });
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

const model = (i: number): Impostor => ({
  colour: { url: `/o/c${i}.png`, bytes: 9 },
  shape: { url: `/o/s${i}.png`, bytes: 9 },
  mapping: "octahedral",
  views: 6,
  size_px: 32,
  centre: [0, 1, 0],
  radius: 1,
  geometricError: 0.1,
  frames: 1,
  stride: 0,
});

/** A wardrobe whose files come unless they are lost. */
function wardrobe() {
  const asked: string[] = [];
  const lost = new Set<string>();
  const fetch = async ({ url }: FileRef) => {
    asked.push(url);
    if (lost.has(url)) throw new Error(`${url} is not there`);
    return new ArrayBuffer(9);
  };
  const clothes = new Wardrobe(new Group(), { fetch, prepare: async () => {} }, () => {});
  /** Whether each of them is drawn, once all has come that is on its way. */
  const look = async (...worn: Impostor[]) => {
    clothes.wear(new Set(worn.map(keyOf)));
    for (const impostor of worn) clothes.has(impostor);
    await new Promise((done) => setTimeout(done));
    return worn.map((impostor) => clothes.has(impostor));
  };
  return { asked, lost, look };
}

const models = (from: number, count: number) => Array.from({ length: count }, (_, i) => model(from + i));

it("has places for so many models at once, and gives those of models that nobody wears to others", async () => {
  const { look } = wardrobe();
  expect(await look(...models(0, 17))).toEqual([...Array(16).fill(true), false]);
  expect(decoded).toBe(32);
  expect(await look(...models(0, 15), model(17))).toEqual(Array(16).fill(true));
  expect(await look(...models(20, 16))).toEqual(Array(16).fill(true));
  expect(decoded).toBe(32);
});

it("keeps what nobody wears while there are places", async () => {
  const { asked, look } = wardrobe();
  await look(model(1));
  await look();
  expect([await look(model(1)), asked.length]).toEqual([[true], 2]);
});

it("what cannot be had takes no place, and is tried again for who comes later", async () => {
  const { asked, lost, look } = wardrobe();
  for (let i = 0; i < 16; i += 1) lost.add(model(i).shape.url);
  const many = models(0, 16);
  expect(await look(...many)).toEqual(Array(16).fill(false));
  expect(await look(...many, model(16))).toEqual([...Array(16).fill(false), true]);
  expect([asked.length, decoded]).toEqual([34, 2]);
  lost.clear();
  await look(model(16));
  expect(await look(model(3))).toEqual([true]);
});
