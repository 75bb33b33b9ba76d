/** Who answers live sessions? A server of one scene in memory, whose answers, streams and clock a test changes. */
import { Tree } from "../core/fetch/tree.ts";
import type { LiveEvent } from "../core/live/events.ts";
import type { EventStream } from "../core/live/hearing.ts";

interface Sent {
  readonly method: string;
  readonly url: string;
  readonly body: Record<string, unknown> | undefined;
  readonly token: string | null;
}

/** A server of one scene whose answers can be changed. */
export function liveServer(link: string | undefined) {
  const sent: Sent[] = [];
  const streams: {
    url: string;
    listeners: Map<string, (event: { data: string }) => void>;
    stream: EventStream;
    isClosed: () => boolean;
  }[] = [];
  const events: LiveEvent[] = [];
  let now_ms = 0;
  /** What comes later, and when. */
  const due = new Map<() => void, number>();
  const clock = {
    get now_ms() {
      return now_ms;
    },
    /** Does what has come due by then. */
    set now_ms(ms: number) {
      now_ms = ms;
      for (const [then, at_ms] of due) {
        if (at_ms > ms) continue;
        due.delete(then);
        then();
      }
    },
    pointerStatus: 200,
    openStatus: 201,
    poseStatus: 200,
    doorStatus: 204,
    eventsStatus: 200,
    retryAfter: "",
  };
  /** Answers to poses, while these are not given at once. */
  const held: ((answer: object) => void)[] = [];
  const hold = { poses: false };
  const fetch = async (url: string, init: RequestInit): Promise<Response> => {
    const method = init.method ?? "GET";
    const token = new Headers(init.headers).get("Authorization");
    sent.push({ method, url, body: init.body ? JSON.parse(String(init.body)) : undefined, token });
    const headers: Record<string, string> = clock.retryAfter ? { "Retry-After": clock.retryAfter } : {};
    if (url.endsWith("/events")) return new Response(null, { status: clock.eventsStatus, headers });
    if (method === "HEAD" && clock.pointerStatus === 0) throw new TypeError("nobody answers");
    const { pointerStatus: status } = clock;
    if (method === "HEAD") {
      return new Response(null, { status, headers: link && status === 200 ? { Link: link } : headers });
    }
    if (method === "POST") {
      const opened = {
        session: "s1",
        token: "t",
        object: "o100000000",
        cell: "c0",
        events_url: "/v1/sessions/s1/events",
        now_ms: 0,
      };
      return Response.json(opened, { status: clock.openStatus, headers });
    }
    if (url.endsWith("/pose") && hold.poses) {
      return new Promise((resolve, reject) => {
        held.push((answer) => resolve(Response.json(answer)));
        init.signal?.addEventListener("abort", () => reject(init.signal?.reason));
      });
    }
    if (url.includes("/doors/")) return new Response(null, { status: clock.doorStatus });
    if (url.endsWith("/pose")) return Response.json({ cell: "c0", hush: null }, { status: clock.poseStatus, headers });
    return Response.json({});
  };
  const listen = (url: string) => {
    const listeners = new Map<string, (event: { data: string }) => void>();
    let isClosed = false;
    const stream: EventStream = {
      addEventListener: (name, listener) => listeners.set(name, listener),
      onerror: null,
      readyState: 1,
      close: () => {
        isClosed = true;
      },
    };
    streams.push({ url, listeners, stream, isClosed: () => isClosed });
    return stream;
  };
  const tree = new Tree("https://host/sub/");
  const parts = {
    tree,
    scene: "rooms",
    fetch,
    listen,
    clock: {
      now_ms: () => clock.now_ms,
      later: (then: () => void, ms: number) => {
        due.set(then, now_ms + ms);
        return () => void due.delete(then);
      },
      random: () => 0.5,
    },
    told: (event: LiveEvent) => events.push(event),
  };
  /** How much is still to come. */
  const waiting = () => due.size;
  return { parts, sent, streams, events, clock, hold, held, waiting };
}

export const LINK = '</v1/scenes/rooms/sessions>; rel="sessions"';
export const self = (x: number) => ({ position: [x, 1.6, 0], orientation: [0, 0, 0, 1], velocity: [0, 0, 0] }) as const;
export const methods = (sent: readonly Sent[]) =>
  sent.map(({ method, url }) => `${method} ${url.replace("https://host/sub", "")}`);

/** What a browser does with a stream that breaks off: it reconnects by itself. */
export function breakOff(stream: EventStream | undefined): void {
  const broken = stream as unknown as { onerror: () => void; readyState: number };
  broken.readyState = 0;
  broken.onerror();
}

/** What a browser does with a stream that was answered with anything else. */
export function refuse(stream: EventStream | undefined): void {
  const refused = stream as unknown as { onerror: () => void; readyState: number };
  refused.readyState = 2;
  refused.onerror();
}
