import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { explore, type SetUp } from "../../test/explore.ts";
import { PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";

const ROOM_0: Vec3 = [1, 1.6, 3];
const MINUTE_MS = 60_000;

// Time goes on as it does, and further when it is told to.
beforeEach(() => void vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"], shouldAdvanceTime: true }));
afterEach(() => void vi.useRealTimers());

/** An explorer of rooms whose server answers some paths with a status while it is out of order. */
async function outOfOrder(isOut: (path: string) => boolean, options: SetUp = {}, status = 503) {
  const outage = { over: true };
  let refused = 0;
  const answer = (path: string) => {
    if (outage.over || !isOut(path)) return undefined;
    refused += 1;
    return new Response("", { status });
  };
  const explored = await explore({ ...options, answer });
  const { explorer, requests } = explored;
  /** Waits until something was refused and no request has begun for a while. */
  const still = async () => {
    await vi.waitFor(() => expect(refused).toBeGreaterThan(0));
    for (let before = -1; before !== requests.length; ) {
      before = requests.length;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  };
  /** Ends it, and waits until nothing is on its way any more. */
  const heal = async () => {
    outage.over = true;
    for (let calm = 0; calm < 20; ) {
      vi.advanceTimersByTime(1000);
      await new Promise((resolve) => setTimeout(resolve, 2));
      calm = explorer.pending === 0 ? calm + 1 : 0;
    }
  };
  outage.over = false;
  return { ...explored, outage, still, heal, close: () => explorer.close() };
}

const isModel = (path: string) => /\.(glb|pack)$/.test(path);

describe("what failed while the server was out of order", () => {
  it.each([
    ["models", isModel, {}],
    ["models in packs", isModel, { packed: true }],
    ["smooth LODs", (path: string) => path.endsWith(".slod"), { smooth: true }],
    ["pictures", (path: string) => path.endsWith(".webp") || path.endsWith(".png"), { impostor: true }],
    ["everything", () => true, {}],
    ["all objects", (path: string) => path.includes("/o/"), { packed: true, bundles: true }],
  ] as const)("comes by itself when it is well again: %s", async (_, isOut, options) => {
    const well = await explore(options);
    well.go(ROOM_0);
    await well.quiet();
    const { explorer, problems, told, still, heal, go, close } = await outOfOrder(isOut, options);
    go(ROOM_0);
    await still();
    expect(told).toEqual([]);
    await heal();
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0, notes: [] });
    for (const { model } of well.explorer.visible) {
      const { geometricError = 1 } = explorer.models.of(model.model).held ?? {};
      expect(geometricError).toBeLessThan(0.01);
    }
    // Levels stand in for smooth LODs, so nobody was told of a problem.
    expect(told.length > 0).toBe(problems.length > 0);
    close();
  });

  it("comes at once when something else is answered well", async () => {
    const { explorer, outage, told, still, go, quiet, close } = await outOfOrder(isModel, { rooms: 24, perChunk: 2 });
    go(ROOM_0);
    await still();
    expect(explorer.missing).toBeGreaterThan(0);
    // It has just been tried, so the next pause is one that this test does not wait for.
    for (const _ of [1, 2, 3, 4]) {
      vi.advanceTimersByTime(1.2 * MINUTE_MS);
      await still();
    }
    outage.over = true;
    go([20 * PITCH_M + 1, 1.6, 3]);
    await quiet();
    expect(explorer).toMatchObject({ cellId: 40, settled: true, missing: 0 });
    expect(told).toContain("answered");
    close();
  });

  it("is asked for once at each try, however much is wanted, and however long it takes", async () => {
    const { requests, still, heal, explorer, go, close } = await outOfOrder(() => true);
    go(ROOM_0);
    await still();
    const before = requests.length;
    for (let minute = 1; minute <= 10; minute += 1) {
      vi.advanceTimersByTime(1.2 * MINUTE_MS);
      await still();
    }
    const tries = requests.length - before;
    expect(tries).toBeGreaterThan(5);
    expect(tries).toBeLessThan(20);
    await heal();
    expect(explorer).toMatchObject({ settled: true, missing: 0 });
    close();
  });

  it("leaves what is drawn plain without its texture until that comes, and draws it once more then", async () => {
    const isTexture = (path: string) => path.endsWith(".png");
    const { explorer, host, requests, problems, outage, still, heal, go, close } = await outOfOrder(isTexture);
    go(ROOM_0);
    for (let tries = 1; tries <= 4; tries += 1) {
      await still();
      vi.advanceTimersByTime(1.2 * MINUTE_MS);
    }
    await still();
    const drawn = () => host.uploads.filter(({ model }) => model === 0).length;
    expect([explorer.missing, drawn(), host.textures.size]).toEqual([0, 1, 0]);
    expect(problems.length).toBeGreaterThan(1);
    const before = requests.filter(isModel).length;
    outage.over = true;
    vi.advanceTimersByTime(1.2 * MINUTE_MS);
    await heal();
    expect([drawn(), host.textures.size, requests.filter(isModel).length]).toEqual([2, 1, before]);
    expect(explorer.residency.base(0)).toEqual(explorer.residency.held(0));
    close();
  });

  it("stands in nobody's way when it is but one file", async () => {
    let broken: string | undefined;
    const isOut = (path: string) => {
      if (path.endsWith(".glb")) broken ??= path;
      return path === broken;
    };
    const { explorer, heal, go, still, quiet, close } = await outOfOrder(isOut);
    go(ROOM_0);
    await still();
    await quiet();
    go([3 * PITCH_M + 1, 1.6, 3]);
    await quiet();
    expect(explorer.cellId).toBe(6);
    const holdsNothing = explorer.visible.filter(({ model }) => !explorer.holds(model.model));
    expect(new Set(holdsNothing.map(({ model }) => model.model)).size).toBeLessThanOrEqual(1);
    vi.advanceTimersByTime(MINUTE_MS);
    await heal();
    expect(explorer).toMatchObject({ settled: true, missing: 0 });
    close();
  });

  it("is not asked for again when it is not there at all", async () => {
    const { requests, told, still, go, quiet, close } = await outOfOrder(isModel, {}, 404);
    go(ROOM_0);
    await still();
    await quiet();
    const models = () => requests.filter(isModel).length;
    const before = models();
    expect(before).toBeGreaterThan(0);
    vi.advanceTimersByTime(5 * MINUTE_MS);
    await quiet();
    expect([models(), told]).toEqual([before, []]);
    close();
  });
});

describe("a jump while the server is out of order", () => {
  const UNKNOWN = { settled: false, missing: undefined, visibleCount: undefined };

  /** An explorer that has all that can be seen from the first room when its server goes out of order. */
  async function settledInRoom0(rooms: number) {
    const set = await outOfOrder(() => true, { rooms, perChunk: 2 });
    set.outage.over = true;
    set.go(ROOM_0);
    await set.quiet();
    set.outage.over = false;
    return set;
  }

  it("leaves in the picture what was there where nothing is known, and tells no figures that nobody knows", async () => {
    const { explorer, go, still, heal, close } = await settledInRoom0(48);
    const before = explorer.visible;
    expect(explorer).toMatchObject({ cellId: 0, settled: true, holes: 0 });
    expect(before.length).toBeGreaterThan(0);
    const far: Vec3 = [46 * PITCH_M + 1, 1.6, 3];
    for (const target of [far, [24 * PITCH_M + 1, 1.6, 3] as Vec3, far]) {
      go(target);
      await still();
      expect(explorer).toMatchObject({ ...UNKNOWN, holes: 0 });
      expect(explorer.quality()).toBeUndefined();
      expect(explorer.visible.length).toBeGreaterThan(0);
    }
    go(ROOM_0);
    await still();
    expect(explorer, "back where all is known").toMatchObject({
      cellId: 0,
      settled: true,
      visibleCount: before.length,
    });
    expect([explorer.visible, explorer.quality()?.here]).toEqual([before, 1]);
    go(far);
    await still();
    expect(explorer).toMatchObject(UNKNOWN);
    await heal();
    expect(explorer).toMatchObject({ cellId: 92, settled: true, missing: 0 });
    expect(explorer.quality()?.here).toBe(1);
    close();
  });

  it("shows what is known around there, without saying that this is all", async () => {
    const { explorer, go, still, heal, close } = await settledInRoom0(8);
    const known = new Set(explorer.visible.map(({ entry }) => entry.object));
    go([7 * PITCH_M + 1, 1.6, 3]);
    await still();
    expect(explorer).toMatchObject(UNKNOWN);
    const shown = explorer.visible.map(({ entry }) => entry.object);
    expect([...known].filter((id) => !shown.includes(id))).toEqual([]);
    expect(explorer.quality()).toBeUndefined();
    await heal();
    expect(explorer).toMatchObject({ cellId: 14, settled: true, missing: 0 });
    close();
  });

  it("ends in the cell below who flies, once the map is there again", async () => {
    const { explorer, go, still, heal, close } = await settledInRoom0(48);
    go([24 * PITCH_M + 1, 500, 3]);
    await still();
    expect(explorer).toMatchObject(UNKNOWN);
    await heal();
    expect(explorer).toMatchObject({ cellId: 48, inside: false, settled: true, missing: 0 });
    close();
  });
});
