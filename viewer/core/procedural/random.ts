/**
 * Which random number belongs to a place? A hash of the seed and of the way that led there, as in
 * `crates/scene/src/procedural/random.rs`: MurmurHash3's (Appleby 2011), one word at a time.
 */

const bits = new DataView(new ArrayBuffer(8));

function rotatedLeft(word: number, by: number): number {
  return (word << by) | (word >>> (32 - by));
}

/** The path after one more word. */
export function step(path: number, word: number): number {
  const scrambled = Math.imul(rotatedLeft(Math.imul(word, 0xcc9e2d51), 15), 0x1b873593);
  return (Math.imul(rotatedLeft(path ^ scrambled, 13), 5) + 0xe6546b64) | 0;
}

/** The path after the bits of a number: the low word first. */
export function stepNumber(path: number, number: number): number {
  bits.setFloat64(0, number, true);
  return step(step(path, bits.getInt32(0, true)), bits.getInt32(4, true));
}

/** The path after a name, which is of ASCII letters. */
export function stepName(path: number, name: string): number {
  let stepped = path;
  for (let i = 0; i < name.length; i += 1) stepped = step(stepped, name.charCodeAt(i));
  return stepped;
}

/** 32 well mixed bits of a path. */
export function mixed(path: number): number {
  let hash = path;
  hash = Math.imul(hash ^ (hash >>> 16), 0x85ebca6b);
  hash = Math.imul(hash ^ (hash >>> 13), 0xc2b2ae35);
  return (hash ^ (hash >>> 16)) >>> 0;
}

/** A number from 0 up to, not including, 1. */
export function fraction(path: number): number {
  return mixed(path) / 4294967296;
}

/** A corner's slope, times the way from it. */
function dot(seed: number, i: number, j: number, u: number, v: number): number {
  const hash = mixed(step(step(seed, i | 0), j | 0));
  const gx = (hash & 0xffff) / 32767.5 - 1;
  const gz = (hash >>> 16) / 32767.5 - 1;
  return gx * u + gz * v;
}

function fade(t: number): number {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

/** Smooth noise over the plane, between −1 and 1, about one hill for each unit (Perlin 1985, with his later fade). */
export function noise(seed: number, x: number, z: number): number {
  const column = Math.floor(x);
  const row = Math.floor(z);
  const u = x - column;
  const v = z - row;
  const a = dot(seed, column, row, u, v);
  const b = dot(seed, column + 1, row, u - 1, v);
  const c = dot(seed, column, row + 1, u, v - 1);
  const d = dot(seed, column + 1, row + 1, u - 1, v - 1);
  const s = fade(u);
  const near = a + (b - a) * s;
  const far = c + (d - c) * s;
  return near + (far - near) * fade(v);
}
