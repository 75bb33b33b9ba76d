import { expect, it, vi } from "vitest";
import { Tree } from "../tree.ts";
import type { LiveEvent } from "./events.ts";
import { type EventStream, Session } from "./session.ts";

interface Sent {
  readonly method: string;
  readonly url: string;
  readonly body: Record<string, unknown> | undefined;
  readonly token: string | null;
}

/** A server of one scene whose answers can be changed. */
function server(link: string | undefined) {
  const sent: Sent[] = [];
  const streams: { url: string; listeners: Map<string, (event: { data: string }) => void>; stream: EventStream }[] = [];
  const events: LiveEvent[] = [];
  const clock = { now_ms: 0, poseStatus: 200, eventsStatus: 200 };
  const fetch = async (url: string, init: RequestInit): Promise<Response> => {
    const method = init.method ?? "GET";
    const token = new Headers(init.headers).get("Authorization");
    sent.push({ method, url, body: init.body ? JSON.parse(String(init.body)) : undefined, token });
    if (url.endsWith("/events")) return new Response(null, { status: clock.eventsStatus });
    if (method === "HEAD") return new Response(null, { headers: link ? { Link: link } : {} });
    if (method === "POST") {
      const opened = {
        session: "s1",
        token: "t",
        object: "o100000000",
        cell: "c0",
        events_url: "/v1/sessions/s1/events",
        now_ms: 0,
      };
      return Response.json(opened, { status: 201 });
    }
    if (url.endsWith("/pose")) return Response.json({ cell: "c0", hush: null }, { status: clock.poseStatus });
    return Response.json({});
  };
  const listen = (url: string) => {
    const listeners = new Map<string, (event: { data: string }) => void>();
    const stream: EventStream = {
      addEventListener: (name, listener) => listeners.set(name, listener),
      onerror: null,
      readyState: 1,
      close: () => {},
    };
    streams.push({ url, listeners, stream });
    return stream;
  };
  const tree = new Tree("https://host/sub/");
  const parts = {
    tree,
    scene: "rooms",
    fetch,
    listen,
    now_ms: () => clock.now_ms,
    told: (event: LiveEvent) => events.push(event),
  };
  return { parts, sent, streams, events, clock };
}

const LINK = '</v1/scenes/rooms/sessions>; rel="sessions"';
const self = (x: number) => ({ position: [x, 1.6, 0], orientation: [0, 0, 0, 1], velocity: [0, 0, 0] }) as const;
const methods = (sent: readonly Sent[]) =>
  sent.map(({ method, url }) => `${method} ${url.replace("https://host/sub", "")}`);

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
  await session?.setDoor(7, false);
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
  await standAt(2100);
  await standAt(2300);
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

/** What a browser does with a stream that was answered with anything else. */
function refuse(stream: EventStream | undefined): void {
  const refused = stream as unknown as { onerror: () => void; readyState: number };
  refused.readyState = 2;
  refused.onerror();
}

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
    clock.now_ms += 3001;
    session?.update(self(0));
    await new Promise((done) => setTimeout(done));
    expect(asked()).toBe(times);
  }
  expect(session?.isOpen).toBe(true);
  clock.eventsStatus = 200;
  clock.poseStatus = 200;
  clock.now_ms += 3001;
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

it("says anew where one is when all that was told is void", async () => {
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
  streams[0]?.listeners.get("resync")?.({ data: '{"reason": "missed"}' });
  session?.update(self(0));
  expect(said()).toBe(2);
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
