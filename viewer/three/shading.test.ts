import { ShaderChunk } from "three";
import { expect, it } from "vitest";
import { shade } from "./shading.ts";

it("the sun is looked for in the shadow map, and what falls on thin things lights their other side", () => {
  shade();
  expect(ShaderChunk.shadowmap_pars_fragment).toContain("float lookForSun(");
  const [others = "", directional = ""] = ShaderChunk.lights_fragment_begin.split("DirectionalLight directionalLight;");
  expect(directional.match(/lookForSun\(/g)).toHaveLength(1);
  expect(directional.match(/directDiffuse \+=/g)).toHaveLength(1);
  expect(others).not.toMatch(/lookForSun|directDiffuse/);
  expect(ShaderChunk.lights_fragment_maps.match(/getIBLIrradiance\( - geometryNormal \)/g)).toHaveLength(1);
});

it("three.js that works it out otherwise is not taken for what it was", () => {
  const before = ShaderChunk.lights_fragment_maps;
  ShaderChunk.lights_fragment_maps = "iblIrradiance += 1.0;";
  try {
    expect(() => shade()).toThrow("lights_fragment");
  } finally {
    ShaderChunk.lights_fragment_maps = before;
  }
});
