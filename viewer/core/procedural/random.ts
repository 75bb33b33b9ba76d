/**
 * Which random number belongs to a place? A hash of the seed and of the way that led there, as in
 * `crates/scene/src/procedural/random.rs`: MurmurHash3's (Appleby 2011), one word at a time.
 */
import { num } from "./numbers.ts";

const bits = new DataView(new ArrayBuffer(8));

function rotatedLeft(word: number, by: number): number {
  return (word << by) | (word >>> (32 - by));
}

/** The path after one more word. */
export function step(path: number, word: number): number {
  return stepScrambled(path, scrambled(word));
}

/** A word as it is put to a path. */
export function scrambled(word: number): number {
  return Math.imul(rotatedLeft(Math.imul(word, 0xcc9e2d51), 15), 0x1b873593);
}

/** The path after one more word that is scrambled. */
export function stepScrambled(path: number, word: number): number {
  return (Math.imul(rotatedLeft(path ^ word, 13), 5) + 0xe6546b64) | 0;
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

const UPPER = 1 / 32768 + 1 / 2147483648;
const REST = 1 / 32767.5 / 4294967296;

/**
 * 16 bits as a number from −1 to 1: `bits / 32767.5 - 1`, to the last bit, without a division. Their product with the upper
 * bits of 1 / 32767.5 is exact, so that only the sum with the rest is rounded.
 */
export function component(bits: number): number {
  return bits * UPPER + bits * REST - 1;
}

/**
 * Cells of noise that were asked for lately: seed, column and row, and the slopes at four corners. Surfaces are asked for
 * point by point, and the wide octaves of many points lie in the same cell.
 */
const REMEMBERED = 2048;
const cells = new Int32Array(3 * REMEMBERED);
const slopes = new Float64Array(8 * REMEMBERED);
// Nothing is remembered of the others: their places are wrong for the cell that they name.
remember(0, 0, 0, 0);

/** Where the slopes at the corners of a cell lie, until the next cell. */
function cellOf(seed: number, column: number, row: number): number {
  const hash = Math.imul(seed, 0x9e3779b1) ^ Math.imul(column, 0x85ebca6b) ^ Math.imul(row, 0xc2b2ae35);
  const place = (hash ^ (hash >>> 15)) & (REMEMBERED - 1);
  if (cells[3 * place] !== seed || cells[3 * place + 1] !== column || cells[3 * place + 2] !== row) {
    remember(place, seed, column, row);
  }
  return 8 * place;
}

function remember(place: number, seed: number, column: number, row: number): void {
  cells[3 * place] = seed;
  cells[3 * place + 1] = column;
  cells[3 * place + 2] = row;
  const left = step(seed, column);
  const right = step(seed, (column + 1) | 0);
  const above = (row + 1) | 0;
  setSlope(8 * place, mixed(step(left, row)));
  setSlope(8 * place + 2, mixed(step(right, row)));
  setSlope(8 * place + 4, mixed(step(left, above)));
  setSlope(8 * place + 6, mixed(step(right, above)));
}

function setSlope(at: number, hash: number): void {
  slopes[at] = component(hash & 0xffff);
  slopes[at + 1] = component(hash >>> 16);
}

function fade(t: number): number {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

/**
 * Adds smooth noise over the plane, between −weight and weight, about one hill for each unit (Perlin 1985, with his later fade),
 * for so many places side by side. Neighbours often lie in the same cell: then it is looked up once.
 */
export function addNoise(
  seed: number,
  weight: number,
  x: Float64Array,
  z: Float64Array,
  count: number,
  sums: Float64Array,
): void {
  let lastColumn = Number.NaN;
  let lastRow = Number.NaN;
  let ax = 0;
  let az = 0;
  let bx = 0;
  let bz = 0;
  let cx = 0;
  let cz = 0;
  let dx = 0;
  let dz = 0;
  for (let i = 0; i < count; i += 1) {
    const column = Math.floor(num(x, i));
    const row = Math.floor(num(z, i));
    if (column !== lastColumn || row !== lastRow) {
      const cell = cellOf(seed, column | 0, row | 0);
      ax = num(slopes, cell);
      az = num(slopes, cell + 1);
      bx = num(slopes, cell + 2);
      bz = num(slopes, cell + 3);
      cx = num(slopes, cell + 4);
      cz = num(slopes, cell + 5);
      dx = num(slopes, cell + 6);
      dz = num(slopes, cell + 7);
      lastColumn = column;
      lastRow = row;
    }
    const u = num(x, i) - column;
    const v = num(z, i) - row;
    const a = ax * u + az * v;
    const b = bx * (u - 1) + bz * v;
    const c = cx * u + cz * (v - 1);
    const d = dx * (u - 1) + dz * (v - 1);
    const s = fade(u);
    const near = a + (b - a) * s;
    const far = c + (d - c) * s;
    sums[i] = num(sums, i) + weight * (near + (far - near) * fade(v));
  }
}
