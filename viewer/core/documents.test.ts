import { describe, expect, it } from "vitest";
import { publish } from "../test/fixture.ts";
import { readManifest, readPage, readPointer } from "./documents.ts";
import { DocumentError, denseId, Json } from "./json.ts";
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

  it("hold ids only in their one spelling", () => {
    expect(denseId("c", "c12")).toBe(12);
    for (const text of ["", "c", "o1", "c01", "c-1", "c4294967296", "c1 ", "C1", "c1.0"]) {
      expect(denseId("c", text), text).toBeUndefined();
    }
  });
});
