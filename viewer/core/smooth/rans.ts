/**
 * How are decisions read that were written in fractions of a bit? From two interleaved range coders of the ANS family
 * (Duda 2013; Giesen 2014), with models that learn from what was decided: the counterpart of `rans` and `model` in the
 * scene crate, `docs/SLOD.md` §2.
 *
 * A model is a number that a {@link ModelSpace} gave out. The sixteen cumulative chances of a symbol's model stand two
 * in one 32-bit word and learn two at a time; this is what decoding spends most of its time on.
 */
import { bytesOf } from "./list.ts";

/** Why a smooth LOD cannot be decoded. */
export class SmoothError extends Error {
  override readonly name = "SmoothError";
}

export function damaged(what: string): never {
  throw new SmoothError(`this smooth LOD is damaged: ${what}; fetch it again`);
}

/** Gives out models. */
export class ModelSpace {
  bitCount = 0;
  nibbleCount = 0;

  /** The first of so many models of a bit. */
  bits(count: number): number {
    this.bitCount += count;
    return this.bitCount - count;
  }

  /** The first of so many models of one of sixteen symbols. */
  nibbles(count: number): number {
    this.nibbleCount += count;
    return this.nibbleCount - count;
  }
}

const WORDS = 8;
const ONES = 0x0001_0001;
const LOW = 0xffff;
const MOST_CHANCE = 32768;
/** A state below this takes in 16 bits; an untouched one is this. */
const LOWEST = 65536;

const BIT_SETTLED = 32;
const BIT_LEAST = 64;
/** Step sizes, as shifts, by how often a model was asked. */
const BIT_RATES = Uint8Array.from({ length: 33 }, (_, i) => Math.min(Math.floor(Math.log2(i + 1)) + 1, 5 + (i >> 5)));

const NIBBLE_SETTLED = 60;
const NIBBLE_LEAST = 8;
/** By a quarter of how often a model was asked. */
const NIBBLE_RATES = Uint8Array.of(3, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 6);
/** Where two cumulative chances go that are not above the symbol, and two that are. */
const DOWN = Int32Array.from({ length: WORDS }, (_, k) => pair(2 * k * NIBBLE_LEAST, (2 * k + 1) * NIBBLE_LEAST));
const UP = DOWN.map((down) => down + ONES * (MOST_CHANCE - 16 * NIBBLE_LEAST));
/** By rate: what rounds up, and the bits of each half that stay in it when both are shifted. */
const ROUND_UP = Int32Array.from({ length: 7 }, (_, rate) => ONES * ((1 << rate) - 1));
const INSIDE = Int32Array.from({ length: 7 }, (_, rate) => ONES * (LOW >> rate));

function pair(low: number, high: number): number {
  return low | (high << 16);
}

const RAW_BITS = 15;
/** By class of a residual, the least size, and how many bits tell what is above it. */
const BASE = Int32Array.of(0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192);
const BITS = Uint8Array.of(0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 0);

/** Reads decisions. Behind the end of what is there it reads zeros and says that it is starved. */
export class Reader {
  /** The stream, as far as it has come. */
  private bytes = new Uint8Array(0);
  private end = 0;
  private taken = 0;
  private now = 0;
  private next = 0;
  private readonly zero: Int32Array;
  private readonly bitSeen: Uint8Array;
  private readonly below: Int32Array;
  private readonly nibbleSeen: Uint8Array;
  /** The class of the last {@link residual}. */
  sizeClass = 0;

  constructor(models: ModelSpace) {
    this.zero = new Int32Array(models.bitCount).fill(MOST_CHANCE / 2);
    this.bitSeen = new Uint8Array(models.bitCount);
    this.nibbleSeen = new Uint8Array(models.nibbleCount);
    this.below = new Int32Array(WORDS * models.nibbleCount);
    for (let i = 0; i < this.below.length; i += 1) {
      const first = 2 * (i % WORDS) * (MOST_CHANCE / 16);
      this.below[i] = pair(first, first + MOST_CHANCE / 16);
    }
  }

  /** Memory of the models. */
  get modelBytes(): number {
    return bytesOf(this.zero, this.bitSeen, this.below, this.nibbleSeen);
  }

  /** Whether both states have come. Before that nothing can be read. */
  get started(): boolean {
    return this.taken > 0;
  }

  /** Bytes that are there and not yet taken. */
  get left(): number {
    return Math.max(this.end - this.taken, 0);
  }

  /** Whether what it gave cannot be believed, because the stream has not come so far. */
  get starved(): boolean {
    return this.taken > this.end;
  }

  /** Whether everything that was written has been read: both states are as the writer's were at its beginning. */
  get isEnd(): boolean {
    return this.now === LOWEST && this.next === LOWEST && this.taken === this.end;
  }

  /** Says what is there of the stream: the first `end` of these bytes. */
  reach(bytes: Uint8Array<ArrayBuffer>, end: number): void {
    this.bytes = bytes;
    this.end = end;
    if (this.taken > 0 || end < 8) return;
    const view = new DataView(bytes.buffer, bytes.byteOffset);
    this.now = view.getInt32(0, true);
    this.next = view.getInt32(4, true);
    this.taken = 8;
  }

  private take(start: number, width: number): void {
    const now = this.now;
    let state = (Math.imul(width, now >>> 15) + ((now & 32767) - start)) | 0;
    if (state >>> 16 === 0) {
      const at = this.taken;
      state <<= 16;
      if (at + 2 <= this.end) state |= (this.bytes[at] as number) | ((this.bytes[at + 1] as number) << 8);
      this.taken = at + 2;
    }
    this.now = this.next;
    this.next = state;
  }

  /** A decision, 0 or 1. */
  bit(model: number): number {
    const zero = this.zero[model] as number;
    const seen = this.bitSeen[model] as number;
    const bit = (this.now & 32767) >= zero ? 1 : 0;
    if (bit) this.take(zero, MOST_CHANCE - zero);
    else this.take(0, zero);
    const target = bit ? BIT_LEAST : MOST_CHANCE - BIT_LEAST;
    this.zero[model] = zero + ((target - zero) >> (BIT_RATES[seen] as number));
    if (seen < BIT_SETTLED) this.bitSeen[model] = seen + 1;
    return bit;
  }

  /** One of sixteen symbols. */
  symbol(model: number): number {
    const below = this.below;
    const first = model * WORDS;
    const slot = this.now & 32767;
    let word = slot >= ((below[first + 4] as number) & LOW) ? 4 : 0;
    if (slot >= ((below[first + word + 2] as number) & LOW)) word += 2;
    if (slot >= ((below[first + word + 1] as number) & LOW)) word += 1;
    const chances = below[first + word] as number;
    const low = chances & LOW;
    const high = chances >>> 16;
    const odd = slot >= high ? 1 : 0;
    if (odd) this.take(high, (word === WORDS - 1 ? MOST_CHANCE : (below[first + word + 1] as number) & LOW) - high);
    else this.take(low, high - low);

    const seen = this.nibbleSeen[model] as number;
    const rate = NIBBLE_RATES[seen >> 2] as number;
    if (seen < NIBBLE_SETTLED) this.nibbleSeen[model] = seen + 1;
    const inside = INSIDE[rate] as number;
    const roundUp = ROUND_UP[rate] as number;
    let k = 0;
    for (; k < word + odd; k += 1) {
      const both = below[first + k] as number;
      below[first + k] = both - (((both - (DOWN[k] as number) + roundUp) >>> rate) & inside);
    }
    if (!odd) {
      const fall = (low - ((DOWN[k] as number) & LOW) + (roundUp & LOW)) >> rate;
      const rise = (((UP[k] as number) >>> 16) - high) >> rate;
      below[first + k] = pair(low - fall, high + rise);
      k += 1;
    }
    for (; k < WORDS; k += 1) {
      const both = below[first + k] as number;
      below[first + k] = both + ((((UP[k] as number) - both) >>> rate) & inside);
    }
    return 2 * word + odd;
  }

  /** A number of up to 15 bits that nothing is known of. */
  raw(bits: number): number {
    const shift = RAW_BITS - bits;
    const value = (this.now & 32767) >> shift;
    this.take(value << shift, 1 << shift);
    return value;
  }

  /** A number of up to 31 bits that nothing is known of: the low 15 first. */
  wide(bits: number): number {
    const low = this.raw(Math.min(bits, RAW_BITS));
    if (bits <= RAW_BITS) return low;
    const middle = this.raw(Math.min(bits - RAW_BITS, RAW_BITS));
    const top = bits > 2 * RAW_BITS ? this.raw(bits - 2 * RAW_BITS) : 0;
    return low + middle * 2 ** RAW_BITS + top * 2 ** (2 * RAW_BITS);
  }

  /** Any number: how many bits, then the bits (Elias 1975). */
  gamma(): number {
    const bits = this.raw(5);
    return this.wide(bits) + 2 ** bits - 1;
  }

  /** A number of which 0 … 14 are likely. */
  number(model: number): number {
    const symbol = this.symbol(model);
    return symbol < 15 ? symbol : Math.min(this.gamma() + 15, 0xffff_ffff);
  }

  /** A number around 0: the class of its size, in halves of powers of two, then what is below that. */
  residual(model: number): number {
    const found = this.symbol(model);
    this.sizeClass = found;
    if (found === 0) return 0;
    let size = BASE[found] as number;
    let negative = 0;
    if (found < 15) {
      const raw = this.raw(1 + (BITS[found] as number));
      size += raw >> 1;
      negative = raw & 1;
    } else {
      size = (size + this.gamma()) | 0;
      negative = this.raw(1);
    }
    return negative ? -size | 0 : size;
  }
}
