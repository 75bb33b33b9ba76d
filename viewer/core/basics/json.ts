/**
 * Is this JSON what it claims to be? Readers that check once at the edge and name the place of what is wrong.
 */
import type { Bounds, Vec3 } from "./geometry.ts";

/** A published document that does not hold what the format promises. */
export class DocumentError extends Error {
  override readonly name = "DocumentError";

  constructor(
    readonly place: string,
    expected: string,
  ) {
    super(`${place} should be ${expected}`);
  }
}

/** So much of what is no JSON is said back. */
const SAID_CHARACTERS = 60;

/** How a text begins that came instead of a document: the page of somebody on the way, say. */
function beginning(text: string): string {
  const said = [...text.trim().slice(0, 2 * SAID_CHARACTERS)].slice(0, SAID_CHARACTERS).join("");
  return said === "" ? "but it is empty" : `but it begins with “${said}”`;
}

/** A JSON value together with the place where it stands, which is put into words only where something is wrong. */
export class Json {
  /** `step` leads here from the value that holds this one; without one it is the name of a document. */
  constructor(
    private readonly value: unknown,
    private readonly step: string | number,
    private readonly holder?: Json,
  ) {}

  private get place(): string {
    const { step, holder } = this;
    if (!holder) return String(step);
    return typeof step === "number" ? `${holder.place}[${step}]` : `${holder.place}.${step}`;
  }

  static parse(text: string, place: string): Json {
    try {
      return new Json(JSON.parse(text), place);
    } catch {
      throw new DocumentError(place, `JSON, ${beginning(text)}`);
    }
  }

  field(name: string): Json {
    if (typeof this.value !== "object" || this.value === null || Array.isArray(this.value)) this.fail("an object");
    return new Json((this.value as Record<string, unknown>)[name], name, this);
  }

  optional<T>(read: (json: Json) => T): T | undefined {
    return this.value === undefined || this.value === null ? undefined : read(this);
  }

  list<T>(read: (json: Json) => T): T[] {
    if (!Array.isArray(this.value)) return this.fail("a list");
    return this.value.map((item, i) => read(new Json(item, i, this)));
  }

  entries<T>(read: (json: Json, key: string) => T): [string, T][] {
    if (typeof this.value !== "object" || this.value === null || Array.isArray(this.value)) this.fail("an object");
    return Object.entries(this.value as object).map(([key, item]) => [key, read(new Json(item, key, this), key)]);
  }

  get isList(): boolean {
    return Array.isArray(this.value);
  }

  text(): string {
    return typeof this.value === "string" ? this.value : this.fail("a text");
  }

  boolean(): boolean {
    return typeof this.value === "boolean" ? this.value : this.fail("true or false");
  }

  number(): number {
    return typeof this.value === "number" && Number.isFinite(this.value) ? this.value : this.fail("a finite number");
  }

  /** A whole number from 0 on that a double holds exactly: counts, sizes in bytes, indices. */
  count(): number {
    const value = this.value;
    return typeof value === "number" && Number.isSafeInteger(value) && value >= 0 ? value : this.fail("a count");
  }

  /** A count or an index that has 32 bits, as all that is numbered by ids. */
  u32(): number {
    const value = this.count();
    return value <= MOST_U32 ? value : this.fail("a whole number of 32 bits");
  }

  numbers(length: number): number[] {
    const { value } = this;
    if (Array.isArray(value) && value.length === length && value.every(Number.isFinite)) return value;
    const numbers = this.list((item) => item.number());
    return numbers.length === length ? numbers : this.fail(`a list of ${length} numbers`);
  }

  vec3(): Vec3 {
    const [x = 0, y = 0, z = 0] = this.numbers(3);
    return [x, y, z];
  }

  bounds(): Bounds {
    return { min: this.field("min").vec3(), max: this.field("max").vec3() };
  }

  /** A dense id such as `c12`, as its number. */
  id(letter: "c" | "m" | "o"): number {
    const id = denseId(letter, this.text());
    return id ?? this.fail(`an id like ${letter}12`);
  }

  /** The URL of an immutable object: `/o/`, 64 hex digits, a dot, an extension. */
  blob(): string {
    const url = this.text();
    return BLOB_URL.test(url) ? url : this.fail("the URL of an immutable object");
  }

  /** The URL of a rung of a smooth LOD: `/o/`, 64 hex digits, `.r`, its number, `.slod`. */
  rung(): string {
    const url = this.text();
    return RUNG_URL.test(url) ? url : this.fail("the URL of a rung");
  }

  fail(expected: string): never {
    throw new DocumentError(this.place, expected);
  }
}

const MOST_U32 = 0xffff_ffff;
const BLOB_URL = /^\/o\/[0-9a-f]{64}\.[a-z0-9]{1,8}$/;
const RUNG_URL = /^\/o\/[0-9a-f]{64}\.r(0|[1-9][0-9]{0,2})\.slod$/;

/** Reads `c12` as 12, or `undefined` when the text is no such id. */
export function denseId(letter: "c" | "m" | "o", text: string): number | undefined {
  if (!text.startsWith(letter) || !/^(0|[1-9][0-9]{0,9})$/.test(text.slice(1))) return undefined;
  const id = Number(text.slice(1));
  return id <= MOST_U32 ? id : undefined;
}
