import { ShaderChunk } from "three";
import { expect, it } from "vitest";
import { shade, shaded } from "./shading.ts";

const asTheyCome = { ...ShaderChunk };

it("the sun is looked for in the shadow map, and what falls on thin things lights their other side", () => {
  shade();
  expect(ShaderChunk.shadowmap_pars_fragment).toContain("float lookForSun(");
  const [others = "", directional = ""] = ShaderChunk.lights_fragment_begin.split("DirectionalLight directionalLight;");
  expect(directional.match(/lookForSun\(/g)).toHaveLength(1);
  expect(directional.match(/directDiffuse \+=/g)).toHaveLength(1);
  expect(others).not.toMatch(/lookForSun|directDiffuse/);
  expect(ShaderChunk.lights_fragment_maps.match(/getIBLIrradiance\( - geometryNormal \)/g)).toHaveLength(1);
});

it("that is done once", () => {
  const before = { ...ShaderChunk };
  shade();
  expect(ShaderChunk).toEqual(before);
});

it.each(["lights_fragment_begin", "lights_fragment_maps"] as const)(
  "three.js that works out %s otherwise is not taken for what it was",
  (name) => {
    expect(() => shaded(asTheyCome)).not.toThrow();
    expect(() => shaded({ ...asTheyCome, [name]: "iblIrradiance += 1.0;" })).toThrow(`works out ${name} otherwise`);
  },
);
