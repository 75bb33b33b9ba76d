import { expect, it, vi } from "vitest";
import { breakOff, LINK, liveServer, refuse, self } from "../../test/liveserver.ts";
import { Session } from "./session.ts";

const turn = () => new Promise((done) => setTimeout(done));

/** A session that is open, and whose walker never rests. */
async function walking(server: ReturnType<typeof liveServer>) {
  const session = await Session.offered(server.parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  const { clock, sent } = server;
  return {
    session,
    count: (method: string, end: string) => sent.filter((one) => one.method === method && one.url.endsWith(end)).length,
    /** Lets frames run for so long. */
    walk: async (seconds: number, then: () => void = () => {}) => {
      for (let i = 0; i < seconds * 4; i += 1) {
        clock.now_ms += 250;
        session?.update(self(clock.now_ms / 250));
        await turn();
        then();
      }
    },
  };
}

it("while its server is down it says nothing, asks ever less often, and says where one is once it is back", async () => {
  const server = liveServer(LINK);
  const { clock, streams } = server;
  const { session, count, walk } = await walking(server);
  await walk(12);
  const said = count("PUT", "/pose");
  expect(said).toBeGreaterThan(1);
  clock.eventsStatus = 502;
  clock.poseStatus = 502;
  breakOff(streams[0]?.stream);
  await walk(2);
  expect([count("PUT", "/pose") - said, count("HEAD", "/events")]).toEqual([0, 0]);
  // The browser's own second try.
  breakOff(streams[0]?.stream);
  expect(streams[0]?.isClosed()).toBe(true);
  await walk(60);
  expect(count("PUT", "/pose") - said).toBe(0);
  const asked = count("HEAD", "/events");
  expect(asked).toBeGreaterThan(2);
  expect(asked).toBeLessThan(6);
  clock.eventsStatus = 200;
  clock.poseStatus = 200;
  await walk(75);
  expect(streams.length).toBe(2);
  expect(count("PUT", "/pose") - said).toBeGreaterThan(1);
  expect(session?.isOpen).toBe(true);
});

it("a stream that its browser has taken up again by itself is left alone, and where one is is said", async () => {
  const server = liveServer(LINK);
  const { streams, sent, clock } = server;
  const { session, count } = await walking(server);
  session?.update(self(1));
  await turn();
  clock.now_ms += 20_000;
  breakOff(streams[0]?.stream);
  clock.now_ms += 500;
  session?.update(self(1));
  expect(count("PUT", "/pose")).toBe(1);
  Object.assign(streams[0]?.stream ?? {}, { readyState: 1 });
  session?.update(self(1));
  expect([count("PUT", "/pose"), count("HEAD", "/events")]).toEqual([2, 0]);
  expect(sent.at(-1)?.body).toMatchObject({ position: [1, 1.6, 0] });
});

it("a stream that breaks off again at once is given up, and asked for ever less often", async () => {
  const server = liveServer(LINK);
  const { streams } = server;
  const { count, walk } = await walking(server);
  let broken = 0;
  await walk(300, () => {
    if (streams.length === broken) return;
    breakOff(streams[broken]?.stream);
    broken += 1;
  });
  expect(streams.slice(0, -1).every(({ isClosed }) => isClosed())).toBe(true);
  expect(count("HEAD", "/events")).toBeGreaterThan(5);
  expect(count("HEAD", "/events")).toBeLessThan(10);
});

it("a stream that was given up is asked for also while no frames are drawn, until one leaves", async () => {
  const server = liveServer(LINK);
  const { streams, clock } = server;
  const { session, count } = await walking(server);
  clock.eventsStatus = 502;
  breakOff(streams[0]?.stream);
  for (const status of [502, 200]) {
    clock.eventsStatus = status;
    clock.now_ms += 5000;
    await turn();
  }
  expect([count("HEAD", "/events"), streams.length]).toEqual([2, 2]);
  breakOff(streams[1]?.stream);
  expect(server.waiting()).toBe(1);
  session?.close();
  expect(server.waiting()).toBe(0);
});

it("nobody is seen once the stream was given up, and doors stay", async () => {
  const server = liveServer(LINK);
  const { streams, clock, events } = server;
  await walking(server);
  clock.now_ms += 20_000;
  breakOff(streams[0]?.stream);
  expect(events.at(-1)).toEqual({ kind: "resync" });
  breakOff(streams[0]?.stream);
  expect(events.slice(-1)).toEqual([{ kind: "silence" }]);
});

it.each([
  [503, "", 8],
  [401, "", 8],
  [403, "", 8],
  [503, "100", 4],
])(
  "sessions that are refused with %i, retry after “%s”, are asked for at most %i times in 5 minutes",
  async (status, retryAfter, most) => {
    const { parts, clock, sent } = liveServer(LINK);
    Object.assign(clock, { openStatus: status, retryAfter });
    const session = await Session.offered(parts);
    const asked_s: number[] = [];
    for (let s = 0; s < 300; s += 1) {
      const before = sent.length;
      session?.update(self(0));
      await turn();
      if (sent.length > before) asked_s.push(s);
      clock.now_ms += 1000;
    }
    expect(asked_s.length).toBeGreaterThan(2);
    expect(asked_s.length).toBeLessThanOrEqual(most);
    expect(asked_s[1]).toBeGreaterThanOrEqual(Number(retryAfter || 4));
  },
);

it("a stream is not asked for before the server says", async () => {
  const server = liveServer(LINK);
  const { clock, streams } = server;
  const { count, walk } = await walking(server);
  Object.assign(clock, { eventsStatus: 503, retryAfter: "40" });
  refuse(streams[0]?.stream);
  await walk(42);
  expect(count("HEAD", "/events")).toBe(1);
  await walk(10);
  expect(count("HEAD", "/events")).toBeLessThanOrEqual(2);
});

it("poses that are refused are said ever less often", async () => {
  const server = liveServer(LINK);
  const { count, walk } = await walking(server);
  server.clock.poseStatus = 429;
  await walk(60);
  expect(count("PUT", "/pose")).toBeGreaterThan(3);
  expect(count("PUT", "/pose")).toBeLessThan(9);
});

it("who turns to another page stands, and says so at once, after what is on its way", async () => {
  const server = liveServer(LINK);
  const { parts, sent, hold, held } = server;
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  hold.poses = true;
  const poses = () => sent.filter(({ url }) => url.endsWith("/pose")).map(({ body }) => body);
  session?.update({ ...self(1), velocity: [2, 0, 0] });
  session?.rest(self(1.05));
  expect(poses().length).toBe(1);
  hold.poses = false;
  for (const answer of held) answer({ cell: "c0", hush: null });
  await turn();
  expect(poses()[1]).toMatchObject({ position: [1.05, 1.6, 0], velocity: [0, 0, 0] });
  // Who was refused says nothing before it may.
  server.clock.poseStatus = 429;
  server.clock.now_ms += 500;
  session?.update(self(3));
  await turn();
  const said = poses().length;
  session?.rest(self(4));
  expect(poses().length).toBe(said);
  server.clock.poseStatus = 200;
  server.clock.now_ms += 5000;
  session?.rest(self(4));
  await turn();
  expect(poses().length).toBe(said + 1);
  // Who stands already need not say so.
  session?.rest(self(4));
  await turn();
  expect(poses().length).toBe(said + 1);
});
