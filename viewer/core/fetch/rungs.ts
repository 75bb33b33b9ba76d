/**
 * How does a rung come where its tree has none? As a range of its stream, and its own address is not tried again. A server that ignores
 * ranges answers with all of the stream, which is verified by its hash and has all rungs; it is asked for no other stream, unless a model
 * can be drawn with nothing else: what one rung costs there, levels undercut ({@link Rungs.isForgone}). One that answers with something else is asked
 * for no more ranges. The same rules as in `client/src/fetch.rs`, where an answer counts once it has come; here it does from when it begins,
 * unless it goes wrong, so that levels need not wait for all of a stream.
 */
import type { Hooks } from "./carrier.ts";
import type { Download, Within } from "./download.ts";
import type { Span } from "./span.ts";
import { FetchError } from "./transfer.ts";
import { streamOf } from "./verify.ts";

/** How a download comes, if not from its own address. */
export interface Way {
  readonly url: string;
  readonly span: Span;
  /** Whether it is the server who must answer, and no cache on the way. */
  readonly pastCache: boolean;
  /** Hears, when it begins to come, whether that is all of a file and not only the part. */
  readonly begins: (isAll: boolean) => void;
}

type Carry = (download: Download, hooks: Hooks, way?: Way) => Promise<ArrayBuffer>;

/** All of a stream. */
interface Whole {
  readonly url: string;
  readonly bytes: ArrayBuffer;
}

const BY_RANGE = "by range, as the rung is not there";
const BY_STREAM = "with all of its stream, as the rung is not there and ranges are ignored";

/** A rung has to wait until more is known, and gives its place to others. */
export class Postponed extends Error {
  override readonly name = "Postponed";
}

/** Who wants a rung that would bring another stream whole hears this. */
function forgone(url: string): FetchError {
  return new FetchError("forgone", url, `${url} would come with all of its stream, as ranges are ignored`);
}

export class Rungs {
  /** Whether rungs have no addresses of their own. */
  private hasNone = false;
  /** Whether ranges were found to be answered with that, or with all of the file. */
  private ranges: "unknown" | "kept" | "ignored" = "unknown";
  /** Whether all of a stream came in place of a range, and was what its name promises: who ignored a range so is asked for no other. */
  private isProven = false;
  /** They were answered with something else. */
  private refusal: FetchError | undefined;
  /** Where ranges are ignored, the last stream that came whole, which no budget of memory counts. */
  private whole: Whole | undefined;
  /** Streams of which a part is asked for. */
  private readonly asked = new Set<string>();

  constructor(private readonly carry: Carry) {}

  /** Whether a rung need not travel, by its address or by how documents write that. */
  holds(rung: string): boolean {
    const stream = this.whole && streamOf(rung);
    return stream !== undefined && this.whole?.url.endsWith(stream) === true;
  }

  /** Whether a rung, by either address, would bring all of another stream. */
  isForgone(rung: string): boolean {
    const stream = this.ranges === "ignored" ? streamOf(rung) : undefined;
    const isComing = () => [...this.asked].some((url) => url.endsWith(stream ?? url));
    return stream !== undefined && !this.holds(rung) && !isComing();
  }

  /** A rung of the stream that came whole. */
  copyOf({ url, from, to }: Within): ArrayBuffer | undefined {
    return this.whole?.url === url ? this.whole.bytes.slice(from, to) : undefined;
  }

  /** A stream turned out to be damaged. */
  forget(stream: string): void {
    if (this.whole?.url.endsWith(stream)) this.whole = undefined;
  }

  /** Whether a rung would be {@link Postponed} again. */
  waits({ within, isAbsent }: Download): boolean {
    return within !== undefined && isAbsent && this.mustWait(within.url);
  }

  /** Fails with {@link Postponed} where a rung has to wait. */
  async bring(download: Download, within: Within, hooks: Hooks): Promise<ArrayBuffer> {
    if (!download.isAbsent && !this.hasNone && this.ranges !== "ignored") {
      try {
        return await this.carry(download, hooks);
      } catch (error) {
        if (!(error instanceof FetchError) || error.kind !== "status") throw error;
        // From another address it is tried as often.
        download.attempt = 1;
      }
    }
    download.isAbsent = true;
    if (this.mustWait(within.url)) throw new Postponed();
    const copy = this.copyOf(within);
    if (copy) return copy;
    if (this.refusal) throw this.refusal;
    // Levels are the better buy now.
    if (this.ranges === "ignored" && !within.isNeeded) throw forgone(download.url);
    return await this.bringPart(download, within, hooks);
  }

  private async bringPart(download: Download, within: Within, hooks: Hooks): Promise<ArrayBuffer> {
    const { url, from, to } = within;
    const begins = (isAll: boolean) => {
      download.trace?.detours(isAll ? BY_STREAM : BY_RANGE);
      this.learn(isAll);
      hooks.learnt();
    };
    // A cache that has all of a stream answers a range whatever the server does with it.
    const pastCache = this.ranges !== "kept" && !this.isProven;
    this.asked.add(url);
    try {
      const bytes = await this.carry(download, hooks, { url, span: within, pastCache, begins });
      if (!download.comesWhole) return bytes;
      this.ranges = "ignored";
      this.isProven = true;
      this.whole = { url, bytes };
      return bytes.slice(from, to);
    } catch (error) {
      if (error instanceof FetchError && error.kind === "range") {
        this.refusal = error;
        // Its own address is all that is left of another.
        this.hasNone = false;
      }
      // It looked as if all came, and did not.
      if (this.ranges === "ignored" && !this.isProven) this.ranges = "unknown";
      throw error;
    } finally {
      this.asked.delete(url);
    }
  }

  /** It begins to come. That all of a stream comes is believed as long as it goes well. */
  private learn(isAll: boolean): void {
    this.hasNone = true;
    if (!this.isProven) this.ranges = isAll ? "ignored" : "kept";
  }

  /** As long as nobody knows how ranges are answered, one asks at a time; and where all of a stream comes, others who want it wait for that. */
  private mustWait(stream: string): boolean {
    if (this.ranges === "kept") return false;
    return this.ranges === "unknown" ? this.asked.size > 0 : this.asked.has(stream);
  }
}
