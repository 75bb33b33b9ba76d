/**
 * How is the same angle the same everywhere? Functions made of + − × ÷, square roots and rounding down only, with the
 * same steps in the same order as `crates/scene/src/procedural/arithmetic.rs`. `Math.sin` and its like differ from
 * machine to machine in their last bits and are not used. Angles are in degrees.
 */
import { WIDTH } from "./plain/columns.ts";

const RADIANS = 0.017_453_292_519_943_295;

/** Angles that were asked for lately, each with its sine and cosine, at places that their bits choose. */
const REMEMBERED = 256;
const angles = new Float64Array(REMEMBERED).fill(Number.NaN);
const sines = new Float64Array(REMEMBERED);
const cosines = new Float64Array(REMEMBERED);
const angle = new Float64Array(1);
const bits = new Int32Array(angle.buffer);

/** The sine of an angle in degrees; multiples of 90 are exact. */
export function sine(degrees: number): number {
  return sines[placeOf(degrees)] as number;
}

/** The cosine. */
export function cosine(degrees: number): number {
  return cosines[placeOf(degrees)] as number;
}

/** Sines and cosines of the angles that were asked for last. */
const turns = { sines: new Float64Array(WIDTH), cosines: new Float64Array(WIDTH) };

/** The same of so many angles side by side, until the next. */
export function directions(degrees: Float64Array, first: number, count: number): Readonly<typeof turns> {
  for (let i = 0; i < count; i += 1) {
    const place = placeOf(degrees[first + i] as number);
    turns.sines[i] = sines[place] as number;
    turns.cosines[i] = cosines[place] as number;
  }
  return turns;
}

/** Where sine and cosine of an angle lie, until the next angle. */
function placeOf(degrees: number): number {
  angle[0] = degrees;
  const hash = Math.imul((bits[0] as number) ^ (bits[1] as number), 0x9e3779b1);
  const place = hash >>> 24;
  if (angles[place] !== degrees) compute(degrees, place);
  return place;
}

function compute(degrees: number, place: number): void {
  const turned = degrees - 360 * Math.floor(degrees / 360);
  const quarter = Math.floor(turned / 90 + 0.5);
  // Taylor's series within an eighth of a turn.
  const x = (turned - 90 * quarter) * RADIANS;
  const z = x * x;
  // Written out, because compilers of browsers do not: over 2k (2k + 1) and 2k (2k − 1), from k = 8 down to 1.
  let sin = 1 - z / 272;
  let cos = 1 - z / 240;
  sin = 1 - (sin * z) / 210;
  cos = 1 - (cos * z) / 182;
  sin = 1 - (sin * z) / 156;
  cos = 1 - (cos * z) / 132;
  sin = 1 - (sin * z) / 110;
  cos = 1 - (cos * z) / 90;
  sin = 1 - (sin * z) / 72;
  cos = 1 - (cos * z) / 56;
  sin = 1 - (sin * z) / 42;
  cos = 1 - (cos * z) / 30;
  sin = 1 - (sin * z) / 20;
  cos = 1 - (cos * z) / 12;
  sin = 1 - (sin * z) / 6;
  cos = 1 - (cos * z) / 2;
  sin *= x;
  const isOdd = (quarter & 1) === 1;
  const first = isOdd ? cos : sin;
  const second = isOdd ? sin : cos;
  angles[place] = degrees;
  sines[place] = (quarter & 2) === 0 ? first : -first;
  cosines[place] = (((quarter & 3) + 1) & 2) === 0 ? second : -second;
}

/** The angle of the direction (x, y) in degrees, from −180 to 180; 0 for no direction. */
export function atan2(y: number, x: number): number {
  const across = Math.abs(y);
  const along = Math.abs(x);
  if (across === 0 && along === 0) return 0;
  const acute = across <= along ? arc(across / along) : 90 - arc(along / across);
  const upper = x < 0 ? 180 - acute : acute;
  return y < 0 ? -upper : upper;
}

/** Arc tangent from 0 to 1: halved three times, then the series. */
function arc(tangent: number): number {
  let t = tangent;
  for (let i = 0; i < 3; i += 1) t /= 1 + Math.sqrt(1 + t * t);
  const z = t * t;
  let sum = 0;
  for (let k = 17; k >= 1; k -= 2) sum = 1 / k - z * sum;
  return (8 * t * sum) / RADIANS;
}

/** A whole power, by squaring. */
export function power(base: number, exponent: number): number {
  let result = 1;
  let square = base;
  for (let left = Math.abs(exponent); left > 0; left >>>= 1) {
    if (left & 1) result *= square;
    square *= square;
  }
  return exponent < 0 ? 1 / result : result;
}

/** Linear light of an sRGB channel (IEC 61966-2-1), to four decimals. */
export function linearLight(channel: number): number {
  let linear = channel / 12.92;
  if (channel > 0.04045) {
    const base = (channel + 0.055) / 1.055;
    linear = base * base * fifthRoot(base * base);
  }
  return Math.floor(linear * 1e4 + 0.5) / 1e4;
}

/** By Newton's method from above. */
function fifthRoot(x: number): number {
  let root = 1;
  for (let i = 0; i < 24; i += 1) {
    const fourth = root * root * root * root;
    root -= (root * fourth - x) / (5 * fourth);
  }
  return root;
}
