/**
 * What of the light do we work out otherwise than three.js? Shadows of the sun, which lie in tiles of several widths around the eye, and
 * thin things, those that are seen from both sides: what falls on one side of a leaf or an awning lights the other, too.
 *
 * Tiles: each covers a square across the rays of the sun with the same centre, and is wider than the one before it by the same factor.
 * A pixel is looked up in the finest tile that has it; towards a tile's edge that goes over into the next, and beyond the widest there is
 * no shadow. (Zhang et al., *Parallel-split shadow maps for large-scale virtual environments*, 2006; squares around the eye instead of
 * slices of the view, so that they stay when one turns.)
 */
import { ShaderChunk } from "three";

/** Tiles stand above each other in the shadow map, the finest first. */
export const TILES = 3;
export const TILE_PX = 1024;
/** How many times as wide as the tile before it each one is. */
export const TILE_GROWTH = 4;
/** How far the map reaches along the rays from its centre, each way, in halves of the widest tile. */
export const DEPTH_REACH = 1.5;

/** A tile is used up to here, and from there on together with the next: shares of the way from its centre to its edge. */
const [TILE_END, BLEND_FROM] = [0.97, 0.8];
/** How far apart the looks at a shadow are, in texels: that wide is its soft edge on either side. */
const SOFT_PX = 1.1;
/** Nothing is in its own shadow: it is lifted by so many texels towards the sun, and by so many more for each that it falls away in one. */
const LIFT_PX = { level: 0.8, slope: 1.6, most: 8 };
/** How much of the light on one side of a thin thing comes through: of the sun and of the sky. */
const THROUGH = { sun: 0.4, sky: 0.45 };

const SHADOW = /* glsl */ `
#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
float lookAtTile(sampler2DShadow map, vec2 fromCentre, float depth, float slope, int tile, float growth) {
  float lift = min(${float(LIFT_PX.level)} + ${float(LIFT_PX.slope)} * slope, ${float(LIFT_PX.most)});
  // Beyond what the map reaches all is lit that nothing stands before: depths of floating point are compared as they are.
  vec3 at = vec3(growth * fromCentre + 0.5, min(depth - lift / (growth * ${float(TILE_PX * DEPTH_REACH)}), 1.0));
  at.y = (at.y + float(tile)) / ${float(TILES)};
  vec2 step = ${float(SOFT_PX / TILE_PX)} * vec2(1.0, 1.0 / ${float(TILES)});
  float lit = 0.0;
  for (int i = -1; i <= 1; i += 1) {
    for (int j = -1; j <= 1; j += 1) {
      float weight = float((2 - abs(i)) * (2 - abs(j))) / 16.0;
      lit += weight * texture(map, at + vec3(step * vec2(i, j), 0.0));
    }
  }
  return lit;
}

// How much of the sun is left; cosine is that of the angle between its rays and the normal.
float lookForSun(sampler2DShadow map, float intensity, vec3 at, float cosine) {
  vec2 fromCentre = at.xy - 0.5;
  float away = 2.0 * max(abs(fromCentre.x), abs(fromCentre.y));
  if (intensity == 0.0 || away > 1.0) return 1.0;
  float slope = sqrt(1.0 - cosine * cosine) / max(cosine, 0.05);
  int tile = 0;
  float growth = ${float(TILE_GROWTH ** (TILES - 1))};
  while (tile < ${TILES - 1} && growth * away > ${float(TILE_END)}) {
    tile += 1;
    growth /= ${float(TILE_GROWTH)};
  }
  float lit = lookAtTile(map, fromCentre, at.z, slope, tile, growth);
  float wider = smoothstep(${float(BLEND_FROM)}, ${float(TILE_END)}, growth * away);
  if (wider > 0.0) {
    float other = 1.0;
    if (tile < ${TILES - 1}) other = lookAtTile(map, fromCentre, at.z, slope, tile + 1, growth / ${float(TILE_GROWTH)});
    lit = mix(lit, other, wider);
  }
  return mix(1.0, lit, intensity);
}
#endif
`;

const SUN_LEFT =
  "lookForSun( directionalShadowMap[ i ], directionalLightShadow.shadowIntensity, vDirectionalShadowCoord[ i ].xyz, abs( dot( geometryNormal, directLight.direction ) ) )";

const DIRECTIONAL = "DirectionalLight directionalLight;";

const LIGHT_FALLS =
  "RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );";

/** Light from behind, as of a matt surface. */
const SUN_THROUGH = /* glsl */ `
#if defined( DOUBLE_SIDED ) && defined( STANDARD )
reflectedLight.directDiffuse += ${float(THROUGH.sun)} * saturate( - dot( geometryNormal, directLight.direction ) ) * directLight.color * BRDF_Lambert( material.diffuseContribution );
#endif
`;

const SKY_FALLS = "iblIrradiance += getIBLIrradiance( geometryNormal );";

const SKY_THROUGH = /* glsl */ `
#ifdef DOUBLE_SIDED
iblIrradiance += ${float(THROUGH.sky)} * getIBLIrradiance( - geometryNormal );
#endif
`;

function float(number: number): string {
  return Number.isInteger(number) ? `${number}.0` : String(number);
}

/** The parts of programs that are worked out otherwise. */
type Chunks = Pick<typeof ShaderChunk, "shadowmap_pars_fragment" | "lights_fragment_begin" | "lights_fragment_maps">;

/** Has all programs that are made from now on work out light so; once. */
export function shade(): void {
  if (!ShaderChunk.shadowmap_pars_fragment.includes(SHADOW)) Object.assign(ShaderChunk, shaded(ShaderChunk));
}

/** These parts, changed; throws where they are not as they are known here. */
export function shaded(chunks: Chunks): Chunks {
  // Lights that shine from one direction stand behind all others.
  const begin = edit(chunks, "lights_fragment_begin", /getShadow\( directionalShadowMap[^:]*\)(?= : 1\.0)/, SUN_LEFT);
  const [others, directional = ""] = begin.split(DIRECTIONAL);
  const lit = edit(
    { lights_fragment_begin: directional },
    "lights_fragment_begin",
    LIGHT_FALLS,
    LIGHT_FALLS + SUN_THROUGH,
  );
  return {
    shadowmap_pars_fragment: chunks.shadowmap_pars_fragment + SHADOW,
    lights_fragment_begin: others + DIRECTIONAL + lit,
    lights_fragment_maps: edit(chunks, "lights_fragment_maps", SKY_FALLS, SKY_FALLS + SKY_THROUGH),
  };
}

function edit<K extends keyof Chunks>(chunks: Pick<Chunks, K>, name: K, what: string | RegExp, by: string): string {
  const before: string = chunks[name];
  const after = before.replace(what, () => by);
  if (after === before) throw new Error(`three.js works out ${name} otherwise than it is known here`);
  return after;
}
