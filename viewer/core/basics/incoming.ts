/**
 * What has come of something that is still on its way? Its bytes so far, piece after piece, any part of which can be taken out
 * before the rest is here.
 */

/** Room from the beginning, whatever is said of the size … */
const LEAST_BYTES = 4096;
/** … and what is believed of it at most. */
const MOST_TOLD_BYTES = 1024 * 1024;

export class Incoming {
  private bytes: Uint8Array<ArrayBuffer>;
  private came = 0;

  /** `told_bytes` is how large it is said to be. */
  constructor(told_bytes = 0) {
    this.bytes = new Uint8Array(Math.min(MOST_TOLD_BYTES, Math.max(LEAST_BYTES, told_bytes)));
  }

  /** All of it at once. */
  static of(whole: ArrayBuffer): Incoming {
    const incoming = new Incoming();
    incoming.bytes = new Uint8Array(whole);
    incoming.came = whole.byteLength;
    return incoming;
  }

  /** How many bytes have come. */
  get length(): number {
    return this.came;
  }

  push(piece: Uint8Array): void {
    const needed = this.came + piece.byteLength;
    if (needed > this.bytes.byteLength) {
      const wide = new Uint8Array(Math.max(needed, 2 * this.bytes.byteLength));
      wide.set(this.bytes.subarray(0, this.came));
      this.bytes = wide;
    }
    this.bytes.set(piece, this.came);
    this.came = needed;
  }

  /** A copy of these bytes, which must have come. */
  slice(from: number, to: number): ArrayBuffer {
    return this.bytes.slice(from, Math.min(to, this.came)).buffer;
  }

  /** To read what has come where it is. */
  get view(): DataView {
    return new DataView(this.bytes.buffer, 0, this.came);
  }
}
