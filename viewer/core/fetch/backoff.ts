/**
 * Has a server asked to be left alone? One that answers 429 or 503 with `Retry-After` (RFC 9110, §10.2.3) has too much to do for anything
 * that one could ask of it, and not only for what it was asked just now. So nothing is asked of it for that long.
 */
import { retryAfter_ms } from "./pauses.ts";
import type { FetchError } from "./transfer.ts";

/** Answers that are about the server as a whole. */
const BUSY = [429, 503];
/** Who asks to be left alone for longer is asked after that nevertheless. */
const LONGEST_MS = 300_000;
/** One waits for longer by up to this share, so that not all come back at once. */
const SPREAD = 0.2;

interface LeftAlone {
  readonly until_ms: number;
  readonly timer: ReturnType<typeof setTimeout>;
}

export class BackOff {
  private readonly servers = new Map<string, LeftAlone>();

  /** `over` hears of each back-off that has ended. */
  constructor(
    private readonly over: () => void,
    private readonly random: () => number = Math.random,
  ) {}

  /** A try has failed; the answer may ask for a back-off. One that several answers ask for is as long as the longest of them. */
  hears({ url, status, headers }: FetchError): void {
    if (!headers || !BUSY.includes(status ?? 0)) return;
    const asked_ms = Math.min(LONGEST_MS, retryAfter_ms(headers)) * (1 + SPREAD * this.random());
    if (asked_ms <= this.left_ms(url)) return;
    const server = serverOf(url);
    clearTimeout(this.servers.get(server)?.timer);
    const end = () => {
      this.servers.delete(server);
      this.over();
    };
    this.servers.set(server, { until_ms: performance.now() + asked_ms, timer: setTimeout(end, asked_ms) });
  }

  /** Whether the server at an address is left alone. */
  isOn(url: string): boolean {
    return this.servers.size > 0 && this.servers.has(serverOf(url));
  }

  /** For how long it still is. */
  left_ms(url: string): number {
    return Math.max(0, (this.servers.get(serverOf(url))?.until_ms ?? 0) - performance.now());
  }

  /** Nobody waits any more. */
  close(): void {
    for (const { timer } of this.servers.values()) clearTimeout(timer);
    this.servers.clear();
  }
}

function serverOf(url: string): string {
  return URL.canParse(url) ? new URL(url).host : "";
}
