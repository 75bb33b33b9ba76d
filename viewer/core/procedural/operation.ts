/**
 * What do operators and functions of numbers give? What is asked of them is checked where they are visited, for the place.
 * As `crates/scene/src/procedural/operation.rs`.
 */
import { fraction, noise, step } from "./random.ts";

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

/** The random number of a place, from 0 up to 1: behind so many sites that calls add to the path. */
export function random(path: number, sites: Int32Array, first: number, count: number): number {
  let stepped = path;
  for (let i = first; i < first + count; i += 1) stepped = step(stepped, sites[i] as number);
  return fraction(stepped);
}

/**
 * Noise of so many octaves or more is remembered: layers of a landscape, and what stands on it, ask for the same points
 * again, and in the same order. So they lie in that order, where the processor finds the next one before it is asked for: x, z
 * and the noise, and two numbers that say by which seed and octaves.
 */
const LEAST_REMEMBERED = 3;
const REMEMBERED = 65536;
let numbers: Float64Array | undefined;
let settings: Int32Array | undefined;
/** Where the last point with each hash lies. */
let places: Uint16Array | undefined;
let next = 0;
const point = new Float64Array(2);
const bits = new Int32Array(point.buffer);

/** Octaves of noise, each half as high and half as wide as the one before; not a number when they reach too far. */
export function fractal(seed: number, x: number, z: number, octaves: number): number {
  if (!(octaves >= 1 && octaves <= MAX_OCTAVES)) return Number.NaN;
  if (octaves < LEAST_REMEMBERED) return computed(seed, x, z, octaves);
  numbers ??= new Float64Array(3 * REMEMBERED);
  settings ??= new Int32Array(2 * REMEMBERED);
  places ??= new Uint16Array(REMEMBERED);
  point[0] = x;
  point[1] = z;
  const low = Math.imul(bits[0] as number, 0x9e3779b1) ^ Math.imul(bits[2] as number, 0x85ebca6b);
  const high = Math.imul(bits[1] as number, 0xc2b2ae35) ^ Math.imul(bits[3] as number, 0x27d4eb2f);
  const hash = (Math.imul(low ^ (low >>> 15), 0x2c1b3c6d) ^ Math.imul(high ^ (high >>> 13), 0x297a2d39)) >>> 16;
  const place = places[hash] as number;
  const isKnown =
    settings[2 * place] === seed &&
    settings[2 * place + 1] === octaves &&
    numbers[3 * place] === x &&
    numbers[3 * place + 1] === z;
  if (isKnown) return numbers[3 * place + 2] as number;
  const noise = computed(seed, x, z, octaves);
  numbers[3 * next] = x;
  numbers[3 * next + 1] = z;
  numbers[3 * next + 2] = noise;
  settings[2 * next] = seed;
  settings[2 * next + 1] = octaves;
  places[hash] = next;
  next = (next + 1) % REMEMBERED;
  return noise;
}

function computed(seed: number, x: number, z: number, octaves: number): number {
  let u = x;
  let v = z;
  let weight = 1;
  let sum = 0;
  for (let octave = 0; octave < octaves; octave += 1) {
    if (!(Math.abs(u) <= MAX_NOISE && Math.abs(v) <= MAX_NOISE)) return Number.NaN;
    sum += weight * noise((seed + octave) | 0, u, v);
    u *= 2;
    v *= 2;
    weight *= 0.5;
  }
  return sum;
}
