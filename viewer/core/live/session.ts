/**
 * How does one take part in a live scene? Opens a session where the server offers them, listens to its events, says
 * where one is and opens it anew when it has ended. While the server is away the session stays: it goes on when the same
 * one or another is back. A static tree offers none, and nothing is asked of it.
 */
import type { Vec3 } from "../geometry.ts";
import { Json } from "../json.ts";
import type { Tree } from "../tree.ts";
import { EVENT_NAMES, type LiveEvent, readEvent, readHush } from "./events.ts";
import type { Quaternion } from "./motion.ts";
import { Speaker } from "./speaker.ts";

/** What of `EventSource` is needed. */
export interface EventStream {
  addEventListener(name: string, listener: (event: { readonly data: string }) => void): void;
  onerror: ((this: never, event: never) => unknown) | null;
  readonly readyState: number;
  close(): void;
}

export interface SessionParts {
  readonly tree: Tree;
  readonly scene: string;
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  readonly listen: (url: string) => EventStream;
  readonly now_ms: () => number;
  readonly told: (event: LiveEvent) => void;
}

export interface Participant {
  readonly position: Vec3;
  readonly orientation: Quaternion;
  readonly velocity: Vec3;
}

interface Opened {
  readonly session: string;
  readonly token: string;
  /** Where its events are told. */
  readonly events: string;
  stream: EventStream;
  /** When to ask for its stream again; `undefined` while that lasts, or comes back by itself. */
  listen_ms: number | undefined;
}

/** The area of interest: what comes nearer is told of, what goes further is not any more. */
export const AOI = { enter_m: 50, leave_m: 60 } as const;
/** A promise: nobody walks faster in this viewer. Who flies faster counts as jumping. */
const MAX_SPEED_MPS = 5.5;
const STREAM_CLOSED = 2;
const AGAIN_AFTER_MS = 5000;
/** A stream that was refused is asked for again after so long, give or take half of it. */
const LISTEN_AFTER_MS = 2000;
/** The session has ended, or its requests do not reach where it lives. */
const LOST = [401, 403, 404, 421];
/** After a pose that was not heard nothing is said for so long. */
const AFTER_A_FAILURE_MS = 1000;

export class Session {
  private readonly speaker = new Speaker();
  private opened: Opened | undefined;
  private sending = false;
  /** How often the stream has woken it. */
  private wakes = 0;
  private busy = false;
  private again_ms = 0;
  private closed = false;

  private constructor(
    private readonly parts: SessionParts,
    private readonly url: string,
  ) {}

  /** A session that is not open yet; `undefined` when the server offers none. */
  static async offered(parts: SessionParts): Promise<Session | undefined> {
    const answer = await parts.fetch(parts.tree.pointer(parts.scene), { method: "HEAD" });
    const path = /<([^>]+)>\s*;\s*rel="?sessions"?/.exec(answer.headers.get("Link") ?? "")?.[1];
    return path ? new Session(parts, parts.tree.resolve(path)) : undefined;
  }

  get isOpen(): boolean {
    return this.opened !== undefined;
  }

  /** Says where one is when that must be said; call it in every frame. */
  update(self: Participant): void {
    const now_ms = this.parts.now_ms();
    const { opened } = this;
    if (!opened) {
      if (!this.busy && !this.closed && now_ms >= this.again_ms) void this.open(self);
      return;
    }
    if (opened.listen_ms !== undefined && now_ms >= opened.listen_ms) void this.resume(opened);
    if (this.sending) return;
    const pose = this.speaker.speak(now_ms, self.position, self.orientation, self.velocity);
    if (pose) void this.say(opened, pose);
  }

  /** Opens or closes a door for everybody; whether that worked is told as an event. */
  async setDoor(object: number, open: boolean): Promise<void> {
    const { opened } = this;
    if (!opened) throw new Error("the session is not open");
    const url = this.url.replace(/sessions$/, `doors/o${object}`);
    const answer = await this.send(url, "PUT", { open }, opened.token);
    if (!answer.ok) throw new Error(`the door o${object} cannot be moved: ${answer.status}`);
  }

  /** Tells the server how much of what is visible is here, 0 to 1; nobody but its operator hears of it. */
  report(quality: number): void {
    const { opened } = this;
    if (!opened) return;
    const url = this.parts.tree.resolve(`/v1/sessions/${opened.session}/quality`);
    // The next report says more than this one would have.
    void this.send(url, "PUT", { quality }, opened.token).catch(() => {});
  }

  /** Leaves, also a session whose opening is under way; `keepalive` lets the request outlive the page. */
  close(): void {
    this.closed = true;
    const { opened } = this;
    this.opened = undefined;
    if (!opened) return;
    opened.stream.close();
    this.end(opened.session, opened.token);
  }

  private end(session: string, token: string): void {
    const url = this.parts.tree.resolve(`/v1/sessions/${session}`);
    void this.send(url, "DELETE", undefined, token).catch(() => {});
  }

  private async open(self: Participant): Promise<void> {
    this.busy = true;
    const t_ms = Math.round(this.parts.now_ms());
    this.again_ms = t_ms + AGAIN_AFTER_MS;
    try {
      const { position, orientation } = self;
      const asked = { position, orientation, aoi: AOI, max_speed_mps: MAX_SPEED_MPS, t_ms };
      const answer = await this.send(this.url, "POST", asked);
      if (answer.ok) this.enter(Json.parse(await answer.text(), "the session"));
    } catch {
      // A server that is away may come back; the walk goes on without company meanwhile.
    } finally {
      this.busy = false;
    }
  }

  /** Listens to a session that the server has opened; whoever has left meanwhile, or cannot listen, ends it. */
  private enter(json: Json): void {
    const session = json.field("session").text();
    const token = json.field("token").text();
    if (this.closed) {
      this.end(session, token);
      return;
    }
    try {
      const events = this.parts.tree.resolve(json.field("events_url").text());
      this.speaker.keepQuiet(json.field("hush").optional(readHush));
      this.opened = { session, token, events, stream: this.streamOf(events, token), listen_ms: undefined };
      this.listen(this.opened);
    } catch (error) {
      this.end(session, token);
      throw error;
    }
  }

  private streamOf(events: string, token: string): EventStream {
    return this.parts.listen(`${events}?token=${encodeURIComponent(token)}`);
  }

  private listen(opened: Opened): void {
    this.parts.told({ kind: "resync" });
    const { stream } = opened;
    for (const name of EVENT_NAMES) {
      stream.addEventListener(name, ({ data }) => {
        const current = this.opened === opened && opened.stream === stream;
        const event = current ? readEvent(name, data) : undefined;
        if (event?.kind === "hush") this.speaker.keepQuiet(event.hush);
        // What was said before may be as void as what was told: another server may have taken the session up.
        if (event?.kind === "wake" || event?.kind === "resync") {
          this.wakes += 1;
          this.speaker.keepQuiet(undefined);
        }
        if (event) this.parts.told(event);
      });
    }
    stream.onerror = () => {
      // It reconnects by itself unless something else than a stream was answered, and does not say what.
      if (stream.readyState === STREAM_CLOSED) this.listenLater(opened);
    };
  }

  private listenLater(opened: Opened): void {
    opened.listen_ms = this.parts.now_ms() + LISTEN_AFTER_MS * (0.5 + Math.random());
  }

  /** Listens again to a session whose stream was refused, as by a proxy that has lost its server for a while. */
  private async resume(opened: Opened): Promise<void> {
    opened.listen_ms = undefined;
    const answer = await this.send(opened.events, "HEAD", undefined, opened.token).catch(() => undefined);
    if (this.opened !== opened) return;
    if (answer && LOST.includes(answer.status)) this.lose(opened);
    else if (answer?.ok) {
      opened.stream = this.streamOf(opened.events, opened.token);
      this.listen(opened);
    } else this.listenLater(opened);
  }

  private async say(opened: Opened, pose: Participant & { readonly t_ms: number }): Promise<void> {
    this.sending = true;
    const { wakes } = this;
    try {
      const { t_ms, position, orientation, velocity } = pose;
      const url = this.parts.tree.resolve(`/v1/sessions/${opened.session}/pose`);
      const answer = await this.send(url, "PUT", { t_ms, position, orientation, velocity }, opened.token);
      if (LOST.includes(answer.status)) this.lose(opened);
      else if (answer.ok) {
        const hush = Json.parse(await answer.text(), "the answer to a pose")
          .field("hush")
          .optional(readHush);
        // Whoever was woken meanwhile is watched: the stream may overtake the answer.
        if (hush && wakes === this.wakes) this.speaker.keepQuiet(hush);
      } else this.speaker.pause(this.parts.now_ms() + AFTER_A_FAILURE_MS);
    } catch {
      this.speaker.pause(this.parts.now_ms() + AFTER_A_FAILURE_MS);
    } finally {
      this.sending = false;
    }
  }

  private lose(opened: Opened): void {
    if (this.opened !== opened) return;
    opened.stream.close();
    this.opened = undefined;
    this.parts.told({ kind: "resync" });
  }

  private send(url: string, method: string, body: unknown, token?: string): Promise<Response> {
    const headers: Record<string, string> = { "Content-Type": "application/json" };
    if (token) headers.Authorization = `Bearer ${token}`;
    return this.parts.fetch(url, {
      method,
      headers,
      keepalive: method === "DELETE",
      body: body ? JSON.stringify(body) : null,
    });
  }
}
