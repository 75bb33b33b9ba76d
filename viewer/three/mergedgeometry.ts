/**
 * How does geometry that several paints cover become one? Triangles in turn, of vertices that say which paint is theirs. Numbers stay as
 * they are, in rows of a multiple of four bytes, as graphics cards want them. Only what surfaces without pictures are drawn by is taken
 * over, and of vertices that several pieces share, each takes those that it uses.
 */
import { BufferAttribute, BufferGeometry, InterleavedBuffer, InterleavedBufferAttribute, type TypedArray } from "three";
import { PAINT } from "./paintmaterial.ts";

type Attribute = BufferAttribute | InterleavedBufferAttribute;

/** What plain surfaces are drawn by. */
const DRAWN_BY = ["position", "normal", "color"] as const;
/** A row is a multiple of so many bytes. */
const ALIGNED = 4;
/** The last number that 16 bits hold ends a strip in WebGL. */
const MOST_SHORT_VERTICES = 65_535;

/** Triangles of one paint. */
export interface Piece {
  readonly geometry: BufferGeometry;
  readonly paint: number;
}

/** Which vertices of a geometry are used, in their order, and each corner's place among them. */
interface Corners {
  readonly count: number;
  /** Told where it is not all. */
  readonly chosen: Uint32Array | undefined;
  readonly places: ArrayLike<number>;
}

/** Says what pieces must have alike to become one. */
export function formOf(geometry: BufferGeometry): string {
  const forms = DRAWN_BY.map((name) => {
    const attribute = geometry.getAttribute(name) as Attribute | undefined;
    return attribute && `${name} ${attribute.array.constructor.name} ${attribute.itemSize} ${attribute.normalized}`;
  });
  return forms.filter((form) => form !== undefined).join();
}

/** One geometry of pieces of one form. */
export function merged(pieces: readonly Piece[]): BufferGeometry {
  const corners = pieces.map(({ geometry }) => cornersOf(geometry));
  const count = corners.reduce((sum, piece) => sum + piece.count, 0);
  const geometry = new BufferGeometry();
  for (const name of DRAWN_BY) {
    const from = pieces.map((piece) => piece.geometry.getAttribute(name) as Attribute);
    if (from[0]) geometry.setAttribute(name, gathered(from, corners, count));
  }
  geometry.setAttribute(PAINT, paintOf(geometry.getAttribute("position") as Attribute, pieces, corners));
  geometry.setIndex(indexOf(corners, count));
  // Else who first draws it does this, in the middle of a frame.
  geometry.computeBoundingSphere();
  return geometry;
}

function cornersOf(geometry: BufferGeometry): Corners {
  const { count } = geometry.getAttribute("position");
  const places = geometry.getIndex()?.array ?? Uint32Array.from({ length: count }, (_, i) => i);
  const isUsed = new Uint8Array(count);
  let used = 0;
  for (let i = 0; i < places.length; i += 1) {
    const vertex = places[i] as number;
    if (isUsed[vertex] !== 0) continue;
    isUsed[vertex] = 1;
    used += 1;
  }
  if (used === count) return { count, chosen: undefined, places };
  const chosen = new Uint32Array(used);
  const placeOf = new Uint32Array(count);
  let place = 0;
  for (let vertex = 0; vertex < count; vertex += 1) {
    if (isUsed[vertex] === 0) continue;
    chosen[place] = vertex;
    placeOf[vertex] = place;
    place += 1;
  }
  return { count: used, chosen, places: Uint32Array.from(places, (vertex) => placeOf[vertex] as number) };
}

/** An attribute of the vertices that are used. */
function gathered(from: readonly Attribute[], corners: readonly Corners[], count: number): Attribute {
  const [first] = from as [Attribute];
  const { itemSize } = first;
  const to = rows(first.array.constructor as new (length: number) => TypedArray, itemSize, count);
  let row = 0;
  for (const [piece, { chosen, count }] of corners.entries()) {
    copy(from[piece] as Attribute, chosen, count, to, row);
    row += count;
  }
  return new InterleavedBufferAttribute(to, itemSize, 0, first.normalized);
}

/** Copies rows, all or those that are chosen, to rows that begin at so many. */
function copy(
  attribute: Attribute,
  chosen: Uint32Array | undefined,
  count: number,
  { array, stride }: InterleavedBuffer,
  row: number,
): void {
  const { array: numbers, itemSize } = attribute;
  const isInterleaved = attribute instanceof InterleavedBufferAttribute;
  const [start, step] = isInterleaved ? [attribute.offset, attribute.data.stride] : [0, itemSize];
  let end = stride * row;
  if (!chosen && start === 0 && step === stride) {
    array.set(numbers.subarray(0, stride * count), end);
    return;
  }
  for (let i = 0; i < count; i += 1) {
    const at = start + step * (chosen ? (chosen[i] as number) : i);
    for (let k = 0; k < itemSize; k += 1) array[end + k] = numbers[at + k] as number;
    end += stride;
  }
}

/** The paint of each vertex: in what positions of 16 bits leave of their rows, else in rows of its own. */
function paintOf(position: Attribute, pieces: readonly Piece[], corners: readonly Corners[]): Attribute {
  const { data, itemSize, array } = position as InterleavedBufferAttribute;
  const isRoom = array instanceof Uint16Array && itemSize < data.stride;
  const to = isRoom ? data : rows(Uint16Array, 1, position.count);
  const offset = isRoom ? itemSize : 0;
  const [paints, stride] = [to.array as Uint16Array, to.stride];
  let at = offset;
  for (const [piece, { count }] of corners.entries()) {
    const paint = pieces[piece]?.paint ?? 0;
    for (const end = at + stride * count; at < end; at += stride) paints[at] = paint;
  }
  return new InterleavedBufferAttribute(to, 1, offset);
}

function rows(Numbers: new (length: number) => TypedArray, itemSize: number, count: number): InterleavedBuffer {
  const { BYTES_PER_ELEMENT } = new Numbers(0);
  const stride = (Math.ceil((itemSize * BYTES_PER_ELEMENT) / ALIGNED) * ALIGNED) / BYTES_PER_ELEMENT;
  return new InterleavedBuffer(new Numbers(stride * count), stride);
}

function indexOf(corners: readonly Corners[], count: number): BufferAttribute {
  const length = corners.reduce((sum, { places }) => sum + places.length, 0);
  const index = count <= MOST_SHORT_VERTICES ? new Uint16Array(length) : new Uint32Array(length);
  let [end, before] = [0, 0];
  for (const { count, places } of corners) {
    for (let i = 0; i < places.length; i += 1) index[end + i] = before + (places[i] as number);
    end += places.length;
    before += count;
  }
  return new BufferAttribute(index, 1);
}
