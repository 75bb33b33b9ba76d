/**
 * What was asked for, why, and how did it end? The last downloads in the order in which they were asked for.
 */
import type { Purpose } from "../strategy/priority.ts";

export type Result = "waiting" | "running" | "done" | "kept" | "cancelled" | "failed";

export interface LoggedRequest {
  readonly url: string;
  readonly purpose: Purpose;
  /** Why it is wanted, in words. */
  readonly reason: string;
  /** How it comes, where that is not from its own address, and why. */
  readonly detour: string | undefined;
  readonly asked_ms: number;
  /** When it went over the wire for the first time. */
  readonly started_ms: number | undefined;
  readonly ended_ms: number | undefined;
  /** Body bytes so far, those of failed tries included. */
  readonly bytes: number;
  readonly tries: number;
  readonly result: Result;
}

type Entry = { -readonly [field in keyof LoggedRequest]: LoggedRequest[field] };

/** What the queue tells of one download. */
export interface RequestTrace {
  starts(): void;
  receives(bytes: number): void;
  detours(how: string): void;
  ends(result: "done" | "kept" | "cancelled" | "failed"): void;
}

export class RequestLog {
  private readonly kept: Entry[] = [];

  constructor(
    private readonly now_ms: () => number,
    private readonly most = 400,
  ) {}

  /** Oldest first. */
  get entries(): readonly LoggedRequest[] {
    return this.kept;
  }

  asks(url: string, purpose: Purpose, reason: string): RequestTrace {
    const entry: Entry = {
      url,
      purpose,
      reason,
      detour: undefined,
      asked_ms: this.now_ms(),
      started_ms: undefined,
      ended_ms: undefined,
      bytes: 0,
      tries: 0,
      result: "waiting",
    };
    this.kept.push(entry);
    if (this.kept.length > this.most) this.kept.shift();
    return {
      starts: () => {
        entry.started_ms ??= this.now_ms();
        entry.tries += 1;
        entry.result = "running";
      },
      receives: (bytes) => {
        entry.bytes += bytes;
      },
      detours: (how) => {
        entry.detour = how;
      },
      ends: (result) => {
        entry.ended_ms ??= this.now_ms();
        entry.result = result;
      },
    };
  }
}
