import { expect, it } from "vitest";
import { PRIORITY } from "../strategy/priority.ts";
import { FETCH_DEFAULTS, FetchQueue } from "./fetchqueue.ts";
import { RequestLog } from "./requestlog.ts";

it("forgets the oldest and keeps what is told of the others", () => {
  let now_ms = 0;
  const log = new RequestLog(() => now_ms, 2);
  const traces = ["a", "b", "c"].map((url) => log.asks(url, "finer", "because"));
  now_ms = 5;
  traces[2]?.starts();
  traces[2]?.receives(10);
  now_ms = 9;
  traces[2]?.ends("done");
  expect(log.entries.map(({ url }) => url)).toEqual(["b", "c"]);
  expect(log.entries[1]).toMatchObject({
    asked_ms: 0,
    started_ms: 5,
    ended_ms: 9,
    bytes: 10,
    tries: 1,
    result: "done",
  });
});

it("is told by the queue what each download was for and how it ended", async () => {
  const log = new RequestLog(() => 0);
  const answers: Record<string, () => Response> = {
    "https://host/there": () => new Response("four"),
    "https://host/gone": () => new Response("", { status: 404 }),
    "https://host/busy": () => new Response("", { status: 503 }),
  };
  const fetch = async (url: string) => answers[url]?.() ?? new Response("", { status: 404 });
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, attempts: 2, backoff_ms: 1, digest: undefined, fetch, log });
  const there = queue.request("https://host/there", PRIORITY.coarsest + 3, { reason: "m1: nothing of it is here" });
  const gone = queue.request("https://host/gone", PRIORITY.document);
  const busy = queue.request("https://host/busy", PRIORITY.finer);
  const dropped = queue.request("https://host/dropped", PRIORITY.prefetch);
  queue.cancel("https://host/dropped");
  await Promise.allSettled([there, gone, busy, dropped]);
  expect(log.entries.map(({ purpose, result, bytes, tries }) => [purpose, result, bytes, tries])).toEqual([
    ["coarsest", "done", 4, 1],
    ["document", "failed", 0, 1],
    ["finer", "failed", 0, 2],
    ["prefetch", "cancelled", 0, 1],
  ]);
  expect(log.entries[0]?.reason).toBe("m1: nothing of it is here");
});
