/**
 * How are whole numbers kept that become more and more, without making new arrays all the time? In lists that double
 * their room when they are full and keep it when they are emptied.
 */
export class IntList {
  values: Int32Array;
  length = 0;

  constructor(room = 16) {
    this.values = new Int32Array(room);
  }

  push(value: number): void {
    if (this.length === this.values.length) this.values = widened(this.values, this.length + 1);
    this.values[this.length] = value;
    this.length += 1;
  }

  at(index: number): number {
    return this.values[index] as number;
  }

  /** The values, with room for at least so many. Who writes there sets the length. */
  room(length: number): Int32Array {
    if (length > this.values.length) this.values = widened(this.values, length);
    return this.values;
  }

  /** Makes the list so long; what is new has this value. */
  extend(length: number, value: number): void {
    const values = this.room(length);
    for (let i = this.length; i < length; i += 1) values[i] = value;
    this.length = Math.max(length, this.length);
  }

  clear(): void {
    this.length = 0;
  }
}

/** The same numbers with room for at least so many; the same array when it has that room. */
export function widened<T extends Int32Array | Uint8Array>(array: T, length: number): T {
  if (length <= array.length) return array;
  const wide = new (array.constructor as new (length: number) => T)(Math.max(length, 2 * array.length));
  wide.set(array);
  return wide;
}

/** Memory of these arrays. */
export function bytesOf(...arrays: readonly (Int32Array | Uint8Array)[]): number {
  return arrays.reduce((sum, { byteLength }) => sum + byteLength, 0);
}
