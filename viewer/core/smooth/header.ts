/**
 * What does a smooth LOD say of itself before its stream begins? `docs/SLOD.md` §1 has the table of bytes.
 */
import { damaged, SmoothError } from "./rans.ts";

export type ChannelKind = "normal" | "uv" | "colour";

/** Some attribute of a corner. Real value of its number i: `low[i % 2] + number · step[i % 2]`; not of normals. */
export interface Channel {
  readonly kind: ChannelKind;
  readonly low: readonly [number, number];
  readonly step: readonly [number, number];
}

/** A place to stop. */
export interface Cut {
  /** From the beginning of the file. */
  readonly bytes: number;
  /** Of the mesh that those bytes give. */
  readonly triangles: number;
  /** Measured root mean square distance to the whole mesh, in model-space units. */
  readonly rmsError: number;
}

export interface Header {
  /** Bytes of the header itself. */
  readonly bytes: number;
  readonly totalBytes: number;
  /** Of a coordinate, 1 to 16. */
  readonly bits: number;
  readonly vertices: number;
  readonly triangles: number;
  readonly wedges: number;
  readonly materials: number;
  /** Where the lattice begins, in model space, and its finest step. */
  readonly origin: readonly [number, number, number];
  readonly step: number;
  readonly channels: readonly Channel[];
  /** Numbers of a wedge. */
  readonly stride: number;
  /** How positions are predicted: five weights for each of twelve kinds of neighbourhoods. */
  readonly weights: Int32Array;
  readonly cuts: readonly Cut[];
}

const MAGIC = [0x53, 0x4c, 0x4f, 0x44];
const FIXED_BYTES = 44;
const HOODS = 12;
export const FEATURES = 5;
const USUAL_WEIGHTS = [16, 16, -8, 16, 16];
const KINDS: readonly ChannelKind[] = ["normal", "uv", "colour"];

export function numbersOf(kind: ChannelKind): number {
  return kind === "colour" ? 4 : 2;
}

/** Of the bytes that it reads. */
const VERSION = 2;

/** Reads a header; `undefined` while its bytes have not all come. */
export function readHeader(bytes: Uint8Array): Header | undefined {
  if (MAGIC.some((byte, i) => i < bytes.length && bytes[i] !== byte)) {
    throw new SmoothError('this is not a smooth LOD: it does not begin with "SLOD"');
  }
  const version = bytes[4] ?? VERSION;
  if (version !== VERSION) {
    throw new SmoothError(`this smooth LOD has version ${version}, and only ${VERSION} is known: update the viewer`);
  }
  if (bytes.length < FIXED_BYTES) return undefined;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = FIXED_BYTES;
  const has = (count: number) => at + count <= bytes.length;
  const f32 = (place: number) => view.getFloat32(place, true);

  const channels: Channel[] = [];
  for (let i = 0; i < view.getUint8(6); i += 1) {
    if (!has(1)) return undefined;
    const kind = KINDS[view.getUint8(at)] ?? damaged("its header has an unknown attribute");
    at += 1;
    if (kind === "normal") {
      channels.push({ kind, low: [0, 0], step: [0, 0] });
      continue;
    }
    if (!has(16)) return undefined;
    channels.push({ kind, low: [f32(at), f32(at + 4)], step: [f32(at + 8), f32(at + 12)] });
    at += 16;
  }

  const own = view.getUint16(26, true);
  const weights = new Int32Array(FEATURES * HOODS);
  for (let hood = 0; hood < HOODS; hood += 1) {
    const isOwn = ((own >> hood) & 1) === 1;
    if (isOwn && !has(FEATURES)) return undefined;
    for (let i = 0; i < FEATURES; i += 1) {
      weights[FEATURES * hood + i] = isOwn ? view.getInt8(at + i) : (USUAL_WEIGHTS[i] as number);
    }
    if (isOwn) at += FEATURES;
  }

  const cutCount = view.getUint8(7);
  if (!has(12 * cutCount)) return undefined;
  const cuts: Cut[] = [];
  for (let i = 0; i < cutCount; i += 1, at += 12) {
    cuts.push({ bytes: view.getUint32(at, true), triangles: view.getUint32(at + 4, true), rmsError: f32(at + 8) });
  }
  return checked({
    bytes: at,
    totalBytes: view.getUint32(8, true),
    bits: view.getUint8(5),
    vertices: view.getUint32(12, true),
    triangles: view.getUint32(16, true),
    wedges: view.getUint32(20, true),
    materials: view.getUint16(24, true),
    origin: [f32(28), f32(32), f32(36)],
    step: f32(40),
    channels,
    stride: channels.reduce((sum, { kind }) => sum + numbersOf(kind), 0),
    weights,
    cuts,
  });
}

function checked(header: Header): Header {
  const { channels } = header;
  const floats = [...header.origin, header.step, ...channels.flatMap(({ low, step }) => [...low, ...step])];
  if (header.bits < 1 || header.bits > 16) damaged("its coordinates have no bits or more than 16");
  if (channels.length > 8) damaged("it has more attributes than there can be");
  const count = (kind: ChannelKind) => channels.filter((channel) => channel.kind === kind).length;
  if (count("normal") > 1 || count("colour") > 1) damaged("it has more than one normal or colour of a corner");
  if (header.materials === 0) damaged("it has no material");
  if (header.totalBytes < header.bytes) damaged("it is shorter than its header");
  if (header.vertices === 0xffff_ffff || header.triangles > 0x07ff_ffff) {
    damaged("it has more vertices or triangles than there can be");
  }
  // Whatever a damaged stream does with them stays finite in single precision.
  const sane = (number: number) => Math.abs(number) <= 1e24;
  if (!floats.every(sane)) damaged("its header has a number that is not finite, or too large");
  if (header.step < 0) damaged("its lattice has a negative step");
  if (channels.length === 0 && header.wedges > 0) damaged("it has wedges without attributes");
  if (!cutsRise(header)) damaged("its cuts do not rise to its end");
  return header;
}

/** Whether bytes rise and errors fall from cut to cut, and the last one is all there is. */
function cutsRise({ cuts, totalBytes, triangles }: Header): boolean {
  const rise = cuts.every((cut, i) => {
    const before = cuts[i - 1];
    if (!before) return true;
    return before.bytes < cut.bytes && before.triangles <= cut.triangles && before.rmsError >= cut.rmsError;
  });
  const last = cuts.at(-1);
  return rise && (!last || (last.bytes === totalBytes && last.triangles === triangles && last.rmsError >= 0));
}

/** No sound stream needs more places in its vertices' lists than this. */
export function mostPlaces({ vertices, triangles }: Header): number {
  return 16 * vertices + 32 * triangles + 1024;
}

/** A decoder takes no more memory than this, the stream's own bytes included. */
export function memoryBytes(header: Header): number {
  const corners = header.channels.length === 0 ? 0 : 76;
  const arrays =
    Math.max(header.vertices, 1) * 64 +
    header.triangles * (54 + corners) +
    header.wedges * 4 * (1 + header.stride) +
    4 * mostPlaces(header) +
    header.totalBytes;
  // Arrays double their room when they grow.
  return 2 * arrays + 2 ** 20;
}
