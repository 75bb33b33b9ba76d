/**
 * What stays on this device from visit to visit? Immutable objects by the hash in their name, wherever they came from, in
 * the browser's Cache Storage: verified before they are kept, and by who reads them, since all pages of an origin share it; bounded in bytes, the longest unused going first. Rungs have
 * no hash of their own: they are kept as they come, for worlds of the server alone that sent them, and dropped when the whole turns
 * out to be damaged.
 *
 * Cache Storage exists in secure contexts only (https and localhost); elsewhere there is no shelf, and what browsers
 * keep by themselves has to do. Pointers, live routes and bundles never get here: their URLs name no object.
 */

/** What of a `Cache` is needed (`compartments.ts`). */
export interface Compartment {
  match(url: string): Promise<Response | undefined>;
  /** What is found again says its size in a `Content-Length`. */
  put(url: string, bytes: ArrayBuffer): Promise<void>;
  delete(url: string): Promise<boolean>;
  keys(): Promise<readonly { readonly url: string }[]>;
}

/** What of `CacheStorage` is needed. */
export interface Compartments {
  open(name: string): Promise<Compartment>;
}

const NAME = "belvedere-objects-1";
/** Nobody is asked for these addresses: they are names in the cache. */
const PLACE = "https://objects.invalid/";
const INDEX = `${PLACE}index`;
const OBJECT = /\/o\/([0-9a-f]{64}(?:\.r[0-9]{1,3})?\.[a-z0-9]{1,8})$/;
const HASH_DIGITS = 64;
const SIZE = "Content-Length";
/** What was used is written down so long after it changed. */
const SAVE_AFTER_MS = 1000;

export class Shelf {
  /** Sizes by name, the longest unused first. */
  private readonly sizes = new Map<string, number>();
  private total = 0;
  private saving: ReturnType<typeof setTimeout> | undefined;
  private work: Promise<unknown> = Promise.resolve();
  private unfinished = 0;

  private constructor(
    private readonly compartment: Compartment,
    readonly limit_bytes: number,
    /** Before the names of rungs. */
    private readonly sender: string,
  ) {}

  /** For what a server sends, of which the origin is given; `undefined` where this browser keeps nothing. */
  static async open(
    compartments: Compartments | undefined,
    limit_bytes: number,
    origin: string,
  ): Promise<Shelf | undefined> {
    try {
      const compartment = await compartments?.open(NAME);
      if (!compartment) return undefined;
      const shelf = new Shelf(compartment, limit_bytes, `${encodeURIComponent(origin)}/`);
      await shelf.takeStock();
      return shelf;
    } catch {
      // Private windows and full disks refuse; then everything is fetched.
      return undefined;
    }
  }

  get bytes(): number {
    return this.total;
  }

  /** How many objects there are. */
  get size(): number {
    return this.sizes.size;
  }

  /** Writes that are still to be done; who leaves before loses what they would have kept. */
  get pending(): number {
    return this.unfinished + (this.saving === undefined ? 0 : 1);
  }

  has(url: string): boolean {
    // Asked for every file while one plans, so not by an expression: nothing else ends like the name of an object.
    return this.sizes.has(this.kept(url.slice(url.lastIndexOf("/") + 1)));
  }

  /** The bytes of an object, unless it is not here or has gone. */
  async read(url: string): Promise<ArrayBuffer | undefined> {
    const name = this.nameIn(url);
    const bytes = name === undefined ? undefined : this.sizes.get(name);
    if (name === undefined || bytes === undefined) return undefined;
    const found = await this.compartment.match(PLACE + name).catch(() => undefined);
    const body = await found?.arrayBuffer().catch(() => undefined);
    if (body?.byteLength !== bytes) {
      this.forget(url);
      return undefined;
    }
    // It may have had to go meanwhile.
    if (this.sizes.delete(name)) this.sizes.set(name, bytes);
    this.save();
    return body;
  }

  /** Keeps what has been verified. What does not fit is not kept. */
  keep(url: string, bytes: ArrayBuffer): void {
    const name = this.nameIn(url);
    const size = bytes.byteLength;
    if (name === undefined || this.sizes.has(name) || size > this.limit_bytes) return;
    this.next(async () => {
      await this.compartment.put(PLACE + name, bytes);
      this.note(name, size);
      await this.makeRoom();
    });
  }

  forget(url: string): void {
    const name = this.nameIn(url);
    if (name === undefined) return;
    this.next(() => this.remove(name));
  }

  /** Removes everything. */
  async clear(): Promise<void> {
    this.next(async () => {
      for (const name of [...this.sizes.keys()]) await this.remove(name);
    });
    await this.work;
  }

  /** Once all that was asked for so far is done. */
  async done(): Promise<void> {
    await this.work;
  }

  /** Other tabs write their own lists, so what is really there counts. */
  private async takeStock(): Promise<void> {
    const index = await this.compartment.match(INDEX);
    const listed = index ? ((await index.json()) as [string, number][]) : [];
    const keys = await this.compartment.keys();
    const there = new Set(keys.map(({ url }) => url.slice(PLACE.length)));
    there.delete("index");
    for (const name of [...there].filter(isNobodys)) {
      there.delete(name);
      await this.compartment.delete(PLACE + name);
    }
    for (const [name, bytes] of listed) if (there.delete(name)) this.note(name, bytes);
    for (const name of there) {
      const bytes = (await this.compartment.match(PLACE + name))?.headers.get(SIZE);
      this.note(name, Number(bytes ?? 0));
    }
    await this.makeRoom();
  }

  private note(name: string, bytes: number): void {
    this.total += bytes - (this.sizes.get(name) ?? 0);
    this.sizes.set(name, bytes);
    this.save();
  }

  private async makeRoom(): Promise<void> {
    for (const name of [...this.sizes.keys()]) {
      if (this.total <= this.limit_bytes) return;
      await this.remove(name);
    }
  }

  private async remove(name: string): Promise<void> {
    this.total -= this.sizes.get(name) ?? 0;
    this.sizes.delete(name);
    this.save();
    await this.compartment.delete(PLACE + name);
  }

  private nameIn(url: string): string | undefined {
    const name = OBJECT.exec(url)?.[1];
    return name && this.kept(name);
  }

  /** Under which name an object is kept. What its own name does not vouch for is another one from another server. */
  private kept(name: string): string {
    return isRung(name) ? this.sender + name : name;
  }

  /** One thing after the other; what fails, as on a full disk, is only not kept. */
  private next(act: () => Promise<unknown>): void {
    this.unfinished += 1;
    const finished = () => {
      this.unfinished -= 1;
    };
    this.work = this.work.then(act).then(finished, finished);
  }

  private save(): void {
    this.saving ??= setTimeout(() => {
      this.saving = undefined;
      this.next(() => {
        const list = new TextEncoder().encode(JSON.stringify([...this.sizes]));
        return this.compartment.put(INDEX, list.buffer);
      });
    }, SAVE_AFTER_MS);
  }
}

/** Rungs were once kept without their sender; nobody asks for these. */
function isNobodys(name: string): boolean {
  return isRung(name) && !name.includes("/");
}

function isRung(name: string): boolean {
  return name.startsWith(".r", HASH_DIGITS) && name.endsWith(".slod");
}
