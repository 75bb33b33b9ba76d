/**
 * What do people look like who wear no model? `content/person.dcg`, grown here at each moment of a round of two steps, and
 * once standing: two kilobytes of rules are what the page carries of it.
 */
import { DataTexture, FloatType, NearestFilter, RGBAFormat } from "three";
import rules from "../../content/person.dcg?raw";
import type { Vec3 } from "../core/basics/geometry.ts";
import type { Round } from "../core/live/crowd.ts";
import { type Grown, grow, type Program, readProgram } from "../core/procedural/index.ts";

/** The body at a moment. */
type Moment = Pick<Grown["parts"][number], "meshes"> &
  Pick<Grown, "materials"> & { readonly impostor: Grown["parts"][number]["impostor"] | undefined };

/** A body whose corners are elsewhere at each moment, the last of which shows it standing. */
export interface Person extends Round {
  /** Of its pictures. */
  readonly views: number;
  readonly size_px: number;
  readonly vertices: number;
  readonly indices: Uint32Array;
  /** Linear light, three for each vertex. */
  readonly colours: Float32Array;
  /** For each vertex 0 where people choose the colour themselves, else 1. */
  readonly own: Float32Array;
  /** A row for each moment, in it a pixel for each vertex. */
  readonly positions: DataTexture;
  readonly normals: DataTexture;
  /** A ball that holds all of it. */
  readonly centre: Vec3;
  readonly radius: number;
}

/** Grows one. */
export function growPerson(): Person {
  const program = readProgram("person.dcg", rules, (path) => {
    throw new Error(`${path} is not here`);
  });
  const standing = grown(program, 0, 0);
  const wish = standing.impostor;
  if (!wish) throw new Error("person.dcg asks for no pictures");
  const walking = Array.from({ length: wish.frames }, (_, frame) => grown(program, frame / wish.frames, 1));
  const moments = [...walking, standing];
  const vertices = standing.meshes.reduce((sum, mesh) => sum + mesh.vertices, 0);
  const positions = rows(moments, "positions", vertices);
  return {
    frames: wish.frames,
    stride_m: wish.stride,
    standing: wish.frames,
    views: wish.views,
    size_px: wish.size_px,
    vertices,
    indices: indicesOf(standing),
    ...paintOf(standing, vertices),
    positions: texture(positions, vertices),
    normals: texture(rows(moments, "normals", vertices), vertices),
    ...ballOf(positions),
  };
}

/** The whole of the rules is one part. */
function grown(program: Program, phase: number, walking: number): Moment {
  const parameters = new Map([
    ["phase", phase],
    ["walking", walking],
  ]);
  const { parts, materials } = grow(program, { parameters });
  const [part] = parts;
  if (!part || parts.length > 1) throw new Error("person.dcg is more than one part");
  return { meshes: part.meshes, impostor: part.impostor, materials };
}

/** The numbers of all moments, four for each vertex. */
function rows(moments: readonly Moment[], of: "positions" | "normals", vertices: number): Float32Array<ArrayBuffer> {
  const all = new Float32Array(4 * vertices * moments.length);
  let at = 0;
  for (const { meshes } of moments) {
    for (const mesh of meshes) {
      const numbers = mesh[of];
      for (let i = 0; i < numbers.length; i += 3) {
        all.set(numbers.subarray(i, i + 3), at);
        at += 4;
      }
    }
  }
  if (at !== all.length) throw new Error("a person has other corners at another moment");
  return all;
}

function indicesOf({ meshes }: Moment): Uint32Array {
  let first = 0;
  const lists = meshes.map(({ indices, vertices }) => {
    const list = [...indices].map((index) => first + index);
    first += vertices;
    return list;
  });
  return Uint32Array.from(lists.flat());
}

function paintOf({ meshes, materials }: Moment, vertices: number): Pick<Person, "colours" | "own"> {
  const [colours, own] = [new Float32Array(3 * vertices), new Float32Array(vertices)];
  let at = 0;
  for (const mesh of meshes) {
    const surface = materials[mesh.material];
    for (let i = 0; i < mesh.vertices; i += 1) {
      colours.set(surface?.colour ?? [], 3 * at);
      own[at] = surface?.recolour ? 0 : 1;
      at += 1;
    }
  }
  return { colours, own };
}

function texture(numbers: Float32Array<ArrayBuffer>, vertices: number): DataTexture {
  const made = new DataTexture(numbers, vertices, numbers.length / (4 * vertices), RGBAFormat, FloatType);
  made.minFilter = NearestFilter;
  made.magFilter = NearestFilter;
  made.needsUpdate = true;
  return made;
}

/** Around the middle of the box of all moments. */
function ballOf(positions: Float32Array): { centre: Vec3; radius: number } {
  const low = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY];
  const high = low.map((x) => -x);
  const corner = (i: number, axis: number) => positions[4 * i + axis] ?? 0;
  const count = positions.length / 4;
  for (let i = 0; i < count; i += 1) {
    for (const axis of [0, 1, 2]) {
      low[axis] = Math.min(low[axis] ?? 0, corner(i, axis));
      high[axis] = Math.max(high[axis] ?? 0, corner(i, axis));
    }
  }
  const centre = low.map((x, axis) => (x + (high[axis] ?? 0)) / 2) as unknown as Vec3;
  let radius = 0;
  for (let i = 0; i < count; i += 1) {
    const away = [0, 1, 2].map((axis) => corner(i, axis) - (centre[axis as 0 | 1 | 2] ?? 0));
    radius = Math.max(radius, Math.hypot(...away));
  }
  return { centre, radius };
}
