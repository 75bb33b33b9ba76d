/**
 * Where is a new vertex? A prediction from what surrounds it, and what is missing from it (`docs/SLOD.md` §7).
 *
 * Sums are whole numbers in doubles, which hold them exactly; `| 0` wraps at 32 bits where the format says so.
 */
import type { Change } from "./change.ts";
import type { Star } from "./fan.ts";
import { FEATURES, type Header } from "./header.ts";
import { type Mesh, NONE } from "./mesh.ts";
import type { ModelSpace, Reader } from "./rans.ts";
import type { Split } from "./split.ts";
import { AROUND, AT, LENGTH, POINT } from "./stars.ts";

const MOST_NEAR = 12;

/** 65536 / n, rounded; 0 for none. */
const SHARES = Float64Array.from({ length: 256 }, (_, n) => (n === 0 ? 0 : Math.floor((65536 + (n >> 1)) / n)));

function shareOf(count: number): number {
  return count < 256 ? (SHARES[count] as number) : Math.floor(65536 / count);
}

/** Twice the logarithm of a mean distance, from 0 to 31. */
function sizeClass(mean: number): number {
  const number = mean + 1;
  const log = 31 - Math.clz32(number);
  return Math.min(2 * log + (log > 0 ? (number >> (log - 1)) & 1 : 0), 31);
}

/** Calling `fill` for three numbers takes longer. */
export function clear(sum: Float64Array): void {
  sum[0] = 0;
  sum[1] = 0;
  sum[2] = 0;
}

/** What leaves 15 of so many bits. */
const SCALES = Float64Array.from({ length: 65 }, (_, bits) => 2 ** (15 - bits));

/** Leaves a direction's 15 first bits. */
export function shorten(direction: Float64Array): void {
  const longest = Math.max(
    Math.abs(direction[0] as number),
    Math.abs(direction[1] as number),
    Math.abs(direction[2] as number),
  );
  if (longest < 32768) return;
  const bits = longest < 2 ** 32 ? 32 - Math.clz32(longest) : 64 - Math.clz32(Math.floor(longest / 2 ** 32));
  const scale = SCALES[bits] as number;
  direction[0] = Math.floor((direction[0] as number) * scale);
  direction[1] = Math.floor((direction[1] as number) * scale);
  direction[2] = Math.floor((direction[2] as number) * scale);
}

/** Places new vertices. After {@link look} it knows the neighbourhood, after {@link read} the place. */
export class Placer {
  /** Mean distance of the new neighbours from the old vertex, as a class. */
  size = 0;
  /** The new vertex, from the old one. */
  readonly step = new Int32Array(3);
  /** Which of its coordinates are those of vertices nearby: x in bit 0, y, z. */
  shared = 0;

  private kind = 0;
  /** What is expected of the new vertex, from the old one in 1/16 of a step. */
  private readonly expected = new Int32Array(3);
  private readonly normal = new Float64Array(3);
  /** Ways from the old vertex: to itself and then to the first few that were seen. */
  private readonly near = new Int32Array(3 * MOST_NEAR);
  /** Numbers in it. */
  private seen = 3;

  private readonly weights: Int32Array;
  private readonly sharedModels: number;
  private readonly lowModels: number;
  private readonly middleModels: number;
  private readonly topModels: number;

  constructor(header: Header, models: ModelSpace) {
    this.weights = header.weights;
    this.sharedModels = models.nibbles(8 * 3);
    this.lowModels = models.nibbles(32);
    this.middleModels = models.nibbles(16 * 8);
    this.topModels = models.nibbles(16 * 8);
  }

  /** Looks around a vertex before its split is done. All in one piece: calls for each vertex take a tenth longer. */
  look(mesh: Mesh, star: Star, split: Split, change: Change, old: number): void {
    const { opened, third, moves, moved } = change;
    const { from, to } = star;
    const { points } = mesh;
    const { normal, near } = this;
    const oldX = points[POINT * old + AT] as number;
    const oldY = points[POINT * old + AT + 1] as number;
    const oldZ = points[POINT * old + AT + 2] as number;
    const cuts = opened + split.extraThird.length;
    let seen = 3;
    let distance = 0;
    let cutX = 0;
    let cutY = 0;
    let cutZ = 0;
    let cutLapX = 0;
    let cutLapY = 0;
    let cutLapZ = 0;
    for (let i = 0; i < cuts; i += 1) {
      const there = POINT * (i < opened ? (third[i] as number) : split.extraThird.at(i - opened));
      const x = (points[there + AT] as number) - oldX;
      const y = (points[there + AT + 1] as number) - oldY;
      const z = (points[there + AT + 2] as number) - oldZ;
      const share = shareOf(2 * (points[there + LENGTH] as number));
      cutLapX += lapOf(points, there, share);
      cutLapY += lapOf(points, there + 1, share);
      cutLapZ += lapOf(points, there + 2, share);
      cutX += x;
      cutY += y;
      cutZ += z;
      distance += Math.abs(x) + Math.abs(y) + Math.abs(z);
      if (seen < 3 * MOST_NEAR) {
        near[seen] = x;
        near[seen + 1] = y;
        near[seen + 2] = z;
        seen += 3;
      }
    }

    let arcX = 0;
    let arcY = 0;
    let arcZ = 0;
    let arcLapX = 0;
    let arcLapY = 0;
    let arcLapZ = 0;
    let normalX = 0;
    let normalY = 0;
    let normalZ = 0;
    let last = NONE;
    let lastX = 0;
    let lastY = 0;
    let lastZ = 0;
    let lastLapX = 0;
    let lastLapY = 0;
    let lastLapZ = 0;
    for (let i = 0; i < moves; i += 1) {
      const spoke = moved[i] as number;
      // Rows of triangles share their spokes: most need only be looked at once.
      let vertex = from[spoke] as number;
      let begins = vertex !== last;
      if (!begins) vertex = to[spoke] as number;
      for (;;) {
        const there = POINT * vertex;
        const x = (points[there + AT] as number) - oldX;
        const y = (points[there + AT + 1] as number) - oldY;
        const z = (points[there + AT + 2] as number) - oldZ;
        const share = shareOf(2 * (points[there + LENGTH] as number));
        const lapX = lapOf(points, there, share);
        const lapY = lapOf(points, there + 1, share);
        const lapZ = lapOf(points, there + 2, share);
        if (seen < 3 * MOST_NEAR) {
          near[seen] = x;
          near[seen + 1] = y;
          near[seen + 2] = z;
          seen += 3;
        }
        if (!begins) {
          arcX += lastX + x;
          arcY += lastY + y;
          arcZ += lastZ + z;
          arcLapX += lastLapX + lapX;
          arcLapY += lastLapY + lapY;
          arcLapZ += lastLapZ + lapZ;
          normalX += lastY * z - lastZ * y;
          normalY += lastZ * x - lastX * z;
          normalZ += lastX * y - lastY * x;
          distance += Math.abs(lastX) + Math.abs(lastY) + Math.abs(lastZ);
        }
        last = vertex;
        lastX = x;
        lastY = y;
        lastZ = z;
        lastLapX = lapX;
        lastLapY = lapY;
        lastLapZ = lapZ;
        if (!begins) break;
        begins = false;
        vertex = to[spoke] as number;
      }
    }
    this.seen = seen;
    normal[0] = normalX;
    normal[1] = normalY;
    normal[2] = normalZ;
    if (normalX === 0 && normalY === 0 && normalZ === 0) this.addAllFaces(mesh, star, old);
    shorten(normal);

    // Neighbours between two moved triangles count twice, and those at edges that open are not meant.
    const arcs = Math.max(2 * moves - cuts, 0);
    this.kind = 4 * Math.min(cuts, 2) + Math.min((arcs + 1) >> 1, 3);
    this.size = sizeClass(Math.floor((distance * shareOf(cuts + moves)) / 65536));
    const cutShare = shareOf(cuts);
    const arcShare = shareOf(arcs);
    const lapShare = shareOf(2 * (points[POINT * old + LENGTH] as number));
    const lapX = lapOf(points, POINT * old, lapShare);
    const lapY = lapOf(points, POINT * old + 1, lapShare);
    const lapZ = lapOf(points, POINT * old + 2, lapShare);
    this.expect(0, cutX, arcX - cutX, lapX, cutLapX, arcLapX - cutLapX, cutShare, arcShare);
    this.expect(1, cutY, arcY - cutY, lapY, cutLapY, arcLapY - cutLapY, cutShare, arcShare);
    this.expect(2, cutZ, arcZ - cutZ, lapZ, cutLapZ, arcLapZ - cutLapZ, cutShare, arcShare);
  }

  /** Along an axis, where the new vertex is expected: sums over those at edges that open and over the others, weighted. */
  private expect(
    axis: number,
    cut: number,
    arc: number,
    lap: number,
    cutLap: number,
    arcLap: number,
    cutShare: number,
    arcShare: number,
  ): void {
    const { weights } = this;
    const first = FEATURES * this.kind;
    const sum =
      (32 +
        Math.imul(weights[first] as number, Math.floor((cut * cutShare) / 4096)) +
        Math.imul(weights[first + 1] as number, Math.floor((arc * arcShare) / 4096)) +
        Math.imul(weights[first + 2] as number, lap) +
        Math.imul(weights[first + 3] as number, Math.floor((cutLap * cutShare) / 65536)) +
        Math.imul(weights[first + 4] as number, Math.floor((arcLap * arcShare) / 65536))) |
      0;
    this.expected[axis] = sum >> 6;
  }

  /** Where no moved triangle has area: the normal of all around the vertex. */
  private addAllFaces(mesh: Mesh, star: Star, old: number): void {
    const { points } = mesh;
    const here = POINT * old + AT;
    const way = (vertex: number, axis: number) =>
      (points[POINT * vertex + AT + axis] as number) - (points[here + axis] as number);
    for (let i = 0; i < star.spokes; i += 1) {
      const from = star.from[i] as number;
      const to = star.to[i] as number;
      addCross(this.normal, way(from, 0), way(from, 1), way(from, 2), way(to, 0), way(to, 1), way(to, 2));
    }
  }

  /** Reads where the new vertex is; `before` is what the old one's coordinates shared. */
  read(reader: Reader, before: number): void {
    const { expected, step, normal, size } = this;
    this.shared = reader.symbol(this.sharedModels + 3 * (before & 7) + (this.kind >> 2));

    const top = steepest(normal);
    let off = 0;
    let lowClass = 0;
    let middleClass = 0;
    for (let turn = 0; turn < 2; turn += 1) {
      const axis = (top + 1 + turn) % 3;
      const guess = expected[axis] as number;
      if ((this.shared >> axis) & 1) {
        step[axis] = this.nearest(axis);
      } else {
        const model = turn === 0 ? this.lowModels + size : this.middleModels + 8 * (size >> 1) + (lowClass >> 1);
        step[axis] = reader.residual(model) + rounded(guess);
        if (turn === 0) lowClass = reader.sizeClass;
        else middleClass = reader.sizeClass;
      }
      off += (normal[axis] as number) * (16 * (step[axis] as number) - guess);
    }
    if ((this.shared >> top) & 1) {
      step[top] = this.nearest(top);
      return;
    }
    const steep = normal[top] as number;
    const onPlane = ((expected[top] as number) - (steep === 0 ? 0 : Math.trunc(off / steep))) | 0;
    const model = this.topModels + 8 * (size >> 1) + (Math.max(lowClass, middleClass) >> 1);
    step[top] = reader.residual(model) + rounded(onPlane);
  }

  /** The coordinate of vertices nearby that is nearest to what is expected. */
  private nearest(axis: number): number {
    const { near } = this;
    const expected = this.expected[axis] as number;
    const end = this.seen;
    let best = 0xffff_ffff;
    let found = 0;
    for (let i = axis; i < end; i += 3) {
      const distance = Math.abs((16 * (near[i] as number) - expected) | 0);
      if (distance < best) {
        best = distance;
        found = near[i] as number;
      }
    }
    return found;
  }
}

/** From a vertex to the middle of its neighbours, in 1/16, along the axis of the number `at` of its sum. */
function lapOf(points: Int32Array, at: number, share: number): number {
  if (share === 0) return 0;
  return Math.floor(((points[at + AROUND] as number) * share) / 4096) - 16 * (points[at + AT] as number);
}

export function addCross(
  sum: Float64Array,
  ax: number,
  ay: number,
  az: number,
  bx: number,
  by: number,
  bz: number,
): void {
  sum[0] = (sum[0] as number) + ay * bz - az * by;
  sum[1] = (sum[1] as number) + az * bx - ax * bz;
  sum[2] = (sum[2] as number) + ax * by - ay * bx;
}

/** Along which axis a surface with this normal is steepest. */
function steepest(normal: Float64Array): number {
  const x = Math.abs(normal[0] as number);
  const y = Math.abs(normal[1] as number);
  const z = Math.abs(normal[2] as number);
  if (x > y) return x > z ? 0 : 2;
  return y > z ? 1 : 2;
}

/** Sixteenths of a step as steps. */
function rounded(sixteenths: number): number {
  return ((sixteenths + 8) | 0) >> 4;
}
