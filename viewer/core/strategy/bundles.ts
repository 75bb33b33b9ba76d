/**
 * How do many small files come with one request? As a bundle, where the server offers them (`docs/FORMAT.md`): one address
 * names them all, and its answer holds them one after the other. They are taken out while it arrives.
 */
import { Incoming } from "../basics/incoming.ts";
import { compressed_bytes } from "./file.ts";
import { AHEAD_S } from "./meter.ts";

/** What a name takes in the address of a bundle, and its place in the table. */
export const NAME_BYTES = 75;
/** What is larger gains little and would hold up the others. */
const MOST_MEMBER_BYTES = 16 * 1024;
/** So much comes together at most, and no more than the line brings in {@link AHEAD_S}, so that what turns out to be urgent on a slow line need not wait long. */
const MOST_BYTES = 32 * 1024;
const MOST_MEMBERS = 64;
/** No member of an answer ends behind this. */
const MOST_ANSWER_BYTES = 8 * 1024 * 1024;
const MAGIC = 0x4e425642;
const VERSION = 1;
const HEAD_BYTES = 8;

/** Something that may come in a bundle. */
export interface Member {
  readonly url: string;
  /** Its size, as the documents say it. */
  readonly bytes: number | undefined;
}

/** An answer is no bundle of these members. */
export class BundleError extends Error {
  override readonly name = "BundleError";
}

/** Whether a `Link` header offers bundles. */
export function offersBundles(headers: Headers): boolean {
  return /;\s*rel="?bundles"?/.test(headers.get("Link") ?? "");
}

/**
 * Whether something may come in a bundle: a small object or rung that does not take more so than alone. Members are not
 * compressed, so what shrinks by more than a request costs is better fetched alone.
 */
export function isSmall({ url, bytes }: Member, request_bytes: number): boolean {
  if (bytes === undefined || bytes > MOST_MEMBER_BYTES) return false;
  if (bytes + NAME_BYTES > compressed_bytes({ url, bytes }) + request_bytes) return false;
  return /\/o\/[0-9a-f]{64}(\.r[0-9]{1,3})?\.[a-z0-9]{1,8}$/.test(url);
}

/** The first members that fit into one bundle on a line of this speed, of small ones in the order in which they are wanted. */
export function together<T extends Member>(members: Iterable<T>, bytes_per_s: number): T[] {
  const most_bytes = Math.min(MOST_BYTES, Math.trunc(AHEAD_S * bytes_per_s));
  const taken: T[] = [];
  let [total, folder] = [0, ""];
  for (const member of members) {
    const { url, bytes = 0 } = member;
    folder ||= folderOf(url);
    if (taken.length === MOST_MEMBERS || (taken.length > 0 && total + bytes > most_bytes)) break;
    if (folderOf(url) !== folder) continue;
    taken.push(member);
    total += bytes;
  }
  return taken;
}

/** Members in the order in which an address names them, so that who wants the same asks for the same. */
export function inOrder<T extends Member>(members: readonly T[]): T[] {
  return [...members].sort((a, b) => (a.url < b.url ? -1 : 1));
}

/** The address of a bundle, beside its members. */
export function addressOf(members: readonly Member[]): string {
  const names = members.map(({ url }) => url.slice(folderOf(url).length));
  return `${folderOf(members[0]?.url ?? "")}bundle/${names.join("+")}`;
}

function folderOf(url: string): string {
  return url.slice(0, url.lastIndexOf("/") + 1);
}

/** Takes members out of a bundle as its bytes come. */
export class BundleReader {
  private readonly incoming = new Incoming();
  private given = 0;

  constructor(private readonly members: number) {}

  /** Whether all members were given, and nothing else came. */
  get isWhole(): boolean {
    return this.given === this.members && this.incoming.length === this.tableBytes + this.end(this.members - 1);
  }

  /** Takes in the next piece; answers the members that are whole by now, in their order. */
  push(piece: Uint8Array): ArrayBuffer[] {
    const { incoming } = this;
    incoming.push(piece);
    if (incoming.length < this.tableBytes) return [];
    if (this.given === 0) this.checkHead();
    const whole: ArrayBuffer[] = [];
    while (this.given < this.members && incoming.length >= this.tableBytes + this.end(this.given)) {
      const from = this.given === 0 ? 0 : this.end(this.given - 1);
      const to = this.end(this.given);
      whole.push(incoming.slice(this.tableBytes + from, this.tableBytes + to));
      this.given += 1;
    }
    return whole;
  }

  private get tableBytes(): number {
    return HEAD_BYTES + 4 * this.members;
  }

  private end(member: number): number {
    return this.incoming.view.getUint32(HEAD_BYTES + 4 * member, true);
  }

  private checkHead(): void {
    const { view } = this.incoming;
    const right = view.getUint32(0, true) === MAGIC && view.getUint16(4, true) === VERSION;
    if (!right || view.getUint16(6, true) !== this.members) {
      throw new BundleError(`this is no bundle of ${this.members} members in version ${VERSION}`);
    }
    let from = 0;
    for (let member = 0; member < this.members; member += 1) {
      const to = this.end(member);
      if (to < from) throw new BundleError("a bundle's members end before they begin");
      if (to > MOST_ANSWER_BYTES) throw new BundleError(`a bundle has at most ${MOST_ANSWER_BYTES} bytes`);
      from = to;
    }
  }
}
