/**
 * Who waits for one file, and what has come of it? Some wait for all of it, others for a part of it; all hear of its end.
 */
import { Incoming } from "../basics/incoming.ts";
import { Gate } from "../pace/gate.ts";
import type { RequestTrace } from "./requestlog.ts";
import { type Part, PartError, Slices } from "./slices.ts";
import type { Span } from "./span.ts";
import type { IsSound } from "./verify.ts";

/** Where from something must come: from caches that have asked whether it is still so, or past all that can be passed. */
export type Freshness = "checked" | "past caches";

/** Where a file also stands, for when it cannot be had alone: in all of the stream that a rung is of. */
export interface Within extends Span {
  readonly url: string;
  /** Whether nothing else takes its place. */
  readonly isNeeded: boolean;
}

/** What was asked for. */
export interface Wish {
  readonly url: string;
  /** Unless given, from any cache. */
  readonly fresh: Freshness | undefined;
  /** How large it is said to be. */
  readonly bytes: number | undefined;
  readonly within: Within | undefined;
  /** Which of them all was asked for earlier. */
  readonly order: number;
  readonly trace: RequestTrace | undefined;
}

export class Download {
  readonly url: string;
  readonly fresh: Freshness | undefined;
  readonly bytes: number | undefined;
  readonly within: Within | undefined;
  readonly order: number;
  readonly trace: RequestTrace | undefined;
  readonly controller = new AbortController();
  /** Which try comes next. */
  attempt = 1;
  /** Whether nothing came of it for long, so that it has given its place to others once. */
  isLate = false;
  /** Whether nothing has come for long of what was asked for last. */
  isQuiet = false;
  /** Who does something else when that happens. */
  private readonly quiet = new Gate();
  /** Whether its own address has nothing, so that it comes out of what it stands in. */
  isAbsent = false;
  /** Whether it did not come in a bundle where it should have, and now goes alone. */
  alone = false;
  /** Whether its server asked to wait when it was to come in a bundle. */
  hasBackedOff = false;
  private readonly whole: Promise<ArrayBuffer>;
  private resolve: (bytes: ArrayBuffer) => void = () => {};
  private reject: (error: unknown) => void = () => {};
  private isWantedWhole = false;
  private incoming = new Incoming();
  private isComingWhole = false;
  private readonly slices: Slices;

  constructor(
    wish: Wish,
    public priority: number,
    isSound: IsSound,
  ) {
    ({ url: this.url, fresh: this.fresh, bytes: this.bytes, within: this.within } = wish);
    ({ order: this.order, trace: this.trace } = wish);
    this.slices = new Slices(isSound);
    this.whole = new Promise((yes, no) => {
      this.resolve = yes;
      this.reject = no;
    });
    // Who waits for a part only hears of the end by that.
    this.whole.catch(() => {});
  }

  /** Whether trying again is of use: what nobody wants whole, and some had their part of, is left to be fetched part by part. */
  get isWorthAnotherTry(): boolean {
    return this.isWantedWhole || !this.slices.hasGiven;
  }

  /** Whether anybody waits for all of it. */
  get isForAll(): boolean {
    return this.isWantedWhole;
  }

  /** Whether all that was wanted of it has come, although it goes on. */
  get isServed(): boolean {
    return !this.isWantedWhole && this.slices.areServed;
  }

  /** How much is still to come, as far as it is known. */
  get rest_bytes(): number {
    return Math.max(0, this.coming_bytes - this.incoming.length);
  }

  /** How large what comes is said to be: of all that it stands in, where that comes. */
  get coming_bytes(): number {
    return (this.isComingWhole ? this.within?.of_bytes : this.bytes) ?? 0;
  }

  /** How much of it has come. */
  get came_bytes(): number {
    const before = this.isComingWhole ? (this.within?.from ?? 0) : 0;
    return Math.max(0, this.incoming.length - before);
  }

  /** Whether what comes is all that it stands in. */
  get comesWhole(): boolean {
    return this.isComingWhole;
  }

  /** Comes true when nothing comes of it for long. */
  untilQuiet(): Promise<void> {
    return this.isQuiet || this.isLate ? Promise.resolve() : this.quiet.next();
  }

  /** It gives its place to others, and is tried once more later. */
  fallsBehind(): void {
    this.isLate = true;
    this.attempt += 1;
  }

  fallsQuiet(): void {
    this.isQuiet = true;
    this.quiet.open();
  }

  all(): Promise<ArrayBuffer> {
    this.isWantedWhole = true;
    return this.whole;
  }

  part(part: Part, isWanted: () => boolean = () => true): Promise<ArrayBuffer> {
    const given = this.slices.ask(part, isWanted);
    this.slices.look(this.incoming);
    return given;
  }

  /** Parts of it that have come. */
  given(): { readonly url: string; readonly bytes: ArrayBuffer }[] {
    const come = this.slices.given.filter(({ from, bytes }) => from + bytes <= this.incoming.length);
    return come.map(({ url, from, bytes }) => ({ url, bytes: this.incoming.slice(from, from + bytes) }));
  }

  /** It is asked for, for the first time or once more. */
  starts(): void {
    this.trace?.starts();
    this.isQuiet = false;
    this.isComingWhole = false;
    this.incoming = new Incoming(this.bytes);
  }

  receives(piece: Uint8Array, isAll: boolean): void {
    this.trace?.receives(piece.byteLength);
    this.isQuiet = false;
    this.isComingWhole = isAll;
    this.incoming.push(piece);
    this.slices.look(this.incoming);
  }

  /** What has come, when that is all of it. */
  taken(): ArrayBuffer {
    return this.incoming.slice(0, this.incoming.length);
  }

  succeeds(bytes: ArrayBuffer, result: "done" | "kept"): void {
    this.trace?.ends(result);
    this.resolve(bytes);
    this.slices.look(Incoming.of(bytes));
    this.slices.end(new PartError(`${this.url} is too short for what should stand in it`));
  }

  fails(error: unknown, result: "failed" | "cancelled" | undefined): void {
    if (result) this.trace?.ends(result);
    this.reject(error);
    this.slices.end(error);
  }
}
