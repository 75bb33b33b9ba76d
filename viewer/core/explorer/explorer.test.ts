import { describe, expect, it } from "vitest";
import { explore, type SetUp } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";

const ROOM_0: Vec3 = [1, 1.6, 3];
const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];

describe("an explorer", () => {
  it("shows what the record of the eye's cell lists, complete and without a hole", async () => {
    const { explorer, problems, go, quiet } = await explore();
    go(ROOM_0);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer.cellId).toBe(0);
    const record = await explorer.record(0);
    expect(explorer.visible.length).toBe(record.lpvs.length + record.opvs.length);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    const bytes = record.visibleCoarsestBytes;
    expect(explorer.progress()).toEqual({ loaded_bytes: bytes, isAbout: false, total_bytes: bytes, bound: "exact" });
  });

  it("knows from the first moment how much it will be", async () => {
    const kinds: SetUp[] = [{ packed: true }, { smooth: true, impostor: true }, { grown: true, populated: true }];
    for (const options of kinds) {
      const { explorer, scene, go } = await explore(options);
      const told: (number | string | undefined)[][] = [];
      go(ROOM_0);
      expect(explorer.progress()).toBeUndefined();
      for (let calm = 0; calm < 5; calm = explorer.pending === 0 ? calm + 1 : 0) {
        await new Promise((resolve) => setTimeout(resolve, 1));
        const { loaded_bytes, total_bytes, bound } = explorer.progress() ?? {};
        if (total_bytes !== undefined) told.push([loaded_bytes, total_bytes, bound]);
      }
      const { visibleCoarsestBytes } = await explorer.record(0);
      expect(told.length).toBeGreaterThan(3);
      expect(new Set(told.map(([, total, bound]) => `${total} ${bound}`))).toEqual(
        new Set([`${visibleCoarsestBytes} exact`]),
      );
      const loaded = told.map(([bytes]) => Number(bytes));
      // What stands in for entries is estimated.
      if (!options.populated) expect(loaded).toEqual([...loaded].sort((a, b) => a - b));
      expect([loaded[0], loaded.at(-1)]).toEqual([0, visibleCoarsestBytes]);
      expect(scene.manifest.whole).toBeUndefined();
    }
  });

  it("has something of all that lies ahead when one gets there, in three steps", async () => {
    const { explorer, host, go, quiet } = await explore({ rooms: 12 });
    go(ROOM_0, [1.5, 0, 0]);
    await quiet();
    // The doorway ahead, and the room beyond it.
    expect([1, 2, 3, 5].map((cell) => explorer.prepares(cell))).toEqual([true, true, false, false]);
    for (const cell of [1, 2]) {
      const { lpvs, opvs } = await explorer.record(cell);
      for (const { object } of [...lpvs, ...opvs]) {
        expect(explorer.holds(explorer.placed(object)?.model.model ?? -1), `o${object}`).toBe(true);
      }
    }
    const before = host.uploads.length;
    go(room(1), [1.5, 0, 0]);
    await quiet();
    expect(host.uploads.slice(before).every(({ missing }) => missing === 0)).toBe(true);
  });

  it("refines no further than its triangles suffice", async () => {
    const sharp = await explore();
    const blunt = await explore({ most_triangles: 400 });
    for (const { go, quiet } of [sharp, blunt]) {
      go(ROOM_0);
      await quiet();
    }
    const triangles = ({ explorer }: typeof sharp) =>
      explorer.visible.reduce((sum, { model }) => sum + (explorer.models.of(model.model).held?.triangles ?? 0), 0);
    expect(sharp.explorer.refinedTo_px).toBe(1.5);
    expect(blunt.explorer.refinedTo_px).toBeGreaterThan(1.5);
    expect(triangles(blunt)).toBeLessThan(triangles(sharp));
    expect(blunt.explorer).toMatchObject({ settled: true, missing: 0 });
  });

  it("brings the coarsest level of everything before any finer one", async () => {
    const { host, go, quiet, scene } = await explore();
    go(ROOM_0);
    await quiet();
    const models = new Set(host.uploads.map(({ model }) => model));
    const firsts = host.uploads.slice(0, models.size);
    expect(new Set(firsts.map(({ model }) => model))).toEqual(models);
    const finer = host.uploads.slice(models.size);
    expect(finer.length).toBeGreaterThan(0);
    expect(finer.every(({ missing }) => missing === 0)).toBe(true);
    expect(scene.manifest.whole).toBeUndefined();
  });

  it("fetches a pack once instead of its levels, and lone levels once most of it is held", async () => {
    const { requests, explorer, host, problems, log, go, quiet } = await explore({ packed: true });
    go(ROOM_0);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    const glbs = requests.filter((path) => path.endsWith(".glb"));
    const finer = host.uploads.length - new Set(host.uploads.map(({ model }) => model)).size;
    // Two pedestals are in no pack; the balls' finer levels never are.
    expect(glbs.length).toBe(2 + finer);
    expect(requests.filter((path) => path.endsWith(".pack")).length).toBe(1);
    const reasons = log.entries.filter(({ url }) => url.endsWith(".pack")).map(({ reason }) => reason);
    expect(reasons).toEqual([expect.stringMatching(/^not here yet: a pack for \d+ models$/)]);
    go(room(1));
    await quiet();
    expect(requests.filter((path) => path.endsWith(".pack")).length).toBe(1);
    expect(explorer).toMatchObject({ settled: true, missing: 0 });
  });

  it("fetches levels alone when their pack is lost", async () => {
    const spoil = (files: Files) => {
      for (const path of [...files.keys()].filter((path) => path.endsWith(".pack"))) files.delete(path);
    };
    const { explorer, problems, go, quiet } = await explore({ packed: true, spoil });
    go(ROOM_0);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
  });

  it("fetches only what can be seen", async () => {
    const { requests, files, go, quiet } = await explore({ rooms: 12, perChunk: 4 });
    go(ROOM_0);
    await quiet();
    const chunks = requests.filter((path) => path.endsWith(".json")).length;
    const published = [...files.keys()].filter((path) => path.endsWith(".json")).length;
    expect(chunks).toBeLessThan(published / 2);
    expect(new Set(requests).size).toBe(requests.length);
  });

  it("follows the eye next door and keeps the set before in the picture until the new one is known", async () => {
    const { explorer, go, quiet, problems } = await explore();
    go(ROOM_0);
    await quiet();
    const before = explorer.visible;
    go([PITCH_M - 0.2, 1.6, 3]);
    expect(explorer.cellId).toBe(1);
    expect(explorer.visible).toBe(before);
    expect(explorer.holes).toBe(0);
    go(room(1));
    await quiet();
    expect(explorer.cellId).toBe(2);
    expect(explorer.visible.length).toBeGreaterThan(before.length);
    expect(problems).toEqual([]);
  });

  it("knows the records next door before the eye gets there", async () => {
    const { requests, explorer, go, quiet } = await explore();
    go(ROOM_0);
    await quiet();
    const before = requests.filter((path) => path.endsWith(".cell")).length;
    await explorer.record(1);
    expect(requests.filter((path) => path.endsWith(".cell")).length).toBe(before);
    expect(explorer.cell(1)?.portals?.map(({ to }) => to)).toEqual([0, 2]);
  });

  const fetched = (requests: readonly string[], ext: string) => requests.filter((path) => path.endsWith(ext)).length;

  it("learns what is next door by steps, one request for all neighbours, and the same as from their records", async () => {
    const { explorer, requests, problems, go, quiet } = await explore();
    go(room(2));
    await quiet();
    expect([fetched(requests, ".cell"), fetched(requests, ".steps")]).toEqual([1, 1]);
    const apart = await explore({
      spoil: (all) => {
        for (const path of [...all.keys()].filter((name) => name.endsWith(".steps"))) all.delete(path);
      },
    });
    apart.go(room(2));
    await apart.quiet();
    expect(fetched(apart.requests, ".cell")).toBe(3);
    for (const cell of [3, 4, 5]) expect(await explorer.record(cell)).toEqual(await apart.explorer.record(cell));
    expect([problems, apart.problems]).toEqual([[], []]);
    for (let x = 2 * PITCH_M; x < 3 * PITCH_M + 2; x += 0.5) {
      go([x, 1.6, 3]);
      await quiet();
    }
    expect(explorer.cellId).toBe(6);
    expect(new Set(requests).size).toBe(requests.length);
  });

  it("finds a cell after a jump, and the nearest one outside", async () => {
    const { explorer, go, quiet } = await explore();
    go(ROOM_0);
    await quiet();
    go(room(5));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 10, inside: true, settled: true });
    go([-4, 1.6, 3]);
    await quiet();
    expect(explorer).toMatchObject({ cellId: 0, inside: false });
  });

  describe("under a hard memory limit", () => {
    /** Walks to the last of twelve rooms, and to and fro at the end; answers what was fetched and the most memory that was ever taken. */
    async function toAndFro(memory_limit_bytes: number) {
      const { explorer, host, requests, go, quiet, problems } = await explore({ memory_limit_bytes, rooms: 12 });
      let most_bytes = 0;
      for (const i of [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 10, 9, 8, 9, 10, 11, 10, 9, 8]) {
        go(room(i));
        await quiet();
        most_bytes = Math.max(most_bytes, explorer.residency.bytes);
        expect(explorer).toMatchObject({ holes: 0 });
      }
      const levels = requests.filter((path) => path.endsWith(".glb"));
      const again = levels.length - new Set(levels).size;
      return { explorer, host, problems, most_bytes, again };
    }

    it("frees what is far away, keeps to the limit and fetches nothing again that it could have kept", async () => {
      const free = await toAndFro(1e9);
      const limit_bytes = Math.round(free.most_bytes * 0.3);
      const tight = await toAndFro(limit_bytes);
      expect(tight.most_bytes).toBeLessThanOrEqual(limit_bytes);
      expect(tight.host.evicted).not.toEqual([]);
      expect([tight.explorer.missing, tight.problems, tight.again]).toEqual([0, [], 0]);
    });

    it("draws more coarsely what came finer before anything is missing, and fetches none of it again", async () => {
      // The balls' finest level fits beside what is coarsest in ten rooms, and not in eleven.
      const { explorer, host, problems, requests, go, quiet } = await explore({ memory_limit_bytes: 101e3, rooms: 16 });
      const finest: number[] = [];
      for (let i = 0; i <= 10; i += 1) {
        go(room(i));
        await quiet();
        expect(explorer).toMatchObject({ missing: 0, holes: 0, settled: true });
        finest.push(host.details.size);
      }
      expect(finest).toEqual([...Array(10).fill(1), 0]);
      expect([host.evicted, host.blunted, problems]).toEqual([[], [3], []]);
      expect(explorer.models.of(3).held).toEqual(explorer.residency.base(3)?.grade);
      expect(new Set(requests).size).toBe(requests.length);
    });

    it("says so when not even the coarsest levels fit, and goes on with what does", async () => {
      const { explorer, problems } = await toAndFro(1);
      expect(problems.map(String)).toContainEqual(expect.stringContaining("does not fit"));
      expect(explorer.residency.bytes).toBeLessThanOrEqual(1);
    });
  });

  it("neither shows nor fetches what a closed door hides, and brings it when the door opens", async () => {
    const { explorer, go, quiet } = await explore({ doored: true });
    const shown = () => explorer.visible.map(({ entry }) => entry.object).sort((a, b) => a - b);
    go(room(2));
    await quiet();
    const all = shown();
    const record = await explorer.record(4);
    const [door] = explorer.doors;
    const behind = record.opvs.filter(({ doors }) => doors.includes(door ?? -1)).map(({ object }) => object);
    expect(behind.length).toBeGreaterThan(3);
    explorer.shutExactly(new Set([door ?? -1]));
    await quiet();
    expect(shown()).toEqual(all.filter((object) => !behind.includes(object)));
    expect(explorer).toMatchObject({ missing: 0, holes: 0 });
    explorer.shutExactly(new Set());
    await quiet();
    expect(shown()).toEqual(all);
  });

  it("treats every object of a small world as visible", async () => {
    const { explorer, requests, go, quiet, scene } = await explore({ whole: true });
    go(ROOM_0);
    await quiet();
    expect(explorer.visible.length).toBe(scene.manifest.counts.objects);
    expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0, holes: 0 });
    const cells = requests.length;
    go(room(1));
    await quiet();
    expect(explorer.cellId).toBe(2);
    expect(explorer.visible.length).toBe(scene.manifest.counts.objects);
    expect(requests.length).toBeGreaterThanOrEqual(cells);
  });

  it("draws a coarser or finer level where one is damaged, says so, and recovers on retry", async () => {
    const kept = new Map<string, Uint8Array>();
    const { explorer, problems, files, go, quiet } = await explore({
      spoil: (all) => {
        const balls = [...all].filter(([path]) => path.endsWith(".glb")).sort(([, a], [, b]) => b.length - a.length);
        for (const [path, bytes] of balls.slice(0, 1)) {
          kept.set(path, bytes);
          all.set(path, bytes.slice(1));
        }
      },
    });
    go(ROOM_0);
    await quiet();
    expect(explorer).toMatchObject({ missing: 0, holes: 0, settled: true });
    expect(problems.map(String)).toEqual([expect.stringMatching(/does not hold the bytes/)]);
    for (const [path, bytes] of kept) files.set(path, bytes);
    const before = problems.length;
    explorer.retry();
    await quiet();
    expect(problems.length).toBe(before);
    expect(explorer.residency.grades()).not.toHaveProperty("1");
  });

  it("reports a record that is missing and goes on when it is back", async () => {
    const lost = new Map<string, Uint8Array>();
    const { explorer, problems, files, go, quiet } = await explore({
      spoil: (all) => {
        for (const [path, bytes] of [...all].filter(([name]) => name.endsWith(".cell"))) {
          lost.set(path, bytes);
          all.delete(path);
        }
      },
    });
    go(ROOM_0);
    await quiet();
    expect(problems.length).toBe(1);
    expect(explorer.recordOf(0)).toBeUndefined();
    for (const [path, bytes] of lost) files.set(path, bytes);
    explorer.retry();
    await quiet();
    expect(explorer.settled).toBe(true);
  });

  it("stops everything when it is closed", async () => {
    const { explorer, host, go, quiet } = await explore();
    go(ROOM_0);
    explorer.close();
    await quiet();
    expect(host.uploads).toEqual([]);
  });
});

describe("impostors", () => {
  const BALLS = 3;
  const balls = ({ explorer }: Awaited<ReturnType<typeof explore>>) =>
    explorer.visible.filter(({ model }) => model.model === BALLS).map(({ entry }) => entry.object);

  it("are drawn from far away, and where one comes near only there the mesh instead", async () => {
    const set = await explore({ impostor: true, whole: true });
    const { explorer, host, problems, go, quiet } = set;
    go([0, 1.6, 500]);
    await quiet();
    expect(host.pictured).toEqual(new Set([BALLS]));
    expect(host.uploads.map(({ model }) => model)).not.toContain(BALLS);
    expect([...host.far].sort()).toEqual(balls(set).sort());
    expect([explorer.holes, explorer.missing, explorer.quality()?.sharp]).toEqual([0, 0, 1]);
    const { bounds, object } = explorer.visible.find(({ model }) => model.model === BALLS)?.entry ?? {};
    go([(bounds?.min[0] ?? 0) - 0.1, bounds?.min[1] ?? 0, bounds?.min[2] ?? 0]);
    await quiet();
    expect(host.uploads.map(({ model }) => model)).toContain(BALLS);
    expect(host.far.has(object ?? -1)).toBe(false);
    expect([explorer.holes, problems]).toEqual([0, []]);
    expect(explorer.models.of(BALLS)).toMatchObject({ hasImpostor: true, held: { kind: "level" } });
  });

  it("are done without when a picture is lost, which is told once", async () => {
    const lost = (files: Map<string, unknown>) => {
      for (const [url, bytes] of files) {
        if (url.endsWith(".png") && new TextDecoder().decode(bytes as Uint8Array).includes("shape")) files.delete(url);
      }
    };
    const { explorer, host, problems, go, quiet } = await explore({ impostor: true, whole: true, spoil: lost });
    go([0, 1.6, 500]);
    await quiet();
    expect(host.pictured.size).toBe(0);
    expect(host.uploads.map(({ model }) => model)).toContain(BALLS);
    expect([explorer.holes, explorer.missing, problems.length]).toEqual([0, 0, 1]);
  });
});
