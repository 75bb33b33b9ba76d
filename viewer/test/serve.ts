/** Who serves a small published scene? A web server in memory, which also answers bundles when it is told to. */
import type { Files } from "./fixture.ts";

export interface ServerOptions {
  /** Offers bundles, as a server does and a static tree does not. */
  readonly bundles?: boolean;
  /** Answers ranges with that part, and not with all of the file. */
  readonly ranges?: boolean;
  /** Every answer takes so long. */
  readonly delay_ms?: number;
  /** Begins to answer some paths only after a time. */
  readonly answerAfter_ms?: (path: string, bytes: Uint8Array) => number;
  /** Answers some paths in its own way, given what the file holds. */
  readonly answer?: (path: string, bytes: Uint8Array) => BodyInit | Response | undefined;
}

/** Answers requests from files below a base, and counts them. */
export function serveFiles(
  files: Files,
  {
    bundles = false,
    ranges = false,
    delay_ms = 0,
    answerAfter_ms = () => 0,
    answer = () => undefined,
  }: ServerOptions = {},
) {
  const base = "https://host/sub/";
  const requests: string[] = [];
  const headers: HeadersInit = bundles ? { Link: '</o/bundle/>; rel="bundles"' } : {};
  const fetch = async (url: string, init: RequestInit = {}): Promise<Response> => {
    const path = url.startsWith(base) ? `/${url.slice(base.length)}` : url;
    requests.push(path);
    await new Promise((resolve) => setTimeout(resolve, delay_ms));
    if (init.signal?.aborted) throw new DOMException("aborted", "AbortError");
    const bytes = bundles && path.startsWith(BUNDLE) ? bundleOf(files, path) : files.get(path);
    if (!bytes) return new Response("", { status: 404 });
    const after_ms = answerAfter_ms(path, bytes);
    if (after_ms > 0) await new Promise((resolve) => setTimeout(resolve, after_ms));
    const own = answer(path, bytes);
    if (own instanceof Response) return own;
    const range = ranges ? new Headers(init.headers).get("Range") : null;
    if (own === undefined && range) return partOf(bytes, range);
    return new Response(own ?? (bytes as BodyInit), { headers });
  };
  return { fetch, requests };
}

/** What a server answers to a range, as in `bytes=0-9`. */
export function partOf(bytes: Uint8Array, range: string): Response {
  const [from = 0, last = 0] = (/^bytes=([0-9]+)-([0-9]+)$/.exec(range) ?? []).slice(1).map(Number);
  const headers = { "Content-Range": `bytes ${from}-${last}/${bytes.length}` };
  return new Response(bytes.slice(from, last + 1), { status: 206, headers });
}

/** Answers that begin and bring nothing before they are let. */
export class HeldAnswers {
  private readonly held: (() => void)[] = [];
  private holds: (path: string) => boolean = () => false;

  /** How many wait. */
  get count(): number {
    return this.held.length;
  }

  /** From now on holds back what is asked for at these paths, and lets go what was held before. */
  hold(holds: (path: string) => boolean): void {
    this.holds = holds;
    for (const go of this.held.splice(0)) go();
  }

  /** Lets everything come. */
  release(): void {
    this.hold(() => false);
  }

  /** For {@link ServerOptions}. */
  readonly answer = (path: string, bytes: Uint8Array): BodyInit | undefined => {
    if (!this.holds(path)) return undefined;
    return new ReadableStream<Uint8Array>({
      start: (controller) => {
        this.held.push(() => {
          controller.enqueue(bytes);
          controller.close();
        });
      },
    });
  };
}

const BUNDLE = "/o/bundle/";

/** What a server answers at the address of a bundle: a table of where members end, then the members. */
function bundleOf(files: Files, path: string): Uint8Array | undefined {
  const members = path
    .slice(BUNDLE.length)
    .split("+")
    .map((name) => files.get(`/o/${name}`));
  const head = new DataView(new ArrayBuffer(8 + 4 * members.length));
  head.setUint32(0, 0x4e425642, true);
  head.setUint16(4, 1, true);
  head.setUint16(6, members.length, true);
  let end = 0;
  for (const [i, member] of members.entries()) {
    if (!member) return undefined;
    end += member.length;
    head.setUint32(8 + 4 * i, end, true);
  }
  return new Uint8Array(Buffer.concat([new Uint8Array(head.buffer), ...members.flatMap((member) => member ?? [])]));
}
