/** What does a published document say of an impostor? */
import type { Vec3 } from "../basics/geometry.ts";
import type { Json } from "../basics/json.ts";
import type { FileRef } from "./documents.ts";
import { isMapping, type Mapping } from "./impostors.ts";

/** What a graphics card must be able to hold of an impostor: more is not published today. */
const MOST_VIEWS = 32;
const MOST_SIZE_PX = 128;
const MOST_HEIGHT_PX = 4096;

/** Views of a model from all around, in one atlas. */
export interface Impostor {
  readonly colour: FileRef;
  /** Normals and depths. */
  readonly shape: FileRef;
  readonly mapping: Mapping;
  /** Views along each side of the atlas. */
  readonly views: number;
  /** Pixels along each side of a view. */
  readonly size_px: number;
  /** The ball that every view shows, in the model's space. */
  readonly centre: Vec3;
  readonly radius: number;
  readonly geometricError: number;
  /** Moments of a round of its movement, each an atlas of its own below the one before; 1 for what keeps still. */
  readonly frames: number;
  /** How far it walks in a round, in the model's space; 0 for what keeps still. */
  readonly stride: number;
}

/** An impostor whose mapping is not known here is left alone: there are levels. */
export function readImpostor(json: Json): Impostor | undefined {
  const mapping = json.field("mapping").text();
  if (!isMapping(mapping)) return undefined;
  const [views, size_px] = [json.field("views").count(), json.field("size_px").count()];
  if (views < 2 || views > MOST_VIEWS) json.field("views").fail(`from 2 to ${MOST_VIEWS}`);
  if (size_px < 2 || size_px > MOST_SIZE_PX || !Number.isInteger(Math.log2(size_px))) {
    json.field("size_px").fail(`a power of two up to ${MOST_SIZE_PX}`);
  }
  const frames = json.field("frames").optional((count) => count.count()) ?? 1;
  if (frames < 1 || views * size_px * frames > Math.max(MOST_HEIGHT_PX, views * size_px)) {
    json.field("frames").fail(`from 1 on, at most ${MOST_HEIGHT_PX} pixels high together`);
  }
  const radius = json.field("radius").number();
  if (radius <= 0) json.field("radius").fail("above 0");
  return {
    colour: readFile(json.field("colour")),
    shape: readFile(json.field("shape")),
    mapping,
    views,
    size_px,
    centre: json.field("centre").vec3(),
    radius,
    geometricError: json.field("error_m").number(),
    frames,
    stride: json.field("stride_m").optional((stride) => stride.number()) ?? 0,
  };
}

/** An immutable object and its size. */
export function readFile(json: Json): FileRef {
  return { url: json.field("url").blob(), bytes: json.field("bytes").count() };
}
