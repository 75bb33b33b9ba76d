import { describe, expect, it } from "vitest";
import { explore, type SetUp } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import { IncompleteIndexError } from "../atlas/objects.ts";
import type { Vec3 } from "../basics/geometry.ts";

const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];

type Kind = "objects" | "models";

/** The chunk of the index that tells of an object or a model. */
function chunkOf(files: Files, kind: Kind, id: string): string {
  const found = [...files].find(([path, bytes]) => {
    if (!path.endsWith(".json")) return false;
    const { [kind]: told, start, format } = JSON.parse(new TextDecoder().decode(bytes));
    if (start || format || !told) return false;
    return Array.isArray(told) ? told.some(({ object }) => object === id) : Object.hasOwn(told, id);
  });
  return found?.[0] ?? expect.fail(`no chunk tells of ${id}`);
}

/** Somebody in a room, the first unless said, of a tree from which a file is gone, or answered with a status. */
async function without(kind: Kind, id: string, how: "gone" | "damaged" | 500, options: SetUp = {}, at = 0) {
  let lost = "";
  let bytes = new Uint8Array();
  const spoil = (files: Files) => {
    lost = chunkOf(files, kind, id);
    bytes = new Uint8Array(files.get(lost) ?? []);
    if (how === "gone") files.delete(lost);
    if (how === "damaged") files.set(lost, bytes.slice(1));
  };
  const answer = (path: string) => (how === 500 && path === lost ? new Response("", { status: 500 }) : undefined);
  const explored = await explore({ perChunk: 2, ...options, spoil, answer });
  explored.go(room(at));
  await explored.quiet();
  return { ...explored, lost, restore: () => explored.files.set(lost, bytes) };
}

describe("where a chunk of the index is lost, all else is shown that can be seen", () => {
  it.each([
    ["objects", "o0", "gone"],
    ["objects", "o0", "damaged"],
    ["objects", "o0", 500],
    ["models", "m5", "gone"],
    ["models", "m5", "damaged"],
    ["models", "m5", 500],
  ] as const)("of %s, that of %s, which is %s", async (kind, id, how) => {
    const whole = await explore({ perChunk: 2 });
    whole.go(room(0));
    await whole.quiet();
    const { explorer, problems } = await without(kind, id, how);
    const { visible, missing, holes } = explorer;
    const lost = whole.explorer.visible.length - visible.length;
    expect([lost, missing, holes]).toEqual([expect.any(Number), lost, 0]);
    expect(lost).toBeGreaterThan(0);
    expect(lost).toBeLessThan(whole.explorer.visible.length / 2);
    // As fine as where nothing is lost, and what is next door is learnt as well.
    for (const { model } of visible) {
      expect(explorer.models.of(model.model).held).toEqual(whole.explorer.models.of(model.model).held);
    }
    expect(explorer.recordOf(1)?.cell).toBe(1);
    expect(problems).toEqual([expect.any(IncompleteIndexError)]);
    expect(explorer.notes).toEqual([expect.stringContaining("some objects cannot be shown")]);
    explorer.close();
  });

  it("it is asked for once, until one tries again", async () => {
    const { explorer, lost, requests, restore, go, quiet } = await without("objects", "o0", "gone");
    const asked = () => requests.filter((path) => path === lost).length;
    go(room(1));
    await quiet();
    go(room(0));
    await quiet();
    expect([asked(), explorer.settled]).toEqual([1, false]);
    restore();
    explorer.retry();
    await quiet();
    expect([asked(), explorer.settled, explorer.missing, explorer.notes]).toEqual([2, true, 0, []]);
    explorer.close();
  });

  it("the start of the cell where one is says the same", async () => {
    const { explorer, go, quiet } = await without("objects", "o0", "gone", { started: true }, 1);
    expect(explorer.missing).toBeGreaterThan(0);
    go(room(0));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0 });
    explorer.close();
  });

  it("of a page of the index, too", async () => {
    const spoil = (files: Files) => {
      const pointer = JSON.parse(new TextDecoder().decode(files.get("/v1/scenes/rooms/index.json")));
      const { objects } = JSON.parse(new TextDecoder().decode(files.get(pointer.manifest)));
      const [, page] = objects.entries;
      expect(page.kind).toBe("page");
      files.delete(page.url);
    };
    const { explorer, go, quiet } = await explore({ rooms: 12, perChunk: 2, spoil });
    for (let i = 0; i < 12; i += 1) {
      go(room(i));
      await quiet();
      expect(explorer.visible.length, `in room ${i}`).toBeGreaterThan(0);
      expect(explorer.holes).toBe(0);
    }
    explorer.close();
  });
});

it("a level that is lost alone comes out of its pack", async () => {
  const isLevel = (path: string) => path.endsWith(".glb");
  const spoil = (files: Files) => {
    for (const path of [...files.keys()]) if (isLevel(path)) files.delete(path);
  };
  // Nothing is worth a pack where a request costs nothing.
  const { explorer, requests, go, quiet } = await explore({ packed: true, rooms: 2, spoil });
  go(room(0));
  await quiet();
  expect(requests.some((path) => path.endsWith(".pack"))).toBe(true);
  const without = explorer.visible.filter(({ model }) => !explorer.holds(model.model));
  expect(without.filter(({ model }) => model.levels.at(-1)?.pack)).toEqual([]);
  explorer.close();
});

it("a record that is lost is made of that of the cell next door, and the step from there", async () => {
  const { explorer, files, problems, scene, go, quiet } = await explore({ rooms: 6 });
  go(room(0));
  await quiet();
  const before = (await explorer.record(2)).opvs.length;
  explorer.close();
  const other = await explore({ rooms: 6, spoil: (spoilt) => void spoilt.delete(pathOf(files)) });
  other.go(room(1));
  await other.quiet();
  expect(other.explorer).toMatchObject({ cellId: 2, settled: true, missing: 0 });
  expect(other.explorer.recordOf(2)?.opvs.length).toBe(before);
  expect([other.problems, problems]).toEqual([[], []]);
  other.explorer.close();

  function pathOf(published: Files): string {
    const entry = explorer.entryOf(2)?.record ?? "";
    expect(published.has(entry), scene.manifest.title).toBe(true);
    return entry;
  }
});
