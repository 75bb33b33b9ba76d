/**
 * What do operators and functions of numbers give? What is asked of them is checked where they are visited, for the place.
 * As `crates/scene/src/procedural/operation.rs`.
 */
import { num } from "./numbers.ts";
import { copy, WIDTH } from "./plain/columns.ts";
import { addNoise, fraction, scrambled, step, stepScrambled } from "./random.ts";

/** Beyond this a whole number is no longer told from the next in every operation. */
export const MAX_NOISE = 1e9;
/** Most terms of fractal noise. */
export const MAX_OCTAVES = 16;
/** Largest power, either way. */
export const MAX_POWER = 64;

/** Whether a number can be a power. */
export function isWhole(power: number): boolean {
  return Math.abs(power) <= MAX_POWER && power === Math.floor(power);
}

/** The random number behind sites that calls add to a path, the last of them scrambled. */
function randomBehind(path: number, sites: Int32Array, first: number, last: number, site: number): number {
  let behind = path;
  for (let at = first; at < last; at += 1) behind = step(behind, sites[at] as number);
  return fraction(stepScrambled(behind, site));
}

/** The random numbers of places, from 0 up to 1: each behind so many sites that calls add to its path. */
export function randoms(
  paths: Int32Array,
  sites: Int32Array,
  first: number,
  depth: number,
  count: number,
  numbers: Float64Array,
  to: number,
): void {
  const last = first + depth - 1;
  const site = scrambled(sites[last] as number);
  for (let i = 0; i < count; i += 1) {
    numbers[to + i] = randomBehind(paths[i] as number, sites, first, last, site);
  }
}

/** The same, each between two numbers. */
export function randomsBetween(
  paths: Int32Array,
  sites: Int32Array,
  first: number,
  depth: number,
  count: number,
  numbers: Float64Array,
  from: number,
  into: number,
  to: number,
): void {
  const last = first + depth - 1;
  const site = scrambled(sites[last] as number);
  for (let i = 0; i < count; i += 1) {
    const low = num(numbers, from + i);
    const part = randomBehind(paths[i] as number, sites, first, last, site);
    numbers[(to + i) | 0] = low + (num(numbers, into + i) - low) * part;
  }
}

/**
 * Noise of so many octaves or more is remembered: layers of a landscape, and what stands on it, ask for the same places
 * again, and in the same order. So rows of places lie in that order, where the processor finds the next one before it is asked
 * for: all x, all z and what was found.
 */
const LEAST_REMEMBERED = 3;
/** So many places. */
const REMEMBERED = 65536;
let numbers: Float64Array | undefined;
/** At the first place of each row, by which seed and octaves it was found, and how many places it has. */
let settings: Int32Array | undefined;
/** Where the last row with each hash begins. */
let rows: Uint16Array | undefined;
let next = 0;
const point = new Float64Array(3);
const bits = new Int32Array(point.buffer);

/** Octaves of noise, each half as high and half as wide as the one before; not a number when they reach too far. */
export function fractal(seed: number, x: number, z: number, octaves: number): number {
  point[0] = x;
  point[1] = z;
  fractals(seed, point, 0, 1, octaves, 1, 2);
  return point[2] as number;
}

/** The same at so many places of a row, with octaves for each; all lies in columns that begin at these places. */
export function fractalsOf(
  seed: number,
  columns: Float64Array,
  x: number,
  z: number,
  octaves: number,
  count: number,
  to: number,
): void {
  const first = Math.floor(columns[octaves] as number);
  let same = 1;
  while (same < count && Math.floor(columns[octaves + same] as number) === first) same += 1;
  fractals(seed, columns, x, z, first, same, to);
  if (same < count) fractalsOf(seed, columns, x + same, z + same, octaves + same, count - same, to + same);
}

/** The same with as many octaves everywhere. */
export function fractals(
  seed: number,
  columns: Float64Array,
  x: number,
  z: number,
  octaves: number,
  count: number,
  to: number,
): void {
  if (!(octaves >= 1 && octaves <= MAX_OCTAVES)) {
    columns.fill(Number.NaN, to, to + count);
    return;
  }
  if (octaves < LEAST_REMEMBERED) {
    compute(seed, columns, x, z, octaves, count, to);
    return;
  }
  numbers ??= new Float64Array(3 * REMEMBERED);
  settings ??= new Int32Array(2 * REMEMBERED);
  rows ??= new Uint16Array(REMEMBERED);
  const size = octaves | (count << 8);
  const hash = hashOf(columns[x] as number, columns[z] as number) ^ octaves;
  const row = rows[hash] as number;
  if (settings[2 * row] === seed && settings[2 * row + 1] === size) {
    const at = 3 * row;
    if (isSame(numbers, at, columns, x, count) && isSame(numbers, at + count, columns, z, count)) {
      copy(numbers, at + 2 * count, columns, to, count);
      return;
    }
  }
  compute(seed, columns, x, z, octaves, count, to);
  if (next + count > REMEMBERED) next = 0;
  copy(columns, x, numbers, 3 * next, count);
  copy(columns, z, numbers, 3 * next + count, count);
  copy(columns, to, numbers, 3 * next + 2 * count, count);
  // Rows that lay here before are no more.
  settings.fill(0, 2 * next, 2 * (next + count));
  settings[2 * next] = seed;
  settings[2 * next + 1] = size;
  rows[hash] = next;
  next += count;
}

function hashOf(x: number, z: number): number {
  point[0] = x;
  point[1] = z;
  const low = Math.imul(bits[0] as number, 0x9e3779b1) ^ Math.imul(bits[2] as number, 0x85ebca6b);
  const high = Math.imul(bits[1] as number, 0xc2b2ae35) ^ Math.imul(bits[3] as number, 0x27d4eb2f);
  return (Math.imul(low ^ (low >>> 15), 0x2c1b3c6d) ^ Math.imul(high ^ (high >>> 13), 0x297a2d39)) >>> 16;
}

function isSame(a: Float64Array, from: number, b: Float64Array, at: number, count: number): boolean {
  for (let i = 0; i < count; i += 1) if (a[from + i] !== b[at + i]) return false;
  return true;
}

const u = new Float64Array(WIDTH);
const v = new Float64Array(WIDTH);
const sums = new Float64Array(WIDTH);

function compute(
  seed: number,
  columns: Float64Array,
  x: number,
  z: number,
  octaves: number,
  count: number,
  to: number,
): void {
  copy(columns, x, u, 0, count);
  copy(columns, z, v, 0, count);
  sums.fill(0, 0, count);
  for (let [octave, weight] = [0, 1]; octave < octaves; octave += 1, weight *= 0.5) {
    addNoise((seed + octave) | 0, weight, u, v, count, sums);
    for (let i = 0; i < count; i += 1) {
      if (!(Math.abs(u[i] as number) <= MAX_NOISE && Math.abs(v[i] as number) <= MAX_NOISE)) sums[i] = Number.NaN;
      u[i] = 2 * (u[i] as number);
      v[i] = 2 * (v[i] as number);
    }
  }
  copy(sums, 0, columns, to, count);
}
