import { type DataTexture, DataUtils } from "three";
import { expect, test } from "vitest";
import { mirrored, skylight } from "./skylight.ts";

/** How green a texel of a level's face is, from the top left. */
function green(faces: readonly DataTexture[], face: number, x: number, y: number): number {
  const { data, width } = (faces[face] as DataTexture).image as { data: Uint16Array; width: number };
  return DataUtils.fromHalfFloat(data[4 * (width * y + x) + 1] ?? 0);
}

const levels = () => {
  const texture = skylight();
  const blurred = texture.mipmaps as unknown as { image: DataTexture[] }[];
  return [texture.image as unknown as DataTexture[], ...blurred.map(({ image }) => image)];
};

test("a mirror shows a bright sky above a darker ground, whichever way it faces", () => {
  const [sharp = []] = levels();
  for (const side of [0, 1, 4, 5]) {
    expect(green(sharp, side, 10, 20)).toBeGreaterThan(1.5 * green(sharp, side, 10, 44));
  }
  expect(green(sharp, 2, 32, 32)).toBeGreaterThan(3 * green(sharp, 3, 32, 32));
});

test("what is rougher mirrors more of what is beside the way that it faces", () => {
  const up = [0.1, 0.4, 0.7, 1].map((roughness) => mirrored(roughness, -1)[1]);
  expect(up).toEqual([...up].sort((a, b) => a - b));
  expect(up[3]).toBeGreaterThan(1.1 * (up[0] ?? 0));
});

test("at roughness 1 light is gathered as by a matt surface: by the cosine", () => {
  // The ground is no darker than its darkest part, and what looks aside has as much of it as of the sky.
  const [aside, above, below] = [0, 1, -1].map((sine) => mirrored(1, sine)[1]) as [number, number, number];
  expect(aside).toBeCloseTo((above + below) / 2, 1);
});

test("three.js finds the roughest picture that is drawn with last but one, with faces of eight pixels", () => {
  const all = levels();
  expect(all.map(([face]) => face?.image.width)).toEqual([64, 32, 16, 8, 4]);
  const roughest = all.at(-2) ?? [];
  // Its middle texels look up by less than 1.
  expect(green(roughest, 2, 3, 3)).toBeCloseTo(mirrored(1, 1)[1], 1);
  expect(Math.min(...[0, 2, 3].map((face) => green(roughest, face, 3, 7)))).toBeGreaterThan(0.1);
});
