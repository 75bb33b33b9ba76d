/**
 * How is one smooth LOD decoded while its rungs arrive? Bytes in, GLBs out, on whichever thread this runs.
 */
import { SmoothDecoder, snapshotOf } from "../smooth/index.ts";
import { smoothGlb } from "./smoothglb.ts";

/** A stream that may take more memory than this is refused, and its model drawn by levels. */
const MOST_MEMORY_BYTES = 2 ** 29;
/** A slice takes up to about a millisecond to decode. */
const SLICE_BYTES = 2048;

/** What a stream gives after some of its rungs. */
export interface Refined {
  /** To draw, as a level is. */
  readonly glb: ArrayBuffer;
  /** Memory that is kept for going on; none once the stream is whole. */
  readonly state_bytes: number;
}

export class SmoothStream {
  private decoder: SmoothDecoder | undefined = new SmoothDecoder(MOST_MEMORY_BYTES);

  /** `materials` is the text of the model's glTF document. */
  constructor(private readonly materials: string) {}

  /** Takes in bytes slice by slice, so that who calls may pause in between; throws when they are damaged. */
  *take(rungs: readonly ArrayBuffer[]): Generator<void, Refined> {
    const { decoder } = this;
    if (!decoder) throw new Error("this smooth LOD is whole already, and more bytes came for it");
    for (const rung of rungs) {
      for (let at = 0; at < rung.byteLength; at += SLICE_BYTES) {
        decoder.push(new Uint8Array(rung, at, Math.min(SLICE_BYTES, rung.byteLength - at)));
        yield;
      }
    }
    const glb = smoothGlb(snapshotOf(decoder), this.materials);
    if (decoder.isComplete) this.decoder = undefined;
    return { glb, state_bytes: this.decoder?.stateBytes ?? 0 };
  }
}
