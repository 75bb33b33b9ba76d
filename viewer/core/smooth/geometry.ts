/**
 * Where is a new vertex? A prediction from what surrounds it, and what is missing from it (`docs/SLOD.md` §7).
 *
 * Sums are whole numbers in doubles, which hold them exactly; `| 0` wraps at 32 bits where the format says so.
 */
import type { Change } from "./change.ts";
import type { Star } from "./fan.ts";
import { FEATURES, type Header } from "./header.ts";
import type { Mesh } from "./mesh.ts";
import type { ModelSpace, Reader } from "./rans.ts";
import type { Split } from "./split.ts";

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

/** Leaves a direction's 15 first bits. */
export function shorten(direction: Float64Array): void {
  const longest = Math.max(
    Math.abs(direction[0] as number),
    Math.abs(direction[1] as number),
    Math.abs(direction[2] as number),
  );
  if (longest < 32768) return;
  const bits = longest < 2 ** 32 ? 32 - Math.clz32(longest) : 64 - Math.clz32(Math.floor(longest / 2 ** 32));
  const scale = 2 ** (15 - bits);
  for (let axis = 0; axis < 3; axis += 1) direction[axis] = Math.floor((direction[axis] as number) * scale);
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
  private readonly near = new Int32Array(3 * MOST_NEAR);
  private nearCount = 0;
  /** What {@link see} saw last: from the old vertex to another, and from that to the middle of its neighbours. */
  private readonly way = new Float64Array(3);
  private readonly lap = new Float64Array(3);
  private readonly lastWay = new Float64Array(3);
  private readonly lastLap = new Float64Array(3);
  private readonly cut = new Float64Array(3);
  private readonly cutLap = new Float64Array(3);
  private readonly arc = new Float64Array(3);
  private readonly arcLap = new Float64Array(3);
  private readonly expected = new Int32Array(3);
  private readonly nearest = new Int32Array(3);

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
    const { way, lap, lastWay, lastLap, cut, cutLap, arc, arcLap, normal, features } = this;
    clear(cut);
    clear(cutLap);
    clear(arc);
    clear(arcLap);
    clear(normal);
    // The old vertex itself, which stands at the beginning for good.
    this.nearCount = 1;
    let distance = 0;

    const opened = change.third.length;
    const cuts = opened + split.extraThird.length;
    for (let i = 0; i < cuts; i += 1) {
      this.see(mesh, old, i < opened ? change.third.at(i) : split.extraThird.at(i - opened));
      for (let axis = 0; axis < 3; axis += 1) {
        cut[axis] = (cut[axis] as number) + (way[axis] as number);
        cutLap[axis] = (cutLap[axis] as number) + (lap[axis] as number);
        distance += Math.abs(way[axis] as number);
      }
    }

    // Rows of triangles share their spokes: most need only be looked at once.
    const moved = change.moved.length;
    let last = -1;
    for (let i = 0; i < moved; i += 1) {
      const spoke = change.moved.at(i);
      if (star.from.at(spoke) !== last) {
        this.see(mesh, old, star.from.at(spoke));
        this.remember();
      }
      last = star.to.at(spoke);
      this.see(mesh, old, last);
      for (let axis = 0; axis < 3; axis += 1) {
        arc[axis] = (arc[axis] as number) + (lastWay[axis] as number) + (way[axis] as number);
        arcLap[axis] = (arcLap[axis] as number) + (lastLap[axis] as number) + (lap[axis] as number);
        distance += Math.abs(lastWay[axis] as number);
      }
      addCross(normal, lastWay, way);
      this.remember();
    }
    if (normal[0] === 0 && normal[1] === 0 && normal[2] === 0) this.addAllFaces(mesh, star, old);
    shorten(normal);

    const lapShare = lapShareOf(mesh, old);
    const cutShare = shareOf(cuts);
    // Neighbours between two moved triangles count twice, and those at edges that open are not meant.
    const arcs = Math.max(2 * moved - cuts, 0);
    const arcShare = shareOf(arcs);
    for (let axis = 0; axis < 3; axis += 1) {
      const c = cut[axis] as number;
      const cl = cutLap[axis] as number;
      features[axis] = Math.floor((c * cutShare) / 4096);
      features[3 + axis] = Math.floor((((arc[axis] as number) - c) * arcShare) / 4096);
      features[6 + axis] = lapOf(mesh, old, axis, lapShare);
      features[9 + axis] = Math.floor((cl * cutShare) / 65536);
      features[12 + axis] = Math.floor((((arcLap[axis] as number) - cl) * arcShare) / 65536);
    }
    this.kind = 4 * Math.min(cuts, 2) + Math.min((arcs + 1) >> 1, 3);
    this.size = sizeClass(Math.floor((distance * shareOf(cuts + moved)) / 65536));
  }

  /** Looks at a vertex from the old one. */
  private see(mesh: Mesh, old: number, vertex: number): void {
    const { way, lap, near } = this;
    const { at } = mesh;
    const share = lapShareOf(mesh, vertex);
    const slot = this.nearCount < MOST_NEAR ? 3 * this.nearCount : -1;
    for (let axis = 0; axis < 3; axis += 1) {
      const relative = (at[3 * vertex + axis] as number) - (at[3 * old + axis] as number);
      way[axis] = relative;
      lap[axis] = lapOf(mesh, vertex, axis, share);
      if (slot >= 0) near[slot + axis] = relative;
    }
    if (slot >= 0) this.nearCount += 1;
  }

  private remember(): void {
    for (let axis = 0; axis < 3; axis += 1) {
      this.lastWay[axis] = this.way[axis] as number;
      this.lastLap[axis] = this.lap[axis] as number;
    }
  }

  /** Where no moved triangle has area: the normal of all around the vertex. */
  private addAllFaces(mesh: Mesh, star: Star, old: number): void {
    const { way, lastWay, normal } = this;
    for (let i = 0; i < star.spokes; i += 1) {
      for (let axis = 0; axis < 3; axis += 1) {
        const here = mesh.at[3 * old + axis] as number;
        lastWay[axis] = (mesh.at[3 * star.from.at(i) + axis] as number) - here;
        way[axis] = (mesh.at[3 * star.to.at(i) + axis] as number) - here;
      }
      addCross(normal, lastWay, way);
    }
  }

  /** Reads where the new vertex is; `before` is what the old one's coordinates shared. */
  read(reader: Reader, before: number): void {
    const { expected, nearest, step, normal, size } = this;
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
        step[axis] = nearest[axis] as number;
      } else {
        const model = turn === 0 ? this.lowModels + size : this.middleModels + 8 * (size >> 1) + (lowClass >> 1);
        step[axis] = reader.residual(model) + rounded(guess);
        if (turn === 0) lowClass = reader.sizeClass;
        else middleClass = reader.sizeClass;
      }
      off += (normal[axis] as number) * (16 * (step[axis] as number) - guess);
    }
    if ((this.shared >> top) & 1) {
      step[top] = nearest[top] as number;
      return;
    }
    const steep = normal[top] as number;
    const onPlane = ((expected[top] as number) - (steep === 0 ? 0 : Math.trunc(off / steep))) | 0;
    const model = this.topModels + 8 * (size >> 1) + (Math.max(lowClass, middleClass) >> 1);
    step[top] = reader.residual(model) + rounded(onPlane);
  }

  /** What is expected, from the old vertex in 1/16 of a step, and the coordinates nearby that are nearest to it. */
  private predict(): void {
    const { expected, nearest, near, features, weights } = this;
    const first = FEATURES * this.kind;
    for (let axis = 0; axis < 3; axis += 1) {
      let sum = 32;
      for (let i = 0; i < FEATURES; i += 1) {
        sum = (sum + Math.imul(weights[first + i] as number, features[3 * i + axis] as number)) | 0;
      }
      const guess = sum >> 6;
      expected[axis] = guess;
      let best = 0xffff_ffff;
      let found = 0;
      for (let i = axis; i < 3 * this.nearCount; i += 3) {
        const distance = Math.abs((16 * (near[i] as number) - guess) | 0);
        if (distance < best) {
          best = distance;
          found = near[i] as number;
        }
      }
      nearest[axis] = found;
    }
  }
}

function lapShareOf(mesh: Mesh, vertex: number): number {
  return shareOf(2 * (mesh.stars.length[vertex] as number));
}

/** From a vertex to the middle of its neighbours along an axis, in 1/16. */
function lapOf(mesh: Mesh, vertex: number, axis: number, share: number): number {
  if (share === 0) return 0;
  const around = mesh.around[3 * vertex + axis] as number;
  return Math.floor((around * share) / 4096) - 16 * (mesh.at[3 * vertex + axis] as number);
}

function addCross(sum: Float64Array, a: Float64Array, b: Float64Array): void {
  const ax = a[0] as number;
  const ay = a[1] as number;
  const az = a[2] as number;
  const bx = b[0] as number;
  const by = b[1] as number;
  const bz = b[2] as number;
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
