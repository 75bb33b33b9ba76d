/** What may the numbers of a solid be, or of a statement that moves, turns or stretches? */
import { MAX_SIDES } from "./limits.ts";

/** What a number is for, and what it may be. */
export interface Range {
  readonly what: string;
  readonly min: number;
  readonly max: number;
}

/** Most members of one population. */
export const MAX_COUNT = 1_048_576;
/** Largest length of a solid, metres. */
export const MAX_LENGTH = 1e6;
/** Farthest move and largest scale, so that a model stays within reach of numbers. */
export const FARTHEST = 1e9;
/** Longest axes with which a turtle may turn at one go: as it turns, none gets beyond {@link FARTHEST}. */
export const LONGEST = 1e8;
/** Smallest scale, either way. */
export const LEAST_SCALE = 1e-6;

const upTo = (max: number, ...names: string[]): Range[] => names.map((what) => ({ what, min: 0, max }));

/** What is asked of the numbers of a statement that moves, turns or stretches. */
export const MOVE: readonly Range[] = [0, 1, 2].map(() => ({ what: "a transform", min: -FARTHEST, max: FARTHEST }));

/** Numbers of solids, as they are computed one after the other. */
export const RANGES = {
  box: upTo(MAX_LENGTH, "width", "height", "depth"),
  cone: [...upTo(MAX_LENGTH, "radius", "top", "height"), ...upTo(MAX_SIDES, "sides"), ...upTo(1, "closed")],
  cylinder: [...upTo(MAX_LENGTH, "radius", "height"), ...upTo(MAX_SIDES, "sides"), ...upTo(1, "closed")],
  sphere: [...upTo(MAX_LENGTH, "radius"), ...upTo(MAX_SIDES, "sides")],
  lathe: [...upTo(MAX_SIDES, "sides"), ...upTo(1, "smooth")],
  prism: upTo(MAX_LENGTH, "height"),
} as const;

export const HEIGHT: readonly Range[] = [{ what: "a height", min: -MAX_LENGTH, max: MAX_LENGTH }];

/** Solids that are nothing but numbers. */
export type Simple = "box" | "cone" | "cylinder" | "sphere";
