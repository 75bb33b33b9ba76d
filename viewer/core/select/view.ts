/**
 * Which splits does an eye need? Those without which the surface would be off by more pixels than it may.
 */
import type { ClusterTree } from "./tree.ts";

/** A made split is undone only when its error on the screen is below this part of the threshold … */
const KEPT = 0.75;
/** … and counts as in view until it is farther out than this many times its radius. */
const KEPT_RADII = 1.5;

/** From where, and how sharply, an object is looked at. */
export interface View {
  /** In model space. */
  readonly eye: readonly [number, number, number];
  /**
   * What can be seen lies on the inner side of all these: `x · p[0] + y · p[1] + z · p[2] + p[3] >= 0`, with normals of
   * unit length, in model space. None: all around.
   */
  readonly planes: readonly (readonly [number, number, number, number])[];
  /** Pixels of a thing of length 1 at distance 1, facing the eye: height of the image / (2 · tan(vertical angle / 2)). */
  readonly pixels: number;
  /** So many pixels the surface may be off by. 0 gives all that is decoded. */
  readonly mostError_px: number;
  /** So many times more where nothing can be seen; 1 or more. Infinite: nothing is kept there for when the eye turns. */
  readonly outside: number;
}

/** Whether a split is to be made. */
export function wants(view: View, tree: ClusterTree, split: number): boolean {
  return needs(view, tree, split, 1, 1);
}

/** Whether a split that is made stays. So does each that is wanted. */
export function keeps(view: View, tree: ClusterTree, split: number): boolean {
  return needs(view, tree, split, KEPT, KEPT_RADII);
}

function needs(view: View, tree: ClusterTree, split: number, part: number, radii: number): boolean {
  if (view.mostError_px <= 0) return true;
  const at = 3 * (tree.parent[split] as number);
  const x = tree.positions[at] as number;
  const y = tree.positions[at + 1] as number;
  const z = tree.positions[at + 2] as number;
  const radius = tree.radii[split] as number;
  const reach = -(radii * radius);
  let most = part * view.mostError_px;
  for (const plane of view.planes) {
    if (plane[0] * x + plane[1] * y + plane[2] * z + plane[3] < reach) {
      most *= view.outside;
      break;
    }
  }
  const dx = view.eye[0] - x;
  const dy = view.eye[1] - y;
  const dz = view.eye[2] - z;
  const distance = Math.max(Math.sqrt(dx * dx + dy * dy + dz * dz) - radius, 0);
  return (tree.errors[split] as number) * view.pixels > most * distance;
}

/** Whether two views are the same. */
export function isSame(a: View, b: View): boolean {
  const numbers = ({ eye, planes, pixels, mostError_px, outside }: View) =>
    [...eye, pixels, mostError_px, outside, ...planes.flat()].join();
  return numbers(a) === numbers(b);
}
