/**
 * Is what a session tells heard? Its stream is up, down, or up again. Browsers take up by themselves what breaks off, but as often as they
 * like where nothing answers, and at the same pace for ever where it breaks off again at once: such a stream is given up, and asked for after
 * pauses that grow, also while no frames are drawn.
 */
import { Pauses } from "../fetch/pauses.ts";
import { EVENT_NAMES } from "./events.ts";

/** What of `EventSource` is needed. */
export interface EventStream {
  addEventListener(name: string, listener: (event: { readonly data: string }) => void): void;
  onerror: ((this: never, event: never) => unknown) | null;
  readonly readyState: number;
  close(): void;
}

/** When it is, and what comes later. */
export interface Clock {
  readonly now_ms: () => number;
  /** Does something after so long, unless that is called off with what it answers. */
  readonly later: (then: () => void, ms: number) => () => void;
  /** From 0 to 1, so that pauses differ from visitor to visitor. */
  readonly random: () => number;
}

export interface HearingParts {
  readonly clock: Clock;
  readonly open: () => EventStream;
  /** Asks whether there is a stream; nothing where nobody answers. */
  readonly ask: () => Promise<Response | undefined>;
  /** Whether an answer says that the session has ended. */
  readonly isLost: (answer: Response) => boolean;
  /** A stream begins, which tells all there is. */
  readonly begins: () => void;
  readonly heard: (name: (typeof EVENT_NAMES)[number], data: string) => void;
  /** It has broken off, and its promises with it. */
  readonly breaks: () => void;
  /** It does not come back soon. */
  readonly givenUp: () => void;
  /** It is heard again. */
  readonly back: () => void;
  readonly lost: () => void;
}

const [STREAM_OPEN, STREAM_CLOSED] = [1, 2];
/** Between two requests for a stream. */
const LENGTHS = { first_ms: 2000, longest_ms: 60_000 };
/** A stream that breaks off before that would do so again. */
const LASTING_MS = 10_000;

export class Hearing {
  private stream: EventStream;
  private down = false;
  private up_ms: number;
  private isClosed = false;
  private callOff: () => void = () => {};
  private readonly pauses: Pauses;

  /** Begins to listen; fails where nobody can. */
  constructor(private readonly parts: HearingParts) {
    this.pauses = new Pauses(LENGTHS, parts.clock.random);
    this.up_ms = parts.clock.now_ms();
    this.stream = parts.open();
    this.listen();
  }

  /** Whether the stream has broken off and is not here again: what is said then is heard by nobody. */
  get isDown(): boolean {
    return this.down;
  }

  /** Looks whether the browser has taken up what broke off; nothing tells. */
  look(): void {
    if (!this.down || this.stream.readyState !== STREAM_OPEN) return;
    this.down = false;
    this.up_ms = this.parts.clock.now_ms();
    this.parts.back();
  }

  close(): void {
    this.isClosed = true;
    this.callOff();
    this.stream.close();
  }

  private listen(): void {
    const { parts, stream } = this;
    const isCurrent = () => !this.isClosed && this.stream === stream;
    parts.begins();
    for (const name of EVENT_NAMES) {
      stream.addEventListener(name, ({ data }) => {
        if (!isCurrent()) return;
        this.look();
        parts.heard(name, data);
      });
    }
    stream.onerror = () => {
      if (isCurrent()) this.fails();
    };
  }

  private fails(): void {
    const { parts, stream } = this;
    const isShort = parts.clock.now_ms() - this.up_ms < LASTING_MS;
    const isHopeless = stream.readyState === STREAM_CLOSED || this.down || isShort;
    this.down = true;
    parts.breaks();
    if (!isHopeless) return;
    stream.close();
    parts.givenUp();
    this.resumeLater();
  }

  private resumeLater(answer?: Response): void {
    const { now_ms, later } = this.parts.clock;
    const now = now_ms();
    this.callOff = later(() => void this.resume(), this.pauses.after(now, answer) - now);
  }

  /** Listens again to a stream that was refused, as by a proxy that has lost its server for a while. */
  private async resume(): Promise<void> {
    const { parts } = this;
    const answer = await parts.ask();
    if (this.isClosed) return;
    if (answer && parts.isLost(answer)) parts.lost();
    else if (answer?.ok) {
      this.stream = parts.open();
      this.listen();
    } else this.resumeLater(answer);
  }
}
