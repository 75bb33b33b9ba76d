import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { latticeOf, SmoothDecoder } from "../smooth/index.ts";
import { ClusterTree, Selection, type View } from "./index.ts";

const GOLDEN = join(import.meta.dirname, "../../../tests/golden/smooth");

/** What another language said of each step; `null` is infinite. */
interface Step {
  readonly eye: [number, number, number];
  readonly planes: [number, number, number, number][];
  readonly pixels: number;
  readonly most_error_px: number | null;
  readonly outside: number | null;
  readonly most_work: number;
  readonly splits: number;
  readonly merges: number;
  readonly work: number;
  readonly is_settled: boolean;
  readonly clusters: number;
  readonly triangles: number;
  readonly hash: string;
}

interface Path {
  readonly name: string;
  readonly half: number;
  readonly steps_of_half: number;
  readonly least_triangles: number;
  readonly trees: string[];
  readonly steps: Step[];
}

const paths = JSON.parse(readFileSync(join(GOLDEN, "views.json"), "utf8")) as Path[];
const stream = (name: string) => new Uint8Array(readFileSync(join(GOLDEN, `${name}.slod`)));

function decoded(bytes: Uint8Array): SmoothDecoder {
  const decoder = new SmoothDecoder(2 ** 24);
  decoder.push(bytes);
  return decoder;
}

function viewOf({ eye, planes, pixels, most_error_px, outside }: Step): View {
  const infinite = Number.POSITIVE_INFINITY;
  return { eye, planes, pixels, mostError_px: most_error_px ?? infinite, outside: outside ?? infinite };
}

const view = (eye: [number, number, number], mostError_px: number): View => {
  return { eye, planes: [], pixels: 1000, mostError_px, outside: 1 };
};

function hashOfTree(tree: ClusterTree): string {
  const numbers = new Float64Array(2 * Math.max(tree.vertices - 1, 0));
  for (let i = 0; i < numbers.length; i += 1) {
    numbers[i] = (i % 2 === 0 ? tree.errors : tree.radii)[Math.floor(i / 2) + 1] as number;
  }
  return createHash("sha256").update(numbers).digest("hex");
}

function hashOfCut(selection: Selection, decoder: SmoothDecoder): string {
  const words: number[] = [];
  for (const triangle of selection.drawn) {
    words.push(triangle, 0, 0);
    for (const rows of [selection.corners, selection.wedges])
      words.push(...rows.subarray(3 * triangle, 3 * triangle + 3));
  }
  const { positions, indices } = selection.snapshot(decoder);
  const sum = createHash("sha256").update(Int32Array.from(words)).update(positions);
  for (const corners of indices) sum.update(corners);
  return sum.digest("hex");
}

describe.each(paths)("$name", ({ name, half, steps_of_half, least_triangles, trees, steps }) => {
  it("is cut as in Rust, step by step", () => {
    const bytes = stream(name);
    const decoder = decoded(bytes.subarray(0, half));
    let tree = new ClusterTree(decoder);
    const selection = new Selection(tree, least_triangles);
    const hashes = [hashOfTree(tree)];
    steps.forEach((step, i) => {
      if (i === steps_of_half) {
        decoder.push(bytes.subarray(half));
        tree = new ClusterTree(decoder);
        selection.grow(tree);
        hashes.push(hashOfTree(tree));
      }
      const { splits, merges, work, isSettled } = selection.update(viewOf(step), step.most_work);
      const { clusters } = selection;
      const found = { splits, merges, work, is_settled: isSettled, clusters, triangles: selection.drawn.length };
      expect({ i, ...step, ...found, hash: hashOfCut(selection, decoder) }).toEqual({ i, ...step });
    });
    expect(hashes).toEqual(trees);
  });

  it("is all there without any error, in the finest shape", () => {
    const decoder = decoded(stream(name));
    const selection = new Selection(new ClusterTree(decoder), 0);
    expect(selection.drawn.length).toBe(0);
    expect(selection.update(view([0, 0, 5], 0), Number.POSITIVE_INFINITY).isSettled).toBe(true);
    const { triangles, corners } = latticeOf(decoder);
    expect(selection.drawn.length).toBe(triangles.length / 3);
    expect(selection.corners).toEqual(triangles);
    expect(selection.wedges).toEqual(corners);
    selection.update(view([0, 0, 5], Number.POSITIVE_INFINITY), Number.POSITIVE_INFINITY);
    expect(selection.drawn.length).toBe(0);
  });
});

it("follows the eye a little at a time, and stays where little changes", () => {
  const decoder = decoded(stream("plain"));
  const selection = new Selection(new ClusterTree(decoder), 20);
  const near = view([0, 1, 0], 4);
  let calls = 0;
  for (; !selection.update(near, 100).isSettled; calls += 1) {
    for (const triangle of selection.drawn) {
      const [a, b, c] = selection.corners.subarray(3 * triangle, 3 * triangle + 3);
      expect(a !== b && b !== c && c !== a).toBe(true);
    }
  }
  expect(calls).toBeGreaterThan(5);
  expect(selection.drawn.length).toBeLessThan(decoder.triangles * 0.9);
  expect(selection.update(near, 100).work).toBe(0);
  for (const changed of [view([0, 1, 0], 5), view([0.02, 1, 0], 4)]) {
    const { splits, merges } = selection.update(changed, Number.POSITIVE_INFINITY);
    expect(splits + merges).toBeLessThan(3);
  }
});

it("waits for a decoder that has nothing yet", () => {
  const selection = new Selection(new ClusterTree(new SmoothDecoder(2 ** 20)), 10);
  expect(selection.update(view([0, 0, 0], 0), 10).isSettled).toBe(true);
  expect(selection.drawn.length).toBe(0);
});
