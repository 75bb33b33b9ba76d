/**
 * How does one take part in a live scene? Opens a session where the server offers them, listens to its events, says
 * where one is and opens it anew when it has ended. While the server is away the session stays, and nothing is said: it goes on when
 * the same one or another is back, which is asked after less and less often. A static tree offers none, and nothing is asked of it.
 */
import type { Vec3 } from "../basics/geometry.ts";
import { Json } from "../basics/json.ts";
import { Pauses } from "../fetch/pauses.ts";
import type { Tree } from "../fetch/tree.ts";
import { type LiveEvent, readEvent, readHush } from "./events.ts";
import { type Clock, type EventStream, Hearing } from "./hearing.ts";
import type { Quaternion } from "./motion.ts";
import { Speaker } from "./speaker.ts";

export interface SessionParts {
  readonly tree: Tree;
  readonly scene: string;
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  readonly listen: (url: string) => EventStream;
  readonly clock: Clock;
  readonly told: (event: LiveEvent) => void;
  /** Whose model one wears; without one, others draw what they like. */
  readonly avatar?: Avatar | undefined;
}

/** An object that does not move, of this scene or of another one of the same server that one may read. */
export interface Avatar {
  readonly scene?: string;
  readonly object: string;
}

export interface Participant {
  readonly position: Vec3;
  readonly orientation: Quaternion;
  readonly velocity: Vec3;
}

type Said = Participant & { readonly t_ms: number };

interface Opened {
  readonly session: string;
  readonly token: string;
  readonly hearing: Hearing;
  readonly speaker: Speaker;
  /** Whether a pose is on its way, and what is said after it. */
  sending: boolean;
  next: Said | undefined;
  /** After a pose that was not heard. */
  readonly saying: Pauses;
  /** How often the stream has woken it. */
  wakes: number;
}

/** The area of interest: what comes nearer is told of, what goes further is not any more. */
export const AOI = { enter_m: 50, leave_m: 60 } as const;
/** A promise: nobody walks faster in this viewer. Who flies faster counts as jumping. */
const MAX_SPEED_MPS = 5.5;
/** Between two sessions, and two poses of which the first was not heard. */
const OPENING = { first_ms: 5000, longest_ms: 120_000 };
const SAYING = { first_ms: 1000, longest_ms: 60_000 };
/** What voids a promise to say nothing. */
const VOIDING: ReadonlySet<LiveEvent["kind"]> = new Set(["wake", "resync", "revision"]);
/** The session has ended, or its requests do not reach where it lives. */
const LOST = [401, 403, 404, 421];
/** The object is none of the revision that the scene has by now. */
const NEWER_REVISION = 409;
/** What is not answered within so long is given up. */
const ANSWERED_WITHIN_MS = 10_000;
/** While one begins: on a slow line that waits behind first downloads, and nobody could end a session that was given up. */
const OPENED_WITHIN_MS = 60_000;

/** Nobody can say just now whether there are sessions. */
export class NoAnswer extends Error {
  override readonly name = "NoAnswer";
  /** Of what was answered in its place, which may say when to ask again. */
  readonly headers: Headers;

  constructor({ status, headers }: Response) {
    super(`the pointer was answered with ${status}`);
    this.headers = headers;
  }
}

export class Session {
  private opened: Opened | undefined;
  private busy = false;
  private readonly openings: Pauses;
  private again_ms = 0;
  private closed = false;

  private constructor(
    private readonly parts: SessionParts,
    private readonly url: string,
  ) {
    this.openings = new Pauses(OPENING, parts.clock.random);
  }

  /** A session that is not open yet; `undefined` when the server offers none. Fails where it does not answer. */
  static async offered(parts: SessionParts): Promise<Session | undefined> {
    const signal = AbortSignal.timeout(OPENED_WITHIN_MS);
    const answer = await parts.fetch(parts.tree.pointer(parts.scene), { method: "HEAD", signal });
    if (answer.status >= 500 || answer.status === 429) throw new NoAnswer(answer);
    const path = /<([^>]+)>\s*;\s*rel="?sessions"?/.exec(answer.headers.get("Link") ?? "")?.[1];
    return path ? new Session(parts, parts.tree.resolve(path)) : undefined;
  }

  get isOpen(): boolean {
    return this.opened !== undefined;
  }

  /** Whether it is open, and what it tells is heard. */
  get isHeard(): boolean {
    return this.opened?.hearing.isDown === false;
  }

  /** Says where one is when that must be said; call it in every frame. */
  update(self: Participant): void {
    const now_ms = this.parts.clock.now_ms();
    const { opened } = this;
    if (!opened) {
      if (!this.busy && !this.closed && now_ms >= this.again_ms) void this.open(self);
      return;
    }
    opened.hearing.look();
    if (opened.sending || opened.hearing.isDown) return;
    const pose = opened.speaker.speak(now_ms, self.position, self.orientation, self.velocity);
    if (pose) void this.say(opened, pose);
  }

  /** Says at once that one stands here, since no frame may say anything for a while: others would let one walk on. */
  rest({ position, orientation }: Omit<Participant, "velocity">): void {
    const { opened } = this;
    if (!opened || opened.hearing.isDown) return;
    const pose = opened.speaker.rest(this.parts.clock.now_ms(), position, orientation);
    if (!pose) return;
    if (opened.sending) opened.next = pose;
    else void this.say(opened, pose);
  }

  /** Opens or closes a door for everybody, which is told as an event. Answers `false` where others are in a newer revision. */
  async setDoor(object: number, open: boolean): Promise<boolean> {
    const { opened } = this;
    if (!opened) throw new Error("the session is not open");
    const url = this.url.replace(/sessions$/, `doors/o${object}`);
    const answer = await this.send(url, "PUT", { open }, opened.token);
    if (answer.status === NEWER_REVISION) return false;
    if (!answer.ok) throw new Error(`the door o${object} cannot be moved: ${answer.status}`);
    return true;
  }

  /** Tells the server how much of what is visible is here, 0 to 1; nobody but its operator hears of it. */
  report(quality: number): void {
    const { opened } = this;
    if (!opened || opened.hearing.isDown) return;
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
    opened.hearing.close();
    this.end(opened.session, opened.token);
  }

  private end(session: string, token: string): void {
    const url = this.parts.tree.resolve(`/v1/sessions/${session}`);
    void this.send(url, "DELETE", undefined, token).catch(() => {});
  }

  private async open(self: Participant): Promise<void> {
    this.busy = true;
    const t_ms = Math.round(this.parts.clock.now_ms());
    let answer: Response | undefined;
    try {
      const { position, orientation } = self;
      const { avatar } = this.parts;
      const asked = { position, orientation, aoi: AOI, max_speed_mps: MAX_SPEED_MPS, t_ms, avatar };
      answer = await this.send(this.url, "POST", asked);
      if (answer.ok) this.enter(Json.parse(await answer.text(), "the session"));
    } catch {
      // A server that is away may come back; the walk goes on without company meanwhile.
    } finally {
      this.again_ms = this.openings.after(this.parts.clock.now_ms(), answer);
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
      const speaker = new Speaker();
      speaker.keepQuiet(json.field("hush").optional(readHush));
      const saying = new Pauses(SAYING, this.parts.clock.random);
      const hearing = this.listen(events, token, () => opened);
      const opened: Opened = { session, token, hearing, speaker, saying, sending: false, next: undefined, wakes: 0 };
      this.opened = opened;
    } catch (error) {
      this.end(session, token);
      throw error;
    }
  }

  private listen(events: string, token: string, opened: () => Opened): Hearing {
    const { clock, told, listen } = this.parts;
    // What was said before may be as void as what was told: another server may have taken the session up, or walls may have gone.
    const wake = () => {
      opened().wakes += 1;
      opened().speaker.keepQuiet(undefined);
    };
    return new Hearing({
      clock,
      open: () => listen(`${events}?token=${encodeURIComponent(token)}`),
      ask: () => this.send(events, "HEAD", undefined, token).catch(() => undefined),
      isLost: ({ status }) => LOST.includes(status),
      begins: () => told({ kind: "resync" }),
      heard: (name, data) => {
        const event = readEvent(name, data);
        if (event?.kind === "hush") opened().speaker.keepQuiet(event.hush);
        if (event && VOIDING.has(event.kind)) wake();
        if (event) told(event);
      },
      // Also promises that are on their way.
      breaks: wake,
      givenUp: () => told({ kind: "silence" }),
      // Where one is by now, whatever was not heard before.
      back: () => opened().speaker.pause(clock.now_ms()),
      lost: () => this.lose(opened()),
    });
  }

  private async say(opened: Opened, pose: Said): Promise<void> {
    opened.sending = true;
    const unheard = (answer?: Response) => speaker.pause(opened.saying.after(this.parts.clock.now_ms(), answer));
    const { speaker, wakes } = opened;
    try {
      const { t_ms, position, orientation, velocity } = pose;
      const url = this.parts.tree.resolve(`/v1/sessions/${opened.session}/pose`);
      const answer = await this.send(url, "PUT", { t_ms, position, orientation, velocity }, opened.token);
      if (LOST.includes(answer.status)) this.lose(opened);
      else if (answer.ok) {
        opened.saying.over();
        const hush = Json.parse(await answer.text(), "the answer to a pose")
          .field("hush")
          .optional(readHush);
        // Whoever was woken meanwhile is watched: the stream may overtake the answer.
        if (hush && wakes === opened.wakes) speaker.keepQuiet(hush);
      } else unheard(answer);
    } catch {
      unheard();
    } finally {
      opened.sending = false;
      const { next } = opened;
      opened.next = undefined;
      if (next && this.opened === opened) void this.say(opened, next);
    }
  }

  private lose(opened: Opened): void {
    if (this.opened !== opened) return;
    opened.hearing.close();
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
      signal: AbortSignal.timeout(method === "POST" ? OPENED_WITHIN_MS : ANSWERED_WITHIN_MS),
      body: body ? JSON.stringify(body) : null,
    });
  }
}
