import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  type TypedArray,
  Vector3,
} from "three";
import { expect, it } from "vitest";
import { formOf, merged } from "./mergedgeometry.ts";

const [RED, BLUE] = [3, 60_000];

/** Rows of three numbers and one of nothing, as published levels have them. */
const padded = (numbers: TypedArray, isNormalized: boolean) =>
  new InterleavedBufferAttribute(new InterleavedBuffer(numbers, 4), 3, 0, isNormalized);

/** Triangles of a published level that begin at so much along x. */
function published(x: number, triangles: number): BufferGeometry {
  const [positions, normals] = [new Uint16Array(12 * triangles), new Int8Array(12 * triangles)];
  for (let i = 0; i < positions.length; i += 4) {
    positions.set([x + i / 4, i, 7], i);
    normals.set([0, i % 3 === 0 ? 127 : -127, 5], i);
  }
  const index = Uint16Array.from({ length: 3 * triangles }, (_, i) => i);
  return new BufferGeometry()
    .setAttribute("position", padded(positions, false))
    .setAttribute("normal", padded(normals, true))
    .setIndex(new BufferAttribute(index, 1));
}

/** Triangles of vertices that others share. */
function shared(vertices: BufferAttribute, corners?: number[]): BufferGeometry {
  const geometry = new BufferGeometry().setAttribute("position", vertices);
  return corners ? geometry.setIndex(corners) : geometry;
}

/** What the graphics card finds of an attribute at each corner, in turn. */
function atCorners(geometry: BufferGeometry, name: string): number[][] {
  const attribute = geometry.getAttribute(name);
  const corners = geometry.index ? [...geometry.index.array] : Array.from({ length: attribute.count }, (_, i) => i);
  const components = Array.from({ length: attribute.itemSize }, (_, k) => k);
  return corners.map((corner) => components.map((k) => attribute.getComponent(corner, k)));
}

function bytesOf(geometry: BufferGeometry): number {
  const arrays = Object.values(geometry.attributes).map(({ array }) => array);
  return [...new Set([...arrays, geometry.index?.array])].reduce((sum, array) => sum + (array?.byteLength ?? 0), 0);
}

it("triangles are drawn as before, one piece after the other, and each corner says its paint", () => {
  const pieces = [published(0, 2), published(100, 1)] as const;
  const geometry = merged([
    { geometry: pieces[0], paint: RED },
    { geometry: pieces[1], paint: BLUE },
  ]);
  for (const name of ["position", "normal"]) {
    expect(atCorners(geometry, name)).toEqual(pieces.flatMap((piece) => atCorners(piece, name)));
  }
  expect(atCorners(geometry, "paint").flat()).toEqual([...Array(6).fill(RED), ...Array(3).fill(BLUE)]);
});

it("published levels take no more memory than before", () => {
  const pieces = [published(0, 20), published(100, 10)];
  const geometry = merged(pieces.map((piece) => ({ geometry: piece, paint: RED })));
  expect(bytesOf(geometry)).toBe(pieces.reduce((sum, piece) => sum + bytesOf(piece), 0));
});

it("of shared vertices each piece takes those that it uses, where no index is told all", () => {
  const vertices = new BufferAttribute(
    Float32Array.from({ length: 18 }, (_, i) => i / 3),
    3,
  );
  const pieces = [shared(vertices, [0, 1, 2]), shared(vertices, [5, 2, 1, 5, 1, 4]), shared(vertices)];
  const geometry = merged(pieces.map((piece, paint) => ({ geometry: piece, paint })));
  expect(atCorners(geometry, "position")).toEqual(pieces.flatMap((piece) => atCorners(piece, "position")));
  expect(atCorners(geometry, "paint").flat()).toEqual([0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2]);
  expect(geometry.getAttribute("position").count).toBe(3 + 4 + 6);
});

it("corners are told in 16 bits as long as these hold them", () => {
  const many = (vertices: number) => shared(new BufferAttribute(new Float32Array(3 * vertices), 3));
  const indexOf = (...counts: number[]) => merged(counts.map((n) => ({ geometry: many(n), paint: 0 }))).index?.array;
  expect(indexOf(30_000, 35_535)).toBeInstanceOf(Uint16Array);
  const wide = indexOf(30_000, 35_538);
  expect(wide).toBeInstanceOf(Uint32Array);
  expect(wide?.at(-1)).toBe(65_537);
});

it("what differs in how its numbers stand is of another form, and pictures' coordinates do not count", () => {
  const level = published(0, 1);
  const grown = shared(new BufferAttribute(new Float32Array(9), 3), [0, 1, 2]);
  expect(formOf(level)).not.toBe(formOf(grown));
  const mapped = published(9, 1).setAttribute("uv", new BufferAttribute(new Float32Array(6), 2));
  expect(formOf(mapped)).toBe(formOf(level));
  expect(Object.keys(merged([{ geometry: mapped, paint: 0 }]).attributes).sort()).toEqual([
    "normal",
    "paint",
    "position",
  ]);
});

it("where they are is known before anybody draws them", () => {
  const [pieces, all] = [[published(0, 1), published(30, 2)], new Box3()];
  const geometry = merged(pieces.map((piece) => ({ geometry: piece, paint: RED })));
  for (const piece of pieces)
    all.union(new Box3().setFromBufferAttribute(piece.getAttribute("position") as BufferAttribute));
  expect(geometry.boundingSphere?.center.toArray()).toEqual(all.getCenter(new Vector3()).toArray());
});
