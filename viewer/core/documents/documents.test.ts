import { describe, expect, it } from "vitest";
import { publish } from "../../test/fixture.ts";
import { DocumentError, denseId, Json } from "../basics/json.ts";
import { readManifest, readPage, readPointer } from "./documents.ts";
import { readModelChunk } from "./modeldocument.ts";

const files = publish({ rooms: 3, whole: true });
const textOf = (path: string) => new TextDecoder().decode(files.get(path));
const pointer = readPointer(Json.parse(textOf("/v1/scenes/rooms/index.json"), "pointer"));
const manifest = JSON.parse(textOf(pointer.manifest)) as Record<string, unknown>;
const read = (value: unknown) => readManifest(new Json(value, "manifest"));

describe("published documents", () => {
  it("are read with ids as numbers", () => {
    const { whole, viewpoints, counts } = read(manifest);
    expect(viewpoints[0]?.cell).toBe(0);
    expect(viewpoints[0]?.isMadeUp).toBe(false);
    expect(whole?.objects.map(({ object }) => object)).toEqual([...Array(counts.objects).keys()]);
    expect(whole?.models.get(3)?.levels.map(({ level }) => level)).toEqual([0, 1, 2]);
  });

  it("name the place of what is wrong", () => {
    const broken = structuredClone(manifest);
    (broken.whole as { objects: { transform: unknown[] }[] }).objects[1]?.transform.pop();
    expect(() => read(broken)).toThrow("manifest.whole.objects[1].transform should be a list of 16 numbers");
    expect(() => read({ ...manifest, format: 3 })).toThrow(/manifest.format should be 4/);
    expect(() => read({ ...manifest, viewpoints: [] })).toThrow(/at least one viewpoint/);
    expect(() => Json.parse("{", "the pointer")).toThrow("the pointer should be JSON");
  });

  it("refuse every member that is missing or of another kind", () => {
    for (const key of ["format", "title", "bounds", "counts", "viewpoints", "cells", "objects", "models"]) {
      for (const value of [undefined, null, 7.5, "x", [1], { a: 1 }]) {
        if (key === "title" && value === "x") continue;
        expect(() => read({ ...manifest, [key]: value }), `${key} = ${JSON.stringify(value)}`).toThrow(DocumentError);
      }
    }
  });

  it("refuse URLs that do not name immutable objects", () => {
    for (const url of ["https://evil/o/x.json", "/o/../x", "/v1/x", `/o/${"a".repeat(63)}.glb`]) {
      const page = { entries: [{ kind: "page", url, bytes: 1, first: 0, count: 1, bounds: pointer.bounds }] };
      expect(() => readPage(new Json(page, "page")), url).toThrow(/immutable object/);
    }
  });

  it("refuse more ids than there are", () => {
    const of = (first: number, count: number) => {
      const entry = { kind: "chunk", url: `/o/${"a".repeat(64)}.json`, bytes: 1, bounds: pointer.bounds };
      return new Json({ entries: [{ ...entry, first, count }] }, "page");
    };
    expect(readPage(of(0, 2 ** 32 - 1)).entries[0]?.count).toBe(2 ** 32 - 1);
    expect(() => readPage(of(0, 2 ** 32))).toThrow("page.entries[0].count should be a whole number of 32 bits");
    expect(() => readPage(of(2 ** 40, 1))).toThrow("page.entries[0].first should be a whole number of 32 bits");
  });

  it("refuse rungs that are not slices of their stream, by their numbers", () => {
    const [a, b] = ["a", "b"].map((letter) => `/o/${letter.repeat(64)}`);
    const chunk = (...urls: string[]) => {
      const rungs = urls.map((url, i) => ({ url, from: i, to: i + 1, triangles: 1, geometric_error_m: 1 }));
      const smooth = { url: `${a}.slod`, bytes: urls.length, materials: `${a}.gltf`, materials_bytes: 1, rungs };
      const level = { level: 0, url: `${a}.glb`, bytes: 1, triangles: 1, geometric_error_m: 0 };
      return readModelChunk(new Json({ models: { m0: { levels: [level], smooth } } }, "chunk"));
    };
    expect(chunk(`${a}.r0.slod`, `${a}.r1.slod`).get(0)?.smooth?.rungs.length).toBe(2);
    expect(() => chunk(`${a}.r0.slod`, `${b}.r1.slod`)).toThrow(/slices of/);
    expect(() => chunk(`${a}.r1.slod`, `${a}.r0.slod`)).toThrow(/slices of/);
  });

  it("refuse an object whose model is not there", () => {
    const whole = structuredClone(manifest.whole) as { models: Record<string, unknown> };
    delete whole.models.m3;
    expect(() => read({ ...manifest, whole })).toThrow(/also holds m3/);
  });

  it("tell of impostors, and leave those alone that are of a kind not known here", () => {
    const picture = (letter: string) => ({ url: `/o/${letter.repeat(64)}.png`, bytes: 9 });
    const impostor = {
      colour: picture("a"),
      shape: picture("b"),
      mapping: "hemi-octahedral",
      views: 8,
      size_px: 64,
      centre: [0, 1, 0],
      radius: 2,
      error_m: 0.1,
      switch_distance_m: 94,
    };
    const readWith = (changed: object) => {
      const chunk = structuredClone(manifest.whole) as { models: Record<string, object> };
      chunk.models.m3 = { ...chunk.models.m3, impostor: { ...impostor, ...changed } };
      return readModelChunk(new Json(chunk, "chunk")).get(3)?.impostor;
    };
    expect(readWith({})).toMatchObject({ views: 8, centre: [0, 1, 0], geometricError: 0.1, colour: picture("a") });
    expect(readWith({})).toMatchObject({ frames: 1, stride: 0 });
    expect(readWith({ frames: 8, stride_m: 1.4 })).toMatchObject({ frames: 8, stride: 1.4 });
    expect(readWith({ mapping: "spherical", views: undefined })).toBeUndefined();
    for (const wrong of [
      { views: 1 },
      { views: 33 },
      { size_px: 48 },
      { size_px: 256 },
      { radius: 0 },
      { frames: 0 },
      { frames: 9 },
      { frames: 8, stride_m: "far" },
      { shape: {} },
    ]) {
      expect(() => readWith(wrong), JSON.stringify(wrong)).toThrow(DocumentError);
    }
  });

  it("refuse levels outside their packs and rungs that are not their stream", () => {
    const of = (ext: string) => `/o/${"a".repeat(64)}.${ext}`;
    const rung = (number: number, from: number, to: number) => ({
      url: of(`r${number}.slod`),
      from,
      to,
      triangles: 1,
      geometric_error_m: 0,
    });
    const readWith = (from: number, rungs: object[]) => {
      const pack = { url: of("pack"), bytes: 300, from };
      const level = { level: 0, url: of("glb"), bytes: 100, triangles: 1, geometric_error_m: 0, pack };
      const smooth = { url: of("slod"), bytes: 30, materials: of("gltf"), materials_bytes: 3, rungs };
      return readModelChunk(new Json({ models: { m3: { levels: [level], smooth } } }, "chunk")).get(3);
    };
    const rungs = [rung(0, 0, 10), rung(1, 10, 30)];
    expect(readWith(200, rungs)?.smooth?.rungs).toHaveLength(2);
    expect(() => readWith(201, rungs)).toThrow("chunk.models.m3.levels[0].pack should be a place");
    for (const wrong of [
      [],
      [rung(0, 0, 10), rung(2, 10, 30)],
      [rung(0, 0, 10), { ...rung(1, 10, 30), url: `/o/${"b".repeat(64)}.r1.slod` }],
      [rung(0, 0, 40), rung(1, 40, 30)],
      [rung(0, 0, 10), rung(1, 11, 30)],
    ]) {
      expect(() => readWith(200, wrong), JSON.stringify(wrong)).toThrow("chunk.models.m3.smooth.rungs should be");
    }
  });

  it("hold ids only in their one spelling", () => {
    expect(denseId("c", "c12")).toBe(12);
    for (const text of ["", "c", "o1", "c01", "c-1", "c4294967296", "c1 ", "C1", "c1.0"]) {
      expect(denseId("c", text), text).toBeUndefined();
    }
  });
});
