import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join as pathOf } from "node:path";
import validator from "gltf-validator";
import { describe, expect, it } from "vitest";
import { explore } from "../../test/explore.ts";
import { type Files, GOLDEN } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { Smooth } from "../documents/modeldocument.ts";
import { join } from "../fetch/transfer.ts";
import { type IsSound, verify, webCryptoDigest } from "../fetch/verify.ts";
import { readHeader } from "../smooth/header.ts";
import { type Port, SlicedDecoding, WorkerDecoding } from "./smoothdecoding.ts";
import { SmoothLods } from "./smoothlods.ts";
import { SmoothStream } from "./smoothstream.ts";

/** From afar the ball's first rung will do, from near by it takes the last. */
const [AFAR, NEAR]: [Vec3, Vec3] = [
  [5.5, 1.6, 5.5],
  [1.5, 0.5, 2.4],
];
const MATERIALS = JSON.stringify({ asset: { version: "2.0" }, materials: [{ name: "glaze" }, { name: "clay" }] });

/** The rungs of a stream that the encoder's own tests wrote. */
function rungsOf(name: string): ArrayBuffer[] {
  const bytes = new Uint8Array(readFileSync(pathOf(GOLDEN, `${name}.slod`)));
  const cuts = readHeader(bytes)?.cuts ?? [];
  return cuts.map((cut, i) => bytes.slice(cuts[i - 1]?.bytes ?? 0, cut.bytes).buffer);
}

const isBall = (path: string) => /\.r\d+\.slod$/.test(path);

describe("an explorer with smooth LODs", () => {
  it("fetches each rung once and refines what it has", async () => {
    const { explorer, host, requests, problems, scene, go, quiet } = await explore({ smooth: true });
    go(AFAR);
    await quiet();
    expect(requests.filter(isBall).length).toBe(1);
    expect(explorer.residency.grades()).toHaveProperty("r0", 1);
    expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
    go(NEAR);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    const rungs = requests.filter(isBall);
    expect(rungs.length).toBeGreaterThan(1);
    expect(new Set(rungs).size).toBe(rungs.length);
    expect(requests.filter((path) => path.endsWith(".gltf")).length).toBe(1);
    expect(explorer.residency.grades()).toHaveProperty(`r${rungs.length - 1}`, 1);
    expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
    const progress = explorer.sharpProgress();
    expect(progress?.loaded_bytes).toBe(progress?.total_bytes);
    // Rungs are verified with the last of them, and a pointer has no hash that it could be compared with.
    expect(scene.queue.tally.unverified).toBe(0);
    expect(host.uploads.filter(({ model }) => model === 3).length).toBe(2);
  });

  it.each([true, false])(
    "fetches of a tree without rungs their ranges, or once all of the stream where these are ignored: %s",
    async (ranges) => {
      const spoil = (files: Files) => {
        for (const path of [...files.keys()].filter(isBall)) files.delete(path);
      };
      const { explorer, requests, problems, scene, log, go, quiet } = await explore({ smooth: true, ranges, spoil });
      go(AFAR);
      await quiet();
      expect(explorer.residency.grades()).toHaveProperty("r0", 1);
      go(NEAR);
      await quiet();
      expect([problems, explorer.notes]).toEqual([[], []]);
      expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
      expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
      const { loaded_bytes, total_bytes } = explorer.sharpProgress() ?? {};
      expect(loaded_bytes).toBe(total_bytes);
      // Who has no rungs is not asked for them again, and nothing comes twice.
      expect(requests.filter(isBall).length).toBe(1);
      const rungs = log.entries.filter(({ url }) => isBall(url));
      const streams = requests.filter((path) => /\/[0-9a-f]{64}\.slod$/.test(path));
      expect(streams.length).toBe(ranges ? rungs.length : 1);
      expect(explorer.residency.grades()).toHaveProperty(`r${rungs.length - 1}`, 1);
      const whole = readFileSync(pathOf(GOLDEN, "bowl.slod")).length;
      expect(rungs.reduce((sum, { bytes }) => sum + bytes, 0)).toBe(whole);
      expect(rungs.map(({ result }) => result)).toEqual(rungs.map((_, i) => (ranges || i === 0 ? "done" : "kept")));
      expect(rungs[0]?.detour).toContain(ranges ? "by range" : "all of its stream");
      expect(scene.queue.tally.unverified).toBe(0);
    },
  );

  const spoilers: Record<string, (bytes: Uint8Array) => Uint8Array | undefined> = {
    "a bit of the last rung is wrong": (bytes) => bytes.map((byte, i) => (i === bytes.length - 9 ? byte ^ 4 : byte)),
    "the last rung is cut short": (bytes) => bytes.slice(0, -1),
    "the last rung is lost, and so is all of the stream": () => undefined,
  };
  it.each(Object.keys(spoilers))("falls back to levels, and says why, when %s", async (how) => {
    const kept = new Map<string, Uint8Array>();
    const spoil = (files: Files) => {
      const last = [...files.keys()].filter(isBall).sort().at(-1) ?? "";
      const bytes = files.get(last) ?? new Uint8Array();
      kept.set(last, bytes);
      const spoilt = spoilers[how]?.(bytes);
      if (spoilt) files.set(last, spoilt);
      else for (const path of [last, last.replace(/\.r\d+/, "")]) files.delete(path);
    };
    const { explorer, problems, files, go, quiet } = await explore({ smooth: true, spoil });
    go(AFAR);
    await quiet();
    expect(explorer.models.noteOf(3)).toBeUndefined();
    go(NEAR);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(explorer.models.noteOf(3)).toMatch(/slod/);
    expect(explorer.models.of(3).held?.kind).toBe("level");
    expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
    for (const [path, bytes] of kept) files.set(path, bytes);
    explorer.retry();
    await quiet();
    expect(explorer.models.noteOf(3)).toBeUndefined();
  });
});

describe("a stream", () => {
  it.each(["bowl", "cube", "plain"])(
    "of %s gives a sound GLB after each rung, and keeps nothing at its end",
    async (name) => {
      const stream = new SmoothStream(MATERIALS);
      for (const [i, rung] of rungsOf(name).entries()) {
        const taking = stream.take([rung]);
        let step = taking.next();
        while (!step.done) step = taking.next();
        const { glb, state_bytes } = step.value;
        const report = await validator.validateBytes(new Uint8Array(glb), { format: "glb" });
        expect(report.issues.messages.filter(({ severity }) => severity === 0)).toEqual([]);
        expect(state_bytes > 0).toBe(i < rungsOf(name).length - 1);
      }
    },
  );

  it("is decoded alike in a worker and in slices", async () => {
    const streams = new Map<number, SmoothStream>();
    const worker: Port = {
      onmessage: null,
      onerror: null,
      terminate: () => streams.clear(),
      postMessage(order) {
        if ("close" in order) return;
        const stream = streams.get(order.stream) ?? new SmoothStream(order.materials);
        streams.set(order.stream, stream);
        const taking = stream.take(order.rungs);
        let step = taking.next();
        while (!step.done) step = taking.next();
        const result = step.value;
        queueMicrotask(() => this.onmessage?.({ data: { id: order.id, result } }));
      },
    };
    const [there, here] = [new WorkerDecoding(worker), new SlicedDecoding(0)];
    for (const rung of rungsOf("bowl")) {
      const both = await Promise.all([there, here].map((decoding) => decoding.refine(7, [rung], MATERIALS)));
      expect(new Uint8Array(both[0]?.glb ?? new ArrayBuffer())).toEqual(
        new Uint8Array(both[1]?.glb ?? new ArrayBuffer(1)),
      );
    }
    const waiting = there.refine(8, rungsOf("bowl"), MATERIALS);
    there.end();
    await expect(waiting).rejects.toThrow("any more");
  });

  it("that comes whole gives the same as its rungs", async () => {
    const rungs = rungsOf("plain");
    const whole = join(rungs.map((rung) => new Uint8Array(rung)));
    let to = 0;
    const smooth: Smooth = {
      url: `/o/${createHash("sha256").update(new Uint8Array(whole)).digest("hex")}.slod`,
      bytes: whole.byteLength,
      materials: { url: "", bytes: 0 },
      textures: [],
      rungs: rungs.map(({ byteLength }) => {
        to += byteLength;
        return { url: "", from: to - byteLength, to, triangles: 0, geometricError: 0 };
      }),
    };
    const check: IsSound = async (url, bytes) => (await verify(url, bytes, webCryptoDigest())) === "verified";
    const lods = new SmoothLods(() => new SlicedDecoding(), check);
    const last = rungs.length - 1;
    const first = await lods.refine(1, smooth, 0, rungs.slice(0, 1), MATERIALS);
    expect(first.state_bytes).toBeGreaterThan(rungs[0]?.byteLength ?? 0);
    const apart = await lods.refine(1, smooth, last, rungs.slice(1), MATERIALS);
    const atOnce = await lods.refine(2, smooth, last, [whole], MATERIALS);
    expect(apart.state_bytes + atOnce.state_bytes).toBe(0);
    expect(new Uint8Array(apart.glb)).toEqual(new Uint8Array(atOnce.glb));
    const wrong = new Uint8Array(whole.slice(0));
    wrong[wrong.length - 1] = (wrong[wrong.length - 1] ?? 0) ^ 1;
    await expect(lods.refine(3, smooth, last, [wrong.buffer], MATERIALS)).rejects.toThrow("name promises");
    await expect(lods.refine(4, smooth, last, rungs.slice(1), MATERIALS)).rejects.toThrow("up to rung");
  });

  it("that is damaged is refused", async () => {
    const noise = Uint8Array.from({ length: 100 }, (_, i) => i).buffer;
    await expect(new SlicedDecoding().refine(0, [noise], MATERIALS)).rejects.toThrow("not a smooth LOD");
  });
});

it("what is compared with its hash when all ends starts no decoder any more", async () => {
  let compared = (_isSound: boolean) => {};
  const isSound = () =>
    new Promise<boolean>((resolve) => {
      compared = resolve;
    });
  let started = 0;
  const start = () => {
    started += 1;
    return new SlicedDecoding();
  };
  const lods = new SmoothLods(start, isSound);
  const smooth = { url: "/o/x.slod", bytes: 10, rungs: [{ to: 10 }] } as unknown as Smooth;
  const refined = lods.refine(1, smooth, 0, [new ArrayBuffer(10)], MATERIALS);
  lods.end();
  compared(true);
  await expect(refined).rejects.toThrow("any more");
  expect(started).toBe(0);
});
