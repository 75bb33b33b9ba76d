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
  private readonly features = new Int32Array(3 * FEATURES);
  private readonly normal = new Float64Array(3);
  /**
   * What {@link see} saw, the old vertex itself first: ways from it to others, and from those to the middles of their
   * neighbours, in 1/16.
   */
  private ways = new Int32Array(3 * 64);
  private laps = new Float64Array(3 * 64);
  private seen = 1;
  private readonly arc = new Float64Array(3);
  private readonly arcLap = new Float64Array(3);
  private readonly expected = new Int32Array(3);

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

  /** Looks around a vertex before its split is done. */
  look(mesh: Mesh, star: Star, split: Split, change: Change, old: number): void {
    const opened = change.third.length;
    const cuts = opened + split.extraThird.length;
    const moved = change.moved.length;
    const most = 3 * (1 + cuts + 2 * moved);
    if (most > this.ways.length) {
      this.ways = new Int32Array(2 * most);
      this.laps = new Float64Array(2 * most);
    }
    const { ways, laps, features } = this;
    const { points } = mesh;
    const from = star.from.values;
    const to = star.to.values;
    this.seen = 1;
    for (let i = 0; i < cuts; i += 1) {
      this.see(points, old, i < opened ? change.third.at(i) : split.extraThird.at(i - opened));
    }
    const firstArc = 3 * this.seen;
    let distance = 0;
    for (let i = 3; i < firstArc; i += 1) distance += Math.abs(ways[i] as number);

    // Rows of triangles share their spokes: most need only be looked at once.
    const { arc, arcLap, normal } = this;
    clear(arc);
    clear(arcLap);
    clear(normal);
    let last = NONE;
    for (let i = 0; i < moved; i += 1) {
      const spoke = change.moved.at(i);
      if (from[spoke] !== last) this.see(points, old, from[spoke] as number);
      const before = 3 * (this.seen - 1);
      last = to[spoke] as number;
      this.see(points, old, last);
      const ax = ways[before] as number;
      const ay = ways[before + 1] as number;
      const az = ways[before + 2] as number;
      const bx = ways[before + 3] as number;
      const by = ways[before + 4] as number;
      const bz = ways[before + 5] as number;
      arc[0] = (arc[0] as number) + ax + bx;
      arc[1] = (arc[1] as number) + ay + by;
      arc[2] = (arc[2] as number) + az + bz;
      arcLap[0] = (arcLap[0] as number) + (laps[before] as number) + (laps[before + 3] as number);
      arcLap[1] = (arcLap[1] as number) + (laps[before + 1] as number) + (laps[before + 4] as number);
      arcLap[2] = (arcLap[2] as number) + (laps[before + 2] as number) + (laps[before + 5] as number);
      addCross(normal, ax, ay, az, bx, by, bz);
      distance += Math.abs(ax) + Math.abs(ay) + Math.abs(az);
    }
    if (normal[0] === 0 && normal[1] === 0 && normal[2] === 0) this.addAllFaces(mesh, star, old);
    shorten(normal);

    // Neighbours between two moved triangles count twice, and those at edges that open are not meant.
    const arcs = Math.max(2 * moved - cuts, 0);
    const cutShare = shareOf(cuts);
    const arcShare = shareOf(arcs);
    const lapShare = shareOf(2 * (points[POINT * old + LENGTH] as number));
    for (let axis = 0; axis < 3; axis += 1) {
      let cut = 0;
      let cutLap = 0;
      for (let i = 3 + axis; i < firstArc; i += 3) {
        cut += ways[i] as number;
        cutLap += laps[i] as number;
      }
      features[axis] = Math.floor((cut * cutShare) / 4096);
      features[3 + axis] = Math.floor((((arc[axis] as number) - cut) * arcShare) / 4096);
      features[6 + axis] = lapOf(points, POINT * old + axis, lapShare);
      features[9 + axis] = Math.floor((cutLap * cutShare) / 65536);
      features[12 + axis] = Math.floor((((arcLap[axis] as number) - cutLap) * arcShare) / 65536);
    }
    this.kind = 4 * Math.min(cuts, 2) + Math.min((arcs + 1) >> 1, 3);
    this.size = sizeClass(Math.floor((distance * shareOf(cuts + moved)) / 65536));
  }

  /** Looks at a vertex from the old one. */
  private see(points: Int32Array, old: number, vertex: number): void {
    const { ways, laps } = this;
    const slot = 3 * this.seen;
    const here = POINT * old + AT;
    const there = POINT * vertex + AT;
    ways[slot] = (points[there] as number) - (points[here] as number);
    ways[slot + 1] = (points[there + 1] as number) - (points[here + 1] as number);
    ways[slot + 2] = (points[there + 2] as number) - (points[here + 2] as number);
    const share = shareOf(2 * (points[POINT * vertex + LENGTH] as number));
    laps[slot] = lapOf(points, POINT * vertex, share);
    laps[slot + 1] = lapOf(points, POINT * vertex + 1, share);
    laps[slot + 2] = lapOf(points, POINT * vertex + 2, share);
    this.seen += 1;
  }

  /** Where no moved triangle has area: the normal of all around the vertex. */
  private addAllFaces(mesh: Mesh, star: Star, old: number): void {
    const { points } = mesh;
    const here = POINT * old + AT;
    const way = (vertex: number, axis: number) =>
      (points[POINT * vertex + AT + axis] as number) - (points[here + axis] as number);
    for (let i = 0; i < star.spokes; i += 1) {
      const from = star.from.at(i);
      const to = star.to.at(i);
      addCross(this.normal, way(from, 0), way(from, 1), way(from, 2), way(to, 0), way(to, 1), way(to, 2));
    }
  }

  /** Reads where the new vertex is; `before` is what the old one's coordinates shared. */
  read(reader: Reader, before: number): void {
    const { expected, step, normal, size } = this;
    this.predict();
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

  /** What is expected, from the old vertex in 1/16 of a step. */
  private predict(): void {
    const { expected, features, weights } = this;
    const first = FEATURES * this.kind;
    for (let axis = 0; axis < 3; axis += 1) {
      let sum = 32;
      for (let i = 0; i < FEATURES; i += 1) {
        sum = (sum + Math.imul(weights[first + i] as number, features[3 * i + axis] as number)) | 0;
      }
      expected[axis] = sum >> 6;
    }
  }

  /** The coordinate of vertices nearby that is nearest to what is expected. */
  private nearest(axis: number): number {
    const { ways } = this;
    const expected = this.expected[axis] as number;
    const end = 3 * Math.min(this.seen, MOST_NEAR);
    let best = 0xffff_ffff;
    let found = 0;
    for (let i = axis; i < end; i += 3) {
      const distance = Math.abs((16 * (ways[i] as number) - expected) | 0);
      if (distance < best) {
        best = distance;
        found = ways[i] as number;
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
