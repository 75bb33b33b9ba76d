/**
 * How does a client get a mesh out of a smooth LOD while it arrives? Bytes in, triangles out.
 *
 * After any number of bytes there is a valid mesh: all indices are in range and no triangle has a corner twice. When all
 * bytes have come it is the mesh that was encoded, bit for bit. Until then it may lag behind the bytes by what one split
 * takes, some dozen bytes. It takes no more memory than {@link memoryBytes} says of the header.
 */
import { type Header, memoryBytes, readHeader } from "./header.ts";
import { widened } from "./list.ts";
import { damaged, SmoothError } from "./rans.ts";
import { Replay } from "./replay.ts";

const STATE_BYTES = 8;

/** Decodes one smooth LOD. */
export class SmoothDecoder {
  private bytes = new Uint8Array(256);
  private length = 0;
  private begun: { readonly header: Header; readonly replay: Replay } | undefined;
  private damage: unknown;

  /** A decoder that refuses what may take more memory than this. */
  constructor(private readonly mostMemoryBytes: number) {}

  /** What the header says, as soon as it has come. */
  get header(): Header | undefined {
    return this.begun?.header;
  }

  /** Triangles of the mesh so far. */
  get triangles(): number {
    return this.begun?.replay.mesh.triangles ?? 0;
  }

  /** Whether the mesh is whole. */
  get isComplete(): boolean {
    return this.begun?.replay.isEnd ?? false;
  }

  /** Memory that it takes now: what came, the mesh so far and what was learnt to read on. */
  get stateBytes(): number {
    const replay = this.begun?.replay;
    return this.bytes.byteLength + (replay?.bytes ?? 0);
  }

  /** What was decoded, with what its header says; for snapshots. */
  get decoded(): { readonly header: Header; readonly replay: Replay } | undefined {
    return this.begun;
  }

  /**
   * Takes in the next bytes and refines the mesh as far as they go. Throws a {@link SmoothError} when they cannot be
   * those of a smooth LOD, or it may take too much memory; what was decoded before stays, and so does the error.
   */
  push(bytes: Uint8Array): void {
    if (this.damage !== undefined) throw this.damage;
    try {
      this.take(bytes);
    } catch (error) {
      this.damage = error;
      throw error;
    }
  }

  private take(bytes: Uint8Array): void {
    const most = this.begun?.header.totalBytes ?? Number.POSITIVE_INFINITY;
    if (this.length + bytes.length > most) damaged("it goes on after its end");
    this.bytes = widened(this.bytes, this.length + bytes.length);
    this.bytes.set(bytes, this.length);
    this.length += bytes.length;
    if (!this.begun) {
      const header = readHeader(this.bytes.subarray(0, this.length));
      if (!header) return;
      const needed = memoryBytes(header);
      if (needed > this.mostMemoryBytes) {
        const allowed = `${this.mostMemoryBytes} are allowed: raise the limit`;
        throw new SmoothError(`this smooth LOD may take ${needed} bytes of memory, and ${allowed}`);
      }
      if (this.length > header.totalBytes) damaged("it goes on after its end");
      this.begun = { header, replay: new Replay(header) };
    }
    this.run(this.begun.header, this.begun.replay);
  }

  private run(header: Header, replay: Replay): void {
    const isWhole = this.length === header.totalBytes;
    const stream = this.length - header.bytes;
    if (stream < STATE_BYTES) {
      if (isWhole && header.triangles > 0) damaged("it has no stream");
      if (isWhole) replay.finish();
      return;
    }
    const { reader, mesh, attributes } = replay;
    reader.reach(this.bytes.subarray(header.bytes), stream);
    replay.run(stream, isWhole);
    const isAll =
      mesh.vertices === header.vertices &&
      mesh.triangles === header.triangles &&
      attributes.values.length === header.wedges * header.stride;
    if (isWhole && !(isAll && reader.isEnd)) damaged("its stream does not end as its header says");
  }
}
