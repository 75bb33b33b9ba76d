import { describe, expect, it } from "vitest";
import { explore, HereGrowing, type SetUp } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { Seedling } from "../models/growing.ts";

const NEAR: Vec3 = [1.5, 0.5, 2.4];
const BALL = 3;
const POPULATED: SetUp = { grown: true, populated: true };

const starting = (files: Files, ...beginnings: string[]) =>
  [...files].filter(([, bytes]) => beginnings.some((beginning) => Buffer.from(bytes).toString().startsWith(beginning)));
const endingOn = (files: Files, ending: string) => [...files].filter(([path]) => path.endsWith(ending));
const asked = (requests: readonly string[], ending: string) => requests.filter((path) => path.endsWith(ending)).length;
const balls = ({ explorer }: Awaited<ReturnType<typeof explore>>) =>
  explorer.visible.filter(({ model }) => model.model === BALL);

describe("what stands for an object", () => {
  it("is in the picture before its entry is here, which then takes its place without growing it again", async () => {
    const late: Files = new Map();
    const spoil = (files: Files) => {
      for (const [path, bytes] of starting(files, '{"objects"', '{"models"')) {
        late.set(path, bytes);
        files.delete(path);
      }
    };
    const set = await explore({ ...POPULATED, spoil });
    const { explorer, host, files, problems, requests, go, quiet } = set;
    go(NEAR);
    await quiet();
    const stood = balls(set);
    expect(stood.length).toBeGreaterThan(2);
    expect(explorer.visible).toEqual(stood);
    expect(stood.every(({ entry }) => host.draws(entry.object))).toBe(true);
    expect(host.uploads.map(({ model }) => model)).toEqual([BALL]);
    const record = await explorer.record(0);
    const count = record.lpvs.length + record.opvs.length;
    expect(explorer).toMatchObject({ settled: false, holes: 0, visibleCount: count, missing: count - stood.length });
    expect(explorer.quality()?.here).toBeCloseTo(stood.length / count);
    expect(problems.length).toBe(1);
    for (const [path, bytes] of late) files.set(path, bytes);
    explorer.retry();
    await quiet();
    expect(problems.length).toBe(1);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0, visibleCount: count });
    expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
    expect(host.uploads.filter(({ model }) => model === BALL).length).toBe(1);
    expect(asked(requests, ".pop")).toBe(1);
    for (const [i, { entry, model }] of balls(set).entries()) {
      expect([entry.sourceNode, model.levels.length]).toEqual([expect.stringMatching(/ball/), 3]);
      expect(explorer.placed(entry.object)?.entry).toBe(entry);
      const roughly = stood[i]?.entry;
      expect([roughly?.object, roughly?.scale]).toEqual([entry.object, entry.scale]);
      for (const [j, x] of entry.worldFromObject.entries()) expect(roughly?.worldFromObject[j]).toBeCloseTo(x, 5);
    }
  });

  it("goes on growing when its entry comes meanwhile", async () => {
    let grow: () => void = () => {};
    const entriesAreHere = new Promise<void>((resolve) => {
      grow = resolve;
    });
    let grown = 0;
    class SlowGrowing extends HereGrowing {
      override async grow(seedling: Seedling): Promise<ArrayBuffer> {
        grown += 1;
        await entriesAreHere;
        return super.grow(seedling);
      }
    }
    const { explorer, go, quiet } = await explore({ ...POPULATED, growing: new SlowGrowing() });
    go(NEAR);
    const ball = () => explorer.visible.find(({ model }) => model.model === BALL);
    await expect.poll(() => ball()?.model.levels.length).toBe(3);
    grow();
    await quiet();
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(explorer.residency.grades()).toHaveProperty("g0", 1);
    expect(grown).toBe(1);
  });

  it("comes before the entries, of which those come last that something stands for", async () => {
    const { explorer, requests, files, problems, go, quiet } = await explore({ ...POPULATED, perChunk: 2 });
    go(NEAR);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    const at = (path: string | undefined) => requests.indexOf(path ?? "");
    const population = at(requests.find((path) => path.endsWith(".pop")));
    const chunks = starting(files, '{"objects"', '{"models"').map(([path]) => at(path));
    expect(population).toBeGreaterThan(0);
    expect(chunks.filter((i) => i >= 0).length).toBeGreaterThan(3);
    expect(chunks.every((i) => i < 0 || i > population)).toBe(true);
    expect(explorer.visible.every(({ entry, model }) => entry.sourceNode !== "" && model.levels.length > 0)).toBe(true);
    const entries = starting(files, '{"objects"').filter(([path]) => at(path) >= 0);
    const last = entries.sort(([a], [b]) => at(a) - at(b)).at(-1)?.[1];
    const { objects } = JSON.parse(Buffer.from(last ?? []).toString()) as { objects: { model: string }[] };
    expect(objects.map(({ model }) => model)).toEqual([`m${BALL}`, `m${BALL}`]);
    expect(new Set(requests).size).toBe(requests.length);
  });

  it("is done without where populations are damaged, lost or of no use, and a note says why", async () => {
    const damages: [(bytes: Uint8Array, path: string, files: Files) => void, RegExp][] = [
      [(bytes, path, files) => files.set(path, bytes.slice(1)), /does not hold the bytes/],
      [(_, path, files) => files.delete(path), /404/],
    ];
    for (const [damage, why] of damages) {
      const spoil = (files: Files) => {
        for (const [path, bytes] of endingOn(files, ".pop")) damage(bytes, path, files);
      };
      const { explorer, problems, go, quiet } = await explore({ ...POPULATED, spoil });
      go(NEAR);
      await quiet();
      expect(problems).toEqual([]);
      expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
      expect(explorer.notes).toEqual([expect.stringMatching(why)]);
      go([PITCH_M + 1, 1.6, 3]);
      await quiet();
      expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
      explorer.retry();
      expect(explorer.notes).toEqual([]);
    }
  });

  it("gives way to entries where its rules are lost", async () => {
    const spoil = (files: Files) => {
      for (const [path] of endingOn(files, ".dcg")) files.delete(path);
    };
    const { explorer, problems, go, quiet } = await explore({ ...POPULATED, spoil });
    go(NEAR);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(explorer.residency.grades()).not.toHaveProperty("g0");
  });

  it("is not asked for without rules, nor where it costs more than it saves", async () => {
    for (const set of [
      { uses: { rules: false } },
      { perChunk: 64, request_bytes: 4096 },
      { whole: true },
      { populated: false },
    ]) {
      const { explorer, requests, problems, go, quiet } = await explore({ ...POPULATED, ...set });
      go(NEAR);
      await quiet();
      expect(problems).toEqual([]);
      expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
      expect(asked(requests, ".pop"), JSON.stringify(set)).toBe(0);
    }
  });
});
