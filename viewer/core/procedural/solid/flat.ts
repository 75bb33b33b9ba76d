/** Which triangles do boxes, prisms, sets of polygons and height fields have? */
import type { Vector } from "../affine.ts";
import { type Corner, newell, outline, triangulated } from "./polygon.ts";
import type { Writer } from "./writer.ts";

/** A surface over a rectangle around the origin. */
export interface Heights {
  readonly over: readonly [width: number, depth: number];
  /** Cells along x and z. */
  readonly steps: readonly [number, number];
  /** Rows along x, rising z, with one more sample around the rectangle. */
  readonly heights: Float64Array;
}

type Four = readonly [number, number, number, number];

const BOX: readonly (readonly [Four, Vector])[] = [
  [
    [1, 3, 7, 5],
    [1, 0, 0],
  ],
  [
    [0, 4, 6, 2],
    [-1, 0, 0],
  ],
  [
    [2, 6, 7, 3],
    [0, 1, 0],
  ],
  [
    [0, 1, 5, 4],
    [0, -1, 0],
  ],
  [
    [4, 5, 7, 6],
    [0, 0, 1],
  ],
  [
    [0, 2, 3, 1],
    [0, 0, -1],
  ],
];

/** Six faces, each with corners of its own. */
export function writeBox(writer: Writer, [width, height, depth]: Vector): void {
  const x = width / 2;
  const z = depth / 2;
  const corners: Vector[] = [];
  for (let i = 0; i < 8; i += 1) corners.push([i & 1 ? x : -x, i & 2 ? height : 0, i & 4 ? z : -z]);
  const at = (i: number) => corners[i] as Vector;
  for (const [face, normal] of BOX) writer.quad([at(face[0]), at(face[1]), at(face[2]), at(face[3])], normal);
}

/** A wall for each edge, a lid and a floor. */
export function writePrism(writer: Writer, footprint: readonly Corner[], height: number): void {
  const corners = outline(footprint);
  const triangles = triangulated(corners);
  corners.forEach(([x, z], i) => {
    const [toX, toZ] = corners[(i + 1) % corners.length] as Corner;
    const wall = [
      [x, 0, z],
      [toX, 0, toZ],
      [toX, height, toZ],
      [x, height, z],
    ] as const;
    writer.quad(wall, [z - toZ, 0, toX - x]);
  });
  for (const [y, up] of [
    [height, 1],
    [0, -1],
  ] as const) {
    const normal = writer.normal([0, up, 0]);
    const vertices = corners.map(([x, z]) => writer.vertex(x, y, z, normal));
    for (const triangle of triangles) {
      const [a, b, c] = triangle.map((corner) => vertices[corner] as number) as [number, number, number];
      if (up > 0) writer.triangle(a, b, c);
      else writer.triangle(a, c, b);
    }
  }
}

/** Flat polygons; each has corners of its own. */
export function writeMesh(writer: Writer, points: readonly Vector[], faces: readonly (readonly number[])[]): void {
  for (const face of faces) {
    const corners = face.map((i) => points[i] as Vector);
    const flatNormal = newell(corners);
    // Looked at along the axis on which it has most area, with that side's order kept.
    let steep: 0 | 1 | 2 = 0;
    for (const axis of [1, 2] as const) {
      if (Math.abs(flatNormal[axis]) > Math.abs(flatNormal[steep])) steep = axis;
    }
    const u = ((steep + 1) % 3) as 0 | 1 | 2;
    const v = ((steep + 2) % 3) as 0 | 1 | 2;
    const flipped = flatNormal[steep] < 0;
    const triangles = triangulated(corners.map((p): Corner => (flipped ? [p[u], p[v]] : [p[v], p[u]])));
    const normal = writer.normal(flatNormal);
    const vertices = corners.map((corner) => writer.vertex(...corner, normal));
    for (const [a, b, c] of triangles) {
      writer.triangle(vertices[a] as number, vertices[b] as number, vertices[c] as number);
    }
  }
}

/** A grid; normals by the slope between the samples on both sides. */
export function writeHeights(writer: Writer, { over, steps, heights }: Heights): void {
  const [columns, rows] = steps;
  const [width, depth] = over;
  const dx = width / columns;
  const dz = depth / rows;
  const height = (i: number, j: number) => heights[j * (columns + 3) + i] as number;
  let first = 0;
  for (let j = 0; j <= rows; j += 1) {
    for (let i = 0; i <= columns; i += 1) {
      // Samples begin one step before the rectangle.
      const slopeX = (height(i + 2, j + 1) - height(i, j + 1)) / (2 * dx);
      const slopeZ = (height(i + 1, j + 2) - height(i + 1, j)) / (2 * dz);
      const normal = writer.normal([-slopeX, 1, -slopeZ]);
      const x = width * (i / columns - 0.5);
      const z = depth * (j / rows - 0.5);
      const vertex = writer.vertex(x, height(i + 1, j + 1), z, normal);
      if (i === 0 && j === 0) first = vertex;
    }
  }
  const at = (i: number, j: number) => first + j * (columns + 1) + i;
  for (let j = 0; j < rows; j += 1) {
    for (let i = 0; i < columns; i += 1) {
      writer.triangle(at(i, j), at(i, j + 1), at(i + 1, j + 1));
      writer.triangle(at(i, j), at(i + 1, j + 1), at(i + 1, j));
    }
  }
}
