/**
 * Which triangles meet at a vertex? Lists in one array, in blocks of 8, 16, 32 … places that are used again.
 *
 * Where the list of a vertex begins and how long it is stands with its coordinates, for all that looks at a vertex needs it.
 */
import { bytesOf, widened } from "./list.ts";

const SMALLEST = 8;
/** Fewer places are moved one by one: a call takes longer. */
const MOST_STEPS = 32;

/** Numbers of a vertex in an array of them: the sum of its neighbours, coordinates, and its list. */
export const POINT = 8;
export const AROUND = 0;
export const AT = 3;
export const FIRST = 6;
export const LENGTH = 7;

/** One list for each vertex. */
export class Stars {
  /** The triangles of a vertex stand from its `FIRST` on, `LENGTH` of them. */
  places = new Int32Array(128);
  /** The block of a list has 8 · 2^class places. */
  private class = new Uint8Array(16);
  private used = 0;
  /** First places of unused blocks, by class. */
  private readonly free: number[][] = [];

  /** How many places there are. */
  get placeCount(): number {
    return this.used;
  }

  /** Memory that they take. */
  get bytes(): number {
    return bytesOf(this.places, this.class);
  }

  /** Makes room for the lists of so many vertices. */
  reserve(vertices: number): void {
    this.class = widened(this.class, vertices);
    this.places = widened(this.places, SMALLEST * vertices);
  }

  /** A list without triangles for a vertex. */
  add(points: Int32Array, vertex: number): void {
    points[POINT * vertex + FIRST] = this.block(0);
    points[POINT * vertex + LENGTH] = 0;
  }

  /** Makes a list so long and gives its first place; whoever calls it writes all of it anew. */
  resize(points: Int32Array, vertex: number, length: number): number {
    const room = SMALLEST << (this.class[vertex] as number);
    if (length > room || (room > SMALLEST && 4 * length < room)) this.move(points, vertex, length, 0);
    points[POINT * vertex + LENGTH] = length;
    return points[POINT * vertex + FIRST] as number;
  }

  /** Puts a triangle after or before another, or at the end if that is not there; for −1 it is not looked for. */
  insert(points: Int32Array, vertex: number, neighbour: number, after: number, triangle: number): void {
    const length = points[POINT * vertex + LENGTH] as number;
    if (length === SMALLEST << (this.class[vertex] as number)) this.move(points, vertex, length + 1, length);
    const { places } = this;
    const first = points[POINT * vertex + FIRST] as number;
    const end = first + length;
    let at = first;
    if (neighbour < 0) at = end;
    while (at < end && places[at] !== neighbour) at += 1;
    if (at < end) at += after;
    if (end - at > MOST_STEPS) places.copyWithin(at + 1, at, end);
    else for (let i = end; i > at; i -= 1) places[i] = places[i - 1] as number;
    places[at] = triangle;
    points[POINT * vertex + LENGTH] = length + 1;
  }

  /** Gives a list another block, as large as it needs; its first `kept` places stay. */
  private move(points: Int32Array, vertex: number, length: number, kept: number): void {
    const blocks = Math.max(Math.ceil(length / SMALLEST), 1);
    const sizeClass = 32 - Math.clz32(blocks - 1);
    const first = this.block(sizeClass);
    const old = points[POINT * vertex + FIRST] as number;
    this.places.copyWithin(first, old, old + kept);
    this.freeOf(this.class[vertex] as number).push(old);
    points[POINT * vertex + FIRST] = first;
    this.class[vertex] = sizeClass;
  }

  private block(sizeClass: number): number {
    const unused = this.freeOf(sizeClass).pop();
    if (unused !== undefined) return unused;
    const first = this.used;
    this.used += SMALLEST << sizeClass;
    if (this.used > this.places.length) this.places = widened(this.places, this.used);
    return first;
  }

  private freeOf(sizeClass: number): number[] {
    while (this.free.length <= sizeClass) this.free.push([]);
    return this.free[sizeClass] as number[];
  }
}
