/**
 * Where are the turtles of several turns of a loop? Side by side, in columns, with the same numbers as one by one in
 * `turtles.ts`.
 */
import { cosine, sine } from "./arithmetic.ts";
import { type Columns, WIDTH } from "./plain/columns.ts";
import type { Transform } from "./syntax.ts";
import { FRAME, type Turtles } from "./turtles.ts";

/** Three columns. */
const AXIS = 3 * WIDTH;

/** Where the columns of three axes and an origin begin: three each. What does not change is shared with the pose before. */
export interface Pose {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly origin: number;
  readonly material: number;
}

/** The same turtle in all turns. */
export function poseOf(columns: Columns, { numbers }: Turtles, turtle: number): Pose {
  const first = columns.open(FRAME);
  for (let i = 0; i < FRAME; i += 1) columns.fill(first + WIDTH * i, numbers[turtle + i] as number);
  const material = numbers[turtle + FRAME] as number;
  return { x: first, y: first + AXIS, z: first + 2 * AXIS, origin: first + 3 * AXIS, material };
}

/** Where statements lead that move, turn or stretch a pose by columns of numbers: one angle, or three. */
export function transformed(columns: Columns, pose: Pose, transform: Transform, x: number, y: number, z: number): Pose {
  switch (transform) {
    case "move":
      return { ...pose, origin: moved(columns, pose, x, y, z) };
    case "turn": {
      const swung = swing(columns, pose.z, pose.x, x);
      return { ...pose, z: swung, x: swung + AXIS };
    }
    case "tilt": {
      const swung = swing(columns, pose.y, pose.z, x);
      return { ...pose, y: swung, z: swung + AXIS };
    }
    case "roll": {
      const swung = swing(columns, pose.x, pose.y, x);
      return { ...pose, x: swung, y: swung + AXIS };
    }
    case "scale": {
      const [ofX, ofY, ofZ] = [stretch(columns, pose.x, x), stretch(columns, pose.y, y), stretch(columns, pose.z, z)];
      return { ...pose, x: ofX, y: ofY, z: ofZ };
    }
  }
}

/** An origin that is moved along the axes. */
function moved(columns: Columns, pose: Pose, x: number, y: number, z: number): number {
  const to = columns.open(3);
  const { numbers, count } = columns;
  for (let axis = 0; axis < AXIS; axis += WIDTH) {
    for (let i = 0; i < count; i += 1) {
      numbers[to + axis + i] =
        num(numbers, pose.x + axis + i) * num(numbers, x + i) +
        num(numbers, pose.y + axis + i) * num(numbers, y + i) +
        num(numbers, pose.z + axis + i) * num(numbers, z + i) +
        num(numbers, pose.origin + axis + i);
    }
  }
  return to;
}

/** Two axes turned from one to the other by a column of angles, one behind the other. */
function swing(columns: Columns, u: number, v: number, degrees: number): number {
  const to = columns.open(6);
  const { numbers, count } = columns;
  for (let i = 0; i < count; i += 1) {
    const sin = sine(num(numbers, degrees + i));
    const cos = cosine(num(numbers, degrees + i));
    for (let axis = i; axis < AXIS; axis += WIDTH) {
      const from = num(numbers, u + axis);
      const into = num(numbers, v + axis);
      numbers[to + axis] = from * cos + into * sin;
      numbers[to + AXIS + axis] = into * cos - from * sin;
    }
  }
  return to;
}

/** An axis as many times as long as a column says. */
function stretch(columns: Columns, axis: number, factors: number): number {
  const to = columns.open(3);
  const { numbers, count } = columns;
  for (let along = 0; along < AXIS; along += WIDTH) {
    for (let i = 0; i < count; i += 1) {
      numbers[to + along + i] = num(numbers, axis + along + i) * num(numbers, factors + i);
    }
  }
  return to;
}

/** Whether all numbers by which a pose differs from the one before are so small. */
export function isWithin(columns: Columns, pose: Pose, before: Pose, most: number): boolean {
  const isNear = (axis: number, known: number) => axis === known || columns.areWithin(axis, 3, most);
  return (
    isNear(pose.x, before.x) &&
    isNear(pose.y, before.y) &&
    isNear(pose.z, before.z) &&
    isNear(pose.origin, before.origin)
  );
}

/** The turtle of one turn, behind another. */
export function turtleOf({ numbers }: Columns, pose: Pose, turn: number, turtles: Turtles, behind: number): number {
  const at = turtles.painted(behind, pose.material);
  const to = turtles.numbers;
  for (let i = 0; i < 3; i += 1) {
    to[at + i] = num(numbers, pose.x + WIDTH * i + turn);
    to[at + 3 + i] = num(numbers, pose.y + WIDTH * i + turn);
    to[at + 6 + i] = num(numbers, pose.z + WIDTH * i + turn);
    to[at + 9 + i] = num(numbers, pose.origin + WIDTH * i + turn);
  }
  return at;
}

function num(numbers: Float64Array, at: number): number {
  return numbers[at] as number;
}
