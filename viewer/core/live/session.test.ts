import { expect, it, vi } from "vitest";
import { LINK, methods, refuse, self, liveServer as server } from "../../test/liveserver.ts";
import { Session } from "./session.ts";

it("asks nothing more of a tree that offers no sessions", async () => {
  const { parts, sent } = server(undefined);
  expect(await Session.offered(parts)).toBeUndefined();
  expect(methods(sent)).toEqual(["HEAD /v1/scenes/rooms/index.json"]);
});

it("opens once, listens with its token, speaks, moves doors and leaves", async () => {
  const { parts, sent, streams, events } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  expect(streams.map(({ url }) => url)).toEqual(["https://host/sub/v1/sessions/s1/events?token=t"]);
  session?.update(self(1));
  expect(await session?.setDoor(7, false)).toBe(true);
  streams[0]?.listeners.get("door")?.({ data: '{"object": "o7", "open": false}' });
  expect(events).toContainEqual({ kind: "door", object: 7, open: false });
  session?.close();
  expect(methods(sent)).toEqual([
    "HEAD /v1/scenes/rooms/index.json",
    "POST /v1/scenes/rooms/sessions",
    "PUT /v1/sessions/s1/pose",
    "PUT /v1/scenes/rooms/doors/o7",
    "DELETE /v1/sessions/s1",
  ]);
  expect(sent[1]?.body).toMatchObject({ position: [0, 1.6, 0], aoi: { enter_m: 50, leave_m: 60 } });
  expect(sent.slice(2).every(({ token }) => token === "Bearer t")).toBe(true);
});

it("wears what it is told to, of another scene too", async () => {
  const { parts, sent } = server(LINK);
  const avatar = { scene: "people", object: "o3" };
  const session = await Session.offered({ ...parts, avatar });
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  expect(sent[1]?.body).toMatchObject({ avatar });
});

it("ends a session whose opening was under way when one left, and listens to nothing", async () => {
  const { parts, sent, streams, events } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  session?.close();
  await vi.waitFor(() => expect(sent.at(-1)?.method).toBe("DELETE"));
  expect(sent.at(-1)).toMatchObject({ url: "https://host/sub/v1/sessions/s1", token: "Bearer t" });
  session?.update(self(0));
  expect(sent.filter(({ method }) => method === "POST").length).toBe(1);
  expect(session?.isOpen).toBe(false);
  expect(streams).toEqual([]);
  expect(events).toEqual([]);
});

it("ends a session that it cannot listen to", async () => {
  const { parts, sent } = server(LINK);
  const refused = () => {
    throw new Error("event streams are forbidden here");
  };
  const session = await Session.offered({ ...parts, listen: refused });
  session?.update(self(0));
  await vi.waitFor(() => expect(sent.at(-1)?.method).toBe("DELETE"));
  expect(session?.isOpen).toBe(false);
});

it("says how good the picture is to who asked for it, while it is open", async () => {
  const { parts, sent } = server(LINK);
  const session = await Session.offered(parts);
  session?.report(0.5);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  session?.report(0.75);
  const reports = sent.filter(({ url }) => url.endsWith("/quality"));
  expect(reports).toEqual([
    { method: "PUT", url: "https://host/sub/v1/sessions/s1/quality", body: { quality: 0.75 }, token: "Bearer t" },
  ]);
});

it("says again, after a pause, what was not heard", async () => {
  const { parts, sent, clock } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  const said = () => sent.filter(({ url }) => url.endsWith("/pose")).length;
  const standAt = async (now_ms: number) => {
    clock.now_ms = now_ms;
    session?.update(self(9));
    await new Promise((done) => setTimeout(done));
  };
  clock.poseStatus = 503;
  await standAt(1000);
  await standAt(1500);
  expect(said()).toBe(1);
  clock.poseStatus = 200;
  await standAt(2300);
  await standAt(2500);
  expect(said()).toBe(2);
});

it("opens anew, after a pause, when the session has ended", async () => {
  const { parts, sent, clock, events } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  clock.poseStatus = 404;
  clock.now_ms = 1000;
  session?.update(self(5));
  await vi.waitFor(() => expect(session?.isOpen).toBe(false));
  expect(events.at(-1)).toEqual({ kind: "resync" });
  session?.update(self(5));
  expect(sent.filter(({ method }) => method === "POST").length).toBe(1);
  clock.now_ms = 9000;
  session?.update(self(5));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  expect(sent.filter(({ method }) => method === "POST").length).toBe(2);
});

it("listens again, with the same token, when a proxy has refused its stream while the server was away", async () => {
  const { parts, sent, streams, clock, events } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  const asked = () => sent.filter(({ method, url }) => method === "HEAD" && url.endsWith("/events")).length;
  clock.eventsStatus = 502;
  clock.poseStatus = 502;
  refuse(streams[0]?.stream);
  for (const times of [1, 2]) {
    session?.update(self(0));
    expect(asked()).toBe(times - 1);
    clock.now_ms += 3001 * times;
    session?.update(self(0));
    await new Promise((done) => setTimeout(done));
    expect(asked()).toBe(times);
  }
  expect(session?.isOpen).toBe(true);
  clock.eventsStatus = 200;
  clock.poseStatus = 200;
  clock.now_ms += 10_000;
  session?.update(self(0));
  await vi.waitFor(() => expect(streams.length).toBe(2));
  expect(streams[1]?.url).toBe(streams[0]?.url);
  expect(sent.filter(({ method }) => method === "POST").length).toBe(1);
  // Only the last stream is listened to, and what it says counts.
  const door = (i: number, object: number) =>
    streams[i]?.listeners.get("door")?.({ data: `{"object": "o${object}", "open": true}` });
  door(0, 1);
  door(1, 2);
  expect(events.filter(({ kind }) => kind === "door")).toEqual([{ kind: "door", object: 2, open: true }]);
});

it("speaks on when a pose is never answered", async () => {
  const timeouts: AbortController[] = [];
  const timeout = vi.spyOn(AbortSignal, "timeout").mockImplementation(() => {
    const controller = new AbortController();
    timeouts.push(controller);
    return controller.signal;
  });
  const { parts, sent, clock, hold } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  hold.poses = true;
  const said = () => sent.filter(({ url }) => url.endsWith("/pose")).length;
  session?.update(self(5));
  clock.now_ms = 9000;
  session?.update(self(9));
  expect(said()).toBe(1);
  for (const one of timeouts) one.abort();
  await new Promise((done) => setTimeout(done));
  clock.now_ms = 20_000;
  session?.update(self(9));
  expect(said()).toBe(2);
  timeout.mockRestore();
});

it("what is on its way of a session that is lost neither holds up nor hushes the next one", async () => {
  const { parts, sent, streams, clock, hold, held } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  const said = () => sent.filter(({ url }) => url.endsWith("/pose")).length;
  hold.poses = true;
  session?.update(self(0));
  expect(said()).toBe(1);
  hold.poses = false;
  clock.eventsStatus = 404;
  refuse(streams[0]?.stream);
  clock.now_ms = 9000;
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(false));
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  session?.update(self(1));
  expect(said()).toBe(2);
  const hush = { tbv: { center: [0, 1.6, 0], radius_m: 99 }, until_ms: 1e9 };
  for (const answer of held) answer({ cell: "c0", hush });
  await new Promise((done) => setTimeout(done));
  clock.now_ms = 10_000;
  session?.update(self(5));
  expect(said()).toBe(3);
});

it.each([
  ["resync", '{"reason": "missed"}'],
  ["revision", '{"revision": "0011223344556677", "manifest": "/o/x.json"}'],
])("says anew where one is when %s voids what was told", async (name, data) => {
  const { parts, sent, streams, clock } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  const said = () => sent.filter(({ url }) => url.endsWith("/pose")).length;
  for (const _ of [1, 2]) {
    clock.now_ms += 500;
    session?.update(self(0));
    await new Promise((done) => setTimeout(done));
  }
  expect(said()).toBe(1);
  streams[0]?.listeners.get(name)?.({ data });
  session?.update(self(0));
  expect(said()).toBe(2);
});

it("says when a door is none of the revision that others are in by now", async () => {
  const { parts, clock } = server(LINK);
  const session = await Session.offered(parts);
  session?.update(self(0));
  await vi.waitFor(() => expect(session?.isOpen).toBe(true));
  clock.doorStatus = 409;
  expect(await session?.setDoor(7, false)).toBe(false);
  clock.doorStatus = 429;
  await expect(session?.setDoor(7, false)).rejects.toThrow("429");
});

it("opens anew when its stream is refused because the session has ended or lives elsewhere", async () => {
  for (const status of [404, 421]) {
    const { parts, sent, streams, clock, events } = server(LINK);
    const session = await Session.offered(parts);
    session?.update(self(0));
    await vi.waitFor(() => expect(session?.isOpen).toBe(true));
    clock.eventsStatus = status;
    clock.poseStatus = 503;
    refuse(streams[0]?.stream);
    clock.now_ms = 9000;
    session?.update(self(0));
    await vi.waitFor(() => expect(session?.isOpen).toBe(false));
    expect(events.at(-1)).toEqual({ kind: "resync" });
    session?.update(self(0));
    await vi.waitFor(() => expect(session?.isOpen).toBe(true));
    expect(sent.filter(({ method }) => method === "POST").length).toBe(2);
  }
});
