/**
 * Which triangles meet at a vertex? Lists in one array, in blocks of 8, 16, 32 … places that are used again.
 */
import { bytesOf, widened } from "./list.ts";

const SMALLEST = 8;

/** One list for each vertex. */
export class Stars {
  /** The triangles of vertex v stand from `first[v]` on, `length[v]` of them. */
  places = new Int32Array(128);
  first = new Int32Array(16);
  length = new Int32Array(16);
  /** The block of a list has 8 · 2^class places. */
  private class = new Uint8Array(16);
  private lists = 0;
  private used = 0;
  /** First places of unused blocks, by class. */
  private readonly free: number[][] = [];

  /** How many places there are. */
  get placeCount(): number {
    return this.used;
  }

  /** Memory that they take. */
  get bytes(): number {
    return bytesOf(this.places, this.first, this.length, this.class);
  }

  /** Another vertex, without triangles. */
  add(): void {
    if (this.lists === this.first.length) {
      this.first = widened(this.first, this.lists + 1);
      this.length = widened(this.length, this.lists + 1);
      this.class = widened(this.class, this.lists + 1);
    }
    this.first[this.lists] = this.block(0);
    this.lists += 1;
  }

  /** Replaces a list by the first `count` of these triangles. */
  set(vertex: number, triangles: Int32Array, count: number): void {
    const sizeClass = this.class[vertex] as number;
    if (count > SMALLEST << sizeClass || (sizeClass > 0 && 4 * count < SMALLEST << sizeClass)) {
      this.move(vertex, count, 0);
    }
    const first = this.first[vertex] as number;
    for (let i = 0; i < count; i += 1) this.places[first + i] = triangles[i] as number;
    this.length[vertex] = count;
  }

  /** Puts a triangle after or before another, or at the end if that is not there. */
  insert(vertex: number, neighbour: number, after: boolean, triangle: number): void {
    const length = this.length[vertex] as number;
    if (length + 1 > SMALLEST << (this.class[vertex] as number)) this.move(vertex, length + 1, length);
    const { places } = this;
    const first = this.first[vertex] as number;
    const end = first + length;
    let at = first;
    while (at < end && places[at] !== neighbour) at += 1;
    if (at < end && after) at += 1;
    for (let i = end; i > at; i -= 1) places[i] = places[i - 1] as number;
    places[at] = triangle;
    this.length[vertex] = length + 1;
  }

  /** Gives a list another block, as large as it needs; its first `kept` places stay. */
  private move(vertex: number, length: number, kept: number): void {
    const blocks = Math.max(Math.ceil(length / SMALLEST), 1);
    const sizeClass = 32 - Math.clz32(blocks - 1);
    const first = this.block(sizeClass);
    const old = this.first[vertex] as number;
    this.places.copyWithin(first, old, old + kept);
    this.freeOf(this.class[vertex] as number).push(old);
    this.first[vertex] = first;
    this.class[vertex] = sizeClass;
  }

  private block(sizeClass: number): number {
    const unused = this.freeOf(sizeClass).pop();
    if (unused !== undefined) return unused;
    const first = this.used;
    this.used += SMALLEST << sizeClass;
    this.places = widened(this.places, this.used);
    return first;
  }

  private freeOf(sizeClass: number): number[] {
    while (this.free.length <= sizeClass) this.free.push([]);
    return this.free[sizeClass] as number[];
  }
}
