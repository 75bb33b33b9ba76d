/**
 * How is a model drawn by its impostor? A square that faces the eye, on which each pixel looks for the surface in the three
 * views around the eye's direction and mixes what it finds, as `crates/bake/src/impostors/show.rs` does. What is found has
 * a normal and a depth, so that light, fog and what stands half in the ground are as for the mesh. What each who wears the
 * model colours for itself takes its tint. Frames of a movement lie below each other: they count on as views do.
 *
 * From so near that a pixel of the pictures covers several of the screen, mixing would make ghosts of what is solid, since
 * views disagree by whole pixels: there most of the views decide what is covered, and the nearest one how it looks.
 *
 * Space: the *ball* is the model's space, moved and scaled so that the ball around the model has radius 1.
 */
import { DoubleSide, type IUniform, MeshStandardMaterial, type Texture } from "three";
import type { Impostor } from "../core/documents/impostordocument.ts";

/**
 * From how much coverage on a pixel is drawn: it differs from pixel to pixel, so that of a thin bough as many pixels are
 * drawn as it covers (interleaved gradient noise: Jimenez, Next generation post processing in Call of Duty, 2014).
 */
const LEAST_COVERAGE = { from: 0.08, to: 0.72 };
/** Near is whose pictures' pixels are so large on the screen, wholly from twice as large; objects are drawn by their meshes then. */
const NEAR_PX = 1.5;
/** From how much coverage on a pixel of who is near is drawn. */
const NEAR_COVERAGE = 0.5;
/** How much more the nearest view counts for who is near: weights, which sum to 1, are raised to this power. */
const NEAR_POWER = 8;
/** Of what impostors are made for: leaves, bark, stone. */
const ROUGHNESS = 0.9;

/** What each corner tells the pixels. */
const VARYINGS = /* glsl */ `varying vec2 vPlace;
varying vec2 vDepth;
flat varying vec2 vDepthAlong;
flat varying vec3 vTowards;
flat varying vec4 vViewA;
flat varying vec4 vViewB;
flat varying vec4 vViewC;
flat varying vec3 vViewWeights;
flat varying vec3 vTint;
flat varying mat3 vNormalFromBall;
`;

const VERTEX = /* glsl */ `
attribute vec3 towards;
attribute vec4 viewA;
attribute vec4 viewB;
attribute vec4 viewC;
attribute vec3 viewWeights;
attribute vec3 tint;
uniform vec3 ballCentre;
uniform float ballRadius;
${VARYINGS}`;

/** `right` is level, and +X for an eye right above or below. */
export const AXES = /* glsl */ `
vec3 rightOf(vec3 towards) {
  float level = length(towards.xz);
  return level > 1e-6 ? vec3(towards.z, 0.0, -towards.x) / level : vec3(1.0, 0.0, 0.0);
}
`;

const PLACE_SQUARE = /* glsl */ `
vec3 squareRight = rightOf(towards);
vec3 transformed = ballCentre + ballRadius * (position.x * squareRight + position.y * cross(towards, squareRight));
vPlace = position.xy;
vTowards = towards;
vViewA = viewA;
vViewB = viewB;
vViewC = viewC;
vViewWeights = viewWeights;
vTint = tint;
`;

const PLACE_DEPTH = /* glsl */ `
mat4 viewFromObject = modelViewMatrix * instanceMatrix;
vNormalFromBall = transpose(inverse(mat3(viewFromObject)));
vec4 alongClip = projectionMatrix * viewFromObject * vec4(-ballRadius * towards, 0.0);
vDepth = gl_Position.zw;
vDepthAlong = alongClip.zw;
`;

const FRAGMENT = /* glsl */ `
uniform sampler2D colourAtlas;
uniform sampler2D shapeAtlas;
uniform float atlasViews;
uniform float atlasFrames;
uniform float viewSize;
${VARYINGS}${AXES}
// Sums over the views: coverage, and by what each counts colour, normal in the ball, and how far along the ray.
float seenCoverage = 0.0;
vec4 seenColour = vec4(0.0);
vec3 seenNormal = vec3(0.0);
float seenWay = 0.0;

vec2 inAtlas(vec2 place, vec2 tile, float lod) {
  float border = 0.5 * exp2(ceil(lod)) / viewSize;
  vec2 inView = clamp(vec2(place.x + 1.0, 1.0 - place.y) / 2.0, border, 1.0 - border);
  return (tile + inView) / vec2(atlasViews, atlasViews * atlasFrames);
}

void addView(vec4 view, float weight, vec3 onSquare, float lod, float nearness) {
  vec3 viewTowards = view.xyz;
  vec3 viewRight = rightOf(viewTowards);
  mat3 ballFromView = mat3(viewRight, cross(viewTowards, viewRight), viewTowards);
  vec2 tile = vec2(mod(view.w, atlasViews), floor(view.w / atlasViews));
  vec3 origin = onSquare * ballFromView;
  vec3 along = -vTowards * ballFromView;
  float steepness = min(along.z, -0.2);
  float way = -origin.z / steepness;
  for (int i = 0; i < 2; i += 1) {
    float depth = textureLod(shapeAtlas, inAtlas(origin.xy + way * along.xy, tile, lod), lod).b * 2.0 - 1.0;
    way = (depth - origin.z) / steepness;
  }
  vec2 place = origin.xy + way * along.xy;
  if (max(abs(place.x), abs(place.y)) > 1.0) return;
  vec2 at = inAtlas(place, tile, lod);
  vec4 colour = textureLod(colourAtlas, at, lod);
  vec4 shape = textureLod(shapeAtlas, at, lod);
  colour.rgb *= mix(vTint, vec3(1.0), shape.a);
  vec2 slope = shape.rg * 2.0 - 1.0;
  vec3 normal = vec3(slope, sqrt(max(0.0, 1.0 - dot(slope, slope))));
  seenCoverage += weight * colour.a;
  float share = pow(weight, mix(1.0, ${NEAR_POWER}.0, nearness)) * colour.a;
  seenColour += vec4(share * colour.rgb, share);
  seenNormal += share * (ballFromView * normal);
  seenWay += share * way;
}
`;

const LOOK = /* glsl */ `
float texels = log2(length(fwidth(vPlace)) * 0.5 * viewSize);
float lod = clamp(texels, 0.0, log2(viewSize) - 2.0);
float nearness = clamp(-texels - log2(${NEAR_PX}), 0.0, 1.0);
vec3 squareRight = rightOf(vTowards);
vec3 onSquare = vPlace.x * squareRight + vPlace.y * cross(vTowards, squareRight);
addView(vViewA, vViewWeights.x, onSquare, lod, nearness);
addView(vViewB, vViewWeights.y, onSquare, lod, nearness);
addView(vViewC, vViewWeights.z, onSquare, lod, nearness);
float grain = fract(52.9829189 * fract(dot(floor(gl_FragCoord.xy), vec2(0.06711056, 0.00583715))));
float leastCoverage = mix(mix(${LEAST_COVERAGE.from}, ${LEAST_COVERAGE.to}, grain), ${NEAR_COVERAGE}, nearness);
if (seenCoverage < leastCoverage) discard;
diffuseColor.rgb *= seenColour.rgb / seenColour.a;
float way = seenWay / seenColour.a;
gl_FragDepth = 0.5 + 0.5 * (vDepth.x + way * vDepthAlong.x) / (vDepth.y + way * vDepthAlong.y);
`;

const TURN_NORMAL = /* glsl */ `
vec3 normal = normalize(vNormalFromBall * seenNormal);
vec3 nonPerturbedNormal = normal;
`;

/** What of an impostor is asked for to draw it. */
export type Drawable = Pick<Impostor, "mapping" | "views" | "size_px" | "frames" | "centre" | "radius">;

/** A material that knows its pictures. */
export class ImpostorMaterial extends MeshStandardMaterial {
  /** Besides those of three.js. */
  uniforms: Record<string, IUniform> = {};
}

/** A material that draws unit squares so. Dispose of the textures with it. */
export function impostorMaterial(impostor: Drawable, colour: Texture, shape: Texture): ImpostorMaterial {
  const material = new ImpostorMaterial({ roughness: ROUGHNESS, metalness: 0, side: DoubleSide });
  const uniforms = {
    colourAtlas: { value: colour },
    shapeAtlas: { value: shape },
    atlasViews: { value: impostor.views },
    atlasFrames: { value: impostor.frames },
    viewSize: { value: impostor.size_px },
    ballCentre: { value: impostor.centre },
    ballRadius: { value: impostor.radius },
  };
  material.uniforms = uniforms;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", `#include <common>\n${VERTEX}${AXES}`)
      .replace("#include <begin_vertex>", PLACE_SQUARE)
      .replace("#include <project_vertex>", `#include <project_vertex>\n${PLACE_DEPTH}`);
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${FRAGMENT}`)
      .replace("#include <map_fragment>", LOOK)
      .replace("#include <normal_fragment_begin>", TURN_NORMAL);
  };
  // One program for all of them.
  material.customProgramCacheKey = () => "belvedere-impostor";
  return material;
}
