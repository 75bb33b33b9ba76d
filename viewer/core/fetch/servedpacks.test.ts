import { createHash } from "node:crypto";
import { expect, it, vi } from "vitest";
import type { Shelf } from "../shelf/shelf.ts";
import { FETCH_DEFAULTS, FetchQueue } from "./fetchqueue.ts";
import { webCryptoDigest } from "./verify.ts";

const PACK_BYTES = 100_000;
const PACK = "https://host/o/some.pack";
const OTHER = "https://host/v1/other";
const BYTES = Uint8Array.from({ length: PACK_BYTES }, (_, i) => i % 251);

/** A file in the pack, by the name that its bytes give it. */
function part(from: number, bytes: number) {
  const hash = createHash("sha256").update(BYTES.subarray(from, from + bytes));
  return { url: `https://host/o/${hash.digest("hex")}.glb`, from, bytes };
}

/** A line on which there is room for one download, and a pack that comes as far as it is let. */
function slowLine() {
  const asked: string[] = [];
  const kept: string[] = [];
  let pack: ReadableStreamDefaultController<Uint8Array> | undefined;
  let calledOff = false;
  const fetch = async (url: string, init: RequestInit) => {
    asked.push(url);
    if (url !== PACK) return new Response("other");
    init.signal?.addEventListener("abort", () => {
      calledOff = true;
    });
    return new Response(
      new ReadableStream<Uint8Array>({
        start: (controller) => {
          pack = controller;
        },
      }),
    );
  };
  const shelf = { has: () => false, read: async () => undefined, keep: (url: string) => kept.push(url) };
  const queue = new FetchQueue({
    ...FETCH_DEFAULTS,
    concurrency: 1,
    digest: webCryptoDigest(),
    fetch,
    shelf: shelf as unknown as Shelf,
  });
  const slice = (wanted: ReturnType<typeof part>, isWanted = () => true) =>
    queue.slice(wanted, PACK, 1, { bytes: PACK_BYTES, isWanted });
  let sent = 0;
  const send = async (to: number) => {
    await vi.waitFor(() => expect(pack).toBeDefined());
    pack?.enqueue(BYTES.slice(sent, to));
    sent = to;
    // Whatever follows of it has followed.
    await new Promise((resolve) => setTimeout(resolve, 20));
  };
  const end = () => pack?.close();
  return { queue, asked, kept, slice, send, end, isCalledOff: () => calledOff };
}

const FIRST = part(0, 10_000);
const SECOND = part(50_000, 10_000);

it("a pack of which all has come that is wanted is called off for what waits, and what came is kept", async () => {
  const { queue, asked, kept, slice, send, isCalledOff } = slowLine();
  const first = slice(FIRST);
  await send(20_000);
  expect((await first).byteLength).toBe(FIRST.bytes);
  expect(isCalledOff(), "nothing waits").toBe(false);
  expect(new TextDecoder().decode(await queue.request(OTHER, 2))).toBe("other");
  expect([isCalledOff(), asked, queue.pending]).toEqual([true, [PACK, OTHER], 0]);
  await vi.waitFor(() => expect(kept).toEqual([FIRST.url]));
});

it("a pack is called off as soon as the last of it has come that is wanted", async () => {
  const { queue, slice, send, isCalledOff } = slowLine();
  const parts = [slice(FIRST), slice(SECOND)];
  const other = queue.request(OTHER, 2);
  await send(59_999);
  expect(isCalledOff()).toBe(false);
  await send(60_000);
  await Promise.all([...parts, other]);
  expect(isCalledOff()).toBe(true);
});

it("a part that nobody wants any more does not keep a pack", async () => {
  const { queue, slice, send, isCalledOff } = slowLine();
  let isWanted = true;
  const first = slice(FIRST);
  const second = slice(SECOND, () => isWanted);
  const other = queue.request(OTHER, 2);
  await send(20_000);
  await first;
  expect(isCalledOff()).toBe(false);
  isWanted = false;
  const refused = expect(second).rejects.toThrow("not needed");
  await send(30_000);
  await refused;
  await other;
  expect(isCalledOff()).toBe(true);
});

it("a pack of which little is left comes to its end, as does one that somebody wants whole", async () => {
  for (const whole of [false, true]) {
    const { queue, asked, slice, send, end, isCalledOff } = slowLine();
    const first = slice(FIRST);
    const all = whole ? queue.request(PACK, 1) : undefined;
    const other = queue.request(OTHER, 2);
    all?.catch(() => {});
    await send(whole ? 20_000 : PACK_BYTES - 16 * 1024);
    await first;
    expect(asked).toEqual([PACK]);
    await send(PACK_BYTES);
    end();
    await other;
    expect(isCalledOff()).toBe(false);
  }
});
