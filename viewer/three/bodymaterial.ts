/**
 * How is a person drawn from near by? By its corners at two moments, between which they go straight, so that all near people are
 * one draw call however they walk; where clothes are, by the colour that they wear.
 */
import { MeshStandardMaterial } from "three";
import type { Person } from "./person.ts";

/** Numbers of the body at a pose: two moments and a share of the second. */
export const BODY = /* glsl */ `
uniform sampler2D bodyPositions;
uniform sampler2D bodyNormals;
vec3 bodyAt(sampler2D numbers, vec3 pose) {
  vec3 first = texelFetch(numbers, ivec2(gl_VertexID, int(pose.x)), 0).xyz;
  vec3 second = texelFetch(numbers, ivec2(gl_VertexID, int(pose.y)), 0).xyz;
  return mix(first, second, pose.z);
}
`;

const VERTEX = /* glsl */ `
attribute vec3 pose;
attribute vec3 tint;
attribute float own;
varying vec3 vTint;
varying float vOwn;
${BODY}`;

const FRAGMENT = /* glsl */ `
varying vec3 vTint;
varying float vOwn;
`;

/** A material for instances that have a pose and a tint. */
export function bodyMaterial({ positions, normals }: Person): MeshStandardMaterial {
  const material = new MeshStandardMaterial({ vertexColors: true, roughness: 0.85, metalness: 0 });
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { bodyPositions: { value: positions }, bodyNormals: { value: normals } });
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", `#include <common>\n${VERTEX}`)
      .replace("#include <beginnormal_vertex>", "vec3 objectNormal = bodyAt(bodyNormals, pose);")
      .replace(
        "#include <begin_vertex>",
        "vec3 transformed = bodyAt(bodyPositions, pose);\nvTint = tint;\nvOwn = own;",
      );
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${FRAGMENT}`)
      .replace(
        "#include <color_fragment>",
        "#include <color_fragment>\ndiffuseColor.rgb *= mix(vTint, vec3(1.0), vOwn);",
      );
  };
  material.customProgramCacheKey = () => "belvedere-body";
  return material;
}
