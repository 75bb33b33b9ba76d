/** What has grown? Parts that are placed, and what they look like. As `crates/scene/src/procedural/grown.rs`. */
import { type Affine, after, IDENTITY } from "./affine.ts";
import type { Bounds } from "./bounds.ts";
import type { Usage } from "./limits.ts";
import type { Mesh } from "./solid/mesh.ts";

/** A model with all its triangles. */
export interface Grown {
  /** Pieces of geometry; the first is the whole model. They place each other, never in a cycle. */
  readonly parts: readonly Part[];
  readonly materials: readonly Surface[];
  readonly usage: Readonly<Usage>;
}

/** A piece of geometry in its own space. */
export interface Part {
  readonly name: string;
  /** Whether the name is from `called`: then it is also the name of what is placed in it. */
  readonly isCalled: boolean;
  readonly meshes: Mesh[];
  readonly placements: { readonly part: number; readonly frame: Affine }[];
  /** glTF files that it places. */
  readonly models: { readonly path: string; readonly frame: Affine }[];
  /** Where one may look from; along −z, with +y up. */
  readonly viewpoints: { readonly name: string; readonly frame: Affine }[];
  /** What pictures it asks for, to be drawn with from far away. */
  impostor?: Wish;
  /** A box that holds it and all that it places: of glTF files those whose boxes were given. */
  bounds: Bounds;
}

/** Views along a side of the atlas, pixels along a side of a view, whether it is seen from below too, and how it moves. */
export interface Wish {
  readonly views: number;
  readonly size_px: number;
  readonly below: boolean;
  /** Moments of a round of its movement, 1 for what keeps still. */
  readonly frames: number;
  /** How far it walks in a round. */
  readonly stride: number;
}

export type Channels = readonly [number, number, number];

/** A material of the metallic-roughness model; colours are linear light. */
export interface Surface {
  readonly name: string;
  readonly colour: Channels;
  readonly roughness: number;
  readonly metallic: number;
  readonly emissive: Channels;
  readonly opacity: number;
  readonly doubleSided: boolean;
  /** Whether each who wears the model chooses its colour. */
  readonly recolour: boolean;
}

/** What is not painted. */
export const PLAIN: Surface = {
  name: "plain",
  colour: [0.6, 0.6, 0.6],
  roughness: 0.9,
  metallic: 0,
  emissive: [0, 0, 0],
  opacity: 1,
  doubleSided: false,
  recolour: false,
};

/** A part in the world. */
export interface Instance {
  readonly part: number;
  /** What it was called, or its part's name. */
  readonly name: string;
  readonly worldFromPart: Affine;
}

/** Every part in the world, parents before children, also those without triangles of their own. */
export function instancesOf(grown: Grown): Instance[] {
  const instances: Instance[] = [];
  const stack: { part: number; called: string | undefined; frame: Affine }[] = [
    { part: 0, called: undefined, frame: IDENTITY },
  ];
  for (let top = stack.pop(); top; top = stack.pop()) {
    const part = grown.parts[top.part] as Part;
    const called = part.isCalled ? part.name : top.called;
    instances.push({ part: top.part, name: called ?? part.name, worldFromPart: top.frame });
    for (const child of [...part.placements].reverse()) {
      stack.push({ part: child.part, called, frame: after(top.frame, child.frame) });
    }
  }
  return instances;
}
