import { describe, expect, it, vi } from "vitest";
import type { Shelf } from "../shelf/shelf.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { FETCH_DEFAULTS, FetchQueue, type FetchQueueOptions } from "./fetchqueue.ts";
import { FetchError } from "./transfer.ts";
import { webCryptoDigest } from "./verify.ts";

const HELLO = "https://host/o/2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824.bin";

/** A queue whose server answers when told to. */
function manual(options: Partial<FetchQueueOptions> = {}) {
  const open: { url: string; init: RequestInit; answer: (body: string, status?: number) => void; fail: () => void }[] =
    [];
  const fetch = (url: string, init: RequestInit) =>
    new Promise<Response>((resolve, reject) => {
      init.signal?.addEventListener("abort", () => reject(new DOMException("aborted", "AbortError")));
      open.push({
        url,
        init,
        answer: (body, status = 200) => resolve(new Response(body, { status })),
        fail: () => reject(new TypeError("no network")),
      });
    });
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, backoff_ms: 1, digest: undefined, fetch, ...options });
  /** A request, by number, as soon as it was sent: however long the machine takes until the next attempt. */
  const attempt = (number: number) =>
    vi.waitFor(() => open[number] ?? expect.fail(`no attempt ${number}`), { timeout: 4000, interval: 2 });
  return { queue, open, attempt };
}

const turn = () => new Promise((resolve) => setTimeout(resolve, 10));

describe("the fetch queue", () => {
  it("keeps to its bound and takes the most urgent first", async () => {
    const { queue, open } = manual({ concurrency: 1 });
    const order: string[] = [];
    for (const [url, priority] of [
      ["a", 5],
      ["b", 9],
      ["c", 1],
    ] as const) {
      void queue.request(url, priority).then(() => order.push(url));
    }
    queue.reprioritise("b", 0);
    for (let i = 0; i < 3; i += 1) {
      expect(open.length).toBe(i + 1);
      open[i]?.answer("x");
      await turn();
    }
    expect(order).toEqual(["a", "b", "c"]);
    expect(queue.pending).toBe(0);
  });

  it("tries a silent server with one download at a time, also when the one that tries is asked for anew", async () => {
    const { queue, open } = manual({ attempts: 1 });
    queue.watch({ lost: () => {}, answered: () => {}, missing: () => {} });
    const lost = ["a", "b"].map((url) => queue.request(url, 1));
    for (const { fail } of open) fail();
    await Promise.allSettled(lost);
    queue.probe();
    const all = [queue.request("c", 1)];
    queue.cancel("c");
    all.push(queue.request("c", 1), queue.request("d", 1));
    await turn();
    expect(open.map(({ url }) => url)).toEqual(["a", "b", "c", "c"]);
    queue.close();
    await Promise.allSettled(all);
  });

  it("fetches once what is asked for twice", async () => {
    const { queue, open } = manual();
    const both = Promise.all([queue.request("a", 1), queue.request("a", 2)]);
    open[0]?.answer("abc");
    const [first, second] = await both;
    expect(first).toBe(second);
    expect(queue.tally).toMatchObject({ requests: 1, bytes: 3 });
  });

  it("gives up everything when it is closed, and begins nothing any more", async () => {
    const { queue, open } = manual({ concurrency: 1 });
    const asked = [queue.request("a", 1), queue.request("b", 2)];
    queue.close();
    const late = queue.request("c", 1);
    for (const gone of [...asked, late]) await expect(gone).rejects.toMatchObject({ kind: "cancelled" });
    await turn();
    expect([open.map(({ url }) => url), open[0]?.init.signal?.aborted, queue.pending]).toEqual([["a"], true, 0]);
  });

  it.each(["cancelled", "closed"])("does not ask again for what is %s in the pause after a failure", async (how) => {
    vi.useFakeTimers();
    try {
      const { queue, open } = manual({ backoff_ms: 1000 });
      const gone = queue.request("a", 1);
      open[0]?.fail();
      await vi.advanceTimersByTimeAsync(500);
      if (how === "closed") queue.close();
      else queue.cancel("a");
      await expect(gone).rejects.toMatchObject({ kind: "cancelled" });
      await vi.advanceTimersByTimeAsync(60_000);
      expect([open.length, queue.pending]).toEqual([1, 0]);
    } finally {
      vi.useRealTimers();
    }
  });

  it("lets go of what is cancelled and goes on with the rest", async () => {
    const { queue, open, attempt } = manual({ concurrency: 1 });
    const gone = queue.request("a", 1);
    const kept = queue.request("b", 2);
    queue.cancel("a");
    await expect(gone).rejects.toMatchObject({ kind: "cancelled" });
    expect(open[0]?.init.signal?.aborted).toBe(true);
    (await attempt(1)).answer("b");
    expect((await kept).byteLength).toBe(1);
  });

  it("tries again what may pass, and gives up at the end", async () => {
    const { queue, attempt } = manual({ attempts: 3 });
    const lucky = queue.request("a", 1);
    (await attempt(0)).fail();
    (await attempt(1)).answer("busy", 503);
    (await attempt(2)).answer("ok");
    expect((await lucky).byteLength).toBe(2);
    expect(queue.tally.retries).toBe(2);
    const unlucky = queue.request("b", 1);
    unlucky.catch(() => {});
    for (let i = 3; i < 6; i += 1) (await attempt(i)).fail();
    await expect(unlucky).rejects.toMatchObject({ kind: "unreachable" });
  });

  it("does not ask again for what is not there", async () => {
    const { queue, open } = manual();
    const missing = queue.request("a", 1);
    open[0]?.answer("", 404);
    await expect(missing).rejects.toBeInstanceOf(FetchError);
    expect(open.length).toBe(1);
  });

  it("fetches damaged bytes once more past the cache, then says that they are damaged", async () => {
    const { queue, attempt } = manual({ digest: webCryptoDigest() });
    const healed = queue.request(HELLO, 1);
    (await attempt(0)).answer("hellO");
    const again = await attempt(1);
    expect(again.init.cache).toBe("reload");
    again.answer("hello");
    expect((await healed).byteLength).toBe(5);
    const damaged = queue.request(HELLO, 1);
    damaged.catch(() => {});
    (await attempt(2)).answer("hellO");
    (await attempt(3)).answer("hellO");
    await expect(damaged).rejects.toMatchObject({ kind: "corrupt" });
  });

  it("tries again a download from which nothing is heard", async () => {
    let tries = 0;
    const fetch = (_: string, { signal }: RequestInit) =>
      new Promise<Response>((resolve, reject) => {
        tries += 1;
        signal?.addEventListener("abort", () => reject(new DOMException("aborted", "AbortError")));
        if (tries === 2) resolve(new Response("ok"));
      });
    const { queue } = manual({ stall_ms: 5, fetch });
    expect((await queue.request("a", 1)).byteLength).toBe(2);
    expect(queue.tally.retries).toBe(1);
  });
});

it.each([true, false])("gives up bodies that begin and do not go on, tries again, and says so", async (obeys) => {
  let tries = 0;
  const fetch = async (_: string, { signal }: RequestInit) => {
    tries += 1;
    const body = new ReadableStream<Uint8Array>({
      start: (controller) => {
        controller.enqueue(new Uint8Array(3));
        if (obeys) signal?.addEventListener("abort", () => controller.error(signal.reason));
        if (tries === 2) controller.close();
      },
    });
    return new Response(body);
  };
  const { queue } = manual({ stall_ms: 20, attempts: 2, fetch });
  expect((await queue.request("a", 1)).byteLength).toBe(3);
  expect(queue.tally.retries).toBe(1);
  const lost = queue.request("b", 1);
  await expect(lost).rejects.toMatchObject({ kind: "unreachable", message: expect.stringContaining("nothing came") });
  expect([tries, queue.pending]).toEqual([4, 0]);
});

describe("what may be under way", () => {
  /** A line that takes so many bytes more, and what it was asked for. */
  function lineOf(most_bytes: number) {
    const asked_bytes: number[] = [];
    const hasRoom = (_: number, bytes: number) => {
      asked_bytes.push(bytes);
      return bytes < most_bytes;
    };
    const starts = () => ({ receives: () => {}, ends: () => {} });
    return { meter: { request_bytes: 400, bytes_per_s: 1e6, hasRoom, starts }, asked_bytes };
  }

  it("counts as it travels, compressed", () => {
    const { meter, asked_bytes } = lineOf(Number.POSITIVE_INFINITY);
    const { queue, open } = manual({ meter });
    void queue.request("a.glb", PRIORITY.coarsest, { bytes: 10_000 });
    expect(asked_bytes.at(-1)).toBeCloseTo(4_700);
    void queue.request("b.slod", PRIORITY.coarsest, { bytes: 10_000 });
    expect(asked_bytes.at(-1)).toBeCloseTo(14_700);
    expect(open.length).toBe(2);
  });

  it("holds up nothing that this device has kept", async () => {
    const kept = { has: (url: string) => url === "kept", read: async () => new ArrayBuffer(3) };
    const { queue, open } = manual({ meter: lineOf(0).meter, shelf: kept as unknown as Shelf });
    void queue.request("far away", PRIORITY.coarsest, { bytes: 10_000 });
    const near = await queue.request("kept", PRIORITY.finer, { bytes: 3 });
    expect([near.byteLength, open.length]).toEqual([3, 0]);
  });
});

describe("what is silent for some seconds", () => {
  const QUIET = { quiet_ms: 15, stall_ms: 60_000 };

  it("lets others go before it, and is asked for after them", async () => {
    const { queue, open, attempt } = manual({ ...QUIET, concurrency: 1 });
    const [silent, other] = [queue.request("a", 1), queue.request("b", 2)];
    const second = await attempt(1);
    expect([second.url, open[0]?.init.signal?.aborted]).toEqual(["b", true]);
    second.answer("b");
    const third = await attempt(2);
    expect(third.url).toBe("a");
    third.answer("aaa");
    expect([(await silent).byteLength, (await other).byteLength]).toEqual([3, 1]);
  });

  it.each([0, 1])(
    "is asked for once more where nobody else waits, and answer %i is taken when it comes first",
    async (n) => {
      const silent = vi.fn();
      const { queue, open, attempt } = manual({ ...QUIET, silent });
      const come = queue.request(HELLO, 1);
      expect([(await attempt(1)).url, open[1]?.init.cache]).toEqual([HELLO, "reload"]);
      expect(silent.mock.calls[0]?.[0]).toMatchObject({ url: HELLO, how: "quiet", attempt: 1 });
      open[n]?.answer("hello");
      expect((await come).byteLength).toBe(5);
      expect(
        open.map(({ init }) => init.signal?.aborted),
        "the other is called off",
      ).toEqual([n === 1, n === 0]);
      expect(silent.mock.lastCall).toEqual([undefined]);
      expect([open.length, queue.tally.bytes, queue.pending]).toEqual([2, 5, 0]);
    },
  );

  it("takes three transfers at most, so that what is asked for later goes at once", async () => {
    const { queue, open, attempt } = manual({ ...QUIET, concurrency: 4 });
    for (let i = 0; i < 9; i += 1) queue.request(`silent ${i}`, 1).catch(() => {});
    const held = () => open.filter(({ init }) => !init.signal?.aborted).length;
    await vi.waitFor(() => expect([open.length >= 9, held() <= 3]).toEqual([true, true]), { timeout: 4000 });
    await turn();
    const before = open.length;
    void queue.request("urgent", 1);
    expect((await attempt(before)).url).toBe("urgent");
    expect(held()).toBeLessThanOrEqual(4);
  });
});

it("what breaks off is asked for again past the cache, and said to be damaged; nobody else waits for it", async () => {
  const silent = vi.fn();
  const urls: string[] = [];
  const caches: (string | undefined)[] = [];
  const fetch = async (url: string, { cache }: RequestInit) => {
    urls.push(url);
    caches.push(cache);
    if (url === "good") return new Response("good");
    const start = (controller: ReadableStreamDefaultController) => controller.error(new TypeError("network error"));
    return new Response(new ReadableStream({ start }));
  };
  const { queue } = manual({ fetch, attempts: 2, silent });
  const watcher = { lost: vi.fn(), answered: vi.fn(), missing: vi.fn() };
  queue.watch(watcher);
  const broken = ["a", "b", "c"].map((url) => queue.request(url, 1));
  for (const one of broken) await expect(one).rejects.toMatchObject({ kind: "broken" });
  expect(caches).toEqual(["default", "default", "default", "reload", "reload", "reload"]);
  expect(silent.mock.calls[0]?.[0]).toMatchObject({ url: "a", how: "broken" });
  expect(watcher.lost).toHaveBeenCalledTimes(3);
  expect((await queue.request("good", 1)).byteLength).toBe(4);
});
