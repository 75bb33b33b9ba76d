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

/** Which vertices of a geometry are used, in the order of their first use, and each corner's place among them. */
interface Corners {
  readonly vertices: Uint32Array;
  readonly places: Uint32Array;
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
  const count = corners.reduce((sum, { vertices }) => sum + vertices.length, 0);
  const geometry = new BufferGeometry();
  for (const name of DRAWN_BY) {
    const from = pieces.map((piece) => piece.geometry.getAttribute(name) as Attribute);
    if (from[0]) geometry.setAttribute(name, gathered(from, corners, count));
  }
  geometry.setAttribute(PAINT, paintOf(geometry.getAttribute("position") as Attribute, pieces, corners));
  geometry.setIndex(indexOf(corners, count));
  return geometry;
}

function cornersOf(geometry: BufferGeometry): Corners {
  const { count } = geometry.getAttribute("position");
  const index = geometry.getIndex();
  const from = index?.array ?? Uint32Array.from({ length: count }, (_, i) => i);
  const placeOf = new Int32Array(count).fill(-1);
  const vertices = new Uint32Array(count);
  const places = new Uint32Array(from.length);
  let used = 0;
  for (let i = 0; i < from.length; i += 1) {
    const vertex = from[i] as number;
    if (placeOf[vertex] === -1) {
      placeOf[vertex] = used;
      vertices[used] = vertex;
      used += 1;
    }
    places[i] = placeOf[vertex] as number;
  }
  return { vertices: vertices.subarray(0, used), places };
}

/** An attribute of the vertices that are used. */
function gathered(from: readonly Attribute[], corners: readonly Corners[], count: number): Attribute {
  const [first] = from as [Attribute];
  const to = rows(first.array.constructor as new (length: number) => TypedArray, first.itemSize, count);
  const { array, stride } = to;
  let end = 0;
  corners.forEach(({ vertices }, piece) => {
    const attribute = from[piece] as Attribute;
    const numbers = attribute.array;
    const [start, step] =
      attribute instanceof InterleavedBufferAttribute
        ? [attribute.offset, attribute.data.stride]
        : [0, attribute.itemSize];
    for (const vertex of vertices) {
      const at = start + step * vertex;
      for (let k = 0; k < first.itemSize; k += 1) array[end + k] = numbers[at + k] as number;
      end += stride;
    }
  });
  return new InterleavedBufferAttribute(to, first.itemSize, 0, first.normalized);
}

/** The paint of each vertex: in what positions of 16 bits leave of their rows, else in rows of its own. */
function paintOf(position: Attribute, pieces: readonly Piece[], corners: readonly Corners[]): Attribute {
  const { data, itemSize, array } = position as InterleavedBufferAttribute;
  const isRoom = array instanceof Uint16Array && itemSize < data.stride;
  const to = isRoom ? data : rows(Uint16Array, 1, position.count);
  const offset = isRoom ? itemSize : 0;
  let end = offset;
  corners.forEach(({ vertices }, piece) => {
    for (let i = 0; i < vertices.length; i += 1) {
      to.array[end] = pieces[piece]?.paint ?? 0;
      end += to.stride;
    }
  });
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
  for (const { vertices, places } of corners) {
    for (const place of places) {
      index[end] = before + place;
      end += 1;
    }
    before += vertices.length;
  }
  return new BufferAttribute(index, 1);
}
