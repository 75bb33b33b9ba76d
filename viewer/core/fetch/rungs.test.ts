import { createHash } from "node:crypto";
import { describe, expect, it, vi } from "vitest";
import { partOf } from "../../test/serve.ts";
import type { Shelf } from "../shelf/shelf.ts";
import { PRIORITY } from "../strategy/priority.ts";
import type { Within } from "./download.ts";
import { FETCH_DEFAULTS, FetchQueue, type FetchQueueOptions } from "./fetchqueue.ts";
import { RequestLog } from "./requestlog.ts";
import type { Fetch } from "./transfer.ts";
import { webCryptoDigest } from "./verify.ts";

const ENDS = [10, 30, 60];

/** A stream of three rungs, other than those of other seeds. */
function stream(seed: number) {
  const bytes = Uint8Array.from({ length: 60 }, (_, i) => seed + i);
  const url = `https://host/o/${createHash("sha256").update(bytes).digest("hex")}.slod`;
  const within = (number: number, isNeeded: boolean): Within => {
    return { url, from: ENDS[number - 1] ?? 0, to: ENDS[number] ?? 0, of_bytes: bytes.length, isNeeded };
  };
  const part = (number: number) => [...bytes.slice(ENDS[number - 1] ?? 0, ENDS[number])];
  return { bytes, url, part, rung: (number: number) => url.replace(".slod", `.r${number}.slod`), within };
}

type Stream = ReturnType<typeof stream>;
/** What is answered to who asks for a part of a stream. */
type Answer = (
  of: Stream,
  range: string,
  signal: AbortSignal | null | undefined,
  cache?: RequestCache,
) => Response | Promise<Response>;

const FIRST = stream(1);
const OTHER = stream(100);

const kept: Answer = ({ bytes }, range) => partOf(bytes, range);
const ignored: Answer = ({ bytes }) => new Response(bytes);
const damaged: Answer = ({ bytes }) => new Response(bytes.map((byte, i) => (i === 50 ? byte ^ 1 : byte)));
const cut: Answer = ({ bytes }) => {
  const half = bytes.slice(0, 30);
  const start = (body: ReadableStreamDefaultController<Uint8Array>) => body.enqueue(half);
  return new Response(new ReadableStream({ start, pull: () => Promise.reject(new TypeError("cut")) }));
};
const failing = (status: number) => new Response("", { status });
const gone: Answer = () => failing(404);

/** A part of so many bytes that is said to stand there. */
function part(bytes: number, place?: string): Response {
  const headers: HeadersInit = place === undefined ? {} : { "Content-Range": place };
  return new Response(new Uint8Array(bytes), { status: 206, headers });
}

/** What a device has kept. */
function shelfOf() {
  const files = new Map<string, ArrayBuffer>();
  const shelf = {
    has: (url: string) => files.has(url),
    read: async (url: string) => files.get(url),
    keep: (url: string, bytes: ArrayBuffer) => void files.set(url, bytes),
    forget: (url: string) => void files.delete(url),
  };
  return { files, shelf: shelf as unknown as Shelf };
}

/** A tree without rungs, which answers ranges so. */
function tree(
  answer: Answer,
  { other = () => failing(404), ...options }: { other?: (url: string) => Response } & Partial<FetchQueueOptions> = {},
) {
  const asked: string[] = [];
  const fetch: Fetch = async (url, { headers, signal, cache }) => {
    const range = new Headers(headers).get("Range");
    asked.push(range ? `${url} ${range}` : url);
    const of = [FIRST, OTHER].find((one) => one.url === url);
    return of && range ? await answer(of, range, signal, cache) : other(url);
  };
  const log = new RequestLog(() => 0);
  const digest = webCryptoDigest();
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, backoff_ms: 1, digest, fetch, log, ...options });
  const watcher = { lost: vi.fn(), answered: vi.fn(), missing: vi.fn() };
  queue.watch(watcher);
  const ask = async (of: Stream, number: number, isNeeded = false) => {
    const within = of.within(number, isNeeded);
    const come = queue.request(of.rung(number), PRIORITY.finer, { bytes: within.to - within.from, within });
    return [...new Uint8Array(await come)];
  };
  const logged = () => log.entries.map(({ result, bytes, detour }) => [result, bytes, detour]);
  return { queue, asked, logged, watcher, ask };
}

const BY_RANGE = "by range, as the rung is not there";
const BY_STREAM = "with all of its stream, as the rung is not there and ranges are ignored";

describe("a rung that is not there", () => {
  it.each([404, 410, 403])("comes as a range (status %i), and so do others from then on", async (absent) => {
    const { files, shelf } = shelfOf();
    const { queue, asked, logged, watcher, ask } = tree(kept, { other: () => failing(absent), shelf });
    expect(await ask(FIRST, 1)).toEqual(FIRST.part(1));
    expect(await Promise.all([ask(FIRST, 2), ask(OTHER, 0)])).toEqual([FIRST.part(2), OTHER.part(0)]);
    const ranges = [`${FIRST.url} bytes=10-29`, `${FIRST.url} bytes=30-59`, `${OTHER.url} bytes=0-9`];
    expect(asked).toEqual([FIRST.rung(1), ...ranges]);
    expect(queue.tally).toMatchObject({ bytes: 60, requests: 4, retries: 0, unverified: 0 });
    expect(logged()).toEqual([20, 30, 10].map((bytes) => ["done", bytes, BY_RANGE]));
    expect(watcher.missing, "nothing is lost").not.toHaveBeenCalled();
    expect([...files.keys()], "each is kept once").toEqual([FIRST.rung(1), FIRST.rung(2), OTHER.rung(0)]);
  });

  it("comes out of all of its stream where ranges are ignored, and no other stream is asked for unless it is needed", async () => {
    const { files, shelf } = shelfOf();
    const { queue, asked, logged, ask } = tree(ignored, { shelf });
    expect(await ask(FIRST, 1)).toEqual(FIRST.part(1));
    expect(queue.cost_bytes({ url: FIRST.rung(2), bytes: 30 })).toBe(0);
    expect(queue.cost_bytes({ url: OTHER.rung(2), bytes: 30 })).toBeGreaterThan(1e9);
    expect(await ask(FIRST, 2)).toEqual(FIRST.part(2));
    await expect(ask(OTHER, 0)).rejects.toMatchObject({ kind: "forgone" });
    expect(asked).toEqual([FIRST.rung(1), `${FIRST.url} bytes=10-29`]);
    expect(logged()).toEqual([
      ["done", 60, BY_STREAM],
      ["kept", 0, undefined],
      ["cancelled", 0, undefined],
    ]);
    expect(await ask(OTHER, 0, true)).toEqual(OTHER.part(0));
    expect(asked.length).toBe(3);
    expect(queue.tally).toMatchObject({ bytes: 120, unverified: 0 });
    expect([...files.keys()], "each is kept once").toEqual([FIRST.url, OTHER.url]);
    // The last is in memory, the one before on the shelf.
    expect(await ask(FIRST, 0)).toEqual(FIRST.part(0));
    expect(asked.length).toBe(3);
  });

  it("does not come out of a stream that is not what its name promises, which is asked for twice", async () => {
    const { asked, ask, queue } = tree(damaged);
    await expect(ask(FIRST, 0)).rejects.toMatchObject({ kind: "corrupt", url: FIRST.url });
    expect(asked).toEqual([FIRST.rung(0), ...Array(2).fill(`${FIRST.url} bytes=0-9`)]);
    expect(queue.cost_bytes({ url: FIRST.rung(1), bytes: 20 })).toBeGreaterThan(0);
  });

  it.each(Object.entries({ damaged, cut }))(
    "of which all comes %s says nothing of other streams, which are asked for parts next",
    async (_, bad) => {
      const { asked, ask, queue } = tree((...how) => (how[0] === FIRST ? bad(...how) : kept(...how)));
      await expect(ask(FIRST, 0)).rejects.toBeInstanceOf(Error);
      expect(queue.cost_bytes({ url: OTHER.rung(0), bytes: 10 })).toBeLessThan(1e9);
      expect(await ask(OTHER, 0)).toEqual(OTHER.part(0));
      expect(asked.at(-1)).toBe(`${OTHER.url} bytes=0-9`);
    },
  );

  it("comes as a range at the second try where all of its stream broke off at the first, and so do others", async () => {
    let tries = 0;
    const { asked, ask } = tree((...how) => (tries++ === 0 ? cut(...how) : kept(...how)));
    expect(await ask(FIRST, 0)).toEqual(FIRST.part(0));
    expect(await ask(OTHER, 0)).toEqual(OTHER.part(0));
    expect(asked.slice(1)).toEqual([...Array(2).fill(`${FIRST.url} bytes=0-9`), `${OTHER.url} bytes=0-9`]);
  });

  const lies: Record<string, Answer> = {
    "with 19 bytes instead of 20": () => part(19, "bytes 10-29/60"),
    "with 21 bytes instead of 20": () => part(21, "bytes 10-29/60"),
    "with bytes 0-19/60": () => part(20, "bytes 0-19/60"),
    "with a part that has no place": () => part(20),
    "with 20 bytes as if that were all of it": () => new Response(new Uint8Array(20)),
  };
  it.each(Object.entries(lies))(
    "is lost where a range is answered %s, and no more are asked for",
    async (told, lie) => {
      const { files, shelf } = shelfOf();
      const { asked, logged, ask } = tree(lie, { shelf });
      const refused = { kind: "range", message: expect.stringContaining(`${FIRST.url} was answered ${told}`) };
      await expect(ask(FIRST, 1)).rejects.toMatchObject(refused);
      await expect(ask(OTHER, 1)).rejects.toMatchObject(refused);
      expect(asked).toEqual([FIRST.rung(1), `${FIRST.url} bytes=10-29`, OTHER.rung(1)]);
      expect(logged().map(([result]) => result)).toEqual(["failed", "failed"]);
      expect(files.size).toBe(0);
    },
  );

  it("is lost where its stream is not there either, and that is told", async () => {
    const { asked, watcher, ask } = tree(gone);
    await expect(ask(FIRST, 1)).rejects.toMatchObject({ kind: "status", status: 404, url: FIRST.url });
    expect(asked).toEqual([FIRST.rung(1), `${FIRST.url} bytes=10-29`]);
    expect(watcher.missing).toHaveBeenCalledTimes(1);
  });

  it("is tried as often as any file, however often its own address was", async () => {
    let tries = 0;
    const cutTwice: Answer = (...how) => (tries++ < 2 ? cut(...how) : kept(...how));
    const { asked, ask } = tree(cutTwice, { attempts: 3, other: () => failing(asked.length < 3 ? 503 : 404) });
    expect(await ask(FIRST, 1)).toEqual(FIRST.part(1));
    expect(asked).toEqual([...Array(3).fill(FIRST.rung(1)), ...Array(3).fill(`${FIRST.url} bytes=10-29`)]);
  });

  it("is believed without its place where a page may not read that of another origin", async () => {
    const hidden: Answer = ({ bytes }) => {
      const response = new Response(bytes.slice(10, 30), { status: 206 });
      return Object.defineProperty(response, "type", { value: "cors" });
    };
    expect(await tree(hidden).ask(FIRST, 1)).toEqual(FIRST.part(1));
  });
});

/** A range that is answered when told to. */
function held() {
  let answer: (response: Response) => void = () => {};
  let isCalledOff = false;
  const hold: Answer = (_, __, signal) => {
    signal?.addEventListener("abort", () => {
      isCalledOff = true;
    });
    return new Promise((resolve) => {
      answer = resolve;
    });
  };
  return { hold, answer: (response: Response) => answer(response), isCalledOff: () => isCalledOff };
}

/** An answer that has begun, and comes when told to. */
function begun(init: ResponseInit = {}) {
  let body: ReadableStreamDefaultController<Uint8Array> | undefined;
  const start = (controller: typeof body) => {
    body = controller;
  };
  const response = new Response(new ReadableStream({ start }), init);
  return { response, comes: (bytes: Uint8Array) => body?.enqueue(bytes), ends: () => body?.close() };
}

/** A part of 60 bytes that has begun. */
const begunPart = (place: string) => begun({ status: 206, headers: { "Content-Range": `bytes ${place}/60` } });

/** As soon as so many have been asked for. */
const until = (asked: readonly string[], count: number) =>
  vi.waitFor(() => expect(asked.length).toBe(count), { timeout: 4000, interval: 2 });

it("is forgone also when a silent server is tried with it, and then something else tries", async () => {
  let isSilent = false;
  const { queue, asked, ask } = tree((...how) =>
    isSilent ? Promise.reject(new TypeError("silence")) : ignored(...how),
  );
  await ask(FIRST, 0);
  isSilent = true;
  const lost = [ask(OTHER, 1, true), ask(OTHER, 2, true)];
  for (const one of lost) await expect(one).rejects.toMatchObject({ kind: "unreachable" });
  const forgone = ask(OTHER, 0);
  const other = queue.request("https://host/other", PRIORITY.finer);
  const before = asked.length;
  queue.probe();
  await expect(forgone).rejects.toMatchObject({ kind: "forgone" });
  await expect(other).rejects.toMatchObject({ kind: "status" });
  expect(asked.slice(before)).toEqual(["https://host/other"]);
});

describe("while nobody knows how ranges are answered", () => {
  it("one asks, and who waits asks too when it begins to be answered", async () => {
    const { hold, answer } = held();
    let answers = hold;
    const { asked, ask } = tree((...how) => answers(...how));
    const both = [ask(FIRST, 0), ask(OTHER, 0)];
    await until(asked, 3);
    answers = kept;
    const { response, comes, ends } = begunPart("0-9");
    answer(response);
    comes(FIRST.bytes.slice(0, 1));
    expect(await both[1]).toEqual(OTHER.part(0));
    comes(FIRST.bytes.slice(1, 10));
    ends();
    expect(await both[0]).toEqual(FIRST.part(0));
    expect(asked.slice(2)).toEqual([`${FIRST.url} bytes=0-9`, `${OTHER.url} bytes=0-9`]);
  });

  it("who wants another stream than the one that comes whole hears so at once", async () => {
    const { hold, answer } = held();
    const { asked, ask } = tree(hold);
    const [asking, waiting] = [ask(FIRST, 0), ask(OTHER, 0)];
    await until(asked, 3);
    const { response, comes, ends } = begun();
    answer(response);
    comes(FIRST.bytes.slice(0, 1));
    await expect(waiting).rejects.toMatchObject({ kind: "forgone" });
    comes(FIRST.bytes.slice(1));
    ends();
    expect(await asking).toEqual(FIRST.part(0));
  });

  it("who wants more of a stream that comes whole waits for that, and progress counts from where a rung begins", async () => {
    const { hold, answer } = held();
    const { queue, asked, logged, ask } = tree(hold);
    const both = Promise.all([ask(FIRST, 1), ask(FIRST, 2)]);
    await until(asked, 3);
    const { response, comes, ends } = begun();
    answer(response);
    for (const [to, came] of [
      [10, 0],
      [25, 15],
    ] as const) {
      const from = to === 10 ? 0 : 10;
      comes(FIRST.bytes.slice(from, to));
      await vi.waitFor(() => expect(queue.tally.bytes).toBe(to));
      expect(queue.came_bytes(FIRST.rung(1))).toBe(came);
    }
    comes(FIRST.bytes.slice(25));
    ends();
    expect(await both).toEqual([FIRST.part(1), FIRST.part(2)]);
    expect(asked.length).toBe(3);
    expect(logged()).toEqual([
      ["done", 60, BY_STREAM],
      ["kept", 0, undefined],
    ]);
  });

  it("what is asked for twice at once tells it by that which comes, and not by the other", async () => {
    const [slow, whole] = [begunPart("0-9"), begun()];
    const answers = [slow, whole].values();
    const { asked, logged, ask } = tree((...how) => answers.next().value?.response ?? kept(...how), { quiet_ms: 5 });
    const first = ask(FIRST, 0);
    await until(asked, 3);
    await new Promise((later) => setTimeout(later, 5));
    slow.comes(FIRST.bytes.slice(0, 10));
    slow.ends();
    expect(await first).toEqual(FIRST.part(0));
    expect(await ask(OTHER, 0)).toEqual(OTHER.part(0));
    expect(logged().map(([, , detour]) => detour)).toEqual([BY_RANGE, BY_RANGE]);
  });

  it("a stream that comes whole takes room as such, and not as a rung", async () => {
    const { response, comes, ends } = begun();
    const starts = () => ({ receives: () => {}, ends: () => {} });
    const meter = { request_bytes: 1, bytes_per_s: 1, hasRoom: (_: number, bytes: number) => bytes < 50, starts };
    const { queue, asked, ask } = tree(() => response, { meter });
    const first = ask(FIRST, 0);
    await until(asked, 2);
    comes(FIRST.bytes.slice(0, 1));
    await vi.waitFor(() => expect(queue.tally.bytes).toBe(1));
    const other = queue.request("https://host/other", PRIORITY.finer);
    expect(asked.length).toBe(2);
    comes(FIRST.bytes.slice(1));
    ends();
    expect(await first).toEqual(FIRST.part(0));
    await expect(other).rejects.toMatchObject({ kind: "status" });
  });

  it("who waits takes no room, and asks for no address twice", async () => {
    const { hold, answer } = held();
    let answers = hold;
    const starts = () => ({ receives: () => {}, ends: () => {} });
    const meter = { request_bytes: 1, bytes_per_s: 1, hasRoom: (requests: number) => requests < 2, starts };
    const { queue, asked, ask } = tree((...how) => answers(...how), { concurrency: 2, meter });
    const both = [ask(FIRST, 0), ask(OTHER, 0)];
    await until(asked, 3);
    await expect(queue.request("https://host/other", PRIORITY.finer)).rejects.toMatchObject({ kind: "status" });
    answers = kept;
    answer(partOf(FIRST.bytes, "bytes=0-9"));
    expect(await Promise.all(both)).toEqual([FIRST.part(0), OTHER.part(0)]);
    const ranges = [`${FIRST.url} bytes=0-9`, `${OTHER.url} bytes=0-9`];
    expect(asked).toEqual([FIRST.rung(0), OTHER.rung(0), ranges[0], "https://host/other", ranges[1]]);
  });

  it("who waits calls off no pack", async () => {
    const bytes = new Uint8Array(100_000);
    const hash = createHash("sha256").update(bytes.subarray(0, 10)).digest("hex");
    const level = { url: `https://host/o/${hash}.glb`, from: 0, bytes: 10 };
    const url = "https://host/o/some.pack";
    const { response, comes, ends } = begun();
    const { hold, answer } = held();
    let answers = hold;
    const other = (of: string) => (of === url ? response : failing(404));
    const { queue, asked, ask } = tree((...how) => answers(...how), { concurrency: 2, other });
    const both = [ask(FIRST, 0), ask(OTHER, 0)];
    await until(asked, 3);
    const slice = queue.slice(level, url, PRIORITY.finer, { bytes: bytes.length });
    await until(asked, 4);
    comes(bytes.subarray(0, 20));
    expect((await slice).byteLength).toBe(10);
    comes(bytes.subarray(20, 40));
    await vi.waitFor(() => expect(queue.came_bytes(url)).toBe(40));
    comes(bytes.subarray(40));
    ends();
    await vi.waitFor(() => expect(queue.isComing(url)).toBe(false));
    expect(queue.tally.bytes).toBe(bytes.length);
    answers = kept;
    answer(partOf(FIRST.bytes, "bytes=0-9"));
    expect(await Promise.all(both)).toEqual([FIRST.part(0), OTHER.part(0)]);
  });

  it("who falls silent lets another file come, and does not ask for its own address again", async () => {
    const { hold } = held();
    let tries = 0;
    const answer: Answer = (...how) => (tries++ === 0 ? hold(...how) : kept(...how));
    const { queue, asked, ask } = tree(answer, { quiet_ms: 20, concurrency: 1 });
    const first = ask(FIRST, 0);
    await expect(queue.request("https://host/other", PRIORITY.document)).rejects.toMatchObject({ kind: "status" });
    expect(await first).toEqual(FIRST.part(0));
    const range = `${FIRST.url} bytes=0-9`;
    expect(asked).toEqual([FIRST.rung(0), range, "https://host/other", range]);
  });

  it("no other address of a rung is asked for from when a part begins to come", async () => {
    const { response, comes, ends } = begunPart("0-9");
    const { queue, asked, ask } = tree((...how) => (how[0] === FIRST ? response : kept(...how)));
    const first = ask(FIRST, 0);
    await until(asked, 2);
    comes(FIRST.bytes.slice(0, 1));
    await vi.waitFor(() => expect(queue.tally.bytes).toBe(1));
    expect(await ask(OTHER, 0)).toEqual(OTHER.part(0));
    expect(asked.slice(2)).toEqual([`${OTHER.url} bytes=0-9`]);
    comes(FIRST.bytes.slice(1, 10));
    ends();
    expect(await first).toEqual(FIRST.part(0));
  });

  it("a cache of the browser is not taken for the server, and is of use when that is known", async () => {
    const caches: (RequestCache | undefined)[] = [];
    // One that has all of a stream cuts ranges out of it, whatever the server does with them.
    const cached: Answer = (of, range, signal, cache) => {
      caches.push(cache);
      return (cache === "reload" ? ignored : kept)(of, range, signal);
    };
    const { ask } = tree(cached);
    expect(await ask(FIRST, 0)).toEqual(FIRST.part(0));
    await expect(ask(OTHER, 0)).rejects.toMatchObject({ kind: "forgone" });
    expect(await ask(OTHER, 0, true)).toEqual(OTHER.part(0));
    expect(caches).toEqual(["reload", "default"]);
  });

  it.each(["asks", "waits"])("who %s can be called off, and the other goes on", async (who) => {
    const { hold, answer, isCalledOff } = held();
    const { queue, asked, ask } = tree(hold);
    const [asking, waiting] = [ask(FIRST, 0), ask(OTHER, 0)];
    await until(asked, 3);
    const [called, other] = who === "asks" ? [asking, waiting] : [waiting, asking];
    queue.cancel(who === "asks" ? FIRST.rung(0) : OTHER.rung(0));
    await expect(called).rejects.toMatchObject({ kind: "cancelled" });
    if (who === "asks") await until(asked, 4);
    const of = who === "asks" ? OTHER : FIRST;
    answer(partOf(of.bytes, "bytes=0-9"));
    expect(await other).toEqual(of.part(0));
    expect([isCalledOff(), queue.pending]).toEqual([who === "asks", 0]);
  });
});
