import {
  FrontSide,
  MeshStandardMaterial,
  ShaderLib,
  type WebGLProgramParametersWithUniforms,
  type WebGLRenderer,
} from "three";
import { expect, it } from "vitest";
import { paintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";

const grey = (roughness: number) => new MeshStandardMaterial({ color: 0x808080, roughness });
const numbersAt = ({ uniform }: Palette, paint: number) =>
  [...(uniform.value.image.data as Float32Array)].slice(8 * paint, 8 * paint + 8);

it("what is painted alike has one paint, exact to what uniforms hold, whatever else its material says", () => {
  const palette = new Palette();
  const lamp = new MeshStandardMaterial({ roughness: 0.3, metalness: 0.7, emissiveIntensity: 4 });
  lamp.color.setRGB(0.1, 0.2, 0.3);
  lamp.emissive.setRGB(0.5, 0.25, 0);
  const [paint, other] = [palette.take(lamp), palette.take(grey(0.5))];
  const twin = lamp.clone();
  twin.name = "twin";
  expect([palette.take(twin), other === paint]).toEqual([paint, false]);
  expect(numbersAt(palette, paint as number)).toEqual([0.1, 0.2, 0.3, 0.3, 2, 1, 0, 0.7].map(Math.fround));
});

it("a paint goes with its last user, and another takes its number", () => {
  const palette = new Palette();
  const [first, again] = [palette.take(grey(0.1)) as number, palette.take(grey(0.1)) as number];
  palette.release(first);
  expect(palette.take(grey(0.2))).not.toBe(first);
  palette.release(again);
  const version = palette.uniform.value.version;
  expect(palette.take(grey(0.3))).toBe(first);
  expect(numbersAt(palette, first)[3]).toBe(Math.fround(0.3));
  expect(palette.uniform.value.version).toBeGreaterThan(version);
});

it("paints stay what they are while the palette grows, and there are no more than numbers", () => {
  const palette = new Palette();
  const numbers = Array.from({ length: 65_536 }, (_, i) => palette.take(grey(i / 65_536)));
  expect(new Set(numbers).size).toBe(65_536);
  const { width, height } = palette.uniform.value.image;
  expect(Math.max(width, height)).toBeLessThanOrEqual(2048);
  for (const i of [0, 300, 65_535]) expect(numbersAt(palette, numbers[i] as number)[3]).toBe(Math.fround(i / 65_536));
  expect(palette.take(grey(2))).toBeUndefined();
  expect(palette.take(grey(0))).toBe(numbers[0]);
  palette.release(numbers[7] as number);
  expect(palette.take(grey(2))).toBe(numbers[7]);
});

it("materials take paints from what the palette has become, and the graphics card frees what it was", () => {
  const palette = new Palette();
  const material = paintMaterial(palette.uniform, { side: FrontSide, vertexColors: false, flatShading: false });
  const { vertexShader, fragmentShader } = ShaderLib.standard;
  const shader = { uniforms: {}, vertexShader, fragmentShader } as unknown as WebGLProgramParametersWithUniforms;
  material.onBeforeCompile(shader, {} as WebGLRenderer);
  const before = palette.uniform.value;
  let freed = 0;
  before.addEventListener("dispose", () => {
    freed += 1;
  });
  for (let i = 0; i < 300; i += 1) palette.take(grey(i / 300));
  expect([freed, palette.uniform.value === before]).toEqual([1, false]);
  expect(shader.uniforms.palette?.value).toBe(palette.uniform.value);
});
