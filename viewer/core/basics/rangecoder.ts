/**
 * How are decisions read that were written in fractions of a bit? An adaptive binary range coder, the same as in the scene
 * crate: whole numbers only, 32 bits, carryless. Every decision has a {@link Bit} that learns how likely it is.
 *
 * What codes with a {@link Coder} serves both directions: each call is given what shall be written and gives what stands in
 * the stream; a decoder ignores what it is given. (The viewer only reads; its tests also write.)
 *
 * Guarantee: a decoder refuses to go on more than four bytes behind the end, and a decision takes at least 1/89 of a bit,
 * so work and memory are linear in the bytes that are there.
 */
export class CellRecordError extends Error {
  override readonly name = "CellRecordError";
}

export function damaged(what: string): never {
  throw new CellRecordError(`cell record is damaged: ${what}`);
}

const SLOWEST = 30;
const LEAST = 512;

/** Learns how likely a decision is. */
export class Bit {
  /** Chance of a 1, in 1/65536. */
  chance = 32768;
  private seen = 0;

  learn(bit: boolean): void {
    const rate = Math.floor(8192 / (2 * this.seen + 3));
    const chance = this.chance + ((((bit ? 65535 : 0) - this.chance) * rate) >> 12);
    this.chance = Math.min(Math.max(chance, LEAST), 65536 - LEAST);
    this.seen = Math.min(this.seen + 1, SLOWEST);
  }
}

export function bits(count: number): Bit[] {
  return Array.from({ length: count }, () => new Bit());
}

/** Writes decisions, or reads them. */
export interface Coder {
  /** One decision. Gives the one that stands in the stream. */
  bit(model: Bit, bit: boolean): boolean;
}

/** The numbers from `low` to `high` are those that begin with what was read so far. */
export class Interval {
  low = 0;
  high = 0xffff_ffff;

  /** The last number that stands for a 1. */
  split(chance: number): number {
    return this.low + Math.floor(((this.high - this.low) * chance) / 65536);
  }

  narrow(split: number, bit: boolean): void {
    if (bit) this.high = split;
    else this.low = split + 1;
  }

  /** Whether the first byte is decided; takes it out. */
  shift(): number | undefined {
    const first = this.low >>> 24;
    if (first !== this.high >>> 24) return undefined;
    this.low = (this.low << 8) >>> 0;
    this.high = ((this.high << 8) | 0xff) >>> 0;
    return first;
  }
}

export class Decoder implements Coder {
  private readonly interval = new Interval();
  private number = 0;
  private taken = 0;

  constructor(private readonly bytes: Uint8Array) {
    for (let i = 0; i < 4; i += 1) this.take();
  }

  bit(model: Bit): boolean {
    const split = this.interval.split(model.chance);
    const bit = this.number <= split;
    this.interval.narrow(split, bit);
    model.learn(bit);
    while (this.interval.shift() !== undefined) {
      this.take();
      if (this.taken > this.bytes.length + 4) damaged("its stream ends early");
    }
    return bit;
  }

  /** The stream must end where its last decision does. */
  finish(): void {
    if (this.taken < this.bytes.length) damaged("its stream goes on after its last decision");
  }

  private take(): void {
    this.number = ((this.number << 8) | (this.bytes[this.taken] ?? 0)) >>> 0;
    this.taken += 1;
  }
}

const LONGEST = 32;

/** Learns how large numbers are: their length in bits in unary, the two bits below the first, the rest as they are. */
export class NumberModel {
  private readonly longer = bits(LONGEST);
  private readonly leading = Array.from({ length: LONGEST }, () => bits(3));

  /** A number up to 2³² − 1. */
  code(coder: Coder, number = 0): number {
    const given = number + 1;
    let length = 0;
    while (length < LONGEST && coder.bit(this.longer[length] as Bit, given >= 2 ** (length + 1))) length += 1;
    let found = 1;
    for (let at = length - 1; at >= 0; at -= 1) {
      const learns = length - 1 - at < 2;
      const model = learns ? (this.leading[length - 1]?.[found - 1] as Bit) : new Bit();
      const bit = coder.bit(model, Math.floor(given / 2 ** at) % 2 === 1);
      found = 2 * found + (bit ? 1 : 0);
    }
    return found - 1 > 0xffff_ffff ? damaged("a number has more than 32 bits") : found - 1;
  }
}

/** Learns which of 2ⁿ symbols is likely, first bit first. */
export class SymbolModel {
  private readonly nodes: readonly Bit[];

  constructor(private readonly count: number) {
    this.nodes = bits(count);
  }

  code(coder: Coder, symbol = 0): number {
    let node = 1;
    for (let half = this.count / 2; half >= 1; half /= 2) {
      const bit = coder.bit(this.nodes[node] as Bit, (symbol & half) !== 0);
      node = 2 * node + (bit ? 1 : 0);
    }
    return node - this.count;
  }
}

/** Which way a number went: 0 none, 1 down, 2 up. */
export type Way = 0 | 1 | 2;

/** Learns how a small number changes from what it was. */
export class ChangeModel {
  private readonly changed = bits(3);
  private readonly up = bits(3);
  private readonly size = new NumberModel();

  /** `near` is the way that something related went. */
  code(coder: Coder, near: Way, before: number, after: number): { after: number; way: Way } {
    if (!coder.bit(this.changed[near] as Bit, after !== before)) return { after: before, way: 0 };
    const up = coder.bit(this.up[near] as Bit, after > before);
    const size = this.size.code(coder, Math.max(Math.abs(after - before) - 1, 0)) + 1;
    return up ? { after: before + size, way: 2 } : { after: before - size, way: 1 };
  }
}
