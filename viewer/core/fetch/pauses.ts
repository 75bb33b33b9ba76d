/**
 * When is a server that failed asked again? After a pause that grows from time to time, so that nobody hammers one that is down; that differs
 * from visitor to visitor, so that they do not all come back at once; and that is no shorter than the server itself asks for.
 */

/** Pauses are longer or shorter by up to this share. */
const JITTER = 0.2;
/** Who is told to wait for longer asks after that nevertheless. */
const MOST_ASKED_MS = 3_600_000;

export interface PauseLengths {
  readonly first_ms: number;
  readonly longest_ms: number;
  /** Where nothing failed for so long, the pause is the first again; as long as the longest unless given. */
  readonly calm_ms?: number;
}

/** The pause after so many tries; `random` is from 0 to 1. */
function grown_ms({ first_ms, longest_ms }: PauseLengths, tries: number, random: number): number {
  return Math.min(longest_ms, first_ms * 2 ** tries) * (1 + JITTER * (2 * random - 1));
}

/** How long a server asks to be left alone, in seconds or until a date; not at all unless it says so. */
export function retryAfter_ms(headers: Headers, date_ms = Date.now()): number {
  const said = headers.get("Retry-After")?.trim() ?? "";
  const asked_ms = /^\d+$/.test(said) ? Number(said) * 1000 : Date.parse(said) - date_ms;
  return Math.min(MOST_ASKED_MS, Math.max(0, asked_ms || 0));
}

/** What was answered when a try failed. */
export interface Answer {
  readonly headers: Headers;
}

export class Pauses {
  private tries = 0;
  private until_ms = -Infinity;

  constructor(
    private readonly lengths: PauseLengths,
    private readonly random: () => number = Math.random,
  ) {}

  /** A try has ended: when the next may begin. Where none was needed for long enough, the pause is the first again. */
  after(now_ms: number, answer?: Answer): number {
    const { lengths } = this;
    if (now_ms - this.until_ms > (lengths.calm_ms ?? lengths.longest_ms)) this.tries = 0;
    const random = this.random();
    const asked_ms = answer ? retryAfter_ms(answer.headers) * (1 + JITTER * random) : 0;
    this.until_ms = now_ms + Math.max(asked_ms, grown_ms(lengths, this.tries, random));
    this.tries += 1;
    return this.until_ms;
  }

  /** All is well: the next pause is the first again. */
  over(): void {
    this.tries = 0;
  }
}
