import { describe, expect, it } from "vitest";
import { explore } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";
import { addressOf, BundleReader, inOrder, isSmall, type Member, offersBundles, together } from "./bundles.ts";

/** Requests so dear that everything small comes in bundles. */
const DEAR_BYTES = 16_000;
const ROOM_0: Vec3 = [1, 1.6, 3];
const hash = (i: number) => i.toString(16).padStart(64, "0");
const member = (i: number, bytes: number | undefined = 100) => ({ url: `https://host/sub/o/${hash(i)}.glb`, bytes });

/** A bundle of these members. */
function bundle(members: readonly (readonly number[])[]): Uint8Array {
  const head = new DataView(new ArrayBuffer(8 + 4 * members.length));
  [0x42, 0x56, 0x42, 0x4e].forEach((byte, i) => {
    head.setUint8(i, byte);
  });
  head.setUint16(4, 1, true);
  head.setUint16(6, members.length, true);
  let end = 0;
  members.forEach((bytes, i) => {
    end += bytes.length;
    head.setUint32(8 + 4 * i, end, true);
  });
  return Uint8Array.of(...new Uint8Array(head.buffer), ...members.flat());
}

describe("a bundle", () => {
  it("is taken apart while it comes, in pieces of any size", () => {
    const members = [[1, 2, 3], [], [4], [5, 6]];
    const whole = bundle(members);
    for (let size = 1; size <= whole.length; size += 1) {
      const reader = new BundleReader(members.length);
      const given: number[][] = [];
      for (let at = 0; at < whole.length; at += size) {
        expect(reader.isWhole).toBe(false);
        for (const bytes of reader.push(whole.subarray(at, at + size))) given.push([...new Uint8Array(bytes)]);
      }
      expect(given).toEqual(members);
      expect(reader.isWhole).toBe(true);
    }
  });

  it("is refused when it is another, goes back, or goes on", () => {
    const whole = bundle([[1], [2, 3]]);
    expect(() => new BundleReader(3).push(Uint8Array.of(...whole, 0, 0, 0, 0))).toThrow("no bundle of 3");
    expect(() => new BundleReader(2).push(whole.map((byte, i) => (i === 0 ? 0 : byte)))).toThrow("no bundle");
    expect(() => new BundleReader(2).push(whole.map((byte, i) => (i === 12 ? 0 : byte)))).toThrow("end before");
    const longer = new BundleReader(2);
    longer.push(Uint8Array.of(...whole, 9));
    expect(longer.isWhole).toBe(false);
  });

  it("holds few and small things of one tree, in the order of their names", () => {
    const many = Array.from({ length: 100 }, (_, i) => member(99 - i));
    const fast = Number.POSITIVE_INFINITY;
    expect(together(many, fast)).toEqual(many.slice(0, 64));
    expect(
      together(
        many.map((one) => ({ ...one, bytes: 10_000 })),
        fast,
      ).length,
    ).toBe(3);
    const elsewhere = { ...member(1), url: member(1).url.replace("host", "other") };
    expect(together([member(2), elsewhere, member(0)], fast)).toEqual([member(2), member(0)]);
    const address = addressOf(inOrder([member(2), member(0)]));
    expect(address).toBe(`https://host/sub/o/bundle/${hash(0)}.glb+${hash(2)}.glb`);
  });

  it("takes no longer than half a second on a slow line, where it holds more than one", () => {
    const many = Array.from({ length: 9 }, (_, i) => member(i, 8000 + i));
    const counts = [Number.POSITIVE_INFINITY, 64_000, 33_000, 16_000, 1000].map((rate) => together(many, rate).length);
    expect(counts).toEqual([4, 3, 2, 1, 1]);
  });

  it("holds objects and rungs only", () => {
    const isTaken = (one: Member, request_bytes = 400) => isSmall(one, request_bytes);
    const rung = member(1, 6000).url.replace(".glb", ".r12.slod");
    expect(isTaken({ url: rung, bytes: 6000 })).toBe(true);
    expect(isTaken({ url: rung, bytes: undefined })).toBe(false);
    expect(isTaken({ url: rung, bytes: 1e6 })).toBe(false);
    expect(isTaken({ url: "https://host/v1/scenes/rooms/index.json", bytes: 10 })).toBe(false);
    // What shrinks alone and not in a bundle is worth it where requests are dear.
    expect(isTaken(member(1, 500))).toBe(true);
    expect(isTaken(member(1, 6000))).toBe(false);
    expect(isTaken(member(1, 6000), 4000)).toBe(true);
  });

  it("is offered by a header of the pointer", () => {
    const link = (value: string) => offersBundles(new Headers({ Link: value }));
    expect(link('</v1/scenes/a/sessions>; rel="sessions", </o/bundle/>; rel="bundles"')).toBe(true);
    expect(link('</v1/scenes/a/sessions>; rel="sessions"')).toBe(false);
    expect(offersBundles(new Headers())).toBe(false);
  });
});

describe("an explorer whose server offers bundles", () => {
  const isBundle = (path: string) => path.startsWith("/o/bundle/");

  it("enters a cell with fewer requests, and has the same", async () => {
    const apart = await explore({ request_bytes: DEAR_BYTES });
    const { explorer, requests, problems, scene, go, quiet } = await explore({
      bundles: true,
      request_bytes: DEAR_BYTES,
    });
    for (const visit of [apart, { go, quiet }]) {
      visit.go(ROOM_0);
      await visit.quiet();
    }
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(explorer.residency.grades()).toEqual(apart.explorer.residency.grades());
    expect(requests.filter(isBundle).length).toBeGreaterThan(0);
    expect(requests.length).toBeLessThan(0.7 * apart.requests.length);
    expect(scene.queue.tally.bundled).toBeGreaterThan(5);
    const [alone, members] = [false, true].map((bundled) => requests.filter((path) => isBundle(path) === bundled));
    const named = (members ?? []).flatMap((path) => path.split("/").at(-1)?.split("+") ?? []);
    const names = [...named, ...(alone ?? []).map((path) => path.split("/").at(-1))];
    expect(new Set(names).size).toBe(names.length);
  });

  it("asks again alone for a member that is damaged", async () => {
    const levels = (files: Files) => [...files.keys()].filter((path) => path.endsWith(".glb"));
    const { explorer, requests, problems, go, quiet } = await explore({
      bundles: true,
      request_bytes: DEAR_BYTES,
      spoil: (files) => {
        const [first = ""] = levels(files);
        const sound = files.get(first) ?? new Uint8Array();
        let asked = 0;
        const get = files.get.bind(files);
        files.get = (path) => (path === first && asked++ === 0 ? sound.map((byte) => byte ^ 1) : get(path));
      },
    });
    go(ROOM_0);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0 });
    expect(requests.some((path) => path.endsWith(".glb") && !isBundle(path))).toBe(true);
  });

  it("asks alone for everything once a bundle could not be had", async () => {
    const { explorer, requests, problems, files, go, quiet } = await explore({
      bundles: true,
      request_bytes: DEAR_BYTES,
    });
    const get = files.get.bind(files);
    // A member is lost for the first bundle only.
    let lost = true;
    files.get = (path) => {
      if (!lost || !path.endsWith(".glb")) return get(path);
      lost = false;
      return undefined;
    };
    go(ROOM_0);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0 });
    go([3 * PITCH_M + 1, 1.6, 3]);
    await quiet();
    expect(explorer).toMatchObject({ cellId: 6, settled: true, missing: 0 });
    const failed = requests.findIndex((path) => isBundle(path) && path.includes(".glb"));
    expect(failed).toBeGreaterThan(0);
    expect(requests.slice(failed + 9).some(isBundle)).toBe(false);
  });
});
