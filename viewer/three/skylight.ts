/**
 * What light comes from all around, and what do metals mirror? The light of a veiled sky and of the ground below it, which changes with
 * height only. So it is worked out here, for each height, and no picture of it need be drawn: a small cube map whose levels are spread
 * wider and wider, as three.js has them of its `PMREMGenerator`, which draws for longer than phones and software take for a whole picture.
 *
 * Spread by the GGX lobe of each roughness, seen from right above (Karis, *Real Shading in Unreal Engine 4*, 2013); at roughness 1 that
 * is the cosine by which a matt surface gathers light.
 */
import { Color, CubeTexture, DataTexture, DataUtils, HalfFloatType } from "three";

type Light = readonly [number, number, number];
/** Sines of heights, from the zenith down to the nadir, and the light from there. */
type Lights = readonly (readonly [number, Light])[];

/** Cool above, bright in the haze, warm from the ground. */
const LIGHTS: Lights = [
  [1, light(0xb9c5d6)],
  [0.45, light(0xbcc6d2)],
  [0.03, light(0xdfe1e0)],
  [-0.03, light(0x9c9384)],
  [-0.45, light(0x655d51)],
  [-1, light(0x5a5147)],
];
/** A face of the sharpest level; each further one has half of that. */
const SIZE_PX = 64;
/** Levels that are drawn with: the last has faces of 8 pixels, and roughness 1. */
const LEVELS = 4;
/** Of a lobe, in its width and around it. */
const SAMPLES = { wide: 12, around: 12 };
/** Heights for which a lobe is worked out; between them light changes evenly. */
const HEIGHTS = 33;
/** Heights between which texels do not differ. */
const STEPS = 512;

function light(hex: number): Light {
  const { r, g, b } = new Color(hex);
  return [r, g, b];
}

/** The light from a height; between those that are known it changes evenly. */
function lightFrom(sine: number, lights: Lights): Light {
  const next = Math.max(
    1,
    lights.findIndex(([height]) => height <= sine),
  );
  const [[high, above], [low, below]] = [lights[next - 1], lights[next]] as [Lights[number], Lights[number]];
  const share = (sine - low) / (high - low);
  const mix = (i: 0 | 1 | 2) => below[i] + share * (above[i] - below[i]);
  return [mix(0), mix(1), mix(2)];
}

/** What a surface of this roughness mirrors whose normal has this sine, seen along that. */
export function mirrored(roughness: number, sine: number): Light {
  const cosine = Math.sqrt(1 - sine * sine);
  const sum: [number, number, number] = [0, 0, 0];
  let weights = 0;
  for (let i = 0; i < SAMPLES.wide; i += 1) {
    // Normals of facets as often as GGX has them; light comes from twice as far away.
    const share = (i + 0.5) / SAMPLES.wide;
    const away = 2 * Math.acos(Math.sqrt((1 - share) / (1 + (roughness ** 4 - 1) * share)));
    const [along, across] = [Math.cos(away), Math.sin(away)];
    if (along <= 0) continue;
    for (let j = 0; j < SAMPLES.around; j += 1) {
      const turn = (Math.PI * (j + 0.5)) / SAMPLES.around;
      const from = lightFrom(along * sine + across * Math.cos(turn) * cosine, LIGHTS);
      for (const i of [0, 1, 2] as const) sum[i] += along * from[i];
      weights += along;
    }
  }
  return [sum[0] / weights, sum[1] / weights, sum[2] / weights];
}

/** The roughness that a level is for; three.js finds the level by the inverse of this. */
function roughnessOf(level: number): number {
  return 1 - Math.sqrt(1 - level / (LEVELS - 1));
}

/** The lights of a level, by height. */
function lightsOf(level: number): Lights {
  const roughness = roughnessOf(level);
  if (roughness === 0) return LIGHTS;
  return Array.from({ length: HEIGHTS }, (_, i) => 1 - (2 * i) / (HEIGHTS - 1)).map((sine) => [
    sine,
    mirrored(roughness, sine),
  ]);
}

/** The texels of a level, by height from the nadir up. */
function texelsOf(level: number): Uint16Array {
  const lights = lightsOf(level);
  const texels = new Uint16Array(4 * (STEPS + 1));
  for (let i = 0; i <= STEPS; i += 1) {
    texels.set([...lightFrom((2 * i) / STEPS - 1, lights), 1].map(DataUtils.toHalfFloat), 4 * i);
  }
  return texels;
}

/** Faces of a level, in the order of cube maps: two to the sides, that above, that below, and two more. */
function facesOf(level: number): DataTexture[] {
  const size = SIZE_PX >> level;
  const byHeight = texelsOf(level);
  const faceOf = (height: (down: number) => number) => {
    const texels = new Uint16Array(4 * size * size);
    for (let y = 0; y < size; y += 1) {
      for (let x = 0; x < size; x += 1) {
        const [across, down] = [(2 * x + 1) / size - 1, (2 * y + 1) / size - 1];
        const sine = height(down) / Math.sqrt(1 + across * across + down * down);
        const from = 4 * Math.round(((sine + 1) / 2) * STEPS);
        for (let i = 0; i < 4; i += 1) texels[4 * (size * y + x) + i] = byHeight[from + i] ?? 0;
      }
    }
    return new DataTexture(texels, size, size);
  };
  const side = faceOf((down) => -down);
  return [side, side, faceOf(() => 1), faceOf(() => -1), side, side];
}

/** The light as what stands in it mirrors it. */
export function skylight(): CubeTexture {
  const [sharpest = [], ...others] = Array.from({ length: LEVELS }, (_, level) => facesOf(level));
  const texture = new CubeTexture(sharpest);
  // three.js counts levels as if the sharpest stood among these, and never looks at the last.
  texture.mipmaps = [...others, sharpest.map(() => emptyFace(SIZE_PX >> LEVELS))].map(
    (faces) => new CubeTexture(faces),
  );
  texture.isPMREMTexture = true;
  texture.type = HalfFloatType;
  texture.generateMipmaps = false;
  texture.needsUpdate = true;
  return texture;
}

function emptyFace(size: number): DataTexture {
  return new DataTexture(new Uint16Array(4 * size * size), size, size);
}
