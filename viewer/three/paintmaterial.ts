/**
 * How is a surface drawn whose paint each vertex names? As by `MeshStandardMaterial`, but for colour, roughness, emission and metalness,
 * which come from a palette. All vertices of a triangle name the same, so pixels take it as it is, and nothing is mixed.
 */
import { MeshStandardMaterial, type Side, type Texture } from "three";
import { PAINTS_IN_ROW } from "./palette.ts";

/** The attribute of vertices. */
export const PAINT = "paint";

/** What else a material is asked for. */
export interface Finish {
  readonly side: Side;
  readonly vertexColors: boolean;
  readonly flatShading: boolean;
}

const VARYINGS = /* glsl */ `flat varying vec4 vColourRoughness;
flat varying vec4 vEmissionMetalness;
`;

const VERTEX = /* glsl */ `
attribute float ${PAINT};
uniform sampler2D palette;
${VARYINGS}`;

/** Where the palette has the first of a paint's two texels. */
export const PAINT_AT = /* glsl */ `
ivec2 paintAt = ivec2(2 * (int(${PAINT}) % ${PAINTS_IN_ROW}), int(${PAINT}) / ${PAINTS_IN_ROW});
`;

const LOOK_UP = /* glsl */ `${PAINT_AT}vColourRoughness = texelFetch(palette, paintAt, 0);
vEmissionMetalness = texelFetch(palette, paintAt + ivec2(1, 0), 0);
`;

/** A material that knows its palette. */
export class PaintMaterial extends MeshStandardMaterial {
  constructor(
    readonly palette: { readonly value: Texture },
    finish: Finish,
  ) {
    super(finish);
  }
}

/** A material that takes its paints from a palette. */
export function paintMaterial(palette: { readonly value: Texture }, finish: Finish): PaintMaterial {
  const material = new PaintMaterial(palette, finish);
  material.onBeforeCompile = (shader) => {
    shader.uniforms.palette = palette;
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", `#include <common>\n${VERTEX}`)
      .replace("#include <begin_vertex>", `#include <begin_vertex>\n${LOOK_UP}`);
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${VARYINGS}`)
      .replace("#include <color_fragment>", "diffuseColor.rgb = vColourRoughness.rgb;\n#include <color_fragment>")
      .replace("#include <roughnessmap_fragment>", "float roughnessFactor = vColourRoughness.a;")
      .replace("#include <metalnessmap_fragment>", "float metalnessFactor = vEmissionMetalness.a;")
      .replace("#include <emissivemap_fragment>", "totalEmissiveRadiance = vEmissionMetalness.rgb;");
  };
  return material;
}
